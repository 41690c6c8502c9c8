//! Part files: what is written before it takes its place, and what happens to it when a process dies.
//!
//! A part file lies in the folder of its target, and its writer holds a lock on it as long as it lives. The system drops
//! the lock with the process, however that ends. So a part file whose lock is free belongs to nobody, and the next process
//! that writes into the folder removes it. This module must not know what the files become.

use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::NamedTempFile;

/// Beginning and end of the names of part files.
const PREFIX: &str = ".oslrun-";
const SUFFIX: &str = ".part";
/// Tries to make a part file that no other process takes for a dead one.
const TRIES: usize = 16;

/// The part files of this process.
#[derive(Debug, Default)]
pub(crate) struct Parts {
    /// Whether the process is about to end: nothing is made or put in its place any more.
    ending: bool,
    own: BTreeSet<PathBuf>,
    /// Folders that were searched for files of dead processes.
    swept: BTreeSet<PathBuf>,
}

static PARTS: Mutex<Parts> =
    Mutex::new(Parts { ending: false, own: BTreeSet::new(), swept: BTreeSet::new() });

/// The part files of this process, for one thread at a time. A signal that ends the process waits for it.
pub(crate) fn parts() -> io::Result<MutexGuard<'static, Parts>> {
    // The sets are never left half-changed, so a panic elsewhere does not spoil them.
    let parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
    if parts.ending { Err(io::ErrorKind::Interrupted.into()) } else { Ok(parts) }
}

/// Removes the part files of this process, which is about to end. No file is put in its place after this.
pub fn abandon() {
    let mut parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
    parts.ending = true;
    for path in std::mem::take(&mut parts.own) {
        let _ = fs::remove_file(path);
    }
}

/// A part file. If it is dropped, it is removed.
#[derive(Debug)]
pub(crate) struct Part {
    /// `None` once it has been put in its place.
    file: Option<NamedTempFile>,
    path: PathBuf,
}

impl Part {
    /// An empty part file in a folder, with the permissions that any new file would get. The first one in a folder also
    /// removes those of dead processes.
    pub(crate) fn new(folder: &Path) -> io::Result<Part> {
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
                return Ok(Part { file: Some(file), path });
            }
        }
        Err(io::ErrorKind::ResourceBusy.into())
    }

    /// The file.
    pub(crate) fn file(&mut self) -> io::Result<&mut File> {
        self.file.as_mut().map(NamedTempFile::as_file_mut).ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    /// Puts it in the place of another file, or of none. The caller holds the lock of all part files.
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

impl Drop for Part {
    fn drop(&mut self) {
        if let Some(file) = self.file.take() {
            let mut parts = PARTS.lock().unwrap_or_else(PoisonError::into_inner);
            drop(file);
            parts.own.remove(&self.path);
        }
    }
}

/// A second name in the folder of a file, under which it can be found again once its place is taken. Not every file system
/// has such names.
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
        // The system takes the umask of the process off these.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

/// Locks a new part file. False if another process took it for a dead one in between.
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

/// Removes the part files of processes that are dead. What cannot be removed stays.
fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_part = name.to_str().is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(SUFFIX));
        if !is_part || !entry.file_type().is_ok_and(|ty| ty.is_file()) {
            continue;
        }
        // The lock is held until the file is gone, so that no writer can think that the file is its own.
        let path = entry.path();
        if let Ok(file) = crate::open::beneath(folder, Path::new(&name), crate::open::For::Reading)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(path);
        }
    }
}
