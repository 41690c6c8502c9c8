//! Registers across loops and jumps.
//!
//! A value that a region carries has one register at the start and at the end of a round, its home. All other
//! values from outside are, where paths join, where they were when the region began: at the end of the region
//! they return there. So both ways into a place agree on what is where. A slot that a value got within a
//! region is forgotten at its end, since the other way has not filled it.

use super::{Allocator, index, register};
use crate::block::Block;
use crate::encoder::{Encoder, MemoryOperand, Register};
use crate::inst::{Carry, Inst, Kind, Op};

/// Whether an encoder can write the regions of a block: a region must leave three of eight registers to
/// others.
pub(crate) fn carries<E: Encoder>(block: &Block) -> bool {
    if block.regions.is_empty() {
        return E::JUMPS || block.is_plain();
    }
    let needed = block.needed();
    let most = block
        .regions
        .iter()
        .map(|region| region.carried.iter().filter(|carry| carry.is_needed(&needed)).count());
    E::JUMPS && most.max().unwrap_or(0) <= usize::from(E::VECTORS) * 5 / 8
}

/// What regions read at their start and end, by their number.
#[derive(Debug, Default)]
pub(super) struct Lists {
    starts: Vec<Vec<u32>>,
    ends: Vec<Vec<u32>>,
    /// The carried values that something needs.
    carried: Vec<Vec<Carry>>,
}

impl Lists {
    pub(super) fn of(block: &Block, needed: &[bool]) -> Lists {
        let mut lists = Lists::default();
        for (number, region) in block.regions.iter().enumerate() {
            let kept = region.carried.iter().copied().filter(|carry| carry.is_needed(needed));
            lists.carried.push(kept.collect());
            lists.starts.push(block.region_args(number as u32, false, needed));
            lists.ends.push(block.region_args(number as u32, true, needed));
        }
        // A loop reads what it uses from outside again in the next round.
        let mut outside: Vec<Vec<u32>> = vec![Vec::new(); block.regions.len()];
        let mut around: Vec<u32> = Vec::new();
        for (_, inst) in block.insts.iter().enumerate().filter(|(at, _)| needed[*at]) {
            if let Op::End(_) = inst.op {
                around.pop();
            }
            for v in lists.read(inst) {
                for number in &around {
                    let region = &block.regions[*number as usize];
                    if region.kind == Kind::Loop && *v < region.begin {
                        outside[*number as usize].push(*v);
                    }
                }
            }
            if let Op::End(region) = inst.op {
                // Also what it reads at its end.
                let begin = block.regions[region as usize].begin;
                let list = &lists.ends[region as usize];
                outside[region as usize].extend(list.iter().filter(|v| **v < begin));
            }
            if let Op::Begin(region) = inst.op {
                around.push(region);
            }
        }
        for (list, mut more) in lists.ends.iter_mut().zip(outside) {
            more.sort_unstable();
            more.dedup();
            list.extend(more);
        }
        lists
    }

    /// What an operation reads; values may occur twice.
    pub(super) fn read<'a>(&'a self, inst: &'a Inst) -> impl Iterator<Item = &'a u32> {
        match inst.op {
            Op::Begin(region) => &self.starts[region as usize][..],
            Op::End(region) => &self.ends[region as usize][..],
            _ => inst.args(),
        }
        .iter()
    }
}

/// A region that control is in: what was where when it began.
#[derive(Debug)]
pub(super) struct Entered {
    held: Vec<Option<u32>>,
    slot: Vec<Option<u32>>,
    /// The register of each carried value.
    homes: Vec<Register>,
    /// Where a loop begins, or the jump over a part that may be skipped.
    label: usize,
}

/// Where a value comes from that has to be in a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum From {
    Register(Register),
    Slot(u32),
    /// Wherever the value is in memory.
    Value(u32),
}

impl<E: Encoder> Allocator<'_, E> {
    /// Begins a region: gives each carried value a home.
    pub(super) fn begin(&mut self, number: u32) {
        let region = &self.block.regions[number as usize];
        let (kind, cost) = (region.kind, region.cost);
        let carried = std::mem::take(&mut self.lists.carried[number as usize]);
        let mut keep = Vec::new();
        let mut homes = Vec::new();
        for carry in &carried {
            let to = match self.register[carry.init as usize] {
                // Its last use: the value stays where it is.
                Some(register) if self.left(carry.init) == 1 => {
                    self.done(&[carry.init]);
                    register
                }
                _ => {
                    let to = self.take(self.block.insts[carry.init as usize].op.is_mask(), &keep);
                    match self.register[carry.init as usize] {
                        Some(from) => self.code.copy(to, from),
                        None => self.fetch(carry.init, to),
                    }
                    self.done(&[carry.init]);
                    to
                }
            };
            self.hold(to, carry.param);
            homes.push(to);
            keep.push(carry.param);
            self.preferred.insert(carry.next, to);
        }
        let mask = if let Kind::Skip { mask } = kind { Some(mask) } else { None };
        if let Some(mask) = mask {
            let register = self.vector(mask, &keep);
            self.code.test(register);
            self.done(&[mask]);
        }
        self.free.append(&mut self.ending);
        for (carry, home) in carried.iter().zip(&homes) {
            if self.left(carry.param) == 0 {
                self.held[index::<E>(*home)] = None;
                self.register[carry.param as usize] = None;
            }
        }
        self.lists.carried[number as usize] = carried;
        let label = if mask.is_some() { self.code.skip() } else { self.code.label() };
        self.code.spend(cost, mask.is_none());
        self.entered.push(Entered { held: self.held.clone(), slot: self.slot.clone(), homes, label });
    }

    /// Ends a region: everything is where it was, and carried values go to their homes.
    pub(super) fn end(&mut self, number: u32) {
        let Some(entered) = self.entered.pop() else { return };
        let carried = std::mem::take(&mut self.lists.carried[number as usize]);
        let list = std::mem::take(&mut self.lists.ends[number as usize]);
        let is_loop = self.block.regions[number as usize].kind == Kind::Loop;
        let next: Vec<u32> = list[..carried.len()].to_vec();
        next.iter().for_each(|v| {
            self.vector(*v, &next);
        });
        if is_loop {
            // Loops carry the mask that decides first, unless nothing reads it.
            let again = self.block.regions[number as usize].again;
            let keep: Vec<u32> = next.iter().copied().chain([again]).collect();
            let register = self.vector(again, &keep);
            self.code.test(register);
        }
        let params: Vec<u32> = carried.iter().map(|carry| carry.param).collect();
        let stays = |allocator: &Self, v: u32| {
            let reads = list.iter().filter(|have| **have == v).count() as u32;
            !params.contains(&v) && (is_loop || allocator.left(v) > reads)
        };
        let mut moves: Vec<(From, Register)> = Vec::new();
        for (v, home) in next.iter().zip(&entered.homes) {
            moves.extend(self.register[*v as usize].map(|from| (From::Register(from), *home)));
        }
        for (at, v) in entered.held.iter().enumerate() {
            let Some(v) = v.filter(|v| stays(self, *v)) else { continue };
            let from = self.register[v as usize].map_or(From::Value(v), From::Register);
            moves.push((from, register::<E>(at)));
        }
        self.move_all(moves);
        self.done(&list);
        // From here on, what is where is what it was at the beginning.
        for at in 0..self.held.len() {
            if let Some(v) = self.held[at].take() {
                self.register[v as usize] = None;
            }
        }
        for (at, v) in entered.held.iter().enumerate() {
            if let Some(v) = v.filter(|v| self.left(*v) > 0 && !params.contains(v)) {
                self.hold(register::<E>(at), v);
            }
        }
        for (carry, home) in carried.iter().zip(&entered.homes) {
            self.preferred.remove(&carry.next);
            if self.left(carry.result) > 0 {
                self.hold(*home, carry.result);
            }
        }
        for (slot, before) in self.slot.iter_mut().zip(&entered.slot) {
            if before.is_none() {
                self.free.extend(slot.take());
            }
        }
        self.free.append(&mut self.ending);
        if is_loop {
            self.code.jump_back(entered.label);
        } else {
            self.code.land(entered.label);
        }
    }

    /// Moves values to registers, all at once: a register may be the source of one move and the target of
    /// another.
    fn move_all(&mut self, mut moves: Vec<(From, Register)>) {
        moves.retain(|(from, to)| *from != From::Register(*to));
        let mut borrowed = Vec::new();
        loop {
            let is_read = |to: Register| moves.iter().any(|(from, _)| *from == From::Register(to));
            let ready =
                moves.iter().position(|(from, to)| matches!(from, From::Register(_)) && !is_read(*to));
            if let Some(at) = ready {
                if let (From::Register(from), to) = moves.swap_remove(at) {
                    self.code.copy(to, from);
                }
                continue;
            }
            // Only circles are left: one of their registers goes through memory.
            let Some((From::Register(from), _)) =
                moves.iter().find(|(from, _)| matches!(from, From::Register(_))).copied()
            else {
                break;
            };
            let slot = self.free_slot();
            borrowed.push(slot);
            self.code.store(from, MemoryOperand::Slot(slot));
            for (source, _) in &mut moves {
                if *source == From::Register(from) {
                    *source = From::Slot(slot);
                }
            }
        }
        for (from, to) in moves {
            match from {
                From::Register(_) => {}
                From::Slot(slot) => self.code.load(to, MemoryOperand::Slot(slot)),
                From::Value(v) => self.fetch(v, to),
            }
        }
        self.free.extend(borrowed);
    }
}
