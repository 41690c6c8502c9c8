//! Reads source files and their includes from the disk.

use crate::Failure;
use crate::request::{Reach, Reading};
use osl_files::{FileError, Kind, Opened, Roots};
use osl_limits::Limits;
use osl_syntax::Options;
use osl_syntax::encoding::{self, Decoded, Foreign};
use osl_syntax::source::{About, SourceProvider};
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Number of folders above that of a shader which belong to its project, unless a `.git` says more.
const ABOVE: usize = 3;

/// Finds included files: first in the folder of the including file, then in that of the main file, then in
/// the folders of `-I`. [`Reach`] says which files it may find.
pub struct Files {
    main: PathBuf,
    folders: Vec<PathBuf>,
    reach: Reach,
    /// The folders whose files messages may show: that of the main file, those of `-I`, and those that
    /// [`Files::also`] adds.
    shown: RefCell<Roots>,
    /// All folders from which files may be read.
    roots: RefCell<Roots>,
    /// What is special about the files that were read.
    about: RefCell<HashMap<String, About>>,
    limits: Limits,
}

impl Files {
    /// Adds a folder from which files may be read, with its project.
    pub fn also(&self, folder: &Path) {
        self.shown.borrow_mut().add(folder);
        let mut roots = self.roots.borrow_mut();
        roots.add(folder);
        if self.reach != Reach::Folders
            && let Some(project) = project(folder)
        {
            roots.add(&project);
        }
    }

    /// The same search; with `anywhere`, files may be in any folder.
    pub fn or_anywhere(self, anywhere: bool) -> Files {
        let lift = |roots: RefCell<Roots>| RefCell::new(roots.into_inner().or_anywhere(anywhere));
        Files { shown: lift(self.shown), roots: lift(self.roots), ..self }
    }

    /// Remembers how a file has its text.
    pub fn note(&self, name: &str, foreign: Option<Foreign>) {
        if let Some(Foreign::Latin1 { first, .. }) = foreign {
            self.about.borrow_mut().entry(name.to_string()).or_default().first_foreign = Some(first);
        }
    }

    /// Opens an included file. Also says whether messages must not show its text.
    fn open(&self, path: &Path, relative: bool) -> Result<(Opened, bool), FileError> {
        match self.shown.borrow().open_target(path) {
            Err(FileError::Outside) => {}
            found => return Ok((found?, false)),
        }
        match self.roots.borrow().open_target(path) {
            Err(FileError::Outside) if relative && self.reach == Reach::Relative => {
                Ok((Roots::default().or_anywhere(true).open(path)?, true))
            }
            found => Ok((found?, true)),
        }
    }

    /// The name and text of the first file that exists, of those with a name in these folders.
    fn first(
        &self,
        folders: impl IntoIterator<Item = PathBuf>,
        name: &str,
    ) -> Result<(String, Arc<str>), String> {
        let mut answer = FileError::NotFound;
        for path in folders.into_iter().map(|folder| folder.join(name)) {
            match self.open(&path, Path::new(name).is_relative()) {
                Err(FileError::NotFound | FileError::NotAFile(Kind::Folder)) => {}
                Err(FileError::Outside) => answer = FileError::Outside,
                Err(error) => return Err(include_error(error)),
                Ok((file, hidden)) => {
                    let name = file.path().display().to_string();
                    let bytes = file.bytes(self.limits.reading.file_bytes).map_err(include_error)?;
                    let Decoded { text, foreign } = encoding::decode(bytes).map_err(|why| why.to_string())?;
                    self.about.borrow_mut().insert(name.clone(), About { hidden, first_foreign: None });
                    self.note(&name, foreign);
                    return Ok((name, text.into()));
                }
            }
        }
        Err(include_error(answer))
    }
}

/// The project of a folder, links resolved: the nearest folder from it up that has a `.git`, else some
/// folders above. The root of the file system is none.
fn project(folder: &Path) -> Option<PathBuf> {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let real = folder.canonicalize().ok()?;
    let above = || real.ancestors().filter(|above| above.parent().is_some());
    let marked = above().find(|above| above.join(".git").exists());
    marked.or_else(|| above().take(ABOVE + 1).last()).map(Path::to_path_buf)
}

impl SourceProvider for Files {
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let beside = Path::new(from).parent().filter(|_| quoted).map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        self.first(folders, name)
    }

    fn about(&self, name: &str) -> About {
        self.about.borrow().get(name).copied().unwrap_or_default()
    }

    fn names(&self, from: &str) -> Vec<String> {
        let beside = Path::new(from).parent().map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        folders.flat_map(|folder| names_in(&folder, "h")).collect()
    }

    /// The first `stdosl.h` in the folders of `-I`, since vendors extend it.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        let missing = include_error(FileError::NotFound);
        Some(self.first(self.folders.iter().cloned(), "stdosl.h")).filter(|found| *found != Err(missing))
    }
}

/// Maximum number of entries of a folder that are looked at for a suggestion.
const MOST_ENTRIES: usize = 1000;

/// The names of the files in a folder with this extension, in order.
pub fn names_in(folder: &Path, extension: &str) -> Vec<String> {
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
            "it lies outside of the folders that may be read, links followed; -I DIR with the folder that holds \
             the file itself adds it"
                .to_string()
        }
        error => error.to_string(),
    }
}

/// The name and text of the main file, and the source of its includes.
pub struct Input {
    /// The name in diagnostics.
    pub name: String,
    /// The text.
    pub text: String,
    /// How the file has it, unless it is UTF-8.
    foreign: Option<Foreign>,
    /// Finds the included files.
    pub files: Files,
    /// The options for reading it.
    pub options: Options,
}

impl Input {
    /// The bytes of a changed text, in the encoding of the file.
    pub fn encoded(&self, text: &str) -> Result<Vec<u8>, Failure> {
        encoding::encode(text, self.foreign).ok_or_else(|| {
            let why = "it has bytes that are not UTF-8 beside characters in UTF-8";
            Failure::new(format!("{} is not changed: {why}; save it as UTF-8 first", self.name))
        })
    }
}

/// The name of the standard input as a main file.
const STDIN: &str = "-";

/// Reads a main file; `-` is the standard input.
pub fn read(path: &Path, reading: &Reading) -> Result<Input, Failure> {
    if path.as_os_str() == STDIN {
        return read_stdin(reading);
    }
    let decoded = read_source(path, &reading.limits)
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
    let main = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok(decoded_input(path.display().to_string(), decoded, main, reading))
}

/// Reads a main file from the standard input; its includes are searched for in the working directory.
pub fn read_stdin(reading: &Reading) -> Result<Input, Failure> {
    let name = "<standard input>";
    let most = reading.limits.reading.file_bytes;
    // Commands that compile a shader several times read it again.
    static TEXT: OnceLock<Decoded> = OnceLock::new();
    let cannot = |why: &dyn std::fmt::Display| Failure::new(format!("cannot read {name}: {why}"));
    let decoded = match TEXT.get() {
        Some(decoded) => decoded.clone(),
        None => {
            let bytes = osl_files::read_stream(std::io::stdin().lock(), most).map_err(|e| cannot(&e))?;
            let decoded = encoding::decode(bytes).map_err(|e| cannot(&e))?;
            TEXT.get_or_init(|| decoded).clone()
        }
    };
    Ok(decoded_input(name.to_string(), decoded, PathBuf::new(), reading))
}

/// A text with its name and the folder of its includes.
pub fn input(name: String, text: String, main: PathBuf, reading: &Reading) -> Input {
    decoded_input(name, Decoded { text, foreign: None }, main, reading)
}

fn decoded_input(name: String, decoded: Decoded, main: PathBuf, reading: &Reading) -> Input {
    let Decoded { text, foreign } = decoded;
    let files = includes(&main, reading);
    files.note(&name, foreign);
    Input { name, text, foreign, files, options: options(reading) }
}

/// The search for the includes of a file in a folder.
pub fn includes(main: &Path, reading: &Reading) -> Files {
    let files = searched(main, reading);
    files.also(main);
    files
}

/// The search for includes in a folder which is that of no shader yet: see [`Files::also`].
pub fn searched(main: &Path, reading: &Reading) -> Files {
    let files = Files {
        main: main.to_path_buf(),
        folders: reading.include.clone(),
        reach: reading.reach,
        shown: RefCell::default(),
        roots: RefCell::new(Roots::new(
            [""].iter().map(Path::new).chain(reading.include.iter().map(PathBuf::as_path)),
        )),
        about: RefCell::default(),
        limits: reading.limits.clone(),
    };
    reading.include.iter().for_each(|folder| files.shown.borrow_mut().add(folder));
    files
}

/// The reading options of the command line.
pub fn options(reading: &Reading) -> Options {
    let defines = reading.define.iter().map(|d| match d.split_once('=') {
        Some((name, value)) => (name.to_string(), value.to_string()),
        None => (d.clone(), "1".to_string()),
    });
    Options {
        strict: reading.strict_syntax,
        version: reading.version.unwrap_or_default(),
        defines: defines.collect(),
        limits: reading.limits.clone(),
        ..Options::default()
    }
}

/// The text of a shader that the user named. On failure, the reason in words for the user.
pub fn read_source(path: &Path, limits: &Limits) -> Result<Decoded, String> {
    let bytes = osl_files::open_named(path).and_then(|file| file.bytes(limits.reading.file_bytes));
    encoding::decode(bytes.map_err(|error| error.to_string())?).map_err(|why| why.to_string())
}

/// The text of a file that the user named. On failure, the reason in words for the user.
pub fn read_text(path: &Path, limits: &Limits) -> Result<String, String> {
    let opened = osl_files::open_named(path);
    opened.and_then(|file| file.text(limits.reading.file_bytes)).map_err(|error| error.to_string())
}
