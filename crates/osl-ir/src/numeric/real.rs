//! The element type of the arithmetic.
//!
//! [`Real`] has the operations that a body may use on a number. `f32` is the strict arithmetic: products and
//! sums are rounded one by one, and functions are the approximations of [`strict`]. Other arithmetics
//! ([binary64](super::double) as a reference, cheaper approximations) are other implementations; the bodies
//! stay the same. This module must not know what a body computes.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{rounding, strict};

/// The operations that a choice between cases needs.
pub trait Number:
    Copy
    + Debug
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The constant `value`, exactly.
    fn lit(value: f32) -> Self;
    /// A constant of the library that is not exactly a float: its single-precision value, and its exact
    /// value.
    fn known(single: f32, exact: f64) -> Self;
    /// `yes` if `mask`, else `no`. Both are computed; compiles to a blend.
    fn select(mask: bool, yes: Self, no: Self) -> Self;
    /// True for NaN.
    fn is_nan(self) -> bool;
    /// The largest whole number that is not larger; -0 stays.
    fn floor(self) -> Self;
}

/// A number of a lane.
///
/// The operators and `sqrt` are the IEEE operations, each correctly rounded, never contracted. Comparisons
/// are those of `PartialOrd`: false if an operand is NaN.
///
/// Caution if the element type is known to be `f32`: `x.sin()` is then the standard library's, whose bits
/// depend on the platform. Call [`strict::sin`] there. In generic code, the method below is the only
/// candidate.
pub trait Real: Number {
    /// The nearest number to an integer, ties to even.
    fn from_int(value: i32) -> Self;
    /// The nearest number of single precision.
    fn to_f32(self) -> f32;
    /// The number in double precision, as accurately as it is known.
    fn to_f64(self) -> f64;
    /// Truncation to an integer; NaN and values out of range give `i32::MIN`.
    fn to_int(self) -> i32;

    /// True for everything but NaN and the infinities.
    fn is_finite(self) -> bool;
    /// The value with its sign bit cleared.
    fn abs(self) -> Self;
    /// The magnitude of `self` with the sign bit of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// The smallest whole number that is not smaller; `ceil(-0.5)` is -0.
    fn ceil(self) -> Self;
    /// The number without its fraction.
    fn trunc(self) -> Self;
    /// The nearest whole number, halves away from zero.
    fn round(self) -> Self;
    /// The IEEE square root, NaN for negative numbers. OSL's guarded one is
    /// [`common::sqrt`](super::common::sqrt).
    fn sqrt(self) -> Self;

    /// `self + a * b`; rounded twice unless the arithmetic says otherwise.
    #[inline(always)]
    fn plus_product(self, a: Self, b: Self) -> Self {
        self + a * b
    }
    /// `self - a * b`; rounded twice unless the arithmetic says otherwise.
    #[inline(always)]
    fn minus_product(self, a: Self, b: Self) -> Self {
        self - a * b
    }
    /// `1 / √self` for positive numbers, with two roundings unless the arithmetic says otherwise.
    #[inline(always)]
    fn inverse_root(self) -> Self {
        Self::lit(1.0) / self.sqrt()
    }

    /// Sine of an angle in radians, in -1..=1.
    fn sin(self) -> Self;
    /// Cosine of an angle in radians, in -1..=1.
    fn cos(self) -> Self;
    /// Tangent of an angle in radians.
    fn tan(self) -> Self;
    /// Arc sine in radians; the argument is clamped to -1..=1.
    fn asin(self) -> Self;
    /// Arc cosine in radians; the argument is clamped to -1..=1.
    fn acos(self) -> Self;
    /// Arc tangent in radians.
    fn atan(self) -> Self;
    /// Angle of the vector (`x`, `self`) in radians, in -π..=π.
    fn atan2(self, x: Self) -> Self;
    /// Hyperbolic sine.
    fn sinh(self) -> Self;
    /// Hyperbolic cosine.
    fn cosh(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// e to the power of the argument; never 0, never infinite.
    fn exp(self) -> Self;
    /// 2 to the power of the argument clamped to -126..=126.
    fn exp2(self) -> Self;
    /// `exp(x) - 1`, accurate near zero.
    fn expm1(self) -> Self;
    /// Natural logarithm of the argument clamped to the positive normal floats.
    fn log(self) -> Self;
    /// Logarithm to base 2 of the argument clamped to the positive normal floats.
    fn log2(self) -> Self;
    /// Logarithm to base 10 of the argument clamped to the positive normal floats.
    fn log10(self) -> Self;
    /// The binary exponent of the magnitude.
    fn logb(self) -> Self;
    /// Cube root, odd.
    fn cbrt(self) -> Self;
    /// `self` to the power of `y`, with OSL's special cases: never NaN for finite numbers.
    fn pow(self, y: Self) -> Self;
    /// Error function.
    fn erf(self) -> Self;
    /// Complement of the error function.
    fn erfc(self) -> Self;
    /// Remainder with the quotient truncated, for a varying divisor: 0 for divisor 0, sign of `self`.
    fn fmod(self, divisor: Self) -> Self;
    /// Exact remainder with the quotient truncated, for a constant divisor other than 0.
    fn fmod_exact(self, divisor: Self) -> Self;
    /// `self` to the power of `y`, accurate to about half a unit in the last place, for `self` > 0 and a
    /// result in the normal range, as in a good library. Used by color transfer curves.
    fn pow_accurate(self, y: Self) -> Self;
}

/// Methods that forward to a function with the same name and arguments.
macro_rules! hand_over {
    ($($module:ident :: $name:ident ( $($arg:ident),* );)*) => {
        $(
            #[inline(always)]
            fn $name(self $(, $arg: Self)*) -> Self {
                $module::$name(self $(, $arg)*)
            }
        )*
    };
}

impl Number for f32 {
    #[inline(always)]
    fn lit(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn known(single: f32, _: f64) -> Self {
        single
    }

    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        rounding::pick(mask, yes, no)
    }

    #[inline(always)]
    fn is_nan(self) -> bool {
        f32::is_nan(self)
    }

    hand_over! {
        rounding::floor();
    }
}

impl Real for f32 {
    #[inline(always)]
    fn from_int(value: i32) -> Self {
        value as f32
    }

    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    #[inline(always)]
    fn to_int(self) -> i32 {
        rounding::trunc32(self)
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f32::copysign(self, sign)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn fmod_exact(self, divisor: Self) -> Self {
        // The IEEE remainder is exact, so it is the same in every library. This is the only body with a call.
        self % divisor
    }

    hand_over! {
        rounding::ceil();
        rounding::trunc();
        rounding::round();
        strict::sin();
        strict::cos();
        strict::tan();
        strict::asin();
        strict::acos();
        strict::atan();
        strict::atan2(x);
        strict::sinh();
        strict::cosh();
        strict::tanh();
        strict::exp();
        strict::exp2();
        strict::expm1();
        strict::log();
        strict::log2();
        strict::log10();
        strict::logb();
        strict::cbrt();
        strict::pow(y);
        strict::erf();
        strict::erfc();
        strict::fmod(divisor);
        strict::pow_accurate(y);
    }
}
