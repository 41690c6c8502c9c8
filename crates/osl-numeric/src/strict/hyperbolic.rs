//! Hyperbolic functions, from the exponential of the magnitude.

use super::{bits, crush, exp, horner};
use crate::Single;

const SINH: [f32; 3] = [bits(0x3955_da35), bits(0x3c08_7a25), bits(0x3e2a_aad8)];

/// Hyperbolic sine; a polynomial up to 1, beyond that bounded by the clamp of exp. NaN stays NaN.
#[inline(always)]
pub fn sinh<S: Single>(x: S) -> S {
    let half = S::lit(0.5);
    let magnitude = x.abs();
    let e = exp(magnitude);
    let far = half * e - half / e;
    let a = crush(magnitude, 1.0);
    let square = a * a;
    let near = (horner(square, SINH) * a) * square + a;
    S::select(magnitude.gt(S::lit(1.0)), far, near).copysign(x)
}

/// Hyperbolic cosine, bounded by the clamp of exp.
#[inline(always)]
pub fn cosh<S: Single>(x: S) -> S {
    let half = S::lit(0.5);
    let e = exp(x.abs());
    half * e + half / e
}

/// Hyperbolic tangent, within -1..=1.
#[inline(always)]
pub fn tanh<S: Single>(x: S) -> S {
    let (one, two) = (S::lit(1.0), S::lit(2.0));
    let e = exp(two * x.abs());
    (one - two / (one + e)).copysign(x)
}
