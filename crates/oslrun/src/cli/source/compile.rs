//! `oslrun compile FILE -o OUT`: compiles a source to a compiled shader (`.oso`).

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
use std::path::{Path, PathBuf};

/// Which shader to compile.
#[derive(Debug, Args)]
pub(in crate::cli) struct CompileArgs {
    /// The shader file.
    #[arg(value_name = "FILE.osl")]
    file: PathBuf,
    /// File to write; - is the standard output (default: the shader file's name with .oso, in the working
    /// directory). A shader from the standard input needs it.
    #[arg(short, long, value_name = "FILE.oso")]
    output: Option<PathBuf>,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Compiles a shader and writes it.
pub(in crate::cli) fn compile(args: &CompileArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let derived = match args.output {
        Some(_) => None,
        None if args.file.as_os_str() == STDOUT => {
            return Err(Failure::usage("a shader from the standard input has no name: name a file with -o"));
        }
        None => Some(PathBuf::from(args.file.file_name().unwrap_or_default()).with_extension("oso")),
    };
    if args.output.as_ref().or(derived.as_ref()).is_some_and(|path| osl_files::is_same(path, &args.file)) {
        return Err(Failure::usage("this would write the file that is read: name another one with -o"));
    }
    let reading = args.read.reading();
    let input = input::read(&args.file, &reading)?;
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
    let file = match (&args.output, derived) {
        (Some(path), _) if path.as_os_str() == STDOUT => {
            console.report(&text);
            return Ok(());
        }
        (Some(path), _) => Unsaved::new(path),
        (None, name) => Unsaved::derived(Path::new(""), name.unwrap_or_default()),
    };
    let file = file.and_then(|file| file.with(text.as_bytes())).map_err(Failure::new)?;
    let path = file.path().to_path_buf();
    file.save().map_err(Failure::new)?;
    console.wrote(&path);
    Ok(())
}
