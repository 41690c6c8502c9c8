//! Arc functions: a cubic times a square root for asin and acos, a rational function for atan and atan2.

use super::{PI, PI_2, bits, crush, horner};
use crate::Single;

const ACOS: [f32; 4] = [bits(0xbcb1_485d), bits(0x3d9f_b43b), bits(0xbe5a_6b93), PI_2];

/// The two factors of acos(|x|): √(1 - m) and the cubic, where m is |x| clamped to 1.
#[inline(always)]
fn acos_factors<S: Single>(x: S) -> (S, S) {
    let one = S::lit(1.0);
    let magnitude = x.abs();
    // The comparison fails for NaN, which then counts as 1.
    let m = S::select(magnitude.lt(one), crush(magnitude, 1.0), one);
    ((one - m).sqrt(), horner(m, ACOS))
}

/// Arc cosine in 0..=π; arguments beyond ±1 count as ±1.
#[inline(always)]
pub fn acos<S: Single>(x: S) -> S {
    let (root, cubic) = acos_factors(x);
    let a = root * cubic;
    S::select(x.lt(S::lit(0.0)), S::lit(PI) - a, a)
}

/// Arc sine in -π/2..=π/2; arguments beyond ±1 count as ±1.
#[inline(always)]
pub fn asin<S: Single>(x: S) -> S {
    let (root, cubic) = acos_factors(x);
    (S::lit(PI_2) - root * cubic).copysign(x)
}

/// The arctangent on 0..=1.
#[inline(always)]
fn atan_kernel<S: Single>(k: S) -> S {
    let one = S::lit(1.0);
    let s = crush(k, 1.0);
    let t = s * s;
    let numerator = s * (S::lit(bits(0x3edc_3ead)) * t + one);
    let denominator = (S::lit(bits(0x3d6d_4dc6)) * t + S::lit(bits(0x3f43_547e))) * t + one;
    numerator / denominator
}

/// Arc tangent in -π/2..=π/2.
#[inline(always)]
pub fn atan<S: Single>(x: S) -> S {
    let one = S::lit(1.0);
    let magnitude = x.abs();
    let steep = magnitude.gt(one);
    let r = atan_kernel(S::select(steep, one / magnitude, magnitude));
    S::select(steep, S::lit(PI_2) - r, r).copysign(x)
}

/// The angle of the vector (x, y) in -π..=π. The origin gives ±0, or ±π if x is -0.
#[inline(always)]
pub fn atan2<S: Single>(y: S, x: S) -> S {
    let zero = S::lit(0.0);
    let a = x.abs();
    let b = y.abs();
    let steep = b.gt(a);
    let ratio = S::select(steep, a, b) / S::select(steep, b, a);
    let k = S::select(b.eq(zero), zero, S::select(a.eq(b), S::lit(1.0), ratio));
    let r = atan_kernel(k);
    let r = S::select(steep, S::lit(PI_2) - r, r);
    // The sign bit, not a comparison: -0 is on the left.
    S::select(x.has_sign(), S::lit(PI) - r, r).copysign(y)
}
