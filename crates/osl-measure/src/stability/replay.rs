//! Re-execution of a traced point in which only chosen instructions round, and all others compute in double
//! precision.
//!
//! An estimate along the flow of the error cannot tell what a rounding does: one that both operands of a
//! difference share cancels there.

use super::rerun::{again, computes, differences, is_same};
use super::rerun::{broken, rounded_number};
use crate::trace::{Exact, NodeId, Trace, What};

/// The trace of a point, with the values that an experiment changes.
pub(super) struct Replay<'a> {
    trace: &'a Trace,
    /// The values that differ from those in double precision.
    values: Vec<Option<Exact>>,
    changed: Vec<NodeId>,
}

/// Nodes that are passed by in the time of one that runs again.
const PASSED: u64 = 16;

impl<'a> Replay<'a> {
    pub(super) fn new(trace: &'a Trace) -> Replay<'a> {
        Replay { trace, values: vec![None; trace.nodes.len()], changed: Vec::new() }
    }

    /// The largest error of an output as a share of its range, if only these nodes round. They are in the
    /// order of the trace. `budget` counts nodes; `None` if it is used up.
    pub(super) fn error(&mut self, rounding: &[NodeId], ranges: &[f64], budget: &mut u64) -> Option<f64> {
        for id in std::mem::take(&mut self.changed) {
            self.values[id as usize] = None;
        }
        let trace = self.trace;
        let first = rounding.first().map_or(trace.nodes.len(), |id| *id as usize);
        let mut next = rounding.iter().copied().peekable();
        *budget = budget.checked_sub((trace.nodes.len() - first) as u64 / PASSED)?;
        for id in first..trace.nodes.len() {
            let node = &trace.nodes[id];
            let id = id as NodeId;
            let rounds = next.next_if_eq(&id).is_some();
            let is_changed = node.args.iter().any(|arg| self.values[*arg as usize].is_some());
            if !rounds && !is_changed {
                continue;
            }
            *budget = budget.checked_sub(1)?;
            let Some(old) = self.old(id) else { continue };
            let mut value = if is_changed { self.value(id, &old) } else { old.clone() };
            if rounds {
                value = rounded(trace, id, value);
            }
            if !is_same(&value, &old) {
                self.values[id as usize] = Some(value);
                self.changed.push(id);
            }
        }
        Some(self.output_error(ranges))
    }

    fn output_error(&self, ranges: &[f64]) -> f64 {
        let mut largest = 0.0_f64;
        for ((_, _, nodes), range) in self.trace.outputs.iter().zip(ranges) {
            for id in nodes {
                let (Some(new), Some(old)) = (&self.values[*id as usize], self.old(*id)) else { continue };
                for error in differences(&new.numbers(), &old.numbers()) {
                    largest =
                        largest.max(if error.is_finite() { (error / range).abs().min(1.0) } else { 1.0 });
                }
            }
        }
        largest
    }

    /// The value before the experiment: in double precision, or where only the strict arithmetic came by, the
    /// strict one.
    fn old(&self, id: NodeId) -> Option<Exact> {
        let node = self.trace.node(id);
        node.exact.clone().or_else(|| node.strict.as_ref().map(Exact::widen))
    }

    fn now(&self, id: NodeId) -> Exact {
        let new = self.values.get(id as usize).and_then(Option::as_ref);
        new.cloned().or_else(|| self.old(id)).unwrap_or(Exact::Float(0.0))
    }

    /// The value of a node with changed operands.
    fn value(&self, id: NodeId, old: &Exact) -> Exact {
        let node = self.trace.node(id);
        match (&node.what, &node.args[..]) {
            (What::Lane(_) | What::Kernel(..), args) => {
                let args: Vec<Exact> = args.iter().map(|arg| self.now(*arg)).collect();
                again(&node.what, &args).unwrap_or_else(|| self.nearer(id, &args, old))
            }
            // A condition or an index that is another one than in double precision is the strict one.
            (What::Meet, [chooser, strict, exact]) => {
                let is_other = self.old(*chooser).is_none_or(|old| !is_same(&old, &self.now(*chooser)));
                self.now(if is_other { *strict } else { *exact })
            }
            (What::Element | What::Meet, [.., last]) => self.now(*last),
            _ => old.clone(),
        }
    }

    /// The result of a call that cannot run again: the strict one, if the operands are nearer to the strict
    /// ones than to those in double precision.
    fn nearer(&self, id: NodeId, args: &[Exact], old: &Exact) -> Exact {
        let node = self.trace.node(id);
        let Some(result) = &node.strict else { return old.clone() };
        let (mut whole, mut along) = (0.0, 0.0);
        for (now, arg) in args.iter().zip(&node.args) {
            let node = self.trace.node(*arg);
            let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { continue };
            let exact = exact.numbers();
            let to_strict = differences(&Exact::widen(strict).numbers(), &exact);
            let to_now = differences(&now.numbers(), &exact);
            for (to_strict, to_now) in to_strict.iter().zip(to_now).filter(|(s, _)| s.is_finite()) {
                whole += to_strict * to_strict;
                along += to_strict * to_now;
            }
        }
        if along >= 0.5 * whole && along > 0.0 { Exact::widen(result) } else { old.clone() }
    }
}

/// Whether a node rounds its result.
pub(super) fn can_round(trace: &Trace, id: NodeId) -> bool {
    let node = trace.node(id);
    let is_float = matches!(node.exact, Some(Exact::Float(_) | Exact::Triple(_) | Exact::Matrix(_)));
    is_float && node.strict.is_some() && computes(&node.what)
}

/// A value with the rounding error that the node made in strict arithmetic. If that was made on another
/// value, or is not known, the value is rounded to the nearest.
fn rounded(trace: &Trace, id: NodeId, value: Exact) -> Exact {
    let node = trace.node(id);
    let Some(strict) = node.strict.as_ref().filter(|_| can_round(trace, id)) else { return value };
    let strict = Exact::widen(strict);
    if broken(trace, id).is_some() {
        return strict;
    }
    let given: Option<Vec<Exact>> =
        node.args.iter().map(|arg| trace.node(*arg).strict.as_ref().map(Exact::widen)).collect();
    let Some(wide) = given.and_then(|given| again(&node.what, &given)) else { return value };
    let one = |((value, strict), wide): ((f64, f64), f64)| {
        let own = strict - wide;
        // The error of another value says nothing about this one.
        let is_alike = own.is_finite() && (value - wide).abs() <= 0.5 * wide.abs();
        if is_alike { value + own } else { rounded_number(value) }
    };
    let numbers = value.numbers().into_iter().zip(strict.numbers()).zip(wide.numbers());
    Exact::of_numbers(value.kind(), &numbers.map(one).collect::<Vec<_>>())
}
