//! A report as text.

use super::search::is_minor;
use super::{Claim, Output, Report, Verdict, What};
use crate::words::{said, trimmed};
use std::fmt::Write;

/// The report.
pub fn text(report: &Report) -> String {
    let mut out = String::new();
    let domain: Vec<String> = report
        .domain
        .iter()
        .map(|range| match range.from == range.to {
            true => format!("{} = {}", range.name, range.from),
            false => format!("{} in [{}, {}]", range.name, range.from, range.to),
        })
        .collect();
    let tiles = if report.tiles == 1 { "1 tile".to_string() } else { format!("{} tiles", report.tiles) };
    let _ = writeln!(
        out,
        "{}: bounds for all points with {} ({tiles}){}",
        report.shader,
        domain.join(", "),
        said(&report.left_out)
    );
    for (at, output) in report.outputs.iter().enumerate() {
        let before = at.checked_sub(1).and_then(|at| report.outputs.get(at));
        if before.is_none_or(|before| before.name != output.name) {
            let _ = writeln!(out, "\n{}", output.name);
        }
        let _ = writeln!(out, "  {}", component(output));
    }
    let list = |verdict: Verdict| -> Vec<&Claim> {
        report.claims.iter().filter(|claim| claim.verdict == verdict && !is_minor(claim)).collect()
    };
    for (verdict, title) in
        [(Verdict::Wrong, "Wrong"), (Verdict::NotProven, "Not proven"), (Verdict::Proven, "Proven")]
    {
        let claims = list(verdict);
        if !claims.is_empty() {
            let _ = writeln!(out, "\n{title}:");
        }
        for claim in claims {
            say(&mut out, claim, report);
        }
    }
    let minor = report.claims.iter().filter(|claim| is_minor(claim)).count();
    if minor > 0 {
        let s = if minor == 1 { "" } else { "s" };
        let _ = writeln!(out, "\nProven of {minor} operation{s} on ints: the result never overflows");
    }
    if report.is_cut {
        let _ = writeln!(out, "\nThe search ended early; a larger --budget or --tiles may prove more");
    }
    out
}

/// Bounds from here on say only that a value is finite.
const HUGE: f64 = 3.4e38;

/// The values of a component, and what is known of NaN.
fn component(output: &Output) -> String {
    let (lowest, highest) = (output.lowest, output.highest);
    let any = if output.is_finite { "may have any finite value" } else { "may have any value" };
    let name = if output.component.is_empty() { String::new() } else { format!("{} ", output.component) };
    let rounded = |x: f64, down: bool| if output.is_int { x.to_string() } else { outward(x, down) };
    let is_nan = lowest > highest && output.never_nan != Verdict::Proven;
    let range = match (lowest, highest) {
        _ if is_nan => "is always NaN".to_string(),
        (lo, hi) if lo > hi => "has no value".to_string(),
        (lo, hi) if lo == hi => format!("is always {}", rounded(lo, true)),
        (lo, hi) if lo <= -HUGE && hi >= HUGE => any.to_string(),
        (lo, hi) if hi >= HUGE => format!("is at least {}", rounded(lo, true)),
        (lo, hi) if lo <= -HUGE => format!("is at most {}", rounded(hi, false)),
        (lo, hi) => format!("stays in [{}, {}]", rounded(lo, true), rounded(hi, false)),
    };
    let nan = match output.never_nan {
        _ if output.is_int || is_nan => "",
        Verdict::Proven => ", never NaN",
        Verdict::Wrong => ", is NaN at some points",
        Verdict::NotProven => ", may be NaN",
    };
    let reached = match output.reached {
        Some([lo, hi]) if lo != hi || output.lowest != output.highest => {
            let [from, to] = if output.is_int { [lo, hi].map(|x| x.to_string()) } else { inward(lo, hi) };
            format!("; points reach [{from}, {to}]")
        }
        _ => String::new(),
    };
    format!("{name}{range}{nan}{reached}")
}

/// A number with few digits, rounded down or up, so that the statement stays true.
fn outward(x: f64, down: bool) -> String {
    if x == 0.0 || !x.is_finite() || (x == x.trunc() && x.abs() < 1e7) {
        return format!("{}", x + 0.0);
    }
    let digits = 5 - decimal_exponent(x);
    // The nearest number to this power of ten, on every machine.
    let scale: f64 = format!("1e{}", digits.clamp(-300, 300)).parse().unwrap_or(1.0);
    let rounded = if down { (x * scale).floor() } else { (x * scale).ceil() } / scale;
    if rounded.abs() < 1e-4 || rounded.abs() >= 1e7 {
        return short(&format!("{rounded:.5e}"));
    }
    let places = digits.clamp(0, 12) as usize;
    trimmed(&format!("{rounded:.places$}")).to_string()
}

/// Two floats with few digits, rounded towards each other; with all digits if there is no such number between
/// them.
fn inward(lo: f64, hi: f64) -> [String; 2] {
    let ends = [outward(lo, false), outward(hi, true)];
    match ends.each_ref().map(|end| end.parse::<f64>()) {
        [Ok(from), Ok(to)] if from > to => [lo, hi].map(|x| format!("{}", x as f32)),
        _ => ends,
    }
}

/// The exponent of a number in decimal notation, as it prints.
fn decimal_exponent(x: f64) -> i32 {
    let text = format!("{x:e}");
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

/// A number with an exponent, without zeros at the end of its digits.
fn short(text: &str) -> String {
    let Some((digits, exponent)) = text.split_once('e') else { return text.to_string() };
    format!("{}e{exponent}", trimmed(digits))
}

/// A statement, with the line of the source.
fn say(out: &mut String, claim: &Claim, report: &Report) {
    let Claim { quote, values, verdict, .. } = claim;
    let _ = write!(out, "  {}:{}: `{}`: ", quote.file, quote.line, quote.code);
    let _ = write!(out, "{}", words(&claim.what, *verdict));
    match (values, &claim.what) {
        (Some([lo, hi]), what) if !matches!(what, What::Power) => {
            let _ = match (*lo, *hi) {
                (f64::NEG_INFINITY, f64::INFINITY) => write!(out, " (nothing is known of it)"),
                (lo, hi) if lo == hi => write!(out, " ({})", outward(lo, true)),
                (lo, hi) => write!(out, " ({} to {})", outward(lo, true), outward(hi, false)),
            };
        }
        _ => {}
    }
    if let Some(at) = &claim.at {
        let names = report.domain.iter().map(|range| &range.name);
        let at: Vec<String> = names.zip(at).map(|(name, x)| format!("{name} = {x}")).collect();
        let _ = write!(out, ", for example at {}", at.join(", "));
    }
    out.push('\n');
}

/// What holds, or does not.
fn words(what: &What, verdict: Verdict) -> String {
    let (never, may) = match what {
        What::Divisor => ("the divisor is never 0", "the divisor may be 0"),
        What::Root => ("the argument is never negative", "the argument may be negative"),
        What::Logarithm => ("the argument is always positive", "the argument may be 0 or negative"),
        What::Arc => ("the argument is never outside of -1 to 1", "the argument may be outside of -1 to 1"),
        What::Power => ("the power always has a value", "the power may have no value"),
        What::Direction => ("the vector is never zero", "the vector may be zero"),
        What::Edges => ("the edges are always in order", "the edges may be out of order"),
        What::Conversion => ("the number always fits an int", "the number may not fit an int"),
        What::Overflow => ("the result never overflows", "the result may overflow"),
        What::Index(_) => ("the index is always in range", "the index may be out of range"),
    };
    match verdict {
        Verdict::Proven => never.to_string(),
        Verdict::NotProven => may.to_string(),
        Verdict::Wrong => match what {
            What::Divisor => "the divisor is 0",
            What::Root => "the argument is negative",
            What::Logarithm => "the argument is 0 or negative",
            What::Arc => "the argument is outside of -1 to 1",
            What::Power => "the power has no value",
            What::Direction => "the vector is zero",
            What::Edges => "the edges are out of order",
            What::Conversion => "the number does not fit an int",
            What::Overflow => "the result overflows",
            What::Index(_) => "the index is out of range",
        }
        .to_string(),
    }
}
