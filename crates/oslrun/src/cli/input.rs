//! Source files and their includes, from the disk.

use super::Failure;
use super::args::ReadArgs;
use osl_limits::Limits;
use osl_syntax::Options;
use osl_syntax::source::SourceProvider;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Finds included files beside the including file, then beside the main file, then in the folders of `-I`.
pub(super) struct Files {
    main: PathBuf,
    folders: Vec<PathBuf>,
    limits: Limits,
}

impl SourceProvider for Files {
    fn include(&self, name: &str, quoted: bool, from: &str) -> Result<(String, Arc<str>), String> {
        let beside = Path::new(from).parent().filter(|_| quoted).map(Path::to_path_buf);
        let folders = beside.into_iter().chain([self.main.clone()]).chain(self.folders.iter().cloned());
        let found = folders.map(|f| f.join(name)).find(|p| p.is_file()).ok_or("no such file")?;
        let text = read_text(&found, &self.limits)?;
        Ok((found.display().to_string(), text.into()))
    }

    /// The first `stdosl.h` in the folders of `-I`: vendors extend it.
    fn standard(&self) -> Option<Result<(String, Arc<str>), String>> {
        let found = self.folders.iter().map(|f| f.join("stdosl.h")).find(|p| p.is_file())?;
        Some(read_text(&found, &self.limits).map(|text| (found.display().to_string(), text.into())))
    }
}

/// The main file's name and text, and where its includes come from.
pub(super) struct Input {
    /// The name as diagnostics show it.
    pub(super) name: String,
    /// The text.
    pub(super) text: String,
    /// Where includes come from.
    pub(super) files: Files,
    /// How to read it.
    pub(super) options: Options,
}

/// Reads a main file.
pub(super) fn read(path: &Path, args: &ReadArgs) -> Result<Input, Failure> {
    let text = read_text(path, args.limits.limits())
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", path.display())))?;
    let main = path.parent().map(Path::to_path_buf).unwrap_or_default();
    Ok(input(path.display().to_string(), text, main, args))
}

/// Reads a main file from the standard input; its includes are looked for in the current folder.
pub(super) fn read_stdin(args: &ReadArgs) -> Result<Input, Failure> {
    let name = "<standard input>";
    let text = read_stream(std::io::stdin().lock(), args.limits.limits());
    let text = text.map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
    Ok(input(name.to_string(), text, PathBuf::new(), args))
}

/// A text with its name and the folder that its includes lie in.
pub(super) fn input(name: String, text: String, main: PathBuf, args: &ReadArgs) -> Input {
    Input { name, text, files: includes(&main, args), options: options(args) }
}

/// Where the includes of a file in a folder come from.
pub(super) fn includes(main: &Path, args: &ReadArgs) -> Files {
    Files { main: main.to_path_buf(), folders: args.include.clone(), limits: args.limits.limits().clone() }
}

/// How files are read.
pub(super) fn options(args: &ReadArgs) -> Options {
    let defines = args.define.iter().map(|d| match d.split_once('=') {
        Some((name, value)) => (name.to_string(), value.to_string()),
        None => (d.clone(), "1".to_string()),
    });
    Options { strict: args.strict_syntax, defines: defines.collect(), ..Options::default() }
}

/// The text of a file; why there is none, in words for the user.
pub(super) fn read_text(path: &Path, limits: &Limits) -> Result<String, String> {
    let most = limits.reading.file_bytes;
    let meta = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if meta.is_dir() {
        return Err("it is a folder".to_string());
    }
    if meta.len() > most {
        return Err(format!("it has more than {most} bytes"));
    }
    text(std::fs::read(path).map_err(|e| e.to_string())?)
}

fn read_stream(from: impl Read, limits: &Limits) -> Result<String, String> {
    let most = limits.reading.file_bytes;
    let mut bytes = Vec::new();
    from.take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
    if bytes.len() as u64 > most {
        return Err(format!("it has more than {most} bytes"));
    }
    text(bytes)
}

fn text(bytes: Vec<u8>) -> Result<String, String> {
    let text = String::from_utf8(bytes)
        .map_err(|e| format!("it is not text (byte {} is not UTF-8)", e.utf8_error().valid_up_to()))?;
    match text.find('\0') {
        Some(at) => Err(format!("it is not text (byte {at} is zero)")),
        None => Ok(text),
    }
}
