//! Code for x86-64 with AVX2 and FMA: vectors of 8 lanes in 16 registers, with masks among them.
//!
//! A mask has all bits of a lane set, or none. `encode` has the bytes of instructions, and `rare` the
//! operations with a seldom taken path.

mod encode;
mod rare;

use crate::encoder::{Base, Encoder, Masks, MemoryOperand, Operand, Register, Work};
use crate::inst::{Binary, IntCompare, Op, Unary};
use crate::x86::{Assembler, CEIL, FLOOR, Jump, KEPT_BASES, Mem, Opcode, TRUNC, predicate};
use encode::{Rm, Shift, Ymm, name};

const LANES: usize = 8;
/// Bytes per vector.
const VECTOR: usize = 4 * LANES;
/// The bits of infinity, and of all but the sign.
const INFINITY: u32 = 0x7F80_0000;
const MAGNITUDE: u32 = 0x7FFF_FFFF;

/// Whether this machine can run the code.
pub(crate) fn is_supported() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

/// The instructions of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Avx2 {
    code: Assembler,
    /// Where the loop begins.
    start: usize,
}

impl Avx2 {
    fn memory(&mut self, operand: MemoryOperand) -> Rm {
        Rm::Memory(self.code.place(operand, VECTOR))
    }

    fn operand(&mut self, operand: Operand) -> Rm {
        match operand {
            Operand::Register(register) => Rm::Ymm(Ymm(register.number())),
            Operand::Memory(operand) => self.memory(operand),
        }
    }

    fn vector(&mut self, op: Opcode, to: Register, first: Option<Operand>, last: Operand, imm: Option<u8>) {
        let last = self.operand(last);
        let first = first.map(|first| Ymm(first.number()));
        self.code.vex(op, Ymm(to.number()), first, last, imm);
    }

    /// `to = to op word`, where the word is for all lanes.
    fn with_word(&mut self, op: Opcode, to: Register, word: u32) {
        let to = Ymm(to.number());
        self.code.combine_word(op, to, to, word);
    }

    fn shift(&mut self, how: Shift, to: Register, from: Operand, distance: u32) {
        self.code.shift(how, Ymm(to.number()), Ymm(from.number()), distance as u8);
    }

    /// Inverts a mask.
    fn invert(&mut self, mask: Register) {
        self.with_word(name::VPXOR, mask, u32::MAX);
    }

    fn compare_ints(&mut self, how: IntCompare, to: Register, x: Operand, y: Operand) {
        match how {
            IntCompare::Equal => self.vector(name::VPCMPEQD, to, Some(x), y, None),
            IntCompare::Unequal => {
                self.vector(name::VPCMPEQD, to, Some(x), y, None);
                self.invert(to);
            }
            // There is only "greater".
            IntCompare::Less => self.vector(name::VPCMPGTD, to, Some(y), x, None),
            IntCompare::LessEqual => {
                self.vector(name::VPCMPGTD, to, Some(x), y, None);
                self.invert(to);
            }
        }
    }

    /// Whether floats are NaN or infinite; both are the largest magnitudes if compared as ints.
    fn class(&mut self, to: Register, x: Operand, (nan, infinite): (bool, bool)) {
        let x = match x {
            Operand::Register(register) => Ymm(register.number()),
            Operand::Memory(from) => {
                self.load(to, from);
                Ymm(to.number())
            }
        };
        self.code.combine_word(name::VPAND, Ymm(to.number()), x, MAGNITUDE);
        match (nan, infinite) {
            (true, true) => self.with_word(name::VPCMPGTD, to, INFINITY - 1),
            (true, false) => self.with_word(name::VPCMPGTD, to, INFINITY),
            (false, true) => self.with_word(name::VPCMPEQD, to, INFINITY),
            // No magnitude is larger than this.
            (false, false) => self.with_word(name::VPCMPGTD, to, MAGNITUDE),
        }
    }

    /// The word of a table of two vectors: both are permuted, and bit 3 of the index selects one.
    fn look_up(&mut self, index: Operand, table: MemoryOperand, [to, high, choice]: [Ymm; 3]) {
        let index = Ymm(index.number());
        let Mem::At(base, word) = self.code.place(table, VECTOR) else { return };
        for (to, from) in [(to, word), (high, word + VECTOR as i32)] {
            self.code.vex(name::VPERMD, to, Some(index), Rm::Memory(Mem::At(base, from)), None);
        }
        self.code.shift(Shift::Left, choice, index, 31 - 3);
        self.code.choose(to, choice, Rm::Ymm(high), to);
    }
}

impl Encoder for Avx2 {
    const LANES: usize = LANES;
    const VECTORS: u8 = 16;
    const MASKS: Masks = Masks::Vectors;
    const BASES: u8 = KEPT_BASES;
    const JUMPS: bool = true;

    fn takes(operand: MemoryOperand) -> bool {
        // Instructions read whole vectors; constants lie in memory as such.
        !matches!(operand, MemoryOperand::Word(..))
    }

    fn work(op: Op) -> (usize, usize) {
        match op {
            Op::Unary(Unary::InverseRoot | Unary::HighProduct(_)) => (2, 0),
            // The first operand of "less" is the last one of its instruction.
            Op::IntCompare(IntCompare::Less) => (1, 0),
            Op::LookUp(..) => (3, 0),
            Op::Gather(..) => (2, 0),
            Op::Length => (5, 0),
            _ => (0, 0),
        }
    }

    fn pointer(&mut self, to: Base, array: u32) {
        self.code.base(to, array);
    }

    fn begin(&mut self) {
        self.start = self.code.here();
    }

    fn load(&mut self, to: Register, from: MemoryOperand) {
        let op = if matches!(from, MemoryOperand::Word(..)) { name::VBROADCASTSS } else { name::VMOVUPS };
        let from = self.memory(from);
        self.code.vex(op, Ymm(to.number()), None, from, None);
    }

    fn store(&mut self, from: Register, to: MemoryOperand) {
        let to = self.memory(to);
        self.code.vex(name::VMOVUPS_STORE, Ymm(from.number()), None, to, None);
    }

    fn copy(&mut self, to: Register, from: Register) {
        self.code.duplicate(Ymm(to.number()), Ymm(from.number()));
    }

    fn operate(&mut self, op: Op, to: Register, args: &[Operand], work: Work<'_>) {
        let vectors = |n: usize| work.vectors.get(n).map_or(Ymm(0), |register| Ymm(register.number()));
        match (op, args) {
            (Op::Unary(Unary::InverseRoot), [x]) => {
                rare::inverse_root(&mut self.code, Ymm(x.number()), [0, 1].map(vectors));
            }
            (Op::Unary(Unary::HighProduct(factor)), [x]) => {
                rare::high_product(&mut self.code, (Ymm(x.number()), factor), [0, 1].map(vectors));
            }
            (Op::Length, &[root, square, x, y, z]) => {
                let [root, square, x, y, z] = [root, square, x, y, z].map(|arg| Ymm(arg.number()));
                let [to, a, b, c, d] = [0, 1, 2, 3, 4].map(vectors);
                rare::length(&mut self.code, (to, root, square), [x, y, z], [a, b, c, d]);
            }
            (Op::LookUp(..), &[index, Operand::Memory(table)]) => {
                self.look_up(index, table, [0, 1, 2].map(vectors));
            }
            (Op::Gather(..), &[index, Operand::Memory(table)]) => {
                let [to, mask] = [0, 1].map(vectors);
                self.code.vex(name::VPCMPEQD, mask, Some(mask), Rm::Ymm(mask), None);
                if let Rm::Memory(from) = self.memory(table) {
                    self.code.gather(to, Ymm(index.number()), mask, from);
                }
            }
            (Op::Unary(op), &[x]) => {
                let (op, imm) = unary(op);
                self.vector(op, to, None, x, imm);
            }
            (Op::Binary(Binary::Shl), &[x, Operand::Memory(MemoryOperand::Constant(distance @ 0..32))]) => {
                self.shift(Shift::Left, to, x, distance);
            }
            (Op::Binary(Binary::Shr), &[x, Operand::Memory(MemoryOperand::Constant(distance @ 0..32))]) => {
                self.shift(Shift::Arithmetic, to, x, distance);
            }
            (Op::Binary(op), &[x, y]) => self.vector(binary(op), to, Some(x), y, None),
            (Op::Compare(how), &[x, y]) => {
                self.vector(name::VCMPPS, to, Some(x), y, Some(predicate(how)));
            }
            (Op::IntCompare(how), &[x, y]) => self.compare_ints(how, to, x, y),
            (Op::NotZero, [x]) => {
                self.code.combine_word(name::VPCMPEQD, Ymm(to.number()), Ymm(x.number()), 0);
                self.invert(to);
            }
            (Op::Class { nan, infinite }, &[x]) => self.class(to, x, (nan, infinite)),
            (Op::MaskAnd, &[a, b]) => self.vector(name::VPAND, to, Some(a), b, None),
            (Op::MaskOr, &[a, b]) => self.vector(name::VPOR, to, Some(a), b, None),
            (Op::MaskNot, [a]) => {
                self.code.combine_word(name::VPXOR, Ymm(to.number()), Ymm(a.number()), u32::MAX);
            }
            (Op::Choose, &[mask, no, yes]) => {
                let yes = self.operand(yes);
                self.code.choose(Ymm(to.number()), Ymm(mask.number()), yes, Ymm(no.number()));
            }
            (Op::Fused { less }, &[x, y]) => {
                let op = if less { name::VFNMADD231PS } else { name::VFMADD231PS };
                self.vector(op, to, Some(x), y, None);
            }
            (Op::Number, &[mask]) => self.shift(Shift::Right, to, mask, 31),
            // The allocator gives every operation its operands. The others are memory.
            _ => {}
        }
    }

    fn advance(&mut self, base: Base, offset: Register) {
        self.code.advance(base, offset.number());
    }

    fn label(&mut self) -> usize {
        self.code.here()
    }

    fn spend(&mut self, cost: u32, may_stop: bool) {
        self.code.spend(cost, may_stop);
    }

    fn test(&mut self, mask: Register) {
        self.code.test(Ymm(mask.number()));
    }

    fn stop(&mut self) {
        self.code.stop(Jump::IfAny);
    }

    fn skip(&mut self) -> usize {
        self.code.jump(Jump::IfNone)
    }

    fn land(&mut self, skip: usize) {
        self.code.land(skip);
    }

    fn jump_back(&mut self, label: usize) {
        self.code.jump_back(label);
    }

    fn finish(mut self, vectors: usize) -> (Vec<u8>, usize) {
        self.code.count_and_return((VECTOR * vectors) as i32, self.start);
        let instructions = self.code.count;
        (self.code.finish(LANES), instructions)
    }
}

/// The instruction, and the rounding mode of those that round.
fn unary(op: Unary) -> (Opcode, Option<u8>) {
    match op {
        Unary::Sqrt | Unary::InverseRoot => (name::VSQRTPS, None),
        Unary::Floor => (name::VROUNDPS, Some(FLOOR)),
        Unary::Ceil => (name::VROUNDPS, Some(CEIL)),
        Unary::Trunc => (name::VROUNDPS, Some(TRUNC)),
        Unary::ToFloat => (name::VCVTDQ2PS, None),
        Unary::ToInt => (name::VCVTTPS2DQ, None),
        Unary::IntAbs => (name::VPABSD, None),
        Unary::HighProduct(_) => (name::VPMULDQ, None),
    }
}

fn binary(op: Binary) -> Opcode {
    match op {
        Binary::Add => name::VADDPS,
        Binary::Sub => name::VSUBPS,
        Binary::Mul => name::VMULPS,
        Binary::Div => name::VDIVPS,
        Binary::Min => name::VMINPS,
        Binary::IntAdd => name::VPADDD,
        Binary::IntSub => name::VPSUBD,
        Binary::IntMul => name::VPMULLD,
        Binary::IntMin => name::VPMINSD,
        Binary::IntMax => name::VPMAXSD,
        Binary::WordMin => name::VPMINUD,
        Binary::And => name::VPAND,
        Binary::Or => name::VPOR,
        Binary::Xor => name::VPXOR,
        Binary::Shl => name::VPSLLVD,
        Binary::Shr => name::VPSRAVD,
    }
}
