//! The operators of the language: division that always gives finite numbers, wrapping integers, comparisons.
//!
//! Sums, differences and products of floats are the operators of [`Real`].

use super::int::Int;
use super::real::{Number, Real};

/// `a / b` in a shader: 0 if the quotient is not finite, so x/0, 0/0 and an overflow are all 0.
#[inline(always)]
pub fn div<R: Real>(a: R, b: R) -> R {
    let quotient = a / b;
    R::select(quotient.is_finite(), quotient, R::lit(0.0))
}

/// `a / b` for a constant `b` other than 0: the plain quotient, which may overflow to infinity.
#[inline(always)]
pub fn div_by_constant<R: Real>(a: R, b: R) -> R {
    a / b
}

/// Integer `a / b`, truncated toward zero; 0 if `b` is 0, and `i32::MIN / -1` is `i32::MIN`.
#[inline(always)]
pub fn int_div<I: Int>(a: I, b: I) -> I {
    let zero = I::lit(0);
    I::select(b.eq(zero), zero, a.quotient(b))
}

/// Integer `a % b` with the sign of `a`; 0 where `b` is 0 or -1.
#[inline(always)]
pub fn int_rem<I: Int>(a: I, b: I) -> I {
    let zero = I::lit(0);
    let rest = a.wrapping_sub(int_div(a, b).wrapping_mul(b));
    I::select(b.eq(zero), zero, rest)
}

/// Integer sum, modulo 2^32.
#[inline(always)]
pub fn int_add<I: Int>(a: I, b: I) -> I {
    a.wrapping_add(b)
}

/// Integer difference, modulo 2^32.
#[inline(always)]
pub fn int_sub<I: Int>(a: I, b: I) -> I {
    a.wrapping_sub(b)
}

/// Integer product, modulo 2^32.
#[inline(always)]
pub fn int_mul<I: Int>(a: I, b: I) -> I {
    a.wrapping_mul(b)
}

/// Integer negation, modulo 2^32.
#[inline(always)]
pub fn int_neg<I: Int>(a: I) -> I {
    I::lit(0).wrapping_sub(a)
}

/// Integer magnitude, modulo 2^32: that of `i32::MIN` is itself.
#[inline(always)]
pub fn int_abs<I: Int>(a: I) -> I {
    a.wrapping_abs()
}

/// `a << b`; only the low five bits of `b` count.
#[inline(always)]
pub fn shl<I: Int>(a: I, b: I) -> I {
    a.shl(b)
}

/// `a >> b`, sign extended; only the low five bits of `b` count.
#[inline(always)]
pub fn shr<I: Int>(a: I, b: I) -> I {
    a.shr(b)
}

/// `(float) a`: to the nearest, ties to even.
#[inline(always)]
pub fn int_to_float<R: Real>(a: R::Int) -> R {
    R::from_int(a)
}

/// `(int) a`: truncated; NaN and values out of range give `i32::MIN`.
#[inline(always)]
pub fn float_to_int<R: Real>(a: R) -> R::Int {
    a.to_int()
}

/// `a < b`. Like all six comparisons of floats in OSL, it is also true if an operand is NaN, `==` and `!=`
/// included: the reference generates the unordered form of each.
#[inline(always)]
pub fn lt<R: Number>(a: R, b: R) -> R::Mask {
    !a.ge(b)
}

/// `a <= b`, or either is NaN.
#[inline(always)]
pub fn le<R: Number>(a: R, b: R) -> R::Mask {
    !a.gt(b)
}

/// `a > b`, or either is NaN.
#[inline(always)]
pub fn gt<R: Number>(a: R, b: R) -> R::Mask {
    !a.le(b)
}

/// `a >= b`, or either is NaN.
#[inline(always)]
pub fn ge<R: Number>(a: R, b: R) -> R::Mask {
    !a.lt(b)
}

/// `a == b`, or either is NaN.
#[inline(always)]
pub fn eq<R: Number>(a: R, b: R) -> R::Mask {
    le(a, b) & ge(a, b)
}

/// `a != b`, or either is NaN.
#[inline(always)]
pub fn ne<R: Number>(a: R, b: R) -> R::Mask {
    a.ne(b)
}

/// Whether a condition holds for a float: everything but 0.
#[inline(always)]
pub fn is_true<R: Number>(a: R) -> R::Mask {
    ne(a, R::lit(0.0))
}
