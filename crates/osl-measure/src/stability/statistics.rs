//! Error statistics per instruction of the source, summed over the followed points.

use super::rerun::Broken;
use osl_ir::Span;

/// Weight of rounding error relative to amplified error. It is small, so rounding decides only if nothing is
/// amplified.
pub(super) const ROUNDING: f64 = 0.02;

/// An instruction whose own error is this many times a rounding is inexact: single precision does not compute
/// it to the last digit.
pub(super) const INEXACT: f64 = 16.0;

/// An instruction of the source: its location and its operation.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct InstSite {
    /// Its location.
    pub span: Span,
    /// Its operation, in the words of the IR.
    pub what: String,
}

/// What an instruction did to the outputs of one point, as shares of an output's range.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Blame {
    /// Error that passes through it and that it amplifies, or that begins in it.
    pub amplified: f64,
    /// The part of that which it amplifies because it repeats or reduces the range of its argument.
    pub reduced: f64,
    /// The part that begins in it because its result leaves the range of floats.
    pub left: f64,
    /// Error from its own rounding.
    pub rounded: f64,
    /// How many times a single rounding its own error is, multiplied by the error that begins in it. Many
    /// functions are less exact than a rounding.
    pub inexact: f64,
    /// The error that begins in it, as estimated along the flow of the error.
    pub begins: f64,
    /// How often a comparison, a floor or the like has a different result in double precision.
    pub flips: u32,
    /// How often it ran.
    pub runs: u32,
    /// The largest factor by which the relative error of its result exceeds that of its arguments, multiplied
    /// over the rounds of a loop that magnify one after the other; 0 if the result is right.
    pub factor: f64,
    /// The largest number in its results.
    pub size: f64,
    /// How its result left the range of floats, if it did.
    pub broken: Option<Broken>,
}

impl Blame {
    /// The score by which instructions are ranked.
    pub fn score(&self) -> f64 {
        self.amplified + ROUNDING * self.rounded
    }

    /// How many times a single rounding its own error is: the mean, weighted by the error that begins in it.
    pub fn roundings(&self) -> f64 {
        if self.begins > 0.0 { self.inexact / self.begins } else { 0.0 }
    }

    /// Adds the blame from another point.
    pub fn add(&mut self, other: &Blame) {
        self.amplified += other.amplified;
        self.reduced += other.reduced;
        self.left += other.left;
        self.rounded += other.rounded;
        self.inexact += other.inexact;
        self.begins += other.begins;
        self.flips += other.flips;
        self.runs += other.runs;
        self.factor = self.factor.max(other.factor);
        self.size = self.size.max(other.size);
        self.broken = self.broken.max(other.broken);
    }
}
