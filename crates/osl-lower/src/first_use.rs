//! Finds the first use of variables in a body: the code that computes them is placed there.
//!
//! A use in both sides of an `If`, or in one side and after it, is a use of the `If` itself. A use in a loop
//! is a use of the loop: values for many iterations are computed once.

use osl_ir::ir::{BlockId, Body, Op, SlotId};
use rustc_hash::FxHashMap;

/// A place in a body: before an instruction of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Spot {
    pub(super) block: BlockId,
    pub(super) index: usize,
}

/// For each owner of some slots, the place in `root` or its nested blocks before all uses of its slots;
/// owners without uses are missing. Stores count as uses.
pub(super) fn of(body: &Body, root: BlockId, owners: &FxHashMap<SlotId, usize>) -> FxHashMap<usize, Spot> {
    let found = search(body, root, owners);
    found.into_iter().map(|(owner, (_, spot))| (owner, spot)).collect()
}

/// A place before all uses.
#[derive(Clone, Copy, Debug)]
pub(super) struct InsertionPoint {
    /// The innermost place, which only code that needs the slots reaches.
    pub(super) inner: Spot,
    /// Outside any branch.
    pub(super) outer: Spot,
}

/// The place before all uses of some slots in blocks that run one after another.
pub(super) fn across(body: &Body, blocks: &[BlockId], slots: &[SlotId]) -> Option<InsertionPoint> {
    let owners = slots.iter().map(|slot| (*slot, 0)).collect();
    let mut found = blocks.iter().filter_map(|block| {
        let (index, inner) = search(body, *block, &owners).remove(&0)?;
        Some(InsertionPoint { inner, outer: Spot { block: *block, index } })
    });
    let first = found.next()?;
    let inner = if found.next().is_some() { first.outer } else { first.inner };
    Some(InsertionPoint { inner, ..first })
}

/// For each owner, the first instruction of the block that contains a use, and the place before all uses.
fn search(body: &Body, root: BlockId, owners: &FxHashMap<SlotId, usize>) -> FxHashMap<usize, (usize, Spot)> {
    // Besides the place, the first instruction of this block that contains a use.
    let mut found: FxHashMap<usize, (usize, Spot)> = FxHashMap::default();
    if owners.is_empty() {
        return FxHashMap::default();
    }
    let mut note = |owner: usize, index: usize, spot: Spot| {
        let first = found.entry(owner).or_insert((index, spot));
        if first.0 != index {
            first.1 = Spot { block: root, index: first.0 };
        }
    };
    for (index, inst) in body.block(root).insts.iter().enumerate() {
        let here = Spot { block: root, index };
        let mut used =
            |slot: SlotId| owners.get(&slot).into_iter().for_each(|owner| note(*owner, index, here));
        match &inst.op {
            Op::Load(slot) | Op::Store(slot, _) | Op::LoadElement(slot, _) | Op::StoreElement(slot, ..) => {
                used(*slot);
            }
            Op::Kernel(kernel, _) => [kernel.reads(), kernel.writes()].into_iter().flatten().for_each(used),
            Op::If { then, otherwise, .. } => {
                let (then, mut otherwise) = (of(body, *then, owners), of(body, *otherwise, owners));
                #[expect(clippy::iter_over_hash_type, reason = "each owner has a spot of its own")]
                for (owner, spot) in then {
                    let spot = if otherwise.remove(&owner).is_some() { here } else { spot };
                    note(owner, index, spot);
                }
                otherwise.into_iter().for_each(|(owner, spot)| note(owner, index, spot));
            }
            Op::Loop { body: round, .. } => {
                of(body, *round, owners).into_keys().for_each(|owner| note(owner, index, here));
            }
            _ => {}
        }
    }
    found
}

/// Whether a slot is stored to in a block after its first `skip` instructions, or in blocks nested there.
pub(super) fn is_stored(body: &Body, block: BlockId, skip: usize, slot: SlotId) -> bool {
    body.block(block).insts.iter().skip(skip).any(|inst| {
        matches!(inst.op, Op::Store(to, _) if to == slot)
            || inst.op.blocks().any(|id| is_stored(body, id, 0, slot))
    })
}
