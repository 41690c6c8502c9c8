//! Hyperbolic functions, from the exponential of the magnitude.

use super::{bits, crush, exp, horner};
use crate::numeric::rounding::pick;

const SINH: [f32; 3] = [bits(0x3955_da35), bits(0x3c08_7a25), bits(0x3e2a_aad8)];

/// Hyperbolic sine; a polynomial up to 1, beyond that bounded by the clamp of exp. NaN stays NaN.
#[inline(always)]
pub fn sinh(x: f32) -> f32 {
    let magnitude = x.abs();
    let e = exp(magnitude);
    let far = 0.5 * e - 0.5 / e;
    let a = crush(magnitude, 1.0);
    let square = a * a;
    let near = (horner(square, SINH) * a) * square + a;
    pick(magnitude > 1.0, far, near).copysign(x)
}

/// Hyperbolic cosine, bounded by the clamp of exp.
#[inline(always)]
pub fn cosh(x: f32) -> f32 {
    let e = exp(x.abs());
    0.5 * e + 0.5 / e
}

/// Hyperbolic tangent, within -1..=1.
#[inline(always)]
pub fn tanh(x: f32) -> f32 {
    let e = exp(2.0 * x.abs());
    (1.0 - 2.0 / (1.0 + e)).copysign(x)
}
