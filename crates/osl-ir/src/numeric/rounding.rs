//! Rounding to whole numbers, exact for every `f32`, in operations that every vector unit has.
//!
//! The functions of the standard library with these names give the same results, but on the baseline x86-64 target
//! each is a call into a library, and a loop that calls does not vectorise. This module knows nothing but bits.

/// From here on every `f32` is a whole number.
const WHOLE: f32 = 8_388_608.0;

/// In a sum with this a small number of either sign is rounded to a whole one, which then stands in the low bits.
const SIGNED_WHOLE: f32 = 12_582_912.0;

/// The same for `f64`.
pub(crate) const SIGNED_WHOLE_64: f64 = 6_755_399_441_055_744.0;

/// The first `f32` above the range of `i32`.
const TWO_POW_31: f32 = 2_147_483_648.0;

/// A choice between two values that are both at hand; it becomes a blend, never a branch.
#[inline(always)]
pub(crate) fn pick<T: Copy>(mask: bool, yes: T, no: T) -> T {
    if mask { yes } else { no }
}

/// The nearest whole number to `magnitude`, ties to even, for 0 <= `magnitude` < 2^23.
///
/// The sum lands where floats are spaced by one, so the addition itself rounds.
#[inline(always)]
fn nearest_even(magnitude: f32) -> f32 {
    (magnitude + WHOLE) - WHOLE
}

/// The largest whole number not above `x`. Signed zeros, infinities and NaN pass through.
#[inline(always)]
pub fn floor(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude).copysign(x);
    let whole = nearest - pick(nearest > x, 1.0, 0.0);
    pick(magnitude < WHOLE, whole, x)
}

/// The smallest whole number not below `x`; `ceil(-0.5)` is -0. Infinities and NaN pass through.
#[inline(always)]
pub fn ceil(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude).copysign(x);
    let whole = (nearest + pick(nearest < x, 1.0, 0.0)).copysign(x);
    pick(magnitude < WHOLE, whole, x)
}

/// `x` without its fraction, sign kept. Infinities and NaN pass through.
#[inline(always)]
pub fn trunc(x: f32) -> f32 {
    let magnitude = x.abs();
    let nearest = nearest_even(magnitude);
    let whole = nearest - pick(nearest > magnitude, 1.0, 0.0);
    pick(magnitude < WHOLE, whole.copysign(x), x)
}

/// The nearest whole number, halves away from zero, sign kept. Infinities and NaN pass through.
#[inline(always)]
pub fn round(x: f32) -> f32 {
    let magnitude = x.abs();
    let whole = trunc(magnitude);
    // The difference is exact, so 0.49999997 does not slip over the half.
    let rounded = whole + pick(magnitude - whole >= 0.5, 1.0, 0.0);
    pick(magnitude < WHOLE, rounded.copysign(x), x)
}

/// Conversion to an integer by truncation; NaN and whatever lies outside the range of `i32` give `i32::MIN`.
///
/// A cast with `as` does the same but for the outliers, and compilers do not vectorise it. Here the magnitude is taken
/// apart at 2^16: each half is small enough that a sum leaves it, as an integer, in the low bits of the mantissa.
#[inline(always)]
pub fn trunc32(x: f32) -> i32 {
    let magnitude = x.abs();
    let shifted = magnitude * (1.0 / 65_536.0) + WHOLE;
    // Rounded, so that the rest, exact, lies in -2^15..=2^15.
    let rest = magnitude - (shifted - WHOLE) * 65_536.0;
    let rest_shifted = rest + SIGNED_WHOLE;
    let excess = pick(rest_shifted - SIGNED_WHOLE > rest, 1, 0);
    let low = (rest_shifted.to_bits() as i32).wrapping_sub(SIGNED_WHOLE.to_bits() as i32) - excess;
    let whole = ((shifted.to_bits() << 16) as i32).wrapping_add(low);
    let signed = pick(x < 0.0, whole.wrapping_neg(), whole);
    pick(magnitude < TWO_POW_31, signed, i32::MIN)
}

/// 2 to the power of a whole number in -126..=126, as what must be added to the bits of a float to scale it so.
#[inline(always)]
pub(crate) fn exponent_bits(whole: f32) -> u32 {
    (whole + SIGNED_WHOLE).to_bits() << 23
}

/// `trunc32` turned back into a float, which needs no integer: -2^31 for NaN and whatever lies out of range.
/// The sign of a zero is that of `x`.
#[inline(always)]
pub(crate) fn trunc32_as_float(x: f32) -> f32 {
    pick(x.abs() < TWO_POW_31, trunc(x), -TWO_POW_31)
}

/// Rounding as the reference's range reductions do it: half is added away from zero, *rounded*, then truncated to an
/// integer, here as a float. Unlike [`round`], 0.49999997 gives 1.
#[inline(always)]
pub(crate) fn nearest32_as_float(x: f32) -> f32 {
    trunc32_as_float(x + 0.5_f32.copysign(x))
}

/// Whether a whole number is odd.
#[inline(always)]
pub(crate) fn is_odd(whole: f32) -> bool {
    let half = whole.abs() * 0.5;
    // From 2^24 on every float is even.
    (nearest_even(half) != half) & (half < WHOLE)
}

/// Truncation of a quotient of integers, exact up to 2^31 in magnitude, modulo 2^32.
#[inline(always)]
pub(crate) fn trunc_quotient(quotient: f64) -> i32 {
    let shifted = quotient + SIGNED_WHOLE_64;
    let nearest = shifted - SIGNED_WHOLE_64;
    let excess = pick(nearest.abs() > quotient.abs(), 1.0_f64.copysign(quotient), 0.0);
    (shifted - excess).to_bits() as i32
}
