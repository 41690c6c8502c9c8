//! Why a file was not read or written, as values.
//!
//! The text of an error is one line without the file's name: the caller knows the name, and some callers must
//! not show it.

use std::io;
use std::path::{Path, PathBuf};

/// What was found in place of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A folder.
    Folder,
    /// A named pipe. Opening it would wait for its other end.
    Pipe,
    /// A device, which may have no end.
    Device,
    /// A socket.
    Socket,
}

impl Kind {
    /// The word for it, with its article.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Folder => "a folder",
            Kind::Pipe => "a pipe",
            Kind::Device => "a device",
            Kind::Socket => "a socket",
        }
    }
}

/// Why a file was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// There is no file of this name.
    #[error("no such file")]
    NotFound,
    /// The name leads out of the permitted folders, whether or not a file is there.
    #[error("it lies outside of the folders that may be used")]
    Outside,
    /// The file would be hidden: a component of its path begins with a dot.
    #[error("names that begin with a dot are not written")]
    Hidden,
    /// The name belongs to something other than a file.
    #[error("it is {}, not a file", .0.name())]
    NotAFile(Kind),
    /// The file may be read, but not changed.
    #[error("it is write-protected")]
    Protected,
    /// The file is longer than the limit, in bytes.
    #[error("it has more than {0} bytes")]
    TooLong(u64),
    /// The byte at this offset is not UTF-8.
    #[error("it is not text (byte {0} is not UTF-8)")]
    NotUtf8(usize),
    /// The byte at this offset is zero.
    #[error("it is not text (byte {0} is zero)")]
    Zero(usize),
    /// The file was read, so that it must not become an output, see [`crate::protect_inputs`].
    #[error("this would replace a file that is read: name another one")]
    IsRead,
    /// There is no such folder.
    #[error("there is no folder {}", .0.display())]
    NoFolder(PathBuf),
    /// A folder has more entries than a search looks at.
    #[error("it has more than {0} entries")]
    TooMany(usize),
    /// The name of an output contains something that a file name must not contain.
    #[error("a file name cannot be made of `{0}`")]
    Name(String),
    /// The system refused a step, such as "open the file".
    #[error("cannot {step}: {source}")]
    Io {
        /// The step.
        step: &'static str,
        /// The system's reason.
        source: io::Error,
    },
}

impl FileError {
    pub(crate) fn io(step: &'static str) -> impl FnOnce(io::Error) -> FileError {
        move |source| match source.kind() {
            io::ErrorKind::NotFound if step == OPEN => FileError::NotFound,
            io::ErrorKind::IsADirectory => FileError::NotAFile(Kind::Folder),
            _ => FileError::Io { step, source },
        }
    }

    /// The reason without the step, for a message that names the step itself.
    pub fn reason(&self) -> String {
        if let FileError::Io { source, .. } = self { source.to_string() } else { self.to_string() }
    }

    /// Whether there is no file, rather than one that is refused.
    pub fn is_missing(&self) -> bool {
        matches!(self, FileError::NotFound)
    }
}

/// The step that fails if there is no file.
pub(crate) const OPEN: &str = "open the file";

/// Why an output file was not written, with its path.
#[derive(Debug, thiserror::Error)]
#[error("{}: {error}", .path.display())]
pub struct SaveError {
    /// The requested path.
    pub path: PathBuf,
    /// The reason.
    pub error: FileError,
}

impl SaveError {
    pub(crate) fn of(path: &Path) -> impl FnOnce(FileError) -> SaveError {
        move |error| SaveError { path: path.to_owned(), error }
    }
}
