//! Numeric events: operations whose result is not what the formula says, such as a division by zero or an int
//! that wraps, counted by source line over the points of a grid.
//!
//! Each point is followed as by `explain`, and `detect` looks at each executed instruction; so nothing of a
//! run changes, and code that a point does not execute has no events. `watch` counts over points, `words`
//! describes an event, `rounding` follows points with random rounding, [`text`](text::text) formats a
//! [`Report`].

mod detect;
mod rounding;
pub mod text;
mod watch;
mod words;

pub use detect::{DIGITS_LOST, LOST_AT};
pub use rounding::{Apart, Digits, Rounding, rounding};
pub(crate) use rounding::{RUNS, alike, needed, numbers, output};
pub use watch::{Examined, Points, Subject, sanitize};
pub(crate) use watch::{events_at, is_written};

use crate::quote::Quote;
use serde::{Serialize, Serializer};
use serde_json::Value;

/// What happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// The result of an operation on ints did not fit, and wrapped.
    IntOverflow,
    /// A float that no int can hold became an int.
    IntConversion,
    /// The divisor of a division or remainder was 0.
    ZeroDivision,
    /// An argument was outside of the function's domain.
    Domain,
    /// The edges of a step or clamp were equal or in reversed order.
    Edges,
    /// The index of an element or component was out of range.
    Index,
    /// The result was NaN, and no operand was.
    Nan,
    /// All operands were finite, and the result was too large for a float.
    Infinity,
    /// A sum or difference lost more than [`DIGITS_LOST`] digits beyond those that its operands had lost, at
    /// [`LOST_AT`] of the points or more.
    Cancellation,
    /// The result was so close to 0 that it had fewer digits than other floats, and no operand was.
    Denormal,
}

/// The kinds in their order: name, title, and what an instruction does.
const KINDS: [(Kind, &str, &str, &str); 10] = [
    (Kind::IntOverflow, "int-overflow", "an int overflows", "overflows an int"),
    (
        Kind::IntConversion,
        "int-conversion",
        "a float does not fit an int",
        "makes an int of a float that does not fit",
    ),
    (Kind::ZeroDivision, "zero-division", "division by zero", "divides by zero"),
    (Kind::Domain, "domain", "argument outside of the domain", "is given what it is not defined for"),
    (Kind::Edges, "edges", "edges out of order", "has edges out of order"),
    (Kind::Index, "index", "index out of range", "is an index out of range"),
    (Kind::Nan, "nan", "a NaN appears", "makes a NaN"),
    (Kind::Infinity, "infinity", "a result is too large", "makes a number that is too large for a float"),
    (Kind::Cancellation, "cancellation", "digits cancel out", "loses digits"),
    (
        Kind::Denormal,
        "denormal",
        "a result is almost 0 (denormal)",
        "makes a number that is too small for all of its digits",
    ),
];

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 10] = {
        let (mut all, mut at) = ([Kind::Nan; 10], 0);
        while at < all.len() {
            all[at] = KINDS[at].0;
            assert!(all[at] as usize == at);
            at += 1;
        }
        all
    };

    /// Its name for options and tools.
    pub fn name(self) -> &'static str {
        KINDS[self as usize].1
    }

    /// What happened, as the title of a report.
    pub fn title(self) -> &'static str {
        KINDS[self as usize].2
    }

    /// What an instruction does, as the verb of a sentence.
    pub(crate) fn verb(self) -> &'static str {
        KINDS[self as usize].3
    }

    /// The kind with a name.
    pub fn from_name(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Its bit in [`Examined::happened`].
    pub fn bit(self) -> u16 {
        1 << self as u16
    }
}

impl Serialize for Kind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The events of one kind at one place of the source.
#[derive(Clone, Debug, Serialize)]
pub struct Event {
    /// What happened.
    pub kind: Kind,
    /// Where.
    #[serde(flatten)]
    pub quote: Quote,
    /// The number of points at which it happened.
    pub points: usize,
    /// The share of the examined points.
    pub share: f64,
    /// How often it happened, at all points together.
    pub times: u64,
    /// The first pixel: column and row.
    pub first: [usize; 2],
    /// The operands there, at the first time.
    pub operands: Vec<Value>,
    /// The result there; none for an index.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub result: Option<Value>,
    /// The result there in double precision, for a cancellation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<f64>,
    /// The example in words.
    pub example: String,
}

/// The numeric events of a shader.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// The shader.
    pub shader: String,
    /// The size of the grid of points.
    pub grid: [usize; 2],
    /// The number of points that were examined.
    pub points: usize,
    /// How many of these were too long to be examined to their end.
    pub cut: usize,
    /// The number of points that were not examined, because the time was over.
    pub not_examined: usize,
    /// A cancellation loses more digits than this.
    pub digits_lost: f64,
    /// A cancellation happens at least at this share of the points that compute the difference.
    pub lost_at: f64,
    /// The events, in the order of the source.
    pub events: Vec<Event>,
    /// The digits that random rounding leaves, if they were examined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounding: Option<Rounding>,
}
