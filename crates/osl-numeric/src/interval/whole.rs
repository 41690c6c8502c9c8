//! Intervals of ints. A result that may wrap around is every int.

use super::Truth;
use crate::int::Int;
use std::ops::{BitAnd, BitOr, BitXor, Not};

/// The ints from `lo` to `hi`; none if `lo` is larger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Whole {
    /// The smallest.
    pub lo: i32,
    /// The largest.
    pub hi: i32,
}

impl Whole {
    /// Every int.
    pub const ANY: Whole = Whole { lo: i32::MIN, hi: i32::MAX };
    /// No int.
    pub const NONE: Whole = Whole { lo: i32::MAX, hi: i32::MIN };

    /// One int.
    pub fn point(value: i32) -> Whole {
        Whole { lo: value, hi: value }
    }

    /// The ints between two, or every int if they do not fit.
    fn fitting(lo: i64, hi: i64) -> Whole {
        match (i32::try_from(lo), i32::try_from(hi)) {
            (Ok(lo), Ok(hi)) => Whole { lo, hi },
            _ => Whole::ANY,
        }
    }

    /// Its only int.
    pub fn value(self) -> Option<i32> {
        (self.lo == self.hi).then_some(self.lo)
    }

    /// Whether it has no int.
    pub fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    /// Whether it has this int.
    pub fn contains(self, value: i32) -> bool {
        (self.lo..=self.hi).contains(&value)
    }

    /// Whether all of it is in `lo..=hi`.
    pub fn is_within(self, lo: i32, hi: i32) -> bool {
        self.is_empty() || (self.lo >= lo && self.hi <= hi)
    }

    /// The smallest interval with everything in both.
    #[must_use]
    pub fn hull(self, other: Whole) -> Whole {
        Whole { lo: Ord::min(self.lo, other.lo), hi: Ord::max(self.hi, other.hi) }
    }

    /// Everything that is in both.
    #[must_use]
    pub fn meet(self, other: Whole) -> Whole {
        Whole { lo: Ord::max(self.lo, other.lo), hi: Ord::min(self.hi, other.hi) }
    }

    /// As [`Interval::widen`](super::Interval::widen).
    #[must_use]
    pub fn widen(self, next: Whole) -> Whole {
        Whole {
            lo: if next.lo < self.lo { i32::MIN } else { self.lo },
            hi: if next.hi > self.hi { i32::MAX } else { self.hi },
        }
    }

    /// The hull of a function at the four corners, as it is exact for sums, products and quotients.
    pub(super) fn corners(self, other: Whole, f: impl Fn(i64, i64) -> i64) -> (i64, i64) {
        let [a, b, c, d] = [
            f(self.lo.into(), other.lo.into()),
            f(self.lo.into(), other.hi.into()),
            f(self.hi.into(), other.lo.into()),
            f(self.hi.into(), other.hi.into()),
        ];
        (Ord::min(Ord::min(a, b), Ord::min(c, d)), Ord::max(Ord::max(a, b), Ord::max(c, d)))
    }

    fn over_corners(self, other: Whole, f: impl Fn(i64, i64) -> i64) -> Whole {
        if self.is_empty() || other.is_empty() {
            return Whole::NONE;
        }
        let (lo, hi) = self.corners(other, f);
        Whole::fitting(lo, hi)
    }

    /// The value of a function of known ints; `None` if they are not known.
    fn known(self, other: Whole, f: impl Fn(i32, i32) -> i32) -> Option<Whole> {
        Some(Whole::point(f(self.value()?, other.value()?)))
    }

    /// The int with all bits up to the highest bit of `self.hi` or `other.hi`, if neither is negative.
    fn filled(self, other: Whole) -> Option<i32> {
        if self.lo < 0 || other.lo < 0 || self.is_empty() || other.is_empty() {
            return None;
        }
        let bits = (self.hi | other.hi) as u32;
        Some((u32::MAX >> 1).checked_shr(bits.leading_zeros().saturating_sub(1)).unwrap_or(0).cast_signed())
    }
}

impl BitAnd for Whole {
    type Output = Whole;

    fn bitand(self, other: Whole) -> Whole {
        self.known(other, |a, b| a & b).unwrap_or(match (self.lo >= 0, other.lo >= 0) {
            (true, true) => Whole { lo: 0, hi: Ord::min(self.hi, other.hi) },
            (true, false) => Whole { lo: 0, hi: self.hi },
            (false, true) => Whole { lo: 0, hi: other.hi },
            _ => Whole::ANY,
        })
    }
}

impl BitOr for Whole {
    type Output = Whole;

    fn bitor(self, other: Whole) -> Whole {
        let wide = || match self.filled(other) {
            Some(hi) => Whole { lo: Ord::max(self.lo, other.lo), hi },
            None => Whole::ANY,
        };
        self.known(other, |a, b| a | b).unwrap_or_else(wide)
    }
}

impl BitXor for Whole {
    type Output = Whole;

    fn bitxor(self, other: Whole) -> Whole {
        let wide = || self.filled(other).map_or(Whole::ANY, |hi| Whole { lo: 0, hi });
        self.known(other, |a, b| a ^ b).unwrap_or_else(wide)
    }
}

impl Not for Whole {
    type Output = Whole;

    fn not(self) -> Whole {
        Whole { lo: !self.hi, hi: !self.lo }
    }
}

impl Int for Whole {
    type Mask = Truth;

    fn lit(value: i32) -> Whole {
        Whole::point(value)
    }

    fn select(mask: Truth, yes: Whole, no: Whole) -> Whole {
        match mask.value() {
            Some(true) => yes,
            Some(false) => no,
            None => yes.hull(no),
        }
    }

    fn of_mask(mask: Truth) -> Whole {
        match mask.value() {
            Some(truth) => Whole::point(truth.into()),
            None => Whole { lo: 0, hi: 1 },
        }
    }

    fn is_true(self) -> Truth {
        !self.eq(Whole::point(0))
    }

    fn eq(self, other: Whole) -> Truth {
        let is_known = self.value().is_some() && self == other;
        Truth { yes: !self.meet(other).is_empty(), no: !is_known }
    }

    fn lt(self, other: Whole) -> Truth {
        Truth { yes: self.lo < other.hi, no: self.hi >= other.lo }
    }

    fn wrapping_add(self, other: Whole) -> Whole {
        let known = self.known(other, i32::wrapping_add);
        known.unwrap_or_else(|| self.over_corners(other, |a, b| a + b))
    }

    fn wrapping_sub(self, other: Whole) -> Whole {
        let known = self.known(other, i32::wrapping_sub);
        known.unwrap_or_else(|| self.over_corners(other, |a, b| a - b))
    }

    fn wrapping_mul(self, other: Whole) -> Whole {
        let known = self.known(other, i32::wrapping_mul);
        known.unwrap_or_else(|| self.over_corners(other, |a, b| a * b))
    }

    fn wrapping_abs(self) -> Whole {
        match self {
            _ if self.lo >= 0 => self,
            Whole { lo: i32::MIN, hi } => {
                if hi == i32::MIN {
                    self
                } else {
                    Whole::ANY
                }
            }
            _ if self.hi <= 0 => Whole { lo: -self.hi, hi: -self.lo },
            _ => Whole { lo: 0, hi: Ord::max(-self.lo, self.hi) },
        }
    }

    fn min(self, other: Whole) -> Whole {
        Whole { lo: Ord::min(self.lo, other.lo), hi: Ord::min(self.hi, other.hi) }
    }

    fn max(self, other: Whole) -> Whole {
        Whole { lo: Ord::max(self.lo, other.lo), hi: Ord::max(self.hi, other.hi) }
    }

    fn shl(self, distance: Whole) -> Whole {
        if let Some(known) = self.known(distance, Int::shl) {
            return known;
        }
        match distance.value() {
            Some(distance) => self.over_corners(Whole::point(0), |a, _| a << (distance & 31)),
            None => Whole::ANY,
        }
    }

    fn shr(self, distance: Whole) -> Whole {
        if let Some(known) = self.known(distance, Int::shr) {
            return known;
        }
        let distance = if distance.is_within(0, 31) { distance } else { Whole { lo: 0, hi: 31 } };
        self.over_corners(distance, |a, by| a >> by)
    }

    fn quotient(self, divisor: Whole) -> Whole {
        if divisor.contains(0) {
            return Whole::ANY;
        }
        if let Some(known) = self.known(divisor, Int::quotient) {
            return known;
        }
        // i32::MIN / -1 does not fit, and wraps.
        self.over_corners(divisor, |a, b| a.checked_div(b).unwrap_or(i64::MAX))
    }
}
