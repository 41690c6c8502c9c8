//! The fast arithmetic: single precision with cheaper approximations, and fused products and sums where the
//! machine has them.
//!
//! Compared with the [strict](super::strict) functions, polynomials have fewer terms, angles are reduced by
//! one rounding and two products instead of four, reciprocals of numbers in a known range are computed by
//! Newton's method, and with `FUSED` set, a product and a sum are one operation. Set it only in code compiled
//! for an instruction set with such an operation: elsewhere it is a function call. Domains and special cases
//! are those of the language, except for arguments outside the ranges of [`BOUNDS`].
//!
//! Polynomials are minimax fits by weighted least squares (Lawson's iteration); the starting values of
//! Newton's method in exponent bits are those of Moroz, *Fast calculation of inverse square root with the use
//! of magic constant* (2016), and of Blinn, *Floating-point tricks* (1997).

use super::rounding::{self, pick};
use super::{Number, Real};
use std::cmp::Ordering;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of the fast arithmetic. `FUSED`: whether products and sums are one operation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Quick<const FUSED: bool>(pub f32);

/// The error bound of a function of one argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Its name in shaders.
    pub name: &'static str,
    /// The first argument for which the bound holds.
    pub from: f32,
    /// The last argument.
    pub to: f32,
    /// The error is at most this plus `relative` times the magnitude of the result.
    pub absolute: f64,
    /// See `absolute`.
    pub relative: f64,
}

const fn bound(name: &'static str, from: f32, to: f32, absolute: f64, relative: f64) -> Bound {
    Bound { name, from, to, absolute, relative }
}

/// The largest angle with an accurate sine.
const ANGLE: f32 = 1000.0;

/// The errors of the functions, with and without fused operations. Functions that are not listed are exact or
/// correctly rounded.
pub const BOUNDS: &[Bound] = &[
    bound("sin", -ANGLE, ANGLE, 1.6e-6, 0.0),
    bound("cos", -ANGLE, ANGLE, 1.6e-6, 0.0),
    bound("tan", -1.5, 1.5, 1e-7, 2e-5),
    bound("asin", -1.0, 1.0, 5e-5, 0.0),
    bound("acos", -1.0, 1.0, 5e-5, 0.0),
    bound("atan", f32::MIN, f32::MAX, 5e-6, 0.0),
    bound("sinh", -87.0, 87.0, 0.0, 2e-5),
    bound("cosh", -87.0, 87.0, 0.0, 2e-5),
    bound("tanh", f32::MIN, f32::MAX, 4e-6, 0.0),
    bound("exp", -87.0, 87.0, 0.0, 1.3e-5),
    bound("exp2", -126.0, 126.0, 0.0, 4e-6),
    bound("expm1", -87.0, 87.0, 4e-6, 1.3e-5),
    bound("log", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("log2", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("log10", f32::MIN_POSITIVE, f32::MAX, 2.5e-6, 2e-7),
    bound("cbrt", f32::MIN_POSITIVE, f32::MAX, 0.0, 2e-6),
    bound("erf", f32::MIN, f32::MAX, 3e-6, 0.0),
    bound("erfc", f32::MIN, f32::MAX, 3e-6, 0.0),
    bound("inversesqrt", f32::MIN_POSITIVE, f32::MAX, 0.0, 6e-6),
];

/// Coefficients of the functions, for other implementations of them.
pub mod coefficients {
    /// Adding this to a number rounds it to a whole number in the low bits.
    pub const WHOLE: f32 = 12_582_912.0;

    /// 1/π.
    pub const INV_PI: f32 = std::f32::consts::FRAC_1_PI;
    /// π/2.
    pub const PI_2: f32 = std::f32::consts::FRAC_PI_2;

    /// -π in two parts, for fused operations.
    pub const MINUS_PI: [f32; 2] = [-std::f32::consts::PI, 8.742_278e-8];
    /// -π in three parts whose products with small integers are exact.
    pub const MINUS_PI_PARTS: [f32; 3] = [-3.140_625, -0.000_967_502_6, -1.509_906_7e-7];
    /// -π/2 in two parts.
    pub const MINUS_PI_2: [f32; 2] = [-PI_2, 4.371_139e-8];
    /// -π/2 in three parts of the same kind.
    pub const MINUS_PI_2_PARTS: [f32; 3] = [-1.570_312_5, -0.000_483_751_3, -7.549_533_6e-8];

    /// Sine: powers of the squared angle.
    pub const SIN: [f32; 3] = [-0.000_185_422_24, 0.008_314_275, -0.166_658_54];
    /// Tangent, in the same form.
    pub const TAN: [f32; 4] = [0.043_088_8, 0.041_398_55, 0.136_065_07, 0.333_154_32];
    /// Arc tangent.
    pub const ATAN: [f32; 6] =
        [-0.013_480_626, 0.057_477_742, -0.121_239_5, 0.195_636_1, -0.332_994_64, 0.999_995_65];
    /// Arc cosine, divided by √(1 - x).
    pub const ACOS: [f32; 4] = [-0.020_892_033, 0.076_897_38, -0.212_875_19, 1.570_758_3];
    /// 2 to the power of a number within 1/2 of 0.
    pub const EXP2: [f32; 5] = [0.009_582_853, 0.055_906_426, 0.240_240_99, 0.693_124_2, 1.0];
    /// Logarithm to base 2 of 1 plus the argument.
    pub const LOG2: [f32; 6] =
        [-0.145_179_3, 0.292_726_73, -0.371_069_28, 0.481_645_58, -0.721_094_55, 1.442_681_6];
    /// Hyperbolic sine of a small number.
    pub const SINH: [f32; 2] = [0.008_610_608, 0.166_582_14];
    /// Sixteenth root of the reciprocal of 1 minus the error function.
    pub const ERF: [f32; 7] =
        [4.306_378e-5, 0.000_276_567_2, 0.000_152_014_3, 0.009_270_527, 0.042_282_01, 0.070_523_076, 1.0];
}

use coefficients::{
    ACOS, ATAN, ERF, EXP2, INV_PI, LOG2, MINUS_PI, MINUS_PI_2, MINUS_PI_2_PARTS, MINUS_PI_PARTS, PI_2, SIN,
    SINH, TAN, WHOLE,
};
use std::f32::consts::LOG2_E;

impl<const FUSED: bool> Quick<FUSED> {
    /// `a * b + c`.
    #[inline(always)]
    fn fused(a: f32, b: f32, c: f32) -> f32 {
        if FUSED { a.mul_add(b, c) } else { a * b + c }
    }

    /// The polynomial with these coefficients, highest power first.
    #[inline(always)]
    fn horner<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
        let mut sum = coefficients[0];
        let mut at = 1;
        while at < N {
            sum = Self::fused(sum, x, coefficients[at]);
            at += 1;
        }
        sum
    }

    /// `x` plus a whole number of minus periods.
    #[inline(always)]
    fn reduced(x: f32, periods: f32, fused: [f32; 2], parts: [f32; 3]) -> f32 {
        if FUSED {
            Self::fused(periods, fused[1], Self::fused(periods, fused[0], x))
        } else {
            ((x + periods * parts[0]) + periods * parts[1]) + periods * parts[2]
        }
    }

    /// Sine of an angle within π/2 of 0, with the sign flipped if the lowest of `bits` is set; within -1..=1.
    #[inline(always)]
    fn sine(r: f32, bits: u32) -> f32 {
        let square = r * r;
        let p = Self::fused(Self::horner(square, SIN) * square, r, r);
        within_one(f32::from_bits(p.to_bits() ^ (bits << 31)))
    }

    /// 2 to the power of a number, which is clamped to -126..=126.
    #[inline(always)]
    fn power_of_two(x: f32) -> f32 {
        let x = pick(x >= -126.0, x, -126.0);
        let x = pick(x > 126.0, 126.0, x);
        let shifted = x + WHOLE;
        let f = x - (shifted - WHOLE);
        let r = Self::horner(f, EXP2);
        f32::from_bits(r.to_bits().wrapping_add(shifted.to_bits() << 23))
    }

    /// Logarithm to base 2 of the argument, which is clamped to the positive normal floats.
    #[inline(always)]
    fn logarithm(x: f32) -> f32 {
        let x = pick(x >= f32::MIN_POSITIVE, x, f32::MIN_POSITIVE);
        let word = pick(x > f32::MAX, f32::MAX, x).to_bits();
        // The mantissa is in 0.75..1.5, so that there is no cancellation near 1.
        let exponent = (word.wrapping_sub(0x3f40_0000) as i32) >> 23;
        let f = f32::from_bits(word.wrapping_sub((exponent as u32) << 23)) - 1.0;
        Self::fused(Self::horner(f, LOG2), f, exponent as f32)
    }

    /// The reciprocal of a number from 2^-126 to 2^126.
    #[inline(always)]
    fn reciprocal(x: f32) -> f32 {
        let mut y = f32::from_bits(0x7ef3_11c7_u32.wrapping_sub(x.to_bits()));
        y *= Self::fused(-x, y, 2.0);
        y *= Self::fused(-x, y, 2.0);
        y * Self::fused(-x, y, 2.0)
    }

    /// The arc tangent of a number in 0..=1.
    #[inline(always)]
    fn arc(k: f32) -> f32 {
        Self::horner(k * k, ATAN) * k
    }
}

#[inline(always)]
fn within_one(x: f32) -> f32 {
    let x = pick(x >= -1.0, x, -1.0);
    pick(x > 1.0, 1.0, x)
}

impl<const FUSED: bool> PartialOrd for Quick<FUSED> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.partial_cmp(&other.0)
    }
    #[inline(always)]
    fn lt(&self, other: &Self) -> bool {
        self.0 < other.0
    }
    #[inline(always)]
    fn le(&self, other: &Self) -> bool {
        self.0 <= other.0
    }
    #[inline(always)]
    fn gt(&self, other: &Self) -> bool {
        self.0 > other.0
    }
    #[inline(always)]
    fn ge(&self, other: &Self) -> bool {
        self.0 >= other.0
    }
}

macro_rules! operators {
    ($($trait:ident $name:ident $op:tt;)*) => {$(
        impl<const FUSED: bool> $trait for Quick<FUSED> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Quick(self.0 $op other.0)
            }
        }
    )*};
}

operators! {
    Add add +;
    Sub sub -;
    Mul mul *;
    Div div /;
}

impl<const FUSED: bool> Neg for Quick<FUSED> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Quick(-self.0)
    }
}

impl<const FUSED: bool> Number for Quick<FUSED> {
    #[inline(always)]
    fn lit(value: f32) -> Self {
        Quick(value)
    }

    #[inline(always)]
    fn known(single: f32, _: f64) -> Self {
        Quick(single)
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        pick(mask, yes, no)
    }

    #[inline(always)]
    fn is_nan(self) -> bool {
        self.0.is_nan()
    }

    #[inline(always)]
    fn floor(self) -> Self {
        Quick(rounding::floor(self.0))
    }
}

macro_rules! exact {
    ($($name:ident($($arg:ident),*);)*) => {$(
        #[inline(always)]
        fn $name(self $(, $arg: Self)*) -> Self {
            Quick(Real::$name(self.0 $(, $arg.0)*))
        }
    )*};
}

impl<const FUSED: bool> Real for Quick<FUSED> {
    #[inline(always)]
    fn from_int(value: i32) -> Self {
        Quick(value as f32)
    }

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self.0
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self.0)
    }

    #[inline(always)]
    fn to_int(self) -> i32 {
        rounding::trunc32(self.0)
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    exact! {
        abs();
        copysign(sign);
        ceil();
        trunc();
        round();
        sqrt();
        logb();
        fmod(divisor);
        fmod_exact(divisor);
        pow_accurate(y);
    }

    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        Quick(Self::fused(a.0, b.0, self.0))
    }

    #[inline(always)]
    fn minus_product(self, a: Self, b: Self) -> Self {
        Quick(Self::fused(-a.0, b.0, self.0))
    }

    #[inline(always)]
    fn inverse_root(self) -> Self {
        let x = pick(self.0 > f32::MIN_POSITIVE, self.0, f32::MIN_POSITIVE);
        let half = 0.5 * x;
        let mut y = f32::from_bits(0x5f37_59df_u32.wrapping_sub(x.to_bits() >> 1));
        y *= Self::fused(-half * y, y, 1.5);
        y *= Self::fused(-half * y, y, 1.5);
        Quick(pick(self.0 <= f32::MAX, y, 0.0))
    }

    #[inline(always)]
    fn sin(self) -> Self {
        let shifted = Self::fused(self.0, INV_PI, WHOLE);
        let r = Self::reduced(self.0, shifted - WHOLE, MINUS_PI, MINUS_PI_PARTS);
        Quick(Self::sine(r, shifted.to_bits()))
    }

    #[inline(always)]
    fn cos(self) -> Self {
        // The cosine is the sine of the angle from the previous zero.
        let shifted = Self::fused(self.0, INV_PI, 0.5) + WHOLE;
        let r = Self::reduced(self.0, (shifted - WHOLE) - 0.5, MINUS_PI, MINUS_PI_PARTS);
        Quick(Self::sine(-r, !shifted.to_bits()))
    }

    #[inline(always)]
    fn tan(self) -> Self {
        let shifted = Self::fused(self.0, 2.0 * INV_PI, WHOLE);
        let r = Self::reduced(self.0, shifted - WHOLE, MINUS_PI_2, MINUS_PI_2_PARTS);
        let square = r * r;
        let p = Self::fused(Self::horner(square, TAN) * square, r, r);
        Quick(pick(shifted.to_bits() & 1 != 0, -1.0 / p, p))
    }

    #[inline(always)]
    fn asin(self) -> Self {
        Quick((PI_2 - half_acos::<FUSED>(self.0)).copysign(self.0))
    }

    #[inline(always)]
    fn acos(self) -> Self {
        let a = half_acos::<FUSED>(self.0);
        Quick(pick(self.0 < 0.0, std::f32::consts::PI - a, a))
    }

    #[inline(always)]
    fn atan(self) -> Self {
        let magnitude = self.0.abs();
        let steep = magnitude > 1.0;
        let r = Self::arc(pick(steep, 1.0 / magnitude, magnitude));
        Quick(pick(steep, PI_2 - r, r).copysign(self.0))
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let (a, b) = (x.0.abs(), self.0.abs());
        let steep = b > a;
        let ratio = pick(steep, a, b) / pick(steep, b, a);
        let k = pick(b == 0.0, 0.0, pick(a == b, 1.0, ratio));
        let r = Self::arc(k);
        let r = pick(steep, PI_2 - r, r);
        Quick(pick(x.0.is_sign_negative(), std::f32::consts::PI - r, r).copysign(self.0))
    }

    #[inline(always)]
    fn sinh(self) -> Self {
        let a = self.0.abs();
        let e = Self::power_of_two(a * LOG2_E);
        let far = 0.5 * e - 0.5 * Self::reciprocal(e);
        let square = a * a;
        let near = Self::fused(Self::horner(square, SINH) * square, a, a);
        Quick(pick(a > 1.0, far, near).copysign(self.0))
    }

    #[inline(always)]
    fn cosh(self) -> Self {
        let e = Self::power_of_two(self.0.abs() * LOG2_E);
        Quick(Self::fused(0.5, e, 0.5 * Self::reciprocal(e)))
    }

    #[inline(always)]
    fn tanh(self) -> Self {
        let e = Self::power_of_two(self.0.abs() * (2.0 * LOG2_E));
        Quick(Self::fused(-2.0, Self::reciprocal(1.0 + e), 1.0).copysign(self.0))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        Quick(Self::power_of_two(self.0 * LOG2_E))
    }

    #[inline(always)]
    fn exp2(self) -> Self {
        Quick(Self::power_of_two(self.0))
    }

    #[inline(always)]
    fn expm1(self) -> Self {
        let x = self.0;
        let series = Self::fused(0.5 * x, x, x);
        Quick(pick(x.abs() < 0.01, series, Self::power_of_two(x * LOG2_E) - 1.0))
    }

    #[inline(always)]
    fn log(self) -> Self {
        Quick(Self::logarithm(self.0) * std::f32::consts::LN_2)
    }

    #[inline(always)]
    fn log2(self) -> Self {
        Quick(Self::logarithm(self.0))
    }

    #[inline(always)]
    fn log10(self) -> Self {
        Quick(Self::logarithm(self.0) * std::f32::consts::LOG10_2)
    }

    #[inline(always)]
    fn cbrt(self) -> Self {
        let x = self.0.abs();
        // The reciprocal of the root, without a division: a third of the exponent's bits, computed through a
        // float.
        let third = (x.to_bits() >> 8) as i32 as f32 * (1.0 / 3.0) + WHOLE;
        let third = third.to_bits().wrapping_sub(WHOLE.to_bits()) << 8;
        let mut y = f32::from_bits(0x54a2_1d2a_u32.wrapping_sub(third));
        let x_third = x * (1.0 / 3.0);
        y *= Self::fused(-x_third * y, y * y, 4.0 / 3.0);
        y *= Self::fused(-x_third * y, y * y, 4.0 / 3.0);
        y *= Self::fused(-x_third * y, y * y, 4.0 / 3.0);
        Quick(pick(x == 0.0, 0.0, x * y * y).copysign(self.0))
    }

    #[inline(always)]
    fn pow(self, y: Self) -> Self {
        let (x, y) = (self.0, y.0);
        let magnitude = Self::power_of_two(y * Self::logarithm(x.abs()));
        // Large exponents are even.
        let shifted = y + WHOLE;
        let fractional = (y.abs() < 4_194_304.0) & (shifted - WHOLE != y);
        let odd = (y.abs() < 4_194_304.0) & (shifted.to_bits() & 1 != 0);
        let of_negative = pick(fractional, 0.0, pick(odd, -magnitude, magnitude));
        let square = x * x;
        let square = pick(square > f32::MAX, f32::MAX, square);
        // The first test that holds takes precedence, so it comes last.
        let r = pick(x < 0.0, of_negative, magnitude);
        let r = pick(y == 2.0, square, r);
        let r = pick(y == 1.0, x, r);
        let r = pick(x == 0.0, 0.0, r);
        Quick(pick(y == 0.0, 1.0, r))
    }

    #[inline(always)]
    fn erf(self) -> Self {
        let x = self.0.abs();
        // Beyond 4 the result is 1. NaN stays.
        let x = pick(x > 4.0, 4.0, x);
        let r = Self::horner(x, ERF);
        let r2 = r * r;
        let r4 = r2 * r2;
        let r8 = r4 * r4;
        Quick((1.0 - Self::reciprocal(r8 * r8)).copysign(self.0))
    }

    #[inline(always)]
    fn erfc(self) -> Self {
        Quick(1.0 - self.erf().0)
    }
}

/// The arc cosine of a magnitude; larger magnitudes and NaN count as 1.
#[inline(always)]
fn half_acos<const FUSED: bool>(x: f32) -> f32 {
    let magnitude = x.abs();
    let m = pick(magnitude < 1.0, magnitude, 1.0);
    (1.0 - m).sqrt() * Quick::<FUSED>::horner(m, ACOS)
}
