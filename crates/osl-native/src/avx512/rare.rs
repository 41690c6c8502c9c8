//! Operations with a usual path and a rare one; the code chooses one path for all lanes of a vector.
//!
//! A square root and a division by it both wait for the processor's only unit for these operations. If no
//! intermediate result leaves the range of floats, a few products and sums give a root and its inverse with
//! the same correct rounding (Markstein 1990, *Computation of elementary functions on the IBM RISC
//! System/6000 processor*), starting from any estimate within `2^-14`. A test tries every mantissa. A root
//! alone is left to the processor, whose unit works in parallel.

use super::encode::{K, Rm, Zmm, name};
use crate::x86::{Assembler, Jump, Mem, Opcode};

/// Roots of floats from `2^-100` up to `2^100` take the usual path.
const LOW: u32 = (127 - 100) << 23;
const HIGH: u32 = (127 + 100) << 23;
/// Sums of squares below `2^-125` have lost bits.
const UNDERFLOWS_BELOW: u32 = 0x0100_0000;

const LESS: u8 = 1;
const NOT_LESS: u8 = 5;

/// Words 1 and 3 of both operands.
const UPPER_HALVES: u8 = 0b11_01_11_01;
/// Words 0, 2, 1 and 3.
const ALTERNATE: u8 = 0b11_01_10_00;

impl Assembler {
    fn operate(&mut self, op: Opcode, to: Zmm, first: Zmm, last: Zmm) {
        self.evex(op, to.0, Some(first), Rm::Zmm(last), K(0), false, None);
    }

    fn with_word(&mut self, op: Opcode, to: Zmm, first: Zmm, word: u32) {
        let word = Rm::Word(Mem::Pool(self.constant(word)));
        self.evex(op, to.0, Some(first), word, K(0), false, None);
    }

    fn fill(&mut self, to: Zmm, word: u32) {
        let word = Rm::Lanes(Mem::Pool(self.constant(word)));
        self.evex(name::VBROADCASTSS, to.0, None, word, K(0), false, None);
    }

    pub(super) fn copy(&mut self, to: Zmm, from: Zmm) {
        self.evex(name::VMOVDQU32, to.0, None, Rm::Zmm(from), K(0), false, None);
    }

    fn one_operand(&mut self, op: Opcode, to: Zmm, from: Zmm) {
        self.evex(op, to.0, None, Rm::Zmm(from), K(0), false, None);
    }

    fn compare_word(&mut self, op: Opcode, to: K, first: Zmm, word: u32, how: u8) {
        let word = Rm::Word(Mem::Pool(self.constant(word)));
        self.evex(op, to.0, Some(first), word, K(0), false, Some(how));
    }

    fn blend(&mut self, to: Zmm, mask: K, yes: Zmm, no: Zmm) {
        self.evex(name::VPBLENDMD, to.0, Some(no), Rm::Zmm(yes), mask, false, None);
    }
}

/// Computes in `a` 1 divided by the root of `x`, for nonzero `x`.
pub(super) fn inverse_root(code: &mut Assembler, x: Zmm, [a, b, c]: [Zmm; 3], [low, high]: [K; 2]) {
    let (half, one) = (0.5_f32.to_bits(), 1.0_f32.to_bits());
    // Compared as ints, positive floats keep their order and negative ones are smaller. The result for zero
    // is unspecified.
    code.compare_word(name::VPCMPD, low, x, LOW, LESS);
    code.evex(name::VPTESTMD, low.0, Some(x), Rm::Zmm(x), low, false, None);
    code.compare_word(name::VPCMPD, high, x, HIGH, NOT_LESS);
    code.mask(name::KORTESTW, low, None, high);
    let rare = code.jump(Jump::IfAny);
    // a: half the inverse root, b: the root; first to 14 bits, then to about 28.
    code.one_operand(name::VRSQRT14PS, a, x);
    code.operate(name::VMULPS, b, x, a);
    code.with_word(name::VMULPS, a, a, half);
    code.fill(c, half);
    code.operate(name::VFNMADD231PS, c, b, a);
    code.operate(name::VFMADD213PS, b, c, b);
    code.operate(name::VFMADD213PS, a, c, a);
    // The residual of the square, which is exact, corrects the last bit.
    code.copy(c, x);
    code.operate(name::VFNMADD231PS, c, b, b);
    code.operate(name::VFMADD231PS, b, a, c);
    code.operate(name::VADDPS, a, a, a);
    code.fill(c, one);
    code.operate(name::VFNMADD231PS, c, b, a);
    // Rounded up: the inverse of a root whose mantissa is all ones, corrected from below, is a tie.
    code.evex(name::VFMADD213PS, a.0, Some(c), Rm::Up(a), K(0), false, None);
    code.fill(c, one);
    code.operate(name::VFNMADD231PS, c, b, a);
    code.operate(name::VFMADD213PS, a, c, a);
    let done = code.jump(Jump::Always);
    code.land(rare);
    code.one_operand(name::VSQRTPS, b, x);
    code.fill(a, one);
    code.operate(name::VDIVPS, a, a, b);
    code.land(done);
}

/// Computes in `to` the upper halves of the products of the ints in `x` and a factor.
pub(super) fn high_product(code: &mut Assembler, (x, factor): (Zmm, i32), [to, even]: [Zmm; 2]) {
    // The instruction multiplies every second word, so the others take their places for another.
    code.fill(even, factor as u32);
    code.evex(name::VMOVSHDUP, to.0, None, Rm::Zmm(x), K(0), false, None);
    code.operate(name::VPMULDQ, to, to, even);
    code.operate(name::VPMULDQ, even, x, even);
    // The upper halves of two even and two odd words of each quarter, then in their order.
    code.evex(name::VSHUFPS, to.0, Some(even), Rm::Zmm(to), K(0), false, Some(UPPER_HALVES));
    code.evex(name::VPSHUFD, to.0, None, Rm::Zmm(to), K(0), false, Some(ALTERNATE));
}

/// Computes in `to` the length of a vector: `root`, unless its `square` is too small.
pub(super) fn length(
    code: &mut Assembler,
    (to, root, square): (Zmm, Zmm, Zmm),
    v: [Zmm; 3],
    [x, y, z, largest]: [Zmm; 4],
    [small, other]: [K; 2],
) {
    code.copy(to, root);
    code.compare_word(name::VCMPPS, small, square, UNDERFLOWS_BELOW, LESS);
    // For zeros, this is right.
    code.operate(name::VPORD, x, v[0], v[1]);
    code.operate(name::VPORD, x, x, v[2]);
    let magnitude = Rm::Word(Mem::Pool(code.constant(0x7FFF_FFFF)));
    code.evex(name::VPTESTMD, small.0, Some(x), magnitude, small, false, None);
    code.mask(name::KORTESTW, small, None, small);
    let done = code.jump(Jump::IfNone);
    for (part, from) in [x, y, z].into_iter().zip(v) {
        code.with_word(name::VPANDD, part, from, 0x7FFF_FFFF);
    }
    let mut larger = |to: Zmm, a: Zmm, b: Zmm| {
        code.evex(name::VCMPPS, other.0, Some(a), Rm::Zmm(b), K(0), false, Some(LESS));
        code.blend(to, other, b, a);
    };
    larger(largest, x, y);
    larger(largest, largest, z);
    for part in [x, y, z] {
        code.operate(name::VDIVPS, part, part, largest);
        code.operate(name::VMULPS, part, part, part);
    }
    code.operate(name::VADDPS, x, x, y);
    code.operate(name::VADDPS, x, x, z);
    code.one_operand(name::VSQRTPS, x, x);
    code.operate(name::VMULPS, x, largest, x);
    code.blend(to, small, x, to);
    code.land(done);
}
