//! Messages about single tokens.

use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::span::Span;

pub(crate) const STRAY_CHARACTER: Code = Code { id: "E0101", name: "stray-character" };
pub(crate) const UNTERMINATED_STRING: Code = Code { id: "E0102", name: "unterminated-string" };
pub(crate) const UNTERMINATED_COMMENT: Code = Code { id: "E0103", name: "unterminated-comment" };
pub(crate) const INT_TOO_LARGE: Code = Code { id: "E0104", name: "int-too-large" };
pub(crate) const NUMBER_SUFFIX: Code = Code { id: "E0105", name: "number-suffix" };
pub(crate) const RESERVED_WORD: Code = Code { id: "E0106", name: "reserved-word" };
pub(crate) const TRIPLE_UNDERSCORE: Code = Code { id: "E0107", name: "triple-underscore" };
pub(crate) const CHAR_LITERAL: Code = Code { id: "E0108", name: "char-literal" };

/// E0101: a character outside the language.
pub(crate) fn stray_character(span: Span, text: &str) -> Diagnostic {
    let d = Diagnostic::error(STRAY_CHARACTER, span, format!("stray `{}`", text.escape_debug()))
        .label("not a character of OSL outside strings and comments");
    match text {
        "\u{201c}" | "\u{201d}" => d.help("strings take the plain quote `\"`"),
        "\u{a0}" => d.help("this is a no-break space: type a plain one"),
        "\u{2212}" | "\u{2013}" => d.help("the minus sign is `-`"),
        _ => d,
    }
}

/// E0102: a string that is not closed on its line.
pub(crate) fn unterminated_string(span: Span) -> Diagnostic {
    Diagnostic::error(UNTERMINATED_STRING, span, "unterminated string")
        .label("the line ends before the closing quote")
        .help("close it with `\"`; a string goes on in the next line only after a backslash")
}

/// E0103: a comment that is not closed.
pub(crate) fn unterminated_comment(span: Span, end: Span) -> Diagnostic {
    Diagnostic::error(UNTERMINATED_COMMENT, span, "this comment never ends")
        .label("opened here")
        .also(end, "`*/` is missing before the end of the file")
}

/// E0104: an int literal beyond 32 bits.
pub(crate) fn int_too_large(span: Span, text: &str) -> Diagnostic {
    Diagnostic::error(INT_TOO_LARGE, span, format!("int literal `{text}` does not fit into 32 bits"))
        .label("too large")
        .note("decimal literals go up to 2147483648, hexadecimal ones up to 0xffffffff; both wrap to negative values")
}

/// E0105: letters after a number.
pub(crate) fn number_suffix(span: Span, suffix: Span, number: &str, text: &str) -> Diagnostic {
    let d = Diagnostic::error(NUMBER_SUFFIX, span, format!("`{text}` behind the number `{number}`"))
        .label("not a number of OSL");
    if matches!(text, "f" | "F" | "l" | "L" | "u" | "U") && suffix != span {
        d.note("OSL numbers have no suffix: every real literal is a float")
            .fix("remove the suffix", vec![Edit { span: suffix, text: String::new() }])
    } else {
        d
    }
}

/// E0101: `@P`.
pub(crate) fn bound_name(span: Span) -> Diagnostic {
    stray_character(span, "@")
        .help("a name needs no mark: the global variables are `P`, `N`, `u`, `v` and so on")
        .fix("remove the `@`", vec![Edit { span, text: String::new() }])
}

/// E0101: a color as in web pages.
pub(crate) fn hex_color(span: Span, digits: &str) -> Diagnostic {
    let width = digits.len() / 3;
    let part = |n: usize| {
        let digits = digits.get(n * width..(n + 1) * width).unwrap_or_default();
        let value = u32::from_str_radix(digits, 16).unwrap_or_default();
        let part = f64::from(value) / f64::from(16u32.pow(width as u32) - 1);
        (part * 1e4).round() / 1e4
    };
    let text = format!("color(\"sRGB\", {}, {}, {})", part(0), part(1), part(2));
    Diagnostic::error(STRAY_CHARACTER, span, "OSL has no colors of hexadecimal digits")
        .label("not a color of OSL")
        .help("the parts of a color go from 0 to 1; color pickers mean the space \"sRGB\"")
        .fix(format!("write `{text}`"), vec![Edit { span, text }])
}

/// E0106: a reserved word; `inside` a function or a shader, or its parameters, with the start of the next
/// word if one space is between them.
pub(crate) fn reserved_word(span: Span, word: &str, inside: Option<Option<u32>>) -> Diagnostic {
    let d = Diagnostic::error(RESERVED_WORD, span, format!("`{word}` is a reserved word"))
        .label("cannot be used");
    match word {
        "bool" => d.help("use `int`: 0 is false, anything else true"),
        "true" => d.help("write 1"),
        "false" => d.help("write 0"),
        "double" => d.help("OSL has `float`, of 32 bits"),
        "long" | "short" | "char" | "unsigned" | "signed" => d.help("use `int`, of 32 bits"),
        "const" | "static" | "uniform" | "varying" | "inline" if inside.is_some() => {
            let d = d.help("leave it out");
            match inside.flatten() {
                Some(next) => {
                    let edit = Edit { span: Span::new(span.start, next), text: String::new() };
                    d.suggest("leave it out", vec![edit])
                }
                None => d,
            }
        }
        "const" | "static" | "uniform" | "varying" => d.help(
            "leave it out before a function; OSL has no global variables: make it a parameter of the shader, or a macro",
        ),
        "inline" => d.help("leave it out"),
        "extern" => d.help("leave it out; the global variables of OSL need no declaration"),
        "switch" | "case" | "default" => d.help("use a chain of `if` and `else if`"),
        "enum" => d.help("use ints, and macros for their names: `#define RED 0`"),
        "class" | "union" | "template" => d.help("OSL has `struct`, without functions of its own"),
        "sizeof" => d.help("the length of an array is `arraylength(a)`"),
        "typedef" => d.help("OSL has no names for types: a macro may stand for one, `#define real float`"),
        _ => d,
    }
}

/// E0107: a name that begins with three underscores.
pub(crate) fn triple_underscore(span: Span, name: &str) -> Diagnostic {
    Diagnostic::error(TRIPLE_UNDERSCORE, span, format!("`{name}` begins with three underscores"))
        .label("such names belong to the compiler")
}

/// E0108: single quotes.
pub(crate) fn char_literal(span: Span, text: &str) -> Diagnostic {
    let d = Diagnostic::error(CHAR_LITERAL, span, "OSL has no character literals")
        .label("single quotes")
        .help("write a string, with `\"`");
    let inner = text.strip_prefix('\'').and_then(|text| text.strip_suffix('\''));
    match inner.filter(|inner| !inner.contains(['"', '\\', '\n'])) {
        Some(inner) => {
            let text = format!("\"{inner}\"");
            d.fix(format!("write {text}"), vec![Edit { span, text }])
        }
        None => d,
    }
}
