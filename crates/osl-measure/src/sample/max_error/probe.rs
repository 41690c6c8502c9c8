//! Probes: shader results at random positions, compared with the lattice.
//!
//! A probe is a pixel's first sample, which may lie anywhere in the pixel. Where the image is smooth, the
//! lattice is right at these positions too, not only at pixel centres. Some of the probes fail where the
//! lattice is too coarse or where the shader varies within a pixel.

use super::policy::{CLOSE, COARSE, EVIDENCE, FEW, SECOND_LOOKS, SURE_PROBES};
use super::{Work, above};
use crate::sample::error::{Block, weighted};
use crate::sample::image::{Cheaper, Shading};
use crate::sample::oracle::some_pixels;
use crate::sample::pattern::hash;
use osl_exec::RunError;
use rayon::prelude::*;

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

/// The error of a lattice at a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ProbeError {
    pub(super) error: f32,
    /// How many pixels whose error is as large a probe stands for. A feature that covers a tenth of its pixel
    /// is seen by one probe in ten.
    pub(super) stands_for: f32,
}

/// An estimated error, and the error at a probe.
pub(super) type Tried = (f32, ProbeError);

impl Probes {
    /// The number of probes.
    pub(super) fn count(&self) -> usize {
        self.pixels.len()
    }

    /// The probes at pending pixels.
    pub(super) fn open(&self, pending: &[bool]) -> Vec<usize> {
        (0..self.pixels.len()).filter(|slot| pending[self.pixels[*slot] as usize]).collect()
    }

    /// Makes the pixels around a probe pending again.
    pub(super) fn reopen(&self, slot: usize, width: usize, pending: &mut [bool]) {
        let reach = COARSE;
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
        probes.places.extend(chosen.iter().flat_map(|pixel| self.places(*pixel, 1)));
        probes.pixels.extend(chosen);
        probes.values.resize(found.len(), Vec::new());
        probes.values.iter_mut().zip(found).for_each(|(values, found)| values.extend(found));
        Ok(())
    }

    /// The positions of the first samples of a pixel within the band.
    fn places(&self, pixel: u32, samples: usize) -> impl Iterator<Item = [f32; 2]> + '_ {
        let pixel_place = [pixel as usize % self.width, pixel as usize / self.width].map(|x| x as f32);
        let own = self.shading.pattern.of(pixel + self.first).iter().copied();
        own.chain(std::iter::repeat([0.5; 2])).take(samples).map(move |sample| {
            let [x, y] = sample.map(|s| self.shading.filter.place(s).0);
            [pixel_place[0] + x, pixel_place[1] + y]
        })
    }

    /// Judges a lattice at some probes: for each, the estimated and the actual error. `curvature` gives the
    /// estimate of the cell that contains a pixel.
    pub(super) fn judge(
        &mut self,
        probes: &Probes,
        slots: &[usize],
        step: usize,
        curvature: impl Fn(&Self, [usize; 2]) -> f32,
    ) -> Result<Vec<Tried>, RunError> {
        let errors = self.errors(probes, slots, step)?;
        let estimate = |slot: &usize| {
            let pixel = probes.pixels[*slot] as usize;
            curvature(self, [pixel % self.width, pixel / self.width])
        };
        Ok(slots.iter().map(estimate).zip(errors).collect())
    }

    /// The errors of a lattice at some probes.
    fn errors(&mut self, probes: &Probes, slots: &[usize], step: usize) -> Result<Vec<ProbeError>, RunError> {
        let one = |slot: &usize| ProbeError { error: self.error(probes, *slot, step), stands_for: 1.0 };
        let mut errors: Vec<ProbeError> = slots.par_iter().with_min_len(512).map(one).collect();
        let failed: Vec<usize> = (0..slots.len()).filter(|at| self.is_wrong(&errors[*at])).collect();
        let mut kinds = SECOND_LOOKS.iter().take(if step == 1 { 2 } else { 1 });
        let kind = kinds.find(|(one_in, _)| failed.len() * one_in <= slots.len());
        if let Some((_, samples)) = kind.filter(|_| !failed.is_empty()) {
            let again: Vec<u32> = failed.iter().map(|at| probes.pixels[slots[*at]]).collect();
            for (at, found) in failed.iter().zip(self.look_again(&again, *samples, step)?) {
                errors[*at] = found;
            }
        }
        Ok(errors)
    }

    /// Whether a lattice is wrong at a probe.
    pub(super) fn is_wrong(&self, own: &ProbeError) -> bool {
        above(own.error, CLOSE * self.wanted.error)
    }

    /// The error of a lattice at a probe.
    fn error(&self, probes: &Probes, slot: usize, step: usize) -> f32 {
        let (pixel, place) = (probes.pixels[slot] as usize, probes.places[slot]);
        let spot = self.spot(place, step);
        let off = |((values, seen), weight): ((&Vec<f32>, &Vec<f32>), f32)| {
            weighted(distance(spot.of(values), seen[slot]), weight)
        };
        let planes = self.values.iter().zip(&probes.values).zip(self.weights.iter());
        planes.map(off).fold(0.0, f32::max) + self.blurred(pixel, step)
    }

    /// How far the mean over a pixel is from its centre, from the curvature of the lattice: half the filter's
    /// variance times the second derivatives. The largest over the planes.
    fn blurred(&self, pixel: usize, step: usize) -> f32 {
        let planes = self.values.iter().zip(self.weights.iter());
        let blurs = planes.map(|(plane, weight)| weighted(self.blur(plane, pixel, step).abs(), weight));
        blurs.fold(0.0, f32::max)
    }

    /// The same for one plane, with its sign; 0 if it is not finite.
    fn blur(&self, plane: &[f32], pixel: usize, step: usize) -> f32 {
        let (x, y) = (pixel % self.width / step * step, pixel / self.width / step * step);
        let second = |at: usize, size: usize, along: usize| {
            let inside = at >= step && at + step < size;
            let here = y * self.width + x;
            if inside { plane[here - along] - 2.0 * plane[here] + plane[here + along] } else { 0.0 }
        };
        let both = second(x, self.width, step) + second(y, self.height, step * self.width);
        let blur = 0.5 * self.spread * both / (step * step) as f32;
        if blur.is_finite() { blur } else { 0.0 }
    }

    /// Takes more samples of some pixels. Their errors are how far their means are from the lattice, plus the
    /// uncertainty of these means. The lattice stands in for most of a sample's distance from the mean.
    fn look_again(&mut self, pixels: &[u32], samples: u32, step: usize) -> Result<Vec<ProbeError>, RunError> {
        let all: Vec<u32> = pixels.iter().map(|pixel| pixel + self.first).collect();
        let samples = samples.min(self.shading.pattern.count());
        let seen = self.shading.samples(&all, 0..samples, &mut self.said)?;
        self.evaluations += u64::from(samples) * pixels.len() as u64;
        let n = samples as f32;
        let mut found = vec![ProbeError { error: 0.0, stands_for: n }; pixels.len()];
        let mut spots = Vec::with_capacity(samples as usize);
        for (number, (found, pixel)) in found.iter_mut().zip(pixels).enumerate() {
            spots.clear();
            spots.extend(self.places(*pixel, samples as usize).map(|place| self.spot(place, step)));
            let own = number * samples as usize..(number + 1) * samples as usize;
            for ((seen, values), weight) in seen.iter().zip(&self.values).zip(self.weights.iter()) {
                let (mut sum, mut squares, mut failed) = (0.0_f32, 0.0_f32, 0.0_f32);
                for (value, spot) in seen[own.clone()].iter().zip(&spots) {
                    let off = value - spot.of(values);
                    (sum, squares) = (sum + off, squares + off * off);
                    let is_above = above(weighted(off.abs(), weight), CLOSE * self.wanted.error);
                    failed += f32::from(u8::from(is_above));
                }
                // Half a standard error is added, which assumes independent samples: the actual error is
                // smaller.
                let mean = sum / n;
                let spread = ((squares / n - mean * mean).max(0.0) / n).sqrt();
                let off = (mean + self.blur(values, *pixel as usize, step)).abs();
                let error = if mean.is_nan() { f32::INFINITY } else { off + 0.5 * spread };
                found.error = found.error.max(weighted(error, weight));
                found.stands_for = found.stands_for.min(n / failed.max(1.0));
            }
        }
        Ok(found)
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

/// The limit at which nothing is trusted.
pub(super) const NEVER: f32 = -1.0;

/// How far a lattice is trusted.
#[derive(Debug, PartialEq)]
pub(super) struct Trust {
    /// The largest trusted estimate.
    pub(super) limit: f32,
    /// Probes with a trusted estimate.
    pub(super) good: usize,
    /// How many probes the trusted probes that failed stand for.
    pub(super) passed_over: f32,
    /// All probes that failed.
    pub(super) failed: usize,
}

/// The largest estimate at which a lattice is trusted: `most`, or more with enough evidence, such that the
/// trusted probes that fail stand for at most `spare`.
pub(super) fn trust(tried: &[Tried], bound: f32, most: f32, spare: f32) -> Trust {
    let is_failed = |one: &&Tried| above(one.1.error, CLOSE * bound);
    let mut failed: Vec<(f32, f32)> =
        tried.iter().filter(is_failed).map(|(estimate, own)| (*estimate, own.stands_for)).collect();
    failed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let trust = |spare: usize| {
        let safe = CLOSE * failed.get(spare).map_or(f32::INFINITY, |(estimate, _)| *estimate);
        let beyond = tried.iter().map(|(e, _)| *e).filter(|e| e.is_finite() && *e >= most && *e <= safe);
        let (count, furthest) = beyond.fold((0, most), |(n, far), e| (n + 1, far.max(e)));
        let limit = if count >= EVIDENCE { furthest } else { safe.min(most) };
        let good = tried.iter().filter(|(e, _)| *e <= limit).count();
        let passed_over = failed.iter().filter(|(e, _)| *e <= limit).map(|(_, stands_for)| stands_for).sum();
        Trust { limit, good, passed_over, failed: failed.len() }
    };
    let enough = |trust: &Trust| {
        let few = trust.good < FEW.max(tried.len() * 3 / 20);
        !few && trust.limit > 0.0 && trust.passed_over <= spare.min(0.002 * trust.good as f32)
    };
    let most = (spare as usize).min(failed.len());
    let found = (0..=most).rev().map(trust).find(enough);
    found.unwrap_or(Trust { limit: NEVER, good: 0, passed_over: 0.0, failed: failed.len() })
}

impl<'a> Work<'_, 'a> {
    /// Samples pending pixels in the cheaper arithmetic from here on, if there is one and it is accurate
    /// enough. The bound is then reduced by its largest error.
    pub(super) fn choose_arithmetic(&mut self, probes: &Probes, pending: &[bool]) -> Result<(), RunError> {
        let Some(program) = self.shading.cheaper else { return Ok(()) };
        let open = probes.open(pending);
        // With fewer, rare errors would be missed.
        if open.len() < SURE_PROBES / 2 {
            return Ok(());
        }
        let cheaper = Shading { program, cheaper: None, ..self.shading.clone() };
        let [weighty, largest] = self.difference(&cheaper, probes, &open)?;
        if weighty <= 0.02 * self.wanted.error {
            let pixels = pending.iter().filter(|pending| **pending).count() as u64;
            self.chosen = Some(Cheaper { compared: open.len() as u64, largest, pixels });
            self.wanted.error -= weighty;
            self.sampled = cheaper;
        }
        Ok(())
    }

    /// The largest difference between the probes and another way to run the shader: times the factor of its
    /// plane, and in the units of its output.
    fn difference(
        &mut self,
        other: &Shading<'_>,
        probes: &Probes,
        slots: &[usize],
    ) -> Result<[f32; 2], RunError> {
        let pixels: Vec<u32> = slots.iter().map(|slot| probes.pixels[*slot] + self.first).collect();
        let batch = other.batch(&pixels, 0..1)?;
        self.evaluations += pixels.len() as u64;
        let worst = |(values, blocks): (&Vec<f32>, &Vec<Block>)| {
            let one = |(slot, block): (&usize, &Block)| {
                let (value, truth) = (block.mean(), values[*slot]);
                // One is finite and the other is not: no bound holds.
                if value.is_finite() == truth.is_finite() { distance(value, truth) } else { f32::INFINITY }
            };
            slots.iter().zip(blocks).map(one).fold(0.0, f32::max)
        };
        let planes = probes.values.iter().zip(&batch.blocks).map(worst).zip(self.weights.iter());
        Ok(planes.filter(|(_, weight)| *weight > 0.0).fold(
            [0.0, 0.0],
            |[weighty, largest]: [f32; 2], (own, weight)| {
                [weighty.max(weighted(own, weight)), largest.max(own)]
            },
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_ends_below_the_best_peek_that_failed() {
        let good = ProbeError { error: 0.1, stands_for: 1.0 };
        let all = |estimate: f32| (0..40).map(|i| (estimate + 0.01 * i as f32, good)).collect::<Vec<Tried>>();
        let never = |failed| Trust { limit: NEVER, good: 0, passed_over: 0.0, failed };
        let mut tried = all(0.1);
        tried[30].1.error = 2.0;
        let found = trust(&tried, 1.0, 1.0, 0.0);
        assert!((found.limit - 0.36).abs() < 1e-6 && found.good == 26, "nine tenths of 0.4: {found:?}");
        assert_eq!(trust(&tried, 1.0, 1.0, 1.0), found, "one of so few is too many");
        let mut many: Vec<Tried> = (0..1000).map(|i| (0.0005 * i as f32, good)).collect();
        many[500].1.error = 2.0;
        let spared = trust(&many, 1.0, 1.0, 1.0);
        assert_eq!(spared, Trust { limit: 1.0, good: 1000, passed_over: 1.0, failed: 1 });
        many[500].1.stands_for = 3.0;
        let found = trust(&many, 1.0, 1.0, 1.0);
        assert!(found.limit < 0.25 && found.passed_over == 0.0, "three of its kind are too many: {found:?}");
        let found = trust(&all(0.1), 1.0, 0.25, 0.0);
        assert_eq!((found.limit, found.good), (0.25, 16), "never beyond what is trusted anyway");
        tried[0] = (0.0, ProbeError { error: 5.0, stands_for: 1.0 });
        assert_eq!(trust(&tried, 1.0, 1.0, 0.0), never(2), "an estimate of 0 that fails is worth nothing");
        let mut lucky = all(0.1);
        lucky.iter_mut().skip(10).for_each(|one| one.1.error = 2.0);
        assert_eq!(trust(&lucky, 1.0, 1.0, 0.0), never(30), "a few that did not fail are no evidence");
    }
}
