//! What a shader does at one point, line by line: values, branches, loop iterations, calls, and lines that do
//! not run.
//!
//! It reads a [`Trace`](crate::trace::Trace) and the notes in it. It must not know how values are computed,
//! nor the command line. [`text`] formats an explanation for people, and it serialises for tools.

mod cost;
mod lines;
pub mod text;
mod value;

pub use cost::{Cost, cost, only_needed, table};
pub use lines::explain;
pub(crate) use value::short;
pub use value::{Shown, digits};

use serde::Serialize;

/// What a shader does at one point.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The shader.
    pub shader: String,
    /// The globals that the shader reads, with their values.
    pub globals: Vec<(String, Shown)>,
    /// The lines of the source that do something, in order, file by file.
    pub lines: Vec<Line>,
    /// The outputs; for an array, each element.
    pub outputs: Vec<(String, Shown)>,
    /// Whether the trace became too long and was cut off.
    pub cut: bool,
}

/// A line of the source.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Its file.
    pub file: String,
    /// Its number, from 1.
    pub number: u32,
    /// Its text, without leading and trailing spaces.
    pub text: String,
    /// Whether it runs.
    pub state: State,
    /// The facts about it.
    pub facts: Vec<Fact>,
}

/// Whether a line runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// It runs.
    Runs,
    /// The point does not reach it: a branch was not taken, or the shader or a loop was left earlier.
    Skipped,
    /// No requested output needs it.
    NotNeeded,
}

/// A fact about a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "fact", rename_all = "snake_case")]
pub enum Fact {
    /// A variable was assigned, possibly several times.
    Set {
        /// The variable; for an array element, with its index.
        name: String,
        /// The values, in order.
        values: Vec<Shown>,
    },
    /// A condition was evaluated.
    Branch {
        /// Its values.
        taken: Vec<bool>,
        /// How many of them have another result in double precision.
        flips: usize,
    },
    /// A loop iterated.
    Rounds {
        /// How often its body ran.
        count: usize,
    },
    /// A function was called.
    Call {
        /// The chosen overload.
        form: String,
        /// Why it was chosen.
        why: String,
        /// The calls: arguments and results.
        calls: Vec<(Vec<Shown>, Option<Shown>)>,
    },
}
