//! The disk, with the unsaved texts of an editor in place of its files.

use super::{Disk, Host, Memory, Within};
use osl_files::{FileError, Roots, Stamp};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// The disk under unsaved texts. A shader may read the text of an editor wherever it may read the file.
#[derive(Clone, Debug, Default)]
pub struct Watching {
    /// The texts, by absolute path.
    unsaved: Memory,
}

impl Watching {
    /// Sets the text of a file, whether or not there is one on the disk.
    pub fn edit(&mut self, path: impl AsRef<Path>, text: &str) {
        self.unsaved.text(absolute(path.as_ref()), text);
    }

    /// Drops the text of a file, because it was saved or closed.
    pub fn close(&mut self, path: impl AsRef<Path>) {
        self.unsaved.remove(absolute(path.as_ref()));
    }
}

impl Host for Watching {
    fn read(&self, path: &Path, within: Within<'_>, most: u64) -> Result<Vec<u8>, FileError> {
        let may = match within {
            Within::Anywhere => true,
            Within::Roots(roots) | Within::Target(roots) => roots.may_hold(path),
        };
        let unsaved = may.then(|| self.unsaved.at_most(&absolute(path), most)).flatten();
        unsaved.unwrap_or_else(|| Disk.read(path, within, most))
    }

    fn stamp(&self, path: &Path) -> Option<Stamp> {
        let unsaved = (!path.as_os_str().is_empty()).then(|| self.unsaved.stamp(&absolute(path)));
        unsaved.flatten().or_else(|| Disk.stamp(path))
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let mut names = Disk.names(folder);
        names.extend(self.unsaved.names(&absolute(folder)));
        names.sort();
        names.dedup();
        names
    }

    fn permit(&self, folder: &Path, project: bool, roots: &mut Roots) {
        Disk.permit(folder, project, roots);
    }

    fn textures(&self, folders: Vec<PathBuf>, limits: &Limits) -> TextureCache {
        Disk.textures(folders, limits)
    }

    fn now(&self) -> SystemTime {
        Disk.now()
    }
}

/// A path from the root of the file system.
fn absolute(path: &Path) -> PathBuf {
    let here = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::path::absolute(here).unwrap_or_else(|_| path.to_owned())
}
