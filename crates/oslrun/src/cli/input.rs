//! Reads source files and their includes from the disk.

use super::Failure;
use super::args::ReadArgs;
use osl_files::{FileError, Roots};
use osl_limits::Limits;
use osl_syntax::Options;
use osl_syntax::source::SourceProvider;
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Finds included files: first in the folder of the including file, then in that of the main file, then in
/// the folders of `-I`. The files must be below one of these, below the working directory, or below a folder
/// that [`Files::also`] adds.
pub(super) struct Files {
    main: PathBuf,
    folders: Vec<PathBuf>,
    roots: RefCell<Roots>,
    limits: Limits,
}

impl Files {
    /// Adds a folder from which files may be read.
    pub(super) fn also(&self, folder: &Path) {
        self.roots.borrow_mut().add(folder);
    }

    /// The same search; with `anywhere`, files may be in any folder.
    pub(super) fn or_anywhere(self, anywhere: bool) -> Files {
        Files { roots: RefCell::new(self.roots.into_inner().or_anywhere(anywhere)), ..self }
    }

    /// The name and text of the first of these files that exists.
    fn first(&self, places: impl IntoIterator<Item = PathBuf>) -> Result<(String, Arc<str>), FileError> {
        let found = self.roots.borrow().first(places)?;
        let name = found.path().display().to_string();
        Ok((name, found.text(self.limits.reading.file_bytes)?.into()))
    }
}

impl SourceProvider for Files {
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let beside = Path::new(from).parent().filter(|_| quoted).map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        self.first(folders.map(|folder| folder.join(name))).map_err(include_error)
    }

    fn names(&self, from: &str) -> Vec<String> {
        let beside = Path::new(from).parent().map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        folders.flat_map(|folder| names_in(&folder, "h")).collect()
    }

    /// The first `stdosl.h` in the folders of `-I`, since vendors extend it.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        match self.first(self.folders.iter().map(|folder| folder.join("stdosl.h"))) {
            Err(FileError::NotFound) => None,
            found => Some(found.map_err(include_error)),
        }
    }
}

/// Maximum number of entries of a folder that are looked at for a suggestion.
const MOST_ENTRIES: usize = 1000;

/// The names of the files in a folder with this extension, in order.
pub(super) fn names_in(folder: &Path, extension: &str) -> Vec<String> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(MOST_ENTRIES);
    let paths = entries.map(|entry| PathBuf::from(entry.file_name()));
    let fits = |path: &PathBuf| path.extension().is_some_and(|e| e == extension);
    let mut names: Vec<String> = paths.filter(fits).map(|path| path.display().to_string()).collect();
    names.sort();
    names
}

fn include_error(error: FileError) -> String {
    match error {
        FileError::Outside => {
            "it lies outside of the folders that may be read, links followed; -I DIR adds one".to_string()
        }
        error => error.to_string(),
    }
}

/// The name and text of the main file, and the source of its includes.
pub(super) struct Input {
    /// The name in diagnostics.
    pub(super) name: String,
    /// The text.
    pub(super) text: String,
    /// Finds the included files.
    pub(super) files: Files,
    /// The options for reading it.
    pub(super) options: Options,
}

/// The name of the standard input as a main file.
const STDIN: &str = "-";

/// Reads a main file; `-` is the standard input.
pub(super) fn read(path: &Path, args: &ReadArgs) -> Result<Input, Failure> {
    if path.as_os_str() == STDIN {
        return read_stdin(args);
    }
    let text = read_text(path, args.limits.limits())
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
    let main = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok(input(path.display().to_string(), text, main, args))
}

/// Reads a main file from the standard input; its includes are searched for in the working directory.
pub(super) fn read_stdin(args: &ReadArgs) -> Result<Input, Failure> {
    let name = "<standard input>";
    let most = args.limits.limits().reading.file_bytes;
    // Commands that compile a shader several times read it again.
    static TEXT: OnceLock<String> = OnceLock::new();
    let text = match TEXT.get() {
        Some(text) => Ok(text.clone()),
        None => {
            let text = osl_files::read_stream(std::io::stdin().lock(), most);
            text.map(|text| TEXT.get_or_init(|| text).clone())
        }
    };
    let text = text.map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
    Ok(input(name.to_string(), text, PathBuf::new(), args))
}

/// A text with its name and the folder of its includes.
pub(super) fn input(name: String, text: String, main: PathBuf, args: &ReadArgs) -> Input {
    Input { name, text, files: includes(&main, args), options: options(args) }
}

/// The search for the includes of a file in a folder.
pub(super) fn includes(main: &Path, args: &ReadArgs) -> Files {
    let roots = [main, Path::new("")].into_iter().chain(args.include.iter().map(PathBuf::as_path));
    let roots = RefCell::new(Roots::new(roots));
    let limits = args.limits.limits().clone();
    Files { main: main.to_path_buf(), folders: args.include.clone(), roots, limits }
}

/// The reading options of the command line.
pub(super) fn options(args: &ReadArgs) -> Options {
    let defines = args.define.iter().map(|d| match d.split_once('=') {
        Some((name, value)) => (name.to_string(), value.to_string()),
        None => (d.clone(), "1".to_string()),
    });
    Options {
        strict: args.strict_syntax,
        defines: defines.collect(),
        limits: args.limits.limits().clone(),
        ..Options::default()
    }
}

/// The text of a file that the user named. On failure, the reason in words for the user.
pub(super) fn read_text(path: &Path, limits: &Limits) -> Result<String, String> {
    let opened = osl_files::open_named(path);
    opened.and_then(|file| file.text(limits.reading.file_bytes)).map_err(|error| error.to_string())
}
