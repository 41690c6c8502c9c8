//! What a request says while it runs.

use crate::Failure;
use crate::message::{Message, Severity};
use crate::request::Lints;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use std::sync::Arc;

/// Something that a request says while it runs.
pub enum Event<'a> {
    /// The diagnostics of a shader that is about to run, at least of the levels that were asked for.
    Diagnostics {
        /// The diagnostics.
        list: &'a [Diagnostic],
        /// The files of their positions.
        sources: &'a SourceMap,
        /// The warnings that the user asks for. A client may only count the others, because a run is repeated
        /// and `check` shows them. Without it, all are to be shown.
        asked: Option<&'a Lints>,
    },
    /// A message of a running shader.
    Message(&'a Message),
    /// A message about a line of a scene.
    Scene(&'a osl_scene::scene::Message),
    /// A line about the request itself.
    Line(Severity, &'a str),
    /// An option that has no effect, or a doubtful value.
    Doubt(&'a str),
    /// Text of several lines: a diff of repaired brackets.
    Text(&'a str),
    /// Text that a shader prints.
    Printed(&'a str),
}

/// Gets the events of a request.
pub trait Sink {
    /// Takes an event.
    fn event(&mut self, event: Event<'_>);

    /// Called before files are replaced: fails if the text of earlier events was lost.
    ///
    /// # Errors
    /// The text could not be written; it is reported elsewhere.
    fn settle(&mut self) -> Result<(), Failure> {
        Ok(())
    }

    /// Makes the meters that show the progress of long work.
    fn meters(&self) -> Meters {
        Arc::new(|_, _| Box::new(NoMeter))
    }

    /// A note.
    fn note(&mut self, text: &str) {
        self.event(Event::Line(Severity::Note, text));
    }

    /// A warning.
    fn warn(&mut self, text: &str) {
        self.event(Event::Line(Severity::Warning, text));
    }
}

/// Drops all events.
pub struct NoSink;

impl Sink for NoSink {
    fn event(&mut self, _: Event<'_>) {}
}

/// Makes a meter for an amount of work and the name of its unit, which is empty if only a share is counted.
pub type Meters = Arc<dyn Fn(u64, &'static str) -> Box<dyn Meter> + Send + Sync>;

/// Shows how much of some work is done; it ends when it is dropped.
pub trait Meter: Sync {
    /// Sets how much is done.
    fn at(&self, done: u64);
}

struct NoMeter;

impl Meter for NoMeter {
    fn at(&self, _: u64) {}
}
