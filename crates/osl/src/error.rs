//! All errors of the crate, as one type.

use osl_syntax::diagnostic::Diagnostic as Inner;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceMap;
use std::fmt;

/// An error or warning about a location in a source text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Its stable code, such as `E0201`.
    pub code: String,
    /// Whether it is an error rather than a warning.
    pub error: bool,
    /// Its message, on one line.
    pub message: String,
    /// The file, by the name given to the compiler.
    pub file: String,
    /// Line, from 1; 0 if unknown.
    pub line: u32,
    /// Column in characters, from 1; 0 if unknown.
    pub column: u32,
}

/// Why an operation failed. Its text shows all diagnostics with excerpts of the source.
#[derive(Clone, PartialEq, Eq)]
pub struct Error {
    text: String,
    diagnostics: Vec<Diagnostic>,
}

impl Error {
    /// The diagnostics, if a source text caused the error.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    pub(crate) fn new(text: impl fmt::Display) -> Error {
        Error { text: text.to_string(), diagnostics: Vec::new() }
    }

    pub(crate) fn of(list: &[Inner], sources: &SourceMap) -> Error {
        let text = render(list, sources, RenderStyle::default()).trim_end().to_string();
        Error { text, diagnostics: diagnostics(list, sources) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl fmt::Debug for Error {
    /// The same text as `Display`, so that a `main` that returns the error prints it readably.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl std::error::Error for Error {}

/// Converts diagnostics to the types of this crate.
pub(crate) fn diagnostics(list: &[Inner], sources: &SourceMap) -> Vec<Diagnostic> {
    let one = |d: &Inner| {
        let place = sources.place(d.span);
        let (file, line, column) = place.map(|p| (p.file, p.line, p.column)).unwrap_or_default();
        Diagnostic {
            code: d.code.id.into(),
            error: d.is_error(),
            message: d.message.clone(),
            file,
            line,
            column,
        }
    };
    list.iter().map(one).collect()
}
