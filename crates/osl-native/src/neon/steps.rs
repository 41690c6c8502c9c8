//! Operations of several instructions. They overwrite the spare registers. An operand may be in the register
//! of the result, except for the length, and the last operand may be in the last spare register.

use super::encode::{V, name};
use super::place::Draft;
use super::{INFINITY, SPARE};
use crate::encoder::MemoryOperand;

/// Sums of squares below `2^-125` have lost bits.
const UNDERFLOWS_BELOW: u32 = 0x0100_0000;
/// The bits of `2^31` and `-2^31`.
const TOO_LARGE: u32 = 0x4F00_0000;
const LEAST: u32 = 0xCF00_0000;

/// 1 divided by the root.
pub(super) fn inverse_root(code: &mut Draft, to: V, x: V) {
    let [root, ..] = SPARE;
    code.two(name::FSQRT, root, x);
    code.constant(to, 1.0_f32.to_bits());
    code.three(name::FDIV, to, to, root);
}

/// Truncation to an int. The instruction saturates and returns 0 for NaN; so what does not fit, which
/// includes NaN, is replaced by the least float that fits.
pub(super) fn to_int(code: &mut Draft, to: V, x: V) {
    let [fits, least, ..] = SPARE;
    code.constant(fits, TOO_LARGE);
    code.three(name::FCMGT, fits, fits, x);
    code.constant(least, LEAST);
    code.three(name::BSL, fits, x, least);
    code.two(name::FCVTZS, to, fits);
}

/// The upper halves of the products of the ints in `x` and a factor.
pub(super) fn high_product(code: &mut Draft, to: V, x: V, factor: i32) {
    let [by, upper, ..] = SPARE;
    code.constant(by, factor as u32);
    // The products of the upper two lanes, and of the lower two.
    code.three(name::SMULL2, upper, x, by);
    code.three(name::SMULL, to, x, by);
    code.three(name::UZP2, to, to, upper);
}

/// The first if it is smaller, else the second. The instruction `fmin` returns NaN if either is NaN.
pub(super) fn min(code: &mut Draft, to: V, x: V, y: V) {
    let [smaller, ..] = SPARE;
    code.three(name::FCMGT, smaller, y, x);
    code.choose(to, smaller, x, y);
}

/// The instruction reads a signed byte of the distance.
pub(super) fn shift_left(code: &mut Draft, to: V, x: V, distance: V) {
    let [bounded, ..] = SPARE;
    code.constant(bounded, 32);
    code.three(name::UMIN, bounded, bounded, distance);
    code.three(name::USHL, to, x, bounded);
}

/// A shift right is one to the left by a negative distance.
pub(super) fn shift_right(code: &mut Draft, to: V, x: V, distance: V) {
    let [bounded, ..] = SPARE;
    code.constant(bounded, 31);
    code.three(name::UMIN, bounded, bounded, distance);
    code.two(name::NEG, bounded, bounded);
    code.three(name::SSHL, to, x, bounded);
}

/// Neither less nor greater.
pub(super) fn equal_or_nan(code: &mut Draft, to: V, x: V, y: V) {
    let [greater, ..] = SPARE;
    code.three(name::FCMGT, greater, x, y);
    code.three(name::FCMGT, to, y, x);
    code.three(name::ORR, to, to, greater);
    code.two(name::NOT, to, to);
}

/// Whether floats are NaN or infinite.
pub(super) fn class(code: &mut Draft, to: V, x: V, (nan, infinite): (bool, bool)) {
    let [infinity, ..] = SPARE;
    match (nan, infinite) {
        (true, true) => {
            code.constant(infinity, INFINITY);
            code.three(name::FACGT, to, infinity, x);
            code.two(name::NOT, to, to);
        }
        (true, false) => {
            code.three(name::FCMEQ, to, x, x);
            code.two(name::NOT, to, to);
        }
        (false, true) => {
            code.constant(infinity, INFINITY);
            code.three(name::FACGE, to, x, infinity);
        }
        (false, false) => code.constant(to, 0),
    }
}

/// The words of a table. The instruction selects bytes of four registers, so each index becomes the numbers
/// of its word's four bytes.
pub(super) fn look_up(code: &mut Draft, to: V, index: V, table: MemoryOperand) {
    let [first, ..] = SPARE;
    code.constant(first, 0x0404_0404);
    code.three(name::MUL, to, index, first);
    code.constant(first, 0x0302_0100);
    code.three(name::ADD, to, to, first);
    code.load_table(first, table);
    code.three(name::TBL, to, first, to);
}

/// The length of a vector: `root`, unless its `square` is too small. The code chooses a path for all lanes.
pub(super) fn length(code: &mut Draft, to: V, [root, square]: [V; 2], v: [V; 3]) {
    let [small, largest, sum, part] = SPARE;
    code.copy(to, root);
    code.constant(small, UNDERFLOWS_BELOW);
    code.three(name::FCMGT, small, small, square);
    // For zeros, the root is right.
    code.three(name::ORR, part, v[0], v[1]);
    code.three(name::ORR, part, part, v[2]);
    code.two(name::FABS, part, part);
    code.three(name::CMTST, part, part, part);
    code.three(name::AND, small, small, part);
    let done = code.skip_if_none(small, part);
    code.two(name::FABS, largest, v[0]);
    for other in [v[1], v[2]] {
        code.two(name::FABS, part, other);
        code.three(name::FCMGT, sum, part, largest);
        code.three(name::BIT, largest, part, sum);
    }
    for (number, from) in v.into_iter().enumerate() {
        code.two(name::FABS, part, from);
        code.three(name::FDIV, part, part, largest);
        if number == 0 {
            code.three(name::FMUL, sum, part, part);
        } else {
            code.three(name::FMUL, part, part, part);
            code.three(name::FADD, sum, sum, part);
        }
    }
    code.two(name::FSQRT, sum, sum);
    code.three(name::FMUL, sum, largest, sum);
    code.three(name::BIT, to, sum, small);
    code.land(done);
}
