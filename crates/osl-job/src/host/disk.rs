//! Files on the disk, through osl-files with its rules.

use super::{Host, STDIN, Within};
use osl_files::{FileError, Roots, Stamp, open_named, read_stream, stamp};
use osl_image::TextureCache;
use osl_limits::Limits;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// Number of folders above that of a shader which belong to its project, unless a `.git` says more.
const ABOVE: usize = 3;

/// Maximum number of entries of a folder that are looked at for a suggestion.
const MOST_ENTRIES: usize = 1000;

/// The disk. The path `-` that the user names is the standard input.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Host for Disk {
    fn read(&self, path: &Path, within: Within<'_>, most: u64) -> Result<Vec<u8>, FileError> {
        match within {
            Within::Anywhere if path.as_os_str() == STDIN => stdin(most),
            Within::Anywhere => open_named(path)?.bytes(most),
            Within::Roots(roots) => roots.open(path)?.bytes(most),
            Within::Target(roots) => roots.open_target(path)?.bytes(most),
        }
    }

    fn stamp(&self, path: &Path) -> Option<Stamp> {
        stamp(path)
    }

    fn names(&self, folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(or_here(folder)).into_iter().flatten().flatten().take(MOST_ENTRIES);
        let mut names: Vec<String> =
            entries.map(|entry| Path::new(&entry.file_name()).display().to_string()).collect();
        names.sort();
        names
    }

    fn permit(&self, folder: &Path, project: bool, roots: &mut Roots) {
        roots.add(folder);
        if project && let Some(project) = project_of(folder) {
            roots.add(&project);
        }
    }

    fn textures(&self, folders: Vec<PathBuf>, limits: &Limits) -> TextureCache {
        TextureCache::within(folders, limits)
    }

    fn now(&self) -> SystemTime {
        SystemTime::now()
    }
}

/// The standard input. Commands that compile a shader several times read it again.
fn stdin(most: u64) -> Result<Vec<u8>, FileError> {
    static BYTES: OnceLock<Vec<u8>> = OnceLock::new();
    if let Some(bytes) = BYTES.get() {
        return Ok(bytes.clone());
    }
    let bytes = read_stream(std::io::stdin().lock(), most)?;
    Ok(BYTES.get_or_init(|| bytes).clone())
}

/// The project of a folder, links resolved: the nearest folder from it up that has a `.git`, else some
/// folders above. The root of the file system is none.
fn project_of(folder: &Path) -> Option<PathBuf> {
    let real = or_here(folder).canonicalize().ok()?;
    let above = || real.ancestors().filter(|above| above.parent().is_some());
    let marked = above().find(|above| above.join(".git").exists());
    marked.or_else(|| above().take(ABOVE + 1).last()).map(Path::to_path_buf)
}

/// The folder; the empty path is the working directory.
fn or_here(folder: &Path) -> &Path {
    if folder.as_os_str().is_empty() { Path::new(".") } else { folder }
}
