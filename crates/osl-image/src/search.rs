//! Where texture files are searched for.
//!
//! A shader names the files that it reads, and a shader may come from anywhere. So unless the user says
//! otherwise, only files below the working directory or a search path are opened. This module must not know
//! image formats; `osl-files` keeps names inside the folders.

use osl_files::{FileError, Opened, Roots};
use std::path::{Path, PathBuf};

/// The folders to search.
#[derive(Debug, Default)]
pub(crate) struct Search {
    /// Searched after the working directory, in order.
    folders: Vec<PathBuf>,
    roots: Roots,
}

impl Search {
    /// The working directory, then these folders.
    pub(crate) fn new(folders: Vec<PathBuf>) -> Search {
        let here = PathBuf::new();
        let roots = Roots::new(std::iter::once(&here).chain(&folders));
        Search { folders, roots }
    }

    /// Sets whether files elsewhere may be opened too.
    pub(crate) fn or_anywhere(self, anywhere: bool) -> Search {
        Search { roots: self.roots.or_anywhere(anywhere), ..self }
    }

    /// The folders after the working directory.
    pub(crate) fn folders(&self) -> &[PathBuf] {
        &self.folders
    }

    /// Opens the first file with this name.
    pub(crate) fn open(&self, name: &str) -> Result<Opened, FileError> {
        let name = Path::new(name);
        let beside = self.folders.iter().map(|folder| folder.join(name));
        self.roots.first(std::iter::once(name.to_owned()).chain(beside))
    }
}
