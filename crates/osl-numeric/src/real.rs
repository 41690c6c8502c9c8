//! The numbers of the arithmetic, as traits.
//!
//! A body is written once, for any [`Number`] or [`Real`]. `f32` is the strict arithmetic: products and sums
//! are rounded one by one, and functions are the approximations of [`strict`](super::strict). Other
//! arithmetics ([binary64](super::double) as a reference, [cheaper approximations](super::fast)) are other
//! implementations; the bodies stay the same. An implementation need not know a value: it may record the
//! operations instead, to make code of them. So the truth of a comparison is a [`Mask`], an integer is an
//! [`Int`], and a body that needs values asks for them with [`Real::by_value`].
//!
//! | trait | numbers |
//! |---|---|
//! | [`Number`] | all, including those with a derivative |
//! | [`Real`] | all without a derivative, with the elementary functions |
//! | [`Single`] | those of single precision, whose bits a body may use |
//! | [`Scalar`] | those with a known value |

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::int::{Int, Mask};

/// The operations that a choice between cases needs.
pub trait Number:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The result of a comparison.
    type Mask: Mask;

    /// The constant `value`, exactly.
    fn lit(value: f32) -> Self;
    /// A constant of the library that is not exactly a float: its single-precision value, and its exact
    /// value.
    fn known(single: f32, exact: f64) -> Self;
    /// `yes` if `mask`, else `no`. Both are computed; compiles to a blend.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// `self == other`; false for NaN, as all comparisons except [`Number::ne`].
    fn eq(self, other: Self) -> Self::Mask;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `self != other`; true for NaN.
    #[inline(always)]
    fn ne(self, other: Self) -> Self::Mask {
        !self.eq(other)
    }
    /// True for NaN.
    fn is_nan(self) -> Self::Mask;

    /// The largest whole number that is not larger; -0 stays.
    fn floor(self) -> Self;
}

/// A number of a lane.
///
/// The operators and `sqrt` are the IEEE operations, each correctly rounded, never contracted.
///
/// Caution if the element type is known to be `f32`: `x.sin()` is then the standard library's, whose bits
/// depend on the platform. Call [`strict::sin`](super::strict::sin) there. In generic code, the method below
/// is the only candidate.
pub trait Real: Number {
    /// The integers that go with it.
    type Int: Int<Mask = Self::Mask>;
    /// Numbers of the same arithmetic with known values.
    type Plain: Scalar;

    /// The nearest number to an integer, ties to even.
    fn from_int(value: Self::Int) -> Self;
    /// Truncation to an integer; NaN and values out of range give `i32::MIN`.
    fn to_int(self) -> Self::Int;
    /// Computes with the values of the arguments: for a body whose steps depend on values, as those of a
    /// search or of an index into a table. An implementation that does not know the values cannot do it, and
    /// so has no such operation.
    fn by_value<const I: usize, const N: usize, const M: usize>(
        ints: [Self::Int; I],
        numbers: [Self; N],
        body: impl FnOnce([i32; I], [Self::Plain; N]) -> [Self::Plain; M],
    ) -> [Self; M];

    /// True for everything but NaN and the infinities.
    fn is_finite(self) -> Self::Mask;
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
    /// `1 / √self` for positive numbers, with two roundings unless the arithmetic says otherwise; unspecified
    /// for all others.
    #[inline(always)]
    fn inverse_root(self) -> Self {
        Self::lit(1.0) / self.sqrt()
    }
    /// The length of a vector `v`; `square` is the inner product of `v` with itself. See
    /// [`geometry`](super::geometry).
    fn length(square: Self, v: [Self; 3]) -> Self;

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

/// A number with a known value.
pub trait Scalar: Real<Mask = bool, Int = i32, Plain = Self> + PartialOrd + Send + Sync + 'static {
    /// The nearest number of single precision.
    fn to_f32(self) -> f32;
    /// The number in double precision, as accurately as it is known.
    fn to_f64(self) -> f64;
}

/// A number of single precision in the strict arithmetic.
pub trait Single: Real<Plain = f32> {
    /// The bits.
    fn to_bits(self) -> Self::Int;
    /// The number with these bits.
    fn from_bits(bits: Self::Int) -> Self;
    /// `self + a * b`, rounded once. Slow where the machine has no such operation.
    fn plus_fused(self, a: Self, b: Self) -> Self;
    /// `self - a * b`, rounded once. Slow where the machine has no such operation.
    fn minus_fused(self, a: Self, b: Self) -> Self;

    /// Whether the sign bit is set.
    #[inline(always)]
    fn has_sign(self) -> Self::Mask {
        self.to_bits().lt(Self::Int::lit(0))
    }
    /// `self`, whose sign bit is not set, with the sign bit of `sign`.
    #[inline(always)]
    fn with_sign(self, sign: Self) -> Self {
        Self::from_bits(self.to_bits() | (sign.to_bits() & Self::Int::lit(i32::MIN)))
    }
}
