//! The cost of a program, without a clock: the costs that the table of operations states, in additions.
//!
//! A call that needs more than a lane's arithmetic (noise, textures) counts as [`CALL`] additions, the body
//! of a loop as [`ROUNDS`] times its own, since neither is known beforehand. This module must not know what
//! the cost is used for.

use osl_ir::ir::{BlockId, Body, Kind, Op};

/// The cost of a call of noise, a texture and the like.
const CALL: f64 = 50.0;
/// Assumed number of rounds of a loop.
const ROUNDS: f64 = 16.0;

/// The cost of a body after the passes.
pub(crate) fn cost(body: &Body) -> f64 {
    block(body, body.entry)
}

fn block(body: &Body, id: BlockId) -> f64 {
    body.block(id)
        .insts
        .iter()
        .map(|inst| match &inst.op {
            Op::Lane(op, _) => {
                let is_triple = inst.results.first().is_some_and(|v| body.kind(*v) == Kind::Triple);
                let lanes = if is_triple && op.shape().per_component { 3.0 } else { 1.0 };
                lanes * op.cost().additions() as f64
            }
            Op::Kernel(kernel, _) => {
                if matches!(kernel, osl_ir::ir::Kernel::Note { .. }) {
                    0.0
                } else {
                    CALL
                }
            }
            Op::If { then, otherwise, .. } => 1.0 + block(body, *then) + block(body, *otherwise),
            Op::Loop { body: inner, .. } => ROUNDS * block(body, *inner),
            Op::LoadElement(..) | Op::StoreElement(..) => 1.0,
            _ => 0.0,
        })
        .sum()
}
