//! Fuses a product with the sum that alone uses it. Where a choice would discard one of two distances, only
//! the other one is computed (`choices`).
//!
//! One operation less saves writing and reading a register. The arithmetic determines the number of
//! roundings: the strict one still rounds product and sum, so no bit changes. Needs the rates, and runs after
//! the pass that finds shared work, so that a shared product does not become part of a sum that is not
//! shared.

mod choices;

use crate::ir::{BlockId, Body, LaneOp, Op, Source, ValueId};
use rustc_hash::FxHashMap;
use smallvec::smallvec;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    if choices::run(body) {
        super::dce::run(body);
    }
    let uses = uses(body);
    let mut changed = false;
    for block in 0..body.blocks.len() {
        changed |= fuse(body, BlockId(block as u32), &uses);
    }
    if changed {
        super::dce::run(body);
    }
}

/// Number of uses of each value.
fn uses(body: &Body) -> Vec<u32> {
    let mut uses = vec![0; body.values.len()];
    let mut read = |v: ValueId| uses[v.index()] += 1;
    for inst in body.insts() {
        inst.op.for_each_use(&mut read);
    }
    for output in &body.outputs {
        if let Source::Value(v) = output.source {
            read(v);
        }
    }
    uses
}

/// Fuses within a block. Returns whether anything changed.
fn fuse(body: &mut Body, id: BlockId, uses: &[u32]) -> bool {
    let mut insts = std::mem::take(&mut body.blocks[id.index()].insts);
    let mut products: FxHashMap<ValueId, (ValueId, ValueId)> = FxHashMap::default();
    let mut changed = false;
    for inst in &mut insts {
        let (Op::Lane(op, args), [result]) = (&mut inst.op, &inst.results[..]) else { continue };
        let product = |v: &ValueId| {
            let once = uses.get(v.index()) == Some(&1) && body.value(*v).rate == body.value(*result).rate;
            products.get(v).copied().filter(|_| once)
        };
        match (*op, &args[..]) {
            (LaneOp::FMul, [a, b]) => {
                products.insert(*result, (*a, *b));
            }
            (LaneOp::FAdd, [x, y]) => {
                let found = product(x).map(|p| (p, *y)).or_else(|| product(y).map(|p| (p, *x)));
                let Some(((a, b), c)) = found else { continue };
                (*op, *args) = (LaneOp::FMulAdd, smallvec![a, b, c]);
                changed = true;
            }
            (LaneOp::FSub, [c, y]) => {
                let Some((a, b)) = product(y) else { continue };
                (*op, *args) = (LaneOp::FMulSub, smallvec![a, b, *c]);
                changed = true;
            }
            _ => {}
        }
    }
    body.blocks[id.index()].insts = insts;
    changed
}
