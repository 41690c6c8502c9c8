//! Where texture files are looked for, and which of them may be opened.
//!
//! A shader names the files that it reads, and a shader may come from anywhere. So unless the user says
//! otherwise, only what lies below the working directory or a search path is opened: an absolute name, `..`
//! or a symbolic link that leads elsewhere is refused. It must not know image formats.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Why there is no file to open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// No place has such a file.
    NotFound,
    /// The name leads out of the places that may be read, whether or not something is there.
    Outside,
}

/// The places to look in.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// Looked in after the working directory, in order.
    pub(crate) folders: Vec<PathBuf>,
    /// Whether files elsewhere may be opened too.
    pub(crate) anywhere: bool,
}

impl Search {
    /// The first file of this name.
    pub(crate) fn find(&self, name: &str) -> Result<PathBuf, Refusal> {
        let name = Path::new(name);
        let mut places =
            std::iter::once(name.to_owned()).chain(self.folders.iter().map(|dir| dir.join(name)));
        if self.anywhere {
            return places.find(|path| is_file(path)).ok_or(Refusal::NotFound);
        }
        let roots = Roots::of(&self.folders);
        let mut refusal = Refusal::NotFound;
        for path in places {
            match roots.admit(&path) {
                Ok(()) => return Ok(path),
                Err(Refusal::Outside) => refusal = Refusal::Outside,
                Err(Refusal::NotFound) => {}
            }
        }
        Err(refusal)
    }
}

/// The folders below which files may be opened.
struct Roots {
    /// As they are written, made absolute.
    written: Vec<PathBuf>,
    /// Behind all links; folders that are not there are left out.
    real: Vec<PathBuf>,
}

impl Roots {
    fn of(folders: &[PathBuf]) -> Self {
        let here = PathBuf::from(".");
        let all = || std::iter::once(&here).chain(folders);
        Self {
            written: all().filter_map(|folder| written_out(folder)).collect(),
            real: all().filter_map(|folder| fs::canonicalize(folder).ok()).collect(),
        }
    }

    fn admit(&self, path: &Path) -> Result<(), Refusal> {
        // The name alone is judged first, so that the answer does not tell what lies outside.
        let written = written_out(path).ok_or(Refusal::NotFound)?;
        if !self.written.iter().chain(&self.real).any(|root| written.starts_with(root)) {
            return Err(Refusal::Outside);
        }
        let real = fs::canonicalize(path).map_err(|_| Refusal::NotFound)?;
        if !self.real.iter().any(|root| real.starts_with(root)) {
            return Err(Refusal::Outside);
        }
        if is_file(&real) { Ok(()) } else { Err(Refusal::NotFound) }
    }
}

/// An absolute path without `.` and `..`, by its text alone.
fn written_out(path: &Path) -> Option<PathBuf> {
    let mut written = PathBuf::new();
    for component in std::path::absolute(path).ok()?.components() {
        match component {
            Component::ParentDir => {
                written.pop();
            }
            Component::CurDir => {}
            other => written.push(other),
        }
    }
    Some(written)
}

/// Whether there is a plain file; opening a pipe would wait for its writer.
fn is_file(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|meta| meta.is_file())
}
