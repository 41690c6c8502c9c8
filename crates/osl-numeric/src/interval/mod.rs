//! Interval arithmetic: for arguments in given ranges, a range that contains every result of the strict
//! arithmetic, to the last bit.
//!
//! The bodies of the lane operations run on an [`Interval`] as they run on `f32`. The ends of an interval are
//! floats. A sum, product, quotient or root of floats, correctly rounded, is monotone in each operand, so its
//! value at the ends bounds all values in between, without any widening. The approximations of the elementary
//! functions are not monotone: `functions` takes the exact function at the ends, widened by a tested bound of
//! the error ([`ERRORS`]). If a body selects by a comparison that the ranges do not decide, the result is the
//! hull of both cases. `rules` has tighter forms for operations that use an argument twice, such as
//! `smoothstep`.
//!
//! An interval that holds a single float gives exactly the float that a run gives.

mod eval;
mod functions;
mod number;
mod rules;
mod truth;
mod whole;

pub use eval::{Enclosure, eval};
pub use functions::{ERRORS, Error};
pub use truth::Truth;
pub use whole::Whole;

use std::cmp::Ordering;

/// A set of floats: all from `lo` to `hi`, and perhaps NaN.
///
/// −0 counts as less than 0, so that an interval knows the sign of its zeros.
#[derive(Clone, Copy, Debug)]
pub struct Interval {
    lo: f32,
    hi: f32,
    nan: bool,
}

impl PartialEq for Interval {
    fn eq(&self, other: &Interval) -> bool {
        self.lo.to_bits() == other.lo.to_bits()
            && self.hi.to_bits() == other.hi.to_bits()
            && self.nan == other.nan
    }
}

/// The smaller; −0 is smaller than 0.
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a.total_cmp(&b) == Ordering::Greater { b } else { a }
}

/// The larger; 0 is larger than −0.
pub(crate) fn most(a: f32, b: f32) -> f32 {
    if a.total_cmp(&b) == Ordering::Less { b } else { a }
}

/// The largest float that is not larger.
pub(crate) fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

/// The smallest float that is not smaller.
pub(crate) fn up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

impl Interval {
    /// Every float, and NaN.
    pub const ANY: Interval = Interval { lo: f32::NEG_INFINITY, hi: f32::INFINITY, nan: true };
    /// No float, and not NaN: the value of code that no point reaches.
    pub const NONE: Interval = Interval { lo: f32::INFINITY, hi: f32::NEG_INFINITY, nan: false };
    /// NaN alone.
    const NAN: Interval = Interval { nan: true, ..Interval::NONE };
    /// Both zeros.
    const ZERO: Interval = Interval { lo: -0.0, hi: 0.0, nan: false };

    /// One float.
    pub fn point(x: f32) -> Interval {
        if x.is_nan() { Interval::NAN } else { Interval { lo: x, hi: x, nan: false } }
    }

    /// The floats from `lo` to `hi`; with both zeros if it has one at an end and other numbers. Every float
    /// if an end is NaN.
    pub fn new(lo: f32, hi: f32) -> Interval {
        if lo.is_nan() || hi.is_nan() {
            return Interval { nan: false, ..Interval::ANY };
        }
        Interval { lo, hi, nan: false }
    }

    /// The floats between two numbers, rounded outward.
    pub(crate) fn outward(lo: f64, hi: f64) -> Interval {
        Interval::new(down(lo), up(hi))
    }

    /// The smallest number in it; larger than [`Interval::hi`] if there is none.
    pub fn lo(self) -> f32 {
        self.lo
    }

    /// The largest number in it.
    pub fn hi(self) -> f32 {
        self.hi
    }

    /// Whether it has NaN.
    pub fn may_be_nan(self) -> bool {
        self.nan
    }

    /// Whether it has no number; it may have NaN.
    pub fn is_empty(self) -> bool {
        self.lo.total_cmp(&self.hi) == Ordering::Greater
    }

    /// Its only float, if it has one and nothing else. NaN is not a known float: it has many forms.
    pub fn value(self) -> Option<f32> {
        (self.lo.to_bits() == self.hi.to_bits() && !self.nan).then_some(self.lo)
    }

    /// Whether it has this float.
    pub fn contains(self, x: f32) -> bool {
        if x.is_nan() {
            return self.nan;
        }
        self.lo.total_cmp(&x) != Ordering::Greater && x.total_cmp(&self.hi) != Ordering::Greater
    }

    /// Whether it has 0 or −0.
    pub fn has_zero(self) -> bool {
        self.lo <= 0.0 && self.hi >= 0.0
    }

    /// Whether it has an infinity.
    pub fn has_infinity(self) -> bool {
        !self.is_empty() && (self.lo == f32::NEG_INFINITY || self.hi == f32::INFINITY)
    }

    /// Whether all of it is in `lo..=hi`, without NaN.
    pub fn is_within(self, lo: f32, hi: f32) -> bool {
        !self.nan && (self.is_empty() || (self.lo >= lo && self.hi <= hi))
    }

    /// Whether all of it is in another one.
    pub fn is_inside(self, other: Interval) -> bool {
        (other.nan || !self.nan) && (self.is_empty() || (other.contains(self.lo) && other.contains(self.hi)))
    }

    /// The largest magnitude in it; 0 if there is no number.
    pub fn magnitude(self) -> f32 {
        if self.is_empty() { 0.0 } else { self.lo.abs().max(self.hi.abs()) }
    }

    /// The smallest interval with everything in both.
    #[must_use]
    pub fn hull(self, other: Interval) -> Interval {
        Interval { lo: least(self.lo, other.lo), hi: most(self.hi, other.hi), nan: self.nan || other.nan }
    }

    /// Everything that is in both.
    #[must_use]
    pub fn meet(self, other: Interval) -> Interval {
        let meet = Interval {
            lo: most(self.lo, other.lo),
            hi: least(self.hi, other.hi),
            nan: self.nan && other.nan,
        };
        if meet.is_empty() { Interval { nan: meet.nan, ..Interval::NONE } } else { meet }
    }

    /// With NaN if `nan`.
    #[must_use]
    pub fn or_nan(self, nan: bool) -> Interval {
        Interval { nan: self.nan || nan, ..self }
    }

    /// Its numbers, without NaN.
    #[must_use]
    pub fn numbers(self) -> Interval {
        Interval { nan: false, ..self }
    }

    /// The numbers in it from `lo` to `hi`, with the zeros of both signs.
    #[must_use]
    pub fn clip(self, lo: f32, hi: f32) -> Interval {
        let lo = if lo == 0.0 { -0.0 } else { lo };
        let hi = if hi == 0.0 { 0.0 } else { hi };
        self.numbers().meet(Interval::new(lo, hi))
    }

    /// An interval that contains both, for values that change in each round of a loop. After a few steps it
    /// contains every float.
    #[must_use]
    pub fn widen(self, next: Interval) -> Interval {
        let lo =
            if least(self.lo, next.lo).to_bits() == self.lo.to_bits() { self.lo } else { f32::NEG_INFINITY };
        let hi = if most(self.hi, next.hi).to_bits() == self.hi.to_bits() { self.hi } else { f32::INFINITY };
        Interval { lo, hi, nan: self.nan || next.nan }
    }
}

#[cfg(test)]
mod tests;
