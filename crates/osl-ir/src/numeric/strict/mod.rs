//! The strict elementary functions: the reference implementation's own approximations in `f32`, bit for bit.
//!
//! OSL's default build replaces the mathematical library by polynomials that vectorise. They affect what a
//! shader looks like: for exp or asin, a correctly rounded library agrees in one case in a hundred. Each
//! product and each sum is rounded separately; fused operations are never used, whatever the machine offers.
//!
//! Constants are written as bit patterns where a decimal number would not show which float is meant. The
//! approximations are those of OpenImageIO's `fmath.h`. This module must not know more than single numbers.

mod exp_log;
mod hyperbolic;
mod inverse_trig;
mod power;
mod special;
mod trig;

pub use exp_log::{exp, exp2, exp10, expm1, log, log1p, log2, log10, logb};
pub use hyperbolic::{cosh, sinh, tanh};
pub use inverse_trig::{acos, asin, atan, atan2};
pub use power::{cbrt, fmod, pow, pow_accurate};
pub use special::{erf, erfc, ierf};
pub use trig::{cos, cospi, sin, sincos, sinpi, tan};

use super::rounding::pick;

/// The float with these bits.
const fn bits(pattern: u32) -> f32 {
    f32::from_bits(pattern)
}

/// The float nearest to π; likewise for the others.
const PI: f32 = bits(0x4049_0fdb);
const PI_2: f32 = bits(0x3fc9_0fdb);
const PI_4: f32 = bits(0x3f49_0fdb);

/// `x` clamped to `lo..=hi`; NaN becomes `lo`.
#[inline(always)]
fn clamp(x: f32, lo: f32, hi: f32) -> f32 {
    let above = pick(lo <= x, x, lo);
    pick(above > hi, hi, above)
}

/// `scale - (scale - x)`: clears the bits of `x` that are small relative to `scale`, and turns -0 into +0.
///
/// This keeps denormals out of the polynomials, and the two roundings are part of the reference's results.
#[inline(always)]
fn crush(x: f32, scale: f32) -> f32 {
    scale - (scale - x)
}

/// The polynomial with these coefficients, highest power first; one product and one sum per step.
#[inline(always)]
fn horner<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    let mut sum = 0.0;
    let mut first = true;
    for coefficient in coefficients {
        // It does not start by adding to zero, which would cost an operation without changing the value.
        sum = if first { coefficient } else { sum * x + coefficient };
        first = false;
    }
    sum
}
