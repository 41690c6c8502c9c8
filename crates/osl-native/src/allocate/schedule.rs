//! The order of operations: chains that do not depend on each other overlap.
//!
//! A processor looks only some hundred instructions ahead for one that it can start. So operations get the
//! order in which a processor that looks further would take them up: where an operation would have to wait
//! for an operand, a later one comes first (list scheduling, Cooper and Torczon, Engineering a Compiler,
//! chapter 12). Values that are made early are kept for longer, so an operation comes forward only while few
//! values are. Each operation stays between the same two jumps, and accesses of the same place in memory stay
//! in order.

use super::region::Lists;
use crate::block::Block;
use crate::estimate::WIDTH;
use crate::inst::{Array, Inst, Op};
use rustc_hash::FxHashMap;
use std::ops::Range;

/// How many operations an operation may come forward, and how many are looked at for each place.
const AHEAD: u32 = 256;
const CANDIDATES: usize = 8;
/// How long an operation may wait once it is taken up. **Units:** cycles.
const PATIENCE: usize = 10;

/// Maximum number of values to keep at a time: vectors, and masks if they have registers of their own.
pub(super) type Limits = [i32; 2];

/// The operations of a block in their new order, by number.
pub(super) fn order(block: &Block, limits: Limits) -> Vec<u32> {
    let needed = block.needed();
    let mut scheduler = Scheduler::new(block, &needed, limits);
    let mut start = 0;
    for (inst, at) in block.insts.iter().zip(0..) {
        if matches!(inst.op, Op::Begin(_) | Op::End(_) | Op::Stop | Op::Carried { .. }) {
            scheduler.part(start..at);
            scheduler.place(at);
            start = at + 1;
        }
    }
    scheduler.part(start..block.insts.len() as u32);
    scheduler.order
}

/// Marks the end of a list of edges.
const NONE: u32 = u32::MAX;

struct Scheduler<'a> {
    block: &'a Block,
    needed: &'a [bool],
    lists: Lists,
    limits: Limits,
    order: Vec<u32>,
    placed: Vec<bool>,
    /// Number of values that are kept.
    kept: [i32; 2],
    /// The remaining uses of each value.
    left: Vec<u32>,
    /// How many operations of its part each operation still waits for, and when the operands placed so far
    /// are known.
    waits: Vec<u32>,
    known: Vec<usize>,
    /// The operations that wait for each operation: `edges[first[v]]` and on, as pairs of an operation and
    /// the next edge.
    first: Vec<u32>,
    edges: Vec<(u32, u32)>,
    /// The time, in instructions taken up, and when the unit for quotients is free.
    now: usize,
    unit: usize,
}

impl<'a> Scheduler<'a> {
    fn new(block: &'a Block, needed: &'a [bool], limits: Limits) -> Self {
        let count = block.insts.len();
        let lists = Lists::of(block, needed);
        let mut left = vec![0; count];
        for (inst, _) in block.insts.iter().zip(needed).filter(|(_, needed)| **needed) {
            lists.read(inst).for_each(|v| left[*v as usize] += 1);
        }
        Scheduler {
            block,
            needed,
            lists,
            limits,
            order: Vec::with_capacity(count),
            placed: vec![false; count],
            kept: [0; 2],
            left,
            waits: vec![0; count],
            known: vec![0; count],
            first: vec![NONE; count],
            edges: Vec::new(),
            now: 0,
            unit: 0,
        }
    }

    /// Places the operations of a part.
    fn part(&mut self, part: Range<u32>) {
        // In the order of the block.
        let mut available = self.connect(part.clone());
        let mut oldest = part.start;
        while !available.is_empty() {
            while self.placed[oldest as usize] || !self.needed[oldest as usize] {
                oldest += 1;
            }
            let (slot, start) = self.next(&available, oldest);
            let at = available.remove(slot);
            let (count, latency, busy) = self.block.insts[at as usize].op.cost();
            let mut known = 0;
            if count > 0 {
                self.now = self.now.max(start.saturating_sub(PATIENCE * WIDTH)) + count;
                known = start + latency * WIDTH;
            }
            if busy > 0 {
                self.unit = start + busy * WIDTH;
            }
            self.place(at);
            let mut edge = self.first[at as usize];
            while let Some((reader, next)) = self.edges.get(edge as usize).copied() {
                let slot = reader as usize;
                self.known[slot] = self.known[slot].max(known);
                self.waits[slot] -= 1;
                if self.waits[slot] == 0 {
                    available.insert(available.partition_point(|have| *have < reader), reader);
                }
                edge = next;
            }
        }
        part.filter(|at| !self.needed[*at as usize]).for_each(|at| self.order.push(at));
    }

    /// Notes who waits for whom in a part. Returns the operations that wait for none.
    fn connect(&mut self, part: Range<u32>) -> Vec<u32> {
        self.edges.clear();
        let mut available = Vec::new();
        let mut last: FxHashMap<(Array, Option<u32>), u32> = FxHashMap::default();
        for at in part.clone().filter(|at| self.needed[*at as usize]) {
            let inst = &self.block.insts[at as usize];
            let place = match inst.op {
                Op::Lanes(array, word) | Op::Store(array, word) => Some((array, Some(word))),
                Op::LanesAt(array, _) | Op::Gather(array, _) | Op::StoreAt(array, _) => Some((array, None)),
                _ => None,
            };
            let before = place.and_then(|place| last.insert(place, at));
            for v in inst.args().iter().copied().chain(before).filter(|v| *v >= part.start) {
                self.edges.push((at, self.first[v as usize]));
                self.first[v as usize] = self.edges.len() as u32 - 1;
                self.waits[at as usize] += 1;
            }
            if self.waits[at as usize] == 0 {
                available.push(at);
            }
        }
        available
    }

    /// Chooses one of the operations that wait for none: the first that can start soon, else the one that
    /// can start first. Returns its position among them, and when it starts.
    fn next(&self, available: &[u32], oldest: u32) -> (usize, usize) {
        let mut best = (0, usize::MAX);
        for (slot, at) in available.iter().enumerate().take(CANDIDATES) {
            let inst = &self.block.insts[*at as usize];
            let (count, _, busy) = inst.op.cost();
            let mut start = self.known[*at as usize].max(self.now);
            if busy > 0 {
                start = start.max(self.unit);
            }
            if start >= best.1 || *at > oldest.saturating_add(AHEAD) {
                continue;
            }
            // The oldest must come at some time.
            if count > 0 && *at != oldest && !self.fits(*at, inst) {
                continue;
            }
            best = (slot, start);
            if start <= self.now + PATIENCE * WIDTH {
                break;
            }
        }
        best
    }

    /// Whether the result is not one value too many.
    fn fits(&self, at: u32, inst: &Inst) -> bool {
        let mut grows = [0; 2];
        if self.left[at as usize] > 0 {
            grows[self.kind(at)] += 1;
        }
        let args = inst.args();
        for (slot, v) in args.iter().enumerate() {
            let uses = args.iter().filter(|arg| *arg == v).count();
            let is_repeated = args[..slot].contains(v);
            if !is_repeated && self.left[*v as usize] as usize == uses && !self.is_source(*v) {
                grows[self.kind(*v)] -= 1;
            }
        }
        (0..2).all(|kind| grows[kind] <= 0 || self.kept[kind] + grows[kind] <= self.limits[kind])
    }

    /// Adds an operation to the order.
    fn place(&mut self, at: u32) {
        self.order.push(at);
        self.placed[at as usize] = true;
        if !self.needed[at as usize] {
            return;
        }
        for v in self.lists.read(&self.block.insts[at as usize]) {
            let left = &mut self.left[*v as usize];
            *left -= 1;
            if *left == 0 && !self.is_source(*v) {
                self.kept[self.kind(*v)] -= 1;
            }
        }
        if self.left[at as usize] > 0 && !self.is_source(at) {
            self.kept[self.kind(at)] += 1;
        }
    }

    fn is_source(&self, v: u32) -> bool {
        self.block.insts[v as usize].op.is_source()
    }

    /// 1 for a mask with a register of its kind, else 0.
    fn kind(&self, v: u32) -> usize {
        usize::from(self.limits[1] > 0 && self.block.insts[v as usize].op.is_mask())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inst::{Binary, Unary, Value};

    /// Two chains of so many operations, one after the other, on lanes that are stored.
    fn chains(block: &mut Block, length: usize) -> [Value; 2] {
        let array = block.array();
        [0, 16].map(|word| {
            let first = block.lanes(array, word);
            let last = (0..length).fold(first, |x, _| block.binary(Binary::Mul, x, first));
            block.store(array, word, last, true);
            last
        })
    }

    /// The numbers of the products, in the new order.
    fn products(block: &Block, limits: Limits) -> Vec<u32> {
        let is_product = |at: &u32| block.insts[*at as usize].op == Op::Binary(Binary::Mul);
        order(block, limits).into_iter().filter(is_product).collect()
    }

    #[test]
    fn chains_overlap_as_long_as_there_are_registers() {
        let mut block = Block::new();
        chains(&mut block, 40);
        let second = block.insts.len() as u32 / 2;
        let places = products(&block, [13, 0]);
        let first_of_second = places.iter().position(|at| *at > second);
        // The first chain goes ahead by what may wait.
        assert!(first_of_second.is_some_and(|at| (2..20).contains(&at)), "{places:?}");
        let mut sorted = places.clone();
        sorted.sort_unstable();
        assert_ne!(places, sorted);
        assert_eq!(products(&block, [1, 0]), sorted, "one register is for one chain");
    }

    #[test]
    fn operations_come_after_their_operands_and_memory_is_read_before_it_is_written() {
        let mut block = Block::new();
        let ends = chains(&mut block, 5);
        let array = block.array();
        let old = block.lanes(array, 0);
        let root = block.unary(Unary::Sqrt, ends[1]);
        block.store(array, 0, root, true);
        let sum = block.binary(Binary::Add, old, root);
        block.store(array, 16, sum, true);
        let order = order(&block, [29, 7]);
        let place = |v: u32| order.iter().position(|at| *at == v);
        assert_eq!(order.len(), block.insts.len());
        for (inst, at) in block.insts.iter().zip(0..) {
            assert!(inst.args().iter().all(|v| place(*v) < place(at)), "{order:?}");
        }
        let store = block.insts.iter().position(|inst| inst.op == Op::Store(array, 0)).map(|at| at as u32);
        assert!(place(old.0) < store.and_then(place), "{order:?}");
    }

    #[test]
    fn nothing_leaves_its_region() {
        let mut block = Block::new();
        let ends = chains(&mut block, 3);
        let array = block.array();
        let mask = block.not_zero(ends[0]);
        block.begin_skip(mask, &[ends[1]], 0);
        let root = block.unary(Unary::Sqrt, ends[0]);
        let results = block.end_skip(&[root]);
        block.store(array, 0, results[0], true);
        let order = order(&block, [13, 0]);
        let place = |v: u32| order.iter().position(|at| *at == v);
        let region = &block.regions[0];
        assert!(place(region.begin) < place(root.0) && place(root.0) < place(region.end), "{order:?}");
    }
}
