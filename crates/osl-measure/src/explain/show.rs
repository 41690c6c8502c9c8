//! Values and numbers as text, short enough to read. A closure is only there or not.

use crate::trace::Exact;
use osl_ir::ir::Const;
use pxfm::f_log10;

/// Characters of a string that are shown.
const MAX_TEXT: usize = 200;

/// A string in quotes, cut if it is too long to read.
fn quoted(text: &str) -> String {
    match text.char_indices().nth(MAX_TEXT) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

pub(super) fn show(value: &Const) -> String {
    match value {
        Const::Int(n) => n.to_string(),
        Const::Str(s) => quoted(s),
        Const::Null => "null".to_string(),
        Const::Float(x) => number(f64::from(*x)),
        Const::Triple(t) => format!("({})", t.map(|x| number(f64::from(x))).join(" ")),
        Const::Matrix(m) => format!("[{}]", m.map(|x| number(f64::from(x))).join(" ")),
    }
}

/// A number in single precision: six digits, or all before the point as long as a float has them.
pub(super) fn number(x: f64) -> String {
    if (1e6..1e8).contains(&x.abs()) { format!("{x:.0}") } else { short(x, 6) }
}

pub(super) fn show_exact(value: &Exact) -> String {
    match value {
        Exact::Int(n) => n.to_string(),
        Exact::Str(s) => quoted(s),
        Exact::Closure(some) => if *some { "closure" } else { "null" }.to_string(),
        Exact::Float(x) => short(*x, 10),
        Exact::Triple(t) => format!("({})", t.map(|x| short(x, 10)).join(" ")),
        Exact::Matrix(m) => format!("[{}]", m.map(|x| short(x, 10)).join(" ")),
    }
}

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

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let cases = [
            (0.5, "0.5"),
            (1.0 / 3.0, "0.333333"),
            (-2.0, "-2"),
            (1e-7, "1e-7"),
            (123_456_789.0, "1.23457e8"),
        ];
        for (x, text) in cases {
            assert_eq!(short(x, 6), text);
        }
        assert_eq!(short(f64::NAN, 6), "NaN");
        assert_eq!(
            [1e6, -1_000_000.625, 16_777_216.0, 1e8].map(number),
            ["1000000", "-1000001", "16777216", "1e8"]
        );
        assert_eq!([173.2, 8.24, -2817.0, 1.0e7].map(|x| plain(x, 2)), ["170", "8.2", "-2800", "1e7"]);
    }
}
