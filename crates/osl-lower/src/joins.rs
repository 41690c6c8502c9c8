//! Counts the values that branches and loops will return once variables are values: one for every variable
//! that is written inside, at the end of each.
//!
//! Deep nesting multiplies them: two hundred nested branches around a hundred thousand assignments make
//! twenty million.

use osl_ir::ir::{BlockId, Body, Op, SlotId};
use rustc_hash::FxHashSet;

/// The number of values that `block` returns, including nested blocks; counting stops above `limit`.
pub(super) fn count(body: &Body, block: BlockId, limit: u64) -> u64 {
    let mut joins = 0;
    written(body, block, limit, &mut joins);
    joins
}

/// The scalar variables that a block writes.
fn written(body: &Body, block: BlockId, limit: u64, joins: &mut u64) -> FxHashSet<SlotId> {
    let mut all = FxHashSet::default();
    for inst in &body.block(block).insts {
        if *joins > limit {
            break;
        }
        let (inner, values) = match &inst.op {
            Op::Store(slot, _) if body.slot(*slot).len.is_none() => {
                all.insert(*slot);
                continue;
            }
            Op::If { then, otherwise, .. } => {
                let (a, b) = (written(body, *then, limit, joins), written(body, *otherwise, limit, joins));
                (union(a, b), 1)
            }
            // The values for the first iteration, and those of the last.
            Op::Loop { body: round, .. } => (written(body, *round, limit, joins), 2),
            _ => continue,
        };
        *joins += values * inner.len() as u64;
        all = union(all, inner);
    }
    all
}

/// The smaller set is added to the larger one.
fn union(a: FxHashSet<SlotId>, b: FxHashSet<SlotId>) -> FxHashSet<SlotId> {
    let (mut large, small) = if a.len() < b.len() { (b, a) } else { (a, b) };
    large.extend(small);
    large
}
