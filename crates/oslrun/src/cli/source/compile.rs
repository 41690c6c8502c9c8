//! `oslrun compile FILE… -o OUT`: compiles sources to compiled shaders (`.oso`).

use super::many;
use crate::cli::options::reading::{FormatArgs, LintArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl::stages;
use osl_files::Unsaved;
use osl_hir::lint::Level;
use osl_hir::oso;
use osl_job::Failure;
use osl_job::request::values::STDOUT;
use osl_job::source::{input, levels};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Which shaders to compile.
#[derive(Debug, Args)]
pub(in crate::cli) struct CompileArgs {
    /// Shader files. A folder stands for the .osl files in it and in the folders below it.
    #[arg(required = true, value_name = "FILE.osl")]
    files: Vec<PathBuf>,
    /// File to write, or a folder that is there for all files; - is the standard output (default: each shader
    /// file's name with .oso, in the working directory). A shader from the standard input needs it.
    #[arg(short, long, value_name = "FILE.oso")]
    output: Option<PathBuf>,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Compiles the shaders and writes them.
pub(in crate::cli) fn compile(args: &CompileArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let files = many::files(&args.files)?;
    let folder = args.output.as_deref().filter(|path| path.is_dir());
    if let [file] = &files[..] {
        return one(file, folder, args, console);
    }
    if args.output.is_some() && folder.is_none() {
        return Err(Failure::usage("several files need a folder after -o, which is there"));
    }
    if files.iter().any(|file| file.as_os_str() == STDOUT) {
        return Err(Failure::usage("a shader from the standard input is compiled alone"));
    }
    let mut names = HashMap::new();
    for file in &files {
        if let Some(other) = names.insert(compiled_name(file), file) {
            let (a, b) = (other.display(), file.display());
            return Err(Failure::usage(format!("{a} and {b} would become one file: compile them apart")));
        }
    }
    many::each(&files, console, |file, console| one(file, folder, args, console))
}

/// The name of the compiled file.
fn compiled_name(file: &Path) -> PathBuf {
    PathBuf::from(file.file_name().unwrap_or_default()).with_extension("oso")
}

/// Compiles one shader and writes it: into a folder if there is one.
fn one(
    file: &Path,
    folder: Option<&Path>,
    args: &CompileArgs,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let asked = args.output.as_deref().filter(|_| folder.is_none());
    if asked.is_none() && file.as_os_str() == STDOUT {
        return Err(Failure::usage("a shader from the standard input has no name: name a file with -o"));
    }
    let (folder, name) = (folder.unwrap_or(Path::new("")), compiled_name(file));
    if osl_files::is_same(asked.unwrap_or(&folder.join(&name)), file) {
        return Err(Failure::usage("this would write the file that is read: name another one with -o"));
    }
    let reading = args.read.reading();
    let input = input::read(file, &reading)?;
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let list = levels::judge(&checked, Level::Always, &args.lints.lints(), &reading.limits);
    console.diagnostics(&list, &checked.sources)?;
    let program = checked.program.ok_or_else(Failure::said)?;
    let text = match oso::write(&program, &checked.sources, &reading.limits) {
        Ok(text) => text,
        Err(list) => {
            console.diagnostics(&list, &checked.sources)?;
            return Err(Failure::said());
        }
    };
    let file = match asked {
        Some(path) if path.as_os_str() == STDOUT => {
            console.report(&text);
            return Ok(());
        }
        Some(path) => Unsaved::new(path),
        None => Unsaved::derived(folder, name),
    };
    let file = file.and_then(|file| file.with(text.as_bytes())).map_err(Failure::new)?;
    let path = file.path().to_path_buf();
    file.save().map_err(Failure::new)?;
    console.wrote(&path);
    Ok(())
}
