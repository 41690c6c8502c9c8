//! Error statistics, and the tests that a level passes: its error is not larger than that of the original and
//! not above a bound, its picture is not brighter or darker, and the given image is like the points
//! elsewhere.

use super::ground::Sides;
use serde::Serialize;

/// Columns and rows of blocks into which a picture is divided to judge its mean. The error of a mean follows
/// from the differences between blocks, since neighbouring pixels may err alike.
pub(super) const BLOCKS: usize = 8;
/// By how many standard errors more than the tolerance the mean of a picture has to be off, until the level
/// is to blame.
const SURE: f64 = 3.0;
/// How many times larger than at all points that were held out an error in the given image may be.
const OUTLIER: f64 = 1.5;
/// With fewer pixels, no mean is tested.
const FEW: usize = 16;

/// A mean square error with its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Square {
    pub(super) mean: f64,
    pub(super) uncertain: f64,
}

impl Square {
    /// The largest root mean square that is likely: with two standard errors.
    pub(super) fn limit(self) -> f64 {
        (self.mean + 2.0 * self.uncertain).max(0.0).sqrt()
    }

    /// The root mean square.
    pub(super) fn root(self) -> f64 {
        self.mean.max(0.0).sqrt()
    }

    pub(super) fn of(values: &[f64]) -> Square {
        let count = values.len().max(2) as f64;
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
        Square { mean, uncertain: (variance / count).sqrt() }
    }
}

/// How large an error may be, as a share of an output's range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Up to this error, a level is good even if the original is closer.
    pub(super) tolerance: f64,
    /// The largest root mean square error of a mean.
    pub(super) error: f64,
}

impl Bounds {
    /// Those of something that runs the original, or a form of it.
    pub(super) fn without_error(self) -> Bounds {
        Bounds { error: f64::INFINITY, ..self }
    }
}

/// How far values are off.
#[derive(Clone, Debug, Default)]
pub(super) struct Off {
    /// For each output, the squared error of each pixel, as a share of the square of the output's range.
    pub(super) squares: Vec<Vec<f64>>,
    /// For each output, the mean square of the reference's own error.
    pub(super) own: Vec<f64>,
    /// For each output, how far the mean over the pixels is off in each component, as a share of the range.
    pub(super) shifts: Vec<Vec<Square>>,
    /// For each output, how far its mean may be off because it is a whole number.
    pub(super) rounding: Vec<f64>,
}

/// The root mean square error of each output and of all outputs together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// Of each output, as a share of its range.
    pub outputs: Vec<f64>,
    /// The largest of them.
    pub worst: f64,
}

/// Why a level is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// Its error is larger.
    Larger,
    /// Its error is not larger, as far as known, but that is not certain.
    Unsure,
    /// Its error is above the bound.
    Above,
    /// The mean of the picture is off.
    Shifted,
    /// The given image has larger errors than the points elsewhere.
    Unlike,
}

/// A test that failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fault {
    pub(super) cause: Cause,
    /// The number of the output.
    pub(super) output: usize,
    /// The sides of the pixels.
    pub(super) sides: Sides,
    /// The error of the level and what it is compared with, or how far the mean is off and how far it may be.
    pub(super) shares: [f64; 2],
}

impl Off {
    /// The mean square error of an output.
    pub(super) fn output(&self, at: usize) -> Square {
        let square = self.squares.get(at).map_or(Square::default(), |list| Square::of(list));
        Square { mean: square.mean - self.own.get(at).copied().unwrap_or(0.0), ..square }
    }

    /// The mean square error of all outputs.
    pub(super) fn all(&self) -> f64 {
        (0..self.squares.len()).map(|at| self.output(at).mean).sum::<f64>() / self.squares.len().max(1) as f64
    }

    pub(super) fn errors(&self) -> Errors {
        let outputs: Vec<f64> = (0..self.squares.len()).map(|at| self.output(at).root()).collect();
        let worst = outputs.iter().copied().fold(0.0, f64::max);
        Errors { outputs, worst }
    }

    /// The largest error of an output that is likely: with two standard errors.
    pub(super) fn limit(&self) -> f64 {
        (0..self.squares.len()).map(|at| self.output(at).limit()).fold(0.0, f64::max)
    }

    /// Whether the mean square error of an output is at least a fifth smaller than another one, beyond doubt.
    pub(super) fn is_better(&self, other: &Off) -> bool {
        self.squares.iter().zip(&other.squares).any(|(own, other)| {
            let less: Vec<f64> = own.iter().zip(other).map(|(own, other)| own - 0.8 * other).collect();
            let less = Square::of(&less);
            less.mean + 2.0 * less.uncertain < 0.0
        })
    }

    /// The first of these tests that an output fails. Its mean square error is not larger than another one's,
    /// beyond the doubt of two standard errors, or below the tolerance. In elongated pixels, where a pattern
    /// of lines has as large an error with both, it is not larger beyond doubt. Its root is not above the
    /// bound. And its mean over the picture is not off by more than the tolerance, beyond the doubt of three
    /// standard errors.
    pub(super) fn fault(
        &self,
        other: &Off,
        Bounds { tolerance, error }: Bounds,
        sides: Sides,
    ) -> Option<Fault> {
        let pairs = self.squares.iter().zip(&other.squares).enumerate();
        pairs.into_iter().find_map(|(output, (own, others))| {
            let fault = |cause, shares| Some(Fault { cause, output, sides, shares });
            let more: Vec<f64> = own.iter().zip(others).map(|(a, b)| a - b).collect();
            let more = Square::of(&more);
            let root = self.output(output).root();
            let doubt = if sides[0] == sides[1] { 2.0 } else { -2.0 };
            if more.mean + doubt * more.uncertain > 0.0 && self.output(output).limit() > tolerance {
                let cause = if more.mean > 0.0 { Cause::Larger } else { Cause::Unsure };
                return fault(cause, [root, other.output(output).root()]);
            }
            if root > error {
                return fault(Cause::Above, [root, error]);
            }
            let may = tolerance + self.rounding.get(output).copied().unwrap_or(0.0);
            let shifts = self.shifts.get(output)?.iter().zip(other.shifts.get(output)?);
            shifts.into_iter().find_map(|(shift, others)| {
                let most = (may + SURE * shift.uncertain).max(others.mean.abs());
                let by = shift.mean.abs();
                if by > most { fault(Cause::Shifted, [by, most]) } else { None }
            })
        })
    }

    /// The first of these tests that an output fails in the given image, which may have few pixels. Its mean
    /// square error is not larger than another one's beyond doubt. And no pixel is much further off than at
    /// the points elsewhere, with the level or as a rule with the original: what holds there says nothing
    /// about this image then. Only outputs that are changed are tested.
    pub(super) fn fault_at_home(
        &self,
        other: &Off,
        elsewhere: [&Off; 2],
        (tolerance, sides, changed): (f64, Sides, &[bool]),
    ) -> Option<Fault> {
        let largest = |list: &Vec<f64>| list.iter().copied().fold(0.0, f64::max).sqrt();
        let pairs = self.squares.iter().zip(&other.squares).zip(changed).enumerate();
        pairs.into_iter().filter(|(_, (_, changed))| **changed).find_map(|(output, ((own, others), _))| {
            let more: Vec<f64> = own.iter().zip(others).map(|(a, b)| a - b).collect();
            let more = Square::of(&more);
            let roots = [self.output(output).root(), other.output(output).root()];
            if own.len() >= FEW && more.mean > 2.0 * more.uncertain && roots[0] > tolerance {
                return Some(Fault { cause: Cause::Larger, output, sides, shares: roots });
            }
            let [level, original] = elsewhere;
            let most = level.squares.get(output).map_or(0.0, largest).max(original.output(output).root());
            let shares = [largest(own), most];
            let unlike = Fault { cause: Cause::Unlike, output, sides, shares };
            (shares[0] > (OUTLIER * most).max(tolerance)).then_some(unlike)
        })
    }

    /// For each output, whether the values differ from others at any pixel.
    pub(super) fn changed(&self, other: &Off) -> Vec<bool> {
        self.squares.iter().zip(&other.squares).map(|(own, other)| own != other).collect()
    }
}

/// How far the mean of a picture is off, from the errors of some pixels, each with its block. Pixels without
/// a reference value are left out.
pub(super) fn shift(errors: &[Option<f64>], blocks: &[usize]) -> Square {
    let mut sums = vec![(0.0, 0.0_f64); BLOCKS * BLOCKS];
    for (error, block) in errors.iter().zip(blocks) {
        if let (Some(error), Some((sum, count))) = (error, sums.get_mut(*block)) {
            *sum += error;
            *count += 1.0;
        }
    }
    let (sum, count) = sums.iter().fold((0.0, 0.0_f64), |(sum, count), (s, n)| (sum + s, count + n));
    let mean = sum / count.max(1.0);
    // The variance of a ratio of sums over blocks, which may have different numbers of pixels.
    let used = sums.iter().filter(|(_, count)| *count > 0.0).count().max(2) as f64;
    let squares: f64 = sums.iter().map(|(sum, n)| (sum - mean * n) * (sum - mean * n)).sum();
    let uncertain = (squares * used / (used - 1.0)).sqrt() / count.max(1.0);
    Square { mean, uncertain }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOUNDS: Bounds = Bounds { tolerance: 0.004, error: 0.95 };

    fn off(errors: &[f64], shift: Square) -> Off {
        let squares = vec![errors.iter().map(|x| x * x).collect()];
        Off { squares, own: vec![0.0], shifts: vec![vec![shift]], rounding: vec![0.0] }
    }

    #[test]
    fn a_smaller_error_is_no_licence_to_shift_the_mean() {
        let sure = |mean: f64| Square { mean, uncertain: 0.01 };
        let original = off(&[0.9, -0.9, 0.8, -0.8], sure(0.0));
        let fault = |shift: f64| {
            let level = off(&[0.2, 0.2, -0.2, -0.2], sure(shift));
            level.fault(&original, BOUNDS, [16.0; 2]).map(|fault| fault.cause)
        };
        assert_eq!(fault(0.0), None);
        assert_eq!(fault(0.03), None, "within three standard errors");
        let moved = off(&[0.9, -0.9, 0.8, -0.8], sure(0.05));
        assert!(
            off(&[0.2; 4], sure(0.05)).fault(&moved, BOUNDS, [16.0; 2]).is_none(),
            "as far as the original"
        );
        assert_eq!((fault(0.035), fault(-0.035)), (Some(Cause::Shifted), Some(Cause::Shifted)));
        let larger = off(&[1.0; 4], sure(0.0));
        assert_eq!(larger.fault(&original, BOUNDS, [16.0; 2]).map(|fault| fault.cause), Some(Cause::Larger));
        let above = off(&[0.97, 0.97, 0.98, 0.98], sure(0.0)).fault(&larger, BOUNDS, [16.0; 2]);
        assert_eq!(above.map(|fault| fault.cause), Some(Cause::Above));
        let unsure = off(&[0.1, 0.1, 0.1, 1.1], sure(0.0));
        assert_eq!(unsure.fault(&original, BOUNDS, [16.0; 2]).map(|fault| fault.cause), Some(Cause::Unsure));
    }

    #[test]
    fn an_object_that_is_only_in_the_given_image_is_an_outlier() {
        let none = Square::default();
        let (level, original) = (off(&[0.1, 0.0], none), off(&[0.05, 0.0], none));
        let cause = |own: f64, elsewhere: [&Off; 2]| {
            let fault =
                off(&[0.0, own], none).fault_at_home(&original, elsewhere, (0.004, [64.0; 2], &[true]));
            fault.map(|fault| fault.cause)
        };
        assert_eq!(cause(0.14, [&level, &original]), None);
        assert_eq!(cause(0.16, [&level, &original]), Some(Cause::Unlike));
        assert_eq!(cause(0.16, [&level, &off(&[0.9, 0.0], none)]), None);
        let empty = off(&[0.0, 0.0], none);
        assert_eq!(cause(0.003, [&empty, &empty]), None);
        assert_eq!(cause(0.005, [&empty, &empty]), Some(Cause::Unlike));
    }

    #[test]
    fn many_pixels_of_the_given_image_are_tested_as_those_elsewhere() {
        let (large, none) = (off(&[0.5; 64], Square::default()), Square::default());
        let cause = |own: f64, changed: bool| {
            let other = off(&[0.2; 64], none);
            let fault =
                off(&[own; 64], none).fault_at_home(&other, [&large, &large], (0.004, [4.0; 2], &[changed]));
            fault.map(|fault| fault.cause)
        };
        assert_eq!((cause(0.3, true), cause(0.3, false)), (Some(Cause::Larger), None));
        assert_eq!(cause(0.1, true), None);
    }

    #[test]
    fn a_shift_is_as_uncertain_as_the_means_of_blocks() {
        let blocks: Vec<usize> = (0..640).map(|at| at / 10).collect();
        // All pixels of a block err alike, so there are 64 independent errors.
        let errors: Vec<Option<f64>> =
            blocks.iter().map(|b| Some(if b % 2 == 0 { 0.5 } else { -0.3 })).collect();
        let found = shift(&errors, &blocks);
        assert!((found.mean - 0.1).abs() < 1e-12);
        assert!((found.uncertain - 0.4 / 63.0_f64.sqrt()).abs() < 1e-9, "{found:?}");
        assert_eq!(shift(&[None, Some(0.25)], &[0, 1]).mean, 0.25);
    }
}
