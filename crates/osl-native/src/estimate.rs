//! An estimate of the time that a vector takes in a loop over a block.
//!
//! A simple model of a processor: it takes up some instructions in each cycle, in order, as long as the
//! oldest unfinished one is not too far behind; each starts once its operands are known, and roots and
//! quotients share a unit. So instructions of several vectors overlap, unless a vector has more of them than
//! the processor looks ahead.

use crate::block::Block;
use crate::inst::{Binary, Op, Unary};

/// Instructions that are taken up in a cycle, and how far it looks ahead.
pub(crate) const WIDTH: usize = 4;
const WINDOW: usize = 256;
/// Vectors of the simulation.
const ROUNDS: usize = 4;

impl Op {
    /// Number of instructions, cycles until the result, and cycles in the unit for quotients.
    pub(crate) fn cost(self) -> (usize, usize, usize) {
        match self {
            // Held in registers, or read where they are used.
            Op::Word(..) | Op::Constant(_) => (0, 0, 0),
            Op::Lanes(..) => (1, 0, 0),
            Op::Unary(Unary::Sqrt) => (1, 14, 6),
            Op::Unary(Unary::InverseRoot) => (3, 25, 11),
            Op::Length => (4, 18, 0),
            Op::Binary(Binary::Div) => (1, 11, 5),
            Op::Unary(_) | Op::Binary(Binary::Add | Binary::Sub | Binary::Mul | Binary::IntMul) => (1, 4, 0),
            Op::Fused { .. } | Op::LookUp(..) => (2, 6, 0),
            Op::Gather(..) => (8, 20, 0),
            Op::Compare(_) | Op::Choose => (1, 2, 0),
            _ => (1, 1, 0),
        }
    }
}

impl Block {
    /// About how many cycles a vector takes if many follow each other. The block must not have regions.
    pub fn cycles(&self) -> usize {
        // Times are in parts of a cycle, one for each instruction that is taken up in it.
        let mut finished = vec![0; self.insts.len()];
        let mut retired = [0; WINDOW];
        let (mut number, mut time, mut latest, mut unit, mut first) = (0_usize, 0, 0, 0, 0);
        for round in 0..ROUNDS {
            for (at, inst) in self.insts.iter().enumerate() {
                let (count, latency, busy) = inst.op.cost();
                for _ in 0..count {
                    number += 1;
                    time = retired[number % WINDOW].max(time + 1);
                }
                let known = inst.args().iter().filter_map(|arg| finished.get(*arg as usize).copied());
                let mut start = known.max().unwrap_or(0).max(time);
                if busy > 0 {
                    start = start.max(unit);
                    unit = start + busy * WIDTH;
                }
                if count > 0 {
                    finished[at] = start + latency * WIDTH;
                    latest = latest.max(finished[at]);
                }
                for back in 0..count {
                    retired[(number - back) % WINDOW] = latest;
                }
            }
            if round == 0 {
                first = latest;
            }
        }
        (latest - first) / (WIDTH * (ROUNDS - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sum of so many terms, which the block loads.
    fn sum(terms: u32) -> Block {
        let mut block = Block::new();
        let array = block.array();
        let mut total = block.lanes(array, 0);
        for term in 1..terms {
            let next = block.lanes(array, term * 16);
            total = block.binary(Binary::Add, total, next);
        }
        block
    }

    #[test]
    fn chains_overlap_while_they_are_short() {
        // 40 operations of a chain of 80 cycles: three vectors and more at once.
        assert!((10..25).contains(&sum(21).cycles()), "{}", sum(21).cycles());
        // A chain of 1600 cycles: hardly any operation of the next vector comes earlier.
        let long = sum(401).cycles();
        assert!((1000..1600).contains(&long), "{long}");
        let mut apart = Block::new();
        let array = apart.array();
        for term in 0..400 {
            let value = apart.lanes(array, term * 16);
            apart.unary(Unary::Floor, value);
        }
        assert!((190..220).contains(&apart.cycles()), "{}", apart.cycles());
    }
}
