//! The arithmetic in binary64: a reference where single precision has too few digits.
//!
//! Elementary functions come from the library `pxfm` and are accurate to about half a unit in the last place.
//! The rules of the language stay the same: arguments are clamped to the same domains, exponentials to the
//! same single-precision range, and the special cases are those of [`strict`](super::strict). Nothing is
//! rounded to single precision.

use super::geometry;
use super::rounding::pick;
use super::{Number, Real, Scalar};
use pxfm::{
    f_acos, f_asin, f_atan, f_atan2, f_cbrt, f_cos, f_cosh, f_erf, f_erfc, f_exp, f_exp2, f_expm1, f_log,
    f_log2, f_log10, f_pow, f_sin, f_sinh, f_tan, f_tanh,
};
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

/// What stands for a number that has no logarithm: the smallest normal float, as in single precision.
const SMALLEST: f64 = f32::MIN_POSITIVE as f64;
/// The ends of the exponentials' range, as powers of two: those of normal numbers, as in single precision,
/// but of doubles, so that an overflow of single precision is an error against this arithmetic.
const MOST: f64 = 1022.0;
/// 2 to that power, and one over it.
const HUGE: f64 = f64::from_bits((1023 + 1022) << 52);
const TINY: f64 = f64::from_bits((1023 - 1022) << 52);

/// `x` clamped to `lo..=hi`; NaN becomes `lo`.
#[inline(always)]
fn held(x: f64, lo: f64, hi: f64) -> f64 {
    let above = pick(lo <= x, x, lo);
    pick(above > hi, hi, above)
}

/// An argument of an exponential, clamped slightly outside of the range for which results are in theirs.
#[inline(always)]
fn exponent(x: f64) -> f64 {
    held(x, -708.5, 708.5)
}

/// An argument of a logarithm: a positive finite number.
#[inline(always)]
fn positive(x: f64) -> f64 {
    pick(x > 0.0, held(x, f64::MIN_POSITIVE, f64::MAX), SMALLEST)
}

impl Number for f64 {
    type Mask = bool;

    #[inline(always)]
    fn lit(value: f32) -> Self {
        f64::from(value)
    }

    #[inline(always)]
    fn known(_: f32, exact: f64) -> Self {
        exact
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        pick(mask, yes, no)
    }

    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }

    #[inline(always)]
    fn is_nan(self) -> bool {
        f64::is_nan(self)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        f64::floor(self)
    }
}

impl Real for f64 {
    type Int = i32;
    type Plain = f64;

    #[inline(always)]
    fn from_int(value: i32) -> Self {
        f64::from(value)
    }

    #[inline(always)]
    fn to_int(self) -> i32 {
        // A cast saturates, while the language gives the lowest integer.
        pick(self.abs() < 2_147_483_648.0, self as i32, i32::MIN)
    }

    #[inline(always)]
    fn by_value<const I: usize, const N: usize, const M: usize>(
        ints: [i32; I],
        numbers: [f64; N],
        body: impl FnOnce([i32; I], [f64; N]) -> [f64; M],
    ) -> [f64; M] {
        body(ints, numbers)
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }

    #[inline(always)]
    fn ceil(self) -> Self {
        f64::ceil(self)
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        f64::trunc(self)
    }

    #[inline(always)]
    fn round(self) -> Self {
        f64::round(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn length(square: Self, v: [Self; 3]) -> Self {
        geometry::length_by_square(square, v)
    }

    fn sin(self) -> Self {
        let endless = pick(self.is_nan(), -1.0, 1.0_f64.copysign(self));
        if f64::is_finite(self) { f_sin(self) } else { endless }
    }

    fn cos(self) -> Self {
        if f64::is_finite(self) { f_cos(self) } else { -1.0 }
    }

    fn tan(self) -> Self {
        if f64::is_finite(self) { f_tan(self) } else { self }
    }

    fn asin(self) -> Self {
        let f = f64::abs(self);
        if f < 1.0 { f_asin(self) } else { FRAC_PI_2.copysign(self) }
    }

    fn acos(self) -> Self {
        let f = f64::abs(self);
        if f < 1.0 { f_acos(self) } else { pick(self < 0.0, PI, 0.0) }
    }

    fn atan(self) -> Self {
        f_atan(self)
    }

    fn atan2(self, x: Self) -> Self {
        let flat = pick(x.is_sign_negative(), PI, 0.0).copysign(self);
        if self == 0.0 { flat } else { f_atan2(self, x) }
    }

    fn sinh(self) -> Self {
        let a = f64::abs(self);
        f_sinh(pick(a > MOST * LN_2, MOST * LN_2, a)).copysign(self)
    }

    fn cosh(self) -> Self {
        let a = f64::abs(self);
        f_cosh(pick(a <= MOST * LN_2, a, MOST * LN_2))
    }

    fn tanh(self) -> Self {
        let a = f64::abs(self);
        pick(a.is_nan(), 1.0, f_tanh(a)).copysign(self)
    }

    fn exp(self) -> Self {
        held(f_exp(exponent(self)), TINY, HUGE)
    }

    fn exp2(self) -> Self {
        f_exp2(held(self, -MOST, MOST))
    }

    fn expm1(self) -> Self {
        held(f_expm1(exponent(self)), -1.0, HUGE)
    }

    fn log(self) -> Self {
        f_log(positive(self))
    }

    fn log2(self) -> Self {
        f_log2(positive(self))
    }

    fn log10(self) -> Self {
        f_log10(positive(self))
    }

    fn logb(self) -> Self {
        let x = f64::abs(self);
        let exponent = (positive(x).to_bits() >> 52) as i32 - 1023;
        pick(x.is_nan(), 128.0, f64::from(exponent))
    }

    fn cbrt(self) -> Self {
        f_cbrt(self)
    }

    fn pow(self, y: Self) -> Self {
        let magnitude = held(f_pow(positive(f64::abs(self)), y), TINY, HUGE);
        let whole = f64::trunc(y);
        // An infinite exponent counts as even, and so does NaN.
        let fractional = f64::is_finite(y) & (whole != y);
        let half = whole * 0.5;
        let odd = f64::is_finite(y) & (f64::trunc(half) != half);
        let of_negative = pick(fractional, 0.0, pick(odd, -magnitude, magnitude));
        let square = self * self;
        let square = pick(square > f64::MAX, f64::MAX, square);
        // The first test that holds takes precedence, so it comes last.
        let r = pick(self < 0.0, of_negative, magnitude);
        let r = pick(y == 2.0, square, r);
        let r = pick(y == 1.0, self, r);
        let r = pick(self == 0.0, 0.0, r);
        pick(y == 0.0, 1.0, r)
    }

    fn erf(self) -> Self {
        f_erf(self)
    }

    fn erfc(self) -> Self {
        f_erfc(self)
    }

    fn fmod(self, divisor: Self) -> Self {
        if divisor == 0.0 { 0.0 } else { self % divisor }
    }

    fn fmod_exact(self, divisor: Self) -> Self {
        self % divisor
    }

    fn pow_accurate(self, y: Self) -> Self {
        f_pow(self, y)
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self as f32
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

#[cfg(test)]
mod tests {
    use crate::Real;

    /// Whether two numbers agree to about fifteen digits.
    fn agree(a: f64, b: f64) -> bool {
        (a - b).abs() <= 1e-15 * b.abs()
    }

    #[test]
    fn exponentials_and_logarithms_end_where_doubles_do() {
        assert!(agree(Real::exp(100.0_f64), 2.688_117_141_816_135_4e43));
        assert!(agree(Real::log(1e-60_f64), -138.155_105_579_642_74));
        assert!(agree(Real::pow(1e-60_f64, 0.1), 1e-6));
        for x in [-1e300_f64, -800.0, 800.0, 1e300, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                Real::exp(x).is_normal() && Real::exp2(x).is_normal() && Real::pow(10.0_f64, x).is_normal()
            );
        }
    }

    #[test]
    fn what_has_no_logarithm_has_that_of_the_smallest_float() {
        for x in [0.0_f64, -0.0, -3.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(Real::log(x), f64::from(f32::MIN_POSITIVE).ln(), "{x}");
        }
    }
}
