//! What the allocator must know about a kind of machine, and how it hands over operations.
//!
//! An [`Encoder`] writes instructions for registers and memory that the allocator has chosen. It says how
//! many lanes and registers there are, where masks live, and which operands an instruction can read from
//! memory. A further machine is a further encoder: the block, the allocator, constants and tables do not
//! depend on the number of lanes. An encoder without jumps has no code for blocks with regions.

use crate::inst::Op;

/// Where masks are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Masks {
    /// Registers of their own, with the numbers from the first up to the second.
    Registers(u8, u8),
    /// Vector registers: a lane is all ones or all zeros.
    Vectors,
}

/// A register, by its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Register {
    Vector(u8),
    /// Only for [`Masks::Registers`].
    Mask(u8),
}

impl Register {
    pub(crate) fn number(self) -> u8 {
        let (Register::Vector(number) | Register::Mask(number)) = self;
        number
    }
}

/// Where the pointer of an array is: in one of [`Encoder::BASES`] registers that keep pointers, or after all
/// of these in the one that is loaded where it is needed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Base(pub(crate) u8);

/// An operand in memory. Words count from the start of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MemoryOperand {
    /// A vector of working memory, by its number.
    Slot(u32),
    /// The current lanes of an array. The first lane is at this word of the array.
    Lanes(Base, u32),
    /// A word of an array, for all lanes.
    Word(Base, u32),
    /// A table of [`TABLE`](crate::TABLE) words in an array.
    Table(Base, u32),
    /// A constant, for all lanes.
    Constant(u32),
}

/// An operand of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operand {
    Register(Register),
    Memory(MemoryOperand),
}

impl Operand {
    /// The number of its register; 0 if it is in memory.
    pub(crate) fn number(self) -> u8 {
        if let Operand::Register(register) = self { register.number() } else { 0 }
    }
}

/// Registers that an operation may overwrite: vectors and masks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work<'a> {
    pub(crate) vectors: &'a [Register],
    pub(crate) masks: &'a [Register],
}

/// Writes the instructions of a kind of machine.
pub(crate) trait Encoder: Default {
    /// Lanes per vector.
    const LANES: usize;
    /// Number of vector registers.
    const VECTORS: u8;
    /// Where masks are kept.
    const MASKS: Masks;
    /// Number of registers for pointers of arrays.
    const BASES: u8;
    /// Whether it writes the jumps of regions, and addresses that depend on values.
    const JUMPS: bool = false;

    /// Whether the last operand of an operation may be this one in memory.
    fn takes(operand: MemoryOperand) -> bool;
    /// Whether a constant as the last operand of an operation on two values is part of the instruction. It
    /// then never takes a register.
    fn immediate(_op: Op, _bits: u32) -> bool {
        false
    }
    /// How many vectors and masks an operation overwrites. If there are any, its operands are in registers,
    /// and its result is the first vector. Not for [`Op::Choose`] and [`Op::Fused`].
    fn work(op: Op) -> (usize, usize);

    /// Loads the pointer of an array.
    fn pointer(&mut self, to: Base, array: u32);
    /// Begins the loop over the lanes.
    fn begin(&mut self);
    /// Loads a register.
    fn load(&mut self, to: Register, from: MemoryOperand);
    /// Stores a register.
    fn store(&mut self, from: Register, to: MemoryOperand);
    /// Copies a register to another of its kind.
    fn copy(&mut self, to: Register, from: Register);
    /// An operation. Its operands are in registers, except that of the table of [`Op::LookUp`] and the last
    /// one, which may be where [`Encoder::takes`] permits. The first operand of [`Op::Fused`] is in `to`, and
    /// not among `args`. For [`Op::Choose`] the last operand is the value of set lanes.
    fn operate(&mut self, op: Op, to: Register, args: &[Operand], work: Work<'_>);
    /// Adds the first word of a vector to a pointer, as a number of words.
    fn advance(&mut self, _base: Base, _offset: Register) {}
    /// A place to which [`Encoder::jump_back`] leads.
    fn label(&mut self) -> usize {
        0
    }
    /// Takes a cost from the budget; then, if it `may_stop`, stops the code if the budget is exceeded.
    fn spend(&mut self, _cost: u32, _may_stop: bool) {}
    /// Compares a mask with "no lane", for the next jump or stop. Loads, stores and copies may come between.
    fn test(&mut self, _mask: Register) {}
    /// Stops the code if the tested mask had a lane.
    fn stop(&mut self) {}
    /// Jumps forward if the tested mask had no lane. Returns the argument for [`Encoder::land`].
    fn skip(&mut self) -> usize {
        0
    }
    /// Where a jump forward leads.
    fn land(&mut self, _skip: usize) {}
    /// Jumps to a label if the tested mask had a lane.
    fn jump_back(&mut self, _label: usize) {}
    /// Ends the loop over the lanes, whose rounds compute a number of vectors, and the code. Returns the
    /// bytes and the number of instructions.
    fn finish(self, vectors: usize) -> (Vec<u8>, usize);
}
