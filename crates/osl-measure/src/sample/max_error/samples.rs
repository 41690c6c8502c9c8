//! Pixels that need samples: the pilot first, then the others, each with as many as the pilot shows to be
//! enough.

use super::curvature::Curvatures;
use super::limits::StoppingRule;
use super::pilot::estimate;
use super::policy::*;
use super::probe::{NEVER, Probes};
use super::{Work, above};
use crate::sample::adapt::{Refiner, Sampled};
use crate::sample::image::{PIECES, Shading};
use osl_exec::RunError;
use pxfm::f_powf;

impl<'a> Work<'_, 'a> {
    /// The curvature of the coarsest lattice around each pixel. Pixels are numbered in the image.
    pub(super) fn guards(&self, curvatures: &Curvatures, pixels: &[u32]) -> Vec<f32> {
        let within = pixels.iter().map(|pixel| (pixel - self.first) as usize);
        within.map(|at| curvatures.at([at % self.width, at / self.width])).collect()
    }

    /// The pixels whose flag is set, with their numbers in the image.
    fn flagged(&self, flags: &[bool]) -> Vec<u32> {
        (self.first..).zip(flags).filter(|(_, flag)| **flag).map(|(pixel, _)| pixel).collect()
    }

    /// Samples the pixels that are still pending: the pilot first, then the others.
    pub(super) fn sample(&mut self, pending: &[bool], off: f32, probes: &Probes) -> Result<(), RunError> {
        let mut pixels = self.flagged(pending);
        if pixels.is_empty() {
            return Ok(());
        }
        let allowed = (ALLOWED * pending.len() as f32 - off).max(0.0) / pixels.len() as f32;
        let curvatures = self.curvatures(COARSE, pending);
        let allowed = allowed.clamp(0.5 * ALLOWED, ALLOWED_OF_FEW);
        let (pilot, steps) = self.pilot((&curvatures, probes), &pixels, allowed)?;
        self.sampled.pattern = pilot.pattern().clone();
        let mut others = pending.to_vec();
        pilot.pixels().iter().for_each(|pixel| others[(pixel - self.first) as usize] = false);
        pixels = self.flagged(&others);
        if steps.short {
            let ahead = pilot.pixels().len();
            let share = steps.failed as f64 / ahead.max(1) as f64;
            self.above = share * (ahead + pixels.len()) as f64 + f64::from(off);
            self.unfinished += self.unsure(&pilot);
        }
        self.take(pilot.done());
        for pixels in pixels.chunks(SURE_PROBES * PIECES) {
            let piece = |sampled: &Shading<'_>, pixels: &[u32]| {
                let guards = self.guards(&curvatures, pixels);
                let mut some = Refiner::new(sampled, pixels.to_vec()).with(&self.weights);
                let unfinished = self.follow(&mut some, &guards, &steps)?;
                Ok((some.done(), unfinished))
            };
            let mut found = Vec::new();
            self.sampled.side_by_side((pixels, SURE_PROBES), piece, |_, one| found.push(one))?;
            for (some, unfinished) in found {
                self.unfinished += unfinished;
                self.take(some);
            }
        }
        Ok(())
    }

    /// Takes over pixels with their means.
    fn take(&mut self, sampled: Sampled) {
        let Sampled { pixels, means, each, evaluations, said } = sampled;
        self.samples.resize(self.known.len(), 0);
        for (plane, means) in self.values.iter_mut().zip(means) {
            let pixels = pixels.iter().zip(means);
            pixels.for_each(|(pixel, mean)| plane[(pixel - self.first) as usize] = mean);
        }
        let pixels = pixels.iter().zip(each);
        pixels.for_each(|(pixel, each)| self.samples[(pixel - self.first) as usize] = each);
        self.evaluations += evaluations;
        self.said.add(said, &self.shading.options.limits.running);
    }

    /// Samples pixels with the limits that the pilot found. Returns how many need more samples than they may
    /// have.
    fn follow(
        &self,
        refiner: &mut Refiner<'_>,
        guards: &[f32],
        steps: &StoppingRule,
    ) -> Result<u64, RunError> {
        let mut unfinished = 0;
        let first = steps.limits.first().map_or(0, |(samples, _)| *samples);
        for (samples, limit) in &steps.limits {
            if refiner.active.is_empty() {
                break;
            }
            let last = *limit == f32::INFINITY;
            if *limit == NEVER {
                continue;
            }
            // The later half of the samples shows how far the earlier half was off, as in the pilot, whose
            // first round has no earlier half.
            if 2 * refiner.samples < *samples && (last || *samples > first) {
                refiner.round(samples / 2, false)?;
            }
            refiner.round(*samples, !last || steps.short)?;
            if last && steps.short {
                unfinished += self.unsure(refiner);
            }
            if !last {
                refiner.settle_by(|refiner, slot, error| {
                    estimate(error, refiner.moved[slot], guards[slot], *samples) <= *limit
                });
            }
        }
        if !steps.short {
            self.last_look(refiner, steps.power)?;
        }
        Ok(unfinished)
    }

    /// The number of pixels whose samples do not show that they are good enough: two standard errors exceed
    /// the bound.
    fn unsure(&self, refiner: &Refiner<'_>) -> u64 {
        let is_unsure = |slot: &&usize| above(2.0 * refiner.error(**slot), self.wanted.error);
        refiner.active.iter().filter(is_unsure).count() as u64
    }

    /// Takes more samples of pixels that the last half of their samples moved too far.
    fn last_look(&self, refiner: &mut Refiner<'_>, power: f32) -> Result<(), RunError> {
        let limit = last_limit(self.wanted.error, power);
        loop {
            let Refiner { active, moved, .. } = refiner;
            active.retain(|slot| moved[*slot] > limit);
            if active.is_empty() || 2 * refiner.samples > self.wanted.most {
                return Ok(());
            }
            refiner.round(2 * refiner.samples, false)?;
        }
    }
}

/// The largest change by the later half of a pixel's samples after which it needs no others. `power` is the
/// rate at which squared errors fall.
fn last_limit(bound: f32, power: f32) -> f32 {
    // Two independent halves are as far from their mean as that is from the truth; stratified ones are
    // farther.
    LAST_LOOK * bound / f_powf(0.5, 0.5 * (power - 1.0))
}
