//! What of folding changes the meaning of a program, so that it holds where nothing else is folded. It must not know
//! how constants are computed.

use super::super::Renaming;
use super::{Strings, fold, rename_outputs};
use crate::ir::{Body, Const, Kernel, LaneOp, Op, ValueId, Values};
use rustc_hash::FxHashSet;

/// What folding found out that changes the meaning of the program.
#[derive(Default)]
pub(super) struct Meaning {
    /// Results of operations whose divisor is known, and what they became.
    pub(super) divided: Vec<(ValueId, LaneOp)>,
    /// Results of conversions of a color from a space to itself.
    pub(super) unconverted: FxHashSet<ValueId>,
}

/// Settles what the program means where that depends on what is constant: what is not found to be so by now is not.
pub(in crate::passes) fn settle(body: &mut Body) {
    for inst in body.blocks.iter_mut().flat_map(|block| &mut block.insts) {
        if matches!(inst.op, Op::Kernel(Kernel::IsConstant, _)) {
            inst.op = Op::Const(Const::Int(0));
        }
    }
}

/// Only what changes a meaning: which operations divide by a constant (they have no guard), which colors are converted
/// from a space to itself, and what `isconstant` finds. All is found out as the pass would find it, and nothing else of
/// the body changes.
pub(in crate::passes) fn only_meaning(body: &mut Body, text: &mut Strings) {
    let mut folded = body.clone();
    let Meaning { divided, unconverted } = fold(&mut folded, false, false, text);
    let mut operations: Vec<Option<Op>> = vec![None; body.values.len()];
    for inst in folded.blocks.iter().flat_map(|block| &block.insts) {
        if let Some(result) = inst.results.first()
            && let Some(found) = operations.get_mut(result.index())
        {
            *found = Some(inst.op.clone());
        }
    }
    // A loop of one round is folded twice: what has a known divisor may be a constant in the end.
    for (result, op) in divided {
        if let Some(found) = operations.get_mut(result.index()) {
            *found = Some(Op::Lane(op, Values::new()));
        }
    }
    let mut colors = Renaming::default();
    for inst in body.blocks.iter().flat_map(|block| &block.insts) {
        if let (Op::Kernel(Kernel::ColorBetween, args), Some(result)) = (&inst.op, inst.results.first())
            && unconverted.contains(result)
            && let Some(color) = args.get(2)
        {
            colors.set(*result, *color);
        }
    }
    rename_outputs(body, &colors);
    for inst in body.blocks.iter_mut().flat_map(|block| &mut block.insts) {
        inst.op.replace_uses(|value| colors.get(value));
        let found = inst.results.first().and_then(|result| operations.get_mut(result.index())?.take());
        match (&mut inst.op, found) {
            (
                Op::Lane(op, _),
                Some(Op::Lane(found @ (LaneOp::FDivBy | LaneOp::FmodExact | LaneOp::ModBy), _)),
            ) => *op = found,
            (op @ Op::Kernel(Kernel::IsConstant, _), Some(found @ Op::Const(_))) => *op = found,
            _ => {}
        }
    }
}
