//! The errors of image files, as one-line values.
//!
//! Every error names the path and the reason, so that a caller can print it unchanged. This module must not
//! know formats; it only quotes the text of a decoder.

use osl_files::{FileError, SaveError};
use std::path::{Path, PathBuf};

/// Why an image could not be written or read. Its text is one line: the path, then the reason.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// There is no such file.
    #[error("{}: no such file", .path.display())]
    Missing {
        /// The file that the caller named.
        path: PathBuf,
    },
    /// The operating system refused a step.
    #[error("{}: cannot {action}: {source}", .path.display())]
    Io {
        /// The file that the caller named.
        path: PathBuf,
        /// The step that failed, as in "create a file in /tmp".
        action: String,
        /// The reason of the operating system.
        source: std::io::Error,
    },
    /// The file is not an image that this crate reads, or is damaged.
    #[error("{}: {reason}", .path.display())]
    Format {
        /// The file that the caller named.
        path: PathBuf,
        /// What the decoder or encoder found, on one line.
        reason: String,
    },
    /// The image has more samples than the limit allows; nothing was allocated for it.
    #[error("{}: {samples} samples are more than the limit of {limit} (--limit images.samples=COUNT)", .path.display())]
    TooLarge {
        /// The file that the caller named.
        path: PathBuf,
        /// Width times height times channels, saturated.
        samples: u64,
        /// The limit in force.
        limit: u64,
    },
    /// A read would take more memory than a limit permits; nothing was allocated for it.
    #[error(
        "{}: {what} takes {}, and the limit is {} (--limit images.{limit}=BYTES)",
        .path.display(), mebibytes(*.needed), mebibytes(*.most)
    )]
    Memory {
        /// The file that the caller named.
        path: PathBuf,
        /// What takes the memory.
        what: String,
        /// The bytes that it takes.
        needed: u64,
        /// The bytes that are permitted.
        most: u64,
        /// The name of the limit among those of images.
        limit: &'static str,
    },
    /// The caller's planes or names do not form an image.
    #[error("{}: {reason}", .path.display())]
    Input {
        /// The file that the caller named.
        path: PathBuf,
        /// Which expectation was not met.
        reason: String,
    },
}

impl ImageError {
    pub(crate) fn io(path: &Path, action: impl Into<String>, source: std::io::Error) -> Self {
        Self::Io { path: path.to_owned(), action: action.into(), source }
    }

    /// An error from `osl-files`.
    pub(crate) fn file(path: &Path, error: FileError) -> Self {
        match error {
            FileError::Io { step, source } => Self::io(path, step, source),
            FileError::NotFound => Self::Missing { path: path.to_owned() },
            other => Self::input(path, other.to_string()),
        }
    }

    pub(crate) fn format(path: &Path, reason: impl ToString) -> Self {
        Self::Format { path: path.to_owned(), reason: one_line(&reason.to_string()) }
    }

    pub(crate) fn memory(
        path: &Path,
        what: impl Into<String>,
        needed: u64,
        most: u64,
        limit: &'static str,
    ) -> Self {
        Self::Memory { path: path.to_owned(), what: what.into(), needed, most, limit }
    }

    pub(crate) fn input(path: &Path, reason: impl Into<String>) -> Self {
        Self::Input { path: path.to_owned(), reason: reason.into() }
    }
}

impl From<SaveError> for ImageError {
    fn from(SaveError { path, error }: SaveError) -> Self {
        Self::file(&path, error)
    }
}

/// Bytes for display: below a mebibyte as bytes, else in mebibytes, rounded up.
fn mebibytes(bytes: u64) -> String {
    if bytes < 1 << 20 { format!("{bytes} bytes") } else { format!("{} MiB", bytes.div_ceil(1 << 20)) }
}

/// Characters of a foreign message that are shown. It may quote a line of the file.
const SHOWN: usize = 200;

/// Joins the lines of a foreign message.
fn one_line(text: &str) -> String {
    let text: Vec<&str> = text.split_whitespace().collect();
    text.join(" ").chars().take(SHOWN).collect()
}
