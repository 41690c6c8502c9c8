//! The cost of a program, without a clock: the costs that the table of operations states, in additions.
//!
//! A call that needs more than a lane's arithmetic (noise, textures) counts as [`CALL`] additions, the body
//! of a loop as [`ROUNDS`] times its own, since neither is known beforehand.

use osl_ir::ir::{BlockId, Body, Inst, Kernel, Kind, Op};

/// The cost of a call of noise and the like, and what a lookup in a texture or a value of Gabor noise costs
/// more.
const CALL: f64 = 50.0;
const LOOKUP: f64 = 1500.0;
/// Assumed number of rounds of a loop.
pub(crate) const ROUNDS: f64 = 16.0;

/// The cost of a body after the passes.
pub(crate) fn cost(body: &Body) -> f64 {
    let mut sum = 0.0;
    each(body, &mut |_, cost| sum += cost);
    sum
}

/// Calls a function with the cost of each instruction, without that of nested ones.
pub(crate) fn each(body: &Body, told: &mut dyn FnMut(&Inst, f64)) {
    block(body, body.entry, 1.0, told);
}

fn block(body: &Body, id: BlockId, times: f64, told: &mut dyn FnMut(&Inst, f64)) {
    for inst in &body.block(id).insts {
        let own = match &inst.op {
            Op::Lane(op, _) => {
                let is_triple = inst.results.first().is_some_and(|v| body.kind(*v) == Kind::Triple);
                let lanes = if is_triple && op.shape().per_component { 3.0 } else { 1.0 };
                lanes * op.cost().additions() as f64
            }
            Op::Kernel(Kernel::Note { .. }, _) => 0.0,
            Op::Kernel(
                Kernel::NamedNoise { .. }
                | Kernel::Texture { .. }
                | Kernel::Environment { .. }
                | Kernel::Volume { .. },
                _,
            ) => CALL + LOOKUP,
            Op::Kernel(..) => CALL,
            Op::If { .. } | Op::LoadElement(..) | Op::StoreElement(..) => 1.0,
            _ => 0.0,
        };
        told(inst, times * own);
        let times = if matches!(inst.op, Op::Loop { .. }) { times * ROUNDS } else { times };
        inst.op.blocks().for_each(|id| block(body, id, times, told));
    }
}
