//! The digits that the variables of a source lose in single precision.

use crate::cli::picture::figures::Results;
use osl_lower::taps::{Doings, Tap};
use osl_measure::stability::digits_lost;
use std::collections::BTreeMap;

/// The share of the points of a line that may have lost more digits than its margin says.
const WORST: f64 = 0.01;

/// The digits that each line loses: those of the variable that loses most.
pub(super) fn lines(doings: &Doings, single: &Results<'_>, double: &Results<'_>) -> BTreeMap<u32, f64> {
    let mut lines = BTreeMap::new();
    for set in doings.sets.iter().filter(|set| !single.planes(&set.tap.name).is_empty()) {
        let line: &mut f64 = lines.entry(set.wanted.line).or_default();
        *line = line.max(of(&set.tap, single, double));
    }
    lines
}

/// The digits that a variable loses in single precision, of its largest value: all but a hundredth of the
/// points lose less.
fn of(tap: &Tap, single: &Results<'_>, double: &Results<'_>) -> f64 {
    let mask = single.reached(tap);
    let counts = |at: usize| mask.as_ref().is_none_or(|mask| mask.get(at).is_some_and(|x| *x > 0.0));
    let mut errors: Vec<f64> = Vec::new();
    let mut size = 0.0_f64;
    for (single, double) in single.planes(&tap.name).iter().zip(double.planes(&tap.name)) {
        let pairs = single.doubles().into_iter().zip(double.doubles()).enumerate();
        for (_, (a, b)) in pairs.filter(|(at, (a, b))| counts(*at) && a.is_finite() && b.is_finite()) {
            errors.push((a - b).abs());
            size = size.max(b.abs());
        }
    }
    errors.sort_by(f64::total_cmp);
    let at = (errors.len() as f64 * (1.0 - WORST)) as usize;
    let error = errors.get(at.min(errors.len().saturating_sub(1))).copied().unwrap_or(0.0);
    digits_lost(size + error, size)
}
