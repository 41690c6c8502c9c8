//! Code for aarch64 with NEON: vectors of 4 lanes in 32 registers, with masks among them.
//!
//! A mask has all bits of a lane set, or none. Instructions have no operands in memory: an operand there is
//! loaded first, into one of the four registers that the allocator does not see. `encode` has the words of
//! instructions, `place` the registers for addresses, operands in memory and the loop, and `steps` the
//! operations of several instructions.

mod encode;
mod place;
mod steps;

use crate::encoder::{Base, Encoder, Masks, MemoryOperand, Operand, Register, Work};
use crate::inst::{Binary, Compare, IntCompare, Op, Unary};
use encode::{V, name};
use place::Draft;

const LANES: usize = 4;
/// Bytes per vector.
const VECTOR: usize = 4 * LANES;
/// The bits of infinity, of the sign, and of all but the sign.
const INFINITY: u32 = 0x7F80_0000;
const SIGN: u32 = 0x8000_0000;
const MAGNITUDE: u32 = 0x7FFF_FFFF;
/// Registers that every operation may overwrite. They follow each other, since a table fills all of them.
const SPARE: [V; 4] = [V(28), V(29), V(30), V(31)];

/// Whether this machine can run the code. Every aarch64 processor has the instructions; the loading of code
/// is known for Linux.
pub(crate) fn is_supported() -> bool {
    cfg!(all(target_arch = "aarch64", target_endian = "little", target_os = "linux"))
}

/// The instructions of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neon {
    code: Draft,
}

impl Neon {
    /// The register of an operand; one in memory is loaded into `spare`.
    fn value(&mut self, operand: Operand, spare: V) -> V {
        match operand {
            Operand::Register(register) => V(register.number()),
            Operand::Memory(from) => {
                self.code.load(spare, from);
                spare
            }
        }
    }

    fn unary(&mut self, op: Unary, to: V, x: V) {
        let name = match op {
            Unary::Sqrt => name::FSQRT,
            Unary::Floor => name::FRINTM,
            Unary::Ceil => name::FRINTP,
            Unary::Trunc => name::FRINTZ,
            Unary::ToFloat => name::SCVTF,
            Unary::IntAbs => name::ABS,
            Unary::InverseRoot => return steps::inverse_root(&mut self.code, to, x),
            Unary::HighProduct(factor) => return steps::high_product(&mut self.code, to, x, factor),
            Unary::ToInt => return steps::to_int(&mut self.code, to, x),
        };
        self.code.two(name, to, x);
    }

    fn binary(&mut self, op: Binary, to: V, x: V, y: Operand) {
        if let Operand::Memory(MemoryOperand::Constant(bits)) = y
            && self.with_immediate(op, to, x, bits)
        {
            return;
        }
        let y = self.value(y, SPARE[3]);
        let name = match op {
            Binary::Add => name::FADD,
            Binary::Sub => name::FSUB,
            Binary::Mul => name::FMUL,
            Binary::Div => name::FDIV,
            Binary::IntAdd => name::ADD,
            Binary::IntSub => name::SUB,
            Binary::IntMul => name::MUL,
            Binary::IntMin => name::SMIN,
            Binary::IntMax => name::SMAX,
            Binary::WordMin => name::UMIN,
            Binary::And => name::AND,
            Binary::Or => name::ORR,
            Binary::Xor => name::EOR,
            Binary::Min => return steps::min(&mut self.code, to, x, y),
            Binary::Shl => return steps::shift_left(&mut self.code, to, x, y),
            Binary::Shr => return steps::shift_right(&mut self.code, to, x, y),
        };
        self.code.three(name, to, x, y);
    }

    /// An operation whose last operand is part of the instruction. Returns false if there is none such.
    fn with_immediate(&mut self, op: Binary, to: V, x: V, bits: u32) -> bool {
        match (op, bits) {
            (Binary::Shl, distance @ 0..32) => self.code.shift_left(to, x, distance),
            // A shift by no bit has no encoding.
            (Binary::Shr, 0) => self.code.copy(to, x),
            (Binary::Shr, distance @ 1..32) => self.code.shift_right(name::SSHR, to, x, distance),
            (Binary::And, MAGNITUDE) => self.code.two(name::FABS, to, x),
            (Binary::Xor, SIGN) => self.code.two(name::FNEG, to, x),
            _ => return false,
        }
        true
    }

    fn compare(&mut self, how: Compare, to: V, x: V, y: V) {
        let (name, x, y, inverted) = match how {
            Compare::Equal => (name::FCMEQ, x, y, false),
            Compare::UnequalOrNan => (name::FCMEQ, x, y, true),
            Compare::Greater => (name::FCMGT, x, y, false),
            Compare::LessEqualOrNan => (name::FCMGT, x, y, true),
            Compare::GreaterEqual => (name::FCMGE, x, y, false),
            Compare::LessOrNan => (name::FCMGE, x, y, true),
            Compare::Less => (name::FCMGT, y, x, false),
            Compare::GreaterEqualOrNan => (name::FCMGT, y, x, true),
            Compare::LessEqual => (name::FCMGE, y, x, false),
            Compare::GreaterOrNan => (name::FCMGE, y, x, true),
            Compare::EqualOrNan => return steps::equal_or_nan(&mut self.code, to, x, y),
        };
        self.code.three(name, to, x, y);
        if inverted {
            self.code.two(name::NOT, to, to);
        }
    }

    fn compare_ints(&mut self, how: IntCompare, to: V, x: V, y: V) {
        match how {
            IntCompare::Equal | IntCompare::Unequal => self.code.three(name::CMEQ, to, x, y),
            IntCompare::Less => self.code.three(name::CMGT, to, y, x),
            IntCompare::LessEqual => self.code.three(name::CMGE, to, y, x),
        }
        if how == IntCompare::Unequal {
            self.code.two(name::NOT, to, to);
        }
    }
}

impl Encoder for Neon {
    const LANES: usize = LANES;
    const VECTORS: u8 = SPARE[0].0;
    const MASKS: Masks = Masks::Vectors;
    const BASES: u8 = place::KEPT_BASES;

    fn takes(_: MemoryOperand) -> bool {
        // Any is loaded into a spare register.
        true
    }

    fn immediate(op: Op, bits: u32) -> bool {
        matches!(
            (op, bits),
            (Op::Binary(Binary::Shl | Binary::Shr), 0..32)
                | (Op::Binary(Binary::And), MAGNITUDE)
                | (Op::Binary(Binary::Xor), SIGN)
        )
    }

    fn work(op: Op) -> (usize, usize) {
        // Its result is written before the last operand is read.
        if op == Op::Length { (1, 0) } else { (0, 0) }
    }

    fn pointer(&mut self, to: Base, array: u32) {
        self.code.pointer(to, array);
    }

    fn begin(&mut self) {
        self.code.begin();
    }

    fn load(&mut self, to: Register, from: MemoryOperand) {
        self.code.load(V(to.number()), from);
    }

    fn store(&mut self, from: Register, to: MemoryOperand) {
        self.code.store(V(from.number()), to);
    }

    fn copy(&mut self, to: Register, from: Register) {
        self.code.copy(V(to.number()), V(from.number()));
    }

    fn operate(&mut self, op: Op, to: Register, args: &[Operand], _: Work<'_>) {
        let to = V(to.number());
        let register = |operand: Operand| V(operand.number());
        match (op, args) {
            (Op::Length, &[root, square, x, y, z]) => {
                let sum = [root, square].map(register);
                steps::length(&mut self.code, to, sum, [x, y, z].map(register));
            }
            (Op::LookUp(..), &[index, Operand::Memory(table)]) => {
                steps::look_up(&mut self.code, to, register(index), table);
            }
            (Op::Unary(op), &[x]) => {
                let x = self.value(x, to);
                self.unary(op, to, x);
            }
            (Op::Binary(op), &[x, y]) => self.binary(op, to, register(x), y),
            (Op::Compare(how), &[x, y]) => {
                let y = self.value(y, SPARE[3]);
                self.compare(how, to, register(x), y);
            }
            (Op::IntCompare(how), &[x, y]) => {
                let y = self.value(y, SPARE[3]);
                self.compare_ints(how, to, register(x), y);
            }
            (Op::NotZero, &[x]) => self.code.three(name::CMTST, to, register(x), register(x)),
            (Op::Class { nan, infinite }, &[x]) => {
                let x = self.value(x, to);
                steps::class(&mut self.code, to, x, (nan, infinite));
            }
            (Op::MaskAnd, &[a, b]) => self.code.three(name::AND, to, register(a), register(b)),
            (Op::MaskOr, &[a, b]) => self.code.three(name::ORR, to, register(a), register(b)),
            (Op::MaskNot, &[a]) => self.code.two(name::NOT, to, register(a)),
            (Op::Choose, &[mask, no, yes]) => {
                let (mask, no) = (register(mask), register(no));
                let yes = self.value(yes, if to == mask || to == no { SPARE[3] } else { to });
                self.code.choose(to, mask, yes, no);
            }
            (Op::Fused { less }, &[x, y]) => {
                let y = self.value(y, SPARE[3]);
                self.code.three(if less { name::FMLS } else { name::FMLA }, to, register(x), y);
            }
            (Op::Number, &[mask]) => self.code.shift_right(name::USHR, to, register(mask), 31),
            // The allocator gives every operation its operands. The others are memory.
            _ => {}
        }
    }

    fn finish(self, vectors: usize) -> (Vec<u8>, usize) {
        self.code.finish(vectors)
    }
}
