//! The words of a syntax error.

use super::{Failure, Stream};
use crate::diagnostic::Diagnostic;
use crate::errors;

pub(super) fn message(stream: &Stream, failure: &Failure) -> Diagnostic {
    let span = stream.spans.get(failure.at).copied().unwrap_or(stream.end);
    let found = stream.tokens.get(failure.at).map_or("the end of the file".into(), |t| format!("{t:?}"));
    errors::syntax(span, &found, &failure.expected.join(" "))
}
