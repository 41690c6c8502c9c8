//! The results of rays if the renderer does not trace any: no hits.

use crate::ir::{Body, Const, Inst, Kernel, Op};

/// Replaces the results by constants.
pub(super) fn run(body: &mut Body) {
    let is_ray = |inst: &Inst| matches!(inst.op, Op::Kernel(Kernel::Trace | Kernel::SourceMessage { .. }, _));
    for at in 0..body.blocks.len() {
        let Some(block) = body.blocks.get_mut(at).filter(|block| block.insts.iter().any(is_ray)) else {
            continue;
        };
        let insts = std::mem::take(&mut block.insts);
        let mut kept = Vec::with_capacity(insts.len() + 4);
        for inst in insts {
            if !is_ray(&inst) {
                kept.push(inst);
                continue;
            }
            for result in &inst.results {
                let op = Op::Const(Const::zero(body.kind(*result)));
                kept.push(Inst { op, results: [*result].into_iter().collect(), span: inst.span });
            }
        }
        if let Some(block) = body.blocks.get_mut(at) {
            block.insts = kept;
        }
    }
}
