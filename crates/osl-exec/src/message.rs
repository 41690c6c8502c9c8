//! What a run has to say: errors and warnings, printed text, each with the point that says it.

use osl_ir::Span;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// An error or warning of the shader, or of what it asked for.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Message {
    /// Whether it is an error rather than a warning.
    pub error: bool,
    /// The text, one line but for what the shader itself says; `{0}`, `{1}` stand for places.
    pub text: Arc<str>,
    /// Places in the source that the text names.
    pub places: Vec<Span>,
}

impl Message {
    /// An error.
    pub fn error(text: impl Into<Arc<str>>) -> Message {
        Message { error: true, text: text.into(), places: Vec::new() }
    }

    /// An error that names places.
    pub fn error_at(text: impl Into<Arc<str>>, places: Vec<Span>) -> Message {
        Message { error: true, text: text.into(), places }
    }

    /// A warning.
    pub fn warning(text: impl Into<Arc<str>>) -> Message {
        Message { error: false, text: text.into(), places: Vec::new() }
    }

    /// The text with its places in words.
    pub fn show(&self, place: impl Fn(Span) -> String) -> String {
        let mut text = self.text.to_string();
        for (index, span) in self.places.iter().enumerate() {
            text = text.replace(&format!("{{{index}}}"), &place(*span));
        }
        text
    }
}

/// Text that a point printed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Printed {
    /// The point, by its position in the results.
    pub point: usize,
    /// The file to append it to; `None` is the run's output.
    pub file: Option<Arc<str>>,
    /// The text.
    pub text: String,
}

/// Different messages that a tile keeps.
const MAX_MESSAGES: usize = 1000;
/// Bytes of the messages that a tile keeps.
const MAX_BYTES: usize = 1 << 20;

/// What one thread has said.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    list: Vec<(usize, Message)>,
    known: FxHashSet<Message>,
    printed: Vec<Printed>,
    bytes: usize,
}

impl Messages {
    /// Adds a message unless it is there already or there are too many.
    pub(crate) fn add(&mut self, point: usize, message: Message) {
        if self.list.len() < MAX_MESSAGES && self.bytes < MAX_BYTES && !self.known.contains(&message) {
            self.bytes += message.text.len();
            self.known.insert(message.clone());
            self.list.push((point, message));
        }
    }

    /// Adds printed text.
    pub(crate) fn print(&mut self, printed: Printed) {
        self.printed.push(printed);
    }

    /// All of several threads by the positions of their points, each message once.
    pub(crate) fn merge(
        all: impl IntoIterator<Item = Messages>,
        position: impl Fn(usize) -> usize,
    ) -> (Vec<Message>, Vec<Printed>) {
        let (mut list, mut printed) = (Vec::new(), Vec::new());
        for mut one in all {
            list.append(&mut one.list);
            printed.append(&mut one.printed);
        }
        list.sort_by_key(|(point, _)| position(*point));
        printed.iter_mut().for_each(|p| p.point = position(p.point));
        printed.sort_by_key(|p| p.point);
        let mut seen = FxHashSet::default();
        let messages = list.into_iter().map(|(_, m)| m).filter(|m| seen.insert(m.clone())).collect();
        (messages, printed)
    }
}
