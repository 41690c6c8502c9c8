//! Reads elements of arrays from where they were stored: an element that is stored once, before any branch,
//! is the stored value from then on.
//!
//! Elements are known by constant indices, so this pass runs after loops are unrolled. It leaves an array
//! alone if one of its elements is stored at a computed index, in a branch or in a loop.

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Op, SlotId, ValueId};
use rustc_hash::FxHashMap;

/// Runs the pass. Returns whether anything changed.
pub(super) fn run(body: &mut Body) -> bool {
    let numbers = numbers(body);
    let stores = stores(body, &numbers);
    if stores.iter().all(|own| own.as_ref().is_none_or(FxHashMap::is_empty)) {
        return false;
    }
    let mut forward = Forward { numbers, stores, renaming: Renaming::default(), at: 0 };
    let changed = forward.block(body, body.entry);
    if changed {
        super::fold::rename_outputs(body, &forward.renaming);
    }
    changed
}

/// The ints that are constants.
fn numbers(body: &Body) -> FxHashMap<ValueId, i32> {
    let number = |(v, value): (ValueId, &Const)| if let Const::Int(n) = value { Some((v, *n)) } else { None };
    body.constants().filter_map(number).collect()
}

/// The stored elements of an array by index: the instruction of the first block, and the value.
type Elements = FxHashMap<u32, (usize, ValueId)>;

/// The elements of each array. `None` for arrays that are stored in other ways.
fn stores(body: &Body, numbers: &FxHashMap<ValueId, i32>) -> Vec<Option<Elements>> {
    let mut stores = vec![Some(Elements::default()); body.slots.len()];
    for (id, block) in body.blocks.iter().enumerate() {
        let is_first = id == body.entry.index();
        for (at, inst) in block.insts.iter().enumerate() {
            match &inst.op {
                Op::StoreElement(slot, index, value) => {
                    let Some(own) = stores.get_mut(slot.index()) else { continue };
                    let index = numbers.get(index).and_then(|n| index_in(body, *slot, *n));
                    let elements = own.as_mut().zip(index).filter(|_| is_first);
                    // A second value would hold from there on.
                    if elements.is_none_or(|(own, index)| own.insert(index, (at, *value)).is_some()) {
                        *own = None;
                    }
                }
                Op::Kernel(kernel, _) => {
                    if let Some(own) = kernel.writes().and_then(|slot| stores.get_mut(slot.index())) {
                        *own = None;
                    }
                }
                _ => {}
            }
        }
    }
    stores
}

/// A constant as an index into an array.
fn index_in(body: &Body, slot: SlotId, number: i32) -> Option<u32> {
    let index = u32::try_from(number).ok()?;
    body.slots.get(slot.index())?.len.is_some_and(|len| index < len).then_some(index)
}

struct Forward {
    numbers: FxHashMap<ValueId, i32>,
    stores: Vec<Option<Elements>>,
    renaming: Renaming,
    /// The instruction of the first block in which the current one is.
    at: usize,
}

impl Forward {
    fn block(&mut self, body: &mut Body, id: BlockId) -> bool {
        let mut insts = std::mem::take(&mut body.blocks[id.index()].insts);
        let (is_first, mut at, mut changed) = (id == body.entry, 0, false);
        insts.retain_mut(|inst| {
            if is_first {
                self.at = at;
                at += 1;
            }
            inst.op.replace_uses(|v| self.renaming.get(v));
            match &mut inst.op {
                Op::LoadElement(slot, index) => {
                    let stored = self.stored(*slot, *index);
                    if let (Some(value), Some(result)) = (stored, inst.results.first()) {
                        self.renaming.set(*result, value);
                        changed = true;
                        return false;
                    }
                }
                Op::If { then, otherwise, then_yields, else_yields, .. } => {
                    changed |= self.block(body, *then);
                    changed |= self.block(body, *otherwise);
                    let yields = then_yields.iter_mut().chain(else_yields);
                    yields.for_each(|v| *v = self.renaming.get(*v));
                }
                Op::Loop { body: inner, cond, next, .. } => {
                    changed |= self.block(body, *inner);
                    next.iter_mut().chain([cond]).for_each(|v| *v = self.renaming.get(*v));
                }
                _ => {}
            }
            true
        });
        body.blocks[id.index()].insts = insts;
        changed
    }

    /// The value of an element, if it is stored before.
    fn stored(&self, slot: SlotId, index: ValueId) -> Option<ValueId> {
        let index = u32::try_from(*self.numbers.get(&index)?).ok()?;
        let (at, value) = self.stores.get(slot.index())?.as_ref()?.get(&index)?;
        (*at < self.at).then(|| self.renaming.get(*value))
    }
}
