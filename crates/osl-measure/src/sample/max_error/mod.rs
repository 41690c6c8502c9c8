//! Renders an image with the least work such that the error of 999 in 1000 pixels stays below a bound.
//!
//! The cheapest way to compute a pixel is tried first. The work spent on testing a method is proportional to
//! the cost of the method itself.
//!
//! First come lattices: every fourth pixel along x and y, then every second, then every second column, then
//! the centre of every pixel. The pixels between are interpolated. The curvature of the lattice estimates the
//! error, and a few *probes* (samples at random positions) show whether that estimate can be trusted. A finer
//! lattice is first tried around a few of the probes.
//!
//! The remaining pixels need samples. No formula knows how reliable a standard error is for an unknown
//! shader. So some of the pixels, the *pilot*, are sampled first: their sample count is doubled until half of
//! the samples would have been good enough for nearly all of them. The pilot shows, for each sample count,
//! the largest estimated error at which a pixel needs no further samples. So the estimates need not be exact;
//! they only have to sort the pixels.

mod curvature;
mod lattice;
mod limits;
mod pilot;
mod policy;
mod probe;
mod samples;

use super::adapt::power_below;
use super::error::Weights;
use super::image::{Cheaper, Image, PixelSamples, Shading};
use super::round::put;
use osl_exec::{Frame, RunError};
pub use policy::PROMISED;
use policy::*;
use probe::{Probes, trust};
use std::borrow::Cow;
use std::ops::Range;

/// The error bound of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxError {
    /// The largest error of a pixel over all its planes, in the units of the outputs.
    pub error: f32,
    /// Maximum samples per pixel; rounded down to a power of two.
    pub most: u32,
}

/// Renders some rows of an image with an error below a bound. Pass dozens of rows at a time, because the
/// function learns from some of their pixels.
///
/// # Errors
/// A loop exceeds its budget.
pub fn max_error(shading: &Shading<'_>, rows: Range<usize>, wanted: MaxError) -> Result<Image, RunError> {
    let bounds = vec![wanted.error; shading.planes().len()];
    max_error_each(shading, rows, (&bounds, wanted.most))
}

/// The same with a bound for each plane, in the units of its output, and the maximum number of samples per
/// pixel. A plane with an infinite bound gets what the others need.
///
/// # Errors
/// A loop exceeds its budget.
pub fn max_error_each(
    shading: &Shading<'_>,
    rows: Range<usize>,
    (bounds, most): (&[f32], u32),
) -> Result<Image, RunError> {
    let (error, weights) = Weights::of(bounds);
    let (width, height) = shading.surface.size();
    let rows = rows.start.min(height)..rows.end.min(height);
    let mut work = Work {
        shading,
        sampled: shading.clone(),
        chosen: None,
        wanted: MaxError { error, most: power_below(most) },
        weights,
        width,
        height: rows.len(),
        first: (rows.start * width) as u32,
        spread: spread(shading),
        values: Vec::new(),
        known: vec![false; rows.len() * width],
        samples: Vec::new(),
        evaluations: 0,
        unfinished: 0,
        above: 0.0,
        said: Frame::default(),
    };
    if shading.options.threads == Some(1) || work.known.len() < 4096 {
        return work.run();
    }
    // The threads of the pool find the next step sooner than they can be woken.
    rayon::scope(|_| work.run())
}

/// The variance of a filter's samples along one axis.
fn spread(shading: &Shading<'_>) -> f32 {
    let steps = 64;
    let places = (0..steps).map(|i| shading.filter.place((i as f32 + 0.5) / steps as f32));
    (places.map(|(x, sign)| x * x * sign).sum::<f32>() / steps as f32).abs()
}

/// A band of rows in progress. Pixels are numbered from its first.
struct Work<'s, 'a> {
    shading: &'s Shading<'a>,
    /// What is sampled: the given program or its cheaper form.
    sampled: Shading<'a>,
    /// The comparison with the cheaper form, if that is used.
    chosen: Option<Cheaper>,
    /// The smallest bound.
    wanted: MaxError,
    /// Factors on the errors of the planes that make it stand for all.
    weights: Weights,
    width: usize,
    height: usize,
    /// Number of the band's first pixel in the image.
    first: u32,
    /// The variance of samples around a pixel's centre.
    spread: f32,
    /// For each plane the current pixel values: computed centres and interpolated pixels.
    values: Vec<Vec<f32>>,
    /// Pixels whose centre was computed.
    known: Vec<bool>,
    /// The samples of each pixel that has any, 0 for the others; empty as long as none has.
    samples: Vec<u32>,
    evaluations: u64,
    /// Pixels that need more samples than the maximum.
    unfinished: u64,
    /// Pixels that probably exceed the bound, because the samples do not suffice.
    above: f64,
    said: Frame,
}

impl<'a> Work<'_, 'a> {
    fn run(&mut self) -> Result<Image, RunError> {
        let mut pending = vec![true; self.width * self.height];
        self.coarse()?;
        let (mut off, mut probes) = (0.0, Probes::default());
        if self.shading.filter.width() <= WIDEST && !pending.is_empty() {
            off = self.lattices(&mut probes, &mut pending)?;
            self.choose_arithmetic(&probes, &pending)?;
        }
        self.sample(&pending, off, &probes)?;
        Ok(self.image())
    }

    /// Settles as many pixels as lattices can. Returns how many of them may exceed the bound.
    fn lattices(&mut self, probes: &mut Probes, pending: &mut [bool]) -> Result<f32, RunError> {
        let mut steps = vec![COARSE];
        let mut found = self.settle_by(&mut steps, probes, PROBE[0], pending)?;
        for (step, each) in [(2, PROBE[1]), (1, PROBE[2])] {
            if count(pending) == 0 {
                break;
            }
            if self.is_rough(&found, pending) {
                if self.is_worth(probes, pending, step)? {
                    steps.push(step);
                    found = self.settle_by(&mut steps, probes, each, pending)?;
                }
            } else {
                found.off += self.settle_one(step, probes, pending, found.off)?.off;
            }
        }
        // The probes also show whether a cheaper arithmetic is good enough.
        let asks = !steps.is_empty() || self.shading.cheaper.is_some();
        if self.is_rough(&found, pending) && asks && probes.count() < probes_of(pending.len(), PROBE[3], 0) {
            // Sampling will be so expensive that a second test of the lattices costs little in comparison.
            found = self.settle_by(&mut steps, probes, PROBE[3], pending)?;
        }
        Ok(found.off)
    }

    /// Whether the remaining pixels are so expensive that further tests cost nothing in comparison: there are
    /// many, and no lattice was good enough for all.
    fn is_rough(&self, found: &LatticeOutcome, pending: &[bool]) -> bool {
        count(pending) as f32 > ROUGH * pending.len() as f32 && found.failed > NEARLY
    }

    /// Settles pixels by some lattices, after a probe at one in `each` pixels. Lattices that were wrong
    /// almost everywhere are removed from the list.
    fn settle_by(
        &mut self,
        steps: &mut Vec<usize>,
        probes: &mut Probes,
        each: usize,
        pending: &mut [bool],
    ) -> Result<LatticeOutcome, RunError> {
        let wanted = probes_of(pending.len(), each, if steps.contains(&1) { SURE_PROBES } else { 0 });
        self.probe(probes, wanted.saturating_sub(probes.count()))?;
        pending.fill(true);
        let mut found = LatticeOutcome::default();
        let mut useful = Vec::new();
        for step in steps.iter() {
            let before = count(pending);
            let one = self.settle_one(*step, probes, pending, found.off)?;
            if before.saturating_sub(count(pending)) * 20 > pending.len() {
                useful.push(*step);
            }
            found = LatticeOutcome { off: found.off + one.off, ..one };
        }
        *steps = useful;
        Ok(found)
    }

    /// Settles pending pixels by one lattice. `off` pixels may already exceed the bound.
    fn settle_one(
        &mut self,
        step: usize,
        probes: &Probes,
        pending: &mut [bool],
        off: f32,
    ) -> Result<LatticeOutcome, RunError> {
        if step < COARSE {
            self.lattice(step, pending)?;
        }
        let open = probes.open(pending);
        let curvatures = self.curvatures(step, pending);
        let tried = self.judge(probes, &open, step, |_, pixel| curvatures.at(pixel))?;
        let share = pending.len() as f32 / probes.count().max(1) as f32;
        let spare = (ALLOWED * pending.len() as f32 - off).max(0.0) / share;
        let most = TRUSTED[usize::from(step == 1)] * self.wanted.error;
        let mut trust = trust(&tried, self.wanted.error, most, spare);
        if tried.len() < FEW && trust.failed == 0 {
            // A few pixels teach little: the lattice is then as good as its estimates.
            trust.limit = most;
        }
        self.settle(trust.limit, &curvatures, pending);
        // The feature that a probe hit may be larger than its pixel.
        for (slot, (estimate, own)) in open.iter().zip(&tried) {
            if *estimate <= trust.limit && self.is_wrong(own) {
                probes.reopen(*slot, self.width, pending);
            }
        }
        let failed = trust.failed as f32 / probes.count().max(1) as f32;
        Ok(LatticeOutcome { off: trust.passed_over * share, failed })
    }

    /// Whether a finer lattice is right around enough of some pending probes.
    fn is_worth(&mut self, probes: &Probes, pending: &[bool], step: usize) -> Result<bool, RunError> {
        let open = probes.open(pending);
        let some: Vec<usize> = open.iter().copied().step_by(open.len().div_ceil(TRIALS).max(1)).collect();
        let mut needed = probes.stencils(self, &some, step);
        needed.retain(|pixel| !self.known[*pixel as usize]);
        needed.sort_unstable();
        needed.dedup();
        self.compute(&needed)?;
        let tried = self.judge(probes, &some, step, |work, pixel| work.curvature(pixel, step))?;
        let trust = trust(&tried, self.wanted.error, f32::MAX, 0.0);
        // At least a quarter is right without the estimates that belong to a failure.
        Ok(4 * trust.good > tried.len())
    }

    /// Computes the centres of some pixels, which are in order.
    fn compute(&mut self, pixels: &[u32]) -> Result<(), RunError> {
        if pixels.is_empty() {
            return Ok(());
        }
        let found = self.shading.centres(&self.in_image(pixels), &mut self.said)?;
        for (values, found) in self.values.iter_mut().zip(found) {
            put(pixels, &found, values);
        }
        pixels.iter().for_each(|pixel| self.known[*pixel as usize] = true);
        self.evaluations += pixels.len() as u64;
        Ok(())
    }

    /// The numbers in the image of pixels of the band.
    fn in_image<'p>(&self, pixels: &'p [u32]) -> Cow<'p, [u32]> {
        match self.first {
            0 => Cow::Borrowed(pixels),
            first => pixels.iter().map(|pixel| pixel + first).collect(),
        }
    }

    fn image(&mut self) -> Image {
        let (known, mut samples) = (std::mem::take(&mut self.known), std::mem::take(&mut self.samples));
        let (values, said) = (std::mem::take(&mut self.values), std::mem::take(&mut self.said));
        let mut image = self.shading.image(values, said, (known.len(), self.evaluations));
        if samples.is_empty() {
            image.tally.note_centres(count(&known) as u64);
            image.samples = PixelSamples::Centres(known);
        } else {
            samples.iter_mut().zip(&known).for_each(|(own, known)| *own = (*own).max(u32::from(*known)));
            image.tally.note_all(samples.iter().copied());
            image.samples = PixelSamples::Each(samples);
        }
        image.tally.unfinished = self.unfinished;
        image.tally.above = self.above;
        image.tally.cheaper = self.chosen;
        image
    }
}

/// The result of a lattice.
#[derive(Default)]
struct LatticeOutcome {
    /// Pixels that may exceed the bound.
    off: f32,
    /// Share of the probes at which the last lattice failed.
    failed: f32,
}

/// The number of probes in so many pixels: one in `each`, and at least `sure` if that is no more than one in
/// `PROBE[3]`. A small image has all of its probes at once.
fn probes_of(pixels: usize, each: usize, sure: usize) -> usize {
    if pixels < SMALL_IMAGE {
        return (pixels / 4).max(SURE_PROBES.min(pixels));
    }
    (pixels / each).max(sure.min(pixels / PROBE[3])).min(SMALL_IMAGE)
}

/// How many pixels are pending.
fn count(pending: &[bool]) -> usize {
    pending.iter().filter(|pending| **pending).count()
}

/// Whether an estimate is above a limit or NaN.
fn above(estimate: f32, limit: f32) -> bool {
    !matches!(estimate.partial_cmp(&limit), Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_above_every_limit() {
        assert!(above(f32::NAN, 1.0) && above(2.0, 1.0) && !above(1.0, 1.0));
    }
}
