//! Reference values of pixels from many samples, and the error of an image against them.

use super::error::Block;
use super::image::{Image, Shading};
use super::pattern::{MAX_SAMPLES, Pattern, hash};
use osl_exec::{Frame, RunError};

/// Reference values of some pixels, with their standard errors.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    /// The pixels.
    pub pixels: Vec<u32>,
    /// Samples of each.
    pub samples: u32,
    /// For each plane, the values of the pixels.
    pub values: Vec<Vec<f32>>,
    /// For each plane, the standard errors, from the difference between the two halves of the samples. They
    /// are right on average over many pixels, whatever the rate of convergence.
    pub errors: Vec<Vec<f32>>,
    /// Messages of the program.
    pub said: Frame,
}

/// Computes reference values of pixels from many samples, rounded up to a power of two. None of the samples
/// is used by the image, and the two halves are independent.
///
/// # Errors
/// A loop exceeds its budget.
pub fn oracle(shading: &Shading<'_>, pixels: &[u32], samples: u32) -> Result<Oracle, RunError> {
    let samples = samples.clamp(2, MAX_SAMPLES).next_power_of_two();
    let half = |seed: u32| {
        let own = Shading { pattern: Pattern::new(samples / 2, seed), ..shading.clone() };
        own.batch(pixels, 0..samples / 2)
    };
    let (first, second) = (half(0x5eed)?, half(0xd15c)?);
    let both = |of: fn(f64, f64) -> f64| {
        let plane = |(a, b): (&Vec<Block>, &Vec<Block>)| {
            a.iter().zip(b).map(|(a, b)| of(a.sum / a.weight, b.sum / b.weight) as f32).collect()
        };
        first.blocks.iter().zip(&second.blocks).map(plane).collect()
    };
    let (values, errors) = (both(|a, b| 0.5 * (a + b)), both(|a, b| 0.5 * (a - b).abs()));
    let mut said = first.said;
    said.add(second.said, &shading.options.limits.running);
    Ok(Oracle { pixels: pixels.to_vec(), samples, values, errors, said })
}

/// The error of an image at the compared pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Check {
    /// Pixels that were compared.
    pub pixels: u64,
    /// Pixels whose error exceeds the requested bound of a plane by more than the oracle's standard error and
    /// the rounding of single precision.
    pub above: u64,
    /// Root mean square error, with the oracle's own error subtracted.
    pub rmse: f64,
    /// The 99.9th percentile of the error, largest over the planes, minus the oracle's standard error.
    pub nearly_all: f64,
    /// The largest error.
    pub largest: f64,
    /// Root mean square of the oracle's standard error.
    pub oracle: f64,
    /// Pixels that got more samples from the oracle than the others, because they may exceed a bound.
    pub again: u64,
}

impl Oracle {
    /// Replaces the values of some pixels by those of another oracle. `slots` are their positions here.
    fn replace(&mut self, slots: &[usize], with: &Oracle) {
        let all = self.values.iter_mut().zip(&with.values).chain(self.errors.iter_mut().zip(&with.errors));
        for (own, with) in all {
            for (slot, value) in slots.iter().zip(with) {
                if let Some(own) = own.get_mut(*slot) {
                    *own = *value;
                }
            }
        }
    }

    /// How far a value is off: the error, the oracle's standard error, and their difference without the
    /// rounding of single precision. `None` if the oracle does not know.
    fn off(&self, plane: usize, at: usize, value: f32) -> Option<[f64; 3]> {
        let pick =
            |list: &[Vec<f32>]| list.get(plane).and_then(|p| p.get(at)).copied().map_or(f64::NAN, f64::from);
        let (truth, uncertain) = (pick(&self.values), pick(&self.errors));
        if !truth.is_finite() || !uncertain.is_finite() {
            return None;
        }
        let error = (f64::from(value) - truth).abs();
        let error = if error.is_nan() { f64::INFINITY } else { error };
        Some([error, uncertain, error - uncertain - f64::from(f32::EPSILON) * truth.abs()])
    }
}

/// Compares planes with an oracle. `limits` are the bounds of the planes, infinite where there are none.
/// `position` maps a pixel to its index in the planes.
pub fn check(planes: &[Vec<f32>], oracle: &Oracle, limits: &[f64], position: impl Fn(u32) -> usize) -> Check {
    let mut found = Check::default();
    let (mut squares, mut own, mut count) = (0.0, 0.0, 0.0_f64);
    let mut errors = Vec::with_capacity(oracle.pixels.len());
    for (at, pixel) in oracle.pixels.iter().enumerate() {
        let mut worst = 0.0_f64;
        let (mut usable, mut is_above) = (true, false);
        for (at_plane, plane) in planes.iter().enumerate() {
            let value = plane.get(position(*pixel)).copied().unwrap_or(f32::NAN);
            let Some([error, uncertain, sure]) = oracle.off(at_plane, at, value) else {
                usable = false;
                continue;
            };
            squares += error * error;
            own += uncertain * uncertain;
            count += 1.0;
            worst = worst.max(sure);
            is_above |= limits.get(at_plane).is_some_and(|limit| sure > *limit);
        }
        if usable {
            errors.push(worst);
            found.above += u64::from(is_above);
        }
    }
    found.pixels = errors.len() as u64;
    errors.sort_by(f64::total_cmp);
    let last = errors.len().saturating_sub(1);
    let quantile = (errors.len() as f64 * 0.999).ceil() as usize;
    found.nearly_all = errors.get(quantile.saturating_sub(1).min(last)).copied().unwrap_or(0.0);
    found.largest = errors.last().copied().unwrap_or(0.0);
    found.oracle = (own / count.max(1.0)).sqrt();
    found.rmse = (squares / count.max(1.0) - own / count.max(1.0)).max(0.0).sqrt();
    found
}

/// Some of `count` pixels, in ascending order: spread at random, but the same on every call.
pub(crate) fn some_pixels(count: usize, wanted: usize, seed: u32) -> Vec<u32> {
    if wanted >= count {
        return (0..count as u32).collect();
    }
    let stretch = |i: usize| (i as u64 * count as u64 / wanted as u64) as u32;
    let pick = |i: usize| {
        let (from, to) = (stretch(i), stretch(i + 1));
        from + hash(i as u32 ^ seed) % (to - from).max(1)
    };
    (0..wanted).map(pick).collect()
}

/// Randomly chosen pixels of an image, to be compared with an oracle once the image is done.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    pixels: Vec<u32>,
    /// How many of them have their values so far.
    noted: usize,
    values: Vec<Vec<f32>>,
}

impl Watch {
    /// Watches `wanted` of the `count` pixels of an image.
    pub fn new(count: usize, wanted: usize) -> Watch {
        Watch { pixels: some_pixels(count, wanted, 0xc4ec), noted: 0, values: Vec::new() }
    }

    /// The pixels, in order.
    pub fn pixels(&self) -> &[u32] {
        &self.pixels
    }

    /// Records the values of a piece of the image. Pieces arrive in order; `first` is the number of the
    /// piece's first pixel.
    pub fn note(&mut self, image: &Image, first: usize) {
        let planes = &image.frame.planes;
        self.values.resize(planes.len().max(self.values.len()), Vec::new());
        while let Some(at) = self.pixels.get(self.noted).map(|pixel| (*pixel as usize).wrapping_sub(first)) {
            if planes.first().is_none_or(|plane| at >= plane.words.len()) {
                break;
            }
            for (values, plane) in self.values.iter_mut().zip(planes) {
                values.extend(plane.words.get(at).map(|word| f32::from_bits(*word)));
            }
            self.noted += 1;
        }
    }

    /// Compares the recorded values with an oracle. `limits` are the requested error bounds of the planes.
    /// The pixels that may exceed theirs are compared with an oracle of `many` samples, the others with
    /// `few`.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn check(
        &self,
        shading: &Shading<'_>,
        limits: &[f64],
        [few, many]: [u32; 2],
    ) -> Result<Check, RunError> {
        let pixels = self.pixels.get(..self.noted).unwrap_or(&[]);
        let mut truth = oracle(shading, pixels, few)?;
        let may_exceed = |slot: &usize| {
            let mut planes = self.values.iter().zip(limits).enumerate();
            planes.any(|(plane, (values, limit))| {
                let value = values.get(*slot).copied().unwrap_or(f32::NAN);
                let off = truth.off(plane, *slot, value);
                off.is_some_and(|[error, uncertain, _]| error + uncertain > *limit)
            })
        };
        let again: Vec<usize> =
            if few < many { (0..pixels.len()).filter(may_exceed).collect() } else { Vec::new() };
        if !again.is_empty() {
            let some: Vec<u32> = again.iter().filter_map(|slot| pixels.get(*slot)).copied().collect();
            truth.replace(&again, &oracle(shading, &some, many)?);
        }
        let found = check(&self.values, &truth, limits, |pixel| pixels.binary_search(&pixel).unwrap_or(0));
        Ok(Check { again: again.len() as u64, ..found })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oracles_own_error_is_subtracted() {
        let oracle = Oracle {
            pixels: vec![0, 1, 2],
            samples: 4,
            values: vec![vec![1.0, 1.0, f32::NAN]],
            errors: vec![vec![0.1, 0.1, f32::NAN]],
            said: Frame::default(),
        };
        let found = check(&[vec![1.25, 1.05, 0.0]], &oracle, &[0.12], |p| p as usize);
        assert_eq!((found.pixels, found.above), (2, 1), "what the oracle does not know is left out");
        assert!((found.largest - 0.15).abs() < 1e-6 && (found.oracle - 0.1).abs() < 1e-6);
        let nan = check(&[vec![f32::NAN, 1.0, 0.0]], &oracle, &[0.12], |p| p as usize);
        assert_eq!((nan.above, nan.largest), (1, f64::INFINITY));
    }

    #[test]
    fn chosen_pixels_are_spread_and_distinct() {
        let some = some_pixels(1000, 100, 5);
        assert_eq!(some.len(), 100);
        assert!(some.windows(2).all(|w| w[0] < w[1]) && some[99] < 1000);
        assert_eq!(some_pixels(3, 10, 0), [0, 1, 2]);
    }
}
