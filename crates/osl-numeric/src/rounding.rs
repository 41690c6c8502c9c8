//! Rounding to whole numbers, exact for every `f32`, with operations that every vector unit has.
//!
//! The functions of the standard library with these names give the same results, but on the baseline x86-64
//! target each is a library call, which prevents vectorisation. This module works on bits alone.

use super::int::Int;
use super::real::Single;

/// All `f32` from here on are whole numbers.
const WHOLE: f32 = 8_388_608.0;

/// Adding this to a small number of either sign rounds it to a whole number in the low bits.
const SIGNED_WHOLE: f32 = 12_582_912.0;

/// The same for `f64`.
pub(crate) const SIGNED_WHOLE_64: f64 = 6_755_399_441_055_744.0;

/// The first `f32` above the range of `i32`.
const TWO_POW_31: f32 = 2_147_483_648.0;

/// A choice between two values that are both available; it compiles to a blend, never a branch.
#[inline(always)]
pub(crate) fn pick<T: Copy>(mask: bool, yes: T, no: T) -> T {
    if mask { yes } else { no }
}

/// The nearest whole number to `magnitude`, ties to even, for 0 <= `magnitude` < 2^23.
///
/// Floats near the sum are spaced by one, so the addition itself rounds.
#[inline(always)]
fn nearest_even(magnitude: f32) -> f32 {
    (magnitude + WHOLE) - WHOLE
}

/// The largest whole number that is not larger than `x`. Signed zeros, infinities and NaN pass through.
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude).copysign(x);
    let whole = nearest - pick(nearest > x, 1.0, 0.0);
    pick(magnitude < WHOLE, whole, x)
}

/// The smallest whole number that is not smaller than `x`; `ceil(-0.5)` is -0. Infinities and NaN pass
/// through.
#[inline(always)]
pub fn ceil(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude).copysign(x);
    let whole = (nearest + pick(nearest < x, 1.0, 0.0)).copysign(x);
    pick(magnitude < WHOLE, whole, x)
}

/// `x` without its fraction, with its sign. Infinities and NaN pass through.
#[inline(always)]
pub fn trunc(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude);
    let whole = nearest - pick(nearest > magnitude, 1.0, 0.0);
    pick(magnitude < WHOLE, whole.copysign(x), x)
}

/// The nearest whole number, halves away from zero, with the sign of `x`. Infinities and NaN pass through.
#[inline(always)]
pub fn round<S: Single>(x: S) -> S {
    let magnitude = x.abs();
    let whole = magnitude.trunc();
    // The difference is exact, so 0.49999997 is not rounded up.
    let rounded = whole + S::select((magnitude - whole).ge(S::lit(0.5)), S::lit(1.0), S::lit(0.0));
    S::select(magnitude.lt(S::lit(WHOLE)), rounded.with_sign(x), x)
}

/// Conversion to an integer by truncation; NaN and values outside the range of `i32` give `i32::MIN`.
///
/// A cast with `as` is equal except for values out of range, but compilers do not vectorise it. Here the
/// magnitude is split at 2^16: each half is small enough that a sum leaves it, as an integer, in the low bits
/// of the mantissa.
#[inline(always)]
pub fn trunc32(x: f32) -> i32 {
    let magnitude = x.abs();
    let shifted = magnitude * (1.0 / 65_536.0) + WHOLE;
    // Rounded, so the exact remainder is in -2^15..=2^15.
    let rest = magnitude - (shifted - WHOLE) * 65_536.0;
    let rest_shifted = rest + SIGNED_WHOLE;
    let excess = pick(rest_shifted - SIGNED_WHOLE > rest, 1, 0);
    let low = (rest_shifted.to_bits() as i32).wrapping_sub(SIGNED_WHOLE.to_bits() as i32) - excess;
    let whole = ((shifted.to_bits() << 16) as i32).wrapping_add(low);
    let signed = pick(x < 0.0, whole.wrapping_neg(), whole);
    pick(magnitude < TWO_POW_31, signed, i32::MIN)
}

/// 2 to the power of a whole number in -126..=126, as the number to add to the bits of a float that is scaled
/// by it.
#[inline(always)]
pub(crate) fn exponent_bits<S: Single>(whole: S) -> S::Int {
    (whole + S::lit(SIGNED_WHOLE)).to_bits().shl(S::Int::lit(23))
}

/// The result of `trunc32` as a float, computed without an integer: -2^31 for NaN and values out of range. A
/// zero has the sign of `x`.
#[inline(always)]
pub(crate) fn trunc32_as_float<S: Single>(x: S) -> S {
    S::select(x.abs().lt(S::lit(TWO_POW_31)), x.trunc(), S::lit(-TWO_POW_31))
}

/// Rounding as in the reference's range reductions: half is added away from zero and *rounded*, then the sum
/// is truncated to an integer, here as a float. Unlike [`round`], it gives 1 for 0.49999997.
#[inline(always)]
pub(crate) fn nearest32_as_float<S: Single>(x: S) -> S {
    trunc32_as_float(x + S::lit(0.5).with_sign(x))
}

/// Whether a whole number is odd.
#[inline(always)]
pub(crate) fn is_odd<S: Single>(whole: S) -> S::Mask {
    let half = whole.abs() * S::lit(0.5);
    let nearest = (half + S::lit(WHOLE)) - S::lit(WHOLE);
    // All floats from 2^24 on are even.
    nearest.ne(half) & half.lt(S::lit(WHOLE))
}

/// Truncation of a quotient of integers, exact up to 2^31 in magnitude, modulo 2^32.
#[inline(always)]
pub(crate) fn trunc_quotient(quotient: f64) -> i32 {
    let shifted = quotient + SIGNED_WHOLE_64;
    let nearest = shifted - SIGNED_WHOLE_64;
    let excess = pick(nearest.abs() > quotient.abs(), 1.0_f64.copysign(quotient), 0.0);
    (shifted - excess).to_bits() as i32
}
