//! The small functions of the standard library: magnitudes, limits, blends, steps.
//!
//! Each is written for one number; the language applies it to each component of a triple. The order of
//! operations is the reference's.

use super::arith::{div, is_true, le};
use super::int::Int;
use super::real::{Number, Real};

/// -1, 0 or 1 by the sign of `x`; NaN gives 1.
#[inline(always)]
pub fn sign<R: Real>(x: R) -> R {
    let not_negative = R::select(x.eq(R::lit(0.0)), R::lit(0.0), R::lit(1.0));
    R::select(x.lt(R::lit(0.0)), R::lit(-1.0), not_negative)
}

/// The smaller; the first where either is NaN.
#[inline(always)]
pub fn min<R: Number>(x: R, y: R) -> R {
    R::select(le(x, y), x, y)
}

/// The larger; the first where either is NaN.
#[inline(always)]
pub fn max<R: Number>(x: R, y: R) -> R {
    R::select(x.le(y), y, x)
}

/// `x` clamped to `lo..=hi`; `lo` wins if the limits are reversed, and NaN stays.
#[inline(always)]
pub fn clamp<R: Real>(x: R, lo: R, hi: R) -> R {
    max(min(x, hi), lo)
}

/// [`min`] for integers.
#[inline(always)]
pub fn int_min<I: Int>(x: I, y: I) -> I {
    x.min(y)
}

/// [`max`] for integers.
#[inline(always)]
pub fn int_max<I: Int>(x: I, y: I) -> I {
    x.max(y)
}

/// Linear interpolation from `a` at t = 0 to `b` at t = 1, extrapolated outside: `t` is not clamped.
#[inline(always)]
pub fn mix<R: Real>(a: R, b: R, t: R) -> R {
    (a * (R::lit(1.0) - t)).plus_product(b, t)
}

/// `b` if the condition `c` is not zero, else `a`: a true condition selects the *second* argument.
#[inline(always)]
pub fn select<R: Real>(a: R, b: R, c: R) -> R {
    R::select(is_true(c), b, a)
}

/// 0 below the edge, 1 from the edge on; NaN counts as above.
#[inline(always)]
pub fn step<R: Real>(edge: R, x: R) -> R {
    R::select(x.lt(edge), R::lit(0.0), R::lit(1.0))
}

/// 0 below `edge0`, 1 from `edge1` on, a cubic with flat ends in between. With reversed edges it is a step at
/// `edge0`.
///
/// If a derivative of the result is needed, the reference multiplies in another order: see the rule of the
/// `derive` pass.
#[inline(always)]
pub fn smoothstep<R: Real>(edge0: R, edge1: R, x: R) -> R {
    let t = (x - edge0) / (edge1 - edge0);
    let between = (R::lit(3.0) - R::lit(2.0) * t) * (t * t);
    outside_edges(edge0, edge1, x, between)
}

/// 0 below `edge0`, else 1 from `edge1` on, else `between`.
#[inline(always)]
fn outside_edges<R: Real>(edge0: R, edge1: R, x: R, between: R) -> R {
    let above = R::select(x.ge(edge1), R::lit(1.0), between);
    // The first test takes precedence, so it comes last.
    R::select(x.lt(edge0), R::lit(0.0), above)
}

/// 0 below `edge0`, 1 above `edge1`, linear in between; a step if they are equal.
#[inline(always)]
pub fn linearstep<R: Real>(edge0: R, edge1: R, x: R) -> R {
    let ramp = div(clamp(x, edge0, edge1) - edge0, edge1 - edge0);
    R::select(edge0.eq(edge1), step(edge0, x), ramp)
}

/// The remainder with the sign of `b`: a - b·floor(a/b); `a` if `b` is 0.
#[inline(always)]
pub fn modulo<R: Real>(a: R, b: R) -> R {
    a - b * div(a, b).floor()
}

/// [`modulo`] for a constant `b` other than 0: the quotient has no guard.
#[inline(always)]
pub fn modulo_by_constant<R: Real>(a: R, b: R) -> R {
    a - b * (a / b).floor()
}

/// The magnitude; also of -0 and NaN.
#[inline(always)]
pub fn abs<R: Real>(x: R) -> R {
    x.abs()
}

/// The square root; 0 for negative numbers and NaN, -0 for -0.
#[inline(always)]
pub fn sqrt<R: Real>(x: R) -> R {
    R::select(x.ge(R::lit(0.0)), x.sqrt(), R::lit(0.0))
}

/// 1 / √x, with two roundings; 0 if `x` is not positive.
#[inline(always)]
pub fn inversesqrt<R: Real>(x: R) -> R {
    R::select(x.gt(R::lit(0.0)), x.inverse_root(), R::lit(0.0))
}

/// 1 for NaN, else 0.
#[inline(always)]
pub fn isnan<R: Real>(x: R) -> R::Int {
    R::Int::of_mask(x.is_nan())
}

/// 1 for the infinities, else 0.
#[inline(always)]
pub fn isinf<R: Real>(x: R) -> R::Int {
    R::Int::of_mask(!x.is_finite() & !x.is_nan())
}

/// 1 for finite numbers, 0 for NaN and the infinities.
#[inline(always)]
pub fn isfinite<R: Real>(x: R) -> R::Int {
    R::Int::of_mask(x.is_finite())
}
