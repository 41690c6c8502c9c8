//! Folders below which files may be opened, and the checks that keep names inside them.
//!
//! A shader, group, scene or header may come from anywhere. A file named in it is opened only if it is below
//! a root after all links are resolved. Names are judged by their text first, so that no answer reveals what
//! is outside.

use crate::error::{FileError, OPEN};
use crate::open::{self, For};
use crate::read::Opened;
use std::fs;
use std::io::Write;
use std::path::{Component, Path, PathBuf};

/// Maximum number of links in a chain, as in Linux.
const MAX_LINKS: usize = 40;

/// The folders below which files may be opened.
#[derive(Clone, Debug, Default)]
pub struct Roots {
    /// The folders as written, made absolute.
    written: Vec<PathBuf>,
    /// The folders with links resolved; without those that do not exist.
    real: Vec<PathBuf>,
    anywhere: bool,
}

impl Roots {
    /// The roots for these folders; the empty path is the working directory. They are resolved here, once.
    pub fn new<P: AsRef<Path>>(folders: impl IntoIterator<Item = P>) -> Roots {
        let mut roots = Roots::default();
        folders.into_iter().for_each(|folder| roots.add(folder.as_ref()));
        roots
    }

    /// Adds a folder, unless it does not exist.
    pub fn add(&mut self, folder: &Path) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if let (Some(written), Ok(real)) = (written_out(folder), fs::canonicalize(folder))
            && !self.written.contains(&written)
        {
            self.written.push(written);
            self.real.push(real);
        }
    }

    /// Permits files anywhere if `anywhere` is set; they still have to be plain files.
    #[must_use]
    pub fn or_anywhere(mut self, anywhere: bool) -> Roots {
        self.anywhere = anywhere;
        self
    }

    /// Opens the file at a path for reading.
    ///
    /// # Errors
    /// There is none, it is outside the roots, it is not a plain file, or the system refuses.
    pub fn open(&self, path: &Path) -> Result<Opened, FileError> {
        let file = match self.anywhere {
            true => open::anywhere(path, For::Reading)?,
            false => {
                let real = self.real(path)?;
                let (root, below) = self.below(&real).ok_or(FileError::Outside)?;
                open::beneath(root, below, For::Reading)?
            }
        };
        Opened::new(file, path.to_owned())
    }

    /// Opens the file to which a path leads for reading, also if only the text of the path is outside the
    /// roots: its folders may be links.
    ///
    /// # Errors
    /// Those of [`Roots::open`].
    pub fn open_target(&self, path: &Path) -> Result<Opened, FileError> {
        match self.open(path) {
            Err(FileError::Outside) => {
                let real = fs::canonicalize(path).map_err(|_| FileError::Outside)?;
                Ok(self.open(&real)?.named(path))
            }
            other => other,
        }
    }

    /// Whether a file at a path could be opened by [`Roots::open_target`], whether or not one is there.
    pub fn may_hold(&self, path: &Path) -> bool {
        let is_below = |real: &Path| self.below(real).is_some();
        self.anywhere
            || match self.real(path) {
                Ok(real) => is_below(&real),
                Err(FileError::Outside) => fs::canonicalize(path).is_ok_and(|real| is_below(&real)),
                Err(error) => matches!(error, FileError::NotFound),
            }
    }

    /// Opens the first of several paths at which there is something.
    ///
    /// # Errors
    /// Those of [`Roots::open`]. If nothing exists at any path and one leads outside, the error says so.
    pub fn first(&self, paths: impl IntoIterator<Item = PathBuf>) -> Result<Opened, FileError> {
        let mut answer = FileError::NotFound;
        for path in paths {
            match self.open(&path) {
                Err(FileError::NotFound | FileError::NotAFile(crate::Kind::Folder)) => {}
                Err(FileError::Outside) => answer = FileError::Outside,
                other => return other,
            }
        }
        Err(answer)
    }

    /// Appends to the file at a path and creates it if necessary.
    ///
    /// # Errors
    /// As for [`Roots::open`]. Also refused, unless files may be anywhere: paths with a component that begins
    /// with a dot, since programs keep their settings there.
    pub fn append(&self, path: &Path, bytes: &[u8]) -> Result<(), FileError> {
        let mut file =
            if self.anywhere { open::anywhere(path, For::Creating)? } else { self.open_to_append(path)? };
        file.write_all(bytes).map_err(FileError::io("write the file"))
    }

    /// Says whether the file at a path may be replaced: it is there, it is a plain file below the roots with
    /// links resolved, and it is not write-protected.
    ///
    /// # Errors
    /// As for [`Roots::append`], except that a missing file is an error.
    pub fn may_replace(&self, path: &Path) -> Result<(), FileError> {
        self.to_replace(path).map(drop)
    }

    /// The real path of a file that may be replaced.
    pub(crate) fn to_replace(&self, path: &Path) -> Result<PathBuf, FileError> {
        // Opening it for appending shows whether it may be written; nothing is appended.
        let (real, file) = if self.anywhere {
            let real = fs::canonicalize(path).map_err(FileError::io(OPEN))?;
            let file = open::anywhere(&real, For::Appending)?;
            (real, file)
        } else {
            let real = self.real(path)?;
            let file = self.open_real(&real, For::Appending)?;
            (real, file)
        };
        let about = file.metadata().map_err(FileError::io("look at the file"))?;
        if about.permissions().readonly() {
            return Err(FileError::Protected);
        }
        Ok(real)
    }

    fn open_to_append(&self, path: &Path) -> Result<fs::File, FileError> {
        let (real, what) = match self.real(path) {
            Ok(real) => (real, For::Appending),
            Err(FileError::NotFound) => {
                let name = path.file_name().ok_or(FileError::NotFound)?;
                // Only the file itself may be missing. If the name is a dangling link, opening it fails.
                let folder = path.parent().filter(|dir| !dir.as_os_str().is_empty());
                (self.real(folder.unwrap_or(Path::new(".")))?.join(name), For::Creating)
            }
            Err(other) => return Err(other),
        };
        self.open_real(&real, what)
    }

    /// Opens the file at a real path for writing.
    fn open_real(&self, real: &Path, what: For) -> Result<fs::File, FileError> {
        let (root, below) = self.below(real).ok_or(FileError::Outside)?;
        if below.components().any(|name| name.as_os_str().as_encoded_bytes().starts_with(b".")) {
            return Err(FileError::Hidden);
        }
        open::beneath(root, below, what)
    }

    /// The path with links resolved.
    fn real(&self, path: &Path) -> Result<PathBuf, FileError> {
        let written = written_out(path).ok_or(FileError::NotFound)?;
        if !self.written.iter().chain(&self.real).any(|root| written.starts_with(root)) {
            return Err(FileError::Outside);
        }
        let real = fs::canonicalize(path);
        real.map_err(|_| self.missing(path, MAX_LINKS))
    }

    /// Why there is nothing at a path. The answer depends on where the existing part of the path leads, not
    /// on what is there.
    fn missing(&self, path: &Path, links: usize) -> FileError {
        let Ok(path) = std::path::absolute(path) else { return FileError::NotFound };
        for part in path.ancestors() {
            if let Ok(real) = fs::canonicalize(part) {
                return if self.below(&real).is_some() { FileError::NotFound } else { FileError::Outside };
            }
            if let Ok(target) = fs::read_link(part) {
                let from = part.parent().unwrap_or(Path::new("/"));
                return match links.checked_sub(1) {
                    Some(links) => self.missing(&from.join(target), links),
                    None => FileError::Outside,
                };
            }
        }
        FileError::NotFound
    }

    /// The root that contains a real path, and the rest of the path.
    fn below<'a>(&'a self, real: &'a Path) -> Option<(&'a Path, &'a Path)> {
        self.real.iter().find_map(|root| Some((root.as_path(), real.strip_prefix(root).ok()?)))
    }
}

/// An absolute path without `.` and `..`, computed from its text alone.
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
