//! Unrolls loops with a few iterations whose number is known at compile time.
//!
//! Their counters are then constants, which folding propagates: conditions, offsets and indices vanish, and
//! so do the copies that a running loop makes. Inner loops go first. The number of iterations is found by
//! executing the loop on constants; if a condition depends on anything else, the loop stays.
//!
//! The bounds of a search over neighbours, `i0 - 1` to `i0 + 1`, differ from point to point, but the number
//! of rounds does not. So an int that comes from a float counts as known except for a constant: sums of it
//! and small constants compare like the constants. This holds because no float converts to an int near the
//! ends of the range, except to the least int, which stands for NaN and large floats. At points with this
//! value the loop must end in its first round, and they keep the values from before it.

use super::Renaming;
use crate::ir::{Block, BlockId, Body, Const, Inst, Kernel, LaneOp, Op, ValueId, Values, choose_op};
use rustc_hash::FxHashMap;
use smallvec::smallvec;

/// Rounds that a loop may have to be unrolled. Like the next constant, a choice of the optimizer, no limit.
const MAX_ROUNDS: usize = 64;
/// Maximum number of instructions in all unrolled loops together.
const MAX_GROWTH: usize = 8192;

/// Maximum magnitude of the constant in a sum. Ints that come from floats have at least this distance from
/// both ends of their range, unless they are the least int.
const MAX_OFFSET: i32 = 127;

/// Runs the pass. Returns whether anything changed. `exact`: only results that double precision has too count
/// as constants.
pub(super) fn run(body: &mut Body, exact: bool) -> bool {
    let known = body.constants().map(|(v, value)| (v, value.clone())).collect();
    let mut unroll = Unroll {
        known,
        sums: FxHashMap::default(),
        renaming: Renaming::default(),
        left: MAX_GROWTH,
        changed: false,
        exact,
    };
    unroll.block(body, body.entry);
    if unroll.changed {
        let renaming = unroll.renaming;
        for inst in body.blocks.iter_mut().flat_map(|b| &mut b.insts) {
            inst.op.replace_uses(|v| renaming.get(v));
        }
        super::fold::rename_outputs(body, &renaming);
    }
    unroll.changed
}

/// What is known of a value.
#[derive(Clone, Debug, PartialEq)]
enum Known {
    Const(Const),
    /// The sum of an int that comes from a float, and of a constant.
    Sum(ValueId, i32),
}

/// The known values of an iteration.
type Iteration = FxHashMap<ValueId, Known>;

/// An int that comes from a float, and the results of a loop where it is the least int; none if these are no
/// special case.
type Shift = (ValueId, Values);

struct Unroll {
    /// Values that are constants.
    known: FxHashMap<ValueId, Const>,
    /// Values that are sums and are computed before the current instruction.
    sums: FxHashMap<ValueId, (ValueId, i32)>,
    /// The replacements of the results of unrolled loops.
    renaming: Renaming,
    /// Number of instructions that may still be written.
    left: usize,
    changed: bool,
    /// Whether only results that double precision has too count as constants.
    exact: bool,
}

impl Unroll {
    fn block(&mut self, body: &mut Body, id: BlockId) {
        let insts = std::mem::take(&mut body.blocks[id.index()].insts);
        let mut kept = Vec::with_capacity(insts.len());
        for inst in insts {
            match &inst.op {
                Op::If { then, otherwise, .. } => {
                    let (then, otherwise) = (*then, *otherwise);
                    self.block(body, then);
                    self.block(body, otherwise);
                    kept.push(inst);
                }
                Op::Loop { body: inner, .. } => {
                    let inner = *inner;
                    // What a loop computes differs from iteration to iteration.
                    let outer = self.sums.clone();
                    self.block(body, inner);
                    self.sums = outer;
                    self.round(body, inst, &mut kept);
                }
                _ => {
                    self.note(&inst);
                    kept.push(inst);
                }
            }
        }
        body.blocks[id.index()].insts = kept;
    }

    /// Notes what is known of the result of an instruction.
    fn note(&mut self, inst: &Inst) {
        let Some(result) = inst.results.first() else { return };
        match &inst.op {
            Op::Const(value) => _ = self.known.insert(*result, value.clone()),
            Op::Lane(LaneOp::ToInt, _) if !self.exact => _ = self.sums.insert(*result, (*result, 0)),
            Op::Lane(op @ (LaneOp::IAdd | LaneOp::ISub), args) => {
                let base = args.iter().find_map(|v| self.sums.get(v)).map(|(base, _)| *base);
                if base.is_some()
                    && let Some(Known::Sum(base, offset)) = self.lane(*op, args, &Iteration::default(), base)
                {
                    self.sums.insert(*result, (base, offset));
                }
            }
            _ => {}
        }
    }

    fn round(&mut self, body: &mut Body, inst: Inst, kept: &mut Vec<Inst>) {
        let Op::Loop { init, params, body: inner, next, .. } = &inst.op else { return };
        let size = body.insts_from(*inner).count();
        // A loop that would not fit is not executed either.
        let most = (self.left / size.max(1)).min(MAX_ROUNDS);
        let rounds = self.rounds(body, &inst, most, None).map(|rounds| (rounds, None));
        let Some((rounds, least)) = rounds
            .or_else(|| self.shifted_rounds(body, &inst, most).map(|(rounds, shift)| (rounds, Some(shift))))
        else {
            kept.push(inst);
            return;
        };
        self.left -= size * rounds.len();
        self.changed = true;
        let mut current: Values = init.iter().map(|v| self.renaming.get(*v)).collect();
        for round in &rounds {
            let mut copy = Copy {
                map: params.iter().copied().zip(current).collect(),
                renaming: &self.renaming,
                sums: least.is_some().then_some(round),
            };
            let insts = copy.insts(body, *inner);
            current = next.iter().map(|v| copy.value(*v)).collect();
            insts.iter().for_each(|inst| self.note(inst));
            kept.extend(insts);
        }
        if let Some((base, before)) = least.filter(|(_, before)| !before.is_empty()) {
            let mut push = |body: &mut Body, op: Op, like: ValueId| {
                let value = define(body, like);
                kept.push(Inst { op, results: smallvec![value], span: inst.span });
                value
            };
            let least = push(body, Op::Const(Const::Int(i32::MIN)), base);
            let is_least = push(body, Op::Lane(LaneOp::IEq, smallvec![base, least]), base);
            for (now, before) in current.iter_mut().zip(before) {
                let op = choose_op(body.kind(*now));
                *now = push(body, Op::Lane(op, smallvec![is_least, before, *now]), *now);
            }
        }
        for (result, value) in inst.results.iter().zip(current) {
            self.renaming.set(*result, value);
        }
    }

    /// The known values of the iterations of a loop; `None` if constants do not determine their number, or if
    /// it exceeds `most`. Sums with the int `base` count as known.
    fn rounds(&self, body: &Body, inst: &Inst, most: usize, base: Option<ValueId>) -> Option<Vec<Iteration>> {
        let Op::Loop { init, params, body: inner, cond, next } = &inst.op else { return None };
        let mut current: Vec<_> = init.iter().map(|v| self.value(*v, &Iteration::default(), base)).collect();
        let mut rounds = Vec::new();
        while rounds.len() < most {
            let mut values = Iteration::default();
            for (param, value) in params.iter().zip(current) {
                values.extend(value.map(|value| (*param, value)));
            }
            self.evaluate(body, *inner, &mut values, base);
            let goes_on = self.value(*cond, &values, base)?;
            current = next.iter().map(|v| self.value(*v, &values, base)).collect();
            rounds.push(values);
            match goes_on {
                Known::Const(Const::Int(0)) => return Some(rounds),
                Known::Const(Const::Int(_)) => {}
                _ => return None,
            }
        }
        None
    }

    /// The iterations of a loop over small offsets from an int that comes from a float.
    fn shifted_rounds(&mut self, body: &Body, inst: &Inst, most: usize) -> Option<(Vec<Iteration>, Shift)> {
        let Op::Loop { init, params, body: inner, next, .. } = &inst.op else { return None };
        if self.sums.is_empty() || !is_pure(body, *inner) {
            return None;
        }
        let of = |v: &ValueId| self.sums.get(&self.renaming.get(*v)).map(|(base, _)| *base);
        let (base, rounds) = init
            .iter()
            .filter_map(of)
            .find_map(|base| Some((base, self.rounds(body, inst, most, Some(base))?)))?;
        // The rounds where it is the least int.
        let sums = std::mem::take(&mut self.sums);
        for (value, (_, offset)) in sums.iter().filter(|(_, (of, _))| *of == base) {
            self.known.insert(*value, Const::Int(i32::MIN.wrapping_add(*offset)));
        }
        let least = self.rounds(body, inst, most, None);
        sums.keys().for_each(|value| _ = self.known.remove(value));
        self.sums = sums;
        let least = least?;
        let alike = |(all, one): (&Iteration, &Iteration)| {
            all.iter().all(|(v, known)| matches!(known, Known::Sum(..)) || one.get(v) == Some(known))
        };
        if least.len() == rounds.len() && rounds.iter().zip(&least).all(alike) {
            return Some((rounds, (base, Values::new())));
        }
        let [first] = &least[..] else { return None };
        let unchanged = |v: &ValueId| {
            let param = self.chosen(body, *inner, *v, first);
            let at = params.iter().position(|own| *own == param)?;
            init.get(at).map(|v| self.renaming.get(*v))
        };
        let before: Values = next.iter().map(unchanged).collect::<Option<_>>()?;
        Some((rounds, (base, before)))
    }

    /// The value that known conditions choose for a value.
    fn chosen(&self, body: &Body, id: BlockId, v: ValueId, values: &Iteration) -> ValueId {
        for inst in &body.block(id).insts {
            let Some(at) = inst.results.iter().position(|result| *result == v) else { continue };
            let Op::If { cond, then, otherwise, then_yields, else_yields } = &inst.op else { return v };
            let Some(Known::Const(Const::Int(c))) = self.value(*cond, values, None) else { return v };
            let (side, yields) = if c != 0 { (then, then_yields) } else { (otherwise, else_yields) };
            return yields.get(at).map_or(v, |v| self.chosen(body, *side, *v, values));
        }
        v
    }

    fn value(&self, v: ValueId, values: &Iteration, base: Option<ValueId>) -> Option<Known> {
        let v = self.renaming.get(v);
        let known = values.get(&v).cloned().or_else(|| self.known.get(&v).cloned().map(Known::Const));
        let sum = || self.sums.get(&v).filter(|(of, _)| Some(*of) == base);
        known.or_else(|| sum().map(|(base, offset)| Known::Sum(*base, *offset)))
    }

    /// What is known of the result of a lane operation.
    fn lane(&self, op: LaneOp, args: &Values, values: &Iteration, base: Option<ValueId>) -> Option<Known> {
        let args: Vec<Known> = args.iter().map(|a| self.value(*a, values, base)).collect::<Option<_>>()?;
        let small = |n: i32| (-MAX_OFFSET..=MAX_OFFSET).contains(&n);
        match (op, &args[..]) {
            (LaneOp::IAdd, [Known::Sum(base, a), Known::Const(Const::Int(b))])
            | (LaneOp::IAdd, [Known::Const(Const::Int(a)), Known::Sum(base, b)]) => {
                a.checked_add(*b).filter(|sum| small(*sum)).map(|sum| Known::Sum(*base, sum))
            }
            (LaneOp::ISub, [Known::Sum(base, a), Known::Const(Const::Int(b))]) => {
                a.checked_sub(*b).filter(|sum| small(*sum)).map(|sum| Known::Sum(*base, sum))
            }
            (
                LaneOp::ISub
                | LaneOp::ILt
                | LaneOp::ILe
                | LaneOp::IGt
                | LaneOp::IGe
                | LaneOp::IEq
                | LaneOp::INe,
                [Known::Sum(one, a), Known::Sum(other, b)],
            ) if one == other => op.eval(&[Const::Int(*a), Const::Int(*b)]).map(Known::Const),
            _ => {
                let constant = |known| if let Known::Const(value) = known { Some(value) } else { None };
                let args: Vec<Const> = args.into_iter().map(constant).collect::<Option<_>>()?;
                let value = if self.exact { op.eval_exactly(&args) } else { op.eval(&args) };
                value.map(Known::Const)
            }
        }
    }

    /// Computes what is known of the values of a block.
    fn evaluate(&self, body: &Body, id: BlockId, values: &mut Iteration, base: Option<ValueId>) {
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::Lane(op, args) => {
                    let known = self.lane(*op, args, values, base);
                    values.extend(inst.results.first().copied().zip(known));
                }
                Op::If { cond, then, otherwise, then_yields, else_yields } => {
                    let Some(Known::Const(Const::Int(c))) = self.value(*cond, values, base) else { continue };
                    let (side, yields) = if c != 0 { (then, then_yields) } else { (otherwise, else_yields) };
                    self.evaluate(body, *side, values, base);
                    for (result, value) in inst.results.iter().zip(yields) {
                        values.extend(self.value(*value, values, base).map(|value| (*result, value)));
                    }
                }
                _ => {}
            }
        }
    }
}

/// Whether a block only computes values, so that points may run it in vain.
fn is_pure(body: &Body, id: BlockId) -> bool {
    body.block(id).insts.iter().all(|inst| match &inst.op {
        Op::If { then, otherwise, .. } => is_pure(body, *then) && is_pure(body, *otherwise),
        Op::Kernel(kernel, _) => matches!(kernel, Kernel::Noise { .. } | Kernel::Hash),
        Op::Loop { .. } | Op::Store(..) | Op::StoreElement(..) => false,
        _ => true,
    })
}

/// A new value of the kind of another one.
fn define(body: &mut Body, like: ValueId) -> ValueId {
    let value = body.value(like).clone();
    body.values.push(value);
    ValueId(body.values.len() as u32 - 1)
}

/// Copies a block with new values.
struct Copy<'a> {
    map: FxHashMap<ValueId, ValueId>,
    renaming: &'a Renaming,
    /// Known values, which replace the operations that compute them.
    sums: Option<&'a Iteration>,
}

impl Copy<'_> {
    fn value(&self, v: ValueId) -> ValueId {
        let v = self.renaming.get(v);
        self.map.get(&v).copied().unwrap_or(v)
    }

    fn define(&mut self, body: &mut Body, v: ValueId) -> ValueId {
        let copy = define(body, v);
        self.map.insert(v, copy);
        copy
    }

    fn insts(&mut self, body: &mut Body, id: BlockId) -> Vec<Inst> {
        let insts = body.block(id).insts.clone();
        let mut copies = Vec::with_capacity(insts.len());
        for mut inst in insts {
            if let (Op::Lane(..), Some(result)) = (&inst.op, inst.results.first().copied()) {
                match self.sums.and_then(|sums| sums.get(&result)) {
                    Some(Known::Const(value)) => inst.op = Op::Const(value.clone()),
                    Some(Known::Sum(base, 0)) => {
                        self.map.insert(result, *base);
                        continue;
                    }
                    Some(Known::Sum(base, offset)) => {
                        let constant = define(body, result);
                        let op = Op::Const(Const::Int(*offset));
                        copies.push(Inst { op, results: smallvec![constant], span: inst.span });
                        inst.op = Op::Lane(LaneOp::IAdd, smallvec![*base, constant]);
                    }
                    None => {}
                }
            }
            copies.push(self.inst(body, inst));
        }
        copies
    }

    fn inst(&mut self, body: &mut Body, mut inst: Inst) -> Inst {
        // Yields and the values of the next iteration are defined inside, so the blocks go first.
        match &mut inst.op {
            Op::If { then, otherwise, .. } => {
                *then = self.block(body, *then);
                *otherwise = self.block(body, *otherwise);
            }
            Op::Loop { params, body: inner, .. } => {
                params.iter_mut().for_each(|p| *p = self.define(body, *p));
                *inner = self.block(body, *inner);
            }
            _ => {}
        }
        inst.op.replace_uses(|v| self.value(v));
        inst.results = inst.results.iter().map(|r| self.define(body, *r)).collect();
        inst
    }

    fn block(&mut self, body: &mut Body, id: BlockId) -> BlockId {
        let insts = self.insts(body, id);
        body.blocks.push(Block { insts });
        BlockId(body.blocks.len() as u32 - 1)
    }
}
