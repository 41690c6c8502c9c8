//! The inputs of an image, runs of the program at some of its pixels, and what an image consists of.

use super::error::Weights;
use super::error::{Block, Shown, blocks};
use super::filter::Filter;
use super::pattern::Pattern;
use super::points::SamplePoints;
use super::round::{Found, Round, STEP, Sums};
use super::surface::Surface;
use osl_exec::{Frame, Plane, PointSource, Program, Run, RunError, RunOptions, Services};
use osl_ir::ir::Kind;
use rayon::prelude::*;
use std::ops::Range;

/// Points held in memory at a time, unless one pixel has more.
pub(super) const TOGETHER: usize = 1 << 19;
/// The largest and the smallest number of points that a thread handles at a time, unless one pixel has more.
const PIECE: (usize, usize) = (1 << 15, 1 << 12);
/// The number of pieces into which points are divided if there are enough.
const PARTS: usize = 8;
/// The number of tiles of a run of few points, and the smallest number of points of a tile.
const TILES: usize = 4;
const TILE: usize = 512;
/// Pieces whose results are kept until those before them are there.
pub(super) const PIECES: usize = 64;

/// A program with everything needed to run it at any position of an image.
#[derive(Clone)]
pub struct Shading<'a> {
    /// The program.
    pub program: &'a Program,
    /// Textures, spaces and the ray type.
    pub services: &'a Services,
    /// The points.
    pub surface: &'a dyn Surface,
    /// Options of the run.
    pub options: &'a RunOptions,
    /// The same shader in a cheaper arithmetic. It may be used where its error is permitted.
    pub cheaper: Option<&'a Program>,
    /// Where the samples lie.
    pub pattern: Pattern,
    /// The reconstruction filter.
    pub filter: Filter,
}

/// An image, or some rows of it.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// The planes, as floats, and the messages of the program.
    pub frame: Frame,
    /// What the image cost.
    pub tally: Tally,
    /// Samples of each pixel.
    pub samples: PixelSamples,
}

/// How many samples each pixel of an image has, 0 where it was interpolated.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum PixelSamples {
    /// The plan alone says it: all pixels have the same number, or there is one for several.
    #[default]
    Planned,
    /// One or none: whether the centre of the pixel was computed.
    Centres(Vec<bool>),
    /// Any number.
    Each(Vec<u32>),
}

impl PixelSamples {
    /// The number of each pixel, unless the plan says it.
    pub fn each(&self) -> impl Iterator<Item = u32> + '_ {
        let (centres, each) = match self {
            PixelSamples::Planned => (&[][..], &[][..]),
            PixelSamples::Centres(known) => (&known[..], &[][..]),
            PixelSamples::Each(each) => (&[][..], &each[..]),
        };
        centres.iter().map(|known| u32::from(*known)).chain(each.iter().copied())
    }
}

/// What an image cost, and what is known of its error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of pixels.
    pub pixels: u64,
    /// Evaluations of the shader.
    pub evaluations: u64,
    /// Pairs of a sample count and the number of pixels with that count; 0 samples are interpolated pixels.
    pub by_samples: Vec<(u32, u64)>,
    /// Pixels that need more samples than the maximum.
    pub unfinished: u64,
    /// Pixels that probably exceed the error bound, because their samples do not suffice. It is estimated
    /// from the pixels that were sampled first.
    pub above: f64,
    /// Pixels with a value that is NaN or infinite.
    pub not_finite: u64,
    /// The comparison with the cheaper arithmetic, if it was used.
    pub cheaper: Option<Cheaper>,
}

/// How a cheaper arithmetic compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cheaper {
    /// Samples that were computed in both.
    pub compared: u64,
    /// The largest difference, in the units of the outputs.
    pub largest: f32,
    /// Pixels that were sampled in it.
    pub pixels: u64,
}

impl Tally {
    /// Adds the tally of other pixels.
    pub fn add(&mut self, other: &Tally) {
        self.pixels += other.pixels;
        self.evaluations += other.evaluations;
        self.unfinished += other.unfinished;
        self.above += other.above;
        self.not_finite += other.not_finite;
        if let Some(other) = other.cheaper {
            let own = self.cheaper.get_or_insert_default();
            own.compared += other.compared;
            own.largest = own.largest.max(other.largest);
            own.pixels += other.pixels;
        }
        for (samples, pixels) in &other.by_samples {
            self.note(*samples, *pixels);
        }
    }

    /// Records some pixels with the same number of samples.
    pub(super) fn note(&mut self, samples: u32, pixels: u64) {
        match self.by_samples.binary_search_by_key(&samples, |(n, _)| *n) {
            Ok(at) => self.by_samples[at].1 += pixels,
            Err(at) if pixels > 0 => self.by_samples.insert(at, (samples, pixels)),
            Err(_) => {}
        }
    }

    /// Records that the centres of some pixels were computed, at most all, and the others interpolated.
    pub(super) fn note_centres(&mut self, computed: u64) {
        let computed = computed.min(self.pixels);
        self.note(1, computed);
        self.note(0, self.pixels - computed);
    }

    /// Records the sample counts of pixels, one after the other.
    pub(super) fn note_all(&mut self, samples: impl Iterator<Item = u32>) {
        // Most pixels have the number of the one before, and nearly all numbers are 0 or powers of two.
        let mut counts = [0; 33];
        let (mut number, mut count) = (0_u32, 0);
        for n in samples.map(Some).chain([None]) {
            if n == Some(number) {
                count += 1;
                continue;
            }
            let place = u32::BITS - number.leading_zeros();
            match counts.get_mut(place as usize).filter(|_| number & number.wrapping_sub(1) == 0) {
                Some(all) => *all += count,
                None => self.note(number, count),
            }
            (number, count) = (n.unwrap_or(0), 1);
        }
        for (count, place) in counts.into_iter().zip(0..) {
            self.note(if place == 0 { 0 } else { 1 << (place - 1) }, count);
        }
    }

    /// Evaluations for each pixel.
    pub fn per_pixel(&self) -> f64 {
        self.evaluations as f64 / self.pixels.max(1) as f64
    }
}

/// Sums over the samples of some pixels, plane by plane.
#[derive(Clone, Debug, Default)]
pub(super) struct Batch {
    /// For each plane, for each pixel.
    pub(super) blocks: Vec<Vec<Block>>,
    /// Messages and the like, without planes.
    pub(super) said: Frame,
}

impl<'a> Shading<'a> {
    /// Whether the planes of this many pixels fit in memory.
    ///
    /// # Errors
    /// They do not fit.
    pub fn fits(&self, pixels: usize) -> Result<(), RunError> {
        let none = SamplePoints::centres(self.surface, &[], (&self.pattern, &self.filter));
        Run::new(self.program, self.services, &none, self.options).fits(pixels)
    }

    /// The planes of an image, without their values; empty if they would exceed what a run may yield.
    pub fn planes(&self) -> Vec<Plane> {
        let pixels = SamplePoints::centres(self.surface, &[], (&self.pattern, &self.filter));
        let planes = Run::new(self.program, self.services, &pixels, self.options).planes();
        let mut planes = planes.unwrap_or_default();
        planes.iter_mut().for_each(|plane| plane.kind = Kind::Float);
        planes
    }

    /// The centres of pixels: for each plane the values of the pixels.
    pub(super) fn centres(&self, pixels: &[u32], said: &mut Frame) -> Result<Vec<Vec<f32>>, RunError> {
        self.values(&SamplePoints::centres(self.surface, pixels, (&self.pattern, &self.filter)), said)
    }

    /// The first samples of pixels, with their weights: for each plane the values of the pixels.
    pub(super) fn firsts(&self, pixels: &[u32], said: &mut Frame) -> Result<Vec<Vec<f32>>, RunError> {
        if !self.is_signed() {
            return self.samples(pixels, 0..1, said);
        }
        let (means, more) = self.means(pixels, 0..1)?;
        said.add(more, &self.options.limits.running);
        Ok(means)
    }

    /// Samples of a few pixels: for each plane the values, all samples of a pixel in sequence.
    pub(super) fn samples(
        &self,
        pixels: &[u32],
        samples: Range<u32>,
        said: &mut Frame,
    ) -> Result<Vec<Vec<f32>>, RunError> {
        self.values(&SamplePoints::new(self.surface, pixels, samples, (&self.pattern, &self.filter)), said)
    }

    /// For each plane the values of some points.
    pub(super) fn values(
        &self,
        points: &dyn PointSource,
        said: &mut Frame,
    ) -> Result<Vec<Vec<f32>>, RunError> {
        let mut frame = self.run(points, 0..points.count())?;
        let planes = std::mem::take(&mut frame.planes);
        said.add(frame, &self.options.limits.running);
        Ok(planes.into_iter().map(|plane| plane.into_float_words().into_floats()).collect())
    }

    /// Samples pixels and sums up each.
    pub(super) fn batch(&self, pixels: &[u32], samples: Range<u32>) -> Result<Batch, RunError> {
        let (blocks, said) = self.summed(pixels, samples, |block| block)?;
        Ok(Batch { blocks, said })
    }

    /// The means of pixels, plane by plane, and the messages and the like.
    fn means(&self, pixels: &[u32], samples: Range<u32>) -> Result<(Vec<Vec<f32>>, Frame), RunError> {
        self.summed(pixels, samples, |block| block.mean())
    }

    /// What `of` makes of the sums of each pixel, plane by plane, and the messages and the like.
    fn summed<T: Send>(
        &self,
        pixels: &[u32],
        samples: Range<u32>,
        of: impl Fn(Block) -> T + Sync,
    ) -> Result<(Vec<Vec<T>>, Frame), RunError> {
        let each = samples.len().max(1);
        let mut all: Vec<Vec<T>> = self.planes().iter().map(|_| Vec::with_capacity(pixels.len())).collect();
        let mut all_said = Frame::default();
        let piece = |shading: &Shading<'_>, pixels: &[u32]| {
            let mut said = Frame::default();
            let (planes, signs) = shading.sampled(pixels, samples.clone(), &mut said)?;
            let sums = |plane: &Plane| blocks((&plane.words, plane.kind), each, &signs, &of);
            Ok((planes.iter().map(sums).collect::<Vec<_>>(), said))
        };
        self.side_by_side((pixels, self.pixels_of(pixels.len(), each)), piece, |_, (found, said)| {
            all_said.add(said, &self.options.limits.running);
            all.iter_mut().zip(found).for_each(|(all, found)| all.extend(found));
        })?;
        Ok((all, all_said))
    }

    /// Takes a round of samples of those of some pixels that `slots` chooses; `take` gets slots and what the
    /// round found of them. `before` has the sums of all pixels. The errors are found if `estimate` is set.
    pub(super) fn round(
        &self,
        (pixels, slots): (&[u32], &[usize]),
        (samples, estimate): (Range<u32>, bool),
        (sums, weights): (&mut Sums, &Weights),
        said: &mut Frame,
        mut take: impl FnMut(&[usize], &Found),
    ) -> Result<(), RunError> {
        let each = samples.len().max(1);
        let shown = if estimate { Shown::new(&self.pattern, &samples) } else { None };
        let before = &*sums;
        let piece = |shading: &Shading<'_>, slots: &[usize]| {
            let some: Vec<u32> = slots.iter().filter_map(|slot| pixels.get(*slot)).copied().collect();
            let mut said = Frame::default();
            let (planes, signs) = shading.sampled(&some, samples.clone(), &mut said)?;
            let shown = shown.as_ref();
            let number = |pixel: &u32| self.surface.pixel(*pixel as usize) as u32;
            let numbers: Vec<u32> = shown.map_or_else(Vec::new, |_| some.iter().map(number).collect());
            let round = Round { planes: &planes, signs: &signs, each, samples: samples.end, shown, weights };
            Ok((round.of(slots, &numbers, before), said))
        };
        let mut all = Vec::new();
        self.side_by_side((slots, self.pixels_of(slots.len(), each)), piece, |slots, (found, more)| {
            said.add(more, &self.options.limits.running);
            take(slots, &found);
            all.push((slots, found));
        })?;
        all.iter().for_each(|(slots, found)| sums.take(slots, found));
        Ok(())
    }

    /// Splits a list into pieces of a size and handles them side by side. `piece` gets a shading that runs on
    /// the calling thread, `take` gets the results in order. The size must not depend on the number of
    /// threads, because what a point is charged depends on the points beside it.
    pub(super) fn side_by_side<'l, T: Sync, R: Send>(
        &self,
        (list, size): (&'l [T], usize),
        piece: impl Fn(&Shading<'_>, &[T]) -> Result<R, RunError> + Sync,
        mut take: impl FnMut(&'l [T], R),
    ) -> Result<(), RunError> {
        if list.len() <= size || self.options.threads == Some(1) {
            for list in list.chunks(size) {
                take(list, piece(self, list)?);
            }
            return Ok(());
        }
        let options = RunOptions { threads: Some(1), ..self.options.clone() };
        let shading = Shading { options: &options, ..self.clone() };
        for list in list.chunks(size * PIECES) {
            let found: Result<Vec<R>, RunError> =
                list.par_chunks(size).map(|list| piece(&shading, list)).collect();
            list.chunks(size).zip(found?).for_each(|(list, found)| take(list, found));
        }
        Ok(())
    }

    /// Of so many pixels with so many samples each, those that a thread handles at a time: fewer if several
    /// threads are to have some.
    fn pixels_of(&self, pixels: usize, samples: usize) -> usize {
        let (most, least) = PIECE;
        let is_alone = self.options.threads == Some(1);
        let points = if is_alone { most } else { (pixels * samples / PARTS).clamp(least, most) };
        (points / samples).max(1).next_multiple_of(STEP)
    }

    /// Samples of pixels, plane by plane, and their weights unless all are 1.
    fn sampled(
        &self,
        pixels: &[u32],
        samples: Range<u32>,
        said: &mut Frame,
    ) -> Result<(Vec<Plane>, Vec<f32>), RunError> {
        let tools = (&self.pattern, &self.filter);
        let points = SamplePoints::new(self.surface, pixels, samples.clone(), tools);
        let mut frame = self.run(&points, 0..points.count())?;
        let planes = std::mem::take(&mut frame.planes);
        said.add(frame, &self.options.limits.running);
        Ok((planes, self.signs(pixels, samples)))
    }

    /// Whether samples have weights.
    fn is_signed(&self) -> bool {
        self.filter.kind() == super::FilterKind::Mitchell
    }

    /// The weights of samples, pixel by pixel; empty if all are 1.
    pub(super) fn signs(&self, pixels: &[u32], samples: Range<u32>) -> Vec<f32> {
        if !self.is_signed() {
            return Vec::new();
        }
        let range = samples.start as usize..samples.end as usize;
        let number = |pixel: &u32| self.surface.pixel(*pixel as usize) as u32;
        let own =
            pixels.iter().flat_map(|pixel| self.pattern.of(number(pixel)).get(range.clone()).unwrap_or(&[]));
        own.map(|[x, y]| self.filter.place(*x).1 * self.filter.place(*y).1).collect()
    }

    pub(super) fn run(&self, points: &dyn PointSource, range: Range<usize>) -> Result<Frame, RunError> {
        let usual = self.options.tile;
        let tile = (range.len() / TILES).next_multiple_of(TILE);
        if tile >= usual || self.options.threads == Some(1) {
            return Run::new(self.program, self.services, points, self.options).points(range, &|_| ());
        }
        let options = RunOptions { tile, ..self.options.clone() };
        Run::new(self.program, self.services, points, &options).points(range, &|_| ())
    }

    /// Numbers of the pixels in some rows.
    pub(super) fn pixels(&self, rows: Range<usize>) -> Vec<u32> {
        let (width, height) = self.surface.size();
        let rows = rows.start.min(height)..rows.end.min(height);
        (rows.start * width..rows.end * width).map(|pixel| pixel as u32).collect()
    }

    /// Renders some rows of an image with the same number of samples in each pixel, at most as many as the
    /// pattern has. A single sample lies at the pixel's centre: its values are those of a run without
    /// samples.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn rows(&self, rows: Range<usize>, samples: u32) -> Result<Image, RunError> {
        let samples = samples.clamp(1, self.pattern.count());
        let pixels = self.pixels(rows);
        let mut said = Frame::default();
        let values = match samples {
            1 => self.centres(&pixels, &mut said)?,
            _ => {
                let (means, more) = self.means(&pixels, 0..samples)?;
                said = more;
                means
            }
        };
        let count = pixels.len() as u64;
        let mut image = self.image(values, said, (pixels.len(), count * u64::from(samples)));
        image.tally.note(samples, count);
        Ok(image)
    }

    /// The values of some pixels with a number of samples, plane by plane.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn chosen(&self, pixels: &[u32], samples: u32) -> Result<Vec<Vec<f32>>, RunError> {
        Ok(self.means(pixels, 0..samples.clamp(1, self.pattern.count()))?.0)
    }

    /// The values at the centres of pixels, which are numbered row by row: those of an image with one sample.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn at_centres(&self, pixels: &[u32]) -> Result<Vec<Vec<f32>>, RunError> {
        self.centres(pixels, &mut Frame::default())
    }

    /// An image of so many pixels with these values, which took some evaluations of the shader.
    pub(super) fn image(
        &self,
        values: Vec<Vec<f32>>,
        said: Frame,
        (pixels, evaluations): (usize, u64),
    ) -> Image {
        let (pixels, not_finite) = (pixels as u64, not_finite(&values));
        let tally = Tally { pixels, evaluations, not_finite, ..Tally::default() };
        let frame = Frame { planes: self.filled(values), ..said };
        Image { frame, tally, samples: PixelSamples::default() }
    }

    /// Planes of an image with values.
    pub(super) fn filled(&self, values: Vec<Vec<f32>>) -> Vec<Plane> {
        let mut planes = self.planes();
        for (plane, values) in planes.iter_mut().zip(values) {
            plane.words = values.into_iter().map(f32::to_bits).collect();
        }
        planes
    }
}

/// Number of pixels with a value that is NaN or infinite.
fn not_finite(planes: &[Vec<f32>]) -> u64 {
    // Some values at a time, which the compiler puts into vectors.
    let is_bad = |values: &[f32]| values.iter().fold(false, |any, x| any | !x.is_finite());
    let bad: Vec<&Vec<f32>> = planes.iter().filter(|plane| plane.chunks(256).any(is_bad)).collect();
    let pixels = bad.first().map_or(0, |plane| plane.len());
    let one = |pixel: &usize| bad.iter().any(|p| p.get(*pixel).is_some_and(|x| !x.is_finite()));
    (0..pixels).filter(one).count() as u64
}
