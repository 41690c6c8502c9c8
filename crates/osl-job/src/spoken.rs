//! The dialect of a file, as a session keeps it.

use osl_dialects::{Dialect, Reason};
use std::sync::Arc;

/// The dialect of a file.
#[derive(Clone, Debug)]
pub struct Spoken {
    /// The dialect.
    pub dialect: Arc<Dialect>,
    /// What in the file shows it; none if the user named the dialect.
    pub reason: Option<Reason>,
    /// Words of the file whose meaning is not public, with what happens here.
    pub unknown: Vec<(String, String)>,
}

impl Spoken {
    /// The name of a header in messages.
    pub(crate) fn named(&self, header: &str) -> String {
        format!("{header} ({})", self.dialect.name)
    }
}
