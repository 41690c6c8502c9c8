//! Finds the cause of an error: follows the difference between the strict and the exact value of an output
//! back to the instructions that made it.
//!
//! Each executed instruction is asked two questions. *How much of the output's error passes through it?*
//! Strict arguments replace the exact ones, one after the other. This splits the error of a result into the
//! part that each argument brought along and the part that the instruction itself rounded away; the parts are
//! followed back to their origins. *Does the instruction amplify the error?* It is given exact arguments that
//! are rounded once. If its error exceeds the rounding of its own result, no care taken earlier could have
//! avoided it (the local error of P. Panchekha et al., *Automatically Improving Accuracy for Floating Point
//! Expressions*, 2015). An instruction scores by the share of the error that passes through it where it
//! amplifies, and with less weight by its own rounding, which adds up in long loops.

use super::instruction::{Blame, InstSite};
use super::pairs::{Pairs, Paths};
use crate::trace::{Exact, NodeId, Trace, What, eval};
use osl_ir::ir::{Const, Continuity};
use std::collections::BTreeMap;

/// An argument counts as nearly right up to this relative error.
const CLOSE: f64 = 1e-4;

/// What the instructions of a trace did.
#[derive(Clone, Debug, Default)]
pub(super) struct Blames {
    /// The blame of every instruction that has any.
    pub(super) places: BTreeMap<InstSite, Blame>,
    /// The instruction that magnifies, the instruction whose rounding it magnifies, and that error as a share
    /// of an output's range.
    pub(super) pairs: Pairs,
}

/// The blame of a trace. `ranges` are those of the outputs, in the order of the trace.
pub(super) fn blame(trace: &Trace, ranges: &[f64]) -> Blames {
    let mut flows: Vec<Vec<f64>> = vec![Vec::new(); trace.nodes.len()];
    for ((_, _, nodes), range) in trace.outputs.iter().zip(ranges) {
        for id in nodes {
            let error = errors(trace, *id);
            let share = error.iter().map(|e| if e.is_finite() { (e / range).abs().min(1.0) } else { 1.0 });
            add(&mut flows[*id as usize], share);
        }
    }
    let mut found = Blames::default();
    let mut paths = Paths::new(trace.nodes.len());
    let place = |id: NodeId| InstSite { span: trace.node(id).span, what: name(&trace.node(id).what) };
    let sum = |flow: &Vec<f64>| flow.iter().sum::<f64>();
    for id in (0..trace.nodes.len()).rev() {
        let flow = std::mem::take(&mut flows[id]);
        let args = &trace.nodes[id].args;
        let before: Vec<f64> = args.iter().map(|arg| sum(&flows[*arg as usize])).collect();
        let blame = one(trace, id as NodeId, &flow, &mut flows);
        if blame != Blame::default() {
            found.places.entry(place(id as NodeId)).or_default().add(&blame);
        }
        if let Some(by) = paths.magnifier(id).filter(|by| place(*by) != place(id as NodeId)) {
            found.pairs.add(place(by), place(id as NodeId), blame.rounded);
        }
        let after = args.iter().map(|arg| sum(&flows[*arg as usize]));
        let parts: Vec<f64> = after.zip(before).map(|(after, before)| after - before).collect();
        paths.pass_on(id, &blame, args, &parts);
    }
    found
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

fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| difference(*a, *b)).collect()
}

fn difference(a: f64, b: f64) -> f64 {
    match (a == b || (a.is_nan() && b.is_nan()), (a - b).is_finite()) {
        (true, _) => 0.0,
        (false, true) => a - b,
        (false, false) => f64::INFINITY,
    }
}

/// The blame of a node through which the error `flow` passes, component by component. Passes the arguments'
/// parts on.
fn one(trace: &Trace, id: NodeId, flow: &[f64], flows: &mut [Vec<f64>]) -> Blame {
    let node = trace.node(id);
    let mut blame = Blame::default();
    let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return blame };
    let total: f64 = flow.iter().sum();
    match &node.what {
        What::Meet => {
            // The condition that chose the branch is the cause, if it is known.
            let to = node.args.first().filter(|_| node.args.len() == 3);
            if let Some(to) = to {
                add(&mut flows[*to as usize], std::iter::once(total));
            }
            return blame;
        }
        What::Element => {
            if let Some(element) = node.args.last() {
                add(&mut flows[*element as usize], flow.iter().copied());
            }
            return blame;
        }
        What::Lane(_) | What::Kernel(..) => {}
        What::Const | What::Global(_) | What::GlobalDeriv(..) | What::Note(_) => return blame,
    }
    blame.runs = 1;
    let error = differences(&Exact::widen(strict).numbers(), &exact.numbers());
    if error.iter().all(|e| *e == 0.0) {
        return blame;
    }
    if matches!(exact, Exact::Int(_)) {
        blame.flips = 1;
    }
    if total == 0.0 {
        return blame;
    }
    let steps = Steps::new(trace, id);
    blame.flips = u32::from(steps.jumps());
    blame.rounded = steps.pass_on(flow, &node.args, flows);
    blame.amplified = steps.worse(flow, &error);
    if blame.amplified > 0.0 {
        blame.factor = steps.factor();
    }
    blame
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
        let result = match &self.trace.node(self.id).what {
            What::Lane(op) => eval(*op, args)?,
            What::Kernel(kernel, result) => crate::trace::noise(kernel, args, *result)?,
            _ => return None,
        };
        Some(result.numbers())
    }

    /// Splits the error that passes through among the arguments. Returns what is left for the instruction
    /// itself.
    fn pass_on(&self, flow: &[f64], args: &[NodeId], flows: &mut [Vec<f64>]) -> f64 {
        let node = self.trace.node(self.id);
        let strict = node.strict.as_ref().map_or_else(Vec::new, |v| Exact::widen(v).numbers());
        let mut now = self.exact.clone();
        let total: f64 = flow.iter().sum();
        let Some(mut before) = self.run(&now) else { return total };
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
        kept
    }

    /// The relative error of the result divided by the largest one of the arguments, which count as rounded
    /// once at least. 0 for a result that should be 0.
    fn factor(&self) -> f64 {
        let node = self.trace.node(self.id);
        let (Some(strict), Some(exact)) = (&node.strict, &node.exact) else { return 0.0 };
        let given = self.strict.iter().zip(&self.exact).map(|(strict, exact)| relative(strict, exact));
        relative(strict, exact) / given.fold(f64::from(f32::EPSILON) / 2.0, f64::max)
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
    /// rounded once, beyond the rounding of its result.
    fn worse(&self, flow: &[f64], error: &[f64]) -> f64 {
        let node = self.trace.node(self.id);
        let Some(exact) = &node.exact else { return 0.0 };
        let rounded: Vec<Exact> = self.exact.iter().map(|e| Exact::widen(&e.round())).collect();
        let Some(local) = self.run(&rounded) else { return 0.0 };
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

/// The error of the largest component relative to its size; 0 if the exact value is 0.
fn relative(strict: &Const, exact: &Exact) -> f64 {
    let (strict, exact) = (Exact::widen(strict).numbers(), exact.numbers());
    let size = exact.iter().map(|x| x.abs()).fold(0.0, f64::max);
    let error = differences(&strict, &exact).iter().map(|e| e.abs()).fold(0.0, f64::max);
    if size > 0.0 { error / size } else { 0.0 }
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
