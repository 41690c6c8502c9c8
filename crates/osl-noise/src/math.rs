//! The transcendental functions that fields need, with the same bits on every machine.
//!
//! There are two families. [`exp`] and [`sin_cos`] replace a mathematical library: they compute in binary64
//! and round once, so the result is correctly rounded unless the exact value is within 10⁻¹² (relative) of a
//! tie. [`exp2_rough`] and [`sin_cos_rough`] are the short binary32 approximations that OSL renderers agree
//! on where a field is defined by them. Sources: argument reduction after Cody and Waite, and Payne and Hanek
//! (1983) for large angles; Taylor polynomials.

use osl_simd::to_int;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, LOG2_E};

/// Adding this rounds a binary64 below 2⁵¹ to an integer, which is then in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Evaluates a polynomial; the coefficients begin with the highest power.
#[inline(always)]
fn horner<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = coefficients[0];
    let mut i = 1;
    while i < N {
        sum = sum * x + coefficients[i];
        i += 1;
    }
    sum
}

/// e to the power of `x`: 0 or infinity beyond the range of floats, NaN for NaN.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    /// ln 2 in a part whose products with small integers are exact, and the rest.
    const LN_2: [f64; 2] = [f64::from_bits(0x3fe6_2e42_fee0_0000), f64::from_bits(0x3dea_39ef_3579_3c76)];
    let x = f64::from(x);
    let x = if x < -150.0 { -150.0 } else { x };
    let x = if x > 100.0 { 100.0 } else { x };
    let shifted = x * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let power = horner(
        r,
        [
            1.0 / 39_916_800.0,
            1.0 / 3_628_800.0,
            1.0 / 362_880.0,
            1.0 / 40_320.0,
            1.0 / 5040.0,
            1.0 / 720.0,
            1.0 / 120.0,
            1.0 / 24.0,
            1.0 / 6.0,
            0.5,
            1.0,
            1.0,
        ],
    );
    (power * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)) as f32
}

/// The largest magnitude for which [`sin_cos`] needs no long reduction.
pub(crate) const NEAR: f32 = 524_288.0;

/// Sine and cosine of an angle in radians. `FAR` permits every float (NaN for infinities and NaN). Without
/// it, the angle's magnitude must be at most [`NEAR`], or the result is meaningless; loops over it can then
/// be vectorised.
#[inline(always)]
pub(crate) fn sin_cos<const FAR: bool>(x: f32) -> (f32, f32) {
    if FAR && (x.abs() > NEAR || x.is_nan()) {
        return sin_cos_far(x);
    }
    /// π/2 in a part of 33 bits, whose products with the quadrants are exact, and the rest.
    const QUARTER: [f64; 2] = [f64::from_bits(0x3ff9_21fb_5440_0000), f64::from_bits(0x3dd0_b461_1a62_6331)];
    let x = f64::from(x);
    let shifted = x * FRAC_2_PI + ROUND;
    let n = shifted - ROUND;
    turned((x - n * QUARTER[0]) - n * QUARTER[1], shifted.to_bits())
}

/// Sine and cosine of `r` plus a number of quarter turns; `r` is within π/4 of 0.
#[inline(always)]
fn turned(r: f64, quarters: u64) -> (f32, f32) {
    let s = r * r;
    let sine = horner(
        s,
        [1.0 / 6_227_020_800.0, -1.0 / 39_916_800.0, 1.0 / 362_880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0],
    );
    let sine = (r + r * (s * sine)) as f32;
    let cosine = horner(
        s,
        [
            -1.0 / 87_178_291_200.0,
            1.0 / 479_001_600.0,
            -1.0 / 3_628_800.0,
            1.0 / 40_320.0,
            -1.0 / 720.0,
            1.0 / 24.0,
            -0.5,
            1.0,
        ],
    ) as f32;
    let q = quarters as u32;
    let (a, b) = if q & 1 == 0 { (sine, cosine) } else { (cosine, sine) };
    (crate::hash::flip(a, q & 2), crate::hash::flip(b, q.wrapping_add(1) & 2))
}

/// Angles of [`NEAR`] and more, whose quadrant needs more bits of 2/π than a binary64 has.
#[cold]
#[inline(never)]
fn sin_cos_far(x: f32) -> (f32, f32) {
    /// 2/π after the binary point, preceded by a word of zeros.
    const WORDS: [u32; 8] =
        [0, 0xa2f9_836e, 0x4e44_1529, 0xfc27_57d1, 0xf534_ddc0, 0xdb62_9599, 0x3c43_9041, 0xfe51_63ab];
    if !x.is_finite() {
        return (f32::NAN, f32::NAN);
    }
    // |x| = mantissa · 2^(exponent − 150). Of 2/π, only the 96 bits below the position of whole turns matter.
    let exponent = (x.abs().to_bits() >> 23) as usize;
    let mantissa = u128::from((x.to_bits() & 0x007f_ffff) | 0x0080_0000);
    let first = (exponent + 30).saturating_sub(150);
    let window = WORDS
        .iter()
        .skip(first / 32)
        .take(4)
        .fold((0_u128, 128), |(bits, at), &word| (bits | u128::from(word) << (at - 32), at - 32))
        .0;
    let product = mantissa * ((window << (first % 32)) >> 32);
    // Two bits of quadrant and 94 of fraction: the nearest quadrant and the signed remainder.
    let quarters = product.wrapping_add(1 << 93) >> 94;
    let rest = product.wrapping_sub(quarters << 94) as i128;
    const UNIT: f64 = 1.0 / ((1_u128 << 94) as f64);
    let (s, c) = turned(rest as f64 * UNIT * FRAC_PI_2, quarters as u64);
    (if x < 0.0 { -s } else { s }, c)
}

/// Two to the power of `x`, within the range of normal floats.
#[inline(always)]
pub(crate) fn exp2_rough(x: f32) -> f32 {
    let x = if x >= -126.0 { x } else { -126.0 };
    let x = if x > 126.0 { 126.0 } else { x };
    let whole = to_int(x);
    let f = x - whole as f32;
    let f = 1.0 - (1.0 - f);
    let mut r = f32::from_bits(0x3aae_c44e);
    for c in [0x3c20_bb9a, 0x3d63_6733, 0x3e75_f192, 0x3f31_71f1, 0x3f80_0000] {
        r = f * r + f32::from_bits(c);
    }
    f32::from_bits(r.to_bits().wrapping_add((whole as u32) << 23))
}

/// Sine and cosine of an angle in radians, accurate for a few turns.
#[inline(always)]
pub(crate) fn sin_cos_rough(x: f32) -> (f32, f32) {
    const QUARTER: f32 = f32::from_bits(0x3fc9_0fdb);
    let turns = x * f32::from_bits(0x3ea2_f983);
    let q = to_int(turns + 0.5_f32.copysign(turns));
    let n = q as f32;
    let mut r = n * f32::from_bits(0xc049_0000) + x;
    r += n * f32::from_bits(0xba7d_a000);
    r += n * f32::from_bits(0xb422_2000);
    r += n * f32::from_bits(0xacb4_611a);
    r = QUARTER - (QUARTER - r);
    let s = r * r;
    let odd = q as u32 & 1;
    let r = crate::hash::flip(r, odd);
    let mut sine = f32::from_bits(0x362f_0a87);
    sine = sine * s + f32::from_bits(0xb94f_baeb);
    sine = sine * s + f32::from_bits(0x3c08_8777);
    sine = sine * s + f32::from_bits(0xbe2a_aaa6);
    sine = s * (sine * r) + r;
    let mut cosine = f32::from_bits(0xb491_ed89);
    cosine = cosine * s + f32::from_bits(0x37d0_078b);
    cosine = cosine * s + f32::from_bits(0xbab6_0b58);
    cosine = cosine * s + f32::from_bits(0x3d2a_aaaa);
    cosine = cosine * s - 0.5;
    cosine = cosine * s + 1.0;
    (within_one(sine), within_one(crate::hash::flip(cosine, odd)))
}

#[inline(always)]
fn within_one(x: f32) -> f32 {
    let x = if x < -1.0 { -1.0 } else { x };
    if x > 1.0 { 1.0 } else { x }
}

/// Length of a vector, also if its squares are too small for a float.
#[inline(always)]
pub(crate) fn length([x, y, z]: [f32; 3]) -> f32 {
    let square = x * x + y * y + z * z;
    if square < 2.0 * f32::MIN_POSITIVE {
        let m = x.abs().max(y.abs()).max(z.abs());
        if m == 0.0 {
            return 0.0;
        }
        let (x, y, z) = (x / m, y / m, z / m);
        return m * (x * x + y * y + z * z).sqrt();
    }
    square.sqrt()
}

/// The vector divided by its length; zero stays zero.
#[inline(always)]
pub(crate) fn normalize(v: [f32; 3]) -> [f32; 3] {
    let l = length(v);
    if l == 0.0 { [0.0; 3] } else { [v[0] / l, v[1] / l, v[2] / l] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance in floating-point steps from the platform's binary64 functions, whose errors are far below a
    /// step.
    fn apart(got: f32, exact: f64) -> u32 {
        let order = |x: f32| {
            let b = x.to_bits() as i32;
            if b < 0 { i64::from(i32::MIN) - i64::from(b) } else { i64::from(b) }
        };
        if got.is_nan() && exact.is_nan() { 0 } else { order(got).abs_diff(order(exact as f32)) as u32 }
    }

    #[test]
    fn exponentials_are_rounded_correctly() {
        for bits in (0..=u32::MAX).step_by(10_007) {
            let x = f32::from_bits(bits);
            assert_eq!(apart(exp(x), f64::from(x).exp()), 0, "{x:e}");
        }
    }

    #[test]
    fn sines_are_rounded_correctly_however_far() {
        for bits in (0..=u32::MAX).step_by(10_007) {
            let x = f32::from_bits(bits);
            let (s, c) = sin_cos::<true>(x);
            let (es, ec) = f64::from(x).sin_cos();
            assert_eq!((apart(s, es), apart(c, ec)), (0, 0), "{x:e} {s} {c}");
            if x.abs() <= NEAR {
                assert_eq!(sin_cos::<false>(x), (s, c));
            }
        }
    }

    #[test]
    fn rough_functions_give_known_words() {
        assert_eq!(sin_cos_rough(1.0), (f32::from_bits(0x3f57_6aa4), f32::from_bits(0x3f0a_5140)));
        assert_eq!(sin_cos_rough(4.0), (f32::from_bits(0xbf41_bdcf), f32::from_bits(0xbf27_5530)));
        assert_eq!(exp2_rough(1.0), 2.0);
        assert_eq!(exp2_rough(2.5).to_bits(), 0x40b5_04e5);
    }
}
