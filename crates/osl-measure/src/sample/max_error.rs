//! An image whose error stays below a bound, with the least work.
//!
//! No formula knows how far estimates can be trusted for a shader that it has not seen. So the image is tried first: a few
//! hundred pixels, the pilot, get so many samples that they serve as truth. Then each way of computing a pixel is
//! judged by them, from the cheapest on: interpolated from every fourth pixel, from every second, its centre alone, 4, 8,
//! 16 … samples. Each has an estimate of its error, and the pilot tells up to which estimate no pixel of it was worse than
//! the bound. Pixels are then computed in the cheapest way whose estimate stays below that. A way that the pilot finds
//! useless is left out, so that noise costs no lattice, and a smooth image no samples.

use super::adapt::{FEWEST, Refiner, power_below, rounds};
use super::image::{Image, Shading, not_finite};
use super::oracle::some_pixels;
use super::rate::mix;
use osl_exec::{Frame, Stop};
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
const PEEK: (usize, usize, usize) = (256, 256, 1024);
/// The same of the pilot of an image that is not smooth throughout: one of a thousand pixels is to be noticed.
const PILOT: (usize, usize, usize) = (100, 2048, 4096);
/// The largest estimates that are trusted whatever the pilot says, as shares of the bound: it may have missed what is rare.
/// Of lattices; of a pixel's centre, which may be on either side of an edge; of standard errors.
const TRUSTED: [f32; 3] = [1.0, 0.25, 0.5];
/// The same of pixels that have more samples than the pilot needed.
const RARE: f32 = 0.3;
/// How far from the lattice samples may be that agree with it, as a share of the bound.
const AGREED: f32 = 0.75;
/// Pixels of which there is something to learn.
const FEW: usize = 8;
/// Samples until a pixel that disagrees with the lattice is believed.
const DOUBTS: u32 = 64;
/// The fewest and the most samples without which a pilot's pixel does not count as truth: as many as would see what covers
/// so much of a pixel that it matters.
const WITNESSES: (f32, f32) = (8.0, 64.0);
/// A pixel of the pilot that comes this close to the bound counts as beyond it.
const CLOSE: f32 = 0.9;
/// How far below the estimate of the best pixel that failed an estimate has to be.
const BELOW_FAILED: f32 = 0.8;
/// Share of the bound that the standard error of a pilot's pixel may be.
const REFERENCE: f32 = 1.0 / 8.0;
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

/// What the pilot taught: up to which estimates ways of computing a pixel are to be trusted.
#[derive(Debug, Default)]
struct Lesson {
    coarse: f32,
    /// Every second pixel, and each one's centre; `None` where it does not pay.
    fine: Option<f32>,
    centre: Option<f32>,
    /// By rounds.
    samples: Vec<(u32, f32)>,
}

impl Lesson {
    /// What was taught of every second pixel, or of each.
    fn at(&mut self, step: usize) -> &mut Option<f32> {
        if step == 1 { &mut self.centre } else { &mut self.fine }
    }
}

/// Nothing is trusted.
const NEVER: f32 = -1.0;

impl<'a> Work<'_, 'a> {
    fn run(&mut self) -> Result<Image, Stop> {
        let count = self.width * self.height;
        self.values = vec![vec![0.0; count]; self.shading.planes().len()];
        self.lattice(COARSE, |_| true)?;
        let bends = self.bends(COARSE);
        let truth = self.pilot(&bends)?;
        let lesson = self.learn(&truth, &bends)?;

        let mut pending: Vec<bool> = bends.iter().map(|bend| above(*bend, lesson.coarse)).collect();
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

    /// Chooses the pilot and has its samples taken. A smooth image is one on which a few samples of some hundred pixels agree
    /// with the lattice; these are its pilot then.
    fn pilot(&mut self, bends: &[f32]) -> Result<Pilot, Stop> {
        let count = self.width * self.height;
        let choose = |(each, fewest, most): (usize, usize, usize), seed: u32| {
            some_pixels(count, (count / each).clamp(fewest, most), seed)
        };
        let peek = choose(PEEK, self.first ^ 0x9110);
        let mut refiner = self.refiner(&peek);
        refiner.round(FEWEST.min(self.wanted.most))?;
        // A few that disagree may only have had bad luck with their samples.
        while refiner.samples < DOUBTS {
            let agree: Vec<bool> =
                (0..peek.len()).map(|slot| self.agrees(&refiner, &peek, slot, bends)).collect();
            refiner.settle(|slot, _| agree[slot]);
            if refiner.active.is_empty() || refiner.active.len() * 50 > peek.len() {
                break;
            }
            refiner.round(2 * refiner.samples)?;
        }
        if refiner.active.is_empty() {
            return Pilot::new(self, peek, refiner, 0);
        }
        self.evaluations += refiner.evaluations;
        self.said.add(std::mem::take(&mut refiner.said));
        let pilot = choose(PILOT, self.first ^ 0x2b07);
        let mut refiner = self.refiner(&pilot);
        refiner.round(FEWEST.min(self.wanted.most))?;
        let (fewest, most) = WITNESSES;
        let witnesses = (0.5 * self.range() / self.wanted.error).clamp(fewest, most) as u32;
        Pilot::new(self, pilot, refiner, witnesses.next_power_of_two())
    }

    /// How far apart values of the lattice are, the most of all planes.
    fn range(&self) -> f32 {
        let range = |plane: &Vec<f32>| {
            let finite = plane.iter().filter(|x| x.is_finite());
            let (low, high) = finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
            (high - low).max(0.0)
        };
        self.values.iter().map(range).fold(0.0, f32::max)
    }

    fn refiner(&self, pixels: &[u32]) -> Refiner<'a> {
        Refiner::new(self.shading, pixels.iter().map(|pixel| pixel + self.first).collect())
    }

    /// Whether the samples of a pixel agree with the lattice around it, and the lattice with itself. How the samples differ
    /// says little then: by the slope.
    fn agrees(&self, refiner: &Refiner<'_>, pixels: &[u32], slot: usize, bends: &[f32]) -> bool {
        let limit = AGREED * self.wanted.error;
        let pixel = pixels[slot] as usize;
        let near = |(sums, values): (&Vec<super::error::Block>, &Vec<f32>)| {
            !above((sums[slot].mean() - values[pixel]).abs(), limit)
        };
        !above(bends[pixel], self.wanted.error)
            && refiner.sums.iter().zip(&self.values).all(near)
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

    /// The corners of a cell of a lattice: left, right, top, bottom.
    fn cell(&self, x: usize, y: usize, step: usize) -> [usize; 4] {
        let (left, top) = (x / step * step, y / step * step);
        [left, (left + step).min(self.width - 1), top, (top + step).min(self.height - 1)]
    }

    /// Computes the corners of those cells that are wanted, by their top left corner, and interpolates inside.
    fn lattice(&mut self, step: usize, wanted: impl Fn(usize) -> bool) -> Result<(), Stop> {
        let mut corners = Vec::new();
        let mut cells = Vec::new();
        for y in (0..self.height).step_by(step) {
            for x in (0..self.width).step_by(step) {
                if wanted(y * self.width + x) {
                    let [left, right, top, bottom] = self.cell(x, y, step);
                    cells.push([left, right, top, bottom]);
                    for y in [top, bottom] {
                        corners.extend([left, right].map(|x| (y * self.width + x) as u32));
                    }
                }
            }
        }
        self.centres(corners)?;
        if step > 1 {
            let (width, known) = (self.width, &self.known);
            for values in &mut self.values {
                cells.iter().for_each(|cell| interpolate(values, known, width, *cell));
            }
        }
        Ok(())
    }

    /// For each pixel, the estimate of its error if it is interpolated from a lattice: an eighth of how the lattice bends at
    /// the corners around it.
    fn bends(&self, step: usize) -> Vec<f32> {
        let mut bends = vec![0.0; self.width * self.height];
        for y in (0..self.height).step_by(step) {
            for x in (0..self.width).step_by(step) {
                let bend = self.bend([x, y], step, |plane, x, y| plane.get(y * self.width + x).copied());
                for y in y..(y + step).min(self.height) {
                    bends[y * self.width + x..y * self.width + (x + step).min(self.width)].fill(bend);
                }
            }
        }
        bends
    }

    fn bend(
        &self,
        [x, y]: [usize; 2],
        step: usize,
        at: impl Fn(&[f32], usize, usize) -> Option<f32>,
    ) -> f32 {
        let [left, right, top, bottom] = self.cell(x, y, step);
        let (mut across, mut down) = (0.0_f32, 0.0_f32);
        let second = |before: Option<f32>, here: Option<f32>, behind: Option<f32>| match (before, here, behind) {
            (Some(a), Some(b), Some(c)) => {
                let d = (a - 2.0 * b + c).abs();
                if d.is_nan() { f32::INFINITY } else { d }
            }
            _ => 0.0,
        };
        let inside = |x: Option<usize>, n: usize| x.filter(|x| *x < n);
        for plane in &self.values {
            let at = |x: Option<usize>, y: Option<usize>| at(plane, inside(x, self.width)?, inside(y, self.height)?);
            let (columns, lines) =
                if step == 1 { (&[left][..], &[top][..]) } else { (&[left, right][..], &[top, bottom][..]) };
            for y in lines {
                for x in columns {
                    let here = at(Some(*x), Some(*y));
                    let (before, behind) = (x.checked_sub(step), Some(x + step));
                    across = across.max(second(at(before, Some(*y)), here, at(behind, Some(*y))));
                    let (above, below) = (y.checked_sub(step), Some(y + step));
                    down = down.max(second(at(Some(*x), above), here, at(Some(*x), below)));
                    if step == 1 {
                        // What is as small as a pixel may touch its corner alone.
                        across = across.max(second(at(before, above), here, at(behind, below)));
                        down = down.max(second(at(before, below), here, at(behind, above)));
                    }
                }
            }
        }
        (across + down) / 8.0
    }

    /// Judges the ways of computing a pixel by the pilot.
    fn learn(&mut self, truth: &Pilot, bends: &[f32]) -> Result<Lesson, Stop> {
        let mut lesson = Lesson::default();
        let mut left: Vec<usize> = (0..truth.pixels.len()).collect();
        let pixel = |slot: &usize| truth.pixels[*slot] as usize;
        let tried: Vec<Tried> = left
            .iter()
            .map(|slot| (bends[pixel(slot)], truth.distance(*slot, |plane| self.values[plane][pixel(slot)])))
            .collect();
        let [lattice, centre, samples] = TRUSTED;
        (lesson.coarse, left) = trust(&tried, &left, self.wanted.error, lattice);
        for step in [2, 1] {
            // Of few pixels there is little to learn: these ways are then as good as their estimates.
            if left.len() < FEW {
                let most = if step == 1 { centre } else { lattice } * self.wanted.error;
                *lesson.at(step) = Some(most);
                continue;
            }
            let tried = self.try_step(step, truth, &left)?;
            let most = if step == 1 { centre } else { lattice };
            let (limit, rest) = trust(&tried, &left, self.wanted.error, most);
            // A lattice that rejects most pixels costs more than it saves.
            let pays = (left.len() - rest.len()) * [0, 5, 4][step] > left.len();
            if pays {
                *lesson.at(step) = Some(limit);
                left = rest;
            }
        }
        for round in &truth.rounds {
            if left.is_empty() {
                break;
            }
            let tried: Vec<Tried> = left
                .iter()
                .map(|slot| round.tried(truth, *slot, bends[pixel(slot)]))
                .collect();
            let (limit, rest) = trust(&tried, &left, self.wanted.error, samples);
            lesson.samples.push((round.samples, limit));
            left = rest;
        }
        Ok(lesson)
    }

    /// Tries a finer lattice around pixels of the pilot, without keeping it: neighbours are to be left as they are.
    fn try_step(&mut self, step: usize, truth: &Pilot, slots: &[usize]) -> Result<Vec<Tried>, Stop> {
        let width = self.width;
        let around = |pixel: u32| {
            let (x, y) = (pixel as usize % width, pixel as usize / width);
            let [left, right, top, bottom] = self.cell(x, y, step);
            let (far, low) = if step == 1 { (left + 1, top + 1) } else { (right + step, bottom + step) };
            let columns = [left.saturating_sub(step), left, right, far].map(|x| x.min(self.width - 1));
            let lines = [top.saturating_sub(step), top, bottom, low].map(|y| y.min(self.height - 1));
            lines.into_iter().flat_map(move |y| columns.map(|x| (y * width + x) as u32))
        };
        let mut needed: Vec<u32> = slots.iter().flat_map(|slot| around(truth.pixels[*slot])).collect();
        needed.sort_unstable();
        needed.dedup();
        let (known, values) = (self.known.clone(), self.values.clone());
        self.centres(needed)?;
        let tried = slots
            .iter()
            .map(|slot| {
                let pixel = truth.pixels[*slot] as usize;
                let (x, y) = (pixel % width, pixel / width);
                let bend = self.bend([x, y], step, |plane, x, y| plane.get(y * width + x).copied());
                let cell = self.cell(x, y, step);
                let distance = truth.distance(*slot, |plane| match step {
                    1 => self.values[plane][pixel],
                    _ => between(&self.values[plane], width, cell, [x, y]),
                });
                (bend, distance)
            })
            .collect();
        (self.known, self.values) = (known, values);
        Ok(tried)
    }

    /// Computes a finer lattice where pixels are pending, and settles those whose estimate is small enough.
    fn finer(&mut self, step: usize, pending: &mut [bool], limit: f32) -> Result<(), Stop> {
        let (width, height) = (self.width, self.height);
        let any = |pending: &[bool], at: usize| {
            let (x, y) = (at % width, at / width);
            let mut inside =
                (y..(y + step).min(height)).flat_map(|y| (x..(x + step).min(width)).map(move |x| y * width + x));
            inside.any(|pixel| pending[pixel])
        };
        self.lattice(step, |at| any(pending, at))?;
        for y in (0..height).step_by(step) {
            for x in (0..width).step_by(step) {
                if any(pending, y * width + x) {
                    let bend = self.bend([x, y], step, |plane, x, y| plane.get(y * width + x).copied());
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
    fn sample(&mut self, pending: &[bool], bends: &[f32], lesson: &Lesson) -> Result<Refiner<'a>, Stop> {
        let pixels: Vec<u32> =
            (0..pending.len()).filter(|p| pending[*p]).map(|p| p as u32 + self.first).collect();
        let guards: Vec<f32> =
            pending.iter().zip(bends).filter(|(pending, _)| **pending).map(|(_, bend)| *bend).collect();
        let mut refiner = Refiner::new(self.shading, pixels);
        let learned = |samples: u32| lesson.samples.iter().find(|(n, _)| *n == samples).map(|(_, limit)| *limit);
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
        samples.iter().for_each(|n| image.tally.note(*n, 1));
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

/// An estimate of an error, and the error.
type Tried = (f32, f32);

/// Up to which estimate a way of computing pixels is to be trusted, and the pixels that are left for the next one.
fn trust(tried: &[Tried], slots: &[usize], bound: f32, most: f32) -> (f32, Vec<usize>) {
    let failed = |(_, error): &&Tried| above(*error, CLOSE * bound);
    let best_failed = tried.iter().filter(failed).map(|(e, _)| *e).fold(f32::INFINITY, f32::min);
    let limit = if best_failed > 0.0 { (most * bound).min(BELOW_FAILED * best_failed) } else { NEVER };
    let rest: Vec<usize> =
        slots.iter().zip(tried).filter(|(_, (e, _))| above(*e, limit)).map(|(slot, _)| *slot).collect();
    if rest.len() == slots.len() { (NEVER, rest) } else { (limit, rest) }
}

/// Interpolates the pixels of a cell that are not known. The last row and column of a band belong to its last cells.
fn interpolate(values: &mut [f32], known: &[bool], width: usize, cell: [usize; 4]) {
    let [left, right, top, bottom] = cell;
    for y in top..=bottom {
        for x in left..=right {
            let at = y * width + x;
            if !known[at] {
                values[at] = between(values, width, cell, [x, y]);
            }
        }
    }
}

/// The value at a place within a cell, from its corners.
fn between(values: &[f32], width: usize, [left, right, top, bottom]: [usize; 4], [x, y]: [usize; 2]) -> f32 {
    let share = |at: usize, from: usize, to: usize| (at - from) as f32 / (to - from).max(1) as f32;
    let (s, t) = (share(x, left, right), share(y, top, bottom));
    let line = |y: usize| mix(values[y * width + left], values[y * width + right], s);
    mix(line(top), line(bottom), t)
}

/// Pixels with so many samples that they serve as truth.
struct Pilot {
    /// Numbers within the band.
    pixels: Vec<u32>,
    /// Samples of each.
    samples: Vec<u32>,
    /// For each plane, their values.
    values: Vec<Vec<f32>>,
    /// What fewer samples would have said.
    rounds: Vec<Round>,
    evaluations: u64,
}

/// The pixels of a pilot after some samples.
struct Round {
    samples: u32,
    /// By pixel, the standard error; not a number for those that had stopped.
    errors: Vec<f32>,
    values: Vec<Vec<f32>>,
}

impl Pilot {
    /// Takes samples until they serve as truth. The refiner has done its first round.
    fn new(
        work: &mut Work<'_, '_>,
        pixels: Vec<u32>,
        mut refiner: Refiner<'_>,
        witnesses: u32,
    ) -> Result<Pilot, Stop> {
        let mut history = Vec::new();
        let most = power_below(work.wanted.most.saturating_mul(REFERENCE_MORE));
        while !refiner.active.is_empty() {
            let samples = refiner.samples;
            if samples <= work.wanted.most {
                let mut errors = vec![f32::NAN; pixels.len()];
                refiner.active.iter().for_each(|slot| errors[*slot] = refiner.error(*slot));
                history.push(Round { samples, errors, values: refiner.means() });
            }
            let enough = REFERENCE * work.wanted.error;
            refiner.settle(|_, error| samples >= witnesses && error <= enough);
            if refiner.active.is_empty() || 2 * samples > most {
                break;
            }
            refiner.round(2 * samples)?;
        }
        work.said.add(std::mem::take(&mut refiner.said));
        Ok(Pilot {
            pixels,
            samples: refiner.each.clone(),
            values: refiner.means(),
            rounds: history,
            evaluations: refiner.evaluations,
        })
    }

    /// How far values are from the truth, the most of all planes; 0 where the truth is no number, which nothing mends.
    fn distance(&self, slot: usize, value: impl Fn(usize) -> f32) -> f32 {
        let mut worst = 0.0_f32;
        for (plane, truth) in self.values.iter().enumerate() {
            let truth = truth[slot];
            let distance = (value(plane) - truth).abs();
            if truth.is_finite() {
                worst = worst.max(if distance.is_nan() { f32::INFINITY } else { distance });
            }
        }
        worst
    }
}

impl Round {
    /// Estimate and error of a pixel in this round. The truth contains these samples; without them it would be further away.
    fn tried(&self, truth: &Pilot, slot: usize, bend: f32) -> Tried {
        let share = self.samples as f32 / truth.samples[slot].max(1) as f32;
        let error = self.errors[slot];
        if share >= 1.0 || error.is_nan() {
            return (estimate(if error.is_nan() { 0.0 } else { error }, bend, self.samples), 0.0);
        }
        let distance = truth.distance(slot, |plane| self.values[plane][slot]);
        (estimate(error, bend, self.samples), distance / (1.0 - share).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trust_ends_below_the_best_pixel_that_failed() {
        let slots = [0, 1, 2, 3];
        let (limit, rest) = trust(&[(0.1, 0.0), (0.2, 0.5), (0.5, 2.0), (0.3, 0.2)], &slots, 1.0, 1.0);
        assert!((limit - 0.4).abs() < 1e-6, "{limit}");
        assert_eq!(rest, [2]);
        let (limit, rest) = trust(&[(0.1, 0.0), (0.3, 0.1)], &slots[..2], 1.0, 0.25);
        assert_eq!((limit, &rest[..]), (0.25, &[1][..]), "never beyond what is trusted anyway");
        let (limit, rest) = trust(&[(0.0, 5.0), (0.2, 0.1)], &slots[..2], 1.0, 1.0);
        assert_eq!((limit, rest.len()), (NEVER, 2), "an estimate of 0 that fails is worth nothing");
    }

    #[test]
    fn what_is_no_number_is_above_every_limit() {
        assert!(above(f32::NAN, 1.0) && above(2.0, 1.0) && !above(1.0, 1.0));
    }

    #[test]
    fn a_cell_is_filled_between_its_corners() {
        let mut values = vec![0.0; 25];
        let mut known = vec![false; 25];
        for (at, x) in [(0, 0.0), (4, 4.0), (20, 8.0), (24, 12.0)] {
            (values[at], known[at]) = (x, true);
        }
        interpolate(&mut values, &known, 5, [0, 4, 0, 4]);
        assert_eq!((values[12], values[2], values[10]), (6.0, 2.0, 4.0));
    }
}
