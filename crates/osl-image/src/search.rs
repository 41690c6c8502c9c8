//! Where texture files are searched for.
//!
//! A shader names the files that it reads, and a shader may come from anywhere. So unless the user says
//! otherwise, only files below the working directory or a search path are opened; `osl-files` keeps names
//! inside the folders. A client may also provide all files from memory.

use crate::image::Source;
use crate::udim::{self, Square};
use osl_files::{FileError, Roots};
use std::collections::BTreeSet;
use std::io::{BufReader, Cursor};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns the bytes of the file with a name, from wherever a client keeps them; `None` if there is none.
pub type ReadFile = Arc<dyn Fn(&str) -> Option<Arc<[u8]>> + Send + Sync>;

/// Where files are.
pub(crate) enum Search {
    /// Below folders.
    Folders {
        /// Searched after the working directory, in order.
        folders: Vec<PathBuf>,
        roots: Roots,
        /// Names that may lead anywhere.
        trusted: BTreeSet<String>,
    },
    /// Wherever the client keeps them.
    Given(ReadFile),
}

/// A file to read from.
pub(crate) struct ImageSource {
    /// Its name in messages.
    pub(crate) path: PathBuf,
    /// Bytes.
    pub(crate) length: u64,
    pub(crate) source: Box<dyn Source>,
}

impl std::fmt::Debug for Search {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Search::Folders { folders, .. } => f.debug_tuple("Folders").field(folders).finish(),
            Search::Given(_) => f.write_str("Given"),
        }
    }
}

impl ImageSource {
    /// A file on the disk.
    pub(crate) fn on_disk(file: osl_files::Opened) -> ImageSource {
        let (path, length) = (file.path().to_owned(), file.length());
        ImageSource { path, length, source: Box::new(BufReader::new(file.into_file())) }
    }
}

impl Search {
    /// The working directory, then these folders.
    pub(crate) fn new(folders: Vec<PathBuf>) -> Search {
        let here = PathBuf::new();
        let roots = Roots::new(std::iter::once(&here).chain(&folders));
        Search::Folders { folders, roots, trusted: BTreeSet::new() }
    }

    /// Sets whether files elsewhere may be opened too.
    pub(crate) fn or_anywhere(self, anywhere: bool) -> Search {
        match self {
            Search::Folders { folders, roots, trusted } => {
                Search::Folders { folders, roots: roots.or_anywhere(anywhere), trusted }
            }
            given => given,
        }
    }

    /// Lets these names lead to files anywhere; of a tiled name, the names of the usual squares.
    pub(crate) fn trusting(self, names: impl IntoIterator<Item = String>) -> Search {
        match self {
            Search::Folders { folders, roots, mut trusted } => {
                for name in names {
                    if udim::is_pattern(&name) {
                        trusted.extend(Square::usual().filter_map(|square| square.name(&name)));
                    }
                    trusted.insert(name);
                }
                Search::Folders { folders, roots, trusted }
            }
            given => given,
        }
    }

    /// The folders after the working directory.
    pub(crate) fn folders(&self) -> &[PathBuf] {
        match self {
            Search::Folders { folders, .. } => folders,
            Search::Given(_) => &[],
        }
    }

    /// Whether files are on the disk, so that folders can be listed.
    pub(crate) fn is_on_disk(&self) -> bool {
        matches!(self, Search::Folders { .. })
    }

    /// Whether there is a file with this name.
    ///
    /// # Errors
    /// Why there is none.
    pub(crate) fn find(&self, name: &str) -> Result<(), FileError> {
        self.open(name).map(|_| ())
    }

    /// Opens the first file with this name.
    pub(crate) fn open(&self, name: &str) -> Result<ImageSource, FileError> {
        match self {
            Search::Folders { folders, roots, trusted } => {
                let path = Path::new(name);
                let beside = folders.iter().map(|folder| folder.join(path));
                let mut places = std::iter::once(path.to_owned()).chain(beside);
                let found = match trusted.contains(name) {
                    true => Roots::default().or_anywhere(true).first(&mut places),
                    false => roots.first(&mut places),
                };
                found.map(ImageSource::on_disk)
            }
            Search::Given(read) => {
                let bytes = read(name).ok_or(FileError::NotFound)?;
                let length = bytes.len() as u64;
                Ok(ImageSource { path: PathBuf::from(name), length, source: Box::new(Cursor::new(bytes)) })
            }
        }
    }
}
