//! Two vectors in step: a block that computes two vectors in each round of the loop over lanes.
//!
//! Operations of a vector often wait for each other. A processor then starts those of the next vector, but
//! only if they are near enough, and never before a loop within the block has ended. In a pair, each
//! operation of the second vector follows the same operation of the first, so that two chains overlap. A loop
//! within goes on while a lane of either vector does, and a part is skipped if no lane of either needs it, as
//! if vectors were twice as wide.

use crate::block::Block;
use crate::inst::{Carry, Inst, Kind, Op};

/// The numbers of an operation's copies, one for each vector. They are equal if all lanes have the same
/// result.
type Copies = [u32; 2];

impl Block {
    /// The block that computes two vectors of `lanes` lanes in step. `None` if it accesses lanes at offsets:
    /// in a vector that a region skips when it is alone, the offset may be any number.
    pub fn pair(&self, lanes: u32) -> Option<Block> {
        let is_at_offset = |inst: &Inst| matches!(inst.op, Op::LanesAt(..) | Op::StoreAt(..));
        if self.is_pair || self.insts.iter().any(is_at_offset) {
            return None;
        }
        let mut pair = Block { arrays: self.arrays.clone(), is_pair: true, ..Block::default() };
        pair.regions.clone_from(&self.regions);
        let mut all: Vec<Copies> = Vec::with_capacity(self.insts.len());
        for inst in &self.insts {
            let copies = pair.copies_of(inst, &all, lanes)?;
            all.push(copies);
        }
        let copies = |v: u32| all.get(v as usize).copied().unwrap_or_default();
        for region in &mut pair.regions {
            let both = region.carried.iter().flat_map(|Carry { init, param, next, result }| {
                let [init, param, next, result] = [init, param, next, result].map(|v| copies(*v));
                [0, 1].map(|at| Carry {
                    init: init[at],
                    param: param[at],
                    next: next[at],
                    result: result[at],
                })
            });
            region.carried = both.collect();
        }
        Some(pair)
    }

    /// Adds an operation for both vectors, given the copies of those before it.
    fn copies_of(&mut self, inst: &Inst, all: &[Copies], lanes: u32) -> Option<Copies> {
        let args = inst.args().iter().map(|v| all.get(*v as usize).copied());
        let args: Vec<Copies> = args.collect::<Option<_>>()?;
        let of = |vector: usize| args.iter().map(|copies| copies[vector]).collect::<Vec<u32>>();
        Some(match inst.op {
            Op::Begin(number) => {
                if let Kind::Skip { mask } = self.regions.get(number as usize)?.kind {
                    let mask = self.any(*all.get(mask as usize)?);
                    self.regions.get_mut(number as usize)?.kind = Kind::Skip { mask };
                }
                let at = self.push(inst.op, &[]);
                self.regions.get_mut(number as usize)?.begin = at;
                [at; 2]
            }
            Op::End(number) => {
                let region = self.regions.get(number as usize)?;
                let again = match region.kind {
                    Kind::Loop => self.any(*all.get(region.again as usize)?),
                    Kind::Skip { .. } => 0,
                };
                let at = self.push(inst.op, &[]);
                let region = self.regions.get_mut(number as usize)?;
                (region.end, region.again) = (at, again);
                [at; 2]
            }
            Op::Stop => {
                let mask = self.any(*args.first()?);
                [self.push(inst.op, &[mask]); 2]
            }
            Op::Lanes(array, word) => {
                [word, word.saturating_add(lanes)].map(|word| self.push(Op::Lanes(array, word), &[]))
            }
            Op::Store(array, word) => [0, 1].map(|vector: u8| {
                let word = word.saturating_add(u32::from(vector) * lanes);
                self.push(Op::Store(array, word), &of(vector.into()))
            }),
            Op::Carried { .. } => [0, 1].map(|_| self.push(inst.op, &[])),
            op if args.iter().all(|[a, b]| a == b) => [self.push(op, &of(0)); 2],
            op => [0, 1].map(|vector| self.push(op, &of(vector))),
        })
    }

    /// A mask that has a lane if that of either vector does.
    fn any(&mut self, [a, b]: Copies) -> u32 {
        if a == b { a } else { self.push(Op::MaskOr, &[a, b]) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inst::{Binary, IntCompare};
    use crate::region::Next;

    #[test]
    fn what_all_lanes_share_is_computed_once() {
        let mut block = Block::new();
        let (words, lanes) = (block.array(), block.array());
        let (a, b, x) = (block.word(words, 0), block.float(2.0), block.lanes(lanes, 0));
        let shared = block.binary(Binary::Mul, a, b);
        let sum = block.binary(Binary::Add, x, shared);
        block.store(lanes, 0, sum, true);
        let pair = block.pair(8).map(|pair| pair.insts.iter().map(|inst| inst.op).collect::<Vec<_>>());
        let (mul, add) = (Op::Binary(Binary::Mul), Op::Binary(Binary::Add));
        let expected = [
            Op::Word(words, 0),
            Op::Constant(2.0_f32.to_bits()),
            Op::Lanes(lanes, 0),
            Op::Lanes(lanes, 8),
            mul,
            add,
            add,
            Op::Store(lanes, 0),
            Op::Store(lanes, 8),
        ];
        assert_eq!(pair, Some(expected.to_vec()));
    }

    #[test]
    fn a_loop_goes_on_while_either_vector_does() {
        let mut block = Block::new();
        let lanes = block.array();
        let (x, zero, one) = (block.lanes(lanes, 0), block.bits(0), block.bits(1));
        let active = block.not_zero(x);
        let begun = block.begin_loop(active, &[x], 1);
        let less = block.binary(Binary::IntSub, begun.values[0], one);
        let again = block.compare_ints(IntCompare::Less, zero, less);
        let results = block.end_loop(&begun, &[Next { value: less, kept: true }], again);
        block.store(lanes, 0, results[0], true);
        let pair = block.pair(4).expect("it has no offsets");
        let [region] = pair.regions.as_slice() else { panic!("{:?}", pair.regions) };
        assert_eq!(pair.insts[region.again as usize].op, Op::MaskOr);
        assert_eq!((region.carried.len(), pair.insts[region.end as usize].op), (4, Op::End(0)));
        assert!(pair.pair(4).is_none());
    }
}
