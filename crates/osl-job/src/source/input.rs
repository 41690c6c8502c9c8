//! Reads source files and their includes from the host.

use super::dialect;
use crate::Failure;
use crate::host::{self, Host, STDIN, Within};
use crate::request::{Reach, Reading};
use crate::spoken::Spoken;
use osl_files::{FileError, Roots};
use osl_syntax::Options;
use osl_syntax::encoding::{self, Decoded, Foreign};
use osl_syntax::source::{About, SourceProvider};
use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Number of folders above that of the main file in which headers are searched for.
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
    host: Arc<dyn Host>,
    /// Maximum bytes of a file.
    most: u64,
    /// The dialect of the main file, which has a prelude and headers.
    spoken: RefCell<Option<Spoken>>,
}

impl Files {
    /// Adds a folder from which files may be read, with its project.
    pub fn also(&self, folder: &Path) {
        self.host.permit(folder, false, &mut self.shown.borrow_mut());
        self.host.permit(folder, self.reach != Reach::Folders, &mut self.roots.borrow_mut());
    }

    /// The same search; with `anywhere`, files may be in any folder.
    pub fn or_anywhere(self, anywhere: bool) -> Files {
        let lift = |roots: RefCell<Roots>| RefCell::new(roots.into_inner().or_anywhere(anywhere));
        Files { shown: lift(self.shown), roots: lift(self.roots), ..self }
    }

    /// Sets the dialect of the main file.
    pub fn speak(&self, spoken: Option<Spoken>) {
        *self.spoken.borrow_mut() = spoken;
    }

    /// The dialect of the main file.
    pub fn spoken(&self) -> Option<Spoken> {
        self.spoken.borrow().clone()
    }

    /// Remembers how a file has its text.
    pub fn note(&self, name: &str, foreign: Option<Foreign>) {
        if let Some(Foreign::Latin1 { first, .. }) = foreign {
            self.about.borrow_mut().entry(name.to_string()).or_default().first_foreign = Some(first);
        }
    }

    /// Reads an included file. Also says whether messages must not show its text.
    fn read(&self, path: &Path, relative: bool) -> Result<(Vec<u8>, bool), FileError> {
        match self.host.read(path, Within::Target(&self.shown.borrow()), self.most) {
            Err(FileError::Outside) => {}
            found => return Ok((found?, false)),
        }
        match self.host.read(path, Within::Target(&self.roots.borrow()), self.most) {
            Err(FileError::Outside) if relative && self.reach == Reach::Relative => {
                let anywhere = Roots::default().or_anywhere(true);
                Ok((self.host.read(path, Within::Roots(&anywhere), self.most)?, true))
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
        let places = folders.into_iter().map(|folder| folder.join(name));
        let relative = Path::new(name).is_relative();
        let found = host::first(places, |path| self.read(path, relative));
        let (path, (bytes, hidden)) = found.map_err(include_error)?;
        let name = path.display().to_string();
        let Decoded { text, foreign } = encoding::decode(bytes).map_err(|why| why.to_string())?;
        self.about.borrow_mut().insert(name.clone(), About { hidden, first_foreign: None });
        self.note(&name, foreign);
        Ok((name, text.into()))
    }
}

impl SourceProvider for Files {
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let beside = Path::new(from).parent().filter(|_| quoted).map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        let found = self.first(folders, name);
        if !is_missing(&found) {
            return found;
        }
        // Files of one collection may be named from its root.
        let above = (1..=ABOVE).map(|n| self.main.join("../".repeat(n)));
        if let Ok(found) = self.first(above.filter(|_| self.reach == Reach::Project), name) {
            return Ok(found);
        }
        let spoken = self.spoken.borrow();
        let header = spoken.as_ref().and_then(|spoken| Some((spoken, spoken.dialect.header(name)?)));
        header.map_or(found, |(spoken, text)| Ok((spoken.named(name), text.into())))
    }

    fn about(&self, name: &str) -> About {
        self.about.borrow().get(name).copied().unwrap_or_default()
    }

    fn names(&self, from: &str) -> Vec<String> {
        let beside = Path::new(from).parent().map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        folders.flat_map(|folder| names_in(&*self.host, &folder, "h")).collect()
    }

    /// The first `stdosl.h` in the folders of `-I`, since vendors extend it; else the prelude of the dialect,
    /// from these folders or its own.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        let own =
            |name: &str| Some(self.first(self.folders.iter().cloned(), name)).filter(|f| !is_missing(f));
        own("stdosl.h").or_else(|| {
            let spoken = self.spoken.borrow();
            let spoken = spoken.as_ref()?;
            let (name, text) = spoken.dialect.prelude()?;
            own(name).or_else(|| Some(Ok((spoken.named(name), text.into()))))
        })
    }
}

/// Whether a file was searched for without success.
fn is_missing(found: &Result<(String, Arc<str>), String>) -> bool {
    found.as_ref().is_err_and(|why| *why == include_error(FileError::NotFound))
}

/// The names of the files in a folder with this extension, in order.
pub fn names_in(host: &dyn Host, folder: &Path, extension: &str) -> Vec<String> {
    let fits = |name: &String| Path::new(name).extension().is_some_and(|e| e == extension);
    host.names(folder).into_iter().filter(fits).collect()
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

/// Reads a main file; `-` is the standard input.
pub fn read(path: &Path, reading: &Reading) -> Result<Input, Failure> {
    // The includes of the standard input are searched for in the working directory.
    let is_stdin = path.as_os_str() == STDIN;
    let name = if is_stdin { "<standard input>".to_string() } else { path.display().to_string() };
    let decoded = read_source(path, reading).map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
    let main = path.parent().filter(|_| !is_stdin).map(Path::to_path_buf).unwrap_or_default();
    decoded_input(name, decoded, main, reading)
}

/// A text with its name and the folder of its includes.
///
/// # Errors
/// Those of [`dialect::of`].
pub fn input(name: String, text: String, main: PathBuf, reading: &Reading) -> Result<Input, Failure> {
    decoded_input(name, Decoded { text, foreign: None }, main, reading)
}

fn decoded_input(name: String, decoded: Decoded, main: PathBuf, reading: &Reading) -> Result<Input, Failure> {
    let Decoded { text, foreign } = decoded;
    let files = includes(&main, reading);
    files.note(&name, foreign);
    files.speak(dialect::of(&text, reading)?);
    let infinite = files.spoken().is_some_and(|spoken| spoken.dialect.names.quirks.infinite_quotients);
    let options = Options { infinite_quotients: infinite, ..options(reading) };
    Ok(Input { name, text, foreign, files, options })
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
        roots: RefCell::default(),
        about: RefCell::default(),
        host: reading.snapshot.host().clone(),
        most: reading.limits.reading.file_bytes,
        spoken: RefCell::default(),
    };
    let permit = |folder: &Path, roots: &RefCell<Roots>| {
        files.host.permit(folder, false, &mut roots.borrow_mut());
    };
    permit(Path::new(""), &files.roots);
    for folder in &reading.include {
        permit(folder, &files.roots);
        permit(folder, &files.shown);
    }
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
pub fn read_source(path: &Path, reading: &Reading) -> Result<Decoded, String> {
    let bytes = reading.snapshot.host().read(path, Within::Anywhere, reading.limits.reading.file_bytes);
    encoding::decode(bytes.map_err(|error| error.to_string())?).map_err(|why| why.to_string())
}

/// The text of a file that the user named. On failure, the reason in words for the user.
pub fn read_text(path: &Path, reading: &Reading) -> Result<String, String> {
    let bytes = reading.snapshot.host().read(path, Within::Anywhere, reading.limits.reading.file_bytes);
    bytes.and_then(osl_files::text).map_err(|error| error.to_string())
}
