//! From which variables a value gets its derivative, and why the language gives it none.
//!
//! The walk follows the arguments of operations as long as a change of the argument changes the result at
//! this point, and the language carries the derivative on.

use crate::quote::snippet;
use crate::trace::{Exact, NodeId, OnePoint, Trace, What as Kind, eval, noise};
use osl_ir::ir::{Axis, Derivative, Kernel, LaneOp, NoiseField, TextFn};
use osl_numeric::Continuity;
use osl_syntax::source::SourceMap;
use rustc_hash::{FxHashMap, FxHashSet};
use serde::Serialize;
use std::collections::BTreeSet;

/// The most nodes that are visited for one value.
const MAX_NODES: usize = 2_000;

/// A variable or global, with the line that set it.
pub(super) type Named = (String, Option<u32>);

/// Bits for the components of a value.
type Components = u8;
const ALL: Components = 7;

/// How a value is made, as far as it explains that its derivative is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ValueOrigin {
    /// From constants alone, on the way that the point took.
    Constant,
    /// With a derivative, which in the language has no derivative itself.
    Derivative,
    /// Otherwise.
    Other,
}

/// Where a variable was set, and how it changes.
#[derive(Clone, Debug)]
pub(super) struct SetAt {
    pub(super) line: u32,
    pub(super) name: String,
    pub(super) changes: [Vec<f64>; 2],
    /// Why the derivative of the language is not the one of mathematics.
    pub(super) why: Vec<String>,
}

const FMOD: &str = "`fmod` has the derivative of its first argument only";

const COLORS: &str = "a color of a space that is unknown, or known only at run time, has no derivative";

/// What a walk needs to know.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) trace: &'a Trace,
    pub(super) point: OnePoint<'a>,
    pub(super) sources: &'a SourceMap,
    /// The variables that have been set.
    pub(super) set: &'a FxHashMap<NodeId, SetAt>,
    /// Values from this number on belong to derivatives.
    pub(super) values: usize,
}

/// What a walk found.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) through: BTreeSet<Named>,
    /// The variables and globals on the way that have no derivative.
    pub(super) still: BTreeSet<Named>,
    pub(super) made: ValueOrigin,
    pub(super) why: Vec<String>,
    seen: FxHashSet<(NodeId, Components)>,
    open: Vec<(NodeId, Components)>,
}

impl Found {
    /// Walks from a value.
    pub(super) fn of(value: NodeId, known: Known<'_>) -> Found {
        let mut found = Found {
            through: BTreeSet::new(),
            still: BTreeSet::new(),
            made: ValueOrigin::Constant,
            why: Vec::new(),
            seen: FxHashSet::default(),
            open: vec![(value, ALL)],
        };
        while let Some((id, parts)) = found.open.pop() {
            if found.seen.insert((id, parts)) && found.seen.len() <= MAX_NODES {
                found.visit(id, parts, known);
            }
        }
        if found.made == ValueOrigin::Constant && !(found.through.is_empty() && found.why.is_empty()) {
            found.made = ValueOrigin::Other;
        }
        found
    }

    fn because(&mut self, why: String) {
        if !self.why.contains(&why) {
            self.why.push(why);
        }
    }

    fn visit(&mut self, id: NodeId, parts: Components, known: Known<'_>) {
        let node = known.trace.node(id);
        if !matches!(node.what, Kind::Const) && self.made == ValueOrigin::Constant {
            self.made = ValueOrigin::Other;
        }
        if is_derivative(id, known) {
            self.made = ValueOrigin::Derivative;
            return self.because("a derivative has none itself".to_string());
        }
        if let Some(set) = known.set.get(&id) {
            let at = (set.name.clone(), Some(set.line));
            set.why.iter().for_each(|why| self.because(why.clone()));
            let list = if moves(&set.changes, parts) { &mut self.through } else { &mut self.still };
            list.insert(at);
            return;
        }
        match &node.what {
            Kind::Global(global) => {
                let changes =
                    Axis::BOTH.map(|axis| known.point.deriv_of(*global, axis).map(f64::from).to_vec());
                let list = if moves(&changes, parts) { &mut self.through } else { &mut self.still };
                list.insert((global.name().to_string(), None));
            }
            Kind::Lane(op) => self.lane(*op, id, parts, known),
            Kind::Kernel(kernel, _) => self.kernel(kernel, id, known),
            Kind::Element => self.open.extend(node.args.last().map(|id| (*id, parts))),
            // The strict value is the one before the last.
            Kind::Meet => self.open.extend(node.args.iter().rev().nth(1).map(|id| (*id, parts))),
            Kind::Const | Kind::GlobalDeriv(..) | Kind::Note(_) => {}
        }
    }

    fn lane(&mut self, op: LaneOp, id: NodeId, parts: Components, known: Known<'_>) {
        let node = known.trace.node(id);
        if matches!(op.derivative(), Derivative::None | Derivative::Zero) {
            if op.continuity() == Continuity::Smooth && node.args.iter().any(|arg| reaches(*arg, known)) {
                self.because(no_derivative(op, snippet(node.span, known.sources)));
            }
            return;
        }
        let args: Vec<Exact> = node.args.iter().map(|arg| exact(*arg, known)).collect();
        let is_first = matches!(op, LaneOp::Fmod | LaneOp::FmodExact);
        for (at, arg) in node.args.iter().enumerate() {
            let of_arg = match op {
                LaneOp::FAdd | LaneOp::FSub => parts,
                _ => effect(&args, at, parts, |args| eval(op, args)),
            };
            // By zero, `fmod` is 0, but keeps the derivative.
            let of_arg = if is_first && at == 0 && of_arg == 0 && reaches(*arg, known) {
                self.because(FMOD.to_string());
                parts
            } else {
                of_arg
            };
            if of_arg == 0 {
                continue;
            }
            match args.get(at) {
                Some(Exact::Matrix(_)) if reaches(*arg, known) => {
                    self.because("a matrix has no derivative".to_string());
                }
                Some(Exact::Float(_) | Exact::Triple(_)) if at > 0 && is_first && !reaches(*arg, known) => {}
                Some(Exact::Float(_) | Exact::Triple(_)) if at > 0 && is_first => {
                    self.because(FMOD.to_string());
                }
                Some(Exact::Float(_) | Exact::Triple(_)) => {
                    if op == LaneOp::Atan2 && reaches(*arg, known) {
                        self.because(
                            "the sign of the derivative of `atan2` is reversed, as in the reference".into(),
                        );
                    }
                    self.open.push((*arg, of_arg));
                }
                _ => {}
            }
        }
    }

    fn kernel(&mut self, kernel: &Kernel, id: NodeId, known: Known<'_>) {
        let node = known.trace.node(id);
        let numbers = |args: &[NodeId]| -> Vec<(NodeId, Components)> {
            let is_number = |id: &&NodeId| matches!(exact(**id, known), Exact::Float(_) | Exact::Triple(_));
            args.iter().filter(is_number).map(|id| (*id, ALL)).collect()
        };
        let is_reached = || node.args.iter().any(|arg| reaches(*arg, known));
        let still = match kernel {
            Kernel::Noise { field: NoiseField::Hash, .. } => Some("`hash` noise has no derivative"),
            Kernel::Text(TextFn::ToFloat) => Some("a number that is read from a string has no derivative"),
            Kernel::ColorBetween => Some(COLORS),
            Kernel::Environment { .. } => Some("`environment` has no derivative"),
            Kernel::Volume { .. } => Some("`texture3d` has no derivative"),
            _ => None,
        };
        if let Some(why) = still {
            if is_reached() {
                self.because(why.to_string());
            }
            return;
        }
        match kernel {
            Kernel::Noise { dims, .. } | Kernel::NamedNoise { dims, .. } => {
                let first = usize::from(matches!(kernel, Kernel::NamedNoise { .. }));
                let count = if *dims < 3 { usize::from(*dims) } else { usize::from(*dims) - 2 };
                let args: Vec<Exact> = node.args.iter().map(|arg| exact(*arg, known)).collect();
                let is_gabor = matches!(args.first(), Some(Exact::Str(name)) if **name == *"gabor");
                if is_gabor && node.args.iter().any(|arg| reaches(*arg, known)) {
                    self.because("the filter of `gabor` noise has no derivative".to_string());
                }
                let is_periodic = matches!(
                    kernel,
                    Kernel::Noise { periodic: true, .. } | Kernel::NamedNoise { periodic: true, .. }
                );
                let periods = node.args.get(first + count..first + 2 * count).filter(|_| is_periodic);
                if periods.unwrap_or_default().iter().any(|arg| reaches(*arg, known)) {
                    self.because("a period has no derivative".to_string());
                }
                for at in first..first + count {
                    let of_arg = effect(&args, at, ALL, |args| noise(kernel, args, 0));
                    if let Some(arg) = node.args.get(at).filter(|_| of_arg != 0) {
                        self.open.push((*arg, of_arg));
                    }
                }
            }
            Kernel::Texture { footprint, .. } => {
                let changes = node.args.len().checked_sub(4).and_then(|start| node.args.get(start..));
                if *footprint && changes.unwrap_or_default().iter().any(|arg| is_given(*arg, known)) {
                    self.because("`texture` takes the changes of s and t from its arguments".to_string());
                }
                self.open.extend(numbers(node.args.get(1..3).unwrap_or_default()));
            }
            Kernel::SplineInverse { .. } => self.open.extend(numbers(node.args.get(..1).unwrap_or_default())),
            _ => {}
        }
    }
}

/// Whether a value is a derivative: `prepare` wrote it, and with it the derivative of a global or of a call
/// from which it is made. Folding writes values too.
fn is_derivative(value: NodeId, known: Known<'_>) -> bool {
    let (mut seen, mut open) = (FxHashSet::default(), vec![value]);
    while let Some(id) = open.pop() {
        let node = known.trace.node(id);
        match &node.what {
            _ if !seen.insert(id) || seen.len() > MAX_NODES => {}
            Kind::GlobalDeriv(..) => return true,
            Kind::Kernel(kernel, index) if *index > 0 && kernel.has_derivs() => return true,
            _ if node.result.is_some_and(|result| result.index() >= known.values) => open.extend(&node.args),
            _ => {}
        }
    }
    false
}

/// Whether a change of a texture coordinate comes from the source.
fn is_given(change: NodeId, known: Known<'_>) -> bool {
    let node = known.trace.node(change);
    let is_zero = node.strict.as_ref().is_some_and(|x| Exact::widen(x).numbers().iter().all(|x| *x == 0.0));
    !(is_derivative(change, known) || matches!(node.what, Kind::Const) && is_zero)
}

/// Why an operation without a derivative has none; `call` is its source text.
fn no_derivative(op: LaneOp, call: String) -> String {
    let kinds = op.shape();
    match op {
        LaneOp::Still if call.starts_with("getmessage") => "a message has no derivative".to_string(),
        LaneOp::Still if call.starts_with("spline") => "the basis `constant` has no derivative".to_string(),
        LaneOp::Still => "a color in a named space has no derivative".to_string(),
        _ if kinds.args.iter().chain([&kinds.result]).any(|kind| *kind == osl_ir::ir::Kind::Matrix) => {
            "a matrix has no derivative".to_string()
        }
        _ => format!("`{}` has no derivative", op.text()),
    }
}

/// Whether any of these components changes.
fn moves(changes: &[Vec<f64>; 2], parts: Components) -> bool {
    let moves = |list: &Vec<f64>| list.iter().enumerate().any(|(at, x)| *x != 0.0 && parts & (1 << at) != 0);
    changes.iter().any(moves)
}

/// Whether a value is made from anything that changes.
fn reaches(value: NodeId, known: Known<'_>) -> bool {
    let (mut seen, mut open) = (FxHashSet::default(), vec![value]);
    while let Some(id) = open.pop() {
        if !seen.insert(id) || seen.len() > MAX_NODES {
            continue;
        }
        let node = known.trace.node(id);
        match (&node.what, known.set.get(&id)) {
            (Kind::Global(global), _) => {
                let changes =
                    Axis::BOTH.map(|axis| known.point.deriv_of(*global, axis).map(f64::from).to_vec());
                if moves(&changes, ALL) {
                    return true;
                }
            }
            // What has no derivative for a reason may change nevertheless.
            (_, Some(set)) if moves(&set.changes, ALL) || !set.why.is_empty() => return true,
            _ => open.extend(&node.args),
        }
    }
    false
}

/// The value of a node in double precision.
fn exact(id: NodeId, known: Known<'_>) -> Exact {
    let node = known.trace.node(id);
    let strict = || node.strict.as_ref().map(Exact::widen);
    node.exact.clone().or_else(strict).unwrap_or(Exact::Int(0))
}

/// The components of an argument whose change changes these components of the result.
fn effect(
    args: &[Exact],
    at: usize,
    parts: Components,
    result: impl Fn(&[Exact]) -> Option<Exact>,
) -> Components {
    let Some(arg) = args.get(at) else { return 0 };
    let (numbers, kind) = (arg.numbers(), arg.kind());
    let Some(base) = result(args).map(|base| base.numbers()) else { return ALL };
    let mut found = 0;
    for (component, x) in numbers.iter().enumerate() {
        let step = (x.abs() * 1e-6).max(1e-9);
        let changed = [x - step, x + step].into_iter().any(|x| {
            let mut numbers = numbers.clone();
            numbers[component] = x;
            let mut args = args.to_vec();
            args[at] = Exact::of_numbers(kind, &numbers);
            let now = result(&args).map_or_else(Vec::new, |now| now.numbers());
            let differs = |(at, (a, b)): (usize, (&f64, &f64))| {
                (base.len() == 1 || parts & (1 << at) != 0) && a != b && !(a.is_nan() && b.is_nan())
            };
            base.iter().zip(&now).enumerate().any(differs)
        });
        if changed {
            found |= if kind == osl_ir::ir::Kind::Matrix { ALL } else { 1 << component };
        }
    }
    found
}
