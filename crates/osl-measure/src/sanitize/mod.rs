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
pub(crate) use rounding::{RUNS, alike, needed, numbers};
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

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 10] = [
        Kind::IntOverflow,
        Kind::IntConversion,
        Kind::ZeroDivision,
        Kind::Domain,
        Kind::Edges,
        Kind::Index,
        Kind::Nan,
        Kind::Infinity,
        Kind::Cancellation,
        Kind::Denormal,
    ];

    /// Its name for options and tools.
    pub fn name(self) -> &'static str {
        match self {
            Kind::IntOverflow => "int-overflow",
            Kind::IntConversion => "int-conversion",
            Kind::ZeroDivision => "zero-division",
            Kind::Domain => "domain",
            Kind::Edges => "edges",
            Kind::Index => "index",
            Kind::Nan => "nan",
            Kind::Infinity => "infinity",
            Kind::Cancellation => "cancellation",
            Kind::Denormal => "denormal",
        }
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
#[derive(Clone, Debug, Serialize)]
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
