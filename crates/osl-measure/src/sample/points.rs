//! Samples of chosen pixels, or chosen places between pixels, as a source of shading points.

use super::filter::{Filter, WithOffset};
use super::pattern::Pattern;
use super::surface::{Line, PixelPosition, Positions, Row, Surface};
use osl_exec::{Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use osl_simd::{Isa, Kernel};
use std::ops::Range;

/// Some samples of each of some pixels: pixel by pixel, the samples of a pixel in order.
#[derive(Clone)]
pub struct SamplePoints<'a> {
    surface: &'a dyn Surface,
    /// Numbers of pixels, row by row.
    pixels: &'a [u32],
    /// Which samples of each pixel; `None` means the pixel's centre.
    samples: Option<Range<u32>>,
    /// Where the samples of each pixel begin in the pattern. A crop has the samples of the whole image.
    starts: Vec<u32>,
    pattern: &'a Pattern,
    filter: &'a Filter,
    width: u32,
    isa: Isa,
}

impl<'a> SamplePoints<'a> {
    /// Samples of pixels of a surface. Samples beyond the pattern lie at the centre.
    pub fn new(
        surface: &'a dyn Surface,
        pixels: &'a [u32],
        samples: Range<u32>,
        tools: (&'a Pattern, &'a Filter),
    ) -> SamplePoints<'a> {
        let start = |pixel: &u32| tools.0.first(surface.pixel(*pixel as usize) as u32) as u32;
        let starts = pixels.iter().map(start).collect();
        SamplePoints { samples: Some(samples), starts, ..SamplePoints::centres(surface, pixels, tools) }
    }

    /// The centres of pixels.
    pub fn centres(
        surface: &'a dyn Surface,
        pixels: &'a [u32],
        (pattern, filter): (&'a Pattern, &'a Filter),
    ) -> SamplePoints<'a> {
        let width = surface.size().0.max(1) as u32;
        let (samples, starts, isa) = (None, Vec::new(), Isa::detect());
        SamplePoints { surface, pixels, samples, starts, pattern, filter, width, isa }
    }

    /// Samples per pixel.
    fn each(&self) -> usize {
        self.samples.as_ref().map_or(1, |s| s.len().max(1))
    }

    /// Goes through some samples pixel by pixel: `of` gets a pixel, its samples in the pattern, and how many
    /// more lie at its centre.
    fn by_pixel(&self, first: usize, count: usize, mut of: impl FnMut([u32; 2], &[[f32; 2]], usize)) {
        let each = self.each();
        let mut count = count.min(Positions::count(self).saturating_sub(first));
        let (from, to) = self.samples.as_ref().map_or((0, 0), |s| (s.start as usize, s.end as usize));
        // Those of a pixel in this range are in the pattern.
        let known = to.min(self.pattern.count() as usize).saturating_sub(from);
        let (mut at, mut sample) = (first / each, first % each);
        let mut row = Row::default();
        while count > 0 {
            let Some(pixel) = self.pixels.get(at).copied() else { break };
            let left = (each - sample).min(count);
            let own = known.min(sample + left).saturating_sub(sample);
            let start = self.starts.get(at).map_or(0, |start| *start as usize) + from + sample;
            let own = self.pattern.all().get(start..start + own).unwrap_or(&[]);
            of(row.of(pixel, self.width), own, left - own.len());
            (at, sample, count) = (at + 1, 0, count - left);
        }
    }

    /// Writes the places of some samples along an axis within their pixels, and the columns or rows of the
    /// pixels. Returns false if one of them is not in the pattern.
    fn places<const AXIS: usize>(&self, first: usize, lanes: &mut [f32], pixels: &mut Vec<i32>) -> bool {
        let done = match (first.is_multiple_of(self.each()), self.each()) {
            (true, 1) => self.whole::<AXIS, 1>(first, lanes, pixels),
            (true, 2) => self.whole::<AXIS, 2>(first, lanes, pixels),
            (true, 4) => self.whole::<AXIS, 4>(first, lanes, pixels),
            (true, 8) => self.whole::<AXIS, 8>(first, lanes, pixels),
            (true, 16) => self.whole::<AXIS, 16>(first, lanes, pixels),
            _ => 0,
        };
        let (count, mut are_known) = (lanes.len(), true);
        let mut rest = lanes.get_mut(done..).unwrap_or_default();
        self.by_pixel(first + done, count - done, |pixel, own, at_centre| {
            are_known &= at_centre == 0;
            let (here, behind) = std::mem::take(&mut rest).split_at_mut(own.len().min(count - pixels.len()));
            here.iter_mut().zip(own).for_each(|(x, sample)| *x = sample[AXIS]);
            pixels.extend(std::iter::repeat_n(pixel[AXIS] as i32, here.len()));
            rest = behind;
        });
        are_known
    }

    /// The same for all `EACH` samples of each pixel, as far as they are in the pattern. Returns the number
    /// of samples.
    fn whole<const AXIS: usize, const EACH: usize>(
        &self,
        first: usize,
        lanes: &mut [f32],
        pixels: &mut Vec<i32>,
    ) -> usize {
        let range = self.samples.clone().unwrap_or_default();
        if range.end > self.pattern.count() {
            return 0;
        }
        let (from, all, mut row) = (range.start as usize, self.pattern.all(), Row::default());
        let at = first / EACH;
        let own = self.pixels.get(at..).unwrap_or(&[]).iter().zip(self.starts.get(at..).unwrap_or(&[]));
        for ((pixel, start), lanes) in own.zip(lanes.as_chunks_mut::<EACH>().0) {
            let own = all.get(*start as usize + from..).and_then(|own| own.first_chunk::<EACH>());
            let Some(own) = own else { break };
            lanes.iter_mut().zip(own).for_each(|(x, sample)| *x = sample[AXIS]);
            pixels.extend_from_slice(&[row.of(*pixel, self.width)[AXIS] as i32; EACH]);
        }
        pixels.len()
    }
}

impl Positions for SamplePoints<'_> {
    fn count(&self) -> usize {
        self.pixels.len() * self.each()
    }

    fn some(&self, first: usize, count: usize) -> Vec<PixelPosition> {
        let mut places = Vec::with_capacity(count);
        self.by_pixel(first, count, |pixel, own, at_centre| {
            self.filter.offsets(own, |offset| PixelPosition { pixel, offset }, &mut places);
            places.extend(std::iter::repeat_n(PixelPosition::centre(pixel), at_centre));
        });
        places
    }

    fn along(&self, line: &Line, first: usize, lanes: &mut [f32]) -> bool {
        // First the place of each sample in its pixel and the number of the pixel, then the coordinates of
        // all samples, which the compiler puts into vectors.
        let mut pixels = Vec::with_capacity(lanes.len());
        let are_known = match line.axis() {
            0 => self.places::<0>(first, lanes, &mut pixels),
            _ => self.places::<1>(first, lanes, &mut pixels),
        };
        self.filter.with_offset(InPlace(lanes));
        are_known && self.isa.dispatch(Coordinates { line, pixels: &pixels, lanes })
    }
}

/// Replaces samples by their offsets.
struct InPlace<'s>(&'s mut [f32]);

impl WithOffset for InPlace<'_> {
    type Result = ();

    fn with(self, offset: impl Fn(f32) -> f32) {
        self.0.iter_mut().for_each(|x| *x = offset(*x));
    }
}

/// Replaces the offsets from the centres of some pixels by coordinates. The result is false if one of them
/// is 0.
struct Coordinates<'s> {
    line: &'s Line,
    /// Columns or rows.
    pixels: &'s [i32],
    lanes: &'s mut [f32],
}

impl Kernel for Coordinates<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        let mut is_between = true;
        for (x, pixel) in self.lanes.iter_mut().zip(self.pixels) {
            is_between &= *x != 0.0;
            *x = self.line.at(*pixel, *x);
        }
        is_between
    }
}

impl PointSource for SamplePoints<'_> {
    fn count(&self) -> usize {
        Positions::count(self)
    }

    fn pixel(&self, position: usize) -> usize {
        self.pixels.get(position / self.each()).map_or(position, |pixel| self.surface.pixel(*pixel as usize))
    }

    fn varying(&self) -> &[Global] {
        self.surface.varying()
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.surface.uniform(global)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.surface.deriv(global, axis)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        if self.samples.is_some() {
            self.surface.fill_between(global, self, first..first + width, lanes);
        } else {
            let pixels = self.pixels.get(first..).unwrap_or(&[]);
            let pixels = pixels.get(..width).unwrap_or(pixels);
            self.surface.fill_centres(global, pixels, width, lanes);
        }
    }

    fn varying_derivs(&self) -> &[Global] {
        self.surface.varying_derivs()
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.surface.fill_deriv_at(global, axis, &self.some(first, width), width, lanes);
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let place = self.some(point, 1).first().copied()?;
        self.surface.attribute_at(object, name, element, place)
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        self.surface.attribute_global(object, name, element)
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.surface.attribute_is_shared(object, name, element)
    }
}

#[cfg(test)]
mod tests {
    use super::super::filter::FilterKind;
    use super::*;
    use osl_scene::Grid;

    #[test]
    fn samples_lie_where_their_positions_are() {
        let pattern = Pattern::new(8, 5);
        let pixels: Vec<u32> = (3..40).step_by(3).collect();
        for (center, height) in [(false, 4), (true, 4), (false, 1), (true, 1)] {
            let grid = Grid { center, scale: [3.7, 0.3], ..Grid::new(11, height) };
            for kind in [FilterKind::Box, FilterKind::Gaussian] {
                let filter = Filter::new(kind, kind.usual_width());
                // With more samples than the pattern has, some lie at the centre.
                for samples in [0..8, 4..8, 6..10] {
                    let points = SamplePoints::new(&grid, &pixels, samples, (&pattern, &filter));
                    for (global, first) in [(Global::U, 0), (Global::V, 5), (Global::P, 7)] {
                        let (mut found, mut expected) = (vec![0.0; 3 * 16], vec![0.0; 3 * 16]);
                        points.fill(global, first, 16, &mut found);
                        grid.fill_at(global, &points.some(first, 16), 16, &mut expected);
                        assert_eq!(found, expected, "{center} {height} {kind:?} {global:?}");
                    }
                }
            }
        }
    }
}
