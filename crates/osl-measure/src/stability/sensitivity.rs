//! Sensitivity of the outputs of a point to roundings, by experiment: to each rounding by itself, to those of
//! a line together, and to those together that one instruction magnifies.

use super::pairs::Pairs;
use super::replay::Replay;
use super::statistics::InstSite;
use crate::trace::{NodeId, Trace};
use osl_ir::Span;
use std::collections::BTreeMap;

/// Instructions of a point whose rounding is measured; those with the largest estimates come first.
const MEASURED: usize = 64;

/// Roundings that make less than this share of a point's error are not charged with any of it.
const LEAST_SHARE: f64 = 0.01;

/// Errors from roundings, as shares of an output's range.
#[derive(Clone, Debug, Default)]
pub(super) struct Roundings {
    /// By the instruction that rounds.
    pub(super) errors: BTreeMap<InstSite, f64>,
    /// By the instruction that magnifies, and the one whose rounding it magnifies.
    pub(super) pairs: Pairs,
    /// By the instruction in a loop that adds up an error, and the one that makes it.
    pub(super) repeats: Pairs,
    /// By the instruction that magnifies: the error of all the roundings together that it magnifies.
    pub(super) together: BTreeMap<InstSite, f64>,
    /// By line: the error of all its roundings together.
    pub(super) lines: BTreeMap<LineKey, f64>,
}

pub(super) use crate::quote::At as LineKey;

/// The line of an instruction.
pub(super) type LineOf<'a> = dyn Fn(Span) -> Option<LineKey> + 'a;

impl Roundings {
    pub(super) fn merge(&mut self, other: Roundings) {
        for (place, error) in other.errors {
            *self.errors.entry(place).or_default() += error;
        }
        self.pairs.merge(other.pairs);
        self.repeats.merge(other.repeats);
        for (place, error) in other.together {
            *self.together.entry(place).or_default() += error;
        }
        for (line, error) in other.lines {
            *self.lines.entry(line).or_default() += error;
        }
    }
}

/// An instruction that rounds, with all its runs at a point.
#[derive(Default)]
pub(super) struct Rounds {
    /// Its nodes, the last one first.
    pub(super) nodes: Vec<NodeId>,
    pub(super) estimate: f64,
    /// The parts of the estimate, by the instruction that magnifies them.
    pub(super) by: BTreeMap<Option<InstSite>, f64>,
}

/// The part of an estimate that a run counts for at least, so that the runs of an instruction with a wrong
/// estimate count all the same.
pub(super) const LEAST: f64 = 1e-30;

impl Roundings {
    pub(super) fn put(&mut self, place: &InstSite, rounds: &Rounds, error: f64) {
        if error == 0.0 {
            return;
        }
        *self.errors.entry(place.clone()).or_default() += error;
        let all: f64 = rounds.by.values().sum();
        for (by, part) in &rounds.by {
            if let Some(by) = by {
                self.pairs.add(by.clone(), place.clone(), error * part / all);
            }
        }
    }

    /// Measures the roundings of a line together, and those that one instruction magnifies: single ones may
    /// add up or cancel. If the budget is used up, they count as a sum, up to the largest error of the point.
    pub(super) fn join(
        &mut self,
        (trace, ranges): (&Trace, &[f64]),
        (rounds, line): (&BTreeMap<InstSite, Rounds>, &LineOf<'_>),
        largest: f64,
        budget: &mut u64,
    ) {
        let mut replay = Replay::new(trace);
        let mut joint = |members: &BTreeMap<&InstSite, f64>| {
            let sum = members.values().sum::<f64>().min(largest);
            let most = members.values().copied().fold(0.0, f64::max);
            if members.len() < 2 {
                return most;
            }
            let of = |place: &&InstSite| rounds.get(*place).map_or(&[][..], |rounds| &rounds.nodes[..]);
            let mut nodes: Vec<NodeId> = members.keys().flat_map(of).copied().collect();
            nodes.sort_unstable();
            match replay.error(&nodes, ranges, budget) {
                Some(error) => error.min(sum).max(most),
                None => sum,
            }
        };
        let mut lines: BTreeMap<LineKey, BTreeMap<&InstSite, f64>> = BTreeMap::new();
        for (place, error) in &self.errors {
            if let Some(line) = line(place.span) {
                lines.entry(line).or_default().insert(place, *error);
            }
        }
        for (line, members) in &lines {
            self.lines.insert(*line, joint(members));
        }
        for (by, members) in self.pairs.by_magnifier() {
            self.together.insert(by.clone(), joint(&members));
        }
    }
}

/// What the roundings of a point do to its outputs, by experiment. `None` if the budget is used up.
pub(super) fn measured(
    trace: &Trace,
    ranges: &[f64],
    rounds: &BTreeMap<InstSite, Rounds>,
    largest: f64,
    budget: &mut u64,
) -> Option<Roundings> {
    let mut order: Vec<(&InstSite, &Rounds)> = rounds.iter().collect();
    order.sort_by(|a, b| b.1.estimate.total_cmp(&a.1.estimate).then(a.0.cmp(b.0)));
    let mut replay = Replay::new(trace);
    let mut measured = Roundings::default();
    for (place, rounds) in order.into_iter().take(MEASURED) {
        let nodes: Vec<NodeId> = rounds.nodes.iter().rev().copied().collect();
        let error = replay.error(&nodes, ranges, budget)?;
        if error >= LEAST_SHARE * largest {
            measured.put(place, rounds, error);
        }
    }
    Some(measured)
}
