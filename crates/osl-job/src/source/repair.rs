//! Inserts missing brackets into a source before it is compiled.

use super::diff;
use super::input::Input;
use crate::Failure;
use crate::event::{Event, Sink};
use osl::stages;
use osl_syntax::repair::repair;
use std::path::Path;

/// The edits that made a source whole.
pub struct Edits {
    /// The edits as a unified diff; empty if no edit helps.
    diff: String,
    notes: Vec<String>,
}

impl Edits {
    /// Sends the diff, and a note on each change.
    pub fn send(&self, sink: &mut dyn Sink) {
        if !self.diff.is_empty() {
            sink.event(Event::Text(&self.diff));
        }
        self.notes.iter().for_each(|note| sink.note(note));
    }
}

/// Replaces the text by its repaired form, and returns the edits. A text without such errors is not changed.
///
/// # Errors
/// The file is a compiled shader, or the repaired text cannot be written to `write`.
pub fn apply(input: &mut Input, write: Option<&Path>) -> Result<Option<Edits>, Failure> {
    if stages::is_compiled(&input.name) {
        return Err(Failure::usage("--repair is for sources, not for compiled shaders"));
    }
    let parsed = osl_syntax::parse(&input.name, &input.text, &input.files, &input.options);
    let mut edits = None;
    if parsed.has_errors() {
        let Some(found) = repair(&input.name, &input.text, &input.files, &input.options) else {
            let why = "inserting brackets does not make this file whole".to_string();
            return Ok(Some(Edits { diff: String::new(), notes: vec![why] }));
        };
        let diff = diff::unified(&input.name, (&input.text, &found.text), "repaired");
        let notes = found.changes.iter().map(|(_, change)| change.to_string()).collect();
        edits = Some(Edits { diff, notes });
        input.text = found.text;
    }
    if let Some(path) = write {
        osl_files::replace(path, input.text.as_bytes()).map_err(Failure::new)?;
    }
    Ok(edits)
}
