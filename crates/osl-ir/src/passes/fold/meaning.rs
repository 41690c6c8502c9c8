//! The effects of folding on the meaning of a program, which must be the same even if nothing else is folded.

use super::super::Renaming;
use super::{Numbers, Strings, fold, rename_outputs};
use crate::ir::{Body, Const, Kernel, LaneOp, Op, ValueId, Values};
use rustc_hash::FxHashSet;

/// The findings of folding that change the meaning of the program.
#[derive(Default)]
pub(super) struct Meaning {
    /// Results of operations with a constant divisor, and the operations that replaced them.
    pub(super) divided: Vec<(ValueId, LaneOp)>,
    /// Results of conversions of a color from a space to itself.
    pub(super) unconverted: FxHashSet<ValueId>,
}

/// Settles the meaning of the program where it depends on constants: a value that is not constant by now does
/// not count as one.
pub(in crate::passes) fn settle(body: &mut Body) {
    for inst in body.blocks.iter_mut().flat_map(|block| &mut block.insts) {
        if matches!(inst.op, Op::Kernel(Kernel::IsConstant, _)) {
            inst.op = Op::Const(Const::Int(0));
        }
    }
}

/// Applies only the findings that change the meaning: operations that divide by a constant (they have no
/// guard), colors that are converted from a space to itself, and the result of `isconstant`. They are found
/// as in the full pass, and nothing else in the body changes.
pub(in crate::passes) fn only_meaning(body: &mut Body, text: &mut Strings) {
    let mut folded = body.clone();
    let Meaning { divided, unconverted } = fold(&mut folded, false, Numbers::Single, text);
    let mut operations: Vec<Option<Op>> = vec![None; body.values.len()];
    for inst in folded.insts() {
        if let Some(result) = inst.results.first()
            && let Some(found) = operations.get_mut(result.index())
        {
            *found = Some(inst.op.clone());
        }
    }
    // A loop with one iteration is folded twice: an operation with a constant divisor may become a constant
    // in the end.
    for (result, op) in divided {
        if let Some(found) = operations.get_mut(result.index()) {
            *found = Some(Op::Lane(op, Values::new()));
        }
    }
    let mut colors = Renaming::default();
    for inst in body.insts() {
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
