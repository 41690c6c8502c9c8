//! The messages of a run: errors and warnings, and printed text, each with the points that caused it.
//!
//! A run keeps each message once, with the number of its points and the first of them; or, if requested,
//! every occurrence, in the order of the points.

use crate::order::Blocks;
use osl_ir::Span;
use osl_limits::Running;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
use std::sync::Arc;

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// An error.
    Error,
    /// A warning.
    Warning,
    /// A fact about the run that is no fault of the shader. Where every occurrence is kept, notes are not.
    Note,
}

/// An error or warning of the shader, or a message about something that it requested.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Message {
    /// How serious it is.
    pub severity: Severity,
    /// The text, on one line except for the shader's own text; `{0}`, `{1}` stand for locations.
    pub text: Arc<str>,
    /// Source locations to which the text refers.
    pub places: Vec<Span>,
    /// The source location that caused it.
    pub at: Option<Span>,
    /// The file that could not be used, if the message is about one: a texture by the name in the shader.
    pub file: Option<Arc<str>>,
}

impl Message {
    /// An error.
    pub fn error(text: impl Into<Arc<str>>) -> Message {
        Message { severity: Severity::Error, text: text.into(), places: Vec::new(), at: None, file: None }
    }

    /// An error that refers to locations.
    pub fn error_at(text: impl Into<Arc<str>>, places: Vec<Span>) -> Message {
        Message { places, ..Message::error(text) }
    }

    /// A warning.
    pub fn warning(text: impl Into<Arc<str>>) -> Message {
        Message { severity: Severity::Warning, ..Message::error(text) }
    }

    /// A note.
    pub fn note(text: impl Into<Arc<str>>) -> Message {
        Message { severity: Severity::Note, ..Message::error(text) }
    }

    /// The same message about a file that could not be used.
    #[must_use]
    pub fn about_file(self, name: impl Into<Arc<str>>) -> Message {
        Message { file: Some(name.into()), ..self }
    }

    /// The text with its locations as text.
    pub fn show(&self, place: impl Fn(Span) -> String) -> String {
        let mut text = self.text.to_string();
        for (index, span) in self.places.iter().enumerate() {
            text = text.replace(&format!("{{{index}}}"), &place(*span));
        }
        text
    }
}

/// A message, and the points that caused it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// The message.
    pub message: Message,
    /// Number of points; `None` if there were too many messages to count.
    pub points: Option<u64>,
    /// The first of the points: see [`PointSource::pixel`](crate::PointSource::pixel).
    pub first: usize,
}

/// Text that a point printed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Printed {
    /// The point, by its position in the results.
    pub point: usize,
    /// The file to which it is appended; `None` is the run's output.
    pub file: Option<Arc<str>>,
    /// The text.
    pub text: String,
}

/// A visible effect of a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// It printed.
    Printed(Printed),
    /// It caused a message.
    Said(Arc<Message>),
}

/// Maps a location to the one that represents all locations with the same display, such as the start of the
/// line.
pub type StandFor = Arc<dyn Fn(Span) -> Span + Send + Sync>;

/// How a run keeps messages.
#[derive(Clone, Default)]
pub struct Keeping {
    /// Whether every occurrence of printed text and messages is kept, as [`Event`]s in the order of the
    /// points.
    pub each: bool,
    /// Which locations count as one.
    pub places: Option<StandFor>,
}

impl std::fmt::Debug for Keeping {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut fields = f.debug_struct("Keeping");
        fields.field("each", &self.each).field("places", &self.places.is_some()).finish()
    }
}

/// How many messages are kept of a tile, and of a run, and how many bytes of them if there is more than one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Room {
    messages: usize,
    bytes: usize,
}

impl Room {
    /// What limits permit.
    pub(crate) fn of(limits: &Running) -> Room {
        let [messages, bytes] =
            [limits.messages, limits.message_bytes].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        Room { messages, bytes }
    }
}

impl Default for Room {
    fn default() -> Room {
        Room::of(&Running::default())
    }
}

/// Bytes charged for a printed text or a message besides its contents.
const BESIDE: u64 = 64;

/// Position of the point that caused a message, and the number of earlier ones.
type Order = (usize, usize);

/// The points of a message.
#[derive(Clone, Debug)]
struct Points {
    first: Order,
    count: u64,
    /// The start of the last batch that caused it, and a bit for each lane that did.
    batch: usize,
    lanes: Vec<u64>,
}

impl Points {
    /// Counts a point of a batch, once.
    fn count(&mut self, batch: usize, point: usize) {
        if self.batch != batch {
            self.batch = batch;
            self.lanes.clear();
        }
        let lane = point.saturating_sub(batch);
        if self.lanes.len() <= lane / 64 {
            self.lanes.resize(lane / 64 + 1, 0);
        }
        let Some(word) = self.lanes.get_mut(lane / 64) else { return };
        let bit = 1 << (lane % 64);
        self.count += u64::from(*word & bit == 0);
        *word |= bit;
    }
}

/// The messages that are kept once.
#[derive(Clone, Debug, Default)]
struct UniqueMessages {
    list: FxHashMap<Message, Points>,
    sorted: BTreeMap<Order, Message>,
    /// Position of the first message that found no room. Later messages are not kept.
    end: Option<Order>,
    bytes: usize,
}

/// The state of the messages when a batch began.
#[derive(Clone, Debug, Default)]
struct Before {
    /// The messages known then, once the batch has changed them.
    known: Option<Box<UniqueMessages>>,
    said: usize,
    printed: usize,
    events: usize,
}

/// The messages of one thread. Messages are kept once, with the first of their points; if there are too many,
/// those of the first points are kept, because which point reports first depends on the batch size.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    /// The order of the points; without it, their numbers.
    blocks: Option<Blocks>,
    keeping: Keeping,
    room: Room,
    /// The first point of the current batch.
    batch: usize,
    known: UniqueMessages,
    before: Before,
    said: usize,
    printed: Vec<Printed>,
    /// Bytes that the batch has printed.
    bytes: u64,
    /// Kept occurrences, and the messages in them.
    events: Vec<(Order, Event)>,
    shared: FxHashSet<Arc<Message>>,
    /// Cache of the locations that count as one.
    places: FxHashMap<Span, Span>,
}

impl Messages {
    /// No messages yet, for points in this order.
    pub(crate) fn new(blocks: Option<Blocks>, keeping: Keeping, room: Room) -> Messages {
        Messages { blocks, keeping, room, ..Messages::default() }
    }

    /// Takes all messages, and starts again.
    pub(crate) fn take(&mut self) -> Messages {
        let anew = Messages::new(self.blocks, self.keeping.clone(), self.room);
        std::mem::replace(self, anew)
    }

    /// Begins a batch.
    pub(crate) fn begin(&mut self, first: usize) {
        self.batch = first;
        self.bytes = 0;
        let (printed, events) = (self.printed.len(), self.events.len());
        self.before = Before { known: None, said: self.said, printed, events };
    }

    /// Discards the messages of the batch.
    pub(crate) fn roll_back(&mut self) {
        if let Some(known) = self.before.known.take() {
            self.known = *known;
        }
        self.said = self.before.said;
        self.printed.truncate(self.before.printed);
        self.events.truncate(self.before.events);
        self.bytes = 0;
    }

    /// Bytes that the batch has printed, and of kept occurrences of messages.
    pub(crate) fn printed_bytes(&self) -> u64 {
        self.bytes
    }

    /// Discards printed text if there is too much of it.
    pub(crate) fn drop_printed(&mut self) {
        self.printed = Vec::new();
        self.events = Vec::new();
    }

    /// Whether every occurrence of a message is kept.
    pub(crate) fn keeps_each(&self) -> bool {
        self.keeping.each
    }

    fn position(&self, point: usize) -> usize {
        position(self.blocks, point)
    }

    /// The location that represents a location.
    fn place(&mut self, at: Span) -> Span {
        match &self.keeping.places {
            Some(stand_for) => *self.places.entry(at).or_insert_with(|| stand_for(at)),
            None => at,
        }
    }

    /// Adds a message of some points of the batch.
    pub(crate) fn add(&mut self, points: impl IntoIterator<Item = usize>, mut message: Message) {
        message.at = message.at.map(|at| self.place(at));
        let said = self.said;
        self.said += 1;
        if self.keeping.each {
            for point in points.into_iter().filter(|_| message.severity != Severity::Note) {
                self.note((self.position(point), said), &message);
            }
        } else {
            self.add_known(points.into_iter(), said, &message);
        }
    }

    /// Adds a message of some points unless an earlier point has caused it or there are too many earlier
    /// ones.
    fn add_known(&mut self, mut points: impl Iterator<Item = usize>, said: usize, message: &Message) {
        while let Some(point) = points.next() {
            let here = (self.position(point), said);
            if self.before.known.is_none() {
                self.before.known = Some(Box::new(self.known.clone()));
            }
            let (blocks, batch, room) = (self.blocks, self.batch, self.room);
            let known = &mut self.known;
            if let Some(found) = known.list.get_mut(message) {
                // It stays known, so that it is found once for all further points.
                for point in std::iter::once(point).chain(points) {
                    let here = (position(blocks, point), said);
                    found.count(batch, point);
                    if here.0 < found.first.0 {
                        known.sorted.remove(&found.first);
                        found.first = here;
                        known.sorted.insert(here, message.clone());
                    }
                }
                return;
            }
            if known.end.is_some_and(|end| here > end) {
                continue;
            }
            known.bytes += message.text.len();
            let mut found = Points { first: here, count: 0, batch, lanes: Vec::new() };
            found.count(batch, point);
            known.list.insert(message.clone(), found);
            known.sorted.insert(here, message.clone());
            while known.sorted.len() > room.messages || known.bytes > room.bytes && known.sorted.len() > 1 {
                let Some((order, message)) = known.sorted.pop_last() else { break };
                known.list.remove(&message);
                known.bytes -= message.text.len();
                known.end = Some(order);
            }
        }
    }

    /// Keeps a message as an event.
    fn note(&mut self, here: Order, message: &Message) {
        let known = self.shared.get(message).cloned();
        let message = known.unwrap_or_else(|| {
            let message = Arc::new(message.clone());
            self.shared.insert(message.clone());
            message
        });
        // Charged as if each had a separate text: which of them share one depends on the tiles.
        self.bytes += message.text.len() as u64 + BESIDE;
        self.events.push((here, Event::Said(message)));
    }

    /// Adds printed text. Returns its size in bytes.
    pub(crate) fn print(&mut self, mut printed: Printed) -> u64 {
        let bytes = printed.text.len() as u64 + BESIDE;
        self.bytes += bytes;
        printed.point = self.position(printed.point);
        if self.keeping.each {
            let here = (printed.point, self.said);
            self.said += 1;
            self.events.push((here, Event::Printed(printed)));
        } else {
            self.printed.push(printed);
        }
        bytes
    }

    /// Merges the messages of several threads in the order of their points: each message once, printed text,
    /// events.
    pub(crate) fn merge(
        all: impl IntoIterator<Item = Messages>,
        limits: &Running,
    ) -> (Vec<Said>, Vec<Printed>, Vec<Event>) {
        let (mut list, mut printed, mut events) = (Vec::new(), Vec::new(), Vec::new());
        for mut one in all {
            let UniqueMessages { list: known, sorted, end, .. } = one.known;
            for (order, message) in sorted {
                let count = known.get(&message).map(|points| points.count).filter(|_| end.is_none());
                list.push((order, Said { message, points: count, first: order.0 }));
            }
            printed.append(&mut one.printed);
            events.append(&mut one.events);
        }
        list.sort_by_key(|(order, _)| *order);
        printed.sort_by_key(|p| p.point);
        events.sort_by_key(|(order, _)| *order);
        let mut messages = Vec::new();
        unite(&mut messages, list.into_iter().map(|(_, said)| said), limits);
        (messages, printed, events.into_iter().map(|(_, event)| event).collect())
    }
}

/// The position of a point in an order of points.
fn position(blocks: Option<Blocks>, point: usize) -> usize {
    blocks.map_or(point, |blocks| blocks.position(point))
}

/// Adds messages to a list that contains each once, as long as there is room for them. `more` begins with the
/// earliest.
pub fn unite(list: &mut Vec<Said>, more: impl IntoIterator<Item = Said>, limits: &Running) {
    let room = Room::of(limits);
    let mut known: FxHashMap<Message, usize> =
        list.iter().enumerate().map(|(at, said)| (said.message.clone(), at)).collect();
    for said in more {
        match known.get(&said.message).and_then(|at| list.get_mut(*at)) {
            Some(before) => {
                before.points = before.points.zip(said.points).map(|(a, b)| a + b);
                before.first = before.first.min(said.first);
            }
            None => {
                known.insert(said.message.clone(), list.len());
                list.push(said);
            }
        }
    }
    let mut bytes = 0;
    let fits = |said: &&Said| {
        bytes += said.message.text.len();
        bytes <= room.bytes
    };
    let fit = list.iter().take(room.messages).take_while(fits).count().max(1);
    // Once messages have been dropped, the number of points that say one of the others is unknown.
    if list.len() > fit || list.iter().any(|said| said.points.is_none()) {
        list.truncate(fit);
        list.iter_mut().for_each(|said| said.points = None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The kept messages if 40 points each cause their own and some common ones, with this many bytes;
    /// `batch` points cause each message before any causes the next one.
    fn kept(batch: usize, bytes: usize) -> Vec<Said> {
        let mut all = Messages::new(None, Keeping::default(), Room::default());
        for first in (0..40).step_by(batch) {
            all.begin(first);
            for step in 0..60 {
                for point in first..40.min(first + batch) {
                    let own = if step % 5 == 0 { 0 } else { point };
                    let text = format!("{step} of {own} {}", "-".repeat(bytes * (1 + step * 7 % 3)));
                    all.add([point], Message::warning(text));
                }
            }
        }
        Messages::merge([all], &Running::default()).0
    }

    #[test]
    fn which_messages_are_kept_does_not_depend_on_who_came_first() {
        for bytes in [0, 500, 3000, 40_000] {
            let expected = kept(1, bytes);
            let room = Room::default();
            assert!(expected.len() <= room.messages && expected.len() > 3, "{bytes}: {}", expected.len());
            let sum: usize = expected.iter().map(|m| m.message.text.len()).sum();
            assert!(sum <= room.bytes);
            for batch in [3, 16, 40] {
                assert!(kept(batch, bytes) == expected, "{batch} points together, {bytes} bytes");
            }
        }
    }

    #[test]
    fn one_message_is_kept_however_long() {
        let mut all = Messages::new(None, Keeping::default(), Room::default());
        all.add([1], Message::warning("x".repeat(2 << 20)));
        all.add([2], Message::warning("y"));
        assert_eq!(Messages::merge([all], &Running::default()).0.len(), 1);
    }
}
