//! The codes of this crate and one constructor for each message.
//!
//! `E00xx`, `W00xx`: preprocessing. `E01xx`: tokens and syntax. `W01xx`: quirks, which become errors with the
//! same code under strict syntax. The constructors must not decide when a message is due.

mod lexical;
mod preprocessing;
mod quirks;
mod syntax;

pub(crate) use lexical::*;
pub use preprocessing::not_utf8;
pub(crate) use preprocessing::*;
pub(crate) use quirks::*;
pub use syntax::too_many_errors;
pub(crate) use syntax::*;

use crate::diagnostic::{Code, Diagnostic};

/// Whether a diagnostic is a syntax error for the reference, which stops reading there.
pub fn is_of_syntax(d: &Diagnostic) -> bool {
    d.is_error() && [SYNTAX, UNCLOSED, STRAY_CLOSER, NOT_ASSIGNABLE, NOT_INDEXABLE].contains(&d.code)
}

/// Whether the text of a diagnostic may have declared names that the tree does not show.
pub(crate) fn loses_text(d: &Diagnostic) -> bool {
    let keeps = [MACRO_ARGUMENTS, BAD_PASTE, PRAGMA_ERROR, EXPANSION_DEPTH];
    d.is_error()
        && (d.code == UNTERMINATED_COMMENT || (d.code.id.starts_with("E00") && !keeps.contains(&d.code)))
}

/// Every code of this crate, in numerical order.
pub const CODES: &[Code] = &[
    INCLUDE_NOT_FOUND,
    INCLUDE_DEPTH,
    INCLUDE_COUNT,
    BAD_DIRECTIVE,
    UNKNOWN_DIRECTIVE,
    BAD_DEFINE,
    MACRO_ARGUMENTS,
    UNTERMINATED_INVOCATION,
    BAD_PASTE,
    CONDITION,
    UNBALANCED_CONDITIONAL,
    UNTERMINATED_CONDITIONAL,
    ERROR_DIRECTIVE,
    EXPANSION_BUDGET,
    EXPANSION_DEPTH,
    TOKEN_BUDGET,
    TOO_LARGE,
    PRAGMA_ERROR,
    MACRO_REDEFINED,
    WARNING_DIRECTIVE,
    PRAGMA_WARNING,
    UNKNOWN_OSL_PRAGMA,
    NESTED_COMMENT,
    NOT_UTF8,
    STRAY_CHARACTER,
    UNTERMINATED_STRING,
    UNTERMINATED_COMMENT,
    INT_TOO_LARGE,
    NUMBER_SUFFIX,
    RESERVED_WORD,
    TRIPLE_UNDERSCORE,
    CHAR_LITERAL,
    SYNTAX,
    UNCLOSED,
    STRAY_CLOSER,
    NESTING,
    NOT_ASSIGNABLE,
    NOT_INDEXABLE,
    ARRAY_LENGTH,
    ARRAY_INITIALIZER,
    EMPTY_INITIALIZER,
    TOO_MANY_ERRORS,
    STRAY_BRACE,
    BROKEN_STRING,
    TRAILING_COMMA,
    STRAY_SEMICOLON,
    COMMA_OPERATOR,
];
