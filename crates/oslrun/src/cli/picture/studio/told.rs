//! What the work for an answer leaves besides the answer: the messages, the reason to stop, and the files to
//! watch.

use crate::cli::print::json;
use osl_files::stamp;
use osl_job::source::reads::Reads;
use osl_job::{Event, Failure, Severity, Sink};
use osl_limits::Cancel;
use osl_studio::{Files, Stop};
use serde::Serialize;
use serde_json::Value;

/// How much printed text a page shows, in bytes.
const MAX_TEXT: usize = 64 << 10;

/// Collects the events of a request as the objects that a page gets.
#[derive(Default)]
pub(super) struct Told {
    /// The messages.
    pub(super) messages: Vec<Value>,
    /// The text that the shader printed, up to a limit.
    pub(super) printed: String,
}

impl Told {
    fn add(&mut self, object: &impl Serialize) {
        self.messages.extend(serde_json::to_value(object));
    }
}

impl Sink for Told {
    fn event(&mut self, event: Event<'_>) {
        match event {
            Event::Diagnostics { list, sources, .. } => {
                json::diagnostics(list, sources, |object| self.add(object));
            }
            Event::Message(message) => self.add(&json::message(message)),
            Event::Scene(message) => self.add(&json::scene(message)),
            Event::Line(severity, text) => self.add(&json::line(severity, text)),
            Event::Doubt(text) => self.add(&json::doubt(text)),
            Event::Text(text) => {
                let lines = text.lines().filter(|line| !line.trim().is_empty());
                lines.for_each(|line| self.add(&json::line(Severity::Note, line)));
            }
            Event::Printed(text) => {
                let room = MAX_TEXT.saturating_sub(self.printed.len());
                self.printed.push_str(text.get(..text.floor_char_boundary(room)).unwrap_or_default());
            }
        }
    }
}

/// Does work that answers a question. Returns its result; if it failed, with the reason as the last message.
pub(super) fn told<T>(work: impl FnOnce(&mut Told) -> Result<T, Failure>) -> (Told, Option<T>) {
    let mut told = Told::default();
    match work(&mut told) {
        Ok(answer) => (told, Some(answer)),
        Err(Failure { text, .. }) => {
            if !text.is_empty() {
                told.add(&json::line(Severity::Error, &text));
            }
            (told, None)
        }
    }
}

/// Does work that answers a question; stops if it fails or nobody waits for the answer.
pub(super) fn answer<T>(
    cancel: &Cancel,
    work: impl FnOnce(&mut Told) -> Result<T, Failure>,
) -> Result<T, Stop> {
    let (told, answer) = told(work);
    answer.filter(|_| !cancel.is_cancelled()).ok_or_else(|| stop(told.messages, cancel))
}

/// The stop of work that failed with these messages.
pub(super) fn stop(messages: Vec<Value>, cancel: &Cancel) -> Stop {
    if cancel.is_cancelled() { Stop::Cancelled } else { Stop::Failed(messages) }
}

/// Adds files that were read to those that a page watches.
pub(super) fn watch(reads: Reads, files: &mut Files) {
    for path in reads.0 {
        files.entry(path).or_insert_with_key(|path| stamp(path));
    }
}
