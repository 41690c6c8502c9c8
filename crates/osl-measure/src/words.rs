//! Numbers in words, and what the first line of each report says is not examined.

use osl_ir::ir::{Body, Kernel, Kind, Op};
use osl_ir::types::Base;
use pxfm::f_log10;

/// A number with some significant digits, without trailing zeros.
pub(crate) fn short(x: f64, digits: usize) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let power = f_log10(x.abs()).floor();
    if !(-5.0..f64::from(digits as u32)).contains(&power) {
        let text = format!("{x:.*e}", digits.saturating_sub(1));
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{exponent}", trimmed(mantissa));
    }
    let places = (digits as f64 - 1.0 - power).clamp(0.0, 17.0) as usize;
    trimmed(&format!("{x:.places$}")).to_string()
}

/// The same without an exponent below a million.
pub(crate) fn plain(x: f64, digits: usize) -> String {
    let text = short(x, digits);
    if !(1.0..1e6).contains(&x.abs()) {
        return text;
    }
    text.parse::<f64>().map_or(text, |rounded| rounded.to_string())
}

/// A share as a percentage.
pub(crate) fn percent(share: f64) -> String {
    let percent = share * 100.0;
    if percent >= 10.0 { format!("{percent:.0} %") } else { format!("{} %", short(percent, 2)) }
}

/// Names in a sentence, with a word before the last one.
pub(crate) fn listed<T: AsRef<str>>(names: &[T], word: &str) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match &names[..] {
        [rest @ .., last] if !rest.is_empty() => format!("{} {word} {last}", rest.join(", ")),
        names => names.concat(),
    }
}

/// A number without zeros at the end of its fraction.
pub(crate) fn trimmed(text: &str) -> &str {
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        text
    }
}

/// Where the bracket closes in which a text begins; the text may go on after it, or be read backwards.
pub(crate) fn closes(text: impl Iterator<Item = (usize, char)>, open: char, close: char) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, c) in text {
        if c == close && depth == 0 {
            return Some(at);
        }
        depth = depth + usize::from(c == open) - usize::from(c == close);
    }
    None
}

/// What is not examined of a lowered program, in words: strings, and parameters of closures that are no
/// numbers.
pub(crate) fn left_out(body: &Body) -> Vec<String> {
    let strings = body.outputs.iter().filter(|output| output.ty.base == Base::String);
    let mut all: Vec<String> = strings.map(|output| format!("the string `{}`", output.name)).collect();
    let constants: Vec<_> = body.constants().map(|(value, _)| value).collect();
    let closes = body.outputs.iter().any(|output| output.ty.base == Base::Closure);
    for inst in body.insts().filter(|_| closes) {
        let Op::Kernel(Kernel::Component { name, .. }, args) = &inst.op else { continue };
        for (at, arg) in args.iter().enumerate().filter(|(_, arg)| !constants.contains(arg)) {
            let what = match body.kind(*arg) {
                Kind::Int => "an int",
                Kind::Matrix => "a matrix",
                Kind::Str => "a string",
                Kind::Float | Kind::Triple | Kind::Closure => continue,
            };
            let said = format!("argument {} of `{name}`, which is {what}", at + 1);
            if !all.contains(&said) {
                all.push(said);
            }
        }
    }
    all
}

/// The end of the first line of a report.
pub(crate) fn said(left_out: &[String]) -> String {
    if left_out.is_empty() { String::new() } else { format!("; not examined: {}", left_out.join(", ")) }
}
