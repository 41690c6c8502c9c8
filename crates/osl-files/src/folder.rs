//! Finds the files of a folder that the user named.

use crate::error::FileError;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// Most entries of folders that one search looks at.
const MOST: usize = 1 << 20;

/// The files with an extension in a folder and the folders below it, sorted. Links to folders are not
/// followed, and folders whose name begins with a dot are left out.
///
/// # Errors
/// A folder cannot be read, or there are more than a million entries.
pub fn files_below(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, FileError> {
    let (mut folders, mut found, mut seen) = (vec![folder.to_owned()], Vec::new(), 0);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(FileError::io(READ))? {
            let entry = entry.map_err(FileError::io(READ))?;
            seen += 1;
            if seen > MOST {
                return Err(FileError::TooMany(MOST));
            }
            let (path, kind) = (entry.path(), entry.file_type().map_err(FileError::io(READ))?);
            if kind.is_dir() {
                if !entry.file_name().as_encoded_bytes().starts_with(b".") {
                    folders.push(path);
                }
            } else if path.extension() == Some(OsStr::new(extension)) && path.is_file() {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Whether a folder has a file whose name begins and ends like this, with at least one character between.
pub fn has_file(folder: &Path, before: &str, after: &str) -> bool {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let fits = |name: &str| {
        name.strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after))
            .is_some_and(|between| !between.is_empty())
    };
    let entries = fs::read_dir(folder).into_iter().flatten().take(MOST).flatten();
    entries.into_iter().any(|entry| entry.file_name().to_str().is_some_and(fits) && entry.path().is_file())
}

/// The step that fails if a folder is not readable.
const READ: &str = "read the folder";

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;

    #[test]
    fn files_of_all_folders_are_found_in_order_and_links_are_not_followed() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in ["b", "a/deep", ".hidden"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        for file in ["b/2.osl", "a/deep/1.osl", "z.osl", "a/notes.txt", ".hidden/x.osl"] {
            fs::write(at(file), "").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(dir.path(), at("a/loop")).unwrap();
        let found = files_below(dir.path(), "osl").unwrap();
        assert_eq!(found, ["a/deep/1.osl", "b/2.osl", "z.osl"].map(at));
        assert!(files_below(&at("none"), "osl").is_err());
        assert!(has_file(&at("a"), "no", ".txt") && !has_file(&at("a"), "notes", ".txt"));
        assert!(!has_file(&at("a"), "de", "p") && !has_file(&at("none"), "", ""));
    }
}
