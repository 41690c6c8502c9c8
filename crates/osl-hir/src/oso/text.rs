//! How the format writes types, numbers, strings, and the names of nested variables.

use crate::hir::GLOBALS;
use osl_syntax::ast::{BinaryOp, ShaderKind};
use std::fmt::Write;
use std::sync::Arc;

/// The first word of the first line.
pub(super) const HEADER: &str = "OpenShadingLanguage";
/// The name of the section with the shader's body.
pub(super) const MAIN: &str = "___main___";
/// Stands for "never" in the range of operations that read or write a symbol.
pub(super) const NEVER: (i64, i64) = (i32::MAX as i64, -1);

/// Operations that are operators of the language.
pub(super) const OPERATORS: &[(&str, BinaryOp)] = &[
    ("add", BinaryOp::Add),
    ("sub", BinaryOp::Sub),
    ("mul", BinaryOp::Mul),
    ("div", BinaryOp::Div),
    ("mod", BinaryOp::Mod),
    ("eq", BinaryOp::Eq),
    ("neq", BinaryOp::Ne),
    ("lt", BinaryOp::Lt),
    ("le", BinaryOp::Le),
    ("gt", BinaryOp::Gt),
    ("ge", BinaryOp::Ge),
    ("shl", BinaryOp::Shl),
    ("shr", BinaryOp::Shr),
    ("bitand", BinaryOp::BitAnd),
    ("bitor", BinaryOp::BitOr),
    ("xor", BinaryOp::BitXor),
    ("and", BinaryOp::And),
    ("or", BinaryOp::Or),
];

/// The kind of shader for a word.
pub(super) fn shader_kind(word: &str) -> Option<ShaderKind> {
    Some(match word {
        "shader" => ShaderKind::Generic,
        "surface" => ShaderKind::Surface,
        "displacement" => ShaderKind::Displacement,
        "volume" => ShaderKind::Volume,
        _ => return None,
    })
}

/// The index of a global among [`GLOBALS`].
pub(super) fn global(name: &str) -> Option<usize> {
    GLOBALS.iter().position(|(_, n, ..)| *n == name)
}

/// The name in the source, without the number of the scope in front, `___12_i`.
pub(super) fn plain_name(name: &str) -> &str {
    let stripped = name.strip_prefix("___").and_then(|rest| {
        let (number, plain) = rest.split_once('_')?;
        let digits = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        (digits && !plain.is_empty()).then_some(plain)
    });
    stripped.unwrap_or(name)
}

/// The contents of a string literal as characters.
pub(super) fn unescape(text: &str) -> Arc<str> {
    if !text.contains('\\') {
        return text.into();
    }
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        if c != '\\' {
            out.push(c);
            continue;
        }
        match chars.next() {
            Some('n') => out.push('\n'),
            Some('t') => out.push('\t'),
            Some('r') => out.push('\r'),
            Some('b') => out.push('\u{8}'),
            Some('f') => out.push('\u{c}'),
            Some('v') => out.push('\u{b}'),
            Some('a') => out.push('\u{7}'),
            Some(first @ '0'..='7') => {
                // Up to three octal digits.
                let mut code = first as u32 - '0' as u32;
                for _ in 0..2 {
                    let Some(digit) = chars.peek().and_then(|c| c.to_digit(8)) else { break };
                    code = code * 8 + digit;
                    chars.next();
                }
                out.extend(char::from_u32(code));
            }
            Some(other) => out.push(other),
            None => out.push('\\'),
        }
    }
    out.into()
}

/// A string as a literal.
pub(super) fn quote(text: &str, out: &mut String) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            '\u{8}' => out.push_str("\\b"),
            '\u{c}' => out.push_str("\\f"),
            c if (c as u32) < 32 || c as u32 == 127 => {
                let _ = write!(out, "\\{:03o}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
}

/// A float with at most nine digits, as `%.9g` writes it: reading it gives the same bits. The format has no
/// word for infinity, but numbers beyond the largest float mean it, and none for NaN, which becomes 0.
pub(super) fn number(x: f32) -> String {
    if !x.is_finite() || x == 0.0 {
        return match x {
            x if x == f32::INFINITY => "1e39".to_string(),
            x if x == f32::NEG_INFINITY => "-1e39".to_string(),
            x if x.is_sign_negative() => "-0".to_string(),
            _ => "0".to_string(),
        };
    }
    let scientific = format!("{:.8e}", f64::from(x));
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trim = |digits: &str| match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => digits.to_string(),
    };
    if (-4..9).contains(&exponent) {
        let decimals = (8 - exponent).max(0) as usize;
        return trim(&format!("{:.decimals$}", f64::from(x)));
    }
    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", trim(mantissa), exponent.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_nine_digits_and_come_back() {
        let cases = [
            (0.2, "0.200000003"),
            (1.0, "1"),
            (-0.0, "-0"),
            (2.9, "2.9000001"),
            (1e30, "1.00000002e+30"),
            (1e-7, "1.00000001e-07"),
            (123_456_790.0, "123456792"),
            (1.25e9, "1.25e+09"),
            (f32::NEG_INFINITY, "-1e39"),
        ];
        for (x, text) in cases {
            assert_eq!(number(x), text);
        }
        let mut bits = 1u32;
        for _ in 0..10_000 {
            bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let x = f32::from_bits(bits);
            let back: f32 = number(x).parse().unwrap_or(7.0);
            assert!(back.to_bits() == x.to_bits() || x.is_nan() && back == 0.0, "{x:e}");
        }
    }

    #[test]
    fn strings_come_back() {
        for text in ["", "plain", "a \"b\" \\ {c}", "line\nnext\ttab\r\u{7}\u{1b}9", "größe"] {
            let mut quoted = String::new();
            quote(text, &mut quoted);
            assert!(quoted.bytes().all(|b| b >= 32), "{quoted}");
            assert_eq!(&*unescape(&quoted[1..quoted.len() - 1]), text);
        }
    }

    #[test]
    fn names_lose_their_scope() {
        let names = ["i", "___344_i", "___i", "___3_", "___a_b", "___1___2_i", "$tmp1"].map(plain_name);
        assert_eq!(names, ["i", "i", "___i", "___3_", "___a_b", "__2_i", "$tmp1"]);
    }
}
