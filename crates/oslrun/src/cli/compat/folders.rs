//! The folders in which the reference's tools look for shaders: compiled shaders first, then sources.

use crate::cli::options::limits::LimitArgs;
use osl::stages::ShaderFiles;
use osl_job::request::{Reach, Reading};
use osl_job::source::input;
use osl_syntax::source::SourceProvider;
use std::path::{Path, PathBuf};

/// Folders, and the shaders that a tool has generated itself.
pub(super) struct Folders {
    /// Names and texts of the generated shaders.
    written: Vec<(String, String)>,
    path: Vec<PathBuf>,
    includes: input::Files,
    read: Reading,
}

impl Folders {
    /// The folders of a search path, followed by the working directory.
    pub(super) fn new(mut path: Vec<PathBuf>, written: Vec<(String, String)>, limits: &LimitArgs) -> Folders {
        path.push(PathBuf::new());
        let read = Reading { reach: Reach::Relative, ..Reading::within(limits.limits()).plain() };
        let includes = input::searched(Path::new(""), &read);
        Folders { written, path, includes, read }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}

impl ShaderFiles for Folders {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        if let Some((_, text)) = self.written.iter().find(|(name, _)| name == shader) {
            return Ok(("<buffer>".to_string(), text.clone()));
        }
        let stem = shader.strip_suffix(".osl").or_else(|| shader.strip_suffix(".oso")).unwrap_or(shader);
        for ending in ["oso", "osl"] {
            for folder in &self.path {
                let path = folder.join(format!("{stem}.{ending}"));
                if path.is_file() {
                    // The user's own script names the shader, so the file and its includes may be anywhere.
                    self.includes.also(folder_of(&path));
                    let (name, found) = (path.display().to_string(), input::read_source(&path, &self.read)?);
                    self.includes.note(&name, found.foreign);
                    return Ok((name, found.text));
                }
            }
        }
        Err("no compiled shader nor source of that name was found".to_string())
    }

    fn includes(&self) -> &dyn SourceProvider {
        &self.includes
    }
}
