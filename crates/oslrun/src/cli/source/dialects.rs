//! `oslrun dialects [NAME]`: the dialects of renderers, and the table of one.

use crate::cli::options::reading::{FormatArgs, ReadArgs};
use crate::cli::print::Console;
use clap::Args;
use osl_job::Failure;
use osl_job::source::dialect;

/// What to show.
#[derive(Debug, Args)]
pub(in crate::cli) struct DialectsArgs {
    /// A dialect (default: list all).
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Print the tables of all dialects as Markdown: docs/dialects.md.
    #[arg(long, conflicts_with = "name")]
    markdown: bool,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// The text before the tables of docs/dialects.md.
const HEAD: &str = include_str!("dialects_head.md");

/// Prints the list or a table.
pub(in crate::cli) fn dialects(args: &DialectsArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let known = dialect::known(&args.read.reading())?;
    let text = match &args.name {
        _ if args.markdown => format!("{HEAD}\n{}", known.page()),
        Some(name) => dialect::named(name, &known)?.page(),
        None => known.list_text(),
    };
    console.report(&text);
    Ok(())
}
