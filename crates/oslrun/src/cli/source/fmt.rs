//! `oslrun fmt FILE…`: formats files, or lists the files that it would change.
//!
//! A file with syntax errors is not changed.

use super::many;
use crate::cli::options::reading::{FormatArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl::stages;
use osl_job::Failure;
use osl_job::request::Reading;
use osl_job::source::diff;
use osl_job::source::input::{self, Input};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::path::{Path, PathBuf};

/// Which files to format.
#[derive(Debug, Args)]
pub(in crate::cli) struct FmtArgs {
    /// Shader files; - formats the standard input to the standard output. A folder stands for the .osl files
    /// in it and in the folders below it.
    #[arg(required = true, value_name = "FILE.osl")]
    files: Vec<PathBuf>,
    /// Write nothing: list the files that would change, and fail if there are any.
    #[arg(long)]
    check: bool,
    /// With --check, show what would change.
    #[arg(long, requires = "check")]
    diff: bool,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Formats each file in place, or lists those that would change. If a file fails, the others are still
/// formatted.
pub(in crate::cli) fn fmt(args: &FmtArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let reading = args.read.reading();
    let mut changes = false;
    many::each(&many::files(&args.files)?, console, |path, console| {
        changes |= one(path, args, &reading, console)?;
        Ok(())
    })?;
    if args.check && changes { Err(Failure::said()) } else { Ok(()) }
}

/// Formats one file; returns whether that changes it.
fn one(path: &Path, args: &FmtArgs, reading: &Reading, console: &mut Console<'_>) -> Result<bool, Failure> {
    let stdin = path == Path::new("-");
    let input = input::read(path, reading)?;
    if stages::is_compiled(&input.name) {
        return Err(Failure::new(format!("{} is a compiled shader, not a source", input.name)));
    }
    let formatted = formatted(&input, console)?;
    let changed = formatted != input.text;
    if args.check && changed {
        console.escaped(&format!("{}\n", input.name));
        if args.diff {
            console.escaped(&diff::unified(&input.name, (&input.text, &formatted), "formatted"));
        }
    } else if !args.check && stdin {
        console.report(&formatted);
    } else if !args.check && changed {
        osl_files::rewrite(path, &input.encoded(&formatted)?).map_err(Failure::new)?;
    }
    Ok(changed)
}

/// The formatted text. If the file does not parse, the errors are printed and the result is a failure.
fn formatted(input: &Input, console: &mut Console<'_>) -> Result<String, Failure> {
    let parsed = osl_syntax::parse(&input.name, &input.text, &input.files, &input.options);
    if parsed.has_errors() {
        // Only `check` reports warnings.
        let errors: Vec<Diagnostic> = parsed.diagnostics.into_iter().filter(Diagnostic::is_error).collect();
        console.diagnostics(&errors, &parsed.sources)?;
    }
    let limits = &input.options.limits;
    osl_syntax::format::format_within(&input.name, &input.text, limits).or_else(|errors| {
        let mut sources = SourceMap::default();
        let _ = sources.add(input.name.as_str(), input.text.as_str().into());
        console.diagnostics(&errors, &sources)?;
        Err(Failure::said())
    })
}
