//! Finds transformations of `P` between spaces whose matrices are affine. If `P` changes by the same vector
//! from pixel to pixel at all points, so does the result. The general rule has the same value, but it divides
//! by a sum that depends on the point, so that everything that follows is computed for each point.
//!
//! The two rules differ where `P` is infinite or not a number, which cannot be with such changes, and in
//! the sign of a zero.

use super::super::Options;
use crate::global::Global;
use crate::ir::{Body, Const, Kernel, LaneOp, Op, ValueId};
use rustc_hash::FxHashSet;

/// The values of a program that are `P`, or a matrix between affine spaces.
#[derive(Debug, Default)]
pub(in super::super) struct Flat {
    values: FxHashSet<ValueId>,
}

impl Flat {
    /// Finds the values. There are none if the change of `P` differs from point to point.
    pub(in super::super) fn new(body: &Body, options: &Options) -> Flat {
        let mut values = FxHashSet::default();
        if options.affine.is_empty() || options.derivs.contains(&Global::P) {
            return Flat { values };
        }
        let names = body.constants().filter(|(_, value)| match value {
            Const::Str(name) => options.affine.contains(name),
            _ => false,
        });
        let names: FxHashSet<ValueId> = names.map(|(v, _)| v).collect();
        for inst in body.insts() {
            let is_flat = match &inst.op {
                Op::Global(Global::P) => true,
                Op::Kernel(Kernel::SpaceMatrix { .. }, spaces) => {
                    spaces.iter().all(|name| names.contains(name))
                }
                _ => false,
            };
            values.extend(inst.results.iter().filter(|_| is_flat));
        }
        Flat { values }
    }

    /// Whether an operation transforms `P` between affine spaces.
    pub(super) fn covers(&self, op: LaneOp, args: &[ValueId]) -> bool {
        op == LaneOp::TransformPoint && args.iter().all(|arg| self.values.contains(arg))
    }
}
