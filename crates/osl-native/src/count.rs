//! Adding 1 where a mask is set, as one operation.
//!
//! Where masks are vectors, a set lane has all bits, which is the int -1. So a choice between `x + 1` and `x`
//! is `x` minus the mask, and one between `x - 1` and `x` is their sum. Loops count like this in each round.

use crate::block::Block;
use crate::inst::{Binary, Inst, Op};

impl Block {
    /// The block with sums and differences of values and masks in place of choices, for a machine whose masks
    /// are vectors; `None` if there are no such choices.
    pub(crate) fn with_counts(&self) -> Option<Block> {
        let mut counting: Option<Block> = None;
        for (at, inst) in self.insts.iter().enumerate() {
            if let Some(count) = self.count(inst) {
                let block = counting.get_or_insert_with(|| self.clone());
                if let Some(slot) = block.insts.get_mut(at) {
                    *slot = count;
                }
            }
        }
        counting
    }

    /// The sum or difference that has the result of a choice.
    fn count(&self, choice: &Inst) -> Option<Inst> {
        let (Op::Choose, &[mask, yes, no]) = (choice.op, choice.args()) else { return None };
        let changed = self.insts.get(yes as usize)?;
        let (Op::Binary(op), &[a, b]) = (changed.op, changed.args()) else { return None };
        let constant = |v: u32| match self.insts.get(v as usize)?.op {
            Op::Constant(bits) => Some(bits as i32),
            _ => None,
        };
        let step = match op {
            Binary::IntAdd if a == no => constant(b)?,
            Binary::IntAdd if b == no => constant(a)?,
            Binary::IntSub if a == no => constant(b)?.checked_neg()?,
            _ => return None,
        };
        let op = match step {
            1 => Binary::IntSub,
            -1 => Binary::IntAdd,
            _ => return None,
        };
        Some(Inst::new(Op::Binary(op), &[no, mask]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inst::{IntCompare, MaskValue, Value};

    /// The operations of a block that chooses between a changed value and the value.
    fn chosen(change: impl FnOnce(&mut Block, Value, MaskValue) -> Value) -> Option<Vec<Op>> {
        let mut block = Block::new();
        let array = block.array();
        let (x, zero) = (block.lanes(array, 0), block.bits(0));
        let mask = block.compare_ints(IntCompare::Less, x, zero);
        let result = change(&mut block, x, mask);
        block.store(array, 0, result, true);
        let counting = block.with_counts()?;
        let needed = counting.needed();
        Some(
            counting
                .insts
                .iter()
                .zip(needed)
                .filter(|(_, needed)| *needed)
                .map(|(inst, _)| inst.op)
                .collect(),
        )
    }

    #[test]
    fn a_step_of_one_is_the_mask() {
        let step = |bits: u32, op: Binary| {
            chosen(|block, x, mask| {
                let step = block.bits(bits);
                let changed = block.binary(op, x, step);
                block.choose(mask, changed, x)
            })
        };
        let last = |ops: Option<Vec<Op>>| ops.and_then(|ops| ops.get(ops.len() - 2).copied());
        assert_eq!(last(step(1, Binary::IntAdd)), Some(Op::Binary(Binary::IntSub)));
        assert_eq!(last(step(1, Binary::IntSub)), Some(Op::Binary(Binary::IntAdd)));
        assert_eq!(last(step(u32::MAX, Binary::IntAdd)), Some(Op::Binary(Binary::IntAdd)));
        assert_eq!(step(2, Binary::IntAdd), None);
        assert_eq!(step(0x8000_0000, Binary::IntSub), None);
        assert_eq!(step(1, Binary::IntMul), None);
    }
}
