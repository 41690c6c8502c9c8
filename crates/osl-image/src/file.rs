//! Opens and replaces whole files through `osl-files`, with errors that name the file.
//!
//! This module must not know image formats.

use crate::error::ImageError;
use osl_files::{Opened, Unsaved};
use osl_limits::Limits;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// An opened file to read from, with its path and length.
pub(crate) struct File {
    pub(crate) path: PathBuf,
    pub(crate) length: u64,
    pub(crate) source: BufReader<std::fs::File>,
}

/// An opened file, if it is not too long.
pub(crate) fn to_read(file: Opened, limits: &Limits) -> Result<File, ImageError> {
    let (path, length) = (file.path().to_owned(), file.length());
    let most = limits.images.file_bytes;
    if length > most {
        let reason = format!("is longer than {most} bytes (--limit images.file_bytes=N)");
        return Err(ImageError::format(&path, reason));
    }
    Ok(File { path, length, source: BufReader::new(file.into_file()) })
}

/// A file that the user named.
pub(crate) fn open_named(path: &Path, limits: &Limits) -> Result<File, ImageError> {
    to_read(osl_files::open_named(path).map_err(|error| ImageError::file(path, error))?, limits)
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
