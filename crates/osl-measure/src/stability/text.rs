//! The report of an examination as text: `right for scale up to 1000`, then each line to blame with a caret.

use super::lines::WORST;
use super::{Culprit, List, Report, Setting};
use crate::quote::Quote;
use crate::words::said;
use crate::words::short;
use std::fmt::Write;

/// Lines shown by default.
const SHOWN: usize = 5;

/// Lines below this share of the worst line's score are left out.
const NEXT_TO_NOTHING: f64 = 1e-3;

/// The text: findings, the lines to blame with carets, and with `all` the outcome of every trial.
pub fn text(report: &Report, all: bool) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{}: stability, with points wrong that are {}{}\n",
        report.shader,
        wrong_is(report),
        said(&report.left_out)
    );
    for finding in &report.findings {
        let _ = writeln!(out, "  {}", finding.text);
    }
    if let Some(said) = not_examined(report) {
        let _ = writeln!(out, "  {said}");
    }
    if let Some(said) = nothing(report) {
        let _ = writeln!(out, "\n{said}");
    }
    let mut explains = true;
    for List { title, lines, are_errors } in report.lists() {
        let _ = writeln!(out, "\n{title}:");
        if are_errors && std::mem::take(&mut explains) {
            let _ = writeln!(out, "({})", errors_are());
        }
        let count = if all { lines.len() } else { SHOWN };
        let least = if all { 0.0 } else { lines.first().map_or(0.0, |c| c.score * NEXT_TO_NOTHING) };
        for culprit in lines.iter().take(count).filter(|c| c.score > least) {
            line(culprit, &mut out);
            if are_errors {
                let indent = culprit.line.to_string().len();
                let error = short(culprit.error, 2);
                let _ = writeln!(out, "  {} = {error} of the output's range", " ".repeat(indent));
            }
        }
    }
    if all {
        table(report, &mut out);
    }
    out
}

/// Which points are wrong, in words.
pub(super) fn wrong_is(report: &Report) -> String {
    format!("off by more than {} of the range", short(report.tolerance, 2))
}

/// What was not examined, in words, if the time was over.
pub(super) fn not_examined(report: &Report) -> Option<String> {
    (!report.not_examined.is_empty()).then(|| {
        format!(
            "the time was over (--budget) before these were examined: {}; what was examined depends on the machine",
            report.not_examined.join(", ")
        )
    })
}

/// What is said if no line is to blame, unless the truth is not known.
pub(super) fn nothing(report: &Report) -> Option<&'static str> {
    let is_known = !report.not_examined.iter().any(|part| part == super::examine::LINES);
    let is_none = report.culprits.is_empty() && report.not_enough.is_none();
    is_none.then_some(match is_known {
        true => "Nothing to blame.",
        false => "The time was over before lines could be blamed.",
    })
}

/// What the errors of lines are, in words.
pub(super) fn errors_are() -> String {
    format!("an error is the mean over the followed points: up to {WORST} with the largest errors")
}

fn line(culprit: &Culprit, out: &mut String) {
    let Culprit { file, line, column, text, code, .. } = culprit.clone();
    let quote = Quote { file, line, column, text, code };
    let _ = writeln!(
        out,
        "\n{}:{}: `{}` {} ({})",
        quote.file, quote.line, quote.code, culprit.why, culprit.setting
    );
    quote.write(out);
}

fn table(report: &Report, out: &mut String) {
    let _ = writeln!(
        out,
        "\n{:<22} {:<18} {:>8} {:>8} {:>9} {:>9} {:>8} {:>8}  range",
        "setting", "output", "NaN %", "inf %", "rms", "worst", "wrong %", "flips %"
    );
    for trial in &report.trials {
        let setting = trial.setting.text();
        if let Some(why) = &trial.stopped {
            let _ = writeln!(out, "{setting:<22} stopped: {why}");
        }
        for o in &trial.outcomes {
            let _ = writeln!(
                out,
                "{:<22} {:<18} {:>8} {:>8} {:>9} {:>9} {:>8} {:>8}  {} to {}",
                setting,
                o.output,
                short(o.nan * 100.0, 3),
                short(o.infinite * 100.0, 3),
                short(o.rms, 2),
                short(o.worst, 2),
                short(o.wrong * 100.0, 3),
                short(o.flipped * 100.0, 3),
                short(o.range[0], 4),
                short(o.range[1], 4)
            );
        }
    }
}

/// Whether a setting is of a sweep of coordinates.
pub(super) fn is_decade(setting: &Setting) -> Option<(&'static str, f64)> {
    match setting {
        Setting::Offset { by } => Some(("offset", *by)),
        Setting::Scale { by } => Some(("scale", *by)),
        Setting::Footprint { by } => Some(("footprint", *by)),
        Setting::AsGiven | Setting::Param { .. } => None,
    }
}
