//! Powers, the cube root and the remainder.
//!
//! `pow` is the reference's, with all its special cases; `pow_accurate` gives the results of a good
//! mathematical library, for the few places where the reference calls one.

use super::{bits, exp2, log2};
use crate::rounding::{SIGNED_WHOLE_64, is_odd, trunc32_as_float};
use crate::{Int, Single};

const THIRD: f32 = bits(0x3eaa_aaab);

/// All `f32` from here on are even whole numbers.
const ALWAYS_EVEN: f32 = 16_777_216.0;

/// x^y. In this order: y = 0 gives 1, x = 0 gives 0, y = 1 gives x, y = 2 gives x·x clamped to the largest
/// float; a negative x with a y that is not whole gives 0; all else is ±2^(y·log2|x|), never 0 and never
/// infinite.
#[inline(always)]
pub fn pow<S: Single>(x: S, y: S) -> S {
    let (zero, one, most) = (S::lit(0.0), S::lit(1.0), S::lit(f32::MAX));
    let magnitude = exp2(y * log2(x.abs()));

    // From 2^24 on, and for NaN, `y` counts as even.
    let fractional = y.abs().lt(S::lit(ALWAYS_EVEN)) & y.trunc().ne(y);
    let of_negative = S::select(fractional, zero, S::select(is_odd(y), -magnitude, magnitude));

    let square = x * x;
    let square = S::select(square.gt(most), most, square);

    // The first test that holds takes precedence, so it comes last.
    let r = S::select(x.lt(zero), of_negative, magnitude);
    let r = S::select(y.eq(S::lit(2.0)), square, r);
    let r = S::select(y.eq(one), x, r);
    let r = S::select(x.eq(zero), zero, r);
    S::select(y.eq(zero), one, r)
}

/// Cube root, odd; two steps of Newton's method from a guess in the exponent bits. Infinities give NaN.
#[inline(always)]
pub fn cbrt<S: Single>(x: S) -> S {
    let (zero, two, third) = (S::lit(0.0), S::lit(2.0), S::lit(THIRD));
    let magnitude = x.abs();
    let mut a = S::from_bits(magnitude.to_bits().third().wrapping_add(S::Int::lit(0x2a51_37a0)));
    a = third * (two * a + magnitude / (a * a));
    a = third * (two * a + magnitude / (a * a));
    S::select(magnitude.eq(zero), zero, a).copysign(x)
}

/// a minus the truncated quotient times b, for a varying divisor; 0 if b is 0. If the quotient is outside the
/// range of an `i32`, the result is the reference's arbitrary number, not a remainder.
#[inline(always)]
pub fn fmod<S: Single>(a: S, b: S) -> S {
    let zero = S::lit(0.0);
    // The sum with 0 makes -0 a 0, as an integer would.
    let quotient = trunc32_as_float(a / b) + zero;
    S::select(b.eq(zero), zero, a - quotient * b)
}

/// 1 / (2k + 1), k from 9 down to 0: the series of artanh(s) / s in s².
const ARTANH: [f64; 10] = [
    1.0 / 19.0,
    1.0 / 17.0,
    1.0 / 15.0,
    1.0 / 13.0,
    1.0 / 11.0,
    1.0 / 9.0,
    1.0 / 7.0,
    1.0 / 5.0,
    1.0 / 3.0,
    1.0,
];

/// 1 / k!, k from 13 down to 0.
const EXP: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// x^y for normal x > 0 and a result in the normal range, within 0.501 units in the last place: logarithm and
/// exponential are computed in binary64, and the only rounding to `f32` comes last. Outside that domain the
/// value is unspecified, but the same on every machine.
#[inline(always)]
pub fn pow_accurate(x: f32, y: f32) -> f32 {
    // The mantissa is scaled to √½..√2, where the series of artanh needs the fewest terms.
    let word = x.to_bits();
    let offset = word.wrapping_sub(0x3f35_04f3);
    let exponent = (offset as i32) >> 23;
    let mantissa = f64::from(f32::from_bits(word.wrapping_sub((exponent as u32) << 23)));
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let ln_mantissa = 2.0 * s * series(s * s, ARTANH);
    let ln_x = f64::from(exponent) * std::f64::consts::LN_2 + ln_mantissa;

    let exponent = f64::from(y) * ln_x;
    let periods = exponent * std::f64::consts::LOG2_E;
    let shifted = periods + SIGNED_WHOLE_64;
    let whole = shifted - SIGNED_WHOLE_64;
    let rest = exponent - whole * std::f64::consts::LN_2;
    let scale = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    (series(rest, EXP) * scale) as f32
}

#[inline(always)]
fn series<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
    let mut sum = 0.0;
    for coefficient in coefficients {
        sum = sum * x + coefficient;
    }
    sum
}
