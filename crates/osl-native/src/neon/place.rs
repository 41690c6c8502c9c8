//! The base of the code: its arguments, operands in memory, constants after the code, and the loop.
//!
//! Addresses have few bits in an instruction; whatever does not fit is computed first. This module must not
//! know operations.

use super::encode::{Assembler, Skip, V, X, name};
use super::{LANES, VECTOR};
use crate::encoder::{Base, MemoryOperand};
use std::ops::{Deref, DerefMut};

/// The code's arguments, in the registers of the first four parameters: pointers to the arrays, working
/// memory for values without a register, the byte offset of the first lane, and the byte offset after the
/// last.
const POINTERS: X = X(0);
const SLOTS: X = X(1);
const LANE: X = X(2);
const END: X = X(3);
/// The first register for the pointers of the arrays that are used most. The others follow.
const FIRST_BASE: u8 = 4;
/// Number of arrays whose pointers stay in registers.
pub(crate) const KEPT_BASES: u8 = 11;
/// Where the constants are.
const POOL: X = X(15);
/// For the pointer of any other array.
const OTHER_BASE: X = X(16);
/// For addresses. Register 18 belongs to the system.
const ADDRESS: X = X(17);

/// Maximum number of constants in memory: their offsets fit in an instruction.
const MAX_POOL: usize = 1 << 12;

/// The address of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Address {
    /// A register plus a number of bytes.
    At(X, u32),
    /// The sum of two registers.
    Sum(X, X),
}

/// Code under construction: instructions, constants, and what is known while code is made.
#[derive(Clone, Debug, Default)]
pub(super) struct Draft {
    instructions: Assembler,
    pool: Vec<u32>,
    /// Where the address of the constants is computed, and where the loop begins.
    entry: usize,
    start: usize,
    /// The array whose current lane [`ADDRESS`] points to.
    pointed: Option<Base>,
}

fn register(Base(number): Base) -> X {
    if number < KEPT_BASES { X(FIRST_BASE + number) } else { OTHER_BASE }
}

/// Every instruction can be added to the code.
impl Deref for Draft {
    type Target = Assembler;

    fn deref(&self) -> &Assembler {
        &self.instructions
    }
}

impl DerefMut for Draft {
    fn deref_mut(&mut self) -> &mut Assembler {
        &mut self.instructions
    }
}

impl Draft {
    /// Loads the pointer of an array.
    pub(super) fn pointer(&mut self, to: Base, array: u32) {
        if self.pointed == Some(to) {
            self.pointed = None;
        }
        let from = Address::At(POINTERS, 8 * array);
        self.transfer(name::LDR_X, register(to).0, from, 8);
    }

    /// Begins the loop.
    pub(super) fn begin(&mut self) {
        // The distance to the constants is known at the end.
        self.entry = self.here();
        (0..4).for_each(|_| self.push(0));
        self.start = self.here();
    }

    /// Loads a vector; a word fills all lanes.
    pub(super) fn load(&mut self, to: V, from: MemoryOperand) {
        match from {
            MemoryOperand::Constant(bits) => self.constant(to, bits),
            MemoryOperand::Word(base, word) => {
                self.transfer(name::LDR_S, to.0, Address::At(register(base), 4 * word), 4);
                self.two(name::DUP, to, to);
            }
            MemoryOperand::Table(..) => {}
            MemoryOperand::Slot(_) | MemoryOperand::Lanes(..) => {
                let from = self.vector(from);
                self.transfer(name::LDR_Q, to.0, from, VECTOR as u32);
            }
        }
    }

    /// Stores a vector.
    pub(super) fn store(&mut self, from: V, to: MemoryOperand) {
        let to = self.vector(to);
        self.transfer(name::STR_Q, from.0, to, VECTOR as u32);
    }

    /// Loads the words of a table into four registers.
    pub(super) fn load_table(&mut self, first: V, table: MemoryOperand) {
        let MemoryOperand::Table(base, word) = table else { return };
        let (base, offset) = (register(base), 4 * word);
        if offset < 1 << 12 {
            self.add_immediate(ADDRESS, base, offset);
        } else {
            self.set(ADDRESS, offset);
            self.add(ADDRESS, ADDRESS, base);
        }
        self.pointed = None;
        self.load_four(first, ADDRESS);
    }

    /// A constant in all lanes: by an instruction if one has it, else from memory.
    pub(super) fn constant(&mut self, to: V, bits: u32) {
        if self.immediate(to, bits) {
            return;
        }
        let pool = &mut self.pool;
        match pool.iter().position(|have| *have == bits) {
            None if pool.len() == MAX_POOL => {
                self.set(ADDRESS, bits);
                self.pointed = None;
                self.fill(to, ADDRESS);
            }
            found => {
                let number = found.unwrap_or_else(|| {
                    pool.push(bits);
                    pool.len() - 1
                });
                let from = Address::At(POOL, (VECTOR * number) as u32);
                self.transfer(name::LDR_Q, to.0, from, VECTOR as u32);
            }
        }
    }

    /// Skips instructions unless a lane of a mask is set. Overwrites a vector.
    pub(super) fn skip_if_none(&mut self, mask: V, work: V) -> Skip {
        self.two(name::UMAXV, work, mask);
        self.lowest_word(ADDRESS, work);
        self.pointed = None;
        self.skip_if_zero(ADDRESS)
    }

    /// Ends the loop, whose rounds compute a number of vectors, and the code, which its constants follow,
    /// each as a vector. Returns the bytes and the number of instructions.
    pub(super) fn finish(mut self, vectors: usize) -> (Vec<u8>, usize) {
        self.add_immediate(LANE, LANE, (VECTOR * vectors) as u32);
        self.compare(LANE, END);
        let start = self.start;
        self.repeat_if_below(start);
        self.push(name::RET);
        let instructions = self.here();
        while !self.here().is_multiple_of(LANES) {
            self.push(0);
        }
        // POOL = the address of this instruction, plus the distance from there.
        let entry = self.entry;
        let distance = 4 * (self.here() - entry) as u32;
        let mut begin = Assembler::default();
        begin.address_of_this(ADDRESS);
        begin.set_both(POOL, distance);
        begin.add(POOL, POOL, ADDRESS);
        self.replace(entry, &begin);
        let pool = std::mem::take(&mut self.pool);
        pool.iter().for_each(|bits| (0..LANES).for_each(|_| self.push(*bits)));
        (self.bytes(), instructions)
    }

    /// The address of a vector.
    fn vector(&mut self, operand: MemoryOperand) -> Address {
        match operand {
            MemoryOperand::Lanes(base, 0) => Address::Sum(register(base), LANE),
            MemoryOperand::Lanes(base, word) => {
                let (from, offset) = (register(base), 4 * word);
                if !fits(offset, VECTOR as u32) {
                    self.set(ADDRESS, offset);
                    self.add(ADDRESS, ADDRESS, LANE);
                    self.pointed = None;
                    return Address::Sum(from, ADDRESS);
                }
                if self.pointed != Some(base) {
                    self.add(ADDRESS, from, LANE);
                    self.pointed = Some(base);
                }
                Address::At(ADDRESS, offset)
            }
            MemoryOperand::Slot(slot) => Address::At(SLOTS, slot * VECTOR as u32),
            // Constants, words and tables have their own instructions.
            _ => Address::At(SLOTS, 0),
        }
    }

    /// Loads or stores a register of some bytes.
    fn transfer(&mut self, op: name::Transfer, number: u8, address: Address, bytes: u32) {
        match address {
            Address::At(base, offset) if fits(offset, bytes) => {
                self.transfer_at(op, number, base, offset / bytes);
            }
            Address::At(base, offset) => {
                self.set(ADDRESS, offset);
                self.pointed = None;
                self.transfer_sum(op, number, base, ADDRESS);
            }
            Address::Sum(base, other) => self.transfer_sum(op, number, base, other),
        }
    }
}

/// Whether an offset fits in an instruction that transfers some bytes.
fn fits(offset: u32, bytes: u32) -> bool {
    offset.is_multiple_of(bytes) && offset / bytes < 1 << 12
}
