//! The strict elementary functions: the reference implementation's own approximations in `f32`, bit for bit.
//!
//! OSL's default build replaces the mathematical library by polynomials that vectorise. They affect what a
//! shader looks like: for exp or asin, a correctly rounded library agrees in one case in a hundred. Each
//! product and each sum is rounded separately; fused operations are never used, whatever the machine offers.
//!
//! Constants are written as bit patterns where a decimal number would not show which float is meant. The
//! approximations are those of OpenImageIO's `fmath.h`. The functions are written for any [`Single`]; in a
//! loop over `f32`, they vectorise.

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

use super::real::Single;

/// The float with these bits.
#[inline(always)]
const fn bits(pattern: u32) -> f32 {
    f32::from_bits(pattern)
}

/// The float nearest to π; likewise for the others.
const PI: f32 = bits(0x4049_0fdb);
const PI_2: f32 = bits(0x3fc9_0fdb);
const PI_4: f32 = bits(0x3f49_0fdb);

/// `x` clamped to `lo..=hi`; NaN becomes `lo`.
#[inline(always)]
fn clamp<S: Single>(x: S, lo: f32, hi: f32) -> S {
    let (lo, hi) = (S::lit(lo), S::lit(hi));
    let above = S::select(x.ge(lo), x, lo);
    S::select(above.gt(hi), hi, above)
}

/// `scale - (scale - x)`: clears the bits of `x` that are small relative to `scale`, and turns -0 into +0.
///
/// This keeps denormals out of the polynomials, and the two roundings are part of the reference's results.
#[inline(always)]
fn crush<S: Single>(x: S, scale: f32) -> S {
    S::lit(scale) - (S::lit(scale) - x)
}

/// The polynomial with these coefficients, highest power first; one product and one sum per step.
#[inline(always)]
fn horner<S: Single, const N: usize>(x: S, coefficients: [f32; N]) -> S {
    let mut sum = S::lit(0.0);
    let mut first = true;
    for coefficient in coefficients {
        // It does not start by adding to zero, which would cost an operation without changing the value.
        sum = if first { S::lit(coefficient) } else { sum * x + S::lit(coefficient) };
        first = false;
    }
    sum
}
