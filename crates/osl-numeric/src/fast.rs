//! The fast arithmetic: single precision with cheaper approximations, and fused products and sums where the
//! machine has them.
//!
//! Compared with the [strict](super::strict) functions, polynomials have fewer terms, angles are reduced by
//! one rounding and two products instead of four, reciprocals of numbers in a known range are computed by
//! Newton's method, and with `FUSED` set, a product and a sum are one operation. Set it only in code compiled
//! for an instruction set with such an operation: elsewhere it is a function call. Domains and special cases
//! are those of the language, except for arguments outside the ranges of [`BOUNDS`]. The formulas use the
//! bits of any [`Single`], so that they run on floats and are recorded for machine code alike.
//!
//! Polynomials are minimax fits by weighted least squares (Lawson's iteration); the starting values of
//! Newton's method in exponent bits are those of Moroz, *Fast calculation of inverse square root with the use
//! of magic constant* (2016), and of Blinn, *Floating-point tricks* (1997).

mod bounds;
mod coefficients;

use super::geometry;
use super::int::Int;
use super::real::{Number, Real, Scalar, Single};
pub use bounds::{BOUNDS, Bound};
use coefficients::{
    ACOS, ATAN, ERF, EXP2, INV_PI, LOG2, MINUS_PI, MINUS_PI_2, MINUS_PI_2_PARTS, MINUS_PI_PARTS, PI_2, SIN,
    SINH, TAN, WHOLE,
};
use std::f32::consts::{LN_2, LOG2_E, LOG10_2, PI};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number of the fast arithmetic, over a number of the strict one. `FUSED`: whether products and sums are
/// one operation.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
#[repr(transparent)]
pub struct FastFloat<const FUSED: bool, S = f32>(pub S);

impl<const FUSED: bool, S: Single> FastFloat<FUSED, S> {
    /// `x + a * b`.
    #[inline(always)]
    fn plus(x: S, a: S, b: S) -> S {
        if FUSED { x.plus_fused(a, b) } else { a * b + x }
    }

    /// `x - a * b`.
    #[inline(always)]
    fn minus(x: S, a: S, b: S) -> S {
        if FUSED { x.minus_fused(a, b) } else { x - a * b }
    }

    /// The polynomial with these coefficients, highest power first.
    #[inline(always)]
    fn horner<const N: usize>(x: S, coefficients: [f32; N]) -> S {
        let mut sum = S::lit(coefficients[0]);
        let mut at = 1;
        while at < N {
            sum = Self::plus(S::lit(coefficients[at]), sum, x);
            at += 1;
        }
        sum
    }

    /// `x` plus a polynomial of its square, times that square and `x`.
    #[inline(always)]
    fn odd<const N: usize>(x: S, coefficients: [f32; N]) -> S {
        let square = x * x;
        Self::plus(x, Self::horner(square, coefficients) * square, x)
    }

    /// `x` plus a whole number of minus periods.
    #[inline(always)]
    fn reduced(x: S, periods: S, fused: [f32; 2], parts: [f32; 3]) -> S {
        if FUSED {
            Self::plus(Self::plus(x, periods, S::lit(fused[0])), periods, S::lit(fused[1]))
        } else {
            let [first, second, third] = [S::lit(parts[0]), S::lit(parts[1]), S::lit(parts[2])];
            ((x + periods * first) + periods * second) + periods * third
        }
    }

    /// Sine of an angle within π/2 of 0, with the sign flipped if the lowest of `bits` is set; within -1..=1.
    #[inline(always)]
    fn sine(r: S, bits: S::Int) -> S {
        let p = Self::odd(r, SIN);
        clamped(S::from_bits(p.to_bits() ^ bits.shl(S::Int::lit(31))), -1.0, 1.0)
    }

    /// 2 to the power of a number, which is clamped to -126..=126.
    #[inline(always)]
    fn power_of_two(x: S) -> S {
        let x = clamped(x, -126.0, 126.0);
        let shifted = x + S::lit(WHOLE);
        let f = x - (shifted - S::lit(WHOLE));
        let r = Self::horner(f, EXP2);
        S::from_bits(r.to_bits().wrapping_add(shifted.to_bits().shl(S::Int::lit(23))))
    }

    /// Logarithm to base 2 of the argument, which is clamped to the positive normal floats.
    #[inline(always)]
    fn logarithm(x: S) -> S {
        let (word, distance) = (clamped(x, f32::MIN_POSITIVE, f32::MAX).to_bits(), S::Int::lit(23));
        // The mantissa is in 0.75..1.5, so that there is no cancellation near 1.
        let exponent = word.wrapping_sub(S::Int::lit(0x3f40_0000)).shr(distance);
        let f = S::from_bits(word.wrapping_sub(exponent.shl(distance))) - S::lit(1.0);
        Self::plus(S::from_int(exponent), Self::horner(f, LOG2), f)
    }

    /// The reciprocal of a number from 2^-126 to 2^126.
    #[inline(always)]
    fn reciprocal(x: S) -> S {
        let two = S::lit(2.0);
        let mut y = S::from_bits(S::Int::lit(0x7ef3_11c7).wrapping_sub(x.to_bits()));
        y = y * Self::minus(two, x, y);
        y = y * Self::minus(two, x, y);
        y * Self::minus(two, x, y)
    }

    /// The arc tangent of a number in 0..=1.
    #[inline(always)]
    fn arc(k: S) -> S {
        Self::horner(k * k, ATAN) * k
    }

    /// The arc cosine of a magnitude; larger magnitudes and NaN count as 1.
    #[inline(always)]
    fn half_acos(x: S) -> S {
        let one = S::lit(1.0);
        let magnitude = x.abs();
        let m = S::select(magnitude.lt(one), magnitude, one);
        (one - m).sqrt() * Self::horner(m, ACOS)
    }
}

/// `x` clamped to `lo..=hi`; NaN becomes `lo`.
#[inline(always)]
fn clamped<S: Single>(x: S, lo: f32, hi: f32) -> S {
    let x = S::select(x.ge(S::lit(lo)), x, S::lit(lo));
    S::select(x.gt(S::lit(hi)), S::lit(hi), x)
}

macro_rules! operators {
    ($($trait:ident $name:ident $op:tt;)*) => {$(
        impl<const FUSED: bool, S: Single> $trait for FastFloat<FUSED, S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                FastFloat(self.0 $op other.0)
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

impl<const FUSED: bool, S: Single> Neg for FastFloat<FUSED, S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        FastFloat(-self.0)
    }
}

/// Methods that are those of the strict arithmetic.
macro_rules! exact {
    ($($name:ident($($arg:ident),*);)*) => {$(
        #[inline(always)]
        fn $name(self $(, $arg: Self)*) -> Self {
            FastFloat(S::$name(self.0 $(, $arg.0)*))
        }
    )*};
}

macro_rules! comparisons {
    ($($name:ident)*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> S::Mask {
            S::$name(self.0, other.0)
        }
    )*};
}

impl<const FUSED: bool, S: Single> Number for FastFloat<FUSED, S> {
    type Mask = S::Mask;

    #[inline(always)]
    fn lit(value: f32) -> Self {
        FastFloat(S::lit(value))
    }

    #[inline(always)]
    fn known(single: f32, exact: f64) -> Self {
        FastFloat(S::known(single, exact))
    }

    #[inline(always)]
    fn select(mask: S::Mask, yes: Self, no: Self) -> Self {
        FastFloat(S::select(mask, yes.0, no.0))
    }

    comparisons! { eq ne lt le gt ge }

    #[inline(always)]
    fn is_nan(self) -> S::Mask {
        self.0.is_nan()
    }

    exact! { floor(); }
}

impl<const FUSED: bool, S: Single> Real for FastFloat<FUSED, S> {
    type Int = S::Int;
    type Plain = FastFloat<FUSED>;

    #[inline(always)]
    fn from_int(value: S::Int) -> Self {
        FastFloat(S::from_int(value))
    }

    #[inline(always)]
    fn to_int(self) -> S::Int {
        self.0.to_int()
    }

    #[inline(always)]
    fn by_value<const I: usize, const N: usize, const M: usize>(
        ints: [S::Int; I],
        numbers: [Self; N],
        body: impl FnOnce([i32; I], [FastFloat<FUSED>; N]) -> [FastFloat<FUSED>; M],
    ) -> [Self; M] {
        S::by_value(
            ints,
            numbers.map(|x| x.0),
            #[inline(always)]
            |ints, numbers| body(ints, numbers.map(FastFloat)).map(|x| x.0),
        )
        .map(FastFloat)
    }

    #[inline(always)]
    fn is_finite(self) -> S::Mask {
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
        FastFloat(Self::plus(self.0, a.0, b.0))
    }

    #[inline(always)]
    fn minus_product(self, a: Self, b: Self) -> Self {
        FastFloat(Self::minus(self.0, a.0, b.0))
    }

    #[inline(always)]
    fn length(square: Self, v: [Self; 3]) -> Self {
        geometry::length_by_square(square, v)
    }

    #[inline(always)]
    fn inverse_root(self) -> Self {
        let (least, three_halves) = (S::lit(f32::MIN_POSITIVE), S::lit(1.5));
        let x = S::select(self.0.gt(least), self.0, least);
        let half = S::lit(0.5) * x;
        let start = S::Int::lit(0x5f37_59df).wrapping_sub(x.to_bits().shr(S::Int::lit(1)));
        let mut y = S::from_bits(start);
        y = y * Self::minus(three_halves, half * y, y);
        y = y * Self::minus(three_halves, half * y, y);
        FastFloat(S::select(self.0.le(S::lit(f32::MAX)), y, S::lit(0.0)))
    }

    #[inline(always)]
    fn sin(self) -> Self {
        let whole = S::lit(WHOLE);
        let shifted = Self::plus(whole, self.0, S::lit(INV_PI));
        let r = Self::reduced(self.0, shifted - whole, MINUS_PI, MINUS_PI_PARTS);
        FastFloat(Self::sine(r, shifted.to_bits()))
    }

    #[inline(always)]
    fn cos(self) -> Self {
        let (whole, half) = (S::lit(WHOLE), S::lit(0.5));
        // The cosine is the sine of the angle from the previous zero.
        let shifted = Self::plus(half, self.0, S::lit(INV_PI)) + whole;
        let r = Self::reduced(self.0, (shifted - whole) - half, MINUS_PI, MINUS_PI_PARTS);
        FastFloat(Self::sine(-r, !shifted.to_bits()))
    }

    #[inline(always)]
    fn tan(self) -> Self {
        let whole = S::lit(WHOLE);
        let shifted = Self::plus(whole, self.0, S::lit(2.0 * INV_PI));
        let r = Self::reduced(self.0, shifted - whole, MINUS_PI_2, MINUS_PI_2_PARTS);
        let p = Self::odd(r, TAN);
        let is_odd = (shifted.to_bits() & S::Int::lit(1)).is_true();
        FastFloat(S::select(is_odd, S::lit(-1.0) / p, p))
    }

    #[inline(always)]
    fn asin(self) -> Self {
        FastFloat((S::lit(PI_2) - Self::half_acos(self.0)).copysign(self.0))
    }

    #[inline(always)]
    fn acos(self) -> Self {
        let a = Self::half_acos(self.0);
        FastFloat(S::select(self.0.lt(S::lit(0.0)), S::lit(PI) - a, a))
    }

    #[inline(always)]
    fn atan(self) -> Self {
        let one = S::lit(1.0);
        let magnitude = self.0.abs();
        let steep = magnitude.gt(one);
        let r = Self::arc(S::select(steep, one / magnitude, magnitude));
        FastFloat(S::select(steep, S::lit(PI_2) - r, r).copysign(self.0))
    }

    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        let zero = S::lit(0.0);
        let (a, b) = (x.0.abs(), self.0.abs());
        let steep = b.gt(a);
        let ratio = S::select(steep, a, b) / S::select(steep, b, a);
        let k = S::select(b.eq(zero), zero, S::select(a.eq(b), S::lit(1.0), ratio));
        let r = Self::arc(k);
        let r = S::select(steep, S::lit(PI_2) - r, r);
        FastFloat(S::select(x.0.has_sign(), S::lit(PI) - r, r).copysign(self.0))
    }

    #[inline(always)]
    fn sinh(self) -> Self {
        let half = S::lit(0.5);
        let a = self.0.abs();
        let e = Self::power_of_two(a * S::lit(LOG2_E));
        let far = half * e - half * Self::reciprocal(e);
        let near = Self::odd(a, SINH);
        FastFloat(S::select(a.gt(S::lit(1.0)), far, near).copysign(self.0))
    }

    #[inline(always)]
    fn cosh(self) -> Self {
        let half = S::lit(0.5);
        let e = Self::power_of_two(self.0.abs() * S::lit(LOG2_E));
        FastFloat(Self::plus(half * Self::reciprocal(e), half, e))
    }

    #[inline(always)]
    fn tanh(self) -> Self {
        let (one, two) = (S::lit(1.0), S::lit(2.0));
        let e = Self::power_of_two(self.0.abs() * S::lit(2.0 * LOG2_E));
        FastFloat(Self::minus(one, two, Self::reciprocal(one + e)).copysign(self.0))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        FastFloat(Self::power_of_two(self.0 * S::lit(LOG2_E)))
    }

    #[inline(always)]
    fn exp2(self) -> Self {
        FastFloat(Self::power_of_two(self.0))
    }

    #[inline(always)]
    fn expm1(self) -> Self {
        let x = self.0;
        let series = Self::plus(x, S::lit(0.5) * x, x);
        let far = Self::power_of_two(x * S::lit(LOG2_E)) - S::lit(1.0);
        FastFloat(S::select(x.abs().lt(S::lit(0.01)), series, far))
    }

    #[inline(always)]
    fn log(self) -> Self {
        FastFloat(Self::logarithm(self.0) * S::lit(LN_2))
    }

    #[inline(always)]
    fn log2(self) -> Self {
        FastFloat(Self::logarithm(self.0))
    }

    #[inline(always)]
    fn log10(self) -> Self {
        FastFloat(Self::logarithm(self.0) * S::lit(LOG10_2))
    }

    #[inline(always)]
    fn cbrt(self) -> Self {
        let (third, limit, zero) = (S::lit(1.0 / 3.0), S::lit(4.0 / 3.0), S::lit(0.0));
        let (x, eight) = (self.0.abs(), S::Int::lit(8));
        // The reciprocal of the root, without a division: a third of the exponent's bits, computed through a
        // float.
        let bits = S::from_int(x.to_bits().shr(eight)) * third + S::lit(WHOLE);
        let bits = bits.to_bits().wrapping_sub(S::lit(WHOLE).to_bits()).shl(eight);
        let mut y = S::from_bits(S::Int::lit(0x54a2_1d2a).wrapping_sub(bits));
        let x_third = x * third;
        y = y * Self::minus(limit, x_third * y, y * y);
        y = y * Self::minus(limit, x_third * y, y * y);
        y = y * Self::minus(limit, x_third * y, y * y);
        FastFloat(S::select(x.eq(zero), zero, x * y * y).copysign(self.0))
    }

    #[inline(always)]
    fn pow(self, y: Self) -> Self {
        let (x, y) = (self.0, y.0);
        let (zero, one, most, whole) = (S::lit(0.0), S::lit(1.0), S::lit(f32::MAX), S::lit(WHOLE));
        let magnitude = Self::power_of_two(y * Self::logarithm(x.abs()));
        // Large exponents are even.
        let shifted = y + whole;
        let is_small = y.abs().lt(S::lit(4_194_304.0));
        let fractional = is_small & (shifted - whole).ne(y);
        let odd = is_small & (shifted.to_bits() & S::Int::lit(1)).is_true();
        let of_negative = S::select(fractional, zero, S::select(odd, -magnitude, magnitude));
        let square = x * x;
        let square = S::select(square.gt(most), most, square);
        // The first test that holds takes precedence, so it comes last.
        let r = S::select(x.lt(zero), of_negative, magnitude);
        let r = S::select(y.eq(S::lit(2.0)), square, r);
        let r = S::select(y.eq(one), x, r);
        let r = S::select(x.eq(zero), zero, r);
        FastFloat(S::select(y.eq(zero), one, r))
    }

    #[inline(always)]
    fn erf(self) -> Self {
        let (one, four) = (S::lit(1.0), S::lit(4.0));
        let x = self.0.abs();
        // Beyond 4 the result is 1. NaN stays.
        let x = S::select(x.gt(four), four, x);
        let r = Self::horner(x, ERF);
        let r2 = r * r;
        let r4 = r2 * r2;
        let r8 = r4 * r4;
        FastFloat((one - Self::reciprocal(r8 * r8)).copysign(self.0))
    }

    #[inline(always)]
    fn erfc(self) -> Self {
        FastFloat(S::lit(1.0) - self.erf().0)
    }
}

impl<const FUSED: bool> Scalar for FastFloat<FUSED> {
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self.0
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self.0)
    }
}
