//! Sine, cosine, tangent: reduction by multiples of π in four steps, then a polynomial.
//!
//! The reduction has an absolute error of about 1e-7 up to some thousands of turns; beyond 2^31 half-turns
//! the result saturates.

use super::{PI_2, PI_4, bits, clamp, crush, horner};
use crate::Single;
use crate::rounding::{is_odd, nearest32_as_float};

const INV_PI: f32 = bits(0x3ea2_f983);
const TWO_INV_PI: f32 = bits(0x3f22_f983);

/// -π in four parts, each short enough that its product with a small integer is exact (Cody and Waite).
const MINUS_PI: [f32; 4] = [bits(0xc049_0000), bits(0xba7d_a000), bits(0xb422_2000), bits(0xacb4_611a)];
/// -π/2 likewise.
const MINUS_PI_2: [f32; 4] = [bits(0xbfc9_0000), bits(0xb9fd_a000), bits(0xb3a2_2000), bits(0xac34_611a)];

const SIN: [f32; 4] = [bits(0x362f_0a87), bits(0xb94f_baeb), bits(0x3c08_8777), bits(0xbe2a_aaa6)];
const COS: [f32; 6] =
    [bits(0xb491_ed89), bits(0x37d0_078b), bits(0xbab6_0b58), bits(0x3d2a_aaaa), bits(0xbf00_0000), 1.0];
const TAN: [f32; 6] = [
    bits(0x3c17_eb82),
    bits(0x3b59_91d7),
    bits(0x3cc7_1064),
    bits(0x3d5a_ede5),
    bits(0x3e08_958e),
    bits(0x3eaa_aa79),
];

/// `x` minus the nearest multiple of a period, and whether that multiple is odd.
#[inline(always)]
fn reduce<S: Single>(x: S, per_period: f32, minus_period: [f32; 4]) -> (S, S::Mask) {
    let turns = nearest32_as_float(x * S::lit(per_period));
    let mut rest = x;
    for part in minus_period {
        rest = rest + turns * S::lit(part);
    }
    (rest, is_odd(turns))
}

#[inline(always)]
fn sin_reduced<S: Single>(x: S, odd: S::Mask) -> S {
    let square = x * x;
    let x = S::select(odd, -x, x);
    let p = horner(square, SIN);
    clamp(square * (p * x) + x, -1.0, 1.0)
}

#[inline(always)]
fn cos_reduced<S: Single>(x: S, odd: S::Mask) -> S {
    let p = horner(x * x, COS);
    clamp(S::select(odd, -p, p), -1.0, 1.0)
}

#[inline(always)]
fn reduce_by_pi<S: Single>(x: S) -> (S, S::Mask) {
    let (rest, odd) = reduce(x, INV_PI, MINUS_PI);
    (crush(rest, PI_2), odd)
}

/// Sine of an angle in radians, within -1..=1; NaN gives -1.
#[inline(always)]
pub fn sin<S: Single>(x: S) -> S {
    let (rest, odd) = reduce_by_pi(x);
    sin_reduced(rest, odd)
}

/// Cosine of an angle in radians, within -1..=1; NaN gives -1.
#[inline(always)]
pub fn cos<S: Single>(x: S) -> S {
    let (rest, odd) = reduce_by_pi(x);
    cos_reduced(rest, odd)
}

/// `sin(x)` and `cos(x)`, bit for bit, with one reduction.
#[inline(always)]
pub fn sincos<S: Single>(x: S) -> (S, S) {
    let (rest, odd) = reduce_by_pi(x);
    (sin_reduced(rest, odd), cos_reduced(rest, odd))
}

/// Tangent of an angle in radians; infinite for infinities, NaN for NaN.
#[inline(always)]
pub fn tan<S: Single>(x: S) -> S {
    let (rest, odd) = reduce(x, TWO_INV_PI, MINUS_PI_2);
    let x = S::select(odd, rest, crush(rest, PI_4));
    let square = x * x;
    let p = square * (horner(square, TAN) * x) + x;
    S::select(odd, S::lit(-1.0) / p, p)
}

/// Approximate sin(πx) from a parabola. Used only by noise, not by a built-in.
#[inline(always)]
pub fn sinpi<S: Single>(x: S) -> S {
    // 1.5 · 2^24: the sum rounds to an even whole number.
    let even = S::lit(25_165_824.0);
    let z = x - ((x + even) - even);
    let y = z - z * z.abs();
    y * (S::lit(bits(0x4046_a762)) + S::lit(bits(0x4065_6278)) * y.abs())
}

/// Approximate cos(πx); see [`sinpi`].
#[inline(always)]
pub fn cospi<S: Single>(x: S) -> S {
    sinpi(x + S::lit(0.5))
}
