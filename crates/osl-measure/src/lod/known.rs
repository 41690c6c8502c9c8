//! What is known of the original at each footprint in each set of points, and whether something else may
//! replace it there.
//!
//! This module must not know what a level is made of.

use super::judge::{Judge, Set, Truth, Variant};
use super::off::{Fault, Off};
use osl_exec::RunError;

/// What is known of a footprint in one of the sets.
pub(super) struct FootprintErrors {
    pub(super) truth: Truth,
    /// The errors of the original with the number of samples that a level must match.
    pub(super) original: Off,
}

/// What is known of a footprint: on the points that were held out, on those on which levels are made, and in
/// the given image.
pub(super) struct Sets {
    pub(super) held: FootprintErrors,
    pub(super) fitted: FootprintErrors,
    pub(super) home: FootprintErrors,
}

impl Sets {
    pub(super) fn footprint(&self) -> f64 {
        self.held.truth.footprint
    }

    fn all(&self) -> [&FootprintErrors; 3] {
        [&self.held, &self.fitted, &self.home]
    }
}

/// What is known of all footprints.
pub(super) struct Known {
    pub(super) sets: Vec<Sets>,
    pub(super) tolerance: f64,
}

/// The errors of something else in all sets of some footprints, or the first test that it fails.
pub(super) type Verdict = Result<Vec<Off>, Fault>;

impl Known {
    /// Measures the original.
    pub(super) fn of(
        (judge, original): (&Judge<'_>, &Variant),
        footprints: &[f64],
        (samples, tolerance): (u32, f64),
    ) -> Result<Known, RunError> {
        let one = |footprint: f64, set: Set| {
            let truth = judge.truth(original, footprint, set)?;
            let original = judge.off(original, &truth, samples)?;
            Ok(FootprintErrors { truth, original })
        };
        let all = |footprint: &f64| {
            Ok(Sets {
                held: one(*footprint, Set::HeldOut)?,
                fitted: one(*footprint, Set::Fitted)?,
                home: one(*footprint, Set::Home)?,
            })
        };
        let sets: Result<Vec<Sets>, RunError> = footprints.iter().map(all).collect();
        Ok(Known { sets: sets?, tolerance })
    }

    /// The errors of the original at the footprints from one on and below another, in the order of a verdict.
    pub(super) fn originals(&self, from: f64, to: f64) -> Vec<Off> {
        let sets = self.between(from, to);
        sets.flat_map(|sets| sets.all().map(|known| known.original.clone())).collect()
    }

    fn between(&self, from: f64, to: f64) -> impl Iterator<Item = &Sets> {
        self.sets.iter().filter(move |sets| sets.footprint() >= from && sets.footprint() < to)
    }

    /// Whether something with these errors may replace the original at the footprints from one on and below
    /// another. `alone` is something that never runs the original.
    pub(super) fn verdict(
        &self,
        errors: &mut dyn FnMut(&FootprintErrors) -> Result<Off, RunError>,
        ((from, to), alone): ((f64, f64), bool),
    ) -> Result<Verdict, RunError> {
        // Far away, an output may look unchanged because no pixel's centre lies on an object.
        let near = match self.sets.first().filter(|_| alone) {
            Some(sets) => Some(errors(&sets.home)?.changed(&sets.home.original)),
            None => None,
        };
        let mut offs = Vec::new();
        for sets in self.between(from, to) {
            let (tolerance, footprint) = (self.tolerance, sets.footprint());
            let held = errors(&sets.held)?;
            if let Some(fault) = held.fault(&sets.held.original, (tolerance, footprint)) {
                return Ok(Err(fault));
            }
            let fitted = errors(&sets.fitted)?;
            if let Some(fault) = fitted.fault(&sets.fitted.original, (tolerance, footprint)) {
                return Ok(Err(fault));
            }
            let home = errors(&sets.home)?;
            let changed = near.clone().unwrap_or_else(|| home.changed(&sets.home.original));
            let elsewhere = [&held, &sets.held.original];
            let fault = home.fault_at_home(&sets.home.original, elsewhere, (tolerance, footprint, &changed));
            if let Some(fault) = fault {
                return Ok(Err(fault));
            }
            offs.extend([held, fitted, home]);
        }
        Ok(Ok(offs))
    }
}
