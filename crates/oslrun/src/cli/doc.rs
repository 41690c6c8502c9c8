//! `oslrun doc [NAME]`: the reference of the built-in functions.

use super::Failure;
use super::args::DocArgs;
use crate::reference;
use std::io::Write;

/// Prints the list, an entry, or the whole reference as a page.
pub(super) fn doc(args: &DocArgs, out: &mut dyn Write) -> Result<(), Failure> {
    let text = match &args.name {
        None if args.markdown => reference::markdown(),
        None => reference::list(),
        Some(name) => {
            let entries: Vec<String> =
                reference::find(name.trim()).into_iter().map(reference::entry).collect();
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
    match reference::closest(name) {
        Some(close) => format!("there is no built-in function `{name}`; did you mean `{close}`?"),
        None => format!("there is no built-in function `{name}`; `oslrun doc` lists them"),
    }
}
