//! Messages of the preprocessor.

use crate::diagnostic::{Code, Diagnostic, Edit};
use crate::source::SourceFile;
use crate::span::Span;

pub(crate) const INCLUDE_NOT_FOUND: Code = Code { id: "E0001", name: "include-not-found" };
pub(crate) const INCLUDE_DEPTH: Code = Code { id: "E0002", name: "include-depth" };
pub(crate) const INCLUDE_COUNT: Code = Code { id: "E0003", name: "include-count" };
pub(crate) const BAD_DIRECTIVE: Code = Code { id: "E0004", name: "bad-directive" };
pub(crate) const UNKNOWN_DIRECTIVE: Code = Code { id: "E0005", name: "unknown-directive" };
pub(crate) const BAD_DEFINE: Code = Code { id: "E0006", name: "bad-define" };
pub(crate) const MACRO_ARGUMENTS: Code = Code { id: "E0007", name: "macro-arguments" };
pub(crate) const UNTERMINATED_INVOCATION: Code = Code { id: "E0008", name: "unterminated-invocation" };
pub(crate) const BAD_PASTE: Code = Code { id: "E0009", name: "bad-paste" };
pub(crate) const CONDITION: Code = Code { id: "E0010", name: "bad-condition" };
pub(crate) const UNBALANCED_CONDITIONAL: Code = Code { id: "E0011", name: "unbalanced-conditional" };
pub(crate) const UNTERMINATED_CONDITIONAL: Code = Code { id: "E0012", name: "unterminated-conditional" };
pub(crate) const ERROR_DIRECTIVE: Code = Code { id: "E0013", name: "error-directive" };
pub(crate) const EXPANSION_BUDGET: Code = Code { id: "E0014", name: "expansion-budget" };
pub(crate) const EXPANSION_DEPTH: Code = Code { id: "E0015", name: "expansion-depth" };
pub(crate) const TOKEN_BUDGET: Code = Code { id: "E0016", name: "token-budget" };
pub(crate) const TOO_LARGE: Code = Code { id: "E0017", name: "too-large" };
pub(crate) const PRAGMA_ERROR: Code = Code { id: "E0018", name: "pragma-error" };
pub(crate) const MACRO_REDEFINED: Code = Code { id: "W0001", name: "macro-redefined" };
pub(crate) const WARNING_DIRECTIVE: Code = Code { id: "W0002", name: "warning-directive" };
pub(crate) const PRAGMA_WARNING: Code = Code { id: "W0003", name: "pragma-warning" };
pub(crate) const UNKNOWN_OSL_PRAGMA: Code = Code { id: "W0004", name: "unknown-osl-pragma" };
pub(crate) const NESTED_COMMENT: Code = Code { id: "W0005", name: "nested-comment" };
pub(crate) const NOT_UTF8: Code = Code { id: "W0006", name: "not-utf8" };

/// E0001: the provider has no such file; whether the name is in quotes, and the closest name.
pub(crate) fn include_not_found(
    span: Span,
    name: &str,
    reason: &str,
    (quoted, close): (bool, Option<&str>),
) -> Diagnostic {
    let d = Diagnostic::error(INCLUDE_NOT_FOUND, span, format!("cannot include \"{name}\": {reason}"))
        .label("asked for here");
    // Only if the name is in one piece.
    let in_one_piece = (span.end - span.start) as usize == name.len() + 2;
    match close.filter(|_| in_one_piece) {
        Some(close) => {
            let text = if quoted { format!("\"{close}\"") } else { format!("<{close}>") };
            d.help(format!("there is one named `{close}`"))
                .suggest(format!("write `{text}`"), vec![Edit { span, text }])
        }
        None => d.help("add the folder that holds it to the include path (-I)"),
    }
}

/// E0002: files that include each other endlessly.
pub(crate) fn include_depth(span: Span, name: &str, limit: u64) -> Diagnostic {
    Diagnostic::error(INCLUDE_DEPTH, span, format!("\"{name}\" is included more than {limit} levels deep"))
        .label("this level is not read")
        .note("a file that includes itself, directly or through others, never ends")
        .help("guard the file with `#pragma once` or with `#ifndef NAME` … `#endif`")
}

/// E0003: too many inclusions in all.
pub(crate) fn include_count(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(INCLUDE_COUNT, span, format!("more than {limit} inclusions"))
        .label("no further file is read")
        .help("guard the files with `#pragma once` or with `#ifndef NAME` … `#endif`")
}

/// E0004: a directive with invalid syntax.
pub(crate) fn bad_directive(span: Span, directive: &str, form: &str) -> Diagnostic {
    Diagnostic::error(BAD_DIRECTIVE, span, format!("malformed `#{directive}`"))
        .label(format!("expected `#{directive} {form}`"))
}

/// E0005: an unknown directive; `comment`: words follow it, as in a comment of Python; `hash` is its `#`.
pub(crate) fn unknown_directive(span: Span, name: &str, hash: Option<Span>) -> Diagnostic {
    let known = [
        "include", "define", "undef", "if", "ifdef", "ifndef", "elif", "else", "endif", "error", "warning",
        "line", "pragma",
    ];
    let d = Diagnostic::error(UNKNOWN_DIRECTIVE, span, format!("unknown directive `#{name}`"))
        .label("not a directive of the preprocessor");
    match (crate::spelling::closest(name, known), hash) {
        (Some(k), _) => d.help(format!("did you mean `#{k}`?")),
        (None, Some(span)) => d
            .help("a comment begins with `//`")
            .suggest("make it a comment", vec![Edit { span, text: "//".to_owned() }]),
        _ if ["version", "extension", "import"].contains(&name) => {
            d.help("a shader of OSL has no such line: leave it out")
        }
        _ => d,
    }
}

/// E0006: an invalid definition: its name, its parameters or its body.
pub(crate) fn bad_define(span: Span, what: &str) -> Diagnostic {
    Diagnostic::error(BAD_DEFINE, span, format!("malformed macro definition: {what}")).label("here")
}

/// E0007: the wrong number of arguments to a macro.
pub(crate) fn macro_arguments(
    span: Span,
    name: &str,
    wanted: &str,
    got: usize,
    definition: Span,
) -> Diagnostic {
    Diagnostic::error(MACRO_ARGUMENTS, span, format!("macro `{name}` takes {wanted}, got {got}"))
        .label(format!("{got} given"))
        .also(definition, "defined here")
}

/// E0008: `NAME(` without its `)`.
pub(crate) fn unterminated_invocation(span: Span, name: &str) -> Diagnostic {
    Diagnostic::error(UNTERMINATED_INVOCATION, span, format!("the arguments of macro `{name}` never end"))
        .label("its `(` has no `)`")
}

/// E0009: `##` made an invalid token.
pub(crate) fn bad_paste(span: Span, left: &str, right: &str) -> Diagnostic {
    Diagnostic::error(BAD_PASTE, span, format!("`##` of `{left}` and `{right}` does not make one token"))
        .label("pasted here")
}

/// E0010: an `#if` with an invalid expression.
pub(crate) fn condition(span: Span, why: &str) -> Diagnostic {
    Diagnostic::error(CONDITION, span, format!("cannot evaluate the condition: {why}"))
        .label("here")
        .note("a condition is an integer expression of literals, macros and `defined(NAME)`")
}

/// E0011: `#else`, `#elif` or `#endif` without an `#if`.
pub(crate) fn unbalanced_conditional(span: Span, directive: &str, opened: Option<Span>) -> Diagnostic {
    let d = Diagnostic::error(
        UNBALANCED_CONDITIONAL,
        span,
        match opened {
            None => format!("`#{directive}` without `#if`"),
            Some(_) => format!("`#{directive}` after `#else`"),
        },
    )
    .label("continues no condition");
    match opened {
        None => d,
        Some(at) => d.also(at, "the `#else`"),
    }
}

/// E0012: a conditional without an `#endif`.
pub(crate) fn unterminated_conditional(span: Span, end: Span) -> Diagnostic {
    Diagnostic::error(UNTERMINATED_CONDITIONAL, span, "this conditional never ends")
        .label("opened here")
        .also(end, "`#endif` is missing before the end of the file")
}

/// The message of a directive that reports something: its own words if it has any.
fn own_words(directive: &str, message: String, words: &str) -> String {
    if words.trim().is_empty() { format!("a `{directive}` without a text") } else { message }
}

/// E0013: `#error`.
pub(crate) fn error_directive(span: Span, text: &str) -> Diagnostic {
    let message = own_words("#error", format!("#error: {text}"), text);
    Diagnostic::error(ERROR_DIRECTIVE, span, message).label("reported by the source itself")
}

/// E0014: macros that grow endlessly.
pub(crate) fn expansion_budget(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(EXPANSION_BUDGET, span, format!("macro expansion makes more than {limit} tokens"))
        .label("given up here")
        .note("macros that double each other grow without bound")
}

/// E0015: macro calls in macro arguments, nested too deeply.
pub(crate) fn expansion_depth(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(EXPANSION_DEPTH, span, format!("macro calls nested more than {limit} levels deep"))
        .label("not expanded any further")
}

/// E0016: a translation unit with too many tokens.
pub(crate) fn token_budget(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(
        TOKEN_BUDGET,
        span,
        format!("the file has more than {limit} tokens after preprocessing"),
    )
    .label("nothing from here on is read")
}

/// E0016: a translation unit whose tokens are too long.
pub(crate) fn token_bytes(span: Span, limit: u64) -> Diagnostic {
    let message = format!("the tokens of the file have more than {limit} bytes after preprocessing");
    Diagnostic::error(TOKEN_BUDGET, span, message)
        .label("nothing from here on is read")
        .note("a macro repeats a long name or string at each of its uses")
}

/// E0017: files that are included too often, or that are too large together.
pub(crate) fn included_bytes(span: Span, limit: u64) -> Diagnostic {
    Diagnostic::error(TOO_LARGE, span, format!("all included files together may hold {limit} bytes"))
        .label("no further file is read")
        .note("a file counts as often as it is included")
        .help("guard the files with `#pragma once`")
}

/// E0017: the sources together exceed 4 GiB.
pub(crate) fn too_large(span: Span, name: &str) -> Diagnostic {
    Diagnostic::error(TOO_LARGE, span, format!("{name} does not fit: all sources together may hold 4 GiB"))
        .label("not read")
}

/// E0017: a single file that is too large.
pub(crate) fn file_too_large(span: Span, name: &str, limit: u64) -> Diagnostic {
    let text = match limit >> 20 {
        0 => format!("{name} does not fit: a file may hold {limit} bytes"),
        mib => format!("{name} does not fit: a file may hold {mib} MiB"),
    };
    Diagnostic::error(TOO_LARGE, span, text).label("not read")
}

/// E0018: `#pragma error`.
pub(crate) fn pragma_error(span: Span, text: &str) -> Diagnostic {
    let message = own_words("#pragma error", text.to_owned(), text);
    Diagnostic::error(PRAGMA_ERROR, span, message).label("reported by the source itself")
}

/// W0001: a second, different definition. Fatal in the reference.
pub(crate) fn macro_redefined(strict: bool, span: Span, name: &str, first: Span) -> Diagnostic {
    super::quirk(strict, MACRO_REDEFINED, span, format!("macro `{name}` is defined again with another body"))
        .label("the new body counts from here")
        .also(first, "first defined here")
        .help(format!("put `#undef {name}` before the new definition"))
}

/// W0002: `#warning`. Fatal in the reference.
pub(crate) fn warning_directive(strict: bool, span: Span, text: &str) -> Diagnostic {
    let message = own_words("#warning", format!("#warning: {text}"), text);
    super::quirk(strict, WARNING_DIRECTIVE, span, message).label("reported by the source itself")
}

/// W0003: `#pragma warning`.
pub(crate) fn pragma_warning(span: Span, text: &str) -> Diagnostic {
    let message = own_words("#pragma warning", text.to_owned(), text);
    Diagnostic::warning(PRAGMA_WARNING, span, message).label("reported by the source itself")
}

/// W0004: `#pragma osl` with an unknown word.
pub(crate) fn unknown_osl_pragma(span: Span, word: &str) -> Diagnostic {
    Diagnostic::warning(UNKNOWN_OSL_PRAGMA, span, format!("unknown pragma `osl {word}`"))
        .label("ignored")
        .note("the only one is `#pragma osl nowarn`")
}

/// W0006: the file has bytes that are not UTF-8, if it has any.
pub fn not_utf8(file: &SourceFile) -> Option<Diagnostic> {
    let at = file.about.first_foreign?;
    // The text may have been edited since it was read.
    let is_foreign = |(_, c): &(usize, char)| !c.is_ascii();
    let after = file.text.get(at..).and_then(|rest| rest.char_indices().find(is_foreign));
    let (at, c) =
        after.map(|(more, c)| (at + more, c)).or_else(|| file.text.char_indices().find(is_foreign))?;
    let start = file.base + at as u32;
    Some(
        Diagnostic::warning(NOT_UTF8, Span::new(start, start + c.len_utf8() as u32), "the file is not UTF-8")
            .label("the first such byte")
            .note("each byte that is not UTF-8 is read as the character of its code, as in Latin-1")
            .help("save the file as UTF-8"),
    )
}

/// W0005: `/*` within a comment. Fatal in the reference.
pub(crate) fn nested_comment(strict: bool, span: Span) -> Diagnostic {
    super::quirk(strict, NESTED_COMMENT, span, "`/*` inside a comment")
        .label("comments do not nest: the next `*/` ends both")
}
