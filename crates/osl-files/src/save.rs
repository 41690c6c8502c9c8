//! Writes whole files: an output is written next to its target and renamed when it is complete.
//!
//! So a reader sees either the old bytes or the new ones, and a failed or killed run leaves the old file
//! unchanged.

use crate::error::{FileError, Kind, SaveError};
use crate::parts::{self, PartFile};
use crate::roots::Roots;
use crate::{inputs, open};
use std::ffi::OsStr;
use std::fs;
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};

/// Replaces the file at `path` by these bytes, or leaves it untouched.
///
/// # Errors
/// As for [`Unsaved::new`] and [`Unsaved::save`].
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    Unsaved::new(path)?.with(bytes)?.save()
}

/// The same for a command that changes a file that it reads, such as a formatter.
///
/// # Errors
/// As for [`replace`].
pub fn rewrite(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    inputs::permit_rewrite(path);
    replace(path, bytes)
}

/// A file that is written but not yet at its target: [`Unsaved::save`] moves it there. If it is dropped,
/// nothing changes.
///
/// An existing file keeps its permissions; a new one gets those of any new file. A symbolic link stays, and
/// its target is replaced. A device or pipe is written to directly, since renaming would destroy it. If
/// inputs are protected ([`crate::protect_inputs`]), a file that was read is not replaced.
#[derive(Debug)]
#[must_use = "the file is in its place once it is saved"]
pub struct Unsaved {
    path: PathBuf,
    target: PathBuf,
    content: Content,
}

#[derive(Debug)]
enum Content {
    Part(BufWriter<PartFile>, Option<fs::Permissions>),
    /// For a pipe or device.
    Bytes(Cursor<Vec<u8>>),
}

/// A file that is being written.
pub trait Sink: Write + Seek + Send {}
impl<T: Write + Seek + Send> Sink for T {}

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file()?.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file()?.flush()
    }
}

impl Seek for PartFile {
    fn seek(&mut self, to: io::SeekFrom) -> io::Result<u64> {
        self.file()?.seek(to)
    }
}

impl Unsaved {
    /// Creates an empty file for a path that the user named. Links are followed, also to files that do not
    /// exist yet.
    ///
    /// # Errors
    /// The path belongs to a folder, a socket or a disk, the file is write-protected, its folder does not
    /// exist, or the system refuses.
    pub fn new(path: &Path) -> Result<Unsaved, SaveError> {
        let target = fs::canonicalize(path).unwrap_or_else(|_| followed(path));
        Unsaved::at(path, target).map_err(SaveError::of(path))
    }

    /// Creates an empty file in a folder that the user named, under a name derived from names in a shader.
    /// Such a file has to be in the folder, even if there is a link of that name.
    ///
    /// # Errors
    /// As for [`Unsaved::new`]; also if the file would be elsewhere, or its name is not plain, see
    /// [`is_plain_name`].
    pub fn derived(folder: &Path, name: impl AsRef<OsStr>) -> Result<Unsaved, SaveError> {
        let path = folder.join(name.as_ref());
        let target = || {
            let shown = name.as_ref().to_string_lossy();
            if !is_plain_name(&shown) {
                return Err(FileError::Name(shown.escape_debug().to_string()));
            }
            let real = fs::canonicalize(folder_of(&path)).map_err(FileError::io("find the folder"))?;
            match fs::canonicalize(&path) {
                Ok(target) if !target.starts_with(&real) => Err(FileError::Outside),
                Ok(target) => Ok(target),
                Err(_) => Ok(path.clone()),
            }
        };
        target().and_then(|target| Unsaved::at(&path, target)).map_err(SaveError::of(&path))
    }

    /// Creates an empty file that replaces an existing one below the roots. A symbolic link stays, and its
    /// target is replaced, which is below the roots too. The file may be one that was read.
    ///
    /// # Errors
    /// As for [`Roots::may_replace`]; also if the system refuses a new file in the folder.
    pub fn existing(roots: &Roots, path: &Path) -> Result<Unsaved, SaveError> {
        let target = roots.to_replace(path);
        let permitted = target.inspect(|target| inputs::permit_rewrite(target));
        permitted.and_then(|target| Unsaved::at(path, target)).map_err(SaveError::of(path))
    }

    /// A file in memory, for bytes that go to a stream instead of a path: [`Unsaved::into_bytes`] returns
    /// them.
    pub fn in_memory() -> Unsaved {
        let content = Content::Bytes(Cursor::new(Vec::new()));
        Unsaved { path: PathBuf::new(), target: PathBuf::new(), content }
    }

    /// The bytes of a file in memory; empty for other files.
    pub fn into_bytes(self) -> Vec<u8> {
        match self.content {
            Content::Bytes(bytes) => bytes.into_inner(),
            Content::Part(..) => Vec::new(),
        }
    }

    fn at(path: &Path, target: PathBuf) -> Result<Unsaved, FileError> {
        inputs::check(&target)?;
        let look = FileError::io("look at the file");
        let content = match fs::metadata(&target) {
            Ok(old) => match open::kind_of(old.file_type()) {
                None if is_protected(&target, &old) => return Err(FileError::Protected),
                None => part_beside(&target, Some(old.permissions()))?,
                Some(kind @ (Kind::Folder | Kind::Socket)) => return Err(FileError::NotAFile(kind)),
                Some(Kind::Device) if is_disk(&old) => return Err(FileError::NotAFile(Kind::Device)),
                Some(Kind::Pipe | Kind::Device) => Content::Bytes(Cursor::new(Vec::new())),
            },
            Err(error) if error.kind() == io::ErrorKind::NotFound => part_beside(&target, None)?,
            Err(error) => return Err(look(error)),
        };
        Ok(Unsaved { path: path.to_owned(), target, content })
    }

    /// The requested path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes these bytes at the current position and returns the file.
    ///
    /// # Errors
    /// The system refuses.
    pub fn with(mut self, bytes: &[u8]) -> Result<Unsaved, SaveError> {
        let written = self.sink().write_all(bytes).map_err(FileError::io("write the file"));
        written.map_err(SaveError::of(&self.path))?;
        Ok(self)
    }

    /// Where to write.
    pub fn sink(&mut self) -> &mut dyn Sink {
        match &mut self.content {
            Content::Part(file, _) => file,
            Content::Bytes(bytes) => bytes,
        }
    }

    /// Moves the file to its target.
    ///
    /// # Errors
    /// The system refuses. The old file is then still there.
    pub fn save(self) -> Result<(), SaveError> {
        save_all(vec![self])
    }

    /// Writes out buffered bytes, so that only renaming is left to do.
    fn complete(self) -> (PathBuf, Result<Ready, FileError>) {
        let Unsaved { path, target, content } = self;
        let ready = match content {
            Content::Bytes(bytes) => {
                write_through(&target, bytes.get_ref()).map(|()| Ready { target, part: None })
            }
            // Once more: the file may have been read after this one was created.
            Content::Part(file, permissions) => inputs::check(&target)
                .and_then(|()| completed(file, permissions))
                .map(|part| Ready { target, part: Some(part) }),
        };
        (path, ready)
    }
}

/// A file that only has to be renamed; `None` if it was written to a pipe or device.
struct Ready {
    target: PathBuf,
    part: Option<PartFile>,
}

fn completed(file: BufWriter<PartFile>, permissions: Option<fs::Permissions>) -> Result<PartFile, FileError> {
    let mut part = file.into_inner().map_err(|e| FileError::io("write the file")(e.into_error()))?;
    let handle = part.file().map_err(FileError::io("write the file"))?;
    if let Some(permissions) = permissions {
        handle.set_permissions(permissions).map_err(FileError::io("set the permissions of the file"))?;
    }
    Ok(part)
}

/// Moves all files to their targets, or none as far as the file system permits: if one file cannot be moved,
/// files that were already replaced are restored.
///
/// # Errors
/// The first file that could not be moved, and why.
pub fn save_all(files: Vec<Unsaved>) -> Result<(), SaveError> {
    let several = files.len() > 1;
    let mut ready = Vec::new();
    for file in files {
        let (path, one) = file.complete();
        ready.push((one.map_err(SaveError::of(&path))?, path));
    }
    // A signal that ends the process waits until all files are at their targets.
    let mut parts =
        parts::parts().map_err(FileError::io(REPLACE)).map_err(SaveError::of(Path::new("output")))?;
    // The targets replaced so far, each with the second name of the old file.
    let mut done: Vec<(PathBuf, Option<PathBuf>)> = Vec::new();
    let mut result = Ok(());
    for (one, path) in &mut ready {
        let Some(part) = &mut one.part else { continue };
        let old = if several { parts::second_name(&one.target) } else { None };
        let moved = part.persist(&one.target, &mut parts);
        if moved.is_ok() {
            done.push((one.target.clone(), old));
            continue;
        }
        old.map(fs::remove_file);
        result = moved.map_err(FileError::io(REPLACE)).map_err(SaveError::of(path));
        break;
    }
    for (target, old) in done {
        let _ = match (&result, old) {
            (Ok(()), Some(old)) => fs::remove_file(old),
            (Ok(()), None) => Ok(()),
            (Err(_), Some(old)) => fs::rename(old, target),
            (Err(_), None) => fs::remove_file(target),
        };
    }
    // The remaining part files are removed when they are dropped, which takes the same lock.
    drop(parts);
    if result.is_ok() {
        ready.iter().for_each(|(_, path)| inputs::note_written(path));
    }
    result
}

/// The step that moves a file to its target.
const REPLACE: &str = "replace the file";

/// Whether a text can be part of a file name: it is not empty, has no path separators and no control
/// characters.
pub fn is_plain_name(name: &str) -> bool {
    let plain = |c: char| !c.is_control() && !matches!(c, '/' | '\\');
    !name.is_empty() && !matches!(name, "." | "..") && name.chars().all(plain)
}

/// Links that are followed from one name; a longer chain is probably a circle.
const MAX_LINKS: usize = 40;

/// Where a link leads whose target does not exist. Other paths stay as they are.
fn followed(path: &Path) -> PathBuf {
    let mut at = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&at) {
            Ok(target) => at = folder_of(&at).join(target),
            Err(_) => return at,
        }
    }
    path.to_owned()
}

/// Whether a file must not be changed: renaming another file to its name would not ask for permission.
fn is_protected(target: &Path, about: &fs::Metadata) -> bool {
    let refused = |e: &io::Error| e.kind() == io::ErrorKind::PermissionDenied;
    // Nothing is appended.
    about.permissions().readonly()
        || fs::OpenOptions::new().append(true).open(target).is_err_and(|e| refused(&e))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn part_beside(target: &Path, permissions: Option<fs::Permissions>) -> Result<Content, FileError> {
    let folder = folder_of(target);
    if !folder.is_dir() {
        return Err(FileError::NoFolder(folder.to_owned()));
    }
    let part = PartFile::new(folder).map_err(FileError::io("create a file in its folder"))?;
    Ok(Content::Part(BufWriter::new(part), permissions))
}

fn write_through(target: &Path, bytes: &[u8]) -> Result<(), FileError> {
    // If nobody reads the pipe, the system returns an error here instead of waiting forever.
    let mut file = open::to_write_through(target).map_err(FileError::io("write to it"))?;
    open::wait_for_data(&file).map_err(FileError::io("write to it"))?;
    file.write_all(bytes).map_err(FileError::io("write to it"))
}

/// Whether a file is a disk: writing an image to it would destroy its contents.
#[cfg(unix)]
fn is_disk(meta: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    meta.file_type().is_block_device()
}

#[cfg(not(unix))]
fn is_disk(_: &fs::Metadata) -> bool {
    false
}
