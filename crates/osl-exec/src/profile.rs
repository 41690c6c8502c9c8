//! Where the time of a run goes: counts for each step, attributed to instructions and source lines.
//!
//! A machine without a profile only checks once per block whether there is one, and measures nothing.

use crate::program::Program;
use osl_ir::Span;
use std::time::Duration;

/// The counts of a machine, by the marks of its program.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    counts: Vec<Count>,
    /// Time of the steps inside the current one.
    inner: Duration,
    clock: fn() -> Duration,
    /// How long it takes to read the clock.
    reading: Duration,
}

/// So many readings show how long one takes.
const READINGS: usize = 16;

#[derive(Clone, Copy, Debug, Default)]
struct Count {
    runs: u64,
    lanes: u64,
    own: Duration,
}

/// The profile of one instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProfileEntry {
    /// Its operation, named as in `oslrun ir`.
    pub name: String,
    /// The source location that it comes from.
    pub span: Span,
    /// The instructions around it, the outermost first: operation and location of each.
    pub around: Vec<(String, Span)>,
    /// Number of executions on a batch.
    pub runs: u64,
    /// Number of lanes for which it ran, in all batches together. An execution for a shared value counts the
    /// cells.
    pub lanes: u64,
    /// Time spent in it, without nested instructions.
    pub own: Duration,
}

impl ProfileEntry {
    /// Adds the counts of another part of the run.
    pub(crate) fn add(&mut self, other: &ProfileEntry) {
        self.runs += other.runs;
        self.lanes += other.lanes;
        self.own += other.own;
    }
}

impl Profile {
    /// No times yet of a program; `clock` measures them.
    pub(crate) fn new(program: &Program, clock: fn() -> Duration) -> Profile {
        let times: Vec<Duration> = (0..READINGS).map(|_| clock()).collect();
        let pairs = times.iter().zip(times.iter().skip(1));
        let reading = pairs.map(|(a, b)| b.saturating_sub(*a)).min().unwrap_or_default();
        Profile { counts: vec![Count::default(); program.marks.len()], inner: Duration::ZERO, clock, reading }
    }

    /// A step begins: yields the time, and the time of the steps inside the one around it so far, which its
    /// end takes back.
    pub(crate) fn begin(&mut self) -> [Duration; 2] {
        let outer = std::mem::take(&mut self.inner);
        [(self.clock)(), outer]
    }

    /// Ends a step that ran for `lanes` lanes. `begun` is the result of its [`begin`](Self::begin).
    pub(crate) fn end(&mut self, mark: u32, lanes: u64, [start, outer]: [Duration; 2]) {
        let time = (self.clock)().saturating_sub(start);
        // A reading falls within the step, and another one within the step around it.
        let own = time.saturating_sub(self.reading + self.inner);
        self.inner = outer + time + self.reading;
        if let Some(count) = self.counts.get_mut(mark as usize) {
            count.runs += 1;
            count.lanes += lanes;
            count.own += own;
        }
    }

    /// Adds the counts of another machine.
    pub(crate) fn add(&mut self, other: &Profile) {
        for (to, from) in self.counts.iter_mut().zip(&other.counts) {
            to.runs += from.runs;
            to.lanes += from.lanes;
            to.own += from.own;
        }
    }

    /// The entries of all instructions, in the order of the program.
    pub(crate) fn entries(&self, program: &Program) -> Vec<ProfileEntry> {
        let all = program.marks.iter().zip(&self.counts);
        all.map(|(mark, count)| {
            let mut around = Vec::new();
            let mut next = mark.around;
            while let Some(mark) = next.and_then(|at| program.marks.get(at as usize)) {
                around.push((mark.name.clone(), mark.span));
                next = mark.around;
            }
            around.reverse();
            let Count { runs, lanes, own } = *count;
            ProfileEntry { name: mark.name.clone(), span: mark.span, around, runs, lanes, own }
        })
        .collect()
    }
}
