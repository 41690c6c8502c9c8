//! Proven bounds: what holds for a shader at every point of a domain, not only at the points of a picture.
//!
//! The values of a whole tile of points are enclosed at once by interval arithmetic (`walk`, on
//! [`osl_numeric::interval`]; `state` has what a walk knows, and `assume` and `cases` narrow it). The
//! enclosures are too wide where values depend on each other, and become tighter on smaller tiles. So
//! `search` splits the domain where it helps. It also computes single points, which shows how much of a bound
//! is reached, and which statements are wrong. `sites` are the operations for which something is proved.
//! [`text`](text::text) formats a [`Report`].
//!
//! All statements are about the strict arithmetic, with its rounding.

mod assume;
mod calls;
mod defs;
mod domain;
mod numbers;
mod paths;
mod search;
mod sites;
mod state;
pub mod text;
mod textures;
mod walk;

pub use domain::{Domain, Open, Range};
pub use search::{Effort, prove};
pub use sites::What;

use crate::quote::Quote;
use crate::sanitize::{Kind, Subject};
use crate::words;
use osl_ir::ir::Body;
use osl_ir::passes::{self, Pass};
use serde::{Serialize, Serializer};

/// The program of a lowered body without notes. Equal values are computed once, so that a condition about a
/// value narrows every use of it.
pub fn subject(mut body: Body, options: &passes::Options) -> Subject {
    let mut options = options.clone();
    let left_out = if options.outputs.is_none() { words::left_out(&body) } else { Vec::new() };
    passes::closures_as_numbers(&mut body, options.outputs.as_mut());
    let options = &options;
    for pass in [Pass::Ssa, Pass::Slice, Pass::Cse, Pass::Dce] {
        passes::apply(&mut body, pass, options);
    }
    Subject { left_out, ..Subject::new(body, options) }
}

/// What is known of a statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// It holds at every point.
    Proven,
    /// It is wrong at a point that was computed.
    Wrong,
    /// It was not proved, and no point was found where it is wrong.
    NotProven,
}

/// The values of one component of an output.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// The output, with the element of an array: `result`, `list[2]`.
    pub name: String,
    /// `x`, `y` and `z`, or `r`, `g` and `b`, of a triple; the row and column of a matrix; else empty.
    pub component: String,
    /// No value is smaller.
    #[serde(serialize_with = "number")]
    pub lowest: f64,
    /// No value is larger.
    #[serde(serialize_with = "number")]
    pub highest: f64,
    /// The smallest and the largest value of the points that were computed; `None` if no value is known.
    pub reached: Option<[f64; 2]>,
    /// Whether no value is NaN.
    pub never_nan: Verdict,
    /// Whether no value is infinite.
    pub is_finite: bool,
    /// Whether it is an int.
    pub is_int: bool,
}

/// A statement about an operation of the source.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The event that does not happen if it holds.
    pub kind: Kind,
    /// What is to be proved.
    #[serde(skip)]
    pub what: What,
    /// Where.
    #[serde(flatten)]
    pub quote: Quote,
    /// Whether it holds.
    pub verdict: Verdict,
    /// The values of the argument are between these two, where one number says it: `None` for vectors, edges
    /// and results of ints.
    pub values: Option<[f64; 2]>,
    /// A point where it is wrong: a value for each range of the domain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<Vec<f32>>,
}

/// What was proved about a shader.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The shader.
    pub shader: String,
    /// What is not examined, in words: strings, for instance.
    pub left_out: Vec<String>,
    /// The domain: u, v and the open parameters.
    pub domain: Vec<Range>,
    /// The number of tiles that were walked.
    pub tiles: usize,
    /// The number of points that were computed.
    pub points: usize,
    /// Whether the time or the number of tiles ended the search, so that more could be proved.
    pub is_cut: bool,
    /// The components of the outputs.
    pub outputs: Vec<Output>,
    /// The statements, in the order of the source.
    pub claims: Vec<Claim>,
}

impl Report {
    /// The kinds of events of which it is not proven that they never happen, also in the outputs.
    pub fn open_kinds(&self) -> Vec<Kind> {
        let claims =
            self.claims.iter().filter(|claim| claim.verdict != Verdict::Proven).map(|claim| claim.kind);
        let has = |kind, open: fn(&Output) -> bool| self.outputs.iter().any(open).then_some(kind);
        let nan = has(Kind::Nan, |output| output.never_nan != Verdict::Proven);
        let infinity = has(Kind::Infinity, |output| !output.is_finite);
        claims.chain(nan).chain(infinity).collect()
    }
}

/// A number, or a word for what JSON has no number for.
fn number<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match x {
        _ if x.is_finite() => serializer.serialize_f64(*x),
        _ if *x > 0.0 => serializer.serialize_str("inf"),
        _ => serializer.serialize_str("-inf"),
    }
}
