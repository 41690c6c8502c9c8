//! What is known of the truth of a condition.

use crate::int::Mask;
use std::ops::{BitAnd, BitOr, Not};

/// Which truth values a condition may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Truth {
    /// It may be true.
    pub yes: bool,
    /// It may be false.
    pub no: bool,
}

impl Truth {
    /// It may be either.
    pub const UNKNOWN: Truth = Truth { yes: true, no: true };

    /// A known truth.
    pub fn known(truth: bool) -> Truth {
        Truth { yes: truth, no: !truth }
    }

    /// The truth, if there is only one.
    pub fn value(self) -> Option<bool> {
        match self {
            Truth { yes: true, no: false } => Some(true),
            Truth { yes: false, no: true } => Some(false),
            _ => None,
        }
    }

    /// What it may be if it is one of two.
    #[must_use]
    pub fn or_else(self, other: Truth) -> Truth {
        Truth { yes: self.yes || other.yes, no: self.no || other.no }
    }
}

impl BitAnd for Truth {
    type Output = Truth;

    fn bitand(self, other: Truth) -> Truth {
        Truth { yes: self.yes && other.yes, no: self.no || other.no }
    }
}

impl BitOr for Truth {
    type Output = Truth;

    fn bitor(self, other: Truth) -> Truth {
        Truth { yes: self.yes || other.yes, no: self.no && other.no }
    }
}

impl Not for Truth {
    type Output = Truth;

    fn not(self) -> Truth {
        Truth { yes: self.no, no: self.yes }
    }
}

impl Mask for Truth {}
