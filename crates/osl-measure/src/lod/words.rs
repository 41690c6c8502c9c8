//! Numbers in words and as expressions of the language.

use crate::stability::fix::term::word;
use crate::words::{plain, trimmed};
use osl_ir::types::Type;

/// A number of samples.
pub(super) fn samples(n: u32) -> String {
    if n == 1 { "one sample".to_string() } else { format!("{n} samples") }
}

/// A share as percent with two digits.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", plain(100.0 * share, 2))
}

/// A value as an expression of this type: with so many digits that they lose nothing of a range. None if the
/// value is not finite.
pub(super) fn value(ty: Type, means: &[f64], range: f64) -> Option<String> {
    if !means.iter().all(|x| x.is_finite()) {
        return None;
    }
    Some(match (word(ty), means) {
        (Some(word), [x, y, z]) => {
            let [x, y, z] = [x, y, z].map(|x| number(*x, range));
            if x == y && y == z { format!("{word}({x})") } else { format!("{word}({x}, {y}, {z})") }
        }
        (_, [x, ..]) if ty == Type::INT => {
            let most = f64::from(i32::MAX);
            format!("{:.0}", x.clamp(-most, most))
        }
        (_, [x, ..]) => number(*x, range),
        (_, []) => "0".to_string(),
    })
}

/// A number with about four digits of a range, and with at most the digits of a float.
fn number(x: f64, range: f64) -> String {
    let mut text = trimmed(&format!("{:?}", x as f32)).to_string();
    if range > 0.0 && range.is_finite() {
        let mut digits = 0;
        let mut unit = 1e-3 * range;
        while unit < 1.0 && digits < 30 {
            unit *= 10.0;
            digits += 1;
        }
        let rounded = format!("{x:.digits$}");
        let rounded = trimmed(&rounded);
        if rounded.len() <= text.len() {
            text = rounded.to_string();
        }
    }
    let is_int_text = !text.contains(['.', 'e']);
    if is_int_text && x.abs() > f64::from(i32::MAX) {
        // Without a point, this would be an int out of range.
        text.push_str(".0");
    }
    if text == "-0" { "0".to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_short_and_lose_nothing_of_the_range() {
        let cases: [(Type, &[f64], f64, &str); 13] = [
            (Type::FLOAT, &[0.123_456], 1.0, "0.123"),
            (Type::FLOAT, &[-0.000_01], 1.0, "0"),
            (Type::FLOAT, &[123.456], 500.0, "123.5"),
            (Type::FLOAT, &[0.001_234_56], 0.01, "0.00123"),
            (Type::COLOR, &[0.5, 0.5, 0.5], 1.0, "color(0.5)"),
            (Type::COLOR, &[0.5, 0.25, 0.0], 1.0, "color(0.5, 0.25, 0)"),
            (Type::FLOAT, &[f64::from(1e30_f32)], 0.0, "1e30"),
            (Type::FLOAT, &[f64::from(1.234_567e30_f32)], 1e33, "1.234567e30"),
            (Type::FLOAT, &[f64::from(-3e9_f32)], 0.0, "-3000000000.0"),
            (Type::FLOAT, &[f64::from(0.1_f32)], 1e-30, "0.1"),
            (Type::FLOAT, &[f64::from(1.5e-45_f32)], 0.0, "1e-45"),
            (Type::INT, &[1e10], 5.0, "2147483647"),
            (Type::INT, &[-7.0], 0.0, "-7"),
        ];
        for (ty, means, range, text) in cases {
            assert_eq!(value(ty, means, range).as_deref(), Some(text), "{means:?} in {range}");
        }
        assert_eq!(value(Type::FLOAT, &[f64::NAN], 1.0), None);
        assert_eq!(value(Type::COLOR, &[0.0, f64::INFINITY, 0.0], 1.0), None);
    }
}
