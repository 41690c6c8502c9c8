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

/// E0106: a reserved word.
pub(crate) fn reserved_word(span: Span, word: &str) -> Diagnostic {
    let d = Diagnostic::error(RESERVED_WORD, span, format!("`{word}` is a reserved word"))
        .label("cannot be used");
    match word {
        "bool" => d.help("use `int`: 0 is false, anything else true"),
        "true" => d.help("write 1"),
        "false" => d.help("write 0"),
        "double" => d.help("use `float`"),
        "const" | "static" | "uniform" | "varying" | "inline" | "extern" => d.help("leave it out"),
        "switch" | "case" => d.help("use a chain of `if` … `else if`"),
        _ => d,
    }
}

/// E0107: a name that begins with three underscores.
pub(crate) fn triple_underscore(span: Span, name: &str) -> Diagnostic {
    Diagnostic::error(TRIPLE_UNDERSCORE, span, format!("`{name}` begins with three underscores"))
        .label("such names belong to the compiler")
}

/// E0108: single quotes.
pub(crate) fn char_literal(span: Span) -> Diagnostic {
    Diagnostic::error(CHAR_LITERAL, span, "OSL has no character literals")
        .label("single quotes")
        .help("write a string, with `\"`")
}
