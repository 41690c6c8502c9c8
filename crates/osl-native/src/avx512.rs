//! Code for x86-64 with AVX-512: vectors of 16 lanes in 32 registers, and masks in registers of their own.
//!
//! `encode` has the bytes of instructions, and `rare` the operations with a seldom taken path.

mod encode;
mod rare;

use crate::encoder::{Base, Encoder, Masks, MemoryOperand, Operand, Register, Work};
use crate::inst::{Binary, IntCompare, Op, Unary};
use crate::x86::{Assembler, CEIL, FLOOR, Jump, KEPT_BASES, Mem, Opcode, TRUNC, predicate};
use encode::{K, Rm, Zmm, name};

const LANES: usize = 16;
/// Bytes per vector.
const VECTOR: usize = 4 * LANES;

/// Whether this machine can run the code.
pub(crate) fn is_supported() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    {
        is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("fma")
    }
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

/// The instructions of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct Avx512 {
    code: Assembler,
    /// Where the loop begins.
    start: usize,
}

impl Avx512 {
    fn memory(&mut self, operand: MemoryOperand) -> Mem {
        self.code.place(operand, VECTOR)
    }

    fn operand(&mut self, operand: Operand) -> Rm {
        match operand {
            Operand::Register(register) => Rm::Zmm(Zmm(register.number())),
            Operand::Memory(operand @ (MemoryOperand::Word(..) | MemoryOperand::Constant(_))) => {
                Rm::Word(self.memory(operand))
            }
            Operand::Memory(operand) => Rm::Lanes(self.memory(operand)),
        }
    }

    /// A vector instruction without a mask.
    fn vector(&mut self, op: Opcode, to: Register, first: Option<Operand>, last: Operand, imm: Option<u8>) {
        let last = self.operand(last);
        let first = first.map(|first| Zmm(first.number()));
        self.code.evex(op, to.number(), first, last, K(0), false, imm);
    }
}

impl Encoder for Avx512 {
    const LANES: usize = LANES;
    const VECTORS: u8 = 32;
    // Mask 0 means "no mask".
    const MASKS: Masks = Masks::Registers(1, 8);
    const BASES: u8 = KEPT_BASES;
    const JUMPS: bool = true;

    fn takes(_: MemoryOperand) -> bool {
        true
    }

    fn work(op: Op) -> (usize, usize) {
        match op {
            Op::Unary(Unary::InverseRoot) => (3, 2),
            Op::Unary(Unary::HighProduct(_)) => (2, 0),
            Op::Length => (5, 2),
            Op::Gather(..) => (1, 1),
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
        let word = matches!(from, MemoryOperand::Word(..) | MemoryOperand::Constant(_));
        let memory = self.memory(from);
        match to {
            Register::Mask(k) => self.code.mask_memory(name::KMOVW_LOAD, K(k), memory),
            Register::Vector(z) => {
                let op = if word { name::VBROADCASTSS } else { name::VMOVDQU32 };
                self.code.evex(op, z, None, Rm::Lanes(memory), K(0), false, None);
            }
        }
    }

    fn store(&mut self, from: Register, to: MemoryOperand) {
        let memory = self.memory(to);
        match from {
            Register::Mask(k) => self.code.mask_memory(name::KMOVW_STORE, K(k), memory),
            Register::Vector(z) => {
                self.code.evex(name::VMOVDQU32_STORE, z, None, Rm::Lanes(memory), K(0), false, None);
            }
        }
    }

    fn copy(&mut self, to: Register, from: Register) {
        match (to, from) {
            (Register::Mask(to), Register::Mask(from)) => {
                self.code.mask(name::KMOVW_LOAD, K(to), None, K(from));
            }
            _ => self.code.copy(Zmm(to.number()), Zmm(from.number())),
        }
    }

    fn operate(&mut self, op: Op, to: Register, args: &[Operand], work: Work<'_>) {
        match (op, args) {
            (Op::Unary(Unary::InverseRoot), [x]) => {
                if let (&[a, b, c], &[low, high]) = (work.vectors, work.masks) {
                    let work = [a, b, c].map(|z| Zmm(z.number()));
                    let masks = [low, high].map(|k| K(k.number()));
                    rare::inverse_root(&mut self.code, Zmm(x.number()), work, masks);
                }
            }
            (Op::Unary(Unary::HighProduct(factor)), [x]) => {
                if let &[to, even] = work.vectors {
                    let work = [to, even].map(|z| Zmm(z.number()));
                    rare::high_product(&mut self.code, (Zmm(x.number()), factor), work);
                }
            }
            (Op::Length, &[root, square, x, y, z]) => {
                if let (&[to, a, b, c, d], &[small, other]) = (work.vectors, work.masks) {
                    let [root, square, x, y, z] = [root, square, x, y, z].map(|arg| Zmm(arg.number()));
                    let [to, a, b, c, d] = [to, a, b, c, d].map(|z| Zmm(z.number()));
                    let masks = [small, other].map(|k| K(k.number()));
                    rare::length(&mut self.code, (to, root, square), [x, y, z], [a, b, c, d], masks);
                }
            }
            (Op::Gather(..), &[index, Operand::Memory(table)]) => {
                if let &[mask] = work.masks {
                    let (from, mask) = (self.memory(table), K(mask.number()));
                    self.code.mask(name::KXNORW, mask, Some(mask), mask);
                    self.code.evex_gather(Zmm(to.number()), Zmm(index.number()), mask, from);
                }
            }
            (Op::Unary(op), &[x]) => {
                let (op, imm) = unary(op);
                self.vector(op, to, None, x, imm);
            }
            (Op::Binary(op), &[x, y]) => self.vector(binary(op), to, Some(x), y, None),
            (Op::LookUp(..), &[index, table]) => self.vector(name::VPERMD, to, Some(index), table, None),
            (Op::Compare(how), &[x, y]) => {
                self.vector(name::VCMPPS, to, Some(x), y, Some(predicate(how)));
            }
            (Op::IntCompare(how), &[x, y]) => {
                self.vector(name::VPCMPD, to, Some(x), y, Some(int_predicate(how)));
            }
            (Op::NotZero, &[x]) => self.vector(name::VPTESTMD, to, Some(x), x, None),
            (Op::Class { nan, infinite }, &[x]) => {
                // Quiet and signaling NaN, and both infinities.
                let classes = if nan { 0x81 } else { 0 } | if infinite { 0x18 } else { 0 };
                self.vector(name::VFPCLASSPS, to, None, x, Some(classes));
            }
            (Op::MaskAnd | Op::MaskOr, [a, b]) => {
                let op = if op == Op::MaskAnd { name::KANDW } else { name::KORW };
                self.code.mask(op, K(to.number()), Some(K(a.number())), K(b.number()));
            }
            (Op::MaskNot, [a]) => self.code.mask(name::KNOTW, K(to.number()), None, K(a.number())),
            (Op::Choose, &[mask, no, yes]) => {
                let (no, yes) = (Zmm(no.number()), self.operand(yes));
                self.code.evex(name::VPBLENDMD, to.number(), Some(no), yes, K(mask.number()), false, None);
            }
            (Op::Fused { less }, &[x, y]) => {
                let op = if less { name::VFNMADD231PS } else { name::VFMADD231PS };
                self.vector(op, to, Some(x), y, None);
            }
            (Op::Number, [mask]) => {
                let one = Rm::Lanes(Mem::Pool(self.code.constant(1)));
                let mask = K(mask.number());
                self.code.evex(name::VBROADCASTSS, to.number(), None, one, mask, true, None);
            }
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
        self.code.mask(name::KORTESTW, K(mask.number()), None, K(mask.number()));
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
        (self.code.finish(1), instructions)
    }
}

/// The instruction, and the rounding mode of those that round.
fn unary(op: Unary) -> (Opcode, Option<u8>) {
    match op {
        Unary::Sqrt | Unary::InverseRoot => (name::VSQRTPS, None),
        Unary::Floor => (name::VRNDSCALEPS, Some(FLOOR)),
        Unary::Ceil => (name::VRNDSCALEPS, Some(CEIL)),
        Unary::Trunc => (name::VRNDSCALEPS, Some(TRUNC)),
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
        Binary::And => name::VPANDD,
        Binary::Or => name::VPORD,
        Binary::Xor => name::VPXORD,
        Binary::Shl => name::VPSLLVD,
        Binary::Shr => name::VPSRAVD,
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
