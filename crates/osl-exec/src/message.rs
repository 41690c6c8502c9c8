//! What a run has to say: errors and warnings, printed text, each with the point that says it.

use crate::order::Blocks;
use osl_ir::Span;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
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
/// Bytes of the messages that a tile keeps, if it has more than one.
const MAX_BYTES: usize = 1 << 20;

/// Position of the point that says a message, and how many were said before.
type Order = (usize, usize);

/// What one thread has said. Messages are kept once, with the first of their points, and those of the first points where
/// there are too many: who comes to say one first depends on how many points run together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    /// The order of the points; by their numbers without.
    blocks: Option<Blocks>,
    known: FxHashMap<Message, Order>,
    sorted: BTreeMap<Order, Message>,
    /// The first that there was no room for: nothing behind it is kept.
    end: Option<Order>,
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

    /// Adds a message unless a point before has said it or there are too many of those before.
    pub(crate) fn add(&mut self, point: usize, message: Message) {
        let here = (self.position(point), self.said);
        self.said += 1;
        if self.end.is_some_and(|end| here > end) {
            return;
        }
        match self.known.get_mut(&message) {
            Some(first) if here.0 < first.0 => {
                self.sorted.remove(first);
                *first = here;
            }
            Some(_) => return,
            None => {
                self.bytes += message.text.len();
                self.known.insert(message.clone(), here);
            }
        }
        self.sorted.insert(here, message);
        while self.sorted.len() > MAX_MESSAGES || self.bytes > MAX_BYTES && self.sorted.len() > 1 {
            let Some((order, message)) = self.sorted.pop_last() else { break };
            self.known.remove(&message);
            self.bytes -= message.text.len();
            self.end = Some(order);
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
            list.extend(one.sorted);
            printed.append(&mut one.printed);
        }
        list.sort_by_key(|(order, _)| *order);
        printed.sort_by_key(|p| p.point);
        let mut seen = FxHashSet::default();
        let messages = list.into_iter().map(|(_, m)| m).filter(|m| seen.insert(m.clone())).collect();
        (messages, printed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is kept of messages that 40 points say, each its own and some that all say, of so many bytes; `batch` points
    /// say each before any says the next.
    fn kept(batch: usize, bytes: usize) -> Vec<Message> {
        let mut all = Messages::new(None);
        for first in (0..40).step_by(batch) {
            for step in 0..60 {
                for point in first..40.min(first + batch) {
                    let own = if step % 5 == 0 { 0 } else { point };
                    let text = format!("{step} of {own} {}", "-".repeat(bytes * (1 + step * 7 % 3)));
                    all.add(point, Message::warning(text));
                }
            }
        }
        Messages::merge([all]).0
    }

    #[test]
    fn which_messages_are_kept_does_not_depend_on_who_came_first() {
        for bytes in [0, 500, 3000, 40_000] {
            let expected = kept(1, bytes);
            assert!(expected.len() <= MAX_MESSAGES && expected.len() > 3, "{bytes}: {}", expected.len());
            let sum: usize = expected.iter().map(|m| m.text.len()).sum();
            assert!(sum <= MAX_BYTES);
            for batch in [3, 16, 40] {
                assert!(kept(batch, bytes) == expected, "{batch} points together, {bytes} bytes");
            }
        }
    }

    #[test]
    fn one_message_is_kept_however_long() {
        let mut all = Messages::new(None);
        all.add(1, Message::warning("x".repeat(2 << 20)));
        all.add(2, Message::warning("y"));
        assert_eq!(Messages::merge([all]).0.len(), 1);
    }
}
