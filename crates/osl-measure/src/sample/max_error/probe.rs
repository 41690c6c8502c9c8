//! Probes: shader results at random positions, compared with the lattice.
//!
//! A probe is a pixel's first sample, which may lie anywhere in the pixel. Where the image is smooth, the
//! lattice is right at these positions too, not only at pixel centres. Some of the probes fail where the
//! lattice is too coarse or where the shader varies within a pixel.

use super::policy::{BELOW_FAILED, CLOSE, EVIDENCE, FEW};
use super::{Work, above};
use crate::sample::bounds::weighted;
use crate::sample::oracle::some_pixels;
use crate::sample::pattern::hash;
use osl_exec::RunError;

/// Samples for a pixel whose probe failed: the mean of the pixel may still be right.
const SECOND_LOOK: u32 = 32;
/// Standard errors added to the mean of a second look. They assume independent samples; the actual error is
/// smaller.
const DOUBT: f32 = 0.5;
/// In place of an error that was not computed yet.
const UNKNOWN: f32 = -1.0;
/// At most one in so many probes may get a second look.
const SECOND_LOOKS: usize = 50;

/// First samples of pixels.
#[derive(Default)]
pub(super) struct Probes {
    /// Pixel numbers within the band.
    pub(super) pixels: Vec<u32>,
    /// Positions of the samples, in pixels.
    places: Vec<[f32; 2]>,
    /// For each plane, the values at these positions.
    pub(super) values: Vec<Vec<f32>>,
}

/// An estimated error and the actual error.
pub(super) type ErrorPair = (f32, f32);

impl Probes {
    /// The number of probes.
    pub(super) fn count(&self) -> usize {
        self.pixels.len()
    }

    /// The probes at pending pixels.
    pub(super) fn open(&self, pending: &[bool]) -> Vec<usize> {
        (0..self.pixels.len()).filter(|slot| pending[self.pixels[*slot] as usize]).collect()
    }

    /// Makes the pixels around a probe pending again, up to `reach` along each axis.
    pub(super) fn reopen(&self, slot: usize, width: usize, reach: usize, pending: &mut [bool]) {
        let pixel = self.pixels[slot] as usize;
        let (x, y) = (pixel % width, pixel / width);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
        for row in pending.chunks_mut(width).take(y + reach + 1).skip(y.saturating_sub(reach)) {
            row[columns.clone()].fill(true);
        }
    }

    /// The pixels that a lattice needs at some probes, some of them several times.
    pub(super) fn stencils(&self, work: &Work<'_, '_>, slots: &[usize], step: usize) -> Vec<u32> {
        let mut needed = Vec::new();
        for pixel in slots.iter().map(|slot| self.pixels[*slot] as usize) {
            work.around([pixel % work.width, pixel / work.width], step, |pixel| needed.push(pixel as u32));
        }
        needed
    }
}

impl Work<'_, '_> {
    /// Probes at `wanted` more pixels.
    pub(super) fn probe(&mut self, probes: &mut Probes, wanted: usize) -> Result<(), RunError> {
        let seed = hash(self.first ^ 0x9110 ^ probes.count() as u32);
        let chosen = some_pixels(self.known.len(), wanted, seed);
        if chosen.is_empty() {
            return Ok(());
        }
        let found = self.shading.firsts(&self.in_image(&chosen), &mut self.said)?;
        self.evaluations += chosen.len() as u64;
        probes.places.extend(chosen.iter().map(|pixel| self.place(*pixel, 0)));
        probes.pixels.extend(chosen);
        probes.values.resize(found.len(), Vec::new());
        probes.values.iter_mut().zip(found).for_each(|(values, found)| values.extend(found));
        Ok(())
    }

    /// The position of a pixel's sample within the band.
    fn place(&self, pixel: u32, sample: usize) -> [f32; 2] {
        let pixel_place = [pixel as usize % self.width, pixel as usize / self.width].map(|x| x as f32);
        let own = self.shading.pattern.of(pixel + self.first).get(sample).copied().unwrap_or([0.5; 2]);
        let offset = own.map(|s| self.shading.filter.place(s).0);
        [pixel_place[0] + offset[0], pixel_place[1] + offset[1]]
    }

    /// Judges a lattice at some probes: for each, the estimated and the actual error. `curvature` gives the
    /// estimate of the cell that contains a pixel.
    pub(super) fn judge(
        &mut self,
        probes: &Probes,
        slots: &[usize],
        step: usize,
        curvature: impl Fn(&Self, [usize; 2]) -> f32,
    ) -> Result<Vec<ErrorPair>, RunError> {
        let errors = self.errors(probes, slots, step)?;
        let estimate = |slot: &usize| {
            let pixel = probes.pixels[*slot] as usize;
            curvature(self, [pixel % self.width, pixel / self.width])
        };
        Ok(slots.iter().map(estimate).zip(errors).collect())
    }

    /// The errors of a lattice at some probes. Those of a lattice that was computed as a whole are kept.
    pub(super) fn errors(
        &mut self,
        probes: &Probes,
        slots: &[usize],
        step: usize,
    ) -> Result<Vec<f32>, RunError> {
        let mut errors: Vec<f32> = match self.kept(step).map(|kept| std::mem::take(&mut kept.errors)) {
            None => slots.iter().map(|slot| self.error(probes, *slot, step)).collect(),
            Some(mut kept) => {
                kept.resize(probes.count(), UNKNOWN);
                let known = |slot: &usize| {
                    if kept[*slot] == UNKNOWN {
                        kept[*slot] = self.error(probes, *slot, step);
                    }
                    kept[*slot]
                };
                let errors = slots.iter().map(known).collect();
                if let Some(own) = self.kept(step) {
                    own.errors = kept;
                }
                errors
            }
        };
        let failed: Vec<usize> =
            (0..slots.len()).filter(|at| above(errors[*at], CLOSE * self.wanted.error)).collect();
        if failed.len() * SECOND_LOOKS <= slots.len() {
            let pixels: Vec<u32> = failed.iter().map(|at| probes.pixels[slots[*at]]).collect();
            for (at, error) in failed.iter().zip(self.look_again(&pixels, step)?) {
                // The mean of many samples is known so well that it needs no margin.
                errors[*at] = CLOSE * (error + self.blurred(probes.pixels[slots[*at]] as usize, step));
            }
        }
        Ok(errors)
    }

    /// The error of a lattice at a probe.
    fn error(&self, probes: &Probes, slot: usize, step: usize) -> f32 {
        let (pixel, place) = (probes.pixels[slot] as usize, probes.places[slot]);
        let off = |((values, seen), weight): ((&Vec<f32>, &Vec<f32>), f32)| {
            weighted(distance(self.at(values, place, step), seen[slot]), weight)
        };
        let planes = self.values.iter().zip(&probes.values).zip(self.weights.iter());
        planes.map(off).fold(0.0, f32::max) + self.blurred(pixel, step)
    }

    /// How many of some probes have another value than the centre of their pixel, by more than the bound.
    pub(super) fn uneven(&self, probes: &Probes, slots: &[usize]) -> usize {
        let is_uneven = |slot: &&usize| {
            let pixel = probes.pixels[**slot] as usize;
            let planes = self.values.iter().zip(&probes.values).zip(self.weights.iter());
            let mut off = planes
                .map(|((values, seen), weight)| weighted(distance(values[pixel], seen[**slot]), weight));
            off.any(|off| above(off, CLOSE * self.wanted.error))
        };
        slots.iter().filter(is_uneven).count()
    }

    /// Distance between the mean over a pixel and its centre, from the curvature of the lattice: half the
    /// filter's variance times the second derivatives.
    fn blurred(&self, pixel: usize, step: usize) -> f32 {
        let (x, y) = (pixel % self.width / step * step, pixel / self.width / step * step);
        let one = |plane: &Vec<f32>| {
            let second = |at: usize, size: usize, along: usize| {
                let inside = at >= step && at + step < size;
                let here = y * self.width + x;
                if inside { plane[here - along] - 2.0 * plane[here] + plane[here + along] } else { 0.0 }
            };
            let both = second(x, self.width, step) + second(y, self.height, step * self.width);
            0.5 * self.spread * both.abs() / (step * step) as f32
        };
        let planes = self.values.iter().zip(self.weights.iter());
        let blurs = planes.map(|(plane, weight)| weighted(one(plane), weight));
        blurs.filter(|blur| blur.is_finite()).fold(0.0, f32::max)
    }

    /// Takes more samples of some pixels and returns how far their means are from the lattice, plus the
    /// uncertainty of these means.
    fn look_again(&mut self, pixels: &[u32], step: usize) -> Result<Vec<f32>, RunError> {
        if pixels.is_empty() {
            return Ok(Vec::new());
        }
        let all: Vec<u32> = pixels.iter().map(|pixel| pixel + self.first).collect();
        let samples = SECOND_LOOK.min(self.shading.pattern.count());
        let seen = self.shading.samples(&all, 0..samples, &mut self.said)?;
        self.evaluations += u64::from(samples) * pixels.len() as u64;
        let mut worst = vec![0.0_f32; pixels.len()];
        for ((seen, values), weight) in seen.iter().zip(&self.values).zip(self.weights.iter()) {
            for ((worst, seen), pixel) in worst.iter_mut().zip(seen.chunks(samples as usize)).zip(pixels) {
                let (mut sum, mut squares) = (0.0_f32, 0.0_f32);
                for (sample, value) in seen.iter().enumerate() {
                    let off = value - self.at(values, self.place(*pixel, sample), step);
                    (sum, squares) = (sum + off, squares + off * off);
                }
                let n = samples as f32;
                let mean = sum / n;
                let spread = ((squares / n - mean * mean).max(0.0) / n).sqrt();
                let error = if mean.is_nan() { f32::INFINITY } else { mean.abs() + DOUBT * spread };
                *worst = worst.max(weighted(error, weight));
            }
        }
        Ok(worst)
    }
}

/// Error beyond rounding. Zero if the reference is NaN or infinite, since more samples cannot help.
pub(super) fn distance(value: f32, truth: f32) -> f32 {
    let distance = (value - truth).abs() - f32::EPSILON * truth.abs();
    match (truth.is_finite(), distance.is_nan()) {
        (false, _) => 0.0,
        (true, true) => f32::INFINITY,
        (true, false) => distance.max(0.0),
    }
}

/// Share of the probes that a lattice must settle, and the share of those that may be wrong.
const SOME: f32 = 0.15;
const PASSED_OVER: f32 = 0.002;

/// The limit at which nothing is trusted.
pub(super) const NEVER: f32 = -1.0;

/// How far a lattice is trusted.
#[derive(Debug, PartialEq)]
pub(super) struct Trust {
    /// The largest trusted estimate.
    pub(super) limit: f32,
    /// Probes with a trusted estimate.
    pub(super) good: usize,
    /// Trusted probes that failed.
    pub(super) passed_over: usize,
    /// All probes that failed.
    pub(super) failed: usize,
}

/// The largest estimate at which a lattice is trusted: `most`, or more with enough evidence, such that at
/// most `spare` trusted probes fail.
pub(super) fn trust(tried: &[ErrorPair], bound: f32, most: f32, spare: usize) -> Trust {
    let mut failed: Vec<f32> =
        tried.iter().filter(|(_, error)| above(*error, CLOSE * bound)).map(|(e, _)| *e).collect();
    failed.sort_by(f32::total_cmp);
    let trust = |spare: usize| {
        let safe = BELOW_FAILED * failed.get(spare).copied().unwrap_or(f32::INFINITY);
        let beyond = tried.iter().map(|(e, _)| *e).filter(|e| e.is_finite() && *e >= most && *e <= safe);
        let (count, furthest) = beyond.fold((0, most), |(n, far), e| (n + 1, far.max(e)));
        let limit = if count >= EVIDENCE { furthest } else { safe.min(most) };
        let good = tried.iter().filter(|(e, _)| *e <= limit).count();
        let passed_over = failed.iter().filter(|e| **e <= limit).count();
        Trust { limit, good, passed_over, failed: failed.len() }
    };
    let enough = |trust: &Trust| {
        let few = trust.good < FEW.max((SOME * tried.len() as f32) as usize);
        !few && trust.limit > 0.0 && trust.passed_over as f32 <= PASSED_OVER * trust.good as f32
    };
    let found = (0..=spare.min(failed.len())).rev().map(trust).find(enough);
    found.unwrap_or(Trust { limit: NEVER, good: 0, passed_over: 0, failed: failed.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_ends_below_the_best_peek_that_failed() {
        let all =
            |estimate: f32| (0..40).map(|i| (estimate + 0.01 * i as f32, 0.1)).collect::<Vec<ErrorPair>>();
        let never = |failed| Trust { limit: NEVER, good: 0, passed_over: 0, failed };
        let mut tried = all(0.1);
        tried[30].1 = 2.0;
        let found = trust(&tried, 1.0, 1.0, 0);
        assert!((found.limit - 0.36).abs() < 1e-6 && found.good == 26, "nine tenths of 0.4: {found:?}");
        assert_eq!(trust(&tried, 1.0, 1.0, 1), found, "one of so few is too many");
        let mut many: Vec<ErrorPair> = (0..1000).map(|i| (0.0005 * i as f32, 0.1)).collect();
        many[500].1 = 2.0;
        let spared = trust(&many, 1.0, 1.0, 1);
        assert_eq!(spared, Trust { limit: 1.0, good: 1000, passed_over: 1, failed: 1 });
        let found = trust(&all(0.1), 1.0, 0.25, 0);
        assert_eq!((found.limit, found.good), (0.25, 16), "never beyond what is trusted anyway");
        tried[0] = (0.0, 5.0);
        assert_eq!(trust(&tried, 1.0, 1.0, 0), never(2), "an estimate of 0 that fails is worth nothing");
        let mut lucky = all(0.1);
        lucky.iter_mut().skip(10).for_each(|one| one.1 = 2.0);
        assert_eq!(trust(&lucky, 1.0, 1.0, 0), never(30), "a few that did not fail are no evidence");
    }
}
