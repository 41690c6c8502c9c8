//! `oslrun explain-error CODE`: prints the lesson of a diagnostic.

use clap::Args;
use osl::lessons::{self, Lesson};
use osl_job::Failure;
use std::io::Write;

/// Which diagnostic to explain.
#[derive(Debug, Args)]
pub(in crate::cli) struct ExplainErrorArgs {
    /// A code such as E0201 or W0312, or a name such as integer-division.
    #[arg(value_name = "CODE", required_unless_present = "list")]
    code: Option<String>,
    /// List all codes with their titles.
    #[arg(long)]
    list: bool,
}

/// Prints the lesson of a code or name, or the list of all.
pub(in crate::cli) fn explain(args: &ExplainErrorArgs, out: &mut dyn Write) -> Result<(), Failure> {
    if args.list {
        for lesson in lessons::all() {
            let _ = writeln!(out, "{}  {}", lesson.code, lesson.title);
        }
        return Ok(());
    }
    let wanted = args.code.as_deref().unwrap_or("").trim();
    let found: Vec<&Lesson> = lessons::find(wanted);
    if found.is_empty() {
        return Err(Failure::new(unknown(wanted)));
    }
    for (index, lesson) in found.into_iter().enumerate() {
        if index > 0 {
            let _ = writeln!(out);
        }
        let _ = write!(out, "{}", lesson.text.trim_end());
        let _ = writeln!(out);
    }
    Ok(())
}

fn unknown(wanted: &str) -> String {
    let close: Vec<String> =
        lessons::closest(wanted).into_iter().map(|c| format!("{} ({})", c.id, c.name)).collect();
    match close.is_empty() {
        true => format!("there is no diagnostic `{wanted}`; `oslrun explain-error --list` lists them"),
        false => format!("there is no diagnostic `{wanted}`; did you mean {}?", close.join(" or ")),
    }
}
