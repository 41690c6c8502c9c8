//! Samples of chosen pixels, or chosen places between pixels, as a source of shading points.

use super::filter::Filter;
use super::pattern::Pattern;
use super::surface::{PixelPosition, Row, Surface};
use osl_exec::{Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use std::ops::Range;

/// Some samples of each of some pixels: pixel by pixel, the samples of a pixel in order.
#[derive(Clone)]
pub struct SamplePoints<'a> {
    surface: &'a dyn Surface,
    /// Numbers of pixels, row by row.
    pixels: &'a [u32],
    /// Which samples of each pixel; `None` means the pixel's centre.
    samples: Option<Range<u32>>,
    pattern: &'a Pattern,
    filter: &'a Filter,
    width: u32,
}

impl<'a> SamplePoints<'a> {
    /// Samples of pixels of a surface. Samples beyond the pattern lie at the centre.
    pub fn new(
        surface: &'a dyn Surface,
        pixels: &'a [u32],
        samples: Range<u32>,
        (pattern, filter): (&'a Pattern, &'a Filter),
    ) -> SamplePoints<'a> {
        let width = surface.size().0.max(1) as u32;
        SamplePoints { surface, pixels, samples: Some(samples), pattern, filter, width }
    }

    /// The centres of pixels.
    pub fn centres(
        surface: &'a dyn Surface,
        pixels: &'a [u32],
        (pattern, filter): (&'a Pattern, &'a Filter),
    ) -> SamplePoints<'a> {
        let width = surface.size().0.max(1) as u32;
        SamplePoints { surface, pixels, samples: None, pattern, filter, width }
    }

    /// Samples per pixel.
    fn each(&self) -> usize {
        self.samples.as_ref().map_or(1, |s| s.len().max(1))
    }

    fn places(&self, first: usize, count: usize) -> Vec<PixelPosition> {
        let each = self.each();
        let count = count.min(self.count().saturating_sub(first));
        let mut places = Vec::with_capacity(count);
        let (mut at, mut sample) = (first / each, first % each);
        let mut row = Row::default();
        while places.len() < count {
            let Some(pixel) = self.pixels.get(at).copied() else { break };
            let left = (each - sample).min(count - places.len());
            let pixel_at = row.of(pixel, self.width);
            match &self.samples {
                None => places.push(PixelPosition::centre(pixel_at)),
                Some(range) => {
                    // A crop has the samples of the whole image.
                    let own = self.pattern.of(self.surface.pixel(pixel as usize) as u32);
                    let from = range.start as usize + sample;
                    let own = own.get(from.min(own.len())..(from + left).min(own.len())).unwrap_or(&[]);
                    self.filter.offsets(own, |offset| PixelPosition { pixel: pixel_at, offset }, &mut places);
                    let missing = left - own.len();
                    if missing > 0 {
                        places.extend(std::iter::repeat_n(PixelPosition::centre(pixel_at), missing));
                    }
                }
            }
            (at, sample) = (at + 1, 0);
        }
        places
    }
}

impl PointSource for SamplePoints<'_> {
    fn count(&self) -> usize {
        self.pixels.len() * self.each()
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
            self.surface.fill_at(global, &self.places(first, width), width, lanes);
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
        self.surface.fill_deriv_at(global, axis, &self.places(first, width), width, lanes);
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        let place = self.places(point, 1).first().copied()?;
        self.surface.attribute_at(object, name, element, place)
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.surface.attribute_is_shared(object, name, element)
    }
}

/// Chosen places of an image.
pub(super) struct PlacedPoints<'a> {
    pub(super) surface: &'a dyn Surface,
    pub(super) places: &'a [PixelPosition],
}

impl PlacedPoints<'_> {
    /// At most so many places from one on.
    fn some(&self, first: usize, count: usize) -> &[PixelPosition] {
        let end = (first + count).min(self.places.len());
        self.places.get(first..end).unwrap_or(&[])
    }
}

impl PointSource for PlacedPoints<'_> {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn pixel(&self, position: usize) -> usize {
        let width = self.surface.size().0;
        let number = |place: &PixelPosition| place.pixel[1] as usize * width + place.pixel[0] as usize;
        self.places.get(position).map_or(position, |place| self.surface.pixel(number(place)))
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
        self.surface.fill_at(global, self.some(first, width), width, lanes);
    }

    fn varying_derivs(&self) -> &[Global] {
        self.surface.varying_derivs()
    }

    fn fill_deriv(&self, global: Global, axis: Axis, first: usize, width: usize, lanes: &mut [f32]) {
        self.surface.fill_deriv_at(global, axis, self.some(first, width), width, lanes);
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.surface.attribute_at(object, name, element, *self.places.get(point)?)
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.surface.attribute_is_shared(object, name, element)
    }
}
