//! Opens files without waiting and without following links. This module wraps the system calls and does not
//! decide which files may be opened.
//!
//! A path is walked folder by folder from a root; each step is relative to the folder opened before and none
//! follows a link. If another process replaces a folder by a link meanwhile, the walk fails instead of
//! leaving the root. On systems without such calls, the real path is opened and the opened file is checked.

use crate::error::{FileError, Kind, OPEN};
use std::fs::File;
use std::path::Path;

/// What to open a file for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum For {
    /// Reading.
    Reading,
    /// Appending to a file that is there.
    Appending,
    /// Appending to a new file, or to one that was created meanwhile.
    Creating,
}

/// Opens a plain file. `below` has only names of folders and of the file, no links, and no `.` or `..`.
pub(crate) fn beneath(root: &Path, below: &Path, what: For) -> Result<File, FileError> {
    plain(system::beneath(root, below, what).map_err(FileError::io(OPEN))?)
}

/// Opens a plain file anywhere, following links.
pub(crate) fn anywhere(path: &Path, what: For) -> Result<File, FileError> {
    plain(system::anywhere(path, what).map_err(FileError::io(OPEN))?)
}

/// Opens a file of any kind for reading, without waiting.
pub(crate) fn any_kind(path: &Path) -> Result<File, FileError> {
    system::anywhere(path, For::Reading).map_err(FileError::io(OPEN))
}

/// Opens a pipe or device for writing, without waiting for a reader.
pub(crate) fn to_write_through(path: &Path) -> std::io::Result<File> {
    system::to_write_through(path)
}

/// Makes calls on an opened file wait for data from now on.
pub(crate) fn wait_for_data(file: &File) -> std::io::Result<()> {
    system::wait_for_data(file)
}

/// The file, if it is a plain file.
fn plain(file: File) -> Result<File, FileError> {
    match kind(&file)? {
        None => Ok(file),
        Some(kind) => Err(FileError::NotAFile(kind)),
    }
}

/// The kind of an opened file, unless it is a plain file.
pub(crate) fn kind(file: &File) -> Result<Option<Kind>, FileError> {
    let meta = file.metadata().map_err(FileError::io("look at the file"))?;
    Ok(kind_of(meta.file_type()))
}

/// The kind of a file type, unless it is a plain file.
#[cfg(unix)]
pub(crate) fn kind_of(ty: std::fs::FileType) -> Option<Kind> {
    use std::os::unix::fs::FileTypeExt;
    if ty.is_file() {
        None
    } else if ty.is_dir() {
        Some(Kind::Folder)
    } else if ty.is_fifo() {
        Some(Kind::Pipe)
    } else if ty.is_socket() {
        Some(Kind::Socket)
    } else {
        Some(Kind::Device)
    }
}

/// The kind of a file type, unless it is a plain file.
#[cfg(not(unix))]
pub(crate) fn kind_of(ty: std::fs::FileType) -> Option<Kind> {
    (!ty.is_file()).then_some(if ty.is_dir() { Kind::Folder } else { Kind::Device })
}

#[cfg(unix)]
mod system {
    use super::For;
    use rustix::fs::{CWD, Mode, OFlags, fcntl_getfl, fcntl_setfl, openat};
    use std::fs::File;
    use std::io;
    use std::os::fd::OwnedFd;
    use std::path::{Component, Path};

    /// How to open a folder on the path: it need not be readable.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    const FOLDER: OFlags = OFlags::PATH.union(OFlags::DIRECTORY);
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    const FOLDER: OFlags = OFlags::DIRECTORY;

    fn flags(what: For) -> OFlags {
        // A pipe would wait for its other end; a terminal would become the process's controlling terminal.
        let common = OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        common
            | match what {
                For::Reading => OFlags::RDONLY,
                For::Appending => OFlags::WRONLY | OFlags::APPEND,
                For::Creating => OFlags::WRONLY | OFlags::APPEND | OFlags::CREATE,
            }
    }

    /// Permissions of a new file; the system removes those in the umask.
    fn mode() -> Mode {
        Mode::from_raw_mode(0o666)
    }

    pub(super) fn beneath(root: &Path, below: &Path, what: For) -> io::Result<File> {
        let mut folder: OwnedFd = openat(CWD, root, FOLDER | OFlags::CLOEXEC, Mode::empty())?;
        let mut names = below.components().peekable();
        while let Some(name) = names.next() {
            let Component::Normal(name) = name else { return Err(io::ErrorKind::InvalidInput.into()) };
            if names.peek().is_none() {
                return Ok(File::from(openat(&folder, name, flags(what) | OFlags::NOFOLLOW, mode())?));
            }
            folder = openat(&folder, name, FOLDER | OFlags::NOFOLLOW | OFlags::CLOEXEC, Mode::empty())?;
        }
        Err(io::ErrorKind::IsADirectory.into())
    }

    pub(super) fn anywhere(path: &Path, what: For) -> io::Result<File> {
        Ok(File::from(openat(CWD, path, flags(what), mode())?))
    }

    pub(super) fn to_write_through(path: &Path) -> io::Result<File> {
        let flags = OFlags::WRONLY | OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        Ok(File::from(openat(CWD, path, flags, Mode::empty())?))
    }

    pub(super) fn wait_for_data(file: &File) -> io::Result<()> {
        Ok(fcntl_setfl(file, fcntl_getfl(file)? - OFlags::NONBLOCK)?)
    }
}

#[cfg(not(unix))]
mod system {
    use super::For;
    use std::fs::{File, OpenOptions};
    use std::io;
    use std::path::Path;

    pub(super) fn beneath(root: &Path, below: &Path, what: For) -> io::Result<File> {
        let path = root.join(below);
        let file = anywhere(&path, what)?;
        // The opened file is where it was expected, unless a folder on the path has become a link.
        match std::fs::canonicalize(&path)? == path {
            true => Ok(file),
            false => Err(io::ErrorKind::PermissionDenied.into()),
        }
    }

    pub(super) fn anywhere(path: &Path, what: For) -> io::Result<File> {
        match what {
            For::Reading => File::open(path),
            For::Appending => OpenOptions::new().append(true).open(path),
            For::Creating => OpenOptions::new().append(true).create(true).open(path),
        }
    }

    pub(super) fn to_write_through(path: &Path) -> io::Result<File> {
        OpenOptions::new().write(true).open(path)
    }

    pub(super) fn wait_for_data(_: &File) -> io::Result<()> {
        Ok(())
    }
}
