//! What a shader does at one point, line by line: values, branches, rounds of loops, calls, and what does not run.
//!
//! It reads a [`Trace`](crate::trace::Trace) and the notes in it. It must not know how values come about, nor the command line; [`text`] lays
//! an explanation out for people, and it serialises for tools.

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
    /// The outputs; of an array, each element.
    pub outputs: Vec<(String, Shown)>,
    /// Whether the way was too long to be followed to its end.
    pub cut: bool,
}

/// A line of the source.
#[derive(Clone, Debug, Serialize)]
pub struct Line {
    /// Its file.
    pub file: String,
    /// Its number, from 1.
    pub number: u32,
    /// Its text, without what is before and behind.
    pub text: String,
    /// What happens on it.
    pub state: State,
    /// What is known of it.
    pub facts: Vec<Fact>,
}

/// What happens on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// It runs.
    Runs,
    /// The point does not come by: a branch was not taken, or the shader or a loop was left before.
    Skipped,
    /// No output that was asked for needs it.
    NotNeeded,
}

/// What is known of a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "fact", rename_all = "snake_case")]
pub enum Fact {
    /// A variable got values, one after the other.
    Set {
        /// The variable; an element of an array with its index.
        name: String,
        /// The values.
        values: Vec<Shown>,
    },
    /// A condition was asked for.
    Branch {
        /// Its values.
        taken: Vec<bool>,
        /// In how many of them double precision says otherwise.
        flips: usize,
    },
    /// A loop went round.
    Rounds {
        /// How often its body ran.
        count: usize,
    },
    /// A function was called.
    Call {
        /// The form that was chosen.
        form: String,
        /// Why this one.
        why: String,
        /// The calls: arguments and result.
        calls: Vec<(Vec<Shown>, Option<Shown>)>,
    },
}
