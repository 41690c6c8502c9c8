//! Turns a block into code: assigns registers to values and emits the instructions in order.
//!
//! The value needed next keeps its register. If there are too few registers, the value that is needed last
//! gives up its register (Belady 1966) and moves to memory, unless it is there already. This module must not
//! know where arrays are or who provides them.

use crate::block::{Array, Binary, Block, Compare, Inst, IntCompare, Op, Unary};
use crate::encode::{Assembler, Gpr, K, Mem, Opcode, Rm, Zmm, name};
use crate::rare;
use rustc_hash::FxHashMap;

/// The code's arguments, in the registers of the first four parameters: pointers to the arrays, working
/// memory for values without a register, the byte offset of the first lane, and the byte offset after the
/// last.
const POINTERS: Gpr = Gpr::RDI;
const SLOTS: Gpr = Gpr::RSI;
const LANE: Gpr = Gpr::RDX;
const END: Gpr = Gpr::RCX;
/// Holds the pointer of the array that an instruction uses, if that array has no register of its own.
const ARRAY: Gpr = Gpr::RAX;
/// Caller-saved registers, for the arrays that are used most.
const BASES: [Gpr; 4] = [Gpr(8), Gpr(9), Gpr(10), Gpr(11)];

/// Lanes per vector.
pub(crate) const LANES: usize = 16;
/// Bytes per vector and per slot.
const VECTOR: usize = 4 * LANES;

/// Masks are numbered after the vectors; mask 0 means "no mask".
const VECTORS: usize = 32;
const REGISTERS: usize = VECTORS + 8;
const FIRST_MASK: usize = VECTORS + 1;

/// Marks a register that an instruction uses as a temporary.
const TAKEN: u32 = u32::MAX;

/// Code as bytes, and the number of slots it needs.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// The instructions, followed by the constants that they read.
    pub bytes: Vec<u8>,
    /// Number of vectors of working memory.
    pub slots: usize,
}

/// Assembles the code of a block, whether or not this machine can run it, so that it can be inspected or
/// emulated.
///
/// The code takes four arguments, in the usual registers: the address of the array pointers, the address of
/// its slots, the byte offset of the first lane, and the byte offset after the last.
pub fn assemble(block: &Block) -> Assembled {
    let mut allocator = Allocator::new(block);
    for (slot, array) in allocator.bases.into_iter().enumerate() {
        if let Some(array) = array {
            allocator.code.pointer(BASES[slot], POINTERS, 8 * array as i32);
        }
    }
    let start = allocator.code.here();
    for (at, inst) in block.insts.iter().enumerate() {
        allocator.inst(at as u32, inst);
    }
    let Allocator { mut code, slots, .. } = allocator;
    code.count_and_return(LANE, VECTOR as i8, END, start);
    Assembled { bytes: code.finish(), slots }
}

struct Allocator<'a> {
    block: &'a Block,
    code: Assembler,
    /// The uses of each value: those of value `v` are `uses[first[v]..first[v + 1]]`, and `next[v]` counts
    /// those done.
    uses: Vec<u32>,
    first: Vec<u32>,
    next: Vec<u32>,
    /// The value in each register; vectors come before masks.
    held: [Option<u32>; REGISTERS],
    register: Vec<Option<u8>>,
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
    bases: [Option<u32>; 4],
}

impl<'a> Allocator<'a> {
    fn new(block: &'a Block) -> Allocator<'a> {
        let count = block.insts.len();
        let mut first = vec![0u32; count + 1];
        let mut touched = vec![0usize; block.arrays.len()];
        for inst in &block.insts {
            inst.args().iter().for_each(|v| first[*v as usize + 1] += 1);
            if let Op::Lanes(a, _) | Op::Word(a, _) | Op::LookUp(a, _) | Op::Store(a, _) = inst.op {
                touched[a.0 as usize] += 1;
            }
        }
        for v in 0..count {
            first[v + 1] += first[v];
        }
        let mut filled = first.clone();
        let mut uses = vec![0; first[count] as usize];
        for (at, inst) in block.insts.iter().enumerate() {
            for v in inst.args() {
                let slot = &mut filled[*v as usize];
                uses[*slot as usize] = at as u32;
                *slot += 1;
            }
        }
        let mut order: Vec<u32> = (0..touched.len() as u32).collect();
        order.sort_by_key(|a| std::cmp::Reverse(touched[*a as usize]));
        let bases = std::array::from_fn(|n| order.get(n).copied());
        Allocator {
            block,
            code: Assembler::default(),
            uses,
            next: first.clone(),
            first,
            held: [None; REGISTERS],
            register: vec![None; count],
            slot: vec![None; count],
            free: Vec::new(),
            ending: Vec::new(),
            lanes: FxHashMap::default(),
            gone: vec![false; count],
            slots: 0,
            bases,
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
            Op::Unary(Unary::InverseRoot) => self.inverse_root(at, inst),
            Op::Length => self.length(at, inst),
            Op::Unary(op) => {
                let rm = self.last(args[0], args);
                let (op, imm) = unary(op);
                self.give(at, inst, |code, to| code.evex(op, to, None, rm, K(0), false, imm));
            }
            Op::Binary(op) => {
                let (op, turns) = binary(op);
                let (a, b) = self.turned(args[0], args[1], turns);
                let a = self.vector(a, args);
                let b = self.last(b, args);
                self.give(at, inst, |code, to| code.evex(op, to, Some(a), b, K(0), false, None));
            }
            Op::LookUp(array, word) => {
                let index = self.vector(args[0], args);
                let table = Rm::Lanes(self.memory(array, word, false));
                self.give(at, inst, |code, to| {
                    code.evex(name::VPERMD, to, Some(index), table, K(0), false, None);
                });
            }
            Op::Compare(how) => self.compare(at, inst, name::VCMPPS, predicate(how)),
            Op::IntCompare(how) => self.compare(at, inst, name::VPCMPD, int_predicate(how)),
            Op::NotZero => {
                let a = self.vector(args[0], args);
                self.give(at, inst, |code, to| {
                    code.evex(name::VPTESTMD, to, Some(a), Rm::Zmm(a), K(0), false, None);
                });
            }
            Op::Class { nan, infinite } => {
                let rm = self.last(args[0], args);
                // Quiet and signaling NaN, and both infinities.
                let classes = if nan { 0x81 } else { 0 } | if infinite { 0x18 } else { 0 };
                self.give(at, inst, |code, to| {
                    code.evex(name::VFPCLASSPS, to, None, rm, K(0), false, Some(classes));
                });
            }
            Op::TruthAnd | Op::TruthOr => {
                let (a, b) = (self.truth(args[0], args), self.truth(args[1], args));
                let op = if inst.op == Op::TruthAnd { name::KANDW } else { name::KORW };
                self.give(at, inst, |code, to| code.mask(op, K(to), Some(a), b));
            }
            Op::TruthNot => {
                let a = self.truth(args[0], args);
                self.give(at, inst, |code, to| code.mask(name::KNOTW, K(to), None, a));
            }
            Op::Choose => {
                let truth = self.truth(args[0], args);
                let no = self.vector(args[2], args);
                let yes = self.last(args[1], args);
                self.give(at, inst, |code, to| {
                    code.evex(name::VPBLENDMD, to, Some(no), yes, truth, false, None);
                });
            }
            Op::Fused { less } => {
                let factor = self.vector(args[1], args);
                let [to] = self.work(false, args).map(Zmm);
                // The result overwrites the addend, which may be needed again.
                match self.register[args[0] as usize] {
                    Some(sum) => self.code.copy(to, Zmm(sum)),
                    None => self.fetch(args[0], to),
                }
                let last = self.last(args[2], args);
                let op = if less { name::VFNMADD231PS } else { name::VFMADD231PS };
                self.code.evex(op, to.0, Some(factor), last, K(0), false, None);
                self.finish(at, inst, to, &[to], &[]);
            }
            Op::Number => {
                let truth = self.truth(args[0], args);
                let one = Rm::Lanes(Mem::Pool(self.code.constant(1)));
                self.give(at, inst, |code, to| {
                    code.evex(name::VBROADCASTSS, to, None, one, truth, true, None);
                });
            }
            Op::Store(array, word) => {
                self.rescue(array, word);
                let a = self.vector(args[0], args);
                let to = Rm::Lanes(self.memory(array, word, true));
                self.code.evex(name::VMOVDQU32_STORE, a.0, None, to, K(0), false, None);
                self.done(args);
                self.free.append(&mut self.ending);
            }
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

    fn compare(&mut self, at: u32, inst: &Inst, op: Opcode, predicate: u8) {
        let args = inst.args();
        let (a, b) = (self.vector(args[0], args), self.last(args[1], args));
        self.give(at, inst, |code, to| code.evex(op, to, Some(a), b, K(0), false, Some(predicate)));
    }

    /// Orders the operands such that the second may stay in memory, if the operation is commutative.
    fn turned(&self, a: u32, b: u32, turns: bool) -> (u32, u32) {
        let in_memory = |v: u32| self.register[v as usize].is_none();
        if turns && in_memory(a) && !in_memory(b) { (b, a) } else { (a, b) }
    }

    /// Ends the uses of an instruction's arguments, assigns a register to its result, and emits the
    /// instruction.
    fn give(&mut self, at: u32, inst: &Inst, write: impl FnOnce(&mut Assembler, u8)) {
        self.done(inst.args());
        if self.left(at) > 0 {
            let to = self.take(inst.op.is_truth(), &[]);
            self.hold(to, at);
            write(&mut self.code, (to % VECTORS) as u8);
        }
        // Only now: otherwise a value that had to leave its register could have taken a slot that is still to
        // be read.
        self.free.append(&mut self.ending);
    }

    /// Temporary registers for one operation: vectors or masks.
    fn work<const N: usize>(&mut self, truth: bool, keep: &[u32]) -> [u8; N] {
        std::array::from_fn(|_| {
            let register = self.take(truth, keep);
            self.held[register] = Some(TAKEN);
            (register % VECTORS) as u8
        })
    }

    fn inverse_root(&mut self, at: u32, inst: &Inst) {
        let args = inst.args();
        let x = self.vector(args[0], args);
        let [a, b, c] = self.work(false, args).map(Zmm);
        let [low, high] = self.work(true, args).map(K);
        rare::inverse_root(&mut self.code, x, [a, b, c], [low, high]);
        self.finish(at, inst, a, &[a, b, c], &[low, high]);
    }

    fn length(&mut self, at: u32, inst: &Inst) {
        let args = inst.args();
        let [root, square, x, y, z] = [0, 1, 2, 3, 4].map(|n| self.vector(args[n], args));
        let [to, a, b, c, d] = self.work(false, args).map(Zmm);
        let [small, other] = self.work(true, args).map(K);
        rare::length(&mut self.code, (to, root, square), [x, y, z], [a, b, c, d], [small, other]);
        self.finish(at, inst, to, &[to, a, b, c, d], &[small, other]);
    }

    /// Ends an instruction that left its result in one of its temporary registers.
    fn finish(&mut self, at: u32, inst: &Inst, to: Zmm, vectors: &[Zmm], masks: &[K]) {
        vectors.iter().for_each(|z| self.held[usize::from(z.0)] = None);
        masks.iter().for_each(|k| self.held[VECTORS + usize::from(k.0)] = None);
        self.done(inst.args());
        self.free.append(&mut self.ending);
        if self.left(at) > 0 {
            self.hold(usize::from(to.0), at);
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
                    self.held[usize::from(register)] = None;
                }
                self.ending.extend(self.slot[v].take());
            }
        }
    }

    /// Number of remaining uses of a value.
    fn left(&self, v: u32) -> u32 {
        self.first[v as usize + 1] - self.next[v as usize]
    }

    fn hold(&mut self, register: usize, v: u32) {
        self.held[register] = Some(v);
        self.register[v as usize] = Some(register as u8);
    }

    /// A free register; another value may have to leave it, but none of those in `keep`.
    fn take(&mut self, truth: bool, keep: &[u32]) -> usize {
        if let Some(free) = self.unused(truth) {
            return free;
        }
        let range = if truth { FIRST_MASK..REGISTERS } else { 0..VECTORS };
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
        chosen.0
    }

    fn unused(&self, truth: bool) -> Option<usize> {
        let range = if truth { FIRST_MASK..REGISTERS } else { 0..VECTORS };
        range.into_iter().find(|at| self.held[*at].is_none())
    }

    /// Moves a value out of its register.
    fn leave(&mut self, register: usize, v: u32) {
        self.held[register] = None;
        self.register[v as usize] = None;
        if self.slot[v as usize].is_some() || self.is_source(v) {
            return;
        }
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots += 1;
            self.slots as u32 - 1
        });
        self.slot[v as usize] = Some(slot);
        let mem = slot_memory(slot);
        if register >= VECTORS {
            self.code.mask_memory(name::KMOVW_STORE, K((register - VECTORS) as u8), mem);
        } else {
            self.code.evex(name::VMOVDQU32_STORE, register as u8, None, Rm::Lanes(mem), K(0), false, None);
        }
    }

    /// Brings a mask into a register.
    fn truth(&mut self, v: u32, keep: &[u32]) -> K {
        if let Some(register) = self.register[v as usize] {
            return K(register - VECTORS as u8);
        }
        let to = self.take(true, keep);
        self.hold(to, v);
        let k = K((to - VECTORS) as u8);
        if let Some(slot) = self.slot[v as usize] {
            self.code.mask_memory(name::KMOVW_LOAD, k, slot_memory(slot));
        }
        k
    }

    /// Brings a value into a register.
    fn vector(&mut self, v: u32, keep: &[u32]) -> Zmm {
        if let Some(register) = self.register[v as usize] {
            return Zmm(register);
        }
        let to = self.take(false, keep);
        self.hold(to, v);
        self.fetch(v, Zmm(to as u8));
        Zmm(to as u8)
    }

    /// Loads a value from memory into a register.
    fn fetch(&mut self, v: u32, to: Zmm) {
        match self.home(v) {
            Some(Rm::Word(mem)) => {
                self.code.evex(name::VBROADCASTSS, to.0, None, Rm::Lanes(mem), K(0), false, None)
            }
            Some(rm) => self.code.evex(name::VMOVDQU32, to.0, None, rm, K(0), false, None),
            None => {}
        }
    }

    /// A value as the last operand, which may be in memory. It gets a register if it is needed again and one
    /// is free.
    fn last(&mut self, v: u32, keep: &[u32]) -> Rm {
        let again = self.left(v) as usize > keep.iter().filter(|have| **have == v).count();
        if self.register[v as usize].is_some() || again && self.unused(false).is_some() {
            return Rm::Zmm(self.vector(v, keep));
        }
        match self.home(v) {
            Some(home) => home,
            None => Rm::Zmm(self.vector(v, keep)),
        }
    }

    /// Whether a value is in memory already, such as an input or a constant.
    fn is_source(&self, v: u32) -> bool {
        self.block.insts[v as usize].op.is_source() && !self.gone[v as usize]
    }

    /// The memory location of a value.
    fn home(&mut self, v: u32) -> Option<Rm> {
        if let Some(slot) = self.slot[v as usize] {
            return Some(Rm::Lanes(slot_memory(slot)));
        }
        if self.gone[v as usize] {
            return None;
        }
        match self.block.insts[v as usize].op {
            Op::Lanes(array, word) => Some(Rm::Lanes(self.memory(array, word, true))),
            Op::Word(array, word) => Some(Rm::Word(self.memory(array, word, false))),
            Op::Constant(bits) => Some(Rm::Word(Mem::Pool(self.code.constant(bits)))),
            _ => None,
        }
    }

    /// A word of an array, or the word of the first current lane.
    fn memory(&mut self, array: Array, word: u32, lanes: bool) -> Mem {
        let base = match self.bases.iter().position(|have| *have == Some(array.0)) {
            Some(found) => BASES[found],
            None => {
                self.code.pointer(ARRAY, POINTERS, 8 * array.0 as i32);
                ARRAY
            }
        };
        let byte = 4 * word as i32;
        if lanes { Mem::Indexed(base, LANE, byte) } else { Mem::At(base, byte) }
    }
}

fn slot_memory(slot: u32) -> Mem {
    Mem::At(SLOTS, slot as i32 * VECTOR as i32)
}

/// The instruction, and the rounding mode of those that round.
fn unary(op: Unary) -> (Opcode, Option<u8>) {
    // Suppresses the precision exception.
    const QUIET: u8 = 8;
    match op {
        Unary::Sqrt | Unary::InverseRoot => (name::VSQRTPS, None),
        Unary::Floor => (name::VRNDSCALEPS, Some(QUIET | 1)),
        Unary::Ceil => (name::VRNDSCALEPS, Some(QUIET | 2)),
        Unary::Trunc => (name::VRNDSCALEPS, Some(QUIET | 3)),
        Unary::ToFloat => (name::VCVTDQ2PS, None),
        Unary::ToInt => (name::VCVTTPS2DQ, None),
        Unary::IntAbs => (name::VPABSD, None),
    }
}

/// The instruction, and whether it is commutative.
fn binary(op: Binary) -> (Opcode, bool) {
    match op {
        Binary::Add => (name::VADDPS, true),
        Binary::Sub => (name::VSUBPS, false),
        Binary::Mul => (name::VMULPS, true),
        Binary::Div => (name::VDIVPS, false),
        Binary::Min => (name::VMINPS, false),
        Binary::IntAdd => (name::VPADDD, true),
        Binary::IntSub => (name::VPSUBD, false),
        Binary::IntMul => (name::VPMULLD, true),
        Binary::IntMin => (name::VPMINSD, true),
        Binary::IntMax => (name::VPMAXSD, true),
        Binary::And => (name::VPANDD, true),
        Binary::Or => (name::VPORD, true),
        Binary::Xor => (name::VPXORD, true),
        Binary::Shl => (name::VPSLLVD, false),
        Binary::Shr => (name::VPSRAVD, false),
    }
}

fn predicate(how: Compare) -> u8 {
    match how {
        Compare::Equal => 0x00,
        Compare::Less => 0x01,
        Compare::LessEqual => 0x02,
        Compare::UnequalOrNan => 0x04,
        Compare::GreaterEqualOrNan => 0x05,
        Compare::GreaterOrNan => 0x06,
        Compare::EqualOrNan => 0x08,
        Compare::LessOrNan => 0x09,
        Compare::LessEqualOrNan => 0x0A,
        Compare::GreaterEqual => 0x0D,
        Compare::Greater => 0x0E,
    }
}

fn int_predicate(how: IntCompare) -> u8 {
    match how {
        IntCompare::Equal => 0,
        IntCompare::Less => 1,
        IntCompare::LessEqual => 2,
        IntCompare::Unequal => 4,
    }
}
