//! Commands that take several files: folders stand for the shaders in them.

use crate::cli::print::Console;
use osl_job::Failure;
use std::path::{Path, PathBuf};

/// The extension of the sources that a folder stands for.
const SOURCE: &str = "osl";

/// The files that a command line names. A folder stands for the sources in it and in the folders below it,
/// by name.
///
/// # Errors
/// A folder cannot be read, or has no sources.
pub(super) fn files(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in named {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let fails = |why: String| Failure::new(format!("{}: {why}", path.display()));
        let found = osl_files::files_below(path, SOURCE).map_err(|error| fails(error.to_string()))?;
        if found.is_empty() {
            return Err(fails(format!("the folder has no .{SOURCE} file")));
        }
        files.extend(found);
    }
    Ok(files)
}

/// Does the same for each file. A file that fails is reported and does not stop the others.
///
/// # Errors
/// One of the files failed.
pub(super) fn each(
    files: &[PathBuf],
    console: &mut Console<'_>,
    mut work: impl FnMut(&Path, &mut Console<'_>) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let mut result = Ok(());
    for path in files {
        if let Err(Failure { text, .. }) = work(path, console) {
            if !text.is_empty() {
                console.error(&text);
            }
            result = Err(Failure::said());
        }
    }
    result
}
