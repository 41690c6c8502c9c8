//! Renders an image with the least work such that the error of 999 in 1000 pixels stays below a bound.
//!
//! The cheapest way to compute a pixel is tried first. The work spent on testing a method is proportional to
//! the cost of the method itself.
//!
//! First come lattices: every fourth pixel along x and y, then every second, then the centre of every pixel.
//! The pixels between are interpolated. The curvature of the lattice estimates the error, and a few *probes*
//! (samples at random positions) show whether that estimate can be trusted. A finer lattice is first tried
//! around a few of the probes.
//!
//! The remaining pixels need samples. No formula knows how reliable a standard error is for an unknown
//! shader. So some of the pixels, the *pilot*, are sampled first: their sample count is doubled until half of
//! the samples would have been good enough for nearly all of them. The pilot shows, for each sample count,
//! the largest estimated error at which a pixel needs no further samples. So the estimates need not be exact;
//! they only have to sort the pixels.

mod cheaper;
mod curvature;
mod lattice;
mod learn;
mod pilot;
mod probe;
mod scaled;

use super::adapt::{Refiner, power_below};
use super::bounds::Weights;
use super::image::{Cheaper, Image, Shading, not_finite};
use learn::Steps;
use osl_exec::{Frame, RunError};
use pilot::estimate;
use probe::{Probes, Tried, trust};
use std::ops::Range;

/// The error bound of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxError {
    /// The largest error of a pixel over all its planes, in the units of the outputs.
    pub error: f32,
    /// Maximum samples per pixel; rounded down to a power of two.
    pub most: u32,
}

/// When a probe fails where the lattice was trusted, pixels up to this distance along each axis become
/// pending again.
const REACH: usize = 4;
/// Distance between the pixels of the coarsest lattice.
const COARSE: usize = 4;
/// Share of the pixels whose error may exceed the bound.
pub const PROMISED: f64 = 1e-3;
/// The share that planning aims for, to leave a margin.
const ALLOWED: f32 = 5e-4;
/// The aim when few pixels are left.
const ALLOWED_OF_FEW: f32 = 0.02;
/// One in so many pixels gets a probe, to judge the lattices of every fourth, every second and every pixel,
/// and all of them once more before sampling starts. Probes cost about a tenth of the work.
const PROBE: [usize; 4] = [168, 48, 16, 8];
/// The minimum and maximum number of probes.
const PEEKS: (usize, usize) = (64, 16384);
/// The number of probes around which a finer lattice is tried; the share of them that it must settle; the
/// share that may exceed the bound.
const TRIALS: usize = 48;
const WORTH: [f32; 2] = [0.25, 0.6];
/// The next finer lattice has to prove itself only up to this estimate, as a multiple of the bound.
const NEAR: f32 = 2.0;
/// Share of the probes that may fail if a lattice is to do for all pixels.
const FAILED: f32 = 0.005;
/// The largest estimates that are trusted without further evidence, as shares of the bound, because the
/// probes may have missed rare features. The first value is for lattices, the second for a pixel's centre,
/// which may be on either side of an edge.
const TRUSTED: [f32; 2] = [1.0, 0.25];
/// Good probes above `TRUSTED` that raise the trusted estimate.
const EVIDENCE: usize = 40;
/// Share of the pixels below which a finer lattice is not worth its cost.
const ROUGH: f32 = 0.02;
/// Minimum number of probes to learn from.
const FEW: usize = 16;
/// A probe or a pilot pixel whose error exceeds this share of the bound counts as a failure.
const CLOSE: f32 = 0.9;
const BOLD: f32 = 0.95;
/// The threshold used when adaptive sampling costs less than `THRIFT` of sampling every pixel equally.
const CAREFUL: f32 = 0.8;
const THRIFT: f32 = 0.75;
/// If at most this share of the pilot exceeds the bound, the next sample count needs no trial.
const NEARLY: f32 = 0.005;
/// A trusted estimate is at most this multiple of the smallest estimate at which a probe failed.
const BELOW_FAILED: f32 = 0.9;
/// Size of the pilot: one in so many pixels of the image, one in so many pixels that need samples, and the
/// minimum.
const PILOT: (usize, usize, usize) = (16, 4, 64);
/// Samples needed to hit any feature large enough to matter: a factor on the range of values in units of the
/// bound, the minimum and the maximum.
const MIN_SAMPLES: (f32, f32, f32) = (3.0, 8.0, 256.0);
/// A pilot pixel with enough samples is dropped when its error is below this share of the bound.
const DROPPED: f32 = 0.2;
/// A pixel has enough samples when the bound is at least this many standard errors.
const SURE: f32 = 2.0;
/// The widest filter for which lattices are used. **Units:** pixels.
const WIDEST: f32 = 4.0;

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
        evaluations: 0,
        unfinished: 0,
        above: 0.0,
        said: Frame::default(),
    };
    work.run()
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
        let mut off = 0.0;
        if self.shading.filter.width() <= WIDEST && !pending.is_empty() {
            let mut probes = Probes::default();
            off = self.lattices(&mut probes, &mut pending)?;
            self.choose_arithmetic(&probes, &pending)?;
        }
        let refined = self.sample(&pending, off)?;
        Ok(self.image(refined))
    }

    /// Settles as many pixels as lattices can. Returns how many of them may exceed the bound.
    fn lattices(&mut self, probes: &mut Probes, pending: &mut [bool]) -> Result<f32, RunError> {
        let mut steps = vec![COARSE];
        let mut found = self.settle_by(&steps, probes, PROBE[0], pending)?;
        for (step, each) in [(2, PROBE[1]), (1, PROBE[2])] {
            if !pending.contains(&true) {
                break;
            }
            if self.is_rough(&found, pending) {
                if self.is_worth(probes, pending, step)? {
                    steps.push(step);
                    found = self.settle_by(&steps, probes, each, pending)?;
                }
            } else {
                self.settle_near(step, probes, pending)?;
                found.off += self.settle_one(step, probes, pending, found.off)?.off;
            }
        }
        if self.is_rough(&found, pending) {
            // Sampling will be so expensive that a second test of the lattices costs little in comparison.
            found = self.settle_by(&steps, probes, PROBE[3], pending)?;
        }
        Ok(found.off)
    }

    /// Whether the remaining pixels are so expensive that further tests cost nothing in comparison: there are
    /// many, and no lattice was good enough for all.
    fn is_rough(&self, found: &Found, pending: &[bool]) -> bool {
        let left = pending.iter().filter(|p| **p).count();
        left as f32 > ROUGH * pending.len() as f32 && found.failed > FAILED
    }

    /// Settles pixels by some lattices, after a probe at one in `each` pixels.
    fn settle_by(
        &mut self,
        steps: &[usize],
        probes: &mut Probes,
        each: usize,
        pending: &mut [bool],
    ) -> Result<Found, RunError> {
        let (fewest, most) = PEEKS;
        let wanted = (pending.len() / each).clamp(fewest, most).min(pending.len());
        self.probe(probes, wanted.saturating_sub(probes.count()))?;
        pending.fill(true);
        let mut found = Found::default();
        for step in steps {
            let one = self.settle_one(*step, probes, pending, found.off)?;
            found = Found { off: found.off + one.off, ..one };
        }
        Ok(found)
    }

    /// Settles the pending pixels that the coarser lattice nearly settled by a finer one, if the finer one is
    /// right around a few probes among them. The curvature of the finer lattice is not needed for that, which
    /// saves computing its neighbours.
    fn settle_near(&mut self, step: usize, probes: &Probes, pending: &mut [bool]) -> Result<(), RunError> {
        let width = self.width;
        let limit = NEAR * self.wanted.error;
        let curvatures = self.curvatures(2 * step);
        let near: Vec<bool> = (0..pending.len())
            .map(|at| pending[at] && curvatures.at([at % width, at / width]) <= limit)
            .collect();
        let open = probes.open(&near);
        if open.len() < FEW || !self.is_right(probes, open, step)? {
            return Ok(());
        }
        self.cells(step, &near)?;
        pending.iter_mut().zip(near).for_each(|(pending, near)| *pending &= !near);
        Ok(())
    }

    /// Whether a lattice is right around some probes.
    fn is_right(&mut self, probes: &Probes, open: Vec<usize>, step: usize) -> Result<bool, RunError> {
        let tried = self.try_some(probes, open, step)?;
        Ok(tried.iter().all(|(_, error)| *error <= CLOSE * self.wanted.error))
    }

    /// Tries a lattice around some probes. Returns the estimated and the actual errors.
    fn try_some(&mut self, probes: &Probes, open: Vec<usize>, step: usize) -> Result<Vec<Tried>, RunError> {
        let each = open.len().div_ceil(TRIALS).max(1);
        let some: Vec<usize> = open.into_iter().step_by(each).collect();
        let needed = probes.stencils(self, &some, step);
        self.centres(&needed)?;
        self.judge(probes, &some, step)
    }

    /// Settles pending pixels by one lattice. `off` pixels may already exceed the bound.
    fn settle_one(
        &mut self,
        step: usize,
        probes: &Probes,
        pending: &mut [bool],
        off: f32,
    ) -> Result<Found, RunError> {
        if step < COARSE {
            self.lattice(step, pending)?;
        }
        let open = probes.open(pending);
        let tried = self.judge(probes, &open, step)?;
        let share = pending.len() as f32 / probes.count().max(1) as f32;
        let spare = (ALLOWED * pending.len() as f32 - off).max(0.0) / share;
        let most = TRUSTED[usize::from(step == 1)] * self.wanted.error;
        let mut trust = trust(&tried, self.wanted.error, most, spare as usize);
        if tried.len() < FEW && trust.failed == 0 {
            // A few pixels teach little: the lattice is then as good as its estimates.
            trust.limit = most;
        }
        self.settle(step, trust.limit, pending);
        // The feature that a probe hit may be larger than its pixel.
        for (slot, (estimate, error)) in open.iter().zip(&tried) {
            if *estimate <= trust.limit && above(*error, CLOSE * self.wanted.error) {
                probes.reopen(*slot, self.width, REACH, pending);
            }
        }
        let failed = trust.failed as f32 / probes.count().max(1) as f32;
        Ok(Found { off: trust.passed_over as f32 * share, failed })
    }

    /// Whether a finer lattice is right around enough of the pending probes.
    fn is_worth(&mut self, probes: &Probes, pending: &[bool], step: usize) -> Result<bool, RunError> {
        let tried = self.try_some(probes, probes.open(pending), step)?;
        let trust = trust(&tried, self.wanted.error, f32::MAX, 0);
        let some = tried.len() as f32;
        Ok(trust.good as f32 > WORTH[0] * some && trust.failed as f32 <= WORTH[1] * some)
    }

    /// Computes the needed centres that are not known yet.
    fn centres(&mut self, needed: &[bool]) -> Result<(), RunError> {
        let missing = |pixel: &usize| needed[*pixel] && !self.known[*pixel];
        let pixels: Vec<usize> = (0..needed.len()).filter(missing).collect();
        let all: Vec<u32> = pixels.iter().map(|pixel| *pixel as u32 + self.first).collect();
        let found = self.shading.centres(&all, &mut self.said)?;
        for (values, found) in self.values.iter_mut().zip(found) {
            pixels.iter().zip(found).for_each(|(pixel, x)| values[*pixel] = x);
        }
        pixels.iter().for_each(|pixel| self.known[*pixel] = true);
        self.evaluations += pixels.len() as u64;
        Ok(())
    }

    /// The curvature of the coarsest lattice around each pixel. Pixels are numbered in the image.
    fn guards(&self, pixels: &[u32]) -> Vec<f32> {
        let curvatures = self.curvatures(COARSE);
        let within = pixels.iter().map(|pixel| (pixel - self.first) as usize);
        within.map(|at| curvatures.at([at % self.width, at / self.width])).collect()
    }

    /// Samples the pixels that are still pending: the pilot first, then the others.
    fn sample(&mut self, pending: &[bool], off: f32) -> Result<[Refiner<'a>; 2], RunError> {
        let mut pixels: Vec<u32> =
            (0..pending.len()).filter(|p| pending[*p]).map(|p| p as u32 + self.first).collect();
        if pixels.is_empty() {
            return Ok([Refiner::new(self.shading, Vec::new()), Refiner::new(self.shading, Vec::new())]);
        }
        let allowed = (ALLOWED * pending.len() as f32 - off).max(0.0) / pixels.len() as f32;
        let (pilot, steps) = self.pilot(&pixels, allowed.clamp(0.5 * ALLOWED, ALLOWED_OF_FEW))?;
        let ahead = pilot.pixels();
        pixels.retain(|pixel| ahead.binary_search(pixel).is_err());
        let guards = self.guards(&pixels);
        if steps.short {
            let share = f64::from(steps.failed) / ahead.len().max(1) as f64;
            self.above = share * (ahead.len() + pixels.len()) as f64 + f64::from(off);
        }
        let mut others = Refiner::new(&self.sampled, pixels).with(&self.weights);
        self.follow(&mut others, &guards, &steps)?;
        Ok([pilot, others])
    }

    /// Samples pixels with the limits that the pilot found.
    fn follow(&mut self, refiner: &mut Refiner<'a>, guards: &[f32], steps: &Steps) -> Result<(), RunError> {
        let mut estimates = vec![0.0; guards.len()];
        for (samples, limit) in &steps.limits {
            if refiner.active.is_empty() {
                break;
            }
            let last = *limit == f32::INFINITY;
            refiner.round(*samples, !last || steps.short)?;
            if last && steps.short {
                let wants = |slot: &&usize| above(SURE * refiner.error(**slot), self.wanted.error);
                self.unfinished = refiner.active.iter().filter(wants).count() as u64;
            }
            if !last {
                refiner
                    .active
                    .iter()
                    .for_each(|slot| estimates[*slot] = estimate(refiner, *slot, guards[*slot]));
                refiner.settle(|slot, _| estimates[slot] <= *limit);
            }
        }
        Ok(())
    }

    fn image(&mut self, refined: [Refiner<'a>; 2]) -> Image {
        let mut image = Image { frame: std::mem::take(&mut self.said), ..Image::default() };
        let mut samples: Vec<u32> = self.known.iter().map(|known| u32::from(*known)).collect();
        let mut values = std::mem::take(&mut self.values);
        image.tally.evaluations = self.evaluations;
        for refiner in refined {
            let means = refiner.means();
            for (slot, pixel) in refiner.pixels().iter().enumerate() {
                let at = (pixel - self.first) as usize;
                samples[at] = refiner.each[slot];
                values.iter_mut().zip(&means).for_each(|(plane, means)| plane[at] = means[slot]);
            }
            image.tally.evaluations += refiner.evaluations;
            image.frame.add(refiner.said, &self.shading.options.limits.running);
        }
        image.tally.pixels = self.known.len() as u64;
        image.tally.note_all(samples.iter().copied());
        image.samples = samples;
        image.tally.unfinished = self.unfinished;
        image.tally.above = self.above;
        image.tally.cheaper = self.chosen;
        image.tally.not_finite = not_finite(&values);
        image.frame.planes = self.shading.filled(values);
        image
    }
}

/// The result of a lattice.
#[derive(Default)]
struct Found {
    /// Pixels that may exceed the bound.
    off: f32,
    /// Share of the probes at which the last lattice failed.
    failed: f32,
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
