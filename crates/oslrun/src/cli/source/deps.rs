//! `--deps FILE`: what a command has read, as a rule for make and for tools that read its form.

use osl_files::Used;
use osl_job::Failure;
use std::path::{Path, PathBuf};

/// Writes the rule for what this process has read and written.
///
/// # Errors
/// The file cannot be written, or it is one of those that were read.
pub(in crate::cli) fn write(file: Option<PathBuf>) -> Result<(), Failure> {
    let Some(file) = file else { return Ok(()) };
    osl_files::replace(&file, rule(&osl_files::used(), &file).as_bytes()).map_err(Failure::new)
}

/// The rule, and below it an empty rule for each file read, so that make does not stop where one is gone.
fn rule(used: &Used, file: &Path) -> String {
    let own = [file.to_owned()];
    let targets = if used.written.is_empty() { &own } else { &used.written[..] };
    let names = |list: &[PathBuf]| list.iter().map(|path| escaped(path)).collect::<Vec<_>>();
    let read = names(&used.read);
    let mut text = format!("{}: {}\n", names(targets).join(" "), read.join(" \\\n  "));
    read.iter().for_each(|name| text += &format!("\n{name}:\n"));
    text
}

/// A name as make reads it.
fn escaped(path: &Path) -> String {
    let mut text = String::new();
    for letter in path.display().to_string().chars() {
        match letter {
            ' ' | '#' => text.extend(['\\', letter]),
            '$' => text += "$$",
            letter => text.push(letter),
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_has_targets_inputs_and_an_empty_rule_for_each_input() {
        let list = |names: &[&str]| names.iter().map(PathBuf::from).collect();
        let used = Used { read: list(&["a b.osl", "x$.h"]), written: list(&["o.exr"]) };
        let expected = "o.exr: a\\ b.osl \\\n  x$$.h\n\na\\ b.osl:\n\nx$$.h:\n";
        assert_eq!(rule(&used, Path::new("o.d")), expected);
        let used = Used { read: list(&["a.osl"]), written: Vec::new() };
        assert_eq!(rule(&used, Path::new("o.d")), "o.d: a.osl\n\na.osl:\n");
    }
}
