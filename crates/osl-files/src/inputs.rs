//! The files that the process has read and written, so that an output does not replace an input by mistake.
//!
//! Files are compared by what they are, not by their names: links of both kinds lead to the same file. The
//! list begins with [`protect_inputs`], because a program that makes pictures one after the other may write a
//! file that it has read for an earlier one.

use crate::error::FileError;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The files of a piece of work.
#[derive(Debug, Default)]
struct Inputs {
    /// By the first path that led to each.
    read: BTreeMap<Id, PathBuf>,
    /// Files that may be replaced even if they are read.
    rewritten: BTreeSet<Id>,
    /// Outputs that are in their places.
    written: BTreeSet<PathBuf>,
}

/// What a piece of work has read and written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Used {
    /// The files that it read, sorted.
    pub read: Vec<PathBuf>,
    /// The files that it wrote, sorted.
    pub written: Vec<PathBuf>,
}

/// `None` if nothing is protected.
static INPUTS: Mutex<Option<Inputs>> = Mutex::new(None);

fn with(work: impl FnOnce(&mut Inputs)) {
    // The sets are never left half-changed, so a panic elsewhere does not corrupt them.
    if let Some(inputs) = &mut *INPUTS.lock().unwrap_or_else(PoisonError::into_inner) {
        work(inputs);
    }
}

/// From now on, no output of this process replaces a file that it reads, except those of [`permit_rewrite`].
pub fn protect_inputs() {
    *INPUTS.lock().unwrap_or_else(PoisonError::into_inner) = Some(Inputs::default());
}

/// Begins another piece of work: files that were read for earlier ones no longer count.
pub fn forget_inputs() {
    with(|inputs| *inputs = Inputs::default());
}

/// The files that were read and written since [`protect_inputs`] or [`forget_inputs`]; none before.
pub fn used() -> Used {
    let mut used = Used::default();
    with(|inputs| {
        let read: BTreeSet<_> = inputs.read.values().collect();
        used.read = read.into_iter().cloned().collect();
        used.written = inputs.written.iter().cloned().collect();
    });
    used
}

/// Permits that a file is replaced although it is read: the user wants it to be changed.
pub fn permit_rewrite(path: &Path) {
    with(|inputs| inputs.rewritten.extend(id::of(path)));
}

/// Adds a file that was opened for reading.
pub(crate) fn note(file: &File, path: &Path) {
    with(|inputs| {
        if let Some(id) = id::of_opened(file, path) {
            inputs.read.entry(id).or_insert_with(|| path.to_owned());
        }
    });
}

/// Adds an output that is in its place.
pub(crate) fn note_written(path: &Path) {
    with(|inputs| {
        inputs.written.insert(path.to_owned());
    });
}

/// Fails if the file at a path was read and must not be replaced.
pub(crate) fn check(target: &Path) -> Result<(), FileError> {
    let mut is_input = false;
    with(|inputs| {
        is_input =
            id::of(target).is_some_and(|id| inputs.read.contains_key(&id) && !inputs.rewritten.contains(&id));
    });
    if is_input { Err(FileError::IsRead) } else { Ok(()) }
}

/// Whether two paths lead to one existing file: by links of any kind, or as two spellings of its name.
pub fn is_same(a: &Path, b: &Path) -> bool {
    id::of(a).is_some_and(|a| id::of(b) == Some(a))
}

use id::Id;

#[cfg(unix)]
mod id {
    use std::fs::{File, Metadata};
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;

    /// Device and inode.
    pub(super) type Id = (u64, u64);

    fn id(meta: &Metadata) -> Id {
        (meta.dev(), meta.ino())
    }

    pub(super) fn of_opened(file: &File, _: &Path) -> Option<Id> {
        file.metadata().ok().map(|meta| id(&meta))
    }

    pub(super) fn of(path: &Path) -> Option<Id> {
        std::fs::metadata(path).ok().map(|meta| id(&meta))
    }
}

#[cfg(not(unix))]
mod id {
    use std::fs::File;
    use std::path::{Path, PathBuf};

    /// The real path. Two names of one file (hard links) are not recognised.
    pub(super) type Id = PathBuf;

    pub(super) fn of_opened(_: &File, path: &Path) -> Option<Id> {
        of(path)
    }

    pub(super) fn of(path: &Path) -> Option<Id> {
        std::fs::canonicalize(path).ok()
    }
}
