//! The strict arithmetic of a single point: `f32`, `i32` and `bool`.
//!
//! Products and sums are rounded one by one, and functions are those of [`strict`].

use super::int::{Int, Mask};
use super::real::{Number, Real, Scalar, Single};
use super::{geometry, rounding, strict};

impl Mask for bool {
    #[inline(always)]
    fn known(self) -> Option<bool> {
        Some(self)
    }
}

impl Int for i32 {
    type Mask = bool;

    #[inline(always)]
    fn lit(value: i32) -> i32 {
        value
    }

    #[inline(always)]
    fn select(mask: bool, yes: i32, no: i32) -> i32 {
        rounding::pick(mask, yes, no)
    }

    #[inline(always)]
    fn of_mask(mask: bool) -> i32 {
        i32::from(mask)
    }

    #[inline(always)]
    fn is_true(self) -> bool {
        self != 0
    }

    #[inline(always)]
    fn eq(self, other: i32) -> bool {
        self == other
    }

    #[inline(always)]
    fn lt(self, other: i32) -> bool {
        self < other
    }

    #[inline(always)]
    fn wrapping_add(self, other: i32) -> i32 {
        i32::wrapping_add(self, other)
    }

    #[inline(always)]
    fn wrapping_sub(self, other: i32) -> i32 {
        i32::wrapping_sub(self, other)
    }

    #[inline(always)]
    fn wrapping_mul(self, other: i32) -> i32 {
        i32::wrapping_mul(self, other)
    }

    #[inline(always)]
    fn wrapping_abs(self) -> i32 {
        i32::wrapping_abs(self)
    }

    #[inline(always)]
    fn min(self, other: i32) -> i32 {
        Ord::min(self, other)
    }

    #[inline(always)]
    fn max(self, other: i32) -> i32 {
        Ord::max(self, other)
    }

    #[inline(always)]
    fn shl(self, distance: i32) -> i32 {
        self.wrapping_shl(distance as u32)
    }

    #[inline(always)]
    fn shr(self, distance: i32) -> i32 {
        self.wrapping_shr(distance as u32)
    }

    #[inline(always)]
    fn third(self) -> i32 {
        (self as u32 / 3) as i32
    }

    #[inline(always)]
    fn quotient(self, divisor: i32) -> i32 {
        // In binary64, because vector units divide floats but not integers. It is exact: a quotient that is
        // not whole is at least 1/|divisor| away from the next whole number, a relative distance of more than
        // 2^-32.
        rounding::trunc_quotient(f64::from(self) / f64::from(divisor))
    }
}

/// The functions of [`strict`] as methods of an implementation of [`Real`] for a [`Single`].
#[macro_export]
macro_rules! strict_functions {
    () => {
        $crate::strict_functions! {
            sin(); cos(); tan(); asin(); acos(); atan(); atan2(x); sinh(); cosh(); tanh(); exp(); exp2();
            expm1(); log(); log2(); log10(); logb(); cbrt(); pow(y); erf(); erfc(); fmod(divisor);
        }
    };
    ($($name:ident ( $($arg:ident),* );)*) => {
        $(
            #[inline(always)]
            fn $name(self $(, $arg: Self)*) -> Self {
                $crate::strict::$name(self $(, $arg)*)
            }
        )*
    };
}

impl Number for f32 {
    type Mask = bool;

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
        f32::is_nan(self)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        rounding::floor(self)
    }
}

impl Real for f32 {
    type Int = i32;
    type Plain = f32;

    #[inline(always)]
    fn from_int(value: i32) -> Self {
        value as f32
    }

    #[inline(always)]
    fn to_int(self) -> i32 {
        rounding::trunc32(self)
    }

    #[inline(always)]
    fn by_value<const I: usize, const N: usize, const M: usize>(
        ints: [i32; I],
        numbers: [f32; N],
        body: impl FnOnce([i32; I], [f32; N]) -> [f32; M],
    ) -> [f32; M] {
        body(ints, numbers)
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
    fn ceil(self) -> Self {
        rounding::ceil(self)
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        rounding::trunc(self)
    }

    #[inline(always)]
    fn round(self) -> Self {
        rounding::round(self)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn length(square: Self, v: [Self; 3]) -> Self {
        geometry::length_by_square(square, v)
    }

    #[inline(always)]
    fn fmod_exact(self, divisor: Self) -> Self {
        // The IEEE remainder is exact, so it is the same in every library. This is the only body with a call.
        self % divisor
    }

    #[inline(always)]
    fn pow_accurate(self, y: Self) -> Self {
        strict::pow_accurate(self, y)
    }

    strict_functions!();
}

impl Scalar for f32 {
    #[inline(always)]
    fn to_f32(self) -> f32 {
        self
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Single for f32 {
    #[inline(always)]
    fn to_bits(self) -> i32 {
        f32::to_bits(self) as i32
    }

    #[inline(always)]
    fn from_bits(bits: i32) -> Self {
        f32::from_bits(bits as u32)
    }

    #[inline(always)]
    fn plus_fused(self, a: Self, b: Self) -> Self {
        a.mul_add(b, self)
    }

    #[inline(always)]
    fn minus_fused(self, a: Self, b: Self) -> Self {
        (-a).mul_add(b, self)
    }
}
