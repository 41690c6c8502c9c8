//! What a shader does at one point, line by line: values, branches, loop iterations, calls, and lines that do
//! not run.
//!
//! It reads a [`Trace`](crate::trace::Trace) and the notes in it. [`text`] formats an explanation for people,
//! and it serialises for tools.

mod cost;
mod derivatives;
mod lines;
mod narrow;
mod needs;
mod reasons;
mod rounds;
mod sites;
pub mod text;
mod through;
mod value;

pub use cost::{Cost, LineCost, cost, lines as line_costs, ranking, table};
pub use derivatives::{Derivatives, derivatives};
pub use lines::explain;
pub use narrow::Selection;
pub use through::ValueOrigin;
pub use value::{Shown, digits};
pub(crate) use value::{json_of, written};

use crate::quote::{line_at, text_of};
use crate::trace;
use needs::Needs;
use osl_ir::Span;
use osl_ir::global::Global;
use osl_ir::ir::{Body, Inst, Kernel, Op};
use osl_ir::passes;
use osl_syntax::source::SourceMap;
use rustc_hash::FxHashMap;
use serde::Serialize;
use sites::{Passed, Sites};
use std::collections::BTreeSet;

/// A program that can be explained.
pub struct Subject {
    /// The body that [`trace::follow`] follows.
    pub body: Body,
    sites: Sites,
    needs: Needs,
    passed: Passed,
    /// What the passes make of single rounds of loops.
    rounds: FxHashMap<rounds::RoundKey, rounds::InRound>,
    outputs: Vec<String>,
    /// The number of values of the source; those of derivatives come after them.
    values: usize,
    /// The globals that the outputs need.
    globals: BTreeSet<Global>,
    /// Whether it prints, or reports errors of its own.
    acts: bool,
}

impl Subject {
    /// The program of a lowered body with notes; only the requested outputs remain.
    pub fn new(mut noted: Body, options: &passes::Options, sources: &SourceMap) -> Subject {
        passes::apply(&mut noted, passes::Pass::Slice, options);
        let sites = Sites::of(&noted);
        let passed = sites::passed(&noted, &sites, options, sources);
        let needs = Needs::of(&noted, &passed.known(&sites), &options.limits);
        let rounds = rounds::of(&noted, &sites, options);
        let mut outputs: Vec<String> = Vec::new();
        for output in &noted.outputs {
            if !outputs.iter().any(|known| **known == *output.name) {
                outputs.push(output.name.to_string());
            }
        }
        let insts = || noted.insts();
        let read = |inst: &Inst| match (&inst.op, inst.results.first()) {
            (Op::Global(global), Some(result)) if needs.value(*result) => Some(*global),
            _ => None,
        };
        let globals = insts().filter_map(read).collect();
        let acts = |inst: &Inst| match &inst.op {
            Op::Kernel(kernel, _) => kernel.has_effect() && !matches!(kernel, Kernel::Note { .. }),
            _ => false,
        };
        let acts = insts().any(acts);
        let values = noted.values.len();
        let body = trace::prepare(noted, &options.varying, &options.derivs, &options.limits);
        Subject { body, sites, needs, passed, rounds, outputs, values, globals, acts }
    }
}

/// What a shader does at one point.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The shader.
    pub shader: String,
    /// The globals that the outputs need, with their values.
    pub globals: Vec<(String, Shown)>,
    /// The calls of functions of the source, in order; the first one has the number 1.
    pub calls: Vec<Called>,
    /// The lines of the source that do something, in order, file by file.
    pub lines: Vec<Line>,
    /// The outputs; for an array, each element.
    pub outputs: Vec<(String, Shown)>,
    /// What a run reports at the point without naming a line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reports: Vec<Reported>,
    /// Whether the trace became too long and was cut off.
    pub cut: bool,
}

/// An error, a warning or a note that a run reports, in its words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Reported {
    /// `error`, `warning` or `note`.
    pub severity: &'static str,
    /// The text.
    pub message: String,
    /// What helps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub help: Option<String>,
}

impl Explanation {
    /// Adds what a run of the point reports, each text once at its line.
    pub fn report(&mut self, reports: Vec<(Option<Span>, Reported)>, sources: &SourceMap) {
        for (span, reported) in reports {
            let at = span.and_then(|span| line_at(span, sources));
            let text = at.and_then(|at| Some((at.1, text_of(at, sources)?)));
            let list = match text {
                Some((number, (file, text))) => &mut self.line(file, number, text).reports,
                None => &mut self.reports,
            };
            if !list.contains(&reported) {
                list.push(reported);
            }
        }
    }

    /// The line of a file, which is added if the explanation does not have it.
    fn line(&mut self, file: String, number: u32, text: String) -> &mut Line {
        let after = |line: &Line| line.file == file && line.number >= number;
        let end = || self.lines.iter().rposition(|line| line.file == file).map(|at| at + 1);
        let at = self.lines.iter().position(after).or_else(end).unwrap_or(self.lines.len());
        if self.lines.get(at).is_none_or(|line| line.file != file || line.number != number) {
            self.lines.insert(at, Line { file, number, text, ..Line::default() });
        }
        &mut self.lines[at]
    }
}

/// A call of a function of the source.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Called {
    /// The function, as it was declared.
    pub form: String,
    /// Number of the call from which it was called; 0 is the shader.
    pub caller: usize,
    /// The number of calls around it, with itself.
    pub depth: usize,
    /// The values of its inputs, except arrays.
    pub given: Vec<(String, Shown)>,
    /// Its result, with an empty name, and the values of its outputs, except arrays.
    pub results: Vec<(String, Shown)>,
}

/// A line of the source.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Line {
    /// Its file.
    pub file: String,
    /// Its number, from 1.
    pub number: u32,
    /// Its text, without leading and trailing spaces.
    pub text: String,
    /// Whether it runs.
    pub state: State,
    /// Why it does not run, or why some of its values are not needed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The numbers of the calls in which it runs; 0 is the shader.
    pub calls: BTreeSet<usize>,
    /// The facts about it.
    pub facts: Vec<Fact>,
    /// What a run reports at this line.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reports: Vec<Reported>,
}

/// Whether a line runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// It runs.
    #[default]
    Runs,
    /// The point does not reach it: a branch was not taken, or the shader or a loop was left earlier.
    Skipped,
    /// The point reaches it, but no requested output needs its values: a run leaves it out.
    NotNeeded,
}

/// A fact about a line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fact {
    /// The number of the call of the function around the line; 0 is the shader.
    pub call: usize,
    /// The fact.
    #[serde(flatten)]
    pub what: What,
}

/// What happens on a line, in one call.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "fact", rename_all = "snake_case")]
pub enum What {
    /// A variable was assigned, possibly several times.
    Set {
        /// The variable; for an array element, with its index; `return` for the result of the function.
        name: String,
        /// The values, in order.
        values: Vec<Shown>,
        /// What the compiler made of all values; `Kept` if it differs.
        compiled: Compiled,
        /// What the compiler made of each value, if it differs.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        each: Vec<Compiled>,
        /// How each value changes, if that is requested.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        derivatives: Vec<Derivatives>,
    },
    /// A condition was evaluated.
    Branch {
        /// What it decides.
        test: Test,
        /// Its text in the source.
        condition: String,
        /// Its values.
        taken: Vec<bool>,
        /// How many of them have another result in double precision.
        flips: usize,
        /// Whether it is known when the shader is compiled.
        known: bool,
    },
    /// An operand of `&&` or `||` was not evaluated.
    Unevaluated {
        /// Its text in the source.
        condition: String,
    },
    /// A loop ran.
    Rounds {
        /// How often its body ran, each time that the loop was reached.
        counts: Vec<usize>,
    },
    /// A built-in function was called.
    Call {
        /// The chosen overload.
        form: String,
        /// Why it was chosen.
        why: String,
        /// How a matrix was applied: to a point, a vector or a normal; each once.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        how: Vec<Applied>,
        /// The calls: arguments and results.
        calls: Vec<(Vec<Shown>, Option<Shown>)>,
    },
    /// A function of the source was called.
    Enter {
        /// The chosen overload.
        form: String,
        /// Why it was chosen.
        why: String,
        /// The numbers of the calls.
        calls: Vec<usize>,
    },
}

/// How a matrix was applied to a triple.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Applied {
    /// What the triple is.
    pub to: Triple,
    /// The matrix, row by row, for row vectors.
    pub matrix: Shown,
}

/// What a triple is for a transformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Triple {
    /// A location: the translation counts.
    Point,
    /// A direction: the translation does not count.
    Vector,
    /// A direction that stays perpendicular to its surface: by the transposed inverse of the matrix.
    Normal,
}

/// What a condition decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Test {
    /// Which side of an `if` runs.
    If,
    /// Which side of `?:` is taken.
    Choice,
    /// An operand of `&&` or `||`.
    Operand,
}

impl From<osl_ir::ir::Test> for Test {
    fn from(test: osl_ir::ir::Test) -> Test {
        match test {
            osl_ir::ir::Test::If => Test::If,
            osl_ir::ir::Test::Choice => Test::Choice,
            osl_ir::ir::Test::Operand => Test::Operand,
        }
    }
}

/// What the compiler makes of an assignment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Compiled {
    /// A run has the value where the assignment stands, or in the variable that it copies.
    Kept,
    /// No requested output needs it.
    NotNeeded,
    /// The value is known when the shader is compiled.
    Constant,
    /// The line with this number computes the same, and its result is used.
    SameAsLine(u32),
}
