//! Judges a changed shader: by how much its errors are smaller, whether it computes the same function,
//! whether points that were right are still right, and what it costs.
//!
//! The truth is the result of the original source in double precision. This module must not know how the
//! change was found.

use super::super::subject::{Planes, Programs, Subject, Swept};
use super::super::sweep::range;
use super::super::trial::{SAFE, Setting};
use osl_scene::Grid;
use serde::Serialize;

/// The errors of a run, as shares of the range of the output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Errors {
    /// The largest.
    pub largest: f64,
    /// Root mean square over the points, each with its worst output.
    pub rms: f64,
}

impl Errors {
    fn of(points: &[f64]) -> Errors {
        let largest = points.iter().copied().fold(0.0, f64::max);
        let squares: f64 = points.iter().map(|e| e * e).sum();
        Errors { largest, rms: (squares / points.len().max(1) as f64).sqrt() }
    }

    /// How many times smaller other errors are: by the largest or by the mean, unless one of them grows.
    pub(super) fn gain(&self, after: &Errors) -> f64 {
        let ratio = |before: f64, after: f64| before.max(FLOOR) / after.max(FLOOR);
        let (largest, rms) = (ratio(self.largest, after.largest), ratio(self.rms, after.rms));
        if largest.min(rms) < 0.9 { largest.min(rms) } else { largest.max(rms) }
    }
}

/// Errors below this share of the range are roundings, and no longer compared.
const FLOOR: f64 = 1e-7;

/// The largest cost of a repair, relative to the original.
pub(super) const DEAR: f64 = 1.2;

/// The smallest gain for which anything else is tested.
const WORTHWHILE: f64 = 1.2;

/// A change of a point that was right, as a share of the range, which is still rounding.
const ROUNDING: f64 = 2e-6;

/// Neighbours on each side among which a point's error before the change is the largest: a single point may
/// be right by chance.
const AROUND: usize = 3;

/// Difference of two results in double precision up to which they are the same function: as a share of the
/// largest error, and at least as a share of the range.
const SAME: [f64; 2] = [1e-3, 1e-6];

/// What is known of a setting.
struct Level {
    points: Swept,
    tries: bool,
    truth: Vec<Vec<f64>>,
    ranges: Vec<f64>,
    before: Errors,
    /// For each point the largest error near it before the change.
    near: Vec<f64>,
    /// The lines that are blamed there.
    lines: Vec<u32>,
    /// Whether it is the given setting, at which no change may harm.
    is_given: bool,
}

/// The settings at which changes are judged. The first one is the one to repair.
pub(super) struct Judge<'a> {
    subject: &'a Subject<'a>,
    levels: Vec<Level>,
    cost: f64,
}

/// A change that passes all tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Good {
    /// The errors at the first setting.
    pub(super) errors: Errors,
    /// The cost relative to the original.
    pub(super) cost: f64,
    /// The largest difference of the two sources in double precision, as a share of the range.
    pub(super) doubt: f64,
}

/// Why a change does not pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bad {
    /// It does not run to its end.
    Stops,
    /// It helps too little: how many times smaller the error is, and the errors.
    Little(f64, Errors),
    /// It makes other points wrong.
    Harms,
    /// It is another function, also in double precision.
    Differs,
}

impl<'a> Judge<'a> {
    /// Prepares the settings. `None` if the original does not run at the first one.
    pub(super) fn new(
        subject: &'a Subject<'a>,
        grid: &Grid,
        settings: &[(Setting, Vec<u32>)],
    ) -> Option<Judge<'a>> {
        let mut levels = Vec::new();
        for (index, (setting, lines)) in settings.iter().enumerate() {
            let points = setting.points(grid);
            let tries = *setting != Setting::AsGiven;
            match subject.run(&subject.base, &points, tries) {
                Ok(Planes { strict, exact, .. }) => {
                    let ranges: Vec<f64> = exact.iter().map(|plane| range(plane)).collect();
                    let errors = worst(&strict, &exact, &ranges);
                    let before = Errors::of(&errors);
                    let near = around(&errors, grid.width, grid.height);
                    let (lines, is_given) = (lines.clone(), !tries);
                    levels.push(Level { points, tries, truth: exact, ranges, before, near, lines, is_given });
                }
                Err(_) if index == 0 => return None,
                Err(_) => {}
            }
        }
        Some(Judge { subject, levels, cost: subject.base.programs.cost })
    }

    /// The errors before any change, at the first setting.
    pub(super) fn before(&self) -> Errors {
        self.levels.first().map_or(Errors { largest: 0.0, rms: 0.0 }, |level| level.before)
    }

    /// Whether a changed program has exactly these errors at the first setting.
    pub(super) fn has_errors(&self, programs: &Programs, errors: &Errors) -> bool {
        let Some(level) = self.levels.first() else { return false };
        let values = self.subject.values(&programs.strict, &level.points, level.tries);
        values.is_ok_and(|(_, strict)| Errors::of(&worst(&strict, &level.truth, &level.ranges)) == *errors)
    }

    /// Judges a changed program against the original and against the errors of an earlier change. Besides the
    /// first setting, the given one counts, and those at which one of these lines is blamed.
    pub(super) fn judge(&self, programs: &Programs, lines: &[u32], earlier: &Errors) -> Result<Good, Bad> {
        let counts = |(index, level): &(usize, &Level)| {
            *index == 0 || level.is_given || level.lines.iter().any(|line| lines.contains(line))
        };
        let mut errors: Option<Errors> = None;
        for (_, level) in self.levels.iter().enumerate().filter(counts) {
            let values = self.subject.values(&programs.strict, &level.points, level.tries);
            let (_, strict) = values.map_err(|_| Bad::Stops)?;
            if strict.len() != level.truth.len() {
                return Err(Bad::Differs);
            }
            let points = worst(&strict, &level.truth, &level.ranges);
            let own = Errors::of(&points);
            if errors.is_none() {
                let gain = earlier.gain(&own);
                if gain < WORTHWHILE {
                    return Err(Bad::Little(gain, own));
                }
                errors = Some(own);
            }
            if harmed(&points, &level.near, ROUNDING).len() as f64 > SAFE * points.len() as f64 {
                return Err(Bad::Harms);
            }
        }
        let mut doubt: f64 = 0.0;
        for (index, level) in self.levels.iter().enumerate().filter(counts) {
            let values = self.subject.values(&programs.exact, &level.points, level.tries);
            let (_, exact) = values.map_err(|_| Bad::Stops)?;
            let limit = (SAME[0] * level.before.largest.min(1.0)).max(SAME[1]);
            let mut points = worst(&exact, &level.truth, &level.ranges);
            points.sort_by(f64::total_cmp);
            // Single points at a jump may be on its other side.
            let allowed = (SAFE * points.len() as f64) as usize;
            let difference = points.iter().rev().nth(allowed).copied().unwrap_or(0.0);
            if difference > limit {
                return Err(Bad::Differs);
            }
            if index == 0 {
                doubt = difference;
            }
        }
        let cost = programs.cost / self.cost.max(1.0);
        errors.map(|errors| Good { errors, cost, doubt }).ok_or(Bad::Stops)
    }
}

/// The points that become wrong and were right: their error exceeds twice the largest one near it before the
/// change, and this share of the range.
pub(super) fn harmed(now: &[f64], near: &[f64], rounding: f64) -> Vec<usize> {
    let points = now.iter().zip(near).enumerate();
    points.filter(|(_, (now, near))| **now > 2.0 * **near + rounding).map(|(at, _)| at).collect()
}

/// The error of each point in its worst output, as a share of the range; 1 if only one of the two values is a
/// number.
fn worst(values: &[Vec<f64>], truth: &[Vec<f64>], ranges: &[f64]) -> Vec<f64> {
    let planes = values.iter().zip(truth).zip(ranges).map(|((values, truth), range)| (values, truth, *range));
    worst_of(planes, truth.first().map_or(0, Vec::len))
}

/// The same for planes with their truth and their range, at this number of points.
pub(super) fn worst_of<'v>(
    planes: impl Iterator<Item = (&'v Vec<f64>, &'v Vec<f64>, f64)>,
    points: usize,
) -> Vec<f64> {
    let mut out = vec![0.0_f64; points];
    for (values, truth, range) in planes {
        for ((out, value), truth) in out.iter_mut().zip(values).zip(truth) {
            let error = if value == truth || (value.is_nan() && truth.is_nan()) {
                0.0
            } else if (value - truth).is_finite() {
                (value - truth).abs() / range
            } else {
                1.0
            };
            *out = out.max(error);
        }
    }
    out
}

/// For each point of a grid the largest value near it.
pub(super) fn around(values: &[f64], width: usize, height: usize) -> Vec<f64> {
    if values.len() != width * height {
        return values.to_vec();
    }
    let largest = |values: &[f64], at: &dyn Fn(usize) -> usize, n: usize, i: usize| {
        let near = i.saturating_sub(AROUND)..(i + AROUND + 1).min(n);
        near.filter_map(|j| values.get(at(j))).copied().fold(0.0, f64::max)
    };
    let rows: Vec<f64> = (0..values.len())
        .map(|index| {
            let (x, y) = (index % width, index / width);
            largest(values, &|j| y * width + j, width, x)
        })
        .collect();
    (0..values.len())
        .map(|index| {
            let (x, y) = (index % width, index / width);
            largest(&rows, &|j| j * width + x, height, y)
        })
        .collect()
}
