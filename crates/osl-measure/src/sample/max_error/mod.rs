//! An image whose error stays below a bound for 999 of 1000 pixels, with the least work.
//!
//! Ways of computing pixels are tried from the cheapest on, and what is spent on finding out whether one will do is in
//! proportion to what it costs itself.
//!
//! First lattices: every fourth pixel along x and along y, every second, each one's centre, with the pixels between
//! interpolated. The estimate of the error is how the lattice bends; whether it can be trusted tell some peeks, samples
//! at random places. Before a finer lattice is computed it is tried around a few of them.
//!
//! What is left needs samples. No formula knows how far standard errors can be trusted for a shader that it has not seen. So
//! some of the pixels, the pilot, go ahead: their number of samples is doubled until half of them would have been good
//! enough for nearly all. From what each number of samples was worth it is learned up to which estimate of the error a pixel
//! needs no more. The estimates need not be right, then; they only have to sort pixels.

mod bend;
mod cheaper;
mod lattice;
mod learn;
mod peek;
mod pilot;
mod scaled;

use super::adapt::{Refiner, power_below};
use super::image::{Cheaper, Image, Shading, not_finite};
use learn::Steps;
use osl_exec::{Frame, Stop};
use peek::{Peeks, Tried, trust};
use pilot::estimate;
use std::ops::Range;

/// What error an image may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxError {
    /// The largest error of a pixel, over all its planes, in the units of the outputs.
    pub error: f32,
    /// The most samples of a pixel; a power of two, or rounded down to one.
    pub most: u32,
}

/// Pixels around a peek that failed where a lattice was to be trusted, along each axis, that are left unsettled.
const REACH: usize = 4;
/// Pixels between those of the coarsest lattice.
const COARSE: usize = 4;
/// Share of the pixels that may be off.
const PROMISED: f32 = 1e-3;
/// The share that is planned with.
const ALLOWED: f32 = 5e-4;
/// The same where few pixels are left.
const ALLOWED_OF_FEW: f32 = 0.02;
/// Pixels for each one that is peeked at, to judge lattices of every fourth pixel, every second, each, and these before samples
/// are taken: a tenth of the work.
const PEEK: [usize; 4] = [168, 48, 16, 8];
/// The fewest and the most of them.
const PEEKS: (usize, usize) = (64, 16384);
/// Peeks around which a finer lattice is tried, the share of them that has to be settled by it, and that may be off.
const TRIALS: usize = 48;
const WORTH: [f32; 2] = [0.25, 0.6];
/// Estimates of errors of a lattice, as shares of the bound, from which on the next finer one has to prove itself.
const NEAR: f32 = 2.0;
/// Share of the peeks that may be off if a lattice may do for all.
const FAILED: f32 = 0.005;
/// The largest estimates that are trusted whatever the peeks say, as shares of the bound: they may have missed what is rare. Of
/// lattices; of a pixel's centre, which may be on either side of an edge.
const TRUSTED: [f32; 2] = [1.0, 0.25];
/// Good peeks beyond what is trusted anyway that make it trusted too.
const EVIDENCE: usize = 40;
/// Share of the pixels that are not worth a finer lattice.
const ROUGH: f32 = 0.02;
/// Peeks without which there is nothing to learn.
const FEW: usize = 16;
/// A peek, or a pixel of the pilot, that comes this close to the bound counts as beyond it.
const CLOSE: f32 = 0.9;
const BOLD: f32 = 0.95;
/// The same where it costs no more than a share of what the same number of samples for all pixels would.
const CAREFUL: f32 = 0.8;
const THRIFT: f32 = 0.75;
/// Share of the pilot that may be off if the next number of samples needs no trial.
const NEARLY: f32 = 0.005;
/// How far below the estimate of the best peek that failed an estimate has to be.
const BELOW_FAILED: f32 = 0.9;
/// The pilot: pixels of the image for each one of it, pixels that need samples for each one of it, and the fewest.
const PILOT: (usize, usize, usize) = (16, 4, 64);
/// Samples that would see what covers so much of a pixel that it matters: by the range of values in units of the bound; the
/// fewest and the most.
const WITNESSES: (f32, f32, f32) = (3.0, 8.0, 256.0);
/// Share of the bound below which a pilot's pixel with so many samples is left as it is.
const DROPPED: f32 = 0.2;
/// Standard errors that the bound is to be away from a pixel that has enough.
const SURE: f32 = 2.0;
/// The widest filter for which there are lattices. **Units:** pixels.
const WIDEST: f32 = 4.0;

/// Some rows of an image whose error stays below a bound. Wants dozens of rows at a time, since it learns from some of
/// their pixels.
///
/// # Errors
/// A loop beyond its budget.
pub fn max_error(shading: &Shading<'_>, rows: Range<usize>, wanted: MaxError) -> Result<Image, Stop> {
    let (width, height) = shading.surface.size();
    let rows = rows.start.min(height)..rows.end.min(height);
    let mut work = Work {
        shading,
        sampled: shading.clone(),
        chosen: None,
        wanted: MaxError { most: power_below(wanted.most), ..wanted },
        width,
        height: rows.len(),
        first: (rows.start * width) as u32,
        spread: spread(shading),
        values: Vec::new(),
        known: vec![false; rows.len() * width],
        evaluations: 0,
        unfinished: 0,
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

/// A band of rows on its way. Pixels are numbered from its first.
struct Work<'s, 'a> {
    shading: &'s Shading<'a>,
    /// What samples are taken of: the same, or the cheaper one.
    sampled: Shading<'a>,
    /// What is known of the cheaper one, if that is taken.
    chosen: Option<Cheaper>,
    wanted: MaxError,
    width: usize,
    height: usize,
    /// Number of its first pixel in the image.
    first: u32,
    /// The variance of samples around a pixel's centre.
    spread: f32,
    /// For each plane, what pixels show as far as is known: centres, and interpolated ones.
    values: Vec<Vec<f32>>,
    /// Whose centres were computed.
    known: Vec<bool>,
    evaluations: u64,
    /// Pixels that want more samples than they may have.
    unfinished: u64,
    said: Frame,
}

impl<'a> Work<'_, 'a> {
    fn run(&mut self) -> Result<Image, Stop> {
        let mut pending = vec![true; self.width * self.height];
        self.coarse()?;
        let mut off = 0.0;
        if self.shading.filter.width() <= WIDEST && !pending.is_empty() {
            let mut peeks = Peeks::default();
            off = self.lattices(&mut peeks, &mut pending)?;
            self.choose_arithmetic(&peeks, &pending)?;
        }
        let refined = self.sample(&pending, off)?;
        Ok(self.image(refined))
    }

    /// Settles pixels by lattices as far as these will do. Yields how many may be off.
    fn lattices(&mut self, peeks: &mut Peeks, pending: &mut [bool]) -> Result<f32, Stop> {
        let mut steps = vec![COARSE];
        let mut found = self.settle_by(&steps, peeks, PEEK[0], pending)?;
        for (step, each) in [(2, PEEK[1]), (1, PEEK[2])] {
            if !pending.contains(&true) {
                break;
            }
            if self.is_rough(&found, pending) {
                if self.is_worth(peeks, pending, step)? {
                    steps.push(step);
                    found = self.settle_by(&steps, peeks, each, pending)?;
                }
            } else {
                self.settle_near(step, peeks, pending)?;
                found.off += self.settle_one(step, peeks, pending, found.off)?.off;
            }
        }
        if self.is_rough(&found, pending) {
            // Samples will cost so much that lattices can be looked at once more.
            found = self.settle_by(&steps, peeks, PEEK[3], pending)?;
        }
        Ok(found.off)
    }

    /// Whether what is left costs so much that looking closer does not count: where it is much, and no lattice would have
    /// done for all.
    fn is_rough(&self, found: &Found, pending: &[bool]) -> bool {
        let left = pending.iter().filter(|p| **p).count();
        left as f32 > ROUGH * pending.len() as f32 && found.failed > FAILED
    }

    /// Settles pixels by some lattices, after peeks at one of `each` pixels.
    fn settle_by(
        &mut self,
        steps: &[usize],
        peeks: &mut Peeks,
        each: usize,
        pending: &mut [bool],
    ) -> Result<Found, Stop> {
        let (fewest, most) = PEEKS;
        let wanted = (pending.len() / each).clamp(fewest, most).min(pending.len());
        self.peek(peeks, wanted.saturating_sub(peeks.count()))?;
        pending.fill(true);
        let mut found = Found::default();
        for step in steps {
            let one = self.settle_one(*step, peeks, pending, found.off)?;
            found = Found { off: found.off + one.off, ..one };
        }
        Ok(found)
    }

    /// Settles those pending pixels by a finer lattice that the coarser one would all but have settled, if it is right around a few
    /// peeks among them. What the finer lattice bends need not be known then, which saves its surroundings.
    fn settle_near(&mut self, step: usize, peeks: &Peeks, pending: &mut [bool]) -> Result<(), Stop> {
        let width = self.width;
        let limit = NEAR * self.wanted.error;
        let bends = self.bends(2 * step);
        let near: Vec<bool> =
            (0..pending.len()).map(|at| pending[at] && bends.at([at % width, at / width]) <= limit).collect();
        let open = peeks.open(&near);
        if open.len() < FEW || !self.is_right(peeks, open, step)? {
            return Ok(());
        }
        self.cells(step, &near)?;
        pending.iter_mut().zip(near).for_each(|(pending, near)| *pending &= !near);
        Ok(())
    }

    /// Whether a lattice is right around some peeks.
    fn is_right(&mut self, peeks: &Peeks, open: Vec<usize>, step: usize) -> Result<bool, Stop> {
        let tried = self.try_some(peeks, open, step)?;
        Ok(tried.iter().all(|(_, error)| *error <= CLOSE * self.wanted.error))
    }

    /// Tries a lattice around some peeks: estimates of errors, and errors.
    fn try_some(&mut self, peeks: &Peeks, open: Vec<usize>, step: usize) -> Result<Vec<Tried>, Stop> {
        let each = open.len().div_ceil(TRIALS).max(1);
        let some: Vec<usize> = open.into_iter().step_by(each).collect();
        let needed = peeks.stencils(self, &some, step);
        self.centres(&needed)?;
        self.judge(peeks, &some, step)
    }

    /// Settles pending pixels by a lattice. `off` pixels may be off already.
    fn settle_one(
        &mut self,
        step: usize,
        peeks: &Peeks,
        pending: &mut [bool],
        off: f32,
    ) -> Result<Found, Stop> {
        if step < COARSE {
            self.lattice(step, pending)?;
        }
        let open = peeks.open(pending);
        let tried = self.judge(peeks, &open, step)?;
        let share = pending.len() as f32 / peeks.count().max(1) as f32;
        let spare = (ALLOWED * pending.len() as f32 - off).max(0.0) / share;
        let most = TRUSTED[usize::from(step == 1)] * self.wanted.error;
        let mut trust = trust(&tried, self.wanted.error, most, spare as usize);
        if tried.len() < FEW && trust.failed == 0 {
            // Of few pixels there is little to learn: a lattice is then as good as its estimates.
            trust.limit = most;
        }
        self.settle(step, trust.limit, pending);
        // What a peek has seen by chance may be larger than its pixel.
        for (slot, (estimate, error)) in open.iter().zip(&tried) {
            if *estimate <= trust.limit && above(*error, CLOSE * self.wanted.error) {
                peeks.reopen(*slot, self.width, REACH, pending);
            }
        }
        let failed = trust.failed as f32 / peeks.count().max(1) as f32;
        Ok(Found { off: trust.passed_over as f32 * share, failed })
    }

    /// Whether a finer lattice is right around enough of some peeks.
    fn is_worth(&mut self, peeks: &Peeks, pending: &[bool], step: usize) -> Result<bool, Stop> {
        let tried = self.try_some(peeks, peeks.open(pending), step)?;
        let trust = trust(&tried, self.wanted.error, f32::MAX, 0);
        let some = tried.len() as f32;
        Ok(trust.good as f32 > WORTH[0] * some && trust.failed as f32 <= WORTH[1] * some)
    }

    /// Computes the centres of those pixels that are needed and not known yet.
    fn centres(&mut self, needed: &[bool]) -> Result<(), Stop> {
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

    /// What the coarsest lattice says of the surroundings of pixels, by their numbers in the image.
    fn guards(&self, pixels: &[u32]) -> Vec<f32> {
        let bends = self.bends(COARSE);
        let within = pixels.iter().map(|pixel| (pixel - self.first) as usize);
        within.map(|at| bends.at([at % self.width, at / self.width])).collect()
    }

    /// Samples the pixels that are still pending: first the pilot, then the others.
    fn sample(&mut self, pending: &[bool], off: f32) -> Result<[Refiner<'a>; 2], Stop> {
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
        let mut others = Refiner::new(&self.sampled, pixels);
        self.follow(&mut others, &guards, &steps)?;
        Ok([pilot, others])
    }

    /// Samples pixels as the pilot taught.
    fn follow(&mut self, refiner: &mut Refiner<'a>, guards: &[f32], steps: &Steps) -> Result<(), Stop> {
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
            image.frame.add(refiner.said);
        }
        image.tally.pixels = self.known.len() as u64;
        image.tally.note_all(samples.into_iter());
        image.tally.unfinished = self.unfinished;
        image.tally.cheaper = self.chosen;
        image.tally.not_finite = not_finite(&values);
        image.frame.planes = self.shading.filled(values);
        image
    }
}

/// What came of a lattice.
#[derive(Default)]
struct Found {
    /// Pixels that may be off.
    off: f32,
    /// Share of the peeks at which the last lattice is off.
    failed: f32,
}

/// Whether an estimate is above a limit, or none.
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
