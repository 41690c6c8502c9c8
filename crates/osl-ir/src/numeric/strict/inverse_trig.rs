//! Arc functions: a cubic times a square root for asin and acos, a rational function for atan and atan2.
//!
//! This module must not know the forward functions.

use super::{PI, PI_2, bits, crush, horner};
use crate::numeric::rounding::pick;

const ACOS: [f32; 4] = [bits(0xbcb1_485d), bits(0x3d9f_b43b), bits(0xbe5a_6b93), PI_2];

/// The two factors of acos(|x|): √(1 - m) and the cubic, where m is |x| clamped to 1.
#[inline(always)]
fn acos_factors(x: f32) -> (f32, f32) {
    let magnitude = x.abs();
    // The comparison fails for NaN, which then counts as 1.
    let m = pick(magnitude < 1.0, crush(magnitude, 1.0), 1.0);
    ((1.0 - m).sqrt(), horner(m, ACOS))
}

/// Arc cosine in 0..=π; arguments beyond ±1 count as ±1.
#[inline(always)]
pub fn acos(x: f32) -> f32 {
    let (root, cubic) = acos_factors(x);
    let a = root * cubic;
    pick(x < 0.0, PI - a, a)
}

/// Arc sine in -π/2..=π/2; arguments beyond ±1 count as ±1.
#[inline(always)]
pub fn asin(x: f32) -> f32 {
    let (root, cubic) = acos_factors(x);
    (-root * cubic + PI_2).copysign(x)
}

/// The arctangent on 0..=1.
#[inline(always)]
fn atan_kernel(k: f32) -> f32 {
    let s = crush(k, 1.0);
    let t = s * s;
    let numerator = s * (bits(0x3edc_3ead) * t + 1.0);
    let denominator = (bits(0x3d6d_4dc6) * t + bits(0x3f43_547e)) * t + 1.0;
    numerator / denominator
}

/// Arc tangent in -π/2..=π/2.
#[inline(always)]
pub fn atan(x: f32) -> f32 {
    let magnitude = x.abs();
    let steep = magnitude > 1.0;
    let r = atan_kernel(pick(steep, 1.0 / magnitude, magnitude));
    pick(steep, PI_2 - r, r).copysign(x)
}

/// The angle of the vector (x, y) in -π..=π. The origin gives ±0, or ±π if x is -0.
#[inline(always)]
pub fn atan2(y: f32, x: f32) -> f32 {
    let a = x.abs();
    let b = y.abs();
    let steep = b > a;
    let ratio = pick(steep, a, b) / pick(steep, b, a);
    let k = pick(b == 0.0, 0.0, pick(a == b, 1.0, ratio));
    let r = atan_kernel(k);
    let r = pick(steep, PI_2 - r, r);
    // The sign bit, not a comparison: -0 is on the left.
    pick(x.is_sign_negative(), PI - r, r).copysign(y)
}
