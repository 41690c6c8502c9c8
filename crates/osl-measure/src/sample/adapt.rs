//! Adaptive sampling: each round doubles the samples of the pixels whose error is still too large.

use super::error::Weights;
use super::image::{Image, PixelSamples, Shading};
use super::pattern::{MAX_SAMPLES, Pattern};
use super::round::{Sums, put};
use osl_exec::{Frame, RunError};
use std::ops::Range;

/// Samples that every pixel gets, so that its error can be estimated.
pub(super) const FEWEST: u32 = 4;

/// When a pixel has enough samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// The permitted standard error of a pixel, in the units of the outputs; the largest over all planes
    /// counts.
    pub threshold: f32,
    /// Maximum samples per pixel; rounded down to a power of two.
    pub most: u32,
}

/// Pixels in progress: the sums of their samples, and which of them need more.
pub(super) struct Refiner<'a> {
    shading: Shading<'a>,
    pixels: Vec<u32>,
    /// Factors on the errors of the planes.
    pub(super) weights: Weights,
    /// The pixels that need more samples.
    pub(super) active: Vec<usize>,
    sums: Sums,
    /// For each pixel, the change by the last round, largest over all planes.
    pub(super) moved: Vec<f32>,
    /// For each pixel, the standard error after the last round, largest over all planes; NaN if any sample is
    /// NaN.
    errors: Vec<f32>,
    /// Samples of each active pixel so far.
    pub(super) samples: u32,
    /// Samples of each pixel.
    pub(super) each: Vec<u32>,
    pub(super) evaluations: u64,
    pub(super) said: Frame,
}

/// Pixels after their last round.
pub(super) struct Sampled {
    pub(super) pixels: Vec<u32>,
    /// For each plane, the means of the pixels.
    pub(super) means: Vec<Vec<f32>>,
    /// Samples of each pixel.
    pub(super) each: Vec<u32>,
    pub(super) evaluations: u64,
    pub(super) said: Frame,
}

impl<'a> Refiner<'a> {
    pub(super) fn new(shading: &Shading<'a>, pixels: Vec<u32>) -> Refiner<'a> {
        let planes = shading.planes().len();
        Refiner {
            shading: shading.clone(),
            weights: Weights::equal(planes),
            active: (0..pixels.len()).collect(),
            sums: Sums::new(planes, pixels.len()),
            moved: vec![0.0; pixels.len()],
            errors: vec![0.0; pixels.len()],
            samples: 0,
            each: vec![0; pixels.len()],
            pixels,
            evaluations: 0,
            said: Frame::default(),
        }
    }

    /// The same with factors on the errors of the planes.
    #[must_use]
    pub(super) fn with(self, weights: &Weights) -> Refiner<'a> {
        Refiner { weights: weights.clone(), ..self }
    }

    /// Brings the active pixels to `samples`, a power of two and at least twice their current number. Without
    /// `estimate`, their errors are unknown afterwards.
    pub(super) fn round(&mut self, samples: u32, estimate: bool) -> Result<(), RunError> {
        if self.shading.pattern.count() < samples {
            self.shading.pattern = self.shading.pattern.clone().with(samples);
        }
        let Refiner { shading, pixels, active, sums, moved, errors, each, weights, said, .. } = self;
        let rounds = (self.samples..samples, estimate);
        shading.round((pixels, active), rounds, (sums, weights), said, |slots, found| {
            put(slots, &found.moved, moved);
            put(slots, &found.errors, errors);
            slots.iter().for_each(|slot| each[*slot] = samples);
        })?;
        self.evaluations += self.active.len() as u64 * u64::from(samples - self.samples);
        self.samples = samples;
        Ok(())
    }

    /// Largest standard error over a pixel's planes; NaN if any sample is NaN.
    pub(super) fn error(&self, slot: usize) -> f32 {
        self.errors.get(slot).copied().unwrap_or(0.0)
    }

    /// Removes the pixels that have enough samples from the active list; `enough` gets a pixel's slot and its
    /// error. Pixels with a NaN error are removed too, since more samples cannot help.
    pub(super) fn settle(&mut self, enough: impl Fn(usize, f32) -> bool) {
        self.settle_by(|_, slot, error| enough(slot, error));
    }

    /// The same for a decision that needs more of the pixel than its error.
    pub(super) fn settle_by(&mut self, enough: impl Fn(&Refiner<'a>, usize, f32) -> bool) {
        let mut active = std::mem::take(&mut self.active);
        active.retain(|slot| {
            let error = self.error(*slot);
            error.is_finite() && !enough(self, *slot, error)
        });
        self.active = active;
    }

    /// The pattern of the samples, as long as it was needed.
    pub(super) fn pattern(&self) -> &Pattern {
        &self.shading.pattern
    }

    /// The pixels, in the order of the sums.
    pub(super) fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// The pixels as they are now.
    pub(super) fn done(self) -> Sampled {
        let means = self.means();
        let Refiner { pixels, each, evaluations, said, .. } = self;
        Sampled { pixels, means, each, evaluations, said }
    }

    /// For each plane, the means of the pixels.
    pub(super) fn means(&self) -> Vec<Vec<f32>> {
        self.sums.means(&self.each)
    }
}

/// Renders some rows of an image with as many samples per pixel as its error requires: powers of two from 4.
/// Neighbours may have hit a feature that the pixel's own samples missed. So the deviation of a pixel from
/// the line between its neighbours, divided by its sample count, also counts as its error.
///
/// # Errors
/// A loop exceeds its budget.
pub fn adaptive(shading: &Shading<'_>, rows: Range<usize>, wanted: Adaptive) -> Result<Image, RunError> {
    let pixels = shading.pixels(rows);
    let most = power_below(wanted.most);
    let width = shading.surface.size().0;
    let mut refiner = Refiner::new(shading, pixels);
    let mut guard = Vec::new();
    for samples in rounds(FEWEST.min(most), most) {
        if refiner.active.is_empty() {
            break;
        }
        refiner.round(samples, true)?;
        if guard.is_empty() {
            guard = curvatures(&refiner.means(), width);
        }
        let hidden = |slot: usize| guard.get(slot).copied().unwrap_or(0.0) / (2 * samples) as f32;
        refiner.settle(|slot, error| error.max(hidden(slot)) <= wanted.threshold);
    }
    Ok(image(shading, refiner))
}

/// Sample counts, each twice the one before.
pub(super) fn rounds(first: u32, most: u32) -> impl Iterator<Item = u32> {
    std::iter::successors(Some(first), |n| n.checked_mul(2)).take_while(move |n| *n <= most)
}

/// The largest power of two that is at most `samples`, within the size of the patterns.
pub(super) fn power_below(samples: u32) -> u32 {
    1 << samples.clamp(1, MAX_SAMPLES).ilog2()
}

fn image(shading: &Shading<'_>, refiner: Refiner<'_>) -> Image {
    let unfinished = refiner.active.len() as u64;
    let Sampled { pixels, means, each, evaluations, said } = refiner.done();
    let mut image = shading.image(means, said, (pixels.len(), evaluations));
    image.tally.note_all(each.iter().copied());
    image.tally.unfinished = unfinished;
    Image { samples: PixelSamples::Each(each), ..image }
}

/// The distance of each pixel from the line between its neighbours, left and right or above and below; 0 at
/// the borders.
fn curvatures(planes: &[Vec<f32>], width: usize) -> Vec<f32> {
    let count = planes.first().map_or(0, Vec::len);
    let mut curvatures = vec![0.0_f32; count];
    for plane in planes {
        for (at, curvature) in curvatures.iter_mut().enumerate() {
            let x = at % width.max(1);
            let here = 2.0 * plane[at];
            if x > 0 && x + 1 < width {
                *curvature = curvature.max((plane[at - 1] - here + plane[at + 1]).abs());
            }
            if at >= width && at + width < count {
                *curvature = curvature.max((plane[at - width] - here + plane[at + width]).abs());
            }
        }
    }
    curvatures
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_has_no_bend_and_an_edge_has() {
        let plane: Vec<f32> = (0..15).map(|i| (i % 5) as f32 + 3.0 * (i / 5) as f32).collect();
        assert!(curvatures(&[plane], 5).iter().all(|b| b.abs() < 1e-6));
        let edge: Vec<f32> = (0..5).map(|i| if i < 2 { 0.0 } else { 1.0 }).collect();
        assert_eq!(curvatures(&[edge], 5), [0.0, 1.0, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn numbers_of_samples_are_powers_of_two() {
        assert_eq!(rounds(4, power_below(100)).collect::<Vec<_>>(), [4, 8, 16, 32, 64]);
        assert_eq!(rounds(1, power_below(0)).collect::<Vec<_>>(), [1]);
        assert_eq!(power_below(u32::MAX), MAX_SAMPLES);
    }
}
