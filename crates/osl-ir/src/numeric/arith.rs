//! The operators of the language: division that always gives finite numbers, wrapping integers, comparisons.
//!
//! Sums, differences and products of floats are the operators of [`Real`]. This module must not know the
//! built-in functions.

use super::real::{Number, Real};
use super::rounding::{pick, trunc_quotient};

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
///
/// The quotient is computed in binary64, because vector units divide floats but not integers. It is exact: a
/// quotient that is not whole is at least 1/|b| away from the next whole number, a relative distance of more
/// than 2^-32.
#[inline(always)]
pub fn int_div(a: i32, b: i32) -> i32 {
    pick(b == 0, 0, trunc_quotient(f64::from(a) / f64::from(b)))
}

/// Integer `a % b` with the sign of `a`; 0 where `b` is 0 or -1.
#[inline(always)]
pub fn int_rem(a: i32, b: i32) -> i32 {
    let rest = a.wrapping_sub(int_div(a, b).wrapping_mul(b));
    pick(b == 0, 0, rest)
}

/// Integer sum, modulo 2^32.
#[inline(always)]
pub fn int_add(a: i32, b: i32) -> i32 {
    a.wrapping_add(b)
}

/// Integer difference, modulo 2^32.
#[inline(always)]
pub fn int_sub(a: i32, b: i32) -> i32 {
    a.wrapping_sub(b)
}

/// Integer product, modulo 2^32.
#[inline(always)]
pub fn int_mul(a: i32, b: i32) -> i32 {
    a.wrapping_mul(b)
}

/// Integer negation, modulo 2^32.
#[inline(always)]
pub fn int_neg(a: i32) -> i32 {
    a.wrapping_neg()
}

/// Integer magnitude, modulo 2^32: that of `i32::MIN` is itself.
#[inline(always)]
pub fn int_abs(a: i32) -> i32 {
    a.wrapping_abs()
}

/// `a << b`; only the low five bits of `b` count.
#[inline(always)]
pub fn shl(a: i32, b: i32) -> i32 {
    a.wrapping_shl(b as u32)
}

/// `a >> b`, sign extended; only the low five bits of `b` count.
#[inline(always)]
pub fn shr(a: i32, b: i32) -> i32 {
    a.wrapping_shr(b as u32)
}

/// `(float) a`: to the nearest, ties to even.
#[inline(always)]
pub fn int_to_float<R: Real>(a: i32) -> R {
    R::from_int(a)
}

/// `(int) a`: truncated; NaN and values out of range give `i32::MIN`.
#[inline(always)]
pub fn float_to_int<R: Real>(a: R) -> i32 {
    a.to_int()
}

/// `a < b`. Like all six comparisons of floats in OSL, it is also true if an operand is NaN, `==` and `!=`
/// included: the reference generates the unordered form of each.
#[inline(always)]
#[expect(clippy::neg_cmp_op_on_partial_ord, reason = "the negation is what makes NaN count as true")]
pub fn lt<R: Real>(a: R, b: R) -> bool {
    !(a >= b)
}

/// `a <= b`, or either is NaN.
#[inline(always)]
#[expect(clippy::neg_cmp_op_on_partial_ord, reason = "the negation is what makes NaN count as true")]
pub fn le<R: Number>(a: R, b: R) -> bool {
    !(a > b)
}

/// `a > b`, or either is NaN.
#[inline(always)]
#[expect(clippy::neg_cmp_op_on_partial_ord, reason = "the negation is what makes NaN count as true")]
pub fn gt<R: Number>(a: R, b: R) -> bool {
    !(a <= b)
}

/// `a >= b`, or either is NaN.
#[inline(always)]
#[expect(clippy::neg_cmp_op_on_partial_ord, reason = "the negation is what makes NaN count as true")]
pub fn ge<R: Real>(a: R, b: R) -> bool {
    !(a < b)
}

/// `a == b`, or either is NaN.
#[inline(always)]
pub fn eq<R: Real>(a: R, b: R) -> bool {
    le(a, b) & ge(a, b)
}

/// `a != b`, or either is NaN.
#[inline(always)]
pub fn ne<R: Real>(a: R, b: R) -> bool {
    a != b
}

/// Whether a condition holds for a float: everything but 0.
#[inline(always)]
pub fn is_true<R: Real>(a: R) -> bool {
    ne(a, R::lit(0.0))
}
