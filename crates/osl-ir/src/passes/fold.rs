//! Constant folding with the arithmetic of a run. Also resolves names of spaces and noises, takes known
//! branches, and applies rewrites that keep every bit.

mod meaning;

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, NoiseField, Op, Source, ValueId, Values};
use meaning::Meaning;
pub(super) use meaning::{only_meaning, settle};
use osl_numeric::spaces::Path;
use smallvec::smallvec;
use std::cell::Cell;

/// How much text of strings may be computed while compiling; what is not remains for the run.
pub(super) struct Strings {
    /// Bytes of all strings that may still be computed.
    pub(super) left: u64,
    /// Bytes that one string may have.
    pub(super) string: u64,
}

/// Runs the pass.
pub(super) fn run(body: &mut Body, text: &mut Strings) {
    let _ = fold(body, false, Numbers::Single, text);
}

/// Runs the pass on a body whose meaning is settled: values that become constant only now do not change it.
pub(super) fn again(body: &mut Body, numbers: Numbers, text: &mut Strings) {
    let _ = fold(body, true, numbers, text);
}

/// The arithmetic whose results become constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    /// The strict arithmetic.
    Single,
    /// Double precision, where single precision can represent the result.
    Double,
    /// Both, where their results are the same.
    Both,
}

impl Numbers {
    /// The result of an operation on constants.
    fn result(self, op: LaneOp, args: &[Const]) -> Option<Const> {
        match self {
            Numbers::Single => op.eval(args),
            Numbers::Double => op.eval_exactly(args),
            // A NaN is never the same, so that it stays a result of the run.
            Numbers::Both => op.eval(args).filter(|single| op.eval_exactly(args).as_ref() == Some(single)),
        }
    }
}

/// Returns the findings that change the meaning.
fn fold(body: &mut Body, settled: bool, numbers: Numbers, text: &mut Strings) -> Meaning {
    let values = body.values.len();
    let mut fold = Fold {
        settled,
        numbers,
        text: Cell::new(text.left),
        string: text.string,
        renaming: Renaming::default(),
        known: vec![None; values],
        lanes: vec![None; values],
        meaning: Meaning::default(),
    };
    fold.block(body, body.entry);
    rename_outputs(body, &fold.renaming);
    text.left = fold.text.get();
    fold.meaning
}

/// Applies a renaming to the outputs.
pub(super) fn rename_outputs(body: &mut Body, renaming: &Renaming) {
    for output in &mut body.outputs {
        if let Source::Value(value) = &mut output.source {
            *value = renaming.get(*value);
        }
    }
}

struct Fold {
    /// Whether further constants no longer change the meaning.
    settled: bool,
    /// The arithmetic of constants.
    numbers: Numbers,
    /// Bytes of strings that may still be read and made.
    text: Cell<u64>,
    /// Bytes that one string may have.
    string: u64,
    renaming: Renaming,
    /// The constant of each value, if it is one.
    known: Vec<Option<Const>>,
    /// The lane operation that computes each value.
    lanes: Vec<Option<(LaneOp, Values)>>,
    meaning: Meaning,
}

/// The replacement of an instruction.
enum Outcome {
    Keep(Op),
    Constant(Const),
    Same(ValueId),
}

impl Fold {
    fn constant(&self, value: ValueId) -> Option<&Const> {
        self.known.get(value.index())?.as_ref()
    }

    /// Whether an int is known to be in `0..len`.
    fn is_within(&self, index: ValueId, len: ValueId) -> bool {
        let Some(Const::Int(len)) = self.constant(len) else { return false };
        let (low, high) = self.range(index, 4);
        low >= 0 && high < *len
    }

    /// Bounds of an int, from the operations that make it.
    fn range(&self, value: ValueId, depth: u32) -> (i32, i32) {
        let whole = (i32::MIN, i32::MAX);
        if let Some(Const::Int(n)) = self.constant(value) {
            return (*n, *n);
        }
        let Some((op, args)) = self.lane(value).filter(|_| depth > 0) else { return whole };
        let mut bounds = args.iter().map(|a| self.range(*a, depth - 1));
        let (a, b) = (bounds.next().unwrap_or(whole), bounds.next().unwrap_or(whole));
        match op {
            LaneOp::IMin => (a.0.min(b.0), a.1.min(b.1)),
            LaneOp::IMax => (a.0.max(b.0), a.1.max(b.1)),
            LaneOp::IAnd if b.0 >= 0 => (0, b.1),
            LaneOp::IMod if a.0 >= 0 && b.0 > 0 => (0, b.1 - 1),
            LaneOp::FLt | LaneOp::FLe | LaneOp::FGt | LaneOp::FGe | LaneOp::FEq | LaneOp::FNe => (0, 1),
            LaneOp::ILt | LaneOp::ILe | LaneOp::IGt | LaneOp::IGe | LaneOp::IEq | LaneOp::INe => (0, 1),
            _ => whole,
        }
    }

    fn lane(&self, value: ValueId) -> Option<(LaneOp, &[ValueId])> {
        let (op, args) = self.lanes.get(value.index())?.as_ref()?;
        Some((*op, args))
    }

    fn note(&mut self, value: ValueId, op: &Op) {
        let index = value.index();
        if self.known.len() <= index {
            self.known.resize(index + 1, None);
            self.lanes.resize(index + 1, None);
        }
        match op {
            Op::Const(c) => self.known[index] = Some(c.clone()),
            Op::Lane(op, args) => self.lanes[index] = Some((*op, args.clone())),
            _ => {}
        }
    }

    fn block(&mut self, body: &mut Body, id: BlockId) {
        let insts = std::mem::take(&mut body.blocks[id.index()].insts);
        let mut kept = Vec::with_capacity(insts.len());
        for inst in insts {
            self.inst(body, inst, &mut kept);
        }
        body.blocks[id.index()].insts = kept;
    }

    fn inst(&mut self, body: &mut Body, mut inst: Inst, kept: &mut Vec<Inst>) {
        inst.op.replace_uses(|v| self.renaming.get(v));
        match inst.op {
            Op::If { .. } => self.branch(body, inst, kept),
            Op::Loop { .. } => self.round(body, inst, kept),
            Op::Kernel(Kernel::CheckIndex { .. }, ref args) if matches!(args[..], [index, len] if self.is_within(index, len)) =>
                {}
            op => {
                let divided = match &op {
                    Op::Lane(op, args) => self.by_constant(*op, args),
                    _ => None,
                };
                let outcome = match op {
                    Op::Lane(op, args) => self.lane_op(body, divided.unwrap_or(op), args, inst.span, kept),
                    Op::Kernel(Kernel::ColorBetween, args) if self.is_unconverted(&args) => {
                        self.meaning.unconverted.extend(inst.results.first());
                        args.get(2).map_or(Outcome::Constant(Const::Int(0)), |color| Outcome::Same(*color))
                    }
                    Op::Kernel(Kernel::ColorBetween, args) => self.color(body, args, inst.span, kept),
                    Op::Kernel(kernel, args) => self.kernel(kernel, args),
                    op => Outcome::Keep(op),
                };
                if let (Some(op), Some(result)) = (divided, inst.results.first()) {
                    self.meaning.divided.push((*result, op));
                }
                let op = match outcome {
                    Outcome::Keep(op) => op,
                    Outcome::Constant(c) => Op::Const(c),
                    Outcome::Same(value) => {
                        inst.results.iter().for_each(|r| self.renaming.set(*r, value));
                        return;
                    }
                };
                inst.results.iter().for_each(|r| self.note(*r, &op));
                kept.push(Inst { op, ..inst });
            }
        }
    }

    /// Adds an instruction for an intermediate result.
    fn add(
        &mut self,
        body: &mut Body,
        op: Op,
        kind: Kind,
        span: osl_syntax::span::Span,
        kept: &mut Vec<Inst>,
    ) -> ValueId {
        let result = body.fresh(kind, span);
        self.note(result, &op);
        kept.push(Inst { op, results: smallvec![result], span });
        result
    }

    /// The operation for a division or remainder with a constant, nonzero divisor.
    fn by_constant(&self, op: LaneOp, args: &Values) -> Option<LaneOp> {
        let known = match op {
            LaneOp::FDiv => LaneOp::FDivBy,
            LaneOp::Fmod => LaneOp::FmodExact,
            LaneOp::Mod => LaneOp::ModBy,
            _ => return None,
        };
        let divisor = self.constant(*args.get(1)?)?;
        (!self.settled && is_some_divisor(divisor)).then_some(known)
    }

    fn lane_op(
        &mut self,
        body: &mut Body,
        op: LaneOp,
        args: Values,
        span: osl_syntax::span::Span,
        kept: &mut Vec<Inst>,
    ) -> Outcome {
        let constants: Vec<Option<&Const>> = args.iter().map(|a| self.constant(*a)).collect();
        if let Some(all) = constants.iter().map(|c| c.cloned()).collect::<Option<Vec<Const>>>()
            && spend(&self.text, &all)
            && let Some(result) = self.numbers.result(op, &all)
        {
            return Outcome::Constant(result);
        }
        match (op, args.as_slice(), constants.as_slice()) {
            (LaneOp::Get, [t, _], [_, Some(Const::Int(i))]) => {
                let op = [LaneOp::X, LaneOp::Y, LaneOp::Z][(*i).clamp(0, 2) as usize];
                let t = *t;
                self.part(op, t)
            }
            (LaneOp::X | LaneOp::Y | LaneOp::Z, [t], _) => {
                let t = *t;
                self.part(op, t)
            }
            (LaneOp::Set, [t, _, value], [_, Some(Const::Int(i)), _]) => {
                let (t, value, index) = (*t, *value, (*i).clamp(0, 2) as usize);
                let mut parts = [value; 3];
                for (at, op) in [LaneOp::X, LaneOp::Y, LaneOp::Z].into_iter().enumerate() {
                    if at != index {
                        parts[at] = match self.part(op, t) {
                            Outcome::Same(part) => part,
                            Outcome::Keep(op) => self.add(body, op, Kind::Float, span, kept),
                            Outcome::Constant(c) => self.add(body, Op::Const(c), Kind::Float, span, kept),
                        };
                    }
                }
                Outcome::Keep(Op::Lane(LaneOp::Triple, Values::from_slice(&parts)))
            }
            (
                LaneOp::Choose | LaneOp::IChoose | LaneOp::MChoose | LaneOp::SChoose | LaneOp::KChoose,
                [_, a, b],
                [Some(Const::Int(c)), ..],
            ) => {
                let (taken, other) = if *c != 0 { (*a, *b) } else { (*b, *a) };
                // A float next to a triple is broadcast by the operation, so it has to stay.
                if body.kind(taken) == body.kind(other) {
                    Outcome::Same(taken)
                } else {
                    Outcome::Keep(Op::Lane(op, args))
                }
            }
            (LaneOp::INe, [a, _], [_, Some(Const::Int(0))]) if self.is_truth(*a) => Outcome::Same(*a),
            _ => Outcome::Keep(Op::Lane(op, args)),
        }
    }

    /// A component of a triple, taken from the values that compose the triple.
    fn part(&self, op: LaneOp, triple: ValueId) -> Outcome {
        let index = match op {
            LaneOp::X => 0,
            LaneOp::Y => 1,
            _ => 2,
        };
        match (self.constant(triple), self.lane(triple)) {
            (Some(Const::Triple(t)), _) => Outcome::Constant(Const::Float(t[index])),
            (_, Some((LaneOp::Triple, parts))) if parts.len() == 3 => Outcome::Same(parts[index]),
            (_, Some((LaneOp::Splat, [part]))) => Outcome::Same(*part),
            _ => Outcome::Keep(Op::Lane(op, smallvec![triple])),
        }
    }

    /// Whether a value is 0 or 1.
    fn is_truth(&self, value: ValueId) -> bool {
        use LaneOp as L;
        let compares = |op| {
            matches!(
                op,
                L::FLt
                    | L::FLe
                    | L::FGt
                    | L::FGe
                    | L::FEq
                    | L::FNe
                    | L::TEq
                    | L::TNe
                    | L::MEq
                    | L::MNe
                    | L::SEq
                    | L::SNe
                    | L::ILt
                    | L::ILe
                    | L::IGt
                    | L::IGe
                    | L::IEq
                    | L::INe
                    | L::IsNan
                    | L::IsInf
                    | L::IsFinite
            )
        };
        self.lane(value).is_some_and(|(op, _)| compares(op))
            || matches!(self.constant(value), Some(Const::Int(0 | 1)))
    }

    fn kernel(&mut self, kernel: Kernel, args: Values) -> Outcome {
        let name = |at: usize| match args.get(at).and_then(|a| self.constant(*a)) {
            Some(Const::Str(s)) => Some(&**s),
            _ => None,
        };
        match kernel {
            Kernel::NamedNoise { dims, triple, periodic, ref options, has_derivs } => {
                match name(0).and_then(|n| NoiseField::from_name(n, periodic)) {
                    Some(field) => {
                        // Only Gabor noise has options; they follow the coordinates.
                        let words = kernel.coordinates().len() * if periodic { 2 } else { 1 };
                        let mut kept = Values::from_slice(args.get(1..=words).unwrap_or(&[]));
                        kept.extend_from_slice(args.get(1 + words + options.len()..).unwrap_or(&[]));
                        let kernel = Kernel::Noise { field, dims, triple, periodic, has_derivs };
                        Outcome::Keep(Op::Kernel(kernel, kept))
                    }
                    None => Outcome::Keep(Op::Kernel(kernel, args)),
                }
            }
            Kernel::IsConstant if args.first().is_some_and(|a| self.constant(*a).is_some()) => {
                Outcome::Constant(Const::Int(1))
            }
            Kernel::Text(function) => {
                let all: Option<Vec<Const>> = args.iter().map(|a| self.constant(*a).cloned()).collect();
                match all {
                    Some(all) if spend(&self.text, &all) => {
                        let result = function.eval(&all, self.string);
                        spend(&self.text, std::slice::from_ref(&result));
                        Outcome::Constant(result)
                    }
                    _ => Outcome::Keep(Op::Kernel(kernel, args)),
                }
            }
            Kernel::ClosureSum | Kernel::ClosureScale => {
                self.closure(&kernel, &args).unwrap_or(Outcome::Keep(Op::Kernel(kernel, args)))
            }
            kernel => Outcome::Keep(Op::Kernel(kernel, args)),
        }
    }

    /// The result of a sum with a null closure, or of a closure that is null or multiplied by 0 or 1.
    fn closure(&self, kernel: &Kernel, args: &[ValueId]) -> Option<Outcome> {
        let [a, b] = *args else { return None };
        let is_null = |value| matches!(self.constant(value), Some(Const::Null));
        let is = |x: f32| match self.constant(b) {
            Some(Const::Float(by)) => *by == x,
            Some(Const::Triple(by)) => *by == [x; 3],
            _ => false,
        };
        match kernel {
            Kernel::ClosureSum if is_null(a) => Some(Outcome::Same(b)),
            Kernel::ClosureSum if is_null(b) => Some(Outcome::Same(a)),
            Kernel::ClosureScale if is_null(a) || is(0.0) => Some(Outcome::Constant(Const::Null)),
            Kernel::ClosureScale if is(1.0) => Some(Outcome::Same(a)),
            _ => None,
        }
    }

    fn name(&self, value: Option<&ValueId>) -> Option<&std::sync::Arc<str>> {
        match self.constant(*value?)? {
            Const::Str(name) => Some(name),
            _ => None,
        }
    }

    /// Whether a color is converted from a space to itself, with names that are constants of the program as
    /// written: with names that become constant later, it is converted to RGB and back.
    fn is_unconverted(&self, args: &[ValueId]) -> bool {
        let from = self.name(args.first());
        !self.settled && from.is_some() && from == self.name(args.get(1))
    }

    /// A color conversion between known spaces: through RGB by lane operations.
    fn color(
        &mut self,
        body: &mut Body,
        args: Values,
        span: osl_syntax::span::Span,
        kept: &mut Vec<Inst>,
    ) -> Outcome {
        // The number of the RGB system follows the color, if one is set.
        let system = match args.get(3).map(|a| self.constant(*a)) {
            Some(Some(Const::Int(system))) => Some(*system),
            Some(_) => return Outcome::Keep(Op::Kernel(Kernel::ColorBetween, args)),
            None => None,
        };
        let names = self.name(args.first()).zip(self.name(args.get(1)));
        let path = names.and_then(|(from, to)| Path::between(from, to, system));
        let (Some(path), Some(color)) = (path, args.get(2).copied()) else {
            return Outcome::Keep(Op::Kernel(Kernel::ColorBetween, args));
        };
        let mut value = color;
        for (lane, number) in path.steps() {
            let mut operands: Values = smallvec![value];
            let number = number.map(|number| Op::Const(Const::Int(number)));
            operands.extend(number.map(|number| self.add(body, number, Kind::Int, span, kept)));
            value = match self.lane_op(body, lane, operands, span, kept) {
                Outcome::Same(value) => value,
                Outcome::Keep(op) => self.add(body, op, Kind::Triple, span, kept),
                Outcome::Constant(c) => self.add(body, Op::Const(c), Kind::Triple, span, kept),
            };
        }
        Outcome::Same(value)
    }

    fn branch(&mut self, body: &mut Body, inst: Inst, kept: &mut Vec<Inst>) {
        let Op::If { cond, then, otherwise, mut then_yields, mut else_yields } = inst.op else { return };
        if let Some(Const::Int(c)) = self.constant(cond) {
            let (side, yields) = if *c != 0 { (then, then_yields) } else { (otherwise, else_yields) };
            self.block(body, side);
            kept.append(&mut body.blocks[side.index()].insts);
            for (result, value) in inst.results.iter().zip(yields) {
                let value = self.renaming.get(value);
                self.renaming.set(*result, value);
            }
            return;
        }
        self.block(body, then);
        self.block(body, otherwise);
        then_yields.iter_mut().chain(&mut else_yields).for_each(|v| *v = self.renaming.get(*v));
        let mut results = Values::new();
        let (mut a_kept, mut b_kept) = (Values::new(), Values::new());
        let mut truths = Vec::new();
        for ((result, a), b) in inst.results.into_iter().zip(then_yields).zip(else_yields) {
            if a == b {
                self.renaming.set(result, a);
            } else if matches!(
                (self.constant(a), self.constant(b)),
                (Some(Const::Int(1)), Some(Const::Int(0)))
            ) {
                truths.push(result);
            } else {
                results.push(result);
                a_kept.push(a);
                b_kept.push(b);
            }
        }
        // A choice between 1 and 0 is the condition itself.
        for result in truths {
            let truth = if self.is_truth(cond) {
                cond
            } else {
                let zero = self.add(body, Op::Const(Const::Int(0)), Kind::Int, inst.span, kept);
                self.add(body, Op::Lane(LaneOp::INe, smallvec![cond, zero]), Kind::Int, inst.span, kept)
            };
            self.renaming.set(result, truth);
        }
        let op = Op::If { cond, then, otherwise, then_yields: a_kept, else_yields: b_kept };
        kept.push(Inst { op, results, span: inst.span });
    }

    fn round(&mut self, body: &mut Body, inst: Inst, kept: &mut Vec<Inst>) {
        let Op::Loop { init, params, body: inner, cond, next } = inst.op else { return };
        // A parameter that no iteration changes is its first value.
        let mut keep = vec![true; params.len()];
        for (index, (param, next)) in params.iter().zip(&next).enumerate() {
            if param == next {
                let first = self.renaming.get(init[index]);
                self.renaming.set(*param, first);
                self.renaming.set(inst.results[index], first);
                keep[index] = false;
            }
        }
        self.block(body, inner);
        let pick = |list: Values, f: &Self| -> Values {
            list.into_iter().zip(&keep).filter(|(_, k)| **k).map(|(v, _)| f.renaming.get(v)).collect()
        };
        let (init, next, cond) = (pick(init, self), pick(next, self), self.renaming.get(cond));
        let params: Values = params.into_iter().zip(&keep).filter(|(_, k)| **k).map(|(v, _)| v).collect();
        let results: Values =
            inst.results.into_iter().zip(&keep).filter(|(_, k)| **k).map(|(v, _)| v).collect();
        if matches!(self.constant(cond), Some(Const::Int(0))) {
            // A single iteration: the parameters are copies of their first values.
            self.unroll_once(body, inner, (&params, &init), (&results, &next), kept);
            return;
        }
        kept.push(Inst { op: Op::Loop { init, params, body: inner, cond, next }, results, span: inst.span });
    }

    fn unroll_once(
        &mut self,
        body: &mut Body,
        inner: BlockId,
        (params, init): (&[ValueId], &[ValueId]),
        (results, next): (&[ValueId], &[ValueId]),
        kept: &mut Vec<Inst>,
    ) {
        for (param, first) in params.iter().zip(init) {
            self.renaming.set(*param, *first);
        }
        // The body is folded again, now with the first values in place of the parameters.
        self.block(body, inner);
        kept.append(&mut body.blocks[inner.index()].insts);
        for (result, last) in results.iter().zip(next) {
            let last = self.renaming.get(*last);
            self.renaming.set(*result, last);
        }
    }
}

/// Subtracts the bytes of the strings among some constants from the budget; false if it is used up.
fn spend(left: &Cell<u64>, constants: &[Const]) -> bool {
    let text = |c: &Const| if let Const::Str(text) = c { text.len() as u64 } else { 0 };
    let bytes: u64 = constants.iter().map(text).sum();
    let enough = bytes == 0 || bytes <= left.get();
    left.set(left.get().saturating_sub(bytes));
    enough
}

/// Whether any component of a constant divisor is nonzero: the reference then divides without a guard.
fn is_some_divisor(c: &Const) -> bool {
    match c {
        Const::Float(x) => *x != 0.0,
        Const::Triple(t) => t.iter().any(|x| *x != 0.0),
        _ => false,
    }
}
