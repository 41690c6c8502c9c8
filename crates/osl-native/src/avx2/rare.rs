//! Operations of several instructions: the inverse root, the upper half of a product, and the length with its
//! seldom taken path, which the code chooses for all lanes of a vector.

use super::MAGNITUDE;
use super::encode::{Rm, Ymm, name};
use crate::x86::{Assembler, Jump, Mem, Opcode};

/// Sums of squares below `2^-125` have lost bits.
const UNDERFLOWS_BELOW: u32 = 0x0100_0000;

const LESS: u8 = 1;

/// Words 1 and 3 of both operands.
const UPPER_HALVES: u8 = 0b11_01_11_01;
/// Words 0, 2, 1 and 3.
const ALTERNATE: u8 = 0b11_01_10_00;

impl Assembler {
    fn combine(&mut self, op: Opcode, to: Ymm, first: Ymm, last: Ymm) {
        self.vex(op, to, Some(first), Rm::Ymm(last), None);
    }

    pub(super) fn combine_word(&mut self, op: Opcode, to: Ymm, first: Ymm, word: u32) {
        let word = Rm::Memory(Mem::Pool(self.constant(word)));
        self.vex(op, to, Some(first), word, None);
    }

    pub(super) fn duplicate(&mut self, to: Ymm, from: Ymm) {
        self.vex(name::VMOVUPS, to, None, Rm::Ymm(from), None);
    }
}

/// Computes in `to` 1 divided by the root of `x`.
pub(super) fn inverse_root(code: &mut Assembler, x: Ymm, [to, root]: [Ymm; 2]) {
    code.vex(name::VSQRTPS, root, None, Rm::Ymm(x), None);
    let one = Rm::Memory(Mem::Pool(code.constant(1.0_f32.to_bits())));
    code.vex(name::VMOVUPS, to, None, one, None);
    code.combine(name::VDIVPS, to, to, root);
}

/// Computes in `to` the upper halves of the products of the ints in `x` and a factor.
pub(super) fn high_product(code: &mut Assembler, (x, factor): (Ymm, i32), [to, even]: [Ymm; 2]) {
    let factor = Rm::Memory(Mem::Pool(code.constant(factor as u32)));
    // The instruction multiplies every second word, so the others take their places for another.
    code.vex(name::VMOVSHDUP, to, None, Rm::Ymm(x), None);
    code.vex(name::VPMULDQ, to, Some(to), factor, None);
    code.vex(name::VPMULDQ, even, Some(x), factor, None);
    // The upper halves of two even and two odd words of each quarter, then in their order.
    code.vex(name::VSHUFPS, to, Some(even), Rm::Ymm(to), Some(UPPER_HALVES));
    code.vex(name::VPSHUFD, to, None, Rm::Ymm(to), Some(ALTERNATE));
}

/// Computes in `to` the length of a vector: `root`, unless its `square` is too small.
pub(super) fn length(
    code: &mut Assembler,
    (to, root, square): (Ymm, Ymm, Ymm),
    v: [Ymm; 3],
    [small, largest, sum, part]: [Ymm; 4],
) {
    code.duplicate(to, root);
    let limit = Rm::Memory(Mem::Pool(code.constant(UNDERFLOWS_BELOW)));
    code.vex(name::VCMPPS, small, Some(square), limit, Some(LESS));
    // For zeros, the root is right.
    code.combine(name::VPOR, part, v[0], v[1]);
    code.combine(name::VPOR, part, part, v[2]);
    code.combine_word(name::VPAND, part, part, MAGNITUDE);
    code.combine_word(name::VPCMPEQD, part, part, 0);
    code.combine(name::VPANDN, small, part, small);
    code.test(small);
    let done = code.jump(Jump::IfNone);
    code.combine_word(name::VPAND, part, v[0], MAGNITUDE);
    code.combine_word(name::VPAND, largest, v[1], MAGNITUDE);
    // The first operand if it is larger, else the second, so that NaN is handled as by a comparison.
    code.combine(name::VMAXPS, largest, largest, part);
    code.combine_word(name::VPAND, part, v[2], MAGNITUDE);
    code.combine(name::VMAXPS, largest, part, largest);
    for (number, from) in v.into_iter().enumerate() {
        code.combine_word(name::VPAND, part, from, MAGNITUDE);
        code.combine(name::VDIVPS, part, part, largest);
        if number == 0 {
            code.combine(name::VMULPS, sum, part, part);
        } else {
            code.combine(name::VMULPS, part, part, part);
            code.combine(name::VADDPS, sum, sum, part);
        }
    }
    code.vex(name::VSQRTPS, sum, None, Rm::Ymm(sum), None);
    code.combine(name::VMULPS, sum, largest, sum);
    code.choose(to, small, Rm::Ymm(sum), to);
    code.land(done);
}
