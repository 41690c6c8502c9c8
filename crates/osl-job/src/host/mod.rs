//! What a session asks of the program around it: the six questions of a [`Host`].
//!
//! A command has files ([`Disk`]), a script or a web page has texts and arrays ([`Memory`]), and an editor
//! has both: files with unsaved texts over them ([`Watching`]). Everything that a request reads comes from
//! its host, and a host that is shared does not change: a change makes another host, for
//! [`Session::change`](crate::Session::change).

mod disk;
mod memory;
mod watching;

pub use disk::Disk;
pub use memory::Memory;
pub use watching::Watching;

use osl_files::{FileError, Kind, Roots, Stamp};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::fmt::Debug;
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

/// The path of the standard input, as the user names it.
pub const STDIN: &str = "-";

/// Who named a file, and thus where it may be.
#[derive(Clone, Copy, Debug)]
pub enum Within<'a> {
    /// The user: anywhere.
    Anywhere,
    /// A group or a scene: below these folders.
    Roots(&'a Roots),
    /// A header: below these folders after its links are followed, also if its path leads out of them.
    Target(&'a Roots),
}

/// What a session asks of the program around it.
pub trait Host: Debug + Send + Sync {
    /// The bytes of the file at a path, at most so many.
    ///
    /// # Errors
    /// There is no such file, it may not be read, or it is too long.
    fn read(&self, path: &Path, within: Within<'_>, most: u64) -> Result<Vec<u8>, FileError>;

    /// When the file at a path last changed; `None` if there is no such file. The stamp of the empty path
    /// changes if a host has other textures than before.
    fn stamp(&self, path: &Path) -> Option<Stamp>;

    /// The names of files in a folder, in order: suggestions for a name that is not found.
    fn names(&self, folder: &Path) -> Vec<String>;

    /// Adds a folder to those from which files may be read; with `project`, also the project that the folder
    /// is a part of.
    fn permit(&self, folder: &Path, project: bool, roots: &mut Roots);

    /// The textures of the working directory and of these folders, in order.
    fn textures(&self, folders: Vec<PathBuf>, limits: &Limits) -> TextureCache;

    /// The time by the clock of the stamps.
    fn now(&self) -> SystemTime;
}

/// The first of several paths at which there is a file, and what was read from it.
///
/// # Errors
/// Those of [`Host::read`]. If nothing exists at any path and one leads outside, the error says so.
pub(crate) fn first<T>(
    paths: impl IntoIterator<Item = PathBuf>,
    read: impl Fn(&Path) -> Result<T, FileError>,
) -> Result<(PathBuf, T), FileError> {
    let mut answer = FileError::NotFound;
    for path in paths {
        match read(&path) {
            Err(FileError::NotFound | FileError::NotAFile(Kind::Folder)) => {}
            Err(FileError::Outside) => answer = FileError::Outside,
            found => return found.map(|read| (path, read)),
        }
    }
    Err(answer)
}

/// A path without `.` and `..`, computed from its text alone.
fn clean(path: &Path) -> PathBuf {
    let mut clean = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir if clean.file_name().is_some_and(|name| name != "..") => {
                clean.pop();
            }
            Component::CurDir => {}
            other => clean.push(other),
        }
    }
    clean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clean_path_has_no_detours() {
        for (path, expected) in
            [("a/./b/../c", "a/c"), ("./a", "a"), ("../a", "../a"), ("a/../../b", "../b"), ("/x/../y", "/y")]
        {
            assert_eq!(clean(Path::new(path)), Path::new(expected), "{path}");
        }
    }
}
