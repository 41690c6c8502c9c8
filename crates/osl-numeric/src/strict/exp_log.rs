//! Exponentials and logarithms: exponent bits by integer arithmetic, the rest by a polynomial.
//!
//! Arguments are clamped, so that results are always finite and, for the exponentials, never zero.

use super::{bits, clamp, crush, horner};
use crate::rounding::exponent_bits;
use crate::{Int, Single};

const LN2: f32 = bits(0x3f31_7218);
const LOG2E: f32 = bits(0x3fb8_aa3b);
const LOG10_2: f32 = bits(0x3e9a_209b);
const LOG2_10: f32 = bits(0x4054_9a78);

const MANTISSA: i32 = 0x007f_ffff;
const ONE: i32 = 0x3f80_0000;

const EXP2: [f32; 6] =
    [bits(0x3aae_c44e), bits(0x3c20_bb9a), bits(0x3d63_6733), bits(0x3e75_f192), bits(0x3f31_71f1), 1.0];
const LOG2_HIGH: [f32; 5] =
    [bits(0xbc18_8b0d), bits(0x3d55_41c9), bits(0xbe0c_d4fd), bits(0x3e77_adbd), bits(0xbeb1_d206)];
const LOG2_LOW: [f32; 3] = [bits(0x3ef5_162d), bits(0xbf38_9e54), bits(0x3fb8_aa10)];

/// 2^x for x clamped to -126..=126, so the result lies in 2^-126..=2^126; NaN counts as -126.
#[inline(always)]
pub fn exp2<S: Single>(x: S) -> S {
    let x = clamp(x, -126.0, 126.0);
    let whole = x.trunc();
    let fraction = crush(x - whole, 1.0);
    let r = horner(fraction, EXP2);
    S::from_bits(r.to_bits().wrapping_add(exponent_bits(whole)))
}

/// e^x; saturates as [`exp2`] does.
#[inline(always)]
pub fn exp<S: Single>(x: S) -> S {
    exp2(x * S::lit(LOG2E))
}

/// 10^x; saturates as [`exp2`] does. Not a built-in of the language.
#[inline(always)]
pub fn exp10<S: Single>(x: S) -> S {
    exp2(x * S::lit(LOG2_10))
}

/// e^x - 1; two terms of the series near zero.
#[inline(always)]
pub fn expm1<S: Single>(x: S) -> S {
    let y = crush(x, 1.0);
    let series = (S::lit(0.5) * (y * y) + y).copysign(x);
    S::select(x.abs().lt(S::lit(bits(0x3cf5_c28f))), series, exp(x) - S::lit(1.0))
}

/// Logarithm to base 2 of the argument clamped to the positive normal floats: -126 for 0, negatives and NaN.
#[inline(always)]
pub fn log2<S: Single>(x: S) -> S {
    let word = clamp(x, f32::MIN_POSITIVE, f32::MAX).to_bits();
    let f = S::from_bits((word & S::Int::lit(MANTISSA)) | S::Int::lit(ONE)) - S::lit(1.0);
    let f2 = f * f;
    let f4 = f2 * f2;
    let high = horner(f, LOG2_HIGH);
    let low = horner(f, LOG2_LOW);
    (f4 * high + f * low) + exponent(word)
}

/// The exponent of a positive normal float with these bits.
#[inline(always)]
fn exponent<S: Single>(word: S::Int) -> S {
    S::from_int(word.shr(S::Int::lit(23)).wrapping_sub(S::Int::lit(127)))
}

/// Natural logarithm, with the clamp of [`log2`].
#[inline(always)]
pub fn log<S: Single>(x: S) -> S {
    log2(x) * S::lit(LN2)
}

/// Logarithm to base 10, with the clamp of [`log2`].
#[inline(always)]
pub fn log10<S: Single>(x: S) -> S {
    log2(x) * S::lit(LOG10_2)
}

/// log(1 + x); two terms of the series near zero. Not a built-in of the language.
#[inline(always)]
pub fn log1p<S: Single>(x: S) -> S {
    let y = crush(x, 1.0);
    let series = (S::lit(-0.5) * (y * y) + y).copysign(x);
    S::select(x.abs().lt(S::lit(bits(0x3c23_d70a))), series, log(x + S::lit(1.0)))
}

/// The exponent of |x| clamped to the normal floats: -126 for 0, 127 for infinity; 128 for NaN.
#[inline(always)]
pub fn logb<S: Single>(x: S) -> S {
    let (least, most) = (S::lit(f32::MIN_POSITIVE), S::lit(f32::MAX));
    let x = x.abs();
    let x = S::select(x.lt(least), least, x);
    let x = S::select(x.gt(most), most, x);
    exponent(x.to_bits())
}
