//! All errors of the crate, as one type.

use crate::diagnostic::{Diagnostic, Range, diagnostics, range};
use osl_exec::RunError;
use osl_limits::Halt;
use osl_syntax::diagnostic::Diagnostic as Inner;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::SourceMap;
use std::fmt;

/// What failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A source text has errors: see [`Error::diagnostics`].
    Source,
    /// The caller asked for something impossible: an unknown name, a value of another type, an array of
    /// another length.
    Request,
    /// A program ended without results, because it reached one of its [`Limits`](crate::Limits).
    Run,
    /// The work was cancelled, see [`Cancel`](crate::Cancel).
    Cancelled,
}

/// Why an operation failed. Its text shows all diagnostics with excerpts of the source.
#[derive(Clone, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    text: String,
    diagnostics: Vec<Diagnostic>,
    range: Option<Box<Range>>,
}

impl Error {
    /// What failed.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// The diagnostics, if a source text caused the error.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// The loop or call of a source text that reached a limit of a run, if it is known.
    pub fn range(&self) -> Option<&Range> {
        self.range.as_deref()
    }

    /// An impossible request.
    pub(crate) fn new(text: impl fmt::Display) -> Error {
        Error { kind: ErrorKind::Request, text: text.to_string(), diagnostics: Vec::new(), range: None }
    }

    /// A run without results.
    pub(crate) fn run(error: &RunError, sources: &SourceMap) -> Error {
        let kind = match error {
            RunError::Halted(Halt::Cancelled) => ErrorKind::Cancelled,
            _ => ErrorKind::Run,
        };
        let span = match error {
            RunError::TooManySteps { span, .. } | RunError::TooMuchMemory { span, .. } => *span,
            _ => None,
        };
        Error { kind, range: span.and_then(|span| range(span, sources)).map(Box::new), ..Error::new(error) }
    }

    /// Errors of a source text.
    pub(crate) fn of(list: &[Inner], sources: &SourceMap) -> Error {
        let text = render(list, sources, RenderStyle::default()).trim_end().to_string();
        Error { kind: ErrorKind::Source, text, diagnostics: diagnostics(list, sources), range: None }
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
