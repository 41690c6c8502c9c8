//! What a run has to say: errors and warnings, printed text, each with the points that say it.
//!
//! A run keeps each message once, with the number of its points and the first of them; or, where that is asked for, each
//! time that a point says it, in the order of the points. It must not know how messages are shown.

use crate::order::Blocks;
use osl_ir::Span;
use osl_limits::Running;
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
    /// The place in the source that says it.
    pub at: Option<Span>,
    /// The file that could not be used, if that is what it says: a texture by the name that the shader gave it.
    pub file: Option<Arc<str>>,
}

impl Message {
    /// An error.
    pub fn error(text: impl Into<Arc<str>>) -> Message {
        Message { error: true, text: text.into(), places: Vec::new(), at: None, file: None }
    }

    /// An error that names places.
    pub fn error_at(text: impl Into<Arc<str>>, places: Vec<Span>) -> Message {
        Message { places, ..Message::error(text) }
    }

    /// A warning.
    pub fn warning(text: impl Into<Arc<str>>) -> Message {
        Message { error: false, ..Message::error(text) }
    }

    /// The same message about a file that could not be used.
    #[must_use]
    pub fn about_file(self, name: impl Into<Arc<str>>) -> Message {
        Message { file: Some(name.into()), ..self }
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

/// A message, and which points say it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// The message.
    pub message: Message,
    /// How many points say it; `None` where there were too many messages to count.
    pub points: Option<u64>,
    /// The first of the points: see [`PointSource::pixel`](crate::PointSource::pixel).
    pub first: usize,
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

/// Something that a point did for others to see.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// It printed.
    Printed(Printed),
    /// It said a message.
    Said(Arc<Message>),
}

/// Finds the place that stands for all places which are shown alike, such as the start of the line.
pub type StandFor = Arc<dyn Fn(Span) -> Span + Send + Sync>;

/// How a run keeps messages.
#[derive(Clone, Default)]
pub struct Keeping {
    /// Whether what points print and say is kept each time, as [`Event`]s in the order of the points.
    pub each: bool,
    /// Which places count as one.
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

/// Bytes that count for a printed text or a message beside its own.
const BESIDE: u64 = 64;

/// Position of the point that says a message, and how many were said before.
type Order = (usize, usize);

/// The points of a message.
#[derive(Clone, Debug)]
struct Points {
    first: Order,
    count: u64,
    /// The first point of the last batch that says it, and a bit for each lane that does.
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
struct Known {
    list: FxHashMap<Message, Points>,
    sorted: BTreeMap<Order, Message>,
    /// Position of the first message that found no room. Later messages are not kept.
    end: Option<Order>,
    bytes: usize,
}

/// What had been said when a batch began.
#[derive(Clone, Debug, Default)]
struct Before {
    /// What was known, once the batch has changed it.
    known: Option<Box<Known>>,
    said: usize,
    printed: usize,
    events: usize,
}

/// What one thread has said. Messages are kept once, with the first of their points, and those of the first points where
/// there are too many: who comes to say one first depends on how many points run together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Messages {
    /// The order of the points; by their numbers without.
    blocks: Option<Blocks>,
    keeping: Keeping,
    room: Room,
    /// The first point of the batch that runs.
    batch: usize,
    known: Known,
    before: Before,
    said: usize,
    printed: Vec<Printed>,
    /// Bytes of what the batch has printed.
    bytes: u64,
    /// What is kept each time, and the messages in it.
    events: Vec<(Order, Event)>,
    shared: FxHashSet<Arc<Message>>,
    /// Which places count as one, as far as that was asked.
    places: FxHashMap<Span, Span>,
}

impl Messages {
    /// Nothing said yet, by points in this order.
    pub(crate) fn new(blocks: Option<Blocks>, keeping: Keeping, room: Room) -> Messages {
        Messages { blocks, keeping, room, ..Messages::default() }
    }

    /// Takes what was said, and starts anew.
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

    /// Forgets what the batch has said.
    pub(crate) fn roll_back(&mut self) {
        if let Some(known) = self.before.known.take() {
            self.known = *known;
        }
        self.said = self.before.said;
        self.printed.truncate(self.before.printed);
        self.events.truncate(self.before.events);
        self.bytes = 0;
    }

    /// Bytes of what the batch has printed, and of messages that are kept each time.
    pub(crate) fn printed_bytes(&self) -> u64 {
        self.bytes
    }

    /// Forgets what was printed: there is too much of it.
    pub(crate) fn drop_printed(&mut self) {
        self.printed = Vec::new();
        self.events = Vec::new();
    }

    /// Whether each message is kept each time.
    pub(crate) fn keeps_each(&self) -> bool {
        self.keeping.each
    }

    fn position(&self, point: usize) -> usize {
        self.blocks.map_or(point, |blocks| blocks.position(point))
    }

    /// The place that stands for a place.
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
        for point in points {
            let here = (self.position(point), said);
            if self.keeping.each {
                self.note(here, &message);
            } else {
                self.add_one(here, point, &message);
            }
        }
    }

    /// Adds a message unless a point before has said it or there are too many of those before.
    fn add_one(&mut self, here: Order, point: usize, message: &Message) {
        if self.before.known.is_none() {
            self.before.known = Some(Box::new(self.known.clone()));
        }
        let (batch, room) = (self.batch, self.room);
        let known = &mut self.known;
        if let Some(points) = known.list.get_mut(message) {
            points.count(batch, point);
            if here.0 < points.first.0 {
                known.sorted.remove(&points.first);
                points.first = here;
                known.sorted.insert(here, message.clone());
            }
            return;
        }
        if known.end.is_some_and(|end| here > end) {
            return;
        }
        known.bytes += message.text.len();
        let mut points = Points { first: here, count: 0, batch, lanes: Vec::new() };
        points.count(batch, point);
        known.list.insert(message.clone(), points);
        known.sorted.insert(here, message.clone());
        while known.sorted.len() > room.messages || known.bytes > room.bytes && known.sorted.len() > 1 {
            let Some((order, message)) = known.sorted.pop_last() else { break };
            known.list.remove(&message);
            known.bytes -= message.text.len();
            known.end = Some(order);
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
        // As if each had a text of its own: which share one depends on the tiles.
        self.bytes += message.text.len() as u64 + BESIDE;
        self.events.push((here, Event::Said(message)));
    }

    /// Adds printed text. Yields the bytes that it takes.
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

    /// All of several threads in the order of their points: each message once, printed text, events.
    pub(crate) fn merge(
        all: impl IntoIterator<Item = Messages>,
        limits: &Running,
    ) -> (Vec<Said>, Vec<Printed>, Vec<Event>) {
        let (mut list, mut printed, mut events) = (Vec::new(), Vec::new(), Vec::new());
        for mut one in all {
            let Known { list: known, sorted, end, .. } = one.known;
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

/// Adds messages to a list that has each once, as long as there is room for them. `more` begins with what is said first.
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

    /// What is kept of messages that 40 points say, each its own and some that all say, of so many bytes; `batch` points
    /// say each before any says the next.
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
