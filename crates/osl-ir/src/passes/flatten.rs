//! Turns small branches into selections: if both sides are a few cheap operations, computing both and
//! choosing is faster than masks. Needs the rates, since a uniform condition is better handled by a branch.

use crate::ir::{BlockId, Body, Inst, Kernel, Kind, NoiseField, Op, Rate, ValueId};
use smallvec::smallvec;

/// Maximum number of operations of both sides together.
const MAX_OPERATIONS: usize = 40;
/// The cost of a hash of coordinates. Points of a cell mostly share it.
const HASH: usize = 8;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    block(body, body.entry);
}

fn block(body: &mut Body, id: BlockId) {
    let insts = std::mem::take(&mut body.blocks[id.index()].insts);
    let mut kept = Vec::with_capacity(insts.len());
    for inst in insts {
        match inst.op {
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                block(body, then);
                block(body, otherwise);
                if body.value(cond).rate == Rate::Varying && is_cheap(body, then, otherwise) {
                    kept.append(&mut body.blocks[then.index()].insts);
                    kept.append(&mut body.blocks[otherwise.index()].insts);
                    for ((r, a), b) in inst.results.iter().zip(&then_yields).zip(&else_yields) {
                        kept.push(Inst {
                            op: choose(body, cond, *a, *b),
                            results: smallvec![*r],
                            span: inst.span,
                        });
                    }
                } else {
                    let op = Op::If { cond, then, otherwise, then_yields, else_yields };
                    kept.push(Inst { op, ..inst });
                }
            }
            Op::Loop { body: inner, .. } => {
                block(body, inner);
                kept.push(inst);
            }
            _ => kept.push(inst),
        }
    }
    body.blocks[id.index()].insts = kept;
}

fn choose(body: &Body, cond: ValueId, a: ValueId, b: ValueId) -> Op {
    let op = crate::ir::choose_op(body.kind(a));
    Op::Lane(op, smallvec![cond, a, b])
}

fn is_cheap(body: &Body, then: BlockId, otherwise: BlockId) -> bool {
    let mut operations = 0;
    let all = body.block(then).insts.iter().chain(&body.block(otherwise).insts);
    for inst in all {
        match &inst.op {
            Op::Const(_) | Op::Input(_) => {}
            Op::Lane(op, args) => {
                operations += op.cost().additions()
                    * if args.iter().any(|a| body.kind(*a) == Kind::Triple) { 3 } else { 1 };
            }
            Op::Kernel(Kernel::Noise { field: NoiseField::Cell | NoiseField::Hash, .. }, _) => {
                operations += HASH;
            }
            _ => return false,
        }
        if operations > MAX_OPERATIONS {
            return false;
        }
    }
    true
}
