//! The numbers that a component of an output or an argument may be: floats or ints, each to its last digit.

use osl_numeric::interval::{Enclosure, Interval, Whole};

/// A range of floats or of ints, which doubles hold exactly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Numbers {
    lo: f64,
    hi: f64,
    may_be_nan: bool,
}

impl Numbers {
    pub(super) const NONE: Numbers = Numbers { lo: f64::INFINITY, hi: f64::NEG_INFINITY, may_be_nan: false };

    fn new(lo: f64, hi: f64, may_be_nan: bool) -> Numbers {
        if lo <= hi { Numbers { lo, hi, may_be_nan } } else { Numbers { may_be_nan, ..Numbers::NONE } }
    }

    pub(super) fn float(x: Interval) -> Numbers {
        let [lo, hi] = if x.is_empty() { [1.0, 0.0] } else { [x.lo(), x.hi()] };
        Numbers::new(lo.into(), hi.into(), x.may_be_nan())
    }

    pub(super) fn int(n: Whole) -> Numbers {
        Numbers::new(n.lo.into(), n.hi.into(), false)
    }

    /// The numbers of a value, component by component. Strings and closures have none.
    pub(super) fn of(value: &Enclosure) -> Vec<Numbers> {
        match value {
            Enclosure::Int(n) => vec![Numbers::int(*n)],
            other => other.numbers().iter().map(|x| Numbers::float(*x)).collect(),
        }
    }

    /// The smallest number in it; larger than [`Numbers::hi`] if there is none.
    pub(super) fn lo(self) -> f64 {
        self.lo
    }

    /// The largest number in it.
    pub(super) fn hi(self) -> f64 {
        self.hi
    }

    /// Both ends; `None` if it has no number.
    pub(super) fn ends(self) -> Option<[f64; 2]> {
        (!self.is_empty()).then_some([self.lo, self.hi])
    }

    pub(super) fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    pub(super) fn may_be_nan(self) -> bool {
        self.may_be_nan
    }

    pub(super) fn has_infinity(self) -> bool {
        self.ends().is_some_and(|ends| ends.iter().any(|end| end.is_infinite()))
    }

    /// Whether it is a single number, or NaN alone.
    pub(super) fn is_known(self) -> bool {
        let is_single = self.lo.to_bits() == self.hi.to_bits();
        if self.may_be_nan { self.is_empty() } else { is_single }
    }

    /// The smallest range with everything in both.
    #[must_use]
    pub(super) fn hull(self, other: Numbers) -> Numbers {
        let may_be_nan = self.may_be_nan || other.may_be_nan;
        Numbers::new(self.lo.min(other.lo), self.hi.max(other.hi), may_be_nan)
    }

    /// Everything that is in both.
    #[must_use]
    pub(super) fn meet(self, other: Numbers) -> Numbers {
        let may_be_nan = self.may_be_nan && other.may_be_nan;
        Numbers::new(self.lo.max(other.lo), self.hi.min(other.hi), may_be_nan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_ints_stay_exact() {
        let of = |lo, hi| Numbers::int(Whole { lo, hi });
        let hull = of(i32::MIN, -5).hull(of(16_777_217, 16_777_217));
        assert_eq!(hull.ends(), Some([-2_147_483_648.0, 16_777_217.0]));
        assert!(of(16_777_217, 16_777_217).is_known() && !hull.is_known());
        assert_eq!(of(1, 3).meet(of(5, 9)).hull(of(7, 8)), of(7, 8));
        assert_eq!(Numbers::NONE.hull(of(2, 3)), of(2, 3));
        assert_eq!(Numbers::NONE.ends(), None);
    }
}
