//! Whole files in and out, through the door of `osl-files`, with errors that name the file.
//!
//! It must not know image formats.

use crate::error::ImageError;
use osl_files::{Opened, Unsaved};
use std::path::Path;

/// The largest file that is taken into memory, in bytes.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// All bytes of an opened file.
pub(crate) fn read(file: Opened) -> Result<Vec<u8>, ImageError> {
    let path = file.path().to_owned();
    file.bytes(MAX_FILE_BYTES).map_err(|error| ImageError::file(&path, error))
}

/// All bytes of a file that the user named.
pub(crate) fn read_named(path: &Path) -> Result<Vec<u8>, ImageError> {
    read(osl_files::open_named(path).map_err(|error| ImageError::file(path, error))?)
}

/// An empty file that is to replace the one at a path.
pub(crate) fn unsaved(path: &Path) -> Result<Unsaved, ImageError> {
    Ok(Unsaved::new(path)?)
}

/// A file of these bytes that is to replace the one at a path.
pub(crate) fn with(path: &Path, bytes: &[u8]) -> Result<Unsaved, ImageError> {
    Ok(Unsaved::new(path)?.with(bytes)?)
}

/// Replaces a file by one of these bytes, or leaves it untouched.
pub(crate) fn replace(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    Ok(osl_files::replace(path, bytes)?)
}
