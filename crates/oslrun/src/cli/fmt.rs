//! `oslrun fmt FILE…`: formats files, or lists the files that it would change.
//!
//! A file with syntax errors is not changed. This module must not know the style.

use super::args::ReadArgs;
use super::input::Input;
use super::{Failure, diff, input, report};
use clap::Args;
use osl::stages;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Which files to format.
#[derive(Debug, Args)]
pub(super) struct FmtArgs {
    /// Shader files; - formats the standard input to the standard output.
    #[arg(required = true, value_name = "FILE.osl")]
    pub(super) files: Vec<PathBuf>,
    /// Write nothing: list the files that would change, and fail if there are any.
    #[arg(long)]
    pub(super) check: bool,
    /// With --check, show what would change.
    #[arg(long, requires = "check")]
    pub(super) diff: bool,
    /// The options for reading the files.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Formats each file in place, or lists those that would change. If a file fails, the others are still
/// formatted.
pub(super) fn fmt(args: &FmtArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let (mut changes, mut failed) = (false, false);
    for path in &args.files {
        match one(path, args, out, err) {
            Ok(changed) => changes |= changed,
            Err(Failure { text, .. }) => {
                failed = true;
                if !text.is_empty() {
                    let _ = writeln!(err, "error: {}", shown(&text));
                }
            }
        }
    }
    if failed || (args.check && changes) { Err(Failure::said()) } else { Ok(()) }
}

/// Formats one file; returns whether that changes it.
fn one(path: &Path, args: &FmtArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<bool, Failure> {
    let stdin = path == Path::new("-");
    let input = if stdin { input::read_stdin(&args.read) } else { input::read(path, &args.read) }?;
    if stages::is_compiled(&input.name) {
        return Err(Failure::new(format!("{} is a compiled shader, not a source", input.name)));
    }
    let formatted = formatted(&input, args, err)?;
    let changed = formatted != input.text;
    let unwritten = |e: std::io::Error| Failure::new(format!("cannot write: {e}"));
    if args.check && changed {
        writeln!(out, "{}", input.name).map_err(unwritten)?;
        if args.diff {
            let diff = diff::unified(&input.name, (&input.text, &formatted), "formatted");
            write!(out, "{}", shown(&diff)).map_err(unwritten)?;
        }
    } else if !args.check && stdin {
        out.write_all(formatted.as_bytes()).map_err(unwritten)?;
    } else if !args.check && changed {
        osl_files::rewrite(path, &input.encoded(&formatted)?).map_err(Failure::new)?;
    }
    Ok(changed)
}

/// The formatted text. If the file does not parse, the errors are printed and the result is a failure.
fn formatted(input: &Input, args: &FmtArgs, err: &mut dyn Write) -> Result<String, Failure> {
    let parsed = osl_syntax::parse(&input.name, &input.text, &input.files, &input.options);
    if parsed.has_errors() {
        // Only `check` reports warnings.
        let errors: Vec<Diagnostic> = parsed.diagnostics.into_iter().filter(Diagnostic::is_error).collect();
        report::diagnostics(&errors, &parsed.sources, &args.read, err)?;
    }
    let limits = &input.options.limits;
    osl_syntax::format::format_within(&input.name, &input.text, limits).or_else(|errors| {
        let mut sources = SourceMap::default();
        let _ = sources.add(input.name.as_str(), input.text.as_str().into());
        report::diagnostics(&errors, &sources, &args.read, err)?;
        Err(Failure::said())
    })
}
