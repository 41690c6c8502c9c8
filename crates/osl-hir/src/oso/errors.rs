//! Codes and messages of compiled shaders: E07xx.

use osl_syntax::diagnostic::{Code, Diagnostic};
use osl_syntax::span::Span;

/// A line that does not follow the format.
pub const SYNTAX: Code = Code { id: "E0701", name: "oso-syntax" };
/// A symbol that is not declared, or whose declaration is invalid.
pub const SYMBOL: Code = Code { id: "E0702", name: "oso-symbol" };
/// An operation that does not exist or does not take its arguments.
pub const OPERATION: Code = Code { id: "E0703", name: "oso-operation" };
/// A jump that does not lead forward within its block, or that is outside the construct that it leaves.
pub const JUMP: Code = Code { id: "E0704", name: "oso-jump" };

/// All codes of this module, in order.
pub const ALL: &[Code] = &[SYNTAX, SYMBOL, OPERATION, JUMP];

/// An error in a file; boxed, since the results of every step contain it.
pub(super) type Wrong = Box<Diagnostic>;

pub(super) fn syntax(span: Span, message: impl Into<String>) -> Wrong {
    Box::new(Diagnostic::error(SYNTAX, span, message))
}

pub(super) fn symbol(span: Span, message: impl Into<String>) -> Wrong {
    Box::new(Diagnostic::error(SYMBOL, span, message))
}

pub(super) fn operation(span: Span, message: impl Into<String>) -> Wrong {
    Box::new(Diagnostic::error(OPERATION, span, message))
}

pub(super) fn jump(span: Span, message: impl Into<String>) -> Wrong {
    Box::new(Diagnostic::error(JUMP, span, message))
}

/// E0310: a program that runs, but cannot be written.
pub(super) fn nested_arrays(span: Span) -> Wrong {
    let message = "a compiled shader has no arrays within arrays";
    Box::new(
        Diagnostic::error(crate::resolve::errors::BAD_STRUCT, span, message)
            .label("an array of structs that hold arrays")
            .help("run the source, or give each field an array of its own"),
    )
}

pub(super) fn too_large(span: Span, message: impl Into<String>) -> Wrong {
    Box::new(Diagnostic::error(crate::hir::TOO_LARGE, span, message))
}
