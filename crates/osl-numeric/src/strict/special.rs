//! The error function, its complement and its inverse.

use super::{bits, crush, horner, log};
use crate::Single;

/// Abramowitz and Stegun 7.1.28, highest power first.
const ERF: [f32; 7] = [
    bits(0x3834_9f67),
    bits(0x3991_0039),
    bits(0x391f_6607),
    bits(0x3c17_e369),
    bits(0x3d2d_2fe7),
    bits(0x3d90_6e67),
    1.0,
];

/// Giles, "Approximating the erfinv function": for w < 5, then for the tails.
const IERF_CENTRE: [f32; 9] = [
    bits(0x32f1_6588),
    bits(0x34b8_4b36),
    bits(0xb66c_7357),
    bits(0xb693_5ac1),
    bits(0x3965_32db),
    bits(0xbaa4_5408),
    bits(0xbb88_e4ef),
    bits(0x3e7c_8f63),
    bits(0x3fc0_2e2f),
];
const IERF_TAIL: [f32; 9] = [
    bits(0xb951_f09b),
    bits(0x38d3_b56b),
    bits(0x3ab0_dc72),
    bits(0xbb70_bde7),
    bits(0x3bbc_127b),
    bits(0xbbf9_c5d7),
    bits(0x3c1a_a57e),
    bits(0x3f80_36db),
    bits(0x4035_4f7e),
];

/// Error function, within -1..=1; NaN stays NaN.
#[inline(always)]
pub fn erf<S: Single>(x: S) -> S {
    let one = S::lit(1.0);
    let r = horner(crush(x.abs(), 1.0), ERF);
    let r2 = r * r;
    let r4 = r2 * r2;
    let r8 = r4 * r4;
    let r16 = r8 * r8;
    (one - one / r16).copysign(x)
}

/// Complement of the error function, within 0..=2.
#[inline(always)]
pub fn erfc<S: Single>(x: S) -> S {
    S::lit(1.0) - erf(x)
}

/// Inverse of the error function; the argument is clamped below 1. Not a built-in of the language.
#[inline(always)]
pub fn ierf<S: Single>(x: S) -> S {
    let (one, below_one) = (S::lit(1.0), S::lit(bits(0x3f7f_ffff)));
    let magnitude = S::select(x.abs().gt(below_one), below_one, x.abs());
    let w = -log((one - magnitude) * (one + magnitude));
    let centre = horner(w - S::lit(2.5), IERF_CENTRE);
    let tail = horner(w.sqrt() - S::lit(3.0), IERF_TAIL);
    S::select(w.lt(S::lit(5.0)), centre, tail) * x
}
