//! Opens and replaces whole files through `osl-files`, with errors that name the file.

use crate::error::ImageError;
use crate::search::ImageSource;
use osl_files::Unsaved;
use osl_limits::Limits;
use std::path::Path;

/// A file, if it is not too long.
pub(crate) fn to_read(file: ImageSource, limits: &Limits) -> Result<ImageSource, ImageError> {
    let most = limits.images.file_bytes;
    if file.length > most {
        let reason = format!("is longer than {most} bytes (--limit images.file_bytes=N)");
        return Err(ImageError::format(&file.path, reason));
    }
    Ok(file)
}

/// A file that the user named.
pub(crate) fn open_named(path: &Path, limits: &Limits) -> Result<ImageSource, ImageError> {
    let file = osl_files::open_named(path).map_err(|error| ImageError::file(path, error))?;
    to_read(ImageSource::on_disk(file), limits)
}

/// An empty file that will replace the one at a path.
pub(crate) fn unsaved(path: &Path) -> Result<Unsaved, ImageError> {
    Ok(Unsaved::new(path)?)
}

/// A file with these bytes that will replace the one at a path.
pub(crate) fn with(path: &Path, bytes: &[u8]) -> Result<Unsaved, ImageError> {
    Ok(Unsaved::new(path)?.with(bytes)?)
}

/// Replaces a file by these bytes, or leaves it untouched.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    Ok(osl_files::replace(path, bytes)?)
}
