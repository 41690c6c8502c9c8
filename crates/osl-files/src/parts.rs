//! Part files: temporary files that replace their target when complete. This module also cleans up after dead
//! processes.
//!
//! A part file is in the folder of its target, and its writer holds a lock on it. The system releases the
//! lock when the process ends, however it ends. So a part file with a free lock belongs to nobody, and the
//! next process that writes into the folder removes it.

use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// Prefix and suffix of the names of part files.
const PREFIX: &str = ".oslrun-";
const SUFFIX: &str = ".part";
/// Attempts to make a part file that no other process takes for a dead one.
const TRIES: usize = 16;

/// The part files of this process.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// Whether the process is about to end: then no file is created or moved any more.
    ending: bool,
    own: BTreeSet<PathBuf>,
    /// Folders that were already searched for files of dead processes.
    swept: BTreeSet<PathBuf>,
}

static PARTS: Mutex<Parts> =
    Mutex::new(Parts { ending: false, own: BTreeSet::new(), swept: BTreeSet::new() });

/// The part files of this process, for one thread at a time. A signal handler that ends the process waits for
/// it.
pub(crate) fn parts() -> io::Result<MutexGuard<'static, Parts>> {
    // The sets are never left half-changed, so a panic elsewhere does not corrupt them.
    let parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
    if parts.ending { Err(io::ErrorKind::Interrupted.into()) } else { Ok(parts) }
}

/// Removes the part files of this process, which is about to end. No part file replaces its target after
/// this.
pub fn abandon() {
    let mut parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
    parts.ending = true;
    for path in std::mem::take(&mut parts.own) {
        let _ = fs::remove_file(path);
    }
}

/// A part file, which is removed when dropped.
#[derive(Debug)]
pub(crate) struct PartFile {
    /// `None` after it has replaced its target.
    file: Option<NamedTempFile>,
    path: PathBuf,
}

impl PartFile {
    /// Creates an empty part file in a folder, with the permissions of any new file. The first one in a
    /// folder also removes those of dead processes.
    pub(crate) fn new(folder: &Path) -> io::Result<PartFile> {
        let mut parts = parts()?;
        if !parts.swept.contains(folder) {
            sweep(folder);
            parts.swept.insert(folder.to_owned());
        }
        for _ in 0..TRIES {
            let file = builder().tempfile_in(folder)?;
            if claimed(file.as_file()) {
                let path = file.path().to_owned();
                parts.own.insert(path.clone());
                return Ok(PartFile { file: Some(file), path });
            }
        }
        Err(io::ErrorKind::ResourceBusy.into())
    }

    /// The file.
    pub(crate) fn file(&mut self) -> io::Result<&mut File> {
        self.file.as_mut().map(NamedTempFile::as_file_mut).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Moves the file to its target, replacing a file there. The caller holds the lock of all part files.
    pub(crate) fn persist(&mut self, target: &Path, parts: &mut Parts) -> io::Result<()> {
        let Some(file) = self.file.take() else { return Err(io::ErrorKind::NotFound.into()) };
        match file.persist(target) {
            Ok(_) => {
                parts.own.remove(&self.path);
                Ok(())
            }
            Err(failed) => {
                self.file = Some(failed.file);
                Err(failed.error)
            }
        }
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if let Some(file) = self.file.take() {
            let mut parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
            drop(file);
            parts.own.remove(&self.path);
        }
    }
}

/// A second name for a file in its folder, under which it can be restored after its name was reused. Not
/// every file system supports this.
pub(crate) fn second_name(target: &Path) -> Option<PathBuf> {
    let folder = target.parent()?;
    let made = builder().make_in(folder, |path| fs::hard_link(target, path)).ok()?;
    let (_, path) = made.into_parts();
    path.keep().ok()
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The system removes the permissions in the umask.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

/// Locks a new part file. False if another process took it for a dead one meanwhile.
fn claimed(file: &File) -> bool {
    match file.try_lock() {
        Ok(()) => is_linked(file),
        Err(TryLockError::WouldBlock) => false,
        // A file system without locks: nobody can lock the file, so nobody removes it.
        Err(TryLockError::Error(_)) => true,
    }
}

#[cfg(unix)]
fn is_linked(file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    file.metadata().is_ok_and(|meta| meta.nlink() > 0)
}

#[cfg(not(unix))]
fn is_linked(_: &File) -> bool {
    true
}

/// Removes the part files of dead processes. Files that cannot be removed stay.
fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_part = name.to_str().is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(SUFFIX));
        if !is_part || !entry.file_type().is_ok_and(|ty| ty.is_file()) {
            continue;
        }
        // The lock is held until the file is gone, so that no writer can take the file for its own.
        let path = entry.path();
        if let Ok(file) = crate::open::beneath(folder, Path::new(&name), crate::open::For::Reading)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(path);
        }
    }
}
