//! Opening without waiting and without following links: the calls of the system, and nothing of which file is wanted.
//!
//! A path is walked folder by folder from a root, each step relative to the folder opened before and none through a
//! link. If somebody exchanges a folder for a link while this runs, the walk fails instead of leaving the root. Where
//! the system has no such calls, the real path is opened and what was opened is checked.

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
    /// Appending to a new file, or to one that appeared meanwhile.
    Creating,
}

/// Opens a plain file. `below` has only names of folders and of the file, no links, and no `.` or `..`.
pub(crate) fn beneath(root: &Path, below: &Path, what: For) -> Result<File, FileError> {
    plain(system::beneath(root, below, what).map_err(FileError::io(OPEN))?)
}

/// Opens a plain file wherever it lies, through links.
pub(crate) fn anywhere(path: &Path, what: For) -> Result<File, FileError> {
    plain(system::anywhere(path, what).map_err(FileError::io(OPEN))?)
}

/// Opens whatever is there for reading, without waiting.
pub(crate) fn any_kind(path: &Path) -> Result<File, FileError> {
    system::anywhere(path, For::Reading).map_err(FileError::io(OPEN))
}

/// Opens a pipe or device for writing, without waiting for somebody to read.
pub(crate) fn to_write_through(path: &Path) -> std::io::Result<File> {
    system::to_write_through(path)
}

/// Lets calls on an opened file wait for data from now on.
pub(crate) fn wait_for_data(file: &File) -> std::io::Result<()> {
    system::wait_for_data(file)
}

/// The file, if it is one.
fn plain(file: File) -> Result<File, FileError> {
    match kind(&file)? {
        None => Ok(file),
        Some(kind) => Err(FileError::NotAFile(kind)),
    }
}

/// What an opened file is, if it is not a plain file.
pub(crate) fn kind(file: &File) -> Result<Option<Kind>, FileError> {
    let meta = file.metadata().map_err(FileError::io("look at the file"))?;
    Ok(kind_of(meta.file_type()))
}

/// What a type of file is, if it is not that of a plain file.
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

/// What a type of file is, if it is not that of a plain file.
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

    /// A folder on the way: it need not be readable.
    #[cfg(any(target_os = "linux", target_os = "android"))]
    const FOLDER: OFlags = OFlags::PATH.union(OFlags::DIRECTORY);
    #[cfg(not(any(target_os = "linux", target_os = "android")))]
    const FOLDER: OFlags = OFlags::DIRECTORY;

    fn flags(what: For) -> OFlags {
        // A pipe would wait for its other end; a terminal would become that of the process.
        let common = OFlags::NONBLOCK | OFlags::NOCTTY | OFlags::CLOEXEC;
        common
            | match what {
                For::Reading => OFlags::RDONLY,
                For::Appending => OFlags::WRONLY | OFlags::APPEND,
                For::Creating => OFlags::WRONLY | OFlags::APPEND | OFlags::CREATE,
            }
    }

    /// Permissions of a new file; the system takes the umask of the process off these.
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
        // What was opened lies where it was looked for, unless a folder on the way has become a link.
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
