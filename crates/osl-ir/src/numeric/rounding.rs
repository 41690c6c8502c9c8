//! Rounding to whole numbers, exact for every `f32`, in operations that every vector unit has.
//!
//! The functions of the standard library with these names give the same results, but on the baseline x86-64 target
//! each is a call into a library, and a loop that calls does not vectorise. This module knows nothing but bits.

/// From here on every `f32` is a whole number.
const WHOLE: f32 = 8_388_608.0;

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
#[inline(always)]
pub fn trunc32(x: f32) -> i32 {
    // `as` saturates, so that below the range it already gives the minimum.
    pick(x < TWO_POW_31, x as i32, i32::MIN)
}

/// Rounding as the reference's range reductions do it: half is added away from zero, *rounded*, then truncated.
/// Unlike [`round`], 0.49999997 gives 1.
#[inline(always)]
pub fn nearest32(x: f32) -> i32 {
    trunc32(x + 0.5_f32.copysign(x))
}
