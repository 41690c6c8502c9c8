//! Where the shaders of a group or a scene are found.

use super::dialect;
use super::{input, nodes, repair};
use crate::host::{self, Within};
use crate::request::Reading;
use crate::spoken::Spoken;
use osl::stages::ShaderFiles;
use osl_files::{FileError, Roots};
use osl_syntax::encoding::{self, Decoded};
use osl_syntax::source::SourceProvider;
use osl_syntax::spelling::closest;
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// The folders that are searched for the shaders of a group, before the built-in ones.
pub struct Folders<'a> {
    /// The file that the user named as the last shader; it may be in any folder.
    own: Option<PathBuf>,
    folders: Vec<PathBuf>,
    roots: Roots,
    includes: input::Files,
    read: &'a Reading,
    /// The dialects of the shaders that were opened.
    spoken: RefCell<Vec<Spoken>>,
    /// Whether to insert missing brackets; collects the edits.
    repair: Option<RefCell<Vec<repair::Edits>>>,
}

impl<'a> Folders<'a> {
    /// The shaders of a file in a folder.
    pub fn of(
        folder: &Path,
        more: &[PathBuf],
        anywhere: bool,
        repair: bool,
        read: &'a Reading,
    ) -> Folders<'a> {
        let mut folders = vec![folder.to_path_buf(), PathBuf::new()];
        folders.extend(more.iter().cloned());
        let includes = input::includes(folder, read).or_anywhere(anywhere);
        more.iter().for_each(|folder| includes.also(folder));
        let mut roots = Roots::default().or_anywhere(anywhere);
        folders.iter().for_each(|folder| read.snapshot.host().permit(folder, false, &mut roots));
        let spoken = RefCell::default();
        Folders { own: None, folders, roots, includes, spoken, read, repair: repair.then(RefCell::default) }
    }

    /// The same, with a file that the user named as a shader.
    pub(super) fn with(self, own: Option<PathBuf>) -> Folders<'a> {
        Folders { own, ..self }
    }

    /// The dialects of the shaders that were opened, in order.
    pub fn spoken(&self) -> Vec<Spoken> {
        self.spoken.borrow().clone()
    }

    /// The edits of the shaders that were repaired.
    pub(super) fn edits(&self) -> Vec<repair::Edits> {
        self.repair.as_ref().map(RefCell::take).unwrap_or_default()
    }

    /// Why a shader cannot be found, with the closest name that can.
    fn not_found(&self, shader: &str) -> String {
        let why = "there is no such file in the shader paths, nor is it built in";
        let stem = |name: String| name.strip_suffix(".osl").map(str::to_string);
        let host = &**self.read.snapshot.host();
        let beside: Vec<String> =
            self.folders.iter().flat_map(|f| input::names_in(host, f, "osl")).filter_map(stem).collect();
        let mut names: Vec<&str> = nodes::names().collect();
        names.extend(beside.iter().map(String::as_str));
        match closest(shader, names) {
            Some(close) => format!("{why}; there is one named `{close}`"),
            None => why.to_string(),
        }
    }

    /// A shader's file after reading: its name and text.
    fn take(&self, path: &Path, bytes: Vec<u8>) -> Result<(String, String), String> {
        let Decoded { text, foreign } = encoding::decode(bytes).map_err(|why| why.to_string())?;
        let name = path.display().to_string();
        self.includes.note(&name, foreign);
        // The folder of a shader that may be read is one for its includes.
        self.includes.also(path.parent().unwrap_or(Path::new("")));
        let spoken = dialect::of(&text, self.read).map_err(|failure| failure.text)?;
        self.includes.speak(spoken.clone());
        if let Some(spoken) = spoken {
            self.spoken.borrow_mut().push(spoken);
        }
        let Some(edits) = &self.repair else { return Ok((name, text)) };
        let main = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let mut input = input::input(name, text, main, self.read).map_err(|failure| failure.text)?;
        edits.borrow_mut().extend(repair::apply(&mut input, None).map_err(|failure| failure.text)?);
        Ok((input.name, input.text))
    }
}

impl ShaderFiles for Folders<'_> {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let name = Path::new(shader);
        let (host, most) = (&**self.read.snapshot.host(), self.read.limits.reading.file_bytes);
        if self.own.as_deref() == Some(name) {
            let bytes = host.read(name, Within::Anywhere, most).map_err(|error| error.to_string())?;
            return self.take(name, bytes);
        }
        let names = if name.extension().is_some_and(|e| e == "osl" || e == "oso") {
            vec![name.to_path_buf()]
        } else {
            ["osl", "oso"].map(|ending| PathBuf::from(format!("{shader}.{ending}"))).into()
        };
        let places = self.folders.iter().flat_map(|folder| names.iter().map(move |name| folder.join(name)));
        match host::first(places, |path| host.read(path, Within::Roots(&self.roots), most)) {
            Ok((path, bytes)) => self.take(&path, bytes),
            Err(FileError::NotFound) => match nodes::find(shader) {
                Some(text) => {
                    self.includes.speak(None);
                    Ok((format!("{shader}.osl (built in)"), text.to_string()))
                }
                None => Err(self.not_found(shader)),
            },
            Err(FileError::Outside) => {
                Err("it lies outside of the shader paths; --allow-files lets it".to_string())
            }
            Err(error) => Err(error.to_string()),
        }
    }

    fn includes(&self) -> &dyn SourceProvider {
        &self.includes
    }
}
