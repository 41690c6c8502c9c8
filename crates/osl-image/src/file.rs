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
///
/// An existing file keeps its permissions, a new one gets those the process gives to any new file. A symbolic
/// link stays, and what it points to is replaced. A device or pipe is written to directly, since renaming over
/// it would destroy it.
pub fn replace(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    replace_with(path, |file| file.write_all(bytes).map_err(|e| ImageError::io(path, "write the file", e)))
}

/// A file that is being written.
pub(crate) trait Sink: Write + Seek + Send {}
impl<T: Write + Seek + Send> Sink for T {}

/// Replaces `path` by what `write` writes, as [`replace`] does; leaves it untouched if that fails.
pub(crate) fn replace_with<E: From<ImageError>>(
    path: &Path,
    write: impl FnOnce(&mut dyn Sink) -> Result<(), E>,
) -> Result<(), E> {
    let target = resolve(path);
    match fs::metadata(&target) {
        Ok(old) if old.is_dir() => Err(ImageError::input(path, "is a directory, not a file").into()),
        Ok(old) if old.is_file() => persist(path, &target, write, Some(old.permissions())),
        Ok(_) => {
            let mut bytes = Cursor::new(Vec::new());
            write(&mut bytes)?;
            Ok(write_through(path, &target, bytes.get_ref())?)
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => persist(path, &target, write, None),
        Err(error) => Err(ImageError::io(path, "look at the file", error).into()),
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

fn persist<E: From<ImageError>>(
    path: &Path,
    target: &Path,
    write: impl FnOnce(&mut dyn Sink) -> Result<(), E>,
    permissions: Option<fs::Permissions>,
) -> Result<(), E> {
    let dir = match target.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    };
    if !dir.is_dir() {
        return Err(ImageError::input(path, format!("there is no directory {}", dir.display())).into());
    }
    let mut temporary = temporary_in(dir)
        .map_err(|e| ImageError::io(path, format!("create a file in {}", dir.display()), e))?;
    let mut buffered = BufWriter::new(&mut temporary);
    write(&mut buffered)?;
    buffered.flush().map_err(|e| ImageError::io(path, "write the file", e))?;
    drop(buffered);
    if let Some(permissions) = permissions {
        let set = temporary.as_file().set_permissions(permissions);
        set.map_err(|e| ImageError::io(path, "set the permissions of the file", e))?;
    }
    temporary.persist(target).map_err(|e| ImageError::io(path, "replace the file", e.error))?;
    Ok(())
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
