//! Reads an opened file up to a bound, and opens files that the user named.
//!
//! The module `roots` decides which files may be opened.

use crate::error::{FileError, Kind};
use crate::{inputs, open};
use std::fs::File;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// A file that was opened and passed all checks.
#[derive(Debug)]
pub struct Opened {
    file: File,
    path: PathBuf,
    length: u64,
}

impl Opened {
    pub(crate) fn new(file: File, path: PathBuf) -> Result<Opened, FileError> {
        let length = file.metadata().map_err(FileError::io("look at the file"))?.len();
        inputs::note(&file, &path);
        Ok(Opened { file, path, length })
    }

    /// The same file, by another path to it.
    pub(crate) fn named(self, path: &Path) -> Opened {
        Opened { path: path.to_owned(), ..self }
    }

    /// The path by which it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its length in bytes when it was opened.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// The file itself, to be read piece by piece.
    pub fn into_file(self) -> File {
        self.file
    }

    /// Reads all bytes.
    ///
    /// # Errors
    /// The file has more than `limit` bytes, or the system refuses.
    pub fn bytes(self, limit: u64) -> Result<Vec<u8>, FileError> {
        if self.length > limit {
            return Err(FileError::TooLong(limit));
        }
        bytes(self.file, limit, self.length)
    }

    /// Reads the whole file as text.
    ///
    /// # Errors
    /// As for [`Opened::bytes`]; also if it is not UTF-8 or has a zero byte.
    pub fn text(self, limit: u64) -> Result<String, FileError> {
        text(self.bytes(limit)?)
    }
}

/// Opens a file that the user named: a file anywhere, or `/dev/stdin` or `/dev/fd/N`, whatever they refer to.
///
/// # Errors
/// There is nothing, or a folder, a named pipe, a socket or a device, except a terminal.
pub fn open_named(path: &Path) -> Result<Opened, FileError> {
    let file = open::any_kind(path)?;
    match open::kind(&file)? {
        None => {}
        // A shell's `<(command)` is a pipe too, but one without a name of its own. A named pipe may have no
        // writer, and then reading would never end.
        Some(Kind::Pipe) if is_handle(path) => {
            open::wait_for_data(&file).map_err(FileError::io("read the pipe"))?;
        }
        Some(Kind::Device) if file.is_terminal() => {
            open::wait_for_data(&file).map_err(FileError::io("read the terminal"))?;
        }
        Some(kind) => return Err(FileError::NotAFile(kind)),
    }
    Opened::new(file, path.to_owned())
}

/// When a file was last written, and its size: whoever changes a file changes one of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    written: SystemTime,
    length: u64,
}

impl Stamp {
    /// The stamp of a text in memory after so many changes, which is older than any work.
    pub fn revision(changes: u64) -> Stamp {
        Stamp { written: SystemTime::UNIX_EPOCH, length: changes }
    }

    /// Whether the file was last written some time before a moment, so that what was read after it is what
    /// the file holds.
    pub fn is_older_than(&self, moment: SystemTime) -> bool {
        // Systems count in steps of up to ten milliseconds, some in seconds.
        self.written + Duration::from_secs(2) < moment
    }
}

/// The stamp of a file, for a look whether it has changed; `None` if there is no such file.
pub fn stamp(path: &Path) -> Option<Stamp> {
    let about = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some(Stamp { written: about.modified().ok()?, length: about.len() })
}

/// Whether a path is one of the system's names for open file descriptors.
fn is_handle(path: &Path) -> bool {
    path.starts_with("/dev") || path.starts_with("/proc")
}

/// Reads a whole stream.
///
/// # Errors
/// As for [`Opened::bytes`].
pub fn read_stream(from: impl Read, limit: u64) -> Result<Vec<u8>, FileError> {
    bytes(from, limit, 0)
}

/// Bytes as text.
///
/// # Errors
/// They are not UTF-8, or one is zero.
pub fn text(bytes: Vec<u8>) -> Result<String, FileError> {
    let text = String::from_utf8(bytes).map_err(|e| FileError::NotUtf8(e.utf8_error().valid_up_to()))?;
    match text.find('\0') {
        Some(at) => Err(FileError::Zero(at)),
        None => Ok(text),
    }
}

fn bytes(from: impl Read, limit: u64, length: u64) -> Result<Vec<u8>, FileError> {
    let cannot = FileError::io("read the file");
    let mut bytes = Vec::new();
    let room = usize::try_from(length.min(limit)).ok().map(|n| bytes.try_reserve_exact(n));
    if !matches!(room, Some(Ok(()))) {
        return Err(cannot(std::io::ErrorKind::OutOfMemory.into()));
    }
    // The file may grow while it is read, so one byte more than the limit is requested.
    from.take(limit.saturating_add(1)).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > limit { Err(FileError::TooLong(limit)) } else { Ok(bytes) }
}
