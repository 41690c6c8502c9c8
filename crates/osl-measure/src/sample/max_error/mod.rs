//! An image whose error stays below a bound, with the least work.
//!
//! Every fourth pixel is computed first, along x and along y. Where some hundred pixels between are as interpolated, the image
//! is smooth, and is interpolated where its lattice bends little; the rest gets finer lattices and samples.
//!
//! Otherwise no formula knows how far estimates can be trusted for a shader that it has not seen. So the image is tried: some
//! thousand pixels, the pilot, get so many samples that they serve as truth. Then each way of computing a pixel is judged
//! by them, from the cheapest on: interpolated from every fourth pixel, from every second, its centre alone, 4, 8, 16 …
//! samples. Each has an estimate of its error, and the pilot tells up to which estimate no pixel of it was worse than the
//! bound. Pixels are then computed in the cheapest way whose estimate stays below that. A way that the pilot finds useless is
//! left out.

mod lattice;
mod learn;
mod pilot;

use super::adapt::{FEWEST, Refiner, power_below, rounds};
use super::image::{Image, Shading, not_finite};
use lattice::Bends;
use learn::Lesson;
use osl_exec::{Frame, Stop};
use pilot::Pilot;
use std::ops::Range;

/// What error an image may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxError {
    /// The largest error of a pixel, over all its planes, in the units of the outputs.
    pub error: f32,
    /// The most samples of a pixel; a power of two, or rounded down to one.
    pub most: u32,
}

/// Pixels between those of the coarsest lattice.
const COARSE: usize = 4;
/// Pixels for each one that is peeked at, and the fewest and most.
const PEEK: (usize, usize, usize) = (64, 512, 2048);
/// The same of the pilot of an image that is not smooth throughout: one of a thousand pixels is to be noticed.
const PILOT: (usize, usize, usize) = (100, 2048, 4096);
/// The largest estimates that are trusted whatever the pilot says, as shares of the bound: it may have missed what is rare.
/// Of lattices; of a pixel's centre, which may be on either side of an edge; of standard errors.
const TRUSTED: [f32; 3] = [1.0, 0.25, 0.5];
/// The same of pixels that have more samples than the pilot needed.
const RARE: f32 = 0.3;
/// Good pixels of the pilot beyond what is trusted anyway that make it trusted too.
const EVIDENCE: usize = 100;
/// Share of the pixels that are peeked at whose estimate may be above the bound in a smooth image.
const ROUGH: f32 = 0.1;
/// Pixels without which there is nothing to learn.
const FEW: usize = 16;
/// The fewest and the most samples without which a pilot's pixel does not count as truth: as many as would see what covers
/// so much of a pixel that it matters.
const WITNESSES: (f32, f32) = (8.0, 64.0);
/// A pixel of the pilot that comes this close to the bound counts as beyond it.
const CLOSE: f32 = 0.9;
/// How far below the estimate of the best pixel that failed an estimate has to be.
const BELOW_FAILED: f32 = 0.8;
/// Share of the bound that the standard error of a pilot's pixel may be.
const REFERENCE: f32 = 1.0 / 4.0;
/// How many times as many samples as other pixels a pilot's pixel may have.
const REFERENCE_MORE: u32 = 4;

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
        wanted: MaxError { most: power_below(wanted.most), ..wanted },
        width,
        height: rows.len(),
        first: (rows.start * width) as u32,
        values: Vec::new(),
        known: vec![false; rows.len() * width],
        evaluations: 0,
        said: Frame::default(),
    };
    work.run()
}

/// A band of rows on its way. Pixels are numbered from its first.
struct Work<'s, 'a> {
    shading: &'s Shading<'a>,
    wanted: MaxError,
    width: usize,
    height: usize,
    /// Number of its first pixel in the image.
    first: u32,
    /// For each plane, what pixels show as far as is known: centres, and interpolated ones.
    values: Vec<Vec<f32>>,
    /// Whose centres were computed.
    known: Vec<bool>,
    evaluations: u64,
    said: Frame,
}

impl<'a> Work<'_, 'a> {
    fn run(&mut self) -> Result<Image, Stop> {
        let count = self.width * self.height;
        let bends = self.coarse()?;
        let (truth, lesson) = if self.is_smooth(&bends)? {
            (Pilot::default(), Lesson::untaught(self.wanted.error))
        } else {
            let truth = self.pilot()?;
            let lesson = self.learn(&truth, &bends)?;
            (truth, lesson)
        };
        let mut pending = vec![false; count];
        bends.each(|bend, row| {
            let rejected = above(bend, lesson.coarse);
            pending[row].fill(rejected);
        });
        truth.pixels.iter().for_each(|pixel| pending[*pixel as usize] = false);
        if let Some(limit) = lesson.fine {
            self.finer(2, &mut pending, limit)?;
        }
        if let Some(limit) = lesson.centre {
            self.finer(1, &mut pending, limit)?;
        }
        let refined = self.sample(&pending, &bends, &lesson)?;
        Ok(self.image(&truth, refined))
    }

    /// Computes the centres of some pixels that are not known yet.
    fn centres(&mut self, mut pixels: Vec<u32>) -> Result<(), Stop> {
        pixels.sort_unstable();
        pixels.dedup();
        pixels.retain(|pixel| !self.known[*pixel as usize]);
        let all: Vec<u32> = pixels.iter().map(|pixel| pixel + self.first).collect();
        let found = self.shading.centres(&all, &mut self.said)?;
        for (values, found) in self.values.iter_mut().zip(found) {
            pixels.iter().zip(found).for_each(|(pixel, x)| values[*pixel as usize] = x);
        }
        pixels.iter().for_each(|pixel| self.known[*pixel as usize] = true);
        self.evaluations += pixels.len() as u64;
        Ok(())
    }

    /// Computes a finer lattice where pixels are pending, and settles those whose estimate is small enough.
    fn finer(&mut self, step: usize, pending: &mut [bool], limit: f32) -> Result<(), Stop> {
        let (width, height) = (self.width, self.height);
        let any = |pending: &[bool], at: usize| {
            let (x, y) = (at % width, at / width);
            let mut inside = (y..(y + step).min(height))
                .flat_map(|y| (x..(x + step).min(width)).map(move |x| y * width + x));
            inside.any(|pixel| pending[pixel])
        };
        self.lattice(step, |at| any(pending, at))?;
        for y in (0..height).step_by(step) {
            for x in (0..width).step_by(step) {
                if any(pending, y * width + x) {
                    let bend = self.bend([x, y], step);
                    let rejected = above(bend, limit);
                    for y in y..(y + step).min(height) {
                        let row = y * width + x..y * width + (x + step).min(width);
                        pending[row].iter_mut().for_each(|p| *p &= rejected);
                    }
                }
            }
        }
        Ok(())
    }

    /// Samples the pixels that are still pending.
    fn sample(&mut self, pending: &[bool], bends: &Bends, lesson: &Lesson) -> Result<Refiner<'a>, Stop> {
        let pixels: Vec<u32> =
            (0..pending.len()).filter(|p| pending[*p]).map(|p| p as u32 + self.first).collect();
        let guards: Vec<f32> = pixels.iter().map(|pixel| bends.at((pixel - self.first) as usize)).collect();
        let mut refiner = Refiner::new(self.shading, pixels);
        let learned =
            |samples: u32| lesson.samples.iter().find(|(n, _)| *n == samples).map(|(_, limit)| *limit);
        for samples in rounds(FEWEST.min(self.wanted.most), self.wanted.most) {
            if refiner.active.is_empty() {
                break;
            }
            // The pilot did not need so many: these pixels are rare.
            let limit = learned(samples).unwrap_or(RARE * self.wanted.error);
            // No pixel would stop here, and fewer rounds are quicker.
            if limit < 0.0 && samples < self.wanted.most {
                continue;
            }
            refiner.round(samples)?;
            refiner.settle(|slot, error| estimate(error, guards[slot], samples) <= limit);
        }
        Ok(refiner)
    }

    fn image(&mut self, truth: &Pilot, refined: Refiner<'a>) -> Image {
        let mut image = Image { frame: std::mem::take(&mut self.said), ..Image::default() };
        let mut samples: Vec<u32> = self.known.iter().map(|known| u32::from(*known)).collect();
        let mut values = std::mem::take(&mut self.values);
        let means = refined.means();
        for (slot, pixel) in refined.pixels().iter().enumerate() {
            let at = (pixel - self.first) as usize;
            samples[at] = refined.each[slot];
            values.iter_mut().zip(&means).for_each(|(plane, means)| plane[at] = means[slot]);
        }
        for (slot, pixel) in truth.pixels.iter().enumerate() {
            samples[*pixel as usize] = truth.samples[slot];
            for (plane, truth) in values.iter_mut().zip(&truth.values) {
                plane[*pixel as usize] = truth[slot];
            }
        }
        image.frame.add(refined.said);
        image.tally.pixels = self.known.len() as u64;
        image.tally.evaluations = self.evaluations + refined.evaluations + truth.evaluations;
        image.tally.note_all(samples.into_iter());
        image.tally.unfinished = refined.active.len() as u64;
        image.tally.not_finite = not_finite(&values);
        image.frame.planes = self.shading.filled(values);
        image
    }
}

/// Whether an estimate is above a limit, or none.
fn above(estimate: f32, limit: f32) -> bool {
    !matches!(estimate.partial_cmp(&limit), Some(std::cmp::Ordering::Less | std::cmp::Ordering::Equal))
}

/// The error of a pixel with samples: their standard error, and an `n`th of what the lattice around it says, for what may hide
/// between them.
fn estimate(error: f32, bend: f32, samples: u32) -> f32 {
    if bend.is_finite() { error.max(bend / samples as f32) } else { error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_above_every_limit() {
        assert!(above(f32::NAN, 1.0) && above(2.0, 1.0) && !above(1.0, 1.0));
    }
}
