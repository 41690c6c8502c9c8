//! Turns a block into code: `schedule` orders the operations, values get registers, and instructions follow.
//!
//! The value needed next keeps its register. If there are too few registers, the value that is needed last
//! gives up its register (Belady 1966) and moves to memory, unless it is there already. `region` does the
//! same for loops and jumps.

mod region;
mod schedule;

use crate::block::Block;
use crate::encoder::{Base, Encoder, Masks, MemoryOperand, Operand, Register, Work};
use crate::inst::{Array, Inst, Op};
pub(crate) use region::carries;
use region::{Entered, Lists};
use rustc_hash::FxHashMap;
use schedule::Limits;
use std::ops::Range;

/// Marks a register that an instruction uses as a temporary.
const TAKEN: u32 = u32::MAX;

/// Code as bytes, and the number of slots it needs.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// The instructions, followed by the constants that they read.
    pub bytes: Vec<u8>,
    /// Number of vectors of working memory.
    pub slots: usize,
    /// Number of instructions.
    pub instructions: usize,
}

/// Writes the code of a block.
pub(crate) fn assemble<E: Encoder>(block: &Block) -> Assembled {
    let counting = if E::MASKS == Masks::Vectors { block.with_counts() } else { None };
    let mut block = counting.unwrap_or_else(|| block.clone());
    block.hoist();
    let order = schedule::order(&block, limits::<E>());
    block.reorder(&order);
    let (code, slots) = allocate::<E>(&block);
    let (bytes, instructions) = code.finish(block.vectors());
    Assembled { instructions, bytes, slots }
}

/// Vectors that the order of operations keeps at a time, also where there are fewer registers: moving some to
/// memory and back takes less time than waiting for results.
const KEPT: i32 = 26;

/// How many vectors and masks the order of operations may keep at a time. The other registers are for
/// operands from memory and for temporary values.
fn limits<E: Encoder>() -> Limits {
    let count = |mask| registers::<E>(mask).len() as i32;
    let vectors = KEPT.max(count(false) - 3);
    match E::MASKS {
        Masks::Vectors => [vectors, 0],
        Masks::Registers(..) => [vectors, count(true) - 1],
    }
}

/// Hands the operations of a block to an encoder. Returns it with the number of slots.
pub(crate) fn allocate<E: Encoder>(block: &Block) -> (E, usize) {
    let needed = block.needed();
    let mut allocator = Allocator::<E>::new(block, &needed);
    for (base, array) in allocator.bases.iter().enumerate() {
        allocator.code.pointer(Base(base as u8), *array);
    }
    allocator.code.begin();
    for (at, inst) in block.insts.iter().enumerate().filter(|(at, _)| needed[*at]) {
        allocator.inst(at as u32, inst);
    }
    (allocator.code, allocator.slots)
}

/// The registers of a kind are those of `held` in a range; masks of their own come after the vectors.
fn registers<E: Encoder>(mask: bool) -> Range<usize> {
    let vectors = usize::from(E::VECTORS);
    match E::MASKS {
        Masks::Registers(from, to) if mask => vectors + usize::from(from)..vectors + usize::from(to),
        _ => 0..vectors,
    }
}

/// The register at an index of `held`.
fn register<E: Encoder>(index: usize) -> Register {
    let vectors = usize::from(E::VECTORS);
    if index < vectors { Register::Vector(index as u8) } else { Register::Mask((index - vectors) as u8) }
}

/// The index in `held` of a register.
fn index<E: Encoder>(register: Register) -> usize {
    match register {
        Register::Vector(number) => usize::from(number),
        Register::Mask(number) => usize::from(E::VECTORS) + usize::from(number),
    }
}

struct Allocator<'a, E> {
    block: &'a Block,
    code: E,
    /// The uses of each value: those of value `v` are `uses[first[v]..first[v + 1]]`, and `next[v]` counts
    /// those done.
    uses: Vec<u32>,
    first: Vec<u32>,
    next: Vec<u32>,
    /// The value in each register; vectors come before masks.
    held: Vec<Option<u32>>,
    register: Vec<Option<Register>>,
    slot: Vec<Option<u32>>,
    free: Vec<u32>,
    /// Slots whose value the current instruction reads for the last time.
    ending: Vec<u32>,
    /// Lanes that can still be read from memory, because the memory holds what it held before the block, by
    /// location; and lanes that were overwritten.
    lanes: FxHashMap<(Array, u32), u32>,
    gone: Vec<bool>,
    slots: usize,
    /// The arrays that have a register.
    bases: Vec<u32>,
    /// What regions read at their start and end, and those that control is in.
    lists: Lists,
    entered: Vec<Entered>,
    /// The register in which a value should be made: that of the next round.
    preferred: FxHashMap<u32, Register>,
}

impl<'a, E: Encoder> Allocator<'a, E> {
    fn new(block: &'a Block, needed: &[bool]) -> Self {
        let count = block.insts.len();
        let mut first = vec![0u32; count + 1];
        let mut touched = vec![0usize; block.arrays.len()];
        let lists = Lists::of(block, needed);
        let insts = || block.insts.iter().enumerate().filter(|(at, _)| needed[*at]);
        for (_, inst) in insts() {
            lists.read(inst).for_each(|v| first[*v as usize + 1] += 1);
            if let Some(array) = inst.op.array() {
                touched[array.0 as usize] += 1;
            }
        }
        for v in 0..count {
            first[v + 1] += first[v];
        }
        let mut filled = first.clone();
        let mut uses = vec![0; first[count] as usize];
        for (at, inst) in insts() {
            for v in lists.read(inst) {
                let slot = &mut filled[*v as usize];
                uses[*slot as usize] = at as u32;
                *slot += 1;
            }
        }
        let mut order: Vec<u32> = (0..touched.len() as u32).collect();
        order.sort_by_key(|a| std::cmp::Reverse(touched[*a as usize]));
        order.truncate(usize::from(E::BASES));
        Allocator {
            block,
            code: E::default(),
            uses,
            next: first.clone(),
            first,
            held: vec![None; registers::<E>(false).end.max(registers::<E>(true).end)],
            register: vec![None; count],
            slot: vec![None; count],
            free: Vec::new(),
            ending: Vec::new(),
            lanes: FxHashMap::default(),
            gone: vec![false; count],
            slots: 0,
            bases: order,
            lists,
            entered: Vec::new(),
            preferred: FxHashMap::default(),
        }
    }

    fn inst(&mut self, at: u32, inst: &Inst) {
        let args = inst.args();
        match inst.op {
            // Loaded where they are used.
            Op::Lanes(array, word) => {
                self.lanes.insert((array, word), at);
            }
            Op::Word(..) | Op::Constant(_) => {}
            Op::Begin(region) => self.begin(region),
            Op::End(region) => self.end(region),
            // Placed at the start and at the end of their region.
            Op::Carried { .. } => {}
            Op::LanesAt(array, word) => {
                let offset = self.vector(args[0], args);
                self.done(args);
                let to = self.take(false, &[]);
                let from = self.at_offset(array, offset, word);
                self.code.load(to, from);
                self.free.append(&mut self.ending);
                self.hold(to, at);
            }
            Op::StoreAt(array, word) => {
                let (offset, value) = (self.vector(args[0], args), self.vector(args[1], args));
                let to = self.at_offset(array, offset, word);
                self.code.store(value, to);
                self.done(args);
                self.free.append(&mut self.ending);
            }
            Op::Stop => {
                let mask = self.vector(args[0], args);
                self.code.test(mask);
                self.code.stop();
                self.done(args);
                self.free.append(&mut self.ending);
            }
            Op::Choose => {
                let mask = self.operand(args[0], args);
                let no = self.operand(args[2], args);
                let yes = self.last(args[1], args);
                self.give(at, inst, &[mask, no, yes]);
            }
            Op::Fused { .. } => {
                let factor = self.operand(args[1], args);
                let [to] = self.work(false, args);
                // The result overwrites the addend, which may be needed again.
                match self.register[args[0] as usize] {
                    Some(sum) => self.code.copy(to, sum),
                    None => self.fetch(args[0], to),
                }
                let last = self.last(args[2], args);
                self.code.operate(inst.op, to, &[factor, last], Work::default());
                self.finish(at, inst, to, &[to]);
            }
            Op::Store(array, word) => {
                self.rescue(array, word);
                let a = self.vector(args[0], args);
                let to = MemoryOperand::Lanes(self.base(array), word);
                self.code.store(a, to);
                self.done(args);
                self.free.append(&mut self.ending);
            }
            op if E::work(op) != (0, 0) => self.with_work(at, inst),
            Op::LookUp(array, word) => {
                let index = self.operand(args[0], args);
                let table = Operand::Memory(MemoryOperand::Table(self.base(array), word));
                self.give(at, inst, &[index, table]);
            }
            Op::Binary(op) => {
                let (a, b) = self.turned(args[0], args[1], op.commutes());
                let a = self.operand(a, args);
                let b = self.immediate(inst.op, b).unwrap_or_else(|| self.last(b, args));
                self.give(at, inst, &[a, b]);
            }
            // All others have one or two operands. Masks and what is tested for zero are in registers.
            op => match *args {
                [a] if op.takes_mask() || op == Op::NotZero => {
                    let a = self.operand(a, args);
                    self.give(at, inst, &[a]);
                }
                [a, b] if op.takes_mask() => {
                    let (a, b) = (self.operand(a, args), self.operand(b, args));
                    self.give(at, inst, &[a, b]);
                }
                [a] => {
                    let a = self.last(a, args);
                    self.give(at, inst, &[a]);
                }
                [a, b] => {
                    let (a, b) = (self.operand(a, args), self.last(b, args));
                    self.give(at, inst, &[a, b]);
                }
                _ => {}
            },
        }
    }

    /// Loads the old contents of memory into a register if they are needed after the store that comes next.
    fn rescue(&mut self, array: Array, word: u32) {
        if let Some(v) = self.lanes.remove(&(array, word))
            && self.left(v) > 0
        {
            self.vector(v, &[]);
            self.gone[v as usize] = true;
        }
    }

    /// Orders the operands such that the second may stay in memory, if the operation is commutative.
    fn turned(&self, a: u32, b: u32, turns: bool) -> (u32, u32) {
        let in_memory = |v: u32| self.register[v as usize].is_none();
        if turns && in_memory(a) && !in_memory(b) { (b, a) } else { (a, b) }
    }

    /// Ends the uses of an instruction's arguments, assigns a register to its result, and emits the
    /// instruction.
    fn give(&mut self, at: u32, inst: &Inst, args: &[Operand]) {
        self.done(inst.args());
        if self.left(at) > 0 {
            let preferred = self.preferred.get(&at).copied();
            let free = preferred.filter(|register| self.held[index::<E>(*register)].is_none());
            let to = free.unwrap_or_else(|| self.take(inst.op.is_mask(), &[]));
            self.hold(to, at);
            self.code.operate(inst.op, to, args, Work::default());
        }
        // Only now: otherwise a value that had to leave its register could have taken a slot that is still to
        // be read.
        self.free.append(&mut self.ending);
    }

    /// Temporary registers for one operation: vectors or masks.
    fn work<const N: usize>(&mut self, mask: bool, keep: &[u32]) -> [Register; N] {
        std::array::from_fn(|_| self.temporary(mask, keep))
    }

    fn temporary(&mut self, mask: bool, keep: &[u32]) -> Register {
        let taken = self.take(mask, keep);
        self.held[index::<E>(taken)] = Some(TAKEN);
        taken
    }

    /// An operation with all operands in registers, and temporary registers.
    fn with_work(&mut self, at: u32, inst: &Inst) {
        let (args, (vectors, masks)) = (inst.args(), E::work(inst.op));
        let mut operands: Vec<Operand> = args.iter().map(|arg| self.operand(*arg, args)).collect();
        if let Op::LookUp(array, word) | Op::Gather(array, word) = inst.op {
            operands.push(Operand::Memory(MemoryOperand::Table(self.base(array), word)));
        }
        let mut taken: Vec<Register> = (0..vectors).map(|_| self.temporary(false, args)).collect();
        taken.extend((0..masks).map(|_| self.temporary(true, args)));
        let (vectors, masks) = taken.split_at(vectors);
        let Some(to) = vectors.first() else { return };
        self.code.operate(inst.op, *to, &operands, Work { vectors, masks });
        self.finish(at, inst, *to, &taken);
    }

    /// Ends an instruction that left its result in one of its temporary registers.
    fn finish(&mut self, at: u32, inst: &Inst, to: Register, taken: &[Register]) {
        taken.iter().for_each(|register| self.held[index::<E>(*register)] = None);
        self.done(inst.args());
        self.free.append(&mut self.ending);
        if self.left(at) > 0 {
            self.hold(to, at);
        }
    }

    /// Counts the uses of an instruction as done. Values without further uses release their register and
    /// slot.
    fn done(&mut self, args: &[u32]) {
        for v in args {
            let v = *v as usize;
            self.next[v] += 1;
            if self.next[v] >= self.first[v + 1] {
                if let Some(register) = self.register[v].take() {
                    self.held[index::<E>(register)] = None;
                }
                self.ending.extend(self.slot[v].take());
            }
        }
    }

    /// Number of remaining uses of a value.
    fn left(&self, v: u32) -> u32 {
        self.first[v as usize + 1] - self.next[v as usize]
    }

    fn hold(&mut self, register: Register, v: u32) {
        self.held[index::<E>(register)] = Some(v);
        self.register[v as usize] = Some(register);
    }

    /// A free register; another value may have to leave it, but none of those in `keep`.
    fn take(&mut self, mask: bool, keep: &[u32]) -> Register {
        if let Some(free) = self.unused(mask) {
            return register::<E>(free);
        }
        let range = registers::<E>(mask);
        let mut chosen = (range.start, None, 0);
        for at in range {
            let Some(v) = self.held[at] else { continue };
            if v == TAKEN {
                continue;
            }
            let needed = self.uses.get(self.next[v as usize] as usize).copied().unwrap_or(u32::MAX);
            if !keep.contains(&v) && needed >= chosen.2 {
                chosen = (at, Some(v), needed);
            }
        }
        if let (at, Some(v), _) = chosen {
            self.leave(at, v);
        }
        register::<E>(chosen.0)
    }

    fn unused(&self, mask: bool) -> Option<usize> {
        registers::<E>(mask).find(|at| self.held[*at].is_none())
    }

    /// Moves a value out of its register.
    fn leave(&mut self, at: usize, v: u32) {
        self.held[at] = None;
        self.register[v as usize] = None;
        if self.slot[v as usize].is_some() || self.is_source(v) {
            return;
        }
        let slot = self.free_slot();
        self.slot[v as usize] = Some(slot);
        self.code.store(register::<E>(at), MemoryOperand::Slot(slot));
    }

    /// A slot that no value has.
    fn free_slot(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.slots += 1;
            self.slots as u32 - 1
        })
    }

    /// Brings a value or a mask into a register.
    fn vector(&mut self, v: u32, keep: &[u32]) -> Register {
        if let Some(register) = self.register[v as usize] {
            return register;
        }
        let to = self.take(self.block.insts[v as usize].op.is_mask(), keep);
        self.hold(to, v);
        self.fetch(v, to);
        to
    }

    /// The same as an operand.
    fn operand(&mut self, v: u32, keep: &[u32]) -> Operand {
        Operand::Register(self.vector(v, keep))
    }

    /// Loads a value from memory into a register.
    fn fetch(&mut self, v: u32, to: Register) {
        if let Some(home) = self.home(v) {
            self.code.load(to, home);
        }
    }

    /// A value as the last operand, which may be in memory if the machine permits it. It gets a register if
    /// it is needed again and one is free.
    fn last(&mut self, v: u32, keep: &[u32]) -> Operand {
        let again = self.left(v) as usize > keep.iter().filter(|have| **have == v).count();
        if self.register[v as usize].is_some() || again && self.unused(false).is_some() {
            return self.operand(v, keep);
        }
        let Some(home) = self.home(v) else { return self.operand(v, keep) };
        if E::takes(home) {
            return Operand::Memory(home);
        }
        let to = self.take(false, keep);
        self.hold(to, v);
        self.code.load(to, home);
        Operand::Register(to)
    }

    /// A constant that is part of the instruction.
    fn immediate(&self, op: Op, v: u32) -> Option<Operand> {
        match self.block.insts[v as usize].op {
            Op::Constant(bits) if E::immediate(op, bits) => {
                Some(Operand::Memory(MemoryOperand::Constant(bits)))
            }
            _ => None,
        }
    }

    /// Whether a value is in memory already, such as an input or a constant.
    fn is_source(&self, v: u32) -> bool {
        self.block.insts[v as usize].op.is_source() && !self.gone[v as usize]
    }

    /// The memory location of a value.
    fn home(&mut self, v: u32) -> Option<MemoryOperand> {
        if let Some(slot) = self.slot[v as usize] {
            return Some(MemoryOperand::Slot(slot));
        }
        if self.gone[v as usize] {
            return None;
        }
        match self.block.insts[v as usize].op {
            Op::Lanes(array, word) => Some(MemoryOperand::Lanes(self.base(array), word)),
            Op::Word(array, word) => Some(MemoryOperand::Word(self.base(array), word)),
            Op::Constant(bits) => Some(MemoryOperand::Constant(bits)),
            _ => None,
        }
    }

    /// Lanes at an offset, which is in a register.
    fn at_offset(&mut self, array: Array, offset: Register, word: u32) -> MemoryOperand {
        let base = Base(E::BASES);
        self.code.pointer(base, array.0);
        self.code.advance(base, offset);
        MemoryOperand::Lanes(base, word)
    }

    /// The register with the pointer of an array, loaded if it has none of its own.
    fn base(&mut self, array: Array) -> Base {
        if let Some(found) = self.bases.iter().position(|have| *have == array.0) {
            return Base(found as u8);
        }
        self.code.pointer(Base(E::BASES), array.0);
        Base(E::BASES)
    }
}
