//! Slips found in published shaders that cannot change the meaning: warnings by default, errors with the same
//! code under strict syntax.

use crate::diagnostic::{Code, Diagnostic, Edit, Severity};
use crate::span::Span;

pub(crate) const STRAY_BRACE: Code = Code { id: "W0101", name: "stray-brace" };
pub(crate) const BROKEN_STRING: Code = Code { id: "W0102", name: "broken-string" };
pub(crate) const TRAILING_COMMA: Code = Code { id: "W0103", name: "trailing-comma" };
pub(crate) const STRAY_SEMICOLON: Code = Code { id: "W0104", name: "stray-semicolon" };
pub(crate) const COMMA_OPERATOR: Code = Code { id: "W0105", name: "comma-operator" };

/// A warning that becomes an error under strict syntax.
pub(super) fn quirk(strict: bool, code: Code, span: Span, message: impl Into<String>) -> Diagnostic {
    let mut d = Diagnostic::warning(code, span, message);
    if strict {
        d.severity = Severity::Error;
    }
    d
}

fn remove(d: Diagnostic, what: &str, span: Span) -> Diagnostic {
    d.fix(format!("remove the {what}"), vec![Edit { span, text: String::new() }])
}

/// W0101: `}` right before the shader, with nothing open.
pub(crate) fn stray_brace(strict: bool, span: Span) -> Diagnostic {
    let d = quirk(strict, STRAY_BRACE, span, "stray `}` before the shader").label("closes nothing");
    remove(d, "brace", span)
}

/// W0102: a string literal over several lines.
pub(crate) fn broken_string(strict: bool, span: Span, repaired: String) -> Diagnostic {
    quirk(strict, BROKEN_STRING, span, "string literal broken over lines")
        .label("a string ends on its line")
        .note("read with one space for each line break")
        .fix("join the lines", vec![Edit { span, text: repaired }])
}

/// W0103: a comma after the last argument or initialiser.
pub(crate) fn trailing_comma(strict: bool, span: Span) -> Diagnostic {
    let d = quirk(strict, TRAILING_COMMA, span, "trailing comma").label("nothing follows it");
    remove(d, "comma", span)
}

/// W0104: `;` after the body of a function or shader.
pub(crate) fn stray_semicolon(strict: bool, span: Span) -> Diagnostic {
    let d = quirk(strict, STRAY_SEMICOLON, span, "stray `;` between declarations")
        .label("only a struct ends with one");
    remove(d, "semicolon", span)
}

/// W0105: `(a, b)`. The reference accepts it too, with a warning.
pub(crate) fn comma_operator(span: Span) -> Diagnostic {
    Diagnostic::warning(COMMA_OPERATOR, span, "comma operator inside parentheses")
        .label("its value is the last part alone")
        .help("for a color, point, vector or normal, write the type before the parenthesis")
}
