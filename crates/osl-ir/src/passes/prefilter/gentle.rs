//! Finds values that reach the outputs only through smooth functions, sums and choices, so that their mean is
//! useful.

use crate::ir::{BlockId, Body, Continuity, Derivative, Kernel, LaneOp, Op, ValueId};

/// For each value, whether it does.
pub(super) fn find(body: &Body) -> Vec<bool> {
    let mut gentle = vec![true; body.values.len()];
    loop {
        let before = gentle.iter().filter(|g| **g).count();
        block(body, body.entry, &mut gentle);
        if gentle.iter().filter(|g| **g).count() == before {
            return gentle;
        }
    }
}

fn block(body: &Body, id: BlockId, gentle: &mut [bool]) {
    // From the last use to the first, since an operation that is not smooth affects the values from which it
    // is computed.
    for inst in body.block(id).insts.iter().rev() {
        let smooth = |gentle: &[bool]| inst.results.iter().all(|r| has(gentle, *r));
        match &inst.op {
            Op::Lane(LaneOp::Choose, args) => {
                if !smooth(gentle) {
                    args.iter().skip(1).for_each(|v| clear(gentle, *v));
                }
            }
            Op::Lane(op, args) => {
                let rough = op.continuity() != Continuity::Smooth || op.derivative() == Derivative::None;
                if rough || !smooth(gentle) {
                    args.iter().for_each(|v| clear(gentle, *v));
                }
            }
            Op::Kernel(Kernel::Component { .. } | Kernel::ClosureScale | Kernel::ClosureSum, _) => {}
            Op::Derivative(v, _) => {
                if !smooth(gentle) {
                    clear(gentle, *v);
                }
            }
            Op::If { then, otherwise, then_yields, else_yields, .. } => {
                for ((result, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                    if !has(gentle, *result) {
                        clear(gentle, *a);
                        clear(gentle, *b);
                    }
                }
                block(body, *then, gentle);
                block(body, *otherwise, gentle);
            }
            Op::Loop { init, params, body: inner, next, .. } => {
                for (((result, param), first), again) in inst.results.iter().zip(params).zip(init).zip(next) {
                    if !has(gentle, *result) || !has(gentle, *param) {
                        [*result, *param, *first, *again].into_iter().for_each(|v| clear(gentle, v));
                    }
                }
                block(body, *inner, gentle);
            }
            op => op.for_each_use(|v| clear(gentle, v)),
        }
    }
}

fn has(gentle: &[bool], v: ValueId) -> bool {
    gentle.get(v.index()).copied().unwrap_or(false)
}

fn clear(gentle: &mut [bool], v: ValueId) {
    if let Some(g) = gentle.get_mut(v.index()) {
        *g = false;
    }
}
