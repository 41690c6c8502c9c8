//! The image with the most samples per pixel that fit into a time.
//!
//! Passes over the whole image add samples to running sums, so that no sample is taken twice. Each pass at
//! most doubles the samples, and takes at most half of those that still fit, as measured on the pass before.
//! So the time is kept even on a machine that becomes slower meanwhile. The clock decides the number of
//! samples and nothing else: the image has the bits of [`Shading::rows`] with the number that was reached.

use super::error::{Block, add, steady};
use super::image::{Image, Shading, TOGETHER};
use super::oracle::some_pixels;
use super::pattern::MAX_SAMPLES;
use super::points::SamplePoints;
use osl_exec::{Frame, PointSource, RunError};
use rayon::prelude::*;
use std::ops::Range;

/// An image that was rendered within a time.
#[derive(Clone, Debug, Default)]
pub struct Timed {
    /// The image.
    pub image: Image,
    /// Samples of each pixel.
    pub samples: u32,
    /// Whether one sample per pixel fits into the time. If not, the image has one all the same.
    pub fits: bool,
    /// Seconds per evaluation of the last pass, on all threads together.
    pub each: f64,
}

/// Pixels of the first, coarse pass, which measures an evaluation: one in so many, the minimum and the
/// maximum.
const COARSE: (usize, usize, usize) = (16, 64, 16384);
/// Lower bound on the measured time of an evaluation, in seconds, whatever the clock shows.
const QUICKEST: f64 = 1e-12;

/// Renders an image with as many samples per pixel as fit before `clock` shows `end`; both are in seconds.
/// The end may depend on the samples of each pixel and the seconds of an evaluation, because what follows
/// takes time, too. `progress` is called with the passed share of the time.
///
/// # Errors
/// A loop exceeds its budget.
pub fn within(
    shading: &Shading<'_>,
    end: &dyn Fn(u32, f64) -> f64,
    clock: &(dyn Fn() -> f64 + Sync),
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Timed, RunError> {
    let height = shading.surface.size().1;
    let mut passes = Passes::new(shading, 0..height);
    let count = passes.pixels.len().max(1) as f64;
    let (one_in, fewest, most) = COARSE;
    let some = some_pixels(passes.pixels.len(), (passes.pixels.len() / one_in).clamp(fewest, most), 0x71e3);
    let begin = clock();
    shading.centres(&some, &mut Frame::default())?;
    let mut before = clock();
    let mut each = ((before - begin) / some.len().max(1) as f64).max(QUICKEST);
    // An image with one sample has it at the centres, which no other image uses.
    let mut centres: Option<Image> = None;
    let mut fits_one = false;
    loop {
        // The next pass at most doubles the samples.
        let end = end(2 * passes.samples.max(1), each);
        progress((before - begin) / (end - begin).max(QUICKEST));
        let fits = ((end - before) / (each * count)).clamp(0.0, f64::from(MAX_SAMPLES)) as u32;
        let reached = passes.samples;
        let more = if reached > 0 {
            reached.min((fits / 2).max(1)).min(fits).min(MAX_SAMPLES - reached)
        } else if fits >= 2 {
            2
        } else if centres.is_none() {
            centres = Some(shading.rows(0..height, 1)?);
            1
        } else {
            0
        };
        if more == 0 {
            break;
        }
        if reached > 0 || fits >= 2 {
            passes.add(more)?;
        }
        let now = clock();
        fits_one |= now <= end;
        each = ((now - before) / (count * f64::from(more))).max(QUICKEST);
        before = now;
    }
    let mut spent = some.len() as u64;
    let samples = passes.samples;
    let mut image = match centres {
        Some(image) if samples == 0 => image,
        Some(image) => {
            spent += image.tally.evaluations;
            passes.image()
        }
        None => passes.image(),
    };
    image.tally.evaluations += spent;
    Ok(Timed { image, samples: samples.max(1), fits: fits_one, each })
}

/// Running sums of all pixels.
struct Passes<'a> {
    shading: Shading<'a>,
    pixels: Vec<u32>,
    /// Samples of each pixel so far.
    samples: u32,
    /// For each plane, the sum of each pixel's values times their weights.
    sums: Vec<Vec<f64>>,
    /// For each pixel, the sum of the weights; empty if all weights are 1.
    weights: Vec<f64>,
    said: Frame,
}

impl<'a> Passes<'a> {
    fn new(shading: &Shading<'a>, rows: Range<usize>) -> Passes<'a> {
        let (shading, pixels) = (shading.clone(), shading.pixels(rows));
        Passes { shading, pixels, samples: 0, sums: Vec::new(), weights: Vec::new(), said: Frame::default() }
    }

    /// Adds samples to each pixel, in the order in which one pass would add them.
    fn add(&mut self, more: u32) -> Result<(), RunError> {
        let samples = self.samples..self.samples + more;
        if self.shading.pattern.count() < samples.end {
            self.shading.pattern = self.shading.pattern.clone().with(samples.end);
        }
        let (shading, each) = (&self.shading, more.max(1) as usize);
        let together = (TOGETHER / each).max(1);
        if self.sums.is_empty() {
            self.sums = vec![vec![0.0; self.pixels.len()]; shading.planes().len()];
        }
        for (at, pixels) in self.pixels.chunks(together).enumerate() {
            let tools = (&shading.pattern, &shading.filter);
            let points = SamplePoints::new(shading.surface, pixels, samples.clone(), tools);
            let mut frame = shading.run(&points, 0..points.count())?;
            let planes = std::mem::take(&mut frame.planes);
            self.said.add(frame, &shading.options.limits.running);
            let signs = shading.signs(pixels, samples.clone());
            if !signs.is_empty() {
                self.weights.resize(self.pixels.len(), 0.0);
            }
            let first = at * together;
            for (plane, sums) in planes.iter().zip(&mut self.sums) {
                let sums = sums.get_mut(first..first + pixels.len()).unwrap_or_default();
                sums.par_iter_mut().with_min_len(256).zip(plane.words.par_chunks(each)).enumerate().for_each(
                    |(at, (sum, words))| {
                        let signs = signs.get(at * each..(at + 1) * each).unwrap_or(&[]);
                        add(sum, words, plane.kind, signs);
                    },
                );
            }
            let weights = self.weights.iter_mut().skip(first);
            weights.zip(signs.chunks(each)).for_each(|(weight, signs)| {
                signs.iter().for_each(|sign| *weight += f64::from(*sign));
            });
        }
        self.samples = samples.end;
        Ok(())
    }

    fn image(self) -> Image {
        let (samples, weights) = (f64::from(self.samples), &self.weights);
        let mean = |(at, sum): (usize, &f64)| {
            let weight = weights.get(at).map_or(samples, |weight| steady(*weight));
            Block { weight, sum: *sum }.mean()
        };
        let values: Vec<Vec<f32>> =
            self.sums.iter().map(|plane| plane.iter().enumerate().map(mean).collect()).collect();
        let count = self.pixels.len() as u64;
        let evaluations = count * u64::from(self.samples);
        let mut image = self.shading.image(values, self.said, (self.pixels.len(), evaluations));
        image.tally.note(self.samples, count);
        image
    }
}
