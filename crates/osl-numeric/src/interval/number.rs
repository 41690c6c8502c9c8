//! Intervals as numbers of the arithmetic.

use super::{Interval, Truth, Whole, functions, most};
use crate::real::{Number, Real};
use crate::rounding;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// The first float that does not fit an int; it is exact.
const TWO_POW_31: f32 = 2_147_483_648.0;

impl Interval {
    /// The image under a monotone function.
    pub(super) fn increasing(self, f: impl Fn(f32) -> f32) -> Interval {
        if self.is_empty() {
            return self;
        }
        Interval { lo: f(self.lo), hi: f(self.hi), nan: self.nan }
    }

    /// The hull of a function at the four corners: exact for a function that is monotone in each argument.
    /// Corners without a value count as both zeros, which are the values next to them.
    fn corners(self, other: Interval, f: impl Fn(f32, f32) -> f32) -> Interval {
        let nan = self.nan || other.nan;
        if self.is_empty() || other.is_empty() {
            return Interval::NONE.or_nan(nan);
        }
        let mut hull = Interval::NONE.or_nan(nan);
        for (a, b) in [(self.lo, other.lo), (self.lo, other.hi), (self.hi, other.lo), (self.hi, other.hi)] {
            let value = f(a, b);
            hull = hull.hull(if value.is_nan() { Interval::ZERO } else { Interval::point(value) });
        }
        hull
    }

    /// Whether it may have either sign, also of zero.
    fn has_both_signs(self) -> bool {
        self.lo.is_sign_negative() && self.hi.is_sign_positive()
    }

    fn known(self, other: Interval, f: impl Fn(f32, f32) -> f32) -> Option<Interval> {
        Some(Interval::point(f(self.value()?, other.value()?)))
    }
}

impl Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        let nan = self.nan || other.nan;
        if self.is_empty() || other.is_empty() {
            return Interval::NONE.or_nan(nan);
        }
        let (lo, hi) = (self.lo + other.lo, self.hi + other.hi);
        let opposite = |a: f32, b: f32| a.is_infinite() && b == -a;
        let cancels = opposite(self.lo, other.hi)
            || opposite(self.hi, other.lo)
            || opposite(self.lo, other.lo)
            || opposite(self.hi, other.hi);
        if self.known(other, |_, _| 0.0).is_some() {
            return Interval::point(lo);
        }
        let lo = if lo.is_nan() { f32::NEG_INFINITY } else { lo };
        let hi = if hi.is_nan() { f32::INFINITY } else { hi };
        Interval { lo, hi, nan: nan || cancels }
    }
}

impl Sub for Interval {
    type Output = Interval;

    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    fn mul(self, other: Interval) -> Interval {
        if let Some(known) = self.known(other, |a, b| a * b) {
            return known;
        }
        let is_nan = (self.has_zero() && other.has_infinity()) || (self.has_infinity() && other.has_zero());
        self.corners(other, |a, b| a * b).or_nan(is_nan)
    }
}

impl Div for Interval {
    type Output = Interval;

    fn div(self, other: Interval) -> Interval {
        if let Some(known) = self.known(other, |a, b| a / b) {
            return known;
        }
        let is_nan = (self.has_zero() && other.has_zero()) || (self.has_infinity() && other.has_infinity());
        if other.has_both_signs() && !self.is_empty() {
            return Interval::ANY.numbers().or_nan(self.nan || other.nan || is_nan);
        }
        self.corners(other, |a, b| a / b).or_nan(is_nan)
    }
}

impl Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        Interval { lo: -self.hi, hi: -self.lo, nan: self.nan }
    }
}

impl Number for Interval {
    type Mask = Truth;

    fn lit(value: f32) -> Interval {
        Interval::point(value)
    }

    fn known(single: f32, _: f64) -> Interval {
        Interval::point(single)
    }

    fn select(mask: Truth, yes: Interval, no: Interval) -> Interval {
        match mask.value() {
            Some(true) => yes,
            Some(false) => no,
            None => yes.hull(no),
        }
    }

    fn eq(self, other: Interval) -> Truth {
        let is_known = self.lo == self.hi && other.lo == other.hi && self.lo == other.lo;
        Truth { yes: self.lo <= other.hi && other.lo <= self.hi, no: !is_known || self.nan || other.nan }
    }

    fn lt(self, other: Interval) -> Truth {
        Truth { yes: self.lo < other.hi, no: self.hi >= other.lo || self.nan || other.nan }
    }

    fn le(self, other: Interval) -> Truth {
        Truth { yes: self.lo <= other.hi, no: self.hi > other.lo || self.nan || other.nan }
    }

    fn is_nan(self) -> Truth {
        Truth { yes: self.nan, no: !self.is_empty() }
    }

    fn floor(self) -> Interval {
        self.increasing(rounding::floor)
    }
}

impl Real for Interval {
    type Int = Whole;
    type Plain = f32;

    fn from_int(value: Whole) -> Interval {
        if value.is_empty() { Interval::NONE } else { Interval::new(value.lo as f32, value.hi as f32) }
    }

    fn to_int(self) -> Whole {
        let fits = self.clip(-TWO_POW_31, TWO_POW_31.next_down());
        let whole = if fits.is_empty() {
            Whole::NONE
        } else {
            Whole { lo: rounding::trunc32(fits.lo), hi: rounding::trunc32(fits.hi) }
        };
        let fails = self.nan || (!self.is_empty() && (self.lo < -TWO_POW_31 || self.hi >= TWO_POW_31));
        if fails { whole.hull(Whole::point(i32::MIN)) } else { whole }
    }

    fn by_value<const I: usize, const N: usize, const M: usize>(
        ints: [Whole; I],
        numbers: [Interval; N],
        body: impl FnOnce([i32; I], [f32; N]) -> [f32; M],
    ) -> [Interval; M] {
        let (mut plain_ints, mut plain_numbers) = ([0; I], [0.0; N]);
        let mut is_known = true;
        for (to, from) in plain_ints.iter_mut().zip(ints) {
            is_known &= from.value().is_some();
            *to = from.lo;
        }
        for (to, from) in plain_numbers.iter_mut().zip(numbers) {
            is_known &= from.value().is_some();
            *to = from.value().unwrap_or(0.0);
        }
        if is_known { body(plain_ints, plain_numbers).map(Interval::point) } else { [Interval::ANY; M] }
    }

    fn is_finite(self) -> Truth {
        let yes = !self.is_empty() && self.lo < f32::INFINITY && self.hi > f32::NEG_INFINITY;
        Truth { yes, no: self.nan || self.has_infinity() }
    }

    fn abs(self) -> Interval {
        if self.is_empty() || self.lo.is_sign_positive() {
            return self;
        }
        if self.hi.is_sign_negative() {
            return -self;
        }
        Interval { lo: 0.0, hi: most(-self.lo, self.hi), nan: self.nan }
    }

    fn copysign(self, sign: Interval) -> Interval {
        let magnitude = self.abs();
        let may = |negative: bool| {
            let end = if negative { sign.lo } else { sign.hi };
            sign.nan || (!sign.is_empty() && end.is_sign_negative() == negative)
        };
        match (may(true), may(false)) {
            (true, false) => -magnitude,
            (true, true) => magnitude.hull(-magnitude),
            _ => magnitude,
        }
    }

    fn ceil(self) -> Interval {
        self.increasing(rounding::ceil)
    }

    fn trunc(self) -> Interval {
        self.increasing(rounding::trunc)
    }

    fn round(self) -> Interval {
        self.increasing(rounding::round)
    }

    fn sqrt(self) -> Interval {
        let is_nan = !self.is_empty() && self.lo < 0.0;
        let root = self.meet(Interval { lo: -0.0, ..Interval::ANY }).increasing(f32::sqrt);
        root.or_nan(is_nan)
    }

    fn length(square: Interval, v: [Interval; 3]) -> Interval {
        functions::length(square, v)
    }

    fn sin(self) -> Interval {
        functions::sine(self)
    }

    fn cos(self) -> Interval {
        functions::cosine(self)
    }

    fn tan(self) -> Interval {
        functions::tangent(self)
    }

    fn asin(self) -> Interval {
        functions::ASIN.of(self)
    }

    fn acos(self) -> Interval {
        functions::ACOS.of(self)
    }

    fn atan(self) -> Interval {
        functions::ATAN.of(self)
    }

    fn atan2(self, x: Interval) -> Interval {
        functions::atan2(self, x)
    }

    fn sinh(self) -> Interval {
        functions::SINH.of(self)
    }

    fn cosh(self) -> Interval {
        // Even, and the strict function takes the magnitude first.
        functions::COSH.of(self.abs())
    }

    fn tanh(self) -> Interval {
        functions::TANH.of(self)
    }

    fn exp(self) -> Interval {
        functions::EXP.of(self)
    }

    fn exp2(self) -> Interval {
        functions::EXP2.of(self)
    }

    fn expm1(self) -> Interval {
        functions::EXPM1.of(self)
    }

    fn log(self) -> Interval {
        functions::LOG.of(self)
    }

    fn log2(self) -> Interval {
        functions::LOG2.of(self)
    }

    fn log10(self) -> Interval {
        functions::LOG10.of(self)
    }

    fn logb(self) -> Interval {
        let nan = if self.nan { Interval::point(128.0) } else { Interval::NONE };
        self.numbers().abs().increasing(crate::strict::logb::<f32>).hull(nan)
    }

    fn cbrt(self) -> Interval {
        functions::cbrt(self)
    }

    fn pow(self, y: Interval) -> Interval {
        functions::pow(self, y)
    }

    fn erf(self) -> Interval {
        functions::ERF.of(self)
    }

    fn erfc(self) -> Interval {
        Interval::point(1.0) - self.erf()
    }

    fn fmod(self, divisor: Interval) -> Interval {
        functions::fmod(self, divisor)
    }

    fn fmod_exact(self, divisor: Interval) -> Interval {
        functions::fmod_exact(self, divisor)
    }

    fn pow_accurate(self, y: Interval) -> Interval {
        functions::pow_accurate(self, y)
    }
}
