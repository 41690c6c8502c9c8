//! Whole files in, whole files out: nothing else here opens a file.
//!
//! A file is replaced by writing a temporary one beside it and renaming that, so that a reader sees the old
//! bytes or the new ones and a failed run leaves the old file as it was. It must not know image formats.

use std::fs;
use std::io::{BufWriter, Cursor, Read, Seek, Write};
use std::path::{Path, PathBuf};

use crate::error::ImageError;

/// The largest file that [`read`] takes into memory, in bytes.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// Replaces `path` by a file of these bytes, or leaves it untouched and says why.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let mut file = Unsaved::new(path)?;
    let written = file.sink().write_all(bytes);
    written.map_err(|e| ImageError::io(path, "write the file", e))?;
    file.save()
}

/// A file that is written but not yet in its place: [`Unsaved::save`] puts it there, and if it is dropped, all is as it was
/// before.
///
/// An existing file keeps its permissions, a new one gets those the process gives to any new file. A symbolic
/// link stays, and what it points to is replaced. A device or pipe is written to directly, since renaming over
/// it would destroy it.
pub struct Unsaved {
    path: PathBuf,
    target: PathBuf,
    content: Content,
}

enum Content {
    Temporary(BufWriter<tempfile::NamedTempFile>, Option<fs::Permissions>),
    /// For what is no file.
    Bytes(Cursor<Vec<u8>>),
}

/// A file that is being written.
pub(crate) trait Sink: Write + Seek + Send {}
impl<T: Write + Seek + Send> Sink for T {}

impl Unsaved {
    /// An empty file for a path.
    ///
    /// **Errors**: the path is a directory, or there is none for it, or the system refuses.
    pub(crate) fn new(path: &Path) -> Result<Unsaved, ImageError> {
        let target = resolve(path);
        let content = match fs::metadata(&target) {
            Ok(old) if old.is_dir() => return Err(ImageError::input(path, "is a directory, not a file")),
            Ok(old) if old.is_file() => temporary_beside(path, &target, Some(old.permissions()))?,
            Ok(_) => Content::Bytes(Cursor::new(Vec::new())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                temporary_beside(path, &target, None)?
            }
            Err(error) => return Err(ImageError::io(path, "look at the file", error)),
        };
        Ok(Unsaved { path: path.to_owned(), target, content })
    }

    /// Where to write.
    pub(crate) fn sink(&mut self) -> &mut dyn Sink {
        match &mut self.content {
            Content::Temporary(file, _) => file,
            Content::Bytes(bytes) => bytes,
        }
    }

    /// Puts the file in its place.
    ///
    /// **Errors**: what the disk refuses; what was there before is there still.
    pub fn save(self) -> Result<(), ImageError> {
        let Unsaved { path, target, content } = self;
        match content {
            Content::Bytes(bytes) => write_through(&path, &target, bytes.get_ref()),
            Content::Temporary(file, permissions) => {
                let file =
                    file.into_inner().map_err(|e| ImageError::io(&path, "write the file", e.into_error()))?;
                if let Some(permissions) = permissions {
                    let set = file.as_file().set_permissions(permissions);
                    set.map_err(|e| ImageError::io(&path, "set the permissions of the file", e))?;
                }
                file.persist(target).map_err(|e| ImageError::io(&path, "replace the file", e.error))?;
                Ok(())
            }
        }
    }
}

/// Reads all of a file, up to the size limit.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>, ImageError> {
    let file = fs::File::open(path).map_err(|e| ImageError::io(path, "open the file", e))?;
    let meta = file.metadata().map_err(|e| ImageError::io(path, "look at the file", e))?;
    if meta.is_dir() {
        return Err(ImageError::input(path, "is a directory, not a file"));
    }
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too long from one that just fits, also where the
    // length is not known beforehand.
    file.take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| ImageError::io(path, "read the file", e))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(ImageError::format(path, format!("longer than {MAX_FILE_BYTES} bytes")));
    }
    Ok(bytes)
}

/// The file behind links; the path itself where nothing is there yet.
fn resolve(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

fn temporary_beside(
    path: &Path,
    target: &Path,
    permissions: Option<fs::Permissions>,
) -> Result<Content, ImageError> {
    let dir = match target.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    };
    if !dir.is_dir() {
        return Err(ImageError::input(path, format!("there is no directory {}", dir.display())));
    }
    let temporary = temporary_in(dir)
        .map_err(|e| ImageError::io(path, format!("create a file in {}", dir.display()), e))?;
    Ok(Content::Temporary(BufWriter::new(temporary), permissions))
}

/// A temporary file with the permissions that any new file would get.
fn temporary_in(dir: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".image-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The system takes the process's umask off these.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(dir)
}

fn write_through(path: &Path, target: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let opened = fs::OpenOptions::new().write(true).open(target);
    let mut file = opened.map_err(|e| ImageError::io(path, "open the file", e))?;
    file.write_all(bytes).map_err(|e| ImageError::io(path, "write the file", e))
}
