//! The numbers that a component of an output or an argument may be: floats or ints, each to its last digit.

use osl_numeric::interval::{Enclosure, Interval, Whole};

/// A range of floats or of ints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Numbers {
    Float(Interval),
    Int(Whole),
}

impl Numbers {
    pub(super) const NONE: Numbers = Numbers::Float(Interval::NONE);

    /// The numbers of a value, component by component. Strings and closures have none.
    pub(super) fn of(value: &Enclosure) -> Vec<Numbers> {
        match value {
            Enclosure::Int(n) => vec![Numbers::Int(*n)],
            other => other.numbers().iter().map(|x| Numbers::Float(*x)).collect(),
        }
    }

    /// None, of the same kind.
    pub(super) fn none(self) -> Numbers {
        match self {
            Numbers::Float(_) => Numbers::NONE,
            Numbers::Int(_) => Numbers::Int(Whole::NONE),
        }
    }

    /// The smallest number in it; larger than [`Numbers::hi`] if there is none.
    pub(super) fn lo(self) -> f64 {
        match self {
            Numbers::Float(x) => x.lo().into(),
            Numbers::Int(n) => n.lo.into(),
        }
    }

    /// The largest number in it.
    pub(super) fn hi(self) -> f64 {
        match self {
            Numbers::Float(x) => x.hi().into(),
            Numbers::Int(n) => n.hi.into(),
        }
    }

    /// Both ends; `None` if it has no number.
    pub(super) fn ends(self) -> Option<[f64; 2]> {
        (!self.is_empty()).then(|| [self.lo(), self.hi()])
    }

    pub(super) fn is_empty(self) -> bool {
        match self {
            Numbers::Float(x) => x.is_empty(),
            Numbers::Int(n) => n.is_empty(),
        }
    }

    pub(super) fn may_be_nan(self) -> bool {
        matches!(self, Numbers::Float(x) if x.may_be_nan())
    }

    pub(super) fn has_infinity(self) -> bool {
        matches!(self, Numbers::Float(x) if x.has_infinity())
    }

    /// Whether it is a single number, or NaN alone.
    pub(super) fn is_known(self) -> bool {
        match self {
            Numbers::Float(x) => x.value().is_some() || (x.is_empty() && x.may_be_nan()),
            Numbers::Int(n) => n.value().is_some(),
        }
    }

    /// The smallest range with everything in both.
    #[must_use]
    pub(super) fn hull(self, other: Numbers) -> Numbers {
        match (self, other) {
            (Numbers::Float(a), Numbers::Float(b)) => Numbers::Float(a.hull(b)),
            (Numbers::Int(a), Numbers::Int(b)) => Numbers::Int(a.hull(b)),
            (a, b) if a.is_empty() => b,
            (a, b) if b.is_empty() => a,
            _ => Numbers::Float(Interval::ANY),
        }
    }

    /// Everything that is in both.
    #[must_use]
    pub(super) fn meet(self, other: Numbers) -> Numbers {
        match (self, other) {
            (Numbers::Float(a), Numbers::Float(b)) => Numbers::Float(a.meet(b)),
            (Numbers::Int(a), Numbers::Int(b)) => {
                let meet = a.meet(b);
                Numbers::Int(if meet.is_empty() { Whole::NONE } else { meet })
            }
            (a, b) => {
                if b.is_empty() {
                    b
                } else {
                    a
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_ints_stay_exact() {
        let of = |lo, hi| Numbers::Int(Whole { lo, hi });
        let hull = of(i32::MIN, -5).hull(of(16_777_217, 16_777_217));
        assert_eq!(hull.ends(), Some([-2_147_483_648.0, 16_777_217.0]));
        assert!(of(16_777_217, 16_777_217).is_known() && !hull.is_known());
        assert_eq!(of(1, 3).meet(of(5, 9)).hull(of(7, 8)), of(7, 8));
        assert_eq!(Numbers::NONE.hull(of(2, 3)), of(2, 3));
        assert_eq!(of(0, 1).none().ends(), None);
    }
}
