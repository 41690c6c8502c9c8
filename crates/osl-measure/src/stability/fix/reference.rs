//! The original at one setting, against which the outputs of a changed source are compared: each component of
//! each output by itself, so that an output that is wrong already hides no harm to another one.
//!
//! The truth is the original source in double precision.

use super::super::sweep::{errors_in, range};
use super::super::trial::SAFE;
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
    pub(super) fn of(points: &[f64]) -> Errors {
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
pub(super) const FLOOR: f64 = 1e-7;

/// A change of a point that was right, as a share of the range, which is still rounding.
pub(super) const ROUNDING: f64 = 2e-6;

/// Neighbours on each side among which a point's error before the change is the largest: a single point may
/// be right by chance.
const AROUND: usize = 3;

/// Difference of two results in double precision up to which they are the same function: as a share of the
/// largest error, and at least as a share of the range.
pub(super) const SAME: [f64; 2] = [1e-3, 1e-6];

/// How many times its root mean square error may grow in one component.
const GROWS: f64 = 1.2;

/// The share of the range from which on a point is wrong: the default of the command. Where the original has
/// such points with another value of a parameter, smaller errors are no harm.
const WRONG: f64 = 0.01;

/// A component of an output.
struct Component {
    truth: Vec<f64>,
    /// Whether the original is finite at each point.
    was_finite: Vec<bool>,
    range: f64,
    before: Errors,
    /// For each point the largest error near it before the change.
    near: Vec<f64>,
    /// The error up to which a point is not harmed.
    least: f64,
}

/// The components of the outputs.
pub(super) struct Reference {
    components: Vec<Component>,
    /// The errors of the original.
    pub(super) before: Errors,
    /// The share of the range up to which results in double precision are the same.
    same: f64,
}

/// What a change does to points that were right.
pub(super) enum Harm {
    /// Results are not finite that were finite.
    NotFinite,
    /// These points become worse.
    Worse(Vec<usize>),
}

impl Reference {
    /// The original with these results in strict arithmetic and in double precision, on a grid of this size.
    /// Errors up to `least` harm no point, and differences up to `same` are none.
    pub(super) fn new(
        strict: &[Vec<f64>],
        truth: Vec<Vec<f64>>,
        size: (usize, usize),
        (least, same): (f64, f64),
    ) -> Reference {
        let component = |(values, truth): (&Vec<f64>, Vec<f64>)| {
            let range = range(&truth);
            let errors = errors_in(values, &truth, range);
            let was_finite = values.iter().map(|x| x.is_finite()).collect();
            let (before, near) = (Errors::of(&errors), around(&errors, size.0, size.1));
            Component { truth, was_finite, range, before, near, least }
        };
        let components: Vec<Component> = strict.iter().zip(truth).map(component).collect();
        let mut reference = Reference { components, before: Errors { largest: 0.0, rms: 0.0 }, same };
        reference.before = reference.errors(strict);
        reference
    }

    /// Lets smaller errors pass in a component in which the original has wrong points.
    pub(super) fn lenient(mut self) -> Reference {
        for component in &mut self.components {
            let wrong = component.near.iter().filter(|error| **error > WRONG).count();
            if is_many(wrong, component.near.len()) {
                component.least = component.least.max(WRONG);
            }
        }
        self
    }

    /// Whether these are the values of as many components and points.
    pub(super) fn has_size(&self, values: &[Vec<f64>]) -> bool {
        let same = |(own, values): (&Component, &Vec<f64>)| own.truth.len() == values.len();
        self.components.len() == values.len() && self.components.iter().zip(values).all(same)
    }

    /// The errors of points, each with its worst component: the figures of a report.
    pub(super) fn errors(&self, strict: &[Vec<f64>]) -> Errors {
        let mut worst: Vec<f64> = Vec::new();
        for (component, values) in self.components.iter().zip(strict) {
            let errors = component.errors(values);
            worst.resize(errors.len(), 0.0);
            worst.iter_mut().zip(errors).for_each(|(worst, error)| *worst = worst.max(error));
        }
        Errors::of(&worst)
    }

    /// The harm that results in strict arithmetic do, if they do more than at single points.
    pub(super) fn harm(&self, strict: &[Vec<f64>]) -> Option<Harm> {
        if self.lose_finite(strict, |component, at| component.was_finite.get(at) == Some(&true)) {
            return Some(Harm::NotFinite);
        }
        let worse = |(component, values): (&Component, &Vec<f64>)| {
            let errors = component.errors(values);
            let grows = Errors::of(&errors).rms > GROWS * component.before.rms + component.least;
            let times = if grows { 1.0 } else { 2.0 };
            let pairs = errors.iter().zip(&component.near).enumerate();
            let worse = pairs.filter(|(_, (now, near))| **now > times * **near + component.least);
            let points: Vec<usize> = worse.map(|(at, _)| at).collect();
            is_many(points.len(), errors.len()).then_some(points)
        };
        self.components.iter().zip(strict).find_map(worse).map(Harm::Worse)
    }

    /// Where results in double precision are those of another function, if they are at more than single
    /// points: those at a jump may be on its other side.
    pub(super) fn differs(&self, exact: &[Vec<f64>]) -> Option<Harm> {
        if self.lose_finite(exact, |component, at| component.truth.get(at).is_some_and(|x| x.is_finite())) {
            return Some(Harm::NotFinite);
        }
        let other = |(component, values): (&Component, &Vec<f64>)| {
            let limit = (SAME[0] * component.before.largest.min(1.0)).max(self.same);
            let errors = component.errors(values);
            let points: Vec<usize> =
                errors.iter().enumerate().filter(|(_, error)| **error > limit).map(|(at, _)| at).collect();
            is_many(points.len(), errors.len()).then_some(points)
        };
        self.components.iter().zip(exact).find_map(other).map(Harm::Worse)
    }

    /// The largest difference in double precision, without single points.
    pub(super) fn doubt(&self, exact: &[Vec<f64>]) -> f64 {
        let largest = |(component, values): (&Component, &Vec<f64>)| {
            let mut errors = component.errors(values);
            errors.sort_by(f64::total_cmp);
            errors.iter().rev().nth(single(errors.len())).copied().unwrap_or(0.0)
        };
        self.components.iter().zip(exact).map(largest).fold(0.0, f64::max)
    }

    /// Whether a single result is not finite that was finite.
    fn lose_finite(&self, values: &[Vec<f64>], was_finite: impl Fn(&Component, usize) -> bool) -> bool {
        let loses = |(component, values): (&Component, &Vec<f64>)| {
            values.iter().enumerate().any(|(at, now)| !now.is_finite() && was_finite(component, at))
        };
        self.components.iter().zip(values).any(loses)
    }
}

impl Component {
    fn errors(&self, values: &[f64]) -> Vec<f64> {
        errors_in(values, &self.truth, self.range)
    }
}

/// Whether these are more than single points, which may lie at a jump.
fn is_many(points: usize, all: usize) -> bool {
    points > single(all)
}

/// The number of points that count as single ones.
fn single(all: usize) -> usize {
    ((SAFE * all as f64) as usize).max(1)
}

/// For each point of a grid the largest value near it.
fn around(values: &[f64], width: usize, height: usize) -> Vec<f64> {
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
