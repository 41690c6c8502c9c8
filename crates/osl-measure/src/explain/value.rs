//! Values as text.

use crate::trace::{Exact, Node};
use osl_ir::ir::Const;
use pxfm::f_log10;
use serde::Serialize;

/// A value for display.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// As a run computes it.
    pub value: String,
    /// In double precision.
    pub exact: String,
    /// Decimal digits that the two values share, in the worst component. Absent if all digits of single
    /// precision agree, or if the value is NaN or infinite.
    pub digits: Option<f64>,
}

impl Shown {
    /// The value of a node.
    pub fn of(node: &Node) -> Shown {
        let value = node.strict.as_ref().map_or_else(|| "(not computed)".to_string(), show);
        let exact = node.exact.as_ref().map_or_else(|| "(not computed)".to_string(), show_exact);
        Shown { value, exact, digits: node_digits(node) }
    }

    /// A single-precision value that is exact.
    pub fn single(value: &Const) -> Shown {
        Shown { value: show(value), exact: show_exact(&Exact::widen(value)), digits: None }
    }
}

/// The fewest shared decimal digits of any component; `None` if all agree to single precision.
fn node_digits(node: &Node) -> Option<f64> {
    let (strict, exact) = (node.strict.as_ref()?, node.exact.as_ref()?);
    let (a, b) = (Exact::widen(strict).numbers(), exact.numbers());
    if matches!(exact, Exact::Int(_)) {
        return (a != b).then_some(0.0);
    }
    let least = a.iter().zip(&b).filter_map(|(a, b)| digits(*a, *b));
    least.reduce(f64::min)
}

/// Decimal digits that a single-precision value shares with the exact one; `None` if it is one of the two
/// neighbours of the exact value, so that nothing is lost.
pub fn digits(strict: f64, exact: f64) -> Option<f64> {
    if strict == exact || (strict.is_nan() && exact.is_nan()) {
        return None;
    }
    if !strict.is_finite() || !exact.is_finite() {
        return Some(0.0);
    }
    let error = (strict - exact).abs();
    let size = strict.abs().max(exact.abs());
    if error <= size * f64::from(f32::EPSILON) / 2.0 {
        return None;
    }
    Some((-f_log10(error / size)).max(0.0))
}

/// Characters of a string that are shown.
const MAX_TEXT: usize = 200;

/// A string in quotes, cut if it is too long to read.
fn quoted(text: &str) -> String {
    match text.char_indices().nth(MAX_TEXT) {
        Some((end, _)) => format!("{:?}…", &text[..end]),
        None => format!("{text:?}"),
    }
}

fn show(value: &Const) -> String {
    match value {
        Const::Int(n) => n.to_string(),
        Const::Str(s) => quoted(s),
        Const::Null => "null".to_string(),
        Const::Float(x) => short(f64::from(*x), 6),
        Const::Triple(t) => format!("({})", t.map(|x| short(f64::from(x), 6)).join(" ")),
        Const::Matrix(m) => format!("[{}]", m.map(|x| short(f64::from(x), 6)).join(" ")),
    }
}

fn show_exact(value: &Exact) -> String {
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
    }

    #[test]
    fn digits_in_common_are_of_the_larger() {
        assert_eq!(digits(1.0, 1.0), None);
        assert_eq!(digits(1.0, 1.0 + 1e-9), None);
        assert!((digits(1.0, 1.001).unwrap() - 3.0).abs() < 0.01);
        assert_eq!(digits(f64::NAN, 1.0), Some(0.0));
        assert_eq!(digits(0.0, 1e-20), Some(0.0));
    }
}
