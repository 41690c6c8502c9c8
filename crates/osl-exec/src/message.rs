//! What a run has to say: errors and warnings, printed text, each with the point that says it.

use crate::order::Blocks;
use osl_ir::Span;
use rustc_hash::{FxHashMap, FxHashSet};
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

/// What one thread has said. Messages are kept once, with the first of their points: which point comes to say one first
/// depends on how many run together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    /// The order of the points; by their numbers without.
    blocks: Option<Blocks>,
    /// Position of the point, and how many came before.
    known: FxHashMap<Message, (usize, usize)>,
    said: usize,
    printed: Vec<Printed>,
    bytes: usize,
}

impl Messages {
    /// Nothing said yet, by points in this order.
    pub(crate) fn new(blocks: Option<Blocks>) -> Messages {
        Messages { blocks, ..Messages::default() }
    }

    /// Takes what was said, and starts anew.
    pub(crate) fn take(&mut self) -> Messages {
        let anew = Messages::new(self.blocks);
        std::mem::replace(self, anew)
    }

    fn position(&self, point: usize) -> usize {
        self.blocks.map_or(point, |blocks| blocks.position(point))
    }

    /// Adds a message unless a point before has said it or there are too many.
    pub(crate) fn add(&mut self, point: usize, message: Message) {
        let here = (self.position(point), self.said);
        self.said += 1;
        if let Some(first) = self.known.get_mut(&message) {
            if here.0 < first.0 {
                *first = here;
            }
        } else if self.known.len() < MAX_MESSAGES && self.bytes < MAX_BYTES {
            self.bytes += message.text.len();
            self.known.insert(message, here);
        }
    }

    /// Adds printed text.
    pub(crate) fn print(&mut self, mut printed: Printed) {
        printed.point = self.position(printed.point);
        self.printed.push(printed);
    }

    /// All of several threads in the order of their points, each message once.
    pub(crate) fn merge(all: impl IntoIterator<Item = Messages>) -> (Vec<Message>, Vec<Printed>) {
        let (mut list, mut printed) = (Vec::new(), Vec::new());
        for mut one in all {
            list.extend(one.known);
            printed.append(&mut one.printed);
        }
        list.sort_by_key(|(_, order)| *order);
        printed.sort_by_key(|p| p.point);
        let mut seen = FxHashSet::default();
        let messages = list.into_iter().map(|(m, _)| m).filter(|m| seen.insert(m.clone())).collect();
        (messages, printed)
    }
}
