//! `oslrun doc [NAME]`: the reference of the built-in functions.

use super::Failure;
use crate::reference;
use clap::Args;
use std::io::Write;

/// Which function to describe.
#[derive(Debug, Args)]
pub(super) struct DocArgs {
    /// A function, such as smoothstep (default: list all).
    #[arg(value_name = "NAME")]
    pub(super) name: Option<String>,
    /// Print the whole reference as Markdown: docs/builtins.md.
    #[arg(long, conflicts_with = "name")]
    pub(super) markdown: bool,
}

/// Prints the list, an entry, or the whole reference as a page.
pub(super) fn doc(args: &DocArgs, out: &mut dyn Write) -> Result<(), Failure> {
    let text = match &args.name {
        None if args.markdown => reference::markdown(),
        None => reference::list(),
        Some(name) => {
            let entries: Vec<String> =
                osl::reference::find(name.trim()).iter().map(reference::entry).collect();
            if entries.is_empty() {
                return Err(Failure::new(unknown(name)));
            }
            entries.join("\n")
        }
    };
    let _ = write!(out, "{text}");
    Ok(())
}

fn unknown(name: &str) -> String {
    match osl::reference::closest(name) {
        Some(close) => format!("there is no built-in function `{name}`; did you mean `{close}`?"),
        None => format!("there is no built-in function `{name}`; `oslrun doc` lists them"),
    }
}
