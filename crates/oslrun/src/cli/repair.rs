//! `--repair`: inserts missing brackets, shows the edits, and runs the repaired text.

use super::input::Input;
use super::{Failure, diff};
use osl::stages;
use osl_syntax::escape::shown;
use osl_syntax::repair::repair;
use std::io::Write;
use std::path::Path;

/// Replaces the text by its repaired form, and prints the edits as a diff. A text without such errors is not
/// changed.
pub(super) fn apply(input: &mut Input, write: Option<&Path>, err: &mut dyn Write) -> Result<(), Failure> {
    if stages::is_compiled(&input.name) {
        return Err(Failure::usage("--repair is for sources, not for compiled shaders"));
    }
    let parsed = osl_syntax::parse(&input.name, &input.text, &input.files, &input.options);
    if parsed.has_errors() {
        let Some(found) = repair(&input.name, &input.text, &input.files, &input.options) else {
            let _ = writeln!(err, "note: inserting brackets does not make this file whole");
            return Ok(());
        };
        let diff = diff::unified(&input.name, (&input.text, &found.text), "repaired");
        let _ = write!(err, "{}", shown(&diff));
        for (_, change) in &found.changes {
            let _ = writeln!(err, "note: {change}");
        }
        input.text = found.text;
    }
    if let Some(path) = write {
        osl_files::replace(path, input.text.as_bytes()).map_err(Failure::new)?;
    }
    Ok(())
}
