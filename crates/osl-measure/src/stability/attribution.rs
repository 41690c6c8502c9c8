//! Error attribution: propagates the error of an output backward through the executed instructions to those
//! that made it.
//!
//! Each executed instruction is asked two questions. *How much of the output's error passes through it?*
//! Strict arguments replace the exact ones, one after the other. This splits the error of a result into the
//! part that each argument brought along and the part that the instruction itself rounded away; the parts are
//! followed back to their origins. *Does the instruction amplify the error?* It is given exact arguments that
//! are rounded once. If its error exceeds the rounding of its own result, no care taken earlier could have
//! avoided it (the local error of P. Panchekha et al., *Automatically Improving Accuracy for Floating Point
//! Expressions*, 2015). An instruction scores by the share of the error that passes through it where it
//! amplifies, and with less weight by its own rounding, which adds up in long loops. An instruction whose
//! result leaves the range of floats counts like one that amplifies.
//!
//! The parts tell where an error may come from, not how much of it: where the operands of a difference share
//! a rounding, most of it cancels. So `sensitivity` measures what the rounding of each instruction does to
//! the outputs.

use super::loop_growth::Users;
use super::pairs::{Pairs, Paths};
use super::replay::can_round;
use super::rerun::reduces;
use super::rerun::{again, difference, differences, relative_error};
use super::rerun::{broken, rounded_once};
use super::sensitivity::{LEAST, LineOf, Roundings, Rounds, measured};
use super::statistics::{Blame, InstSite};
use crate::trace::{Exact, NodeId, Trace, What};
use osl_ir::Span;
use osl_ir::ir::{Const, Continuity};
use std::collections::BTreeMap;

/// An argument counts as nearly right up to this relative error.
const CLOSE: f64 = 1e-4;

/// A loop is suspected of adding up an error that is at least this share of all errors.
const REPEATED: f64 = 0.1;

/// An instruction that magnifies this many times less than a later one is not the one to look at first.
const MUCH: f64 = 8.0;

/// What the instructions of a trace did.
#[derive(Clone, Debug, Default)]
pub(super) struct Blames {
    /// The blame of every instruction that has any, apart from its rounding.
    pub(super) places: BTreeMap<InstSite, Blame>,
    /// What roundings do to the outputs, estimated along the flow of the error.
    pub(super) estimated: Roundings,
    /// Instructions that magnify much more what others magnify first, by error.
    pub(super) chains: Pairs,
    /// The same as the estimate from experiments, if they are within the budget.
    pub(super) measured: Option<Roundings>,
}

/// The blame of a trace. `ranges` are those of the outputs, in the order of the trace; `budget` is the number
/// of nodes that experiments may run again.
pub(super) fn blame(trace: &Trace, ranges: &[f64], line: &LineOf<'_>, budget: &mut u64) -> Blames {
    let mut flows: Vec<Vec<f64>> = vec![Vec::new(); trace.nodes.len()];
    let (mut all, mut largest) = (0.0, 0.0_f64);
    let shares = output_errors(trace, ranges);
    for share in shares.iter().flat_map(|(_, list)| list) {
        all += share;
        largest = largest.max(*share);
    }
    let mut found = Blames::default();
    if all == 0.0 {
        found.measured = Some(Roundings::default());
        return found;
    }
    // All outputs together count as much as the one with the largest error.
    for (id, list) in shares {
        add(&mut flows[id as usize], list.into_iter().map(|share| share * largest / all));
    }
    let mut paths = Paths::new(trace.nodes.len());
    let mut rounds: BTreeMap<InstSite, Rounds> = BTreeMap::new();
    let place = |id: NodeId| InstSite { span: trace.node(id).span, what: name(&trace.node(id).what) };
    let sum = |flow: &Vec<f64>| flow.iter().sum::<f64>();
    for id in (0..trace.nodes.len()).rev() {
        let flow = std::mem::take(&mut flows[id]);
        let args = &trace.nodes[id].args;
        let before: Vec<f64> = args.iter().map(|arg| sum(&flows[*arg as usize])).collect();
        let (mut blame, rounded) = one(trace, id as NodeId, &flow, &mut flows);
        // The rounds of a loop magnify one after the other.
        if let Some((_, factor)) = paths.after(id).filter(|(by, _)| is_alike(trace, id as NodeId, *by))
            && blame.amplified > 0.0
            && blame.factor > 1.0
            && factor.is_finite()
        {
            blame.factor *= factor;
        }
        let here = (blame != Blame::default()).then(|| place(id as NodeId));
        if let Some(here) = here.filter(|_| blame.broken.is_none() && can_round(trace, id as NodeId)) {
            let by = paths.magnifier(id).map(|(by, _)| place(by)).filter(|by| *by != here);
            let rounds = rounds.entry(here).or_default();
            rounds.nodes.push(id as NodeId);
            rounds.estimate += rounded;
            *rounds.by.entry(by).or_default() += rounded.max(LEAST);
        }
        if let Some((by, factor)) = paths.magnifier(id).filter(|_| blame.amplified > 0.0)
            && factor.is_finite()
            && factor > MUCH * blame.factor
            && !reduces(trace, by)
            && !is_alike(trace, by, id as NodeId)
        {
            found.chains.add(place(by), place(id as NodeId), blame.amplified);
        }
        // What leaves the range without harm does not count.
        blame.broken = blame.broken.filter(|_| blame.left > 0.0);
        if blame != Blame::default() {
            found.places.entry(place(id as NodeId)).or_default().add(&blame);
        }
        let after = args.iter().map(|arg| sum(&flows[*arg as usize]));
        let parts: Vec<f64> = after.zip(before).map(|(after, before)| after - before).collect();
        paths.pass_on(id, &blame, args, &parts);
    }
    found.measured = measured(trace, ranges, &rounds, largest, budget);
    for (place, rounds) in &rounds {
        found.estimated.put(place, rounds, rounds.estimate);
    }
    // Estimates need no experiments.
    let mut without = 0;
    let of = (&rounds, line);
    found.estimated.join((trace, ranges), of, largest, &mut without);
    found.estimated.repeats = repeated(trace, of, &found.estimated);
    if let Some(measured) = &mut found.measured {
        measured.join((trace, ranges), of, largest, budget);
        measured.repeats = repeated(trace, of, measured);
    }
    found
}

/// The errors of the outputs, component by component, as shares of their ranges.
fn output_errors(trace: &Trace, ranges: &[f64]) -> Vec<(NodeId, Vec<f64>)> {
    let nodes = trace.outputs.iter().zip(ranges);
    let nodes = nodes.flat_map(|((_, _, nodes), range)| nodes.iter().map(move |id| (*id, *range)));
    let of = |(id, range): (NodeId, f64)| {
        let share = |e: f64| if e.is_finite() { (e / range).abs().min(1.0) } else { 1.0 };
        (id, errors(trace, id).into_iter().map(share).collect())
    };
    nodes.map(of).collect()
}

/// The instructions of loops that add up the error of a value that they use in each round, with the one that
/// makes that error, if it is a notable part of all.
fn repeated(
    trace: &Trace,
    (rounds, line): (&BTreeMap<InstSite, Rounds>, &LineOf<'_>),
    roundings: &Roundings,
) -> Pairs {
    let mut found = Pairs::default();
    let all: f64 = roundings.errors.values().sum();
    let single = |place: &InstSite| {
        rounds.get(place).and_then(|own| own.nodes.first().filter(|_| own.nodes.len() == 1))
    };
    let list = roundings.errors.iter().filter(|(_, error)| **error >= REPEATED * all);
    let list: Vec<_> = list.filter_map(|(place, error)| Some((place, *error, *single(place)?))).collect();
    if list.is_empty() {
        return found;
    }
    let users = Users::new(trace);
    for (place, error, id) in list {
        if let Some(by) = users.repeated(id, line) {
            let by = InstSite { span: trace.node(by).span, what: name(&trace.node(by).what) };
            found.add(by, place.clone(), error);
        }
    }
    found
}

/// Whether two nodes are runs of the same instruction.
fn is_alike(trace: &Trace, a: NodeId, b: NodeId) -> bool {
    let (a, b) = (trace.node(a), trace.node(b));
    a.span == b.span && a.span != Span::default() && a.what == b.what
}

fn add(to: &mut Vec<f64>, more: impl Iterator<Item = f64>) {
    for (index, x) in more.enumerate() {
        if to.len() <= index {
            to.push(0.0);
        }
        to[index] += x;
    }
}

/// Strict minus exact, component by component; infinite if only one of them is a number.
fn errors(trace: &Trace, id: NodeId) -> Vec<f64> {
    let node = trace.node(id);
    let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return Vec::new() };
    differences(&Exact::widen(strict).numbers(), &exact.numbers())
}

/// The blame of a node through which the error `flow` passes, component by component, and the part that its
/// rounding seems to have made. Passes the arguments' parts on.
fn one(trace: &Trace, id: NodeId, flow: &[f64], flows: &mut [Vec<f64>]) -> (Blame, f64) {
    let node = trace.node(id);
    let mut blame = Blame::default();
    let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return (blame, 0.0) };
    let total: f64 = flow.iter().sum();
    match &node.what {
        What::Meet => {
            // The condition that chose the branch is the cause, if it is known.
            let to = node.args.first().filter(|_| node.args.len() == 3);
            if let Some(to) = to {
                add(&mut flows[*to as usize], std::iter::once(total));
            }
            return (blame, 0.0);
        }
        What::Element => {
            if let Some(element) = node.args.last() {
                add(&mut flows[*element as usize], flow.iter().copied());
            }
            return (blame, 0.0);
        }
        What::Lane(_) | What::Kernel(..) => {}
        What::Const | What::Global(_) | What::GlobalDeriv(..) | What::Note(_) => return (blame, 0.0),
    }
    blame.runs = 1;
    let right = exact.numbers();
    blame.size = right.iter().fold(0.0, |most, x| x.abs().max(most));
    let error = differences(&Exact::widen(strict).numbers(), &right);
    if error.iter().all(|e| *e == 0.0) {
        return (blame, 0.0);
    }
    if matches!(exact, Exact::Int(_)) {
        blame.flips = 1;
    }
    blame.broken = broken(trace, id);
    if total == 0.0 {
        return (blame, 0.0);
    }
    let steps = Steps::new(trace, id);
    blame.flips = u32::from(steps.jumps());
    let (kept, own) = steps.pass_on(flow, &node.args, flows);
    if blame.broken.is_some() {
        (blame.amplified, blame.left) = (kept, kept);
        return (blame, 0.0);
    }
    (blame.inexact, blame.begins) = (kept * own, kept);
    blame.amplified = steps.worse(flow, &error);
    if blame.amplified > 0.0 {
        blame.factor = steps.factor();
        if reduces(trace, id) {
            blame.reduced = blame.amplified;
        }
    }
    (blame, kept)
}

/// An instruction that can be run again with other arguments.
struct Steps<'a> {
    trace: &'a Trace,
    id: NodeId,
    strict: Vec<Const>,
    exact: Vec<Exact>,
}

impl<'a> Steps<'a> {
    fn new(trace: &'a Trace, id: NodeId) -> Steps<'a> {
        let args = trace.node(id).args.iter().map(|a| trace.node(*a));
        let (mut strict, mut exact) = (Vec::new(), Vec::new());
        for node in args {
            let value = node.exact.clone().or_else(|| node.strict.as_ref().map(Exact::widen));
            let value = value.unwrap_or(Exact::Float(0.0));
            strict.push(node.strict.clone().unwrap_or_else(|| value.round()));
            exact.push(value);
        }
        Steps { trace, id, strict, exact }
    }

    fn run(&self, args: &[Exact]) -> Option<Vec<f64>> {
        Some(again(&self.trace.node(self.id).what, args)?.numbers())
    }

    /// Splits the error that passes through among the arguments. Returns what is left for the instruction
    /// itself, and how many times a rounding its own error is.
    fn pass_on(&self, flow: &[f64], args: &[NodeId], flows: &mut [Vec<f64>]) -> (f64, f64) {
        let node = self.trace.node(self.id);
        let strict = node.numbers();
        let mut now = self.exact.clone();
        let total: f64 = flow.iter().sum();
        let Some(mut before) = self.run(&now) else { return (self.pass_on_unknown(total, args, flows), 0.0) };
        // How each component of each argument changes each component of the result.
        let mut changes: Vec<(usize, usize, Vec<f64>)> = Vec::new();
        for (arg, to) in self.strict.iter().enumerate() {
            let to = Exact::widen(to);
            let (goal, kind) = (to.numbers(), to.kind());
            for component in 0..goal.len() {
                let mut numbers = now[arg].numbers();
                if numbers.get(component).is_none_or(|x| difference(*x, goal[component]) == 0.0) {
                    continue;
                }
                numbers[component] = goal[component];
                now[arg] = Exact::of_numbers(kind, &numbers);
                let Some(after) = self.run(&now) else { continue };
                changes.push((arg, component, differences(&after, &before)));
                before = after;
            }
        }
        let own = differences(&strict, &before);
        let largest = |list: &[f64]| list.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let rounding = largest(&before) * f64::from(f32::EPSILON) / 2.0;
        let times = if rounding > 0.0 { (largest(&own) / rounding).min(1.0 / rounding) } else { 0.0 };
        let mut kept = 0.0;
        for (component, flow) in flow.iter().enumerate().filter(|(_, f)| **f != 0.0) {
            let size = |list: &[f64]| {
                list.get(component).map_or(0.0, |x| if x.is_finite() { x.abs() } else { f64::MAX / 1e9 })
            };
            let sum: f64 = changes.iter().map(|(.., change)| size(change)).sum::<f64>() + size(&own);
            if sum == 0.0 {
                kept += flow;
                continue;
            }
            kept += flow * size(&own) / sum;
            for (arg, part, change) in &changes {
                let to = &mut flows[args[*arg] as usize];
                if to.len() <= *part {
                    to.resize(part + 1, 0.0);
                }
                to[*part] += flow * size(change) / sum;
            }
        }
        (kept, if times.is_finite() { times } else { 0.0 })
    }

    /// The same for a call that cannot run again: its wrong operands have all of it.
    fn pass_on_unknown(&self, total: f64, args: &[NodeId], flows: &mut [Vec<f64>]) -> f64 {
        let given = self.strict.iter().zip(&self.exact).map(|(strict, exact)| relative_error(strict, exact));
        let given: Vec<f64> =
            given.map(|error| if error.is_finite() { error } else { f64::MAX / 1e9 }).collect();
        let sum: f64 = given.iter().sum();
        if sum == 0.0 {
            return total;
        }
        for (error, arg) in given.iter().zip(args).filter(|(error, _)| **error > 0.0) {
            let wrong: Vec<bool> = errors(self.trace, *arg).iter().map(|e| *e != 0.0).collect();
            let each = total * error / sum / wrong.iter().filter(|w| **w).count().max(1) as f64;
            add(&mut flows[*arg as usize], wrong.iter().map(|w| if *w { each } else { 0.0 }));
        }
        0.0
    }

    /// The relative error of the result divided by the largest one of the arguments, which count as rounded
    /// once at least. 0 for a result that should be 0.
    fn factor(&self) -> f64 {
        let node = self.trace.node(self.id);
        let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return 0.0 };
        let given = self.strict.iter().zip(&self.exact).map(|(strict, exact)| relative_error(strict, exact));
        relative_error(strict, exact) / given.fold(f64::from(f32::EPSILON) / 2.0, f64::max)
    }

    /// Whether the result jumps for a tiny change of the arguments.
    fn jumps(&self) -> bool {
        match &self.trace.node(self.id).what {
            What::Lane(op) => matches!(op.continuity(), Continuity::Step | Continuity::Compare),
            _ => false,
        }
    }

    /// Whether the arguments are nearly right, so that a wrong result is the instruction's own fault.
    fn are_close(&self) -> bool {
        let close = |(strict, exact): (&Const, &Exact)| {
            let strict = Exact::widen(strict).numbers();
            strict
                .iter()
                .zip(exact.numbers())
                .all(|(s, e)| difference(*s, e).abs() <= CLOSE * s.abs().max(e.abs()))
        };
        self.strict.iter().zip(&self.exact).all(close)
    }

    /// The part of the passing error that the instruction amplifies: its error with exact arguments that are
    /// rounded once, beyond the rounding of its result. Arguments that single precision cannot hold stay as
    /// they are.
    fn worse(&self, flow: &[f64], error: &[f64]) -> f64 {
        let node = self.trace.node(self.id);
        let Some(exact) = &node.exact else { return 0.0 };
        let rounded: Vec<Exact> = self.exact.iter().map(rounded_once).collect();
        let Some(local) = self.run(&rounded) else {
            let are_right = self.strict.iter().zip(&self.exact).all(|(s, e)| relative_error(s, e) == 0.0);
            return if !are_right && self.are_close() { flow.iter().sum() } else { 0.0 };
        };
        let whole = matches!(exact, Exact::Int(_));
        if self.jumps() && self.are_close() {
            return flow.iter().sum();
        }
        let mut sum = 0.0;
        for (((flow, error), local), exact) in flow.iter().zip(error).zip(&local).zip(exact.numbers()) {
            let own = difference(*local, exact).abs();
            let ulp = if whole { 0.0 } else { exact.abs() * f64::from(f32::EPSILON) };
            let part = match (own.is_finite(), error.is_finite()) {
                (false, _) => 1.0,
                (true, false) => 0.0,
                (true, true) => ((own - ulp).max(0.0) / error.abs()).min(1.0),
            };
            sum += flow * part;
        }
        sum
    }
}

fn name(what: &What) -> String {
    match what {
        What::Lane(op) => op.text().to_string(),
        What::Kernel(kernel, _) => {
            osl_ir::ir::Op::Kernel((**kernel).clone(), osl_ir::ir::Values::new()).name()
        }
        other => format!("{other:?}"),
    }
}
