//! `oslrun portability FILE`: what each renderer lacks of what a shader uses.

use crate::cli::options::heading;
use crate::cli::options::reading::{FormatArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl::stages;
use osl_job::Failure;
use osl_job::source::portability::{Portability, compare};
use osl_job::source::{dialect, input};
use serde_json::json;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Which shader to compare.
#[derive(Debug, Args)]
pub(in crate::cli) struct PortabilityArgs {
    /// The shader file, a source.
    #[arg(value_name = "FILE.osl")]
    file: PathBuf,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
    /// Let the shader include any file, not only those of its project.
    #[arg(long, help_heading = heading::FILES)]
    allow_files: bool,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Prints the differences of each renderer.
pub(in crate::cli) fn portability(args: &PortabilityArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let reading = args.read.reading();
    let mut input = input::read(&args.file, &reading)?;
    if stages::is_compiled(&input.name) {
        return Err(Failure::usage("portability is for sources, not for compiled shaders"));
    }
    input.files = input.files.or_anywhere(args.allow_files);
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let errors: Vec<_> = checked.diagnostics.iter().filter(|d| d.is_error()).cloned().collect();
    console.diagnostics(&errors, &checked.sources)?;
    let program = checked.program.ok_or_else(Failure::said)?;
    let found = compare(&input, &program, dialect::known(&reading)?.as_ref());
    if args.json {
        let difference = |d: &osl_job::source::portability::Difference| json!({ "line": d.line, "what": d.what, "why": d.why });
        let one = |p: &Portability| {
            let list: Vec<_> = p.differences.iter().map(difference).collect();
            json!({ "dialect": p.name, "title": p.title, "differences": list })
        };
        return console.object(&found.iter().map(one).collect::<Vec<_>>());
    }
    console.report(&text(&found));
    Ok(())
}

/// The renderers without a known difference on one line, then the others.
fn text(found: &[Portability]) -> String {
    let (same, other): (Vec<_>, Vec<_>) = found.iter().partition(|p| p.differences.is_empty());
    let same: Vec<&str> = same.iter().map(|p| p.title.as_str()).collect();
    let mut out = String::new();
    if !same.is_empty() {
        let _ = writeln!(out, "no known difference: {}", same.join(", "));
    }
    for Portability { title, differences, .. } in other {
        let _ = writeln!(out, "{title}:");
        for d in differences {
            let place = if d.line == 0 { String::new() } else { format!("line {}: ", d.line) };
            let _ = writeln!(out, "    {place}{}: {}", d.what, d.why);
        }
    }
    out
}
