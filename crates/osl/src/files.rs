//! The files that shaders name, from wherever the client keeps them.

use crate::stages::ShaderFiles;
use osl_syntax::encoding::{Foreign, decode};
use osl_syntax::source::{About, SourceProvider};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Answers which files exist and what they contain. Runs call it from any thread; the same name must have the
/// same answer during a run.
pub trait Files: Send + Sync {
    /// The bytes of the file with a name; `None` if there is none.
    ///
    /// Names are as the shader has them, or relative to the file that includes another one. Folders are
    /// separated by `/`.
    fn read(&self, name: &str) -> Option<Arc<[u8]>>;
}

/// No files: texts may include only the headers that come with the compiler.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn read(&self, _: &str) -> Option<Arc<[u8]>> {
        None
    }
}

/// Files in memory.
///
/// ```
/// use osl::{MemoryFiles, ReadOptions, Shader};
///
/// let files = MemoryFiles::new().with("lib/half.h", "#define HALF 0.5\n");
/// let text = "#include \"lib/half.h\"\nshader a(output float o = HALF) {}";
/// let shader = Shader::read("a.osl", text, &files, &ReadOptions::default())?;
/// assert_eq!(shader.params()[0].default, Some(0.5.into()));
/// # Ok::<(), osl::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles {
    files: BTreeMap<String, Arc<[u8]>>,
}

impl MemoryFiles {
    /// No files yet.
    pub fn new() -> MemoryFiles {
        MemoryFiles::default()
    }

    /// Adds a file, or replaces the one with the same name.
    #[must_use]
    pub fn with(mut self, name: &str, bytes: impl AsRef<[u8]>) -> MemoryFiles {
        self.insert(name, bytes);
        self
    }

    /// Adds a file, or replaces the one with the same name.
    pub fn insert(&mut self, name: &str, bytes: impl AsRef<[u8]>) {
        self.files.insert(name.to_string(), bytes.as_ref().into());
    }
}

impl Files for MemoryFiles {
    fn read(&self, name: &str) -> Option<Arc<[u8]>> {
        self.files.get(name).cloned()
    }
}

/// The includes of shaders, from the client's files.
pub(crate) struct Includes<'a>(pub(crate) &'a dyn Files);

impl SourceProvider for Includes<'_> {
    /// A quoted file is searched beside the including one first.
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let beside = from.rsplit_once('/').filter(|_| quoted).and_then(|(folder, _)| joined(folder, name));
        let found = beside.into_iter().chain([name.to_string()]).find_map(|name| {
            let bytes = self.0.read(&name)?;
            Some((name, bytes))
        });
        let (name, bytes) = found.ok_or("no such file")?;
        Ok((name, decode(bytes.to_vec()).map_err(|why| why.to_string())?.text.into()))
    }

    fn about(&self, name: &str) -> About {
        let bytes = self.0.read(name).filter(|bytes| std::str::from_utf8(bytes).is_err());
        let first_foreign = match bytes.and_then(|bytes| decode(bytes.to_vec()).ok()?.foreign) {
            Some(Foreign::Latin1 { first, .. }) => Some(first),
            _ => None,
        };
        About { hidden: false, first_foreign }
    }

    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        self.0.read("stdosl.h")?;
        Some(self.include("stdosl.h", false, ""))
    }
}

impl ShaderFiles for Includes<'_> {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let names = ["", ".osl", ".oso"].map(|ending| format!("{shader}{ending}"));
        let found = names.into_iter().find_map(|name| self.0.read(&name).map(|bytes| (name, bytes)));
        let (name, bytes) = found.ok_or("no such file")?;
        Ok((name, decode(bytes.to_vec()).map_err(|why| why.to_string())?.text))
    }

    fn includes(&self) -> &dyn SourceProvider {
        self
    }
}

/// A name relative to a folder, without `.` and `..`. `None` if it leads out of all folders.
fn joined(folder: &str, name: &str) -> Option<String> {
    let mut parts: Vec<&str> = Vec::new();
    for part in folder.split('/').chain(name.split('/')) {
        match part {
            "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_files_are_beside_their_includer_first() {
        let files = MemoryFiles::new().with("a/x.h", "1").with("x.h", "2").with("bad.h", [0]);
        let files = files.with("latin1.h", [0xe9]);
        let found = |name: &str, quoted, from: &str| Includes(&files).include(name, quoted, from);
        assert_eq!(found("x.h", true, "a/main.osl"), Ok(("a/x.h".into(), "1".into())));
        assert_eq!(found("../x.h", true, "a/main.osl"), Ok(("x.h".into(), "2".into())));
        assert_eq!(found("x.h", false, "a/main.osl"), Ok(("x.h".into(), "2".into())));
        assert_eq!(found("x.h", true, "b/main.osl"), Ok(("x.h".into(), "2".into())));
        assert_eq!(found("latin1.h", true, "main.osl"), Ok(("latin1.h".into(), "\u{e9}".into())));
        assert_eq!(Includes(&files).about("latin1.h").first_foreign, Some(0));
        assert_eq!(found("bad.h", true, "main.osl"), Err("it is not text (byte 0 is zero)".into()));
        assert_eq!(found("../../x.h", true, "a/main.osl"), Err("no such file".into()));
        assert!(Includes(&files).standard().is_none());
    }
}
