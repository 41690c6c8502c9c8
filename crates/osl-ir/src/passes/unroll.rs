//! Unrolls loops with a few iterations whose number is known at compile time.
//!
//! Their counters are then constants, which folding propagates: conditions, offsets and indices vanish, and
//! so do the copies that a running loop makes. Inner loops go first. The number of iterations is found by
//! executing the loop on constants; if a condition depends on anything else, the loop stays.

use super::Renaming;
use crate::ir::{Block, BlockId, Body, Const, Inst, Op, ValueId, Values};
use rustc_hash::FxHashMap;

/// Rounds that a loop may have to be unrolled. Like the next constant, a choice of the optimizer, no limit.
const MAX_ROUNDS: usize = 64;
/// Maximum number of instructions in all unrolled loops together.
const MAX_GROWTH: usize = 8192;

/// Runs the pass. Returns whether anything changed. `exact`: only results that double precision has too count
/// as constants.
pub(super) fn run(body: &mut Body, exact: bool) -> bool {
    let known = body.constants().map(|(v, value)| (v, value.clone())).collect();
    let mut unroll = Unroll { known, renaming: Renaming::default(), left: MAX_GROWTH, changed: false, exact };
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

struct Unroll {
    /// Values that are constants.
    known: FxHashMap<ValueId, Const>,
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
                    self.block(body, inner);
                    self.round(body, inst, &mut kept);
                }
                _ => kept.push(inst),
            }
        }
        body.blocks[id.index()].insts = kept;
    }

    fn round(&mut self, body: &mut Body, inst: Inst, kept: &mut Vec<Inst>) {
        let Op::Loop { init, params, body: inner, next, .. } = &inst.op else { return };
        let size = size(body, *inner);
        // A loop that would not fit is not executed either.
        let most = self.left / size.max(1);
        let Some(rounds) = self.rounds(body, &inst, most.min(MAX_ROUNDS)) else {
            kept.push(inst);
            return;
        };
        self.left -= size * rounds;
        self.changed = true;
        let mut current: Values = init.iter().map(|v| self.renaming.get(*v)).collect();
        for _ in 0..rounds {
            let mut copy =
                Copy { map: params.iter().copied().zip(current).collect(), renaming: &self.renaming };
            let insts = copy.insts(body, *inner);
            current = next.iter().map(|v| copy.value(*v)).collect();
            for inst in &insts {
                if let (Op::Const(value), Some(result)) = (&inst.op, inst.results.first()) {
                    self.known.insert(*result, value.clone());
                }
            }
            kept.extend(insts);
        }
        for (result, value) in inst.results.iter().zip(current) {
            self.renaming.set(*result, value);
        }
    }

    /// The number of iterations of a loop; `None` if constants do not determine it, or if it exceeds `most`.
    fn rounds(&self, body: &Body, inst: &Inst, most: usize) -> Option<usize> {
        let Op::Loop { init, params, body: inner, cond, next } = &inst.op else { return None };
        let first = |v: &ValueId| self.known.get(&self.renaming.get(*v)).cloned();
        let mut current: Vec<Option<Const>> = init.iter().map(first).collect();
        for round in 1..=most {
            let mut values: FxHashMap<ValueId, Const> = FxHashMap::default();
            for (param, value) in params.iter().zip(current) {
                value.into_iter().for_each(|value| {
                    values.insert(*param, value);
                });
            }
            self.evaluate(body, *inner, &mut values);
            let value = |v: &ValueId| self.value(*v, &values);
            match value(cond)? {
                Const::Int(0) => return Some(round),
                Const::Int(_) => {}
                _ => return None,
            }
            current = next.iter().map(value).collect();
        }
        None
    }

    fn value(&self, v: ValueId, values: &FxHashMap<ValueId, Const>) -> Option<Const> {
        let v = self.renaming.get(v);
        values.get(&v).or_else(|| self.known.get(&v)).cloned()
    }

    /// Computes the constants of a block, as far as possible.
    fn evaluate(&self, body: &Body, id: BlockId, values: &mut FxHashMap<ValueId, Const>) {
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::Lane(op, args) => {
                    let args: Option<Vec<Const>> = args.iter().map(|a| self.value(*a, values)).collect();
                    if let (Some(result), Some(value)) = (
                        inst.results.first(),
                        args.and_then(
                            |args| if self.exact { op.eval_exactly(&args) } else { op.eval(&args) },
                        ),
                    ) {
                        values.insert(*result, value);
                    }
                }
                Op::If { cond, then, otherwise, then_yields, else_yields } => {
                    let Some(Const::Int(c)) = self.value(*cond, values) else { continue };
                    let (side, yields) = if c != 0 { (then, then_yields) } else { (otherwise, else_yields) };
                    self.evaluate(body, *side, values);
                    for (result, value) in inst.results.iter().zip(yields) {
                        if let Some(value) = self.value(*value, values) {
                            values.insert(*result, value);
                        }
                    }
                }
                _ => {}
            }
        }
    }
}

/// Number of instructions of a block, including nested ones.
fn size(body: &Body, id: BlockId) -> usize {
    let nested = |inst: &Inst| match &inst.op {
        Op::If { then, otherwise, .. } => size(body, *then) + size(body, *otherwise),
        Op::Loop { body: inner, .. } => size(body, *inner),
        _ => 0,
    };
    body.block(id).insts.iter().map(|inst| 1 + nested(inst)).sum()
}

/// Copies a block with new values.
struct Copy<'a> {
    map: FxHashMap<ValueId, ValueId>,
    renaming: &'a Renaming,
}

impl Copy<'_> {
    fn value(&self, v: ValueId) -> ValueId {
        let v = self.renaming.get(v);
        self.map.get(&v).copied().unwrap_or(v)
    }

    fn define(&mut self, body: &mut Body, v: ValueId) -> ValueId {
        let value = body.value(v).clone();
        body.values.push(value);
        let copy = ValueId(body.values.len() as u32 - 1);
        self.map.insert(v, copy);
        copy
    }

    fn insts(&mut self, body: &mut Body, id: BlockId) -> Vec<Inst> {
        let insts = body.block(id).insts.clone();
        insts.into_iter().map(|inst| self.inst(body, inst)).collect()
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
