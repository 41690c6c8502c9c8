//! Images of a surface that a camera sees, with several samples in each pixel.
//!
//! A sample is a ray through a place of its pixel, and the shader runs where the ray meets the surface. A
//! pixel has the weighted mean of these points; its coverage is their share of the weight of all rays.
//! Nothing is interpolated, because the edge of the surface is nowhere smooth. The caller shades
//! the points.

use super::bounds::outputs;
use super::error::steady;
use super::filter::{Filter, FilterKind};
use super::image::Tally;
use super::pattern::Pattern;
use super::{MAX_SAMPLES, Reach};
use osl_exec::{Frame, Plane, Words};
use osl_ir::ir::Kind;
use osl_limits::Running;
use osl_scene::camera::View;
use osl_scene::shape::Surface;
use osl_scene::view::{Seen, look_at};
use std::ops::Range;

/// Rays that are in memory at a time, unless one pixel has more.
const TOGETHER: usize = 1 << 18;
/// Samples that every pixel gets before its error is estimated.
const FEWEST: u32 = 4;
/// Samples of a pixel that the surface covers in part.
const AT_EDGES: u32 = 16;

/// A view of a surface, and where the samples of its pixels are.
pub struct Sight<'a> {
    /// The camera.
    pub view: &'a View,
    /// The surface.
    pub surface: &'a dyn Surface,
    /// The samples of each pixel.
    pub pattern: Pattern,
    /// The weight of a place in its pixel.
    pub filter: Filter,
    /// The limits of the messages.
    pub limits: &'a Running,
}

/// When pixels have enough samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Enough {
    /// After this many.
    Samples(u32),
    /// When the standard error of each plane is at most its bound, or after this many.
    Errors(Vec<f32>, u32),
}

/// Sums over the samples of a pixel.
#[derive(Clone, Debug, Default)]
struct Pixel {
    rays: u32,
    hits: u32,
    /// The weights of all rays, and of those that meet the surface.
    weights: [f64; 2],
    /// Of each plane, the sums of weighted values and of their squares.
    sums: Vec<[f64; 2]>,
}

impl Pixel {
    fn mean(&self, plane: usize) -> f32 {
        let sum = self.sums.get(plane).map_or(0.0, |[sum, _]| *sum);
        if self.hits == 0 { 0.0 } else { (sum / steady(self.weights[1])) as f32 }
    }

    fn coverage(&self) -> f32 {
        if self.hits == 0 { 0.0 } else { (self.weights[1] / steady(self.weights[0])).clamp(0.0, 1.0) as f32 }
    }

    /// The standard error of a plane, as if its samples were independent: stratified ones have less.
    fn error(&self, plane: usize) -> f32 {
        let [sum, squares] = self.sums.get(plane).copied().unwrap_or_default();
        let n = f64::from(self.hits);
        if self.hits < 2 {
            return 0.0;
        }
        let mean = sum / n;
        let variance = ((squares / n - mean * mean) / (n - 1.0)).max(0.0);
        variance.sqrt() as f32
    }
}

/// An image of a surface.
#[derive(Clone, Debug, Default)]
pub struct SeenImage {
    /// The planes of all pixels, and the messages of the shader at their pixels.
    pub frame: Frame,
    /// The covered share of each pixel.
    pub coverage: Vec<f32>,
    /// Samples of each pixel.
    pub samples: Vec<u32>,
    /// What the image cost.
    pub tally: Tally,
}

/// An image in progress.
pub struct SeenWork<'a> {
    sight: &'a Sight<'a>,
    pattern: Pattern,
    width: usize,
    pixels: Vec<Pixel>,
    planes: Vec<Plane>,
    said: Frame,
    evaluations: u64,
}

impl<'a> SeenWork<'a> {
    /// An image without samples.
    pub fn new(sight: &'a Sight<'a>) -> SeenWork<'a> {
        let [width, height] = sight.view.resolution();
        SeenWork {
            sight,
            pattern: sight.pattern.clone(),
            width,
            pixels: vec![Pixel::default(); width * height],
            planes: Vec::new(),
            said: Frame::default(),
            evaluations: 0,
        }
    }

    /// Takes the first samples of all pixels, from which the ranges of outputs are known.
    ///
    /// # Errors
    /// Those of `shade`, which runs the shader at points.
    pub fn first<E>(&mut self, shade: &mut dyn FnMut(&Seen) -> Result<Frame, E>) -> Result<(), E> {
        let all: Vec<u32> = (0..self.pixels.len() as u32).collect();
        self.round(&all, 0..FEWEST, shade)
    }

    /// The ranges of the outputs, as far as they are known.
    pub fn reaches(&self) -> Vec<Reach> {
        let reach = |own: Range<usize>| {
            let covered = || self.pixels.iter().filter(|pixel| pixel.hits > 0);
            let values =
                own.clone().map(|plane| covered().map(|pixel| pixel.mean(plane)).collect::<Vec<f32>>());
            let name = self.planes.get(own.start).map_or_else(|| "".into(), |plane| plane.output.clone());
            Reach::of(name, own, values, covered().count())
        };
        outputs(&self.planes).into_iter().map(reach).collect()
    }

    /// Takes samples until all pixels have enough.
    ///
    /// # Errors
    /// Those of `shade`, which runs the shader at points.
    pub fn until<E>(
        &mut self,
        enough: &Enough,
        shade: &mut dyn FnMut(&Seen) -> Result<Frame, E>,
    ) -> Result<(), E> {
        let (most, bounds) = match enough {
            Enough::Samples(most) => (*most, None),
            Enough::Errors(bounds, most) => (*most, Some(bounds.as_slice())),
        };
        let most = most.clamp(1, MAX_SAMPLES);
        let mut open: Vec<u32> = (0..self.pixels.len() as u32).collect();
        let mut done = self.pixels.first().map_or(0, |pixel| pixel.rays);
        loop {
            if let Some(bounds) = bounds.filter(|_| done > 0) {
                open = self.unsure(bounds);
            }
            if done >= most || open.is_empty() {
                return Ok(());
            }
            let next = if bounds.is_some() { (2 * done).clamp(FEWEST, most) } else { most };
            // A pixel that had enough samples may be among those near another one that has not.
            let mut taken: Vec<u32> =
                open.iter().filter_map(|at| Some(self.pixels.get(*at as usize)?.rays)).collect();
            taken.sort_unstable();
            taken.dedup();
            for rays in taken {
                let own = |at: &u32| self.pixels.get(*at as usize).is_some_and(|pixel| pixel.rays == rays);
                let own: Vec<u32> = open.iter().copied().filter(own).collect();
                self.round(&own, rays..next, shade)?;
            }
            done = next;
        }
    }

    /// The pixels whose error, or that of a neighbour, is too large: a few samples of one pixel can all be
    /// wrong in the same way, but hardly those of nine.
    fn unsure(&self, bounds: &[f32]) -> Vec<u32> {
        let is_unsure = |pixel: &Pixel| {
            let is_edge = pixel.hits > 0 && pixel.hits < pixel.rays && pixel.rays < AT_EDGES;
            is_edge || bounds.iter().enumerate().any(|(plane, bound)| pixel.error(plane) > *bound)
        };
        let own: Vec<bool> = self.pixels.iter().map(is_unsure).collect();
        let height = own.len() / self.width.max(1);
        let around = |at: &u32| {
            let (x, y) = (*at as usize % self.width, *at as usize / self.width);
            let (xs, ys) =
                (x.saturating_sub(1)..(x + 2).min(self.width), y.saturating_sub(1)..(y + 2).min(height));
            ys.flat_map(|y| xs.clone().map(move |x| (x, y)))
                .any(|(x, y)| own.get(y * self.width + x) == Some(&true))
        };
        (0..own.len() as u32).filter(around).collect()
    }

    /// Takes some samples of some pixels.
    fn round<E>(
        &mut self,
        pixels: &[u32],
        samples: Range<u32>,
        shade: &mut dyn FnMut(&Seen) -> Result<Frame, E>,
    ) -> Result<(), E> {
        if self.pattern.count() < samples.end {
            self.pattern = self.pattern.clone().with(samples.end);
        }
        let each = samples.len().max(1);
        for pixels in pixels.chunks((TOGETHER / each).max(1)) {
            let mut places = Vec::with_capacity(pixels.len() * each);
            let mut signs = Vec::with_capacity(pixels.len() * each);
            for pixel in pixels {
                let own = self.pattern.of(*pixel);
                for sample in samples.clone() {
                    let s = own.get(sample as usize).copied().unwrap_or([0.5; 2]);
                    let [x, y] = s.map(|s| self.sight.filter.place(s));
                    let at = [*pixel as usize % self.width, *pixel as usize / self.width];
                    places.push([at[0] as f32 + 0.5 + x.0, at[1] as f32 + 0.5 + y.0]);
                    signs.push(if self.is_signed() { x.1 * y.1 } else { 1.0 });
                }
            }
            let seen = look_at(self.sight.view, self.sight.surface, &places);
            let frame = shade(&seen)?;
            self.add(pixels, (each, &signs), &seen, frame);
        }
        Ok(())
    }

    fn is_signed(&self) -> bool {
        self.sight.filter.kind() == FilterKind::Mitchell
    }

    /// Adds the points that were seen. `seen.pixels` has the number of the ray of each.
    fn add(&mut self, pixels: &[u32], (each, signs): (usize, &[f32]), seen: &Seen, mut frame: Frame) {
        let pixel_of = |ray: usize| pixels.get(ray / each).map_or(0, |pixel| *pixel as usize);
        for (ray, sign) in signs.iter().enumerate() {
            if let Some(pixel) = self.pixels.get_mut(pixel_of(ray)) {
                pixel.rays += 1;
                pixel.weights[0] += f64::from(*sign);
            }
        }
        let planes = std::mem::take(&mut frame.planes);
        let values: Vec<_> = planes.iter().map(Plane::as_floats).collect();
        for (point, ray) in seen.pixels.iter().enumerate() {
            let sign = f64::from(signs.get(*ray as usize).copied().unwrap_or(1.0));
            let Some(pixel) = self.pixels.get_mut(pixel_of(*ray as usize)) else { continue };
            pixel.hits += 1;
            pixel.weights[1] += sign;
            pixel.sums.resize(values.len(), [0.0; 2]);
            for (sums, values) in pixel.sums.iter_mut().zip(&values) {
                let x = f64::from(values.get(point).copied().unwrap_or(0.0)) * sign;
                sums[0] += x;
                sums[1] += x * x;
            }
        }
        for said in &mut frame.messages {
            said.first = seen.pixels.get(said.first).map_or(0, |ray| pixel_of(*ray as usize));
        }
        self.evaluations += seen.pixels.len() as u64;
        drop(values);
        if self.planes.is_empty() {
            let empty = |plane: Plane| Plane {
                words: Words::default(),
                wide: Vec::new(),
                kind: Kind::Float,
                ..plane
            };
            self.planes = planes.into_iter().map(empty).collect();
        }
        self.said.add(frame, self.sight.limits);
    }

    /// The image so far. `bounds` are those that its planes should keep.
    pub fn image(self, bounds: &[f32]) -> SeenImage {
        let SeenWork { pixels, planes, said, evaluations, .. } = self;
        let mut tally = Tally { pixels: pixels.len() as u64, evaluations, ..Tally::default() };
        tally.note_all(pixels.iter().map(|pixel| pixel.rays));
        for pixel in &pixels {
            let is_above = bounds.iter().enumerate().any(|(plane, bound)| pixel.error(plane) > *bound);
            tally.unfinished += u64::from(is_above);
        }
        tally.above = tally.unfinished as f64;
        let mut planes = planes;
        for (at, plane) in planes.iter_mut().enumerate() {
            plane.words = pixels.iter().map(|pixel| pixel.mean(at).to_bits()).collect();
        }
        let broken = |pixel: &Pixel| (0..planes.len()).any(|plane| !pixel.mean(plane).is_finite());
        tally.not_finite = pixels.iter().filter(|pixel| broken(pixel)).count() as u64;
        let coverage = pixels.iter().map(Pixel::coverage).collect();
        let samples = pixels.iter().map(|pixel| pixel.rays).collect();
        SeenImage { frame: Frame { planes, ..said }, coverage, samples, tally }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test says what must hold")]
mod tests {
    use super::*;
    use osl_ir::types::Type;
    use osl_scene::shape::Shape;
    use osl_scene::view::camera_for;

    /// A sphere whose left half is 0 and whose right half is 1, seen from the front.
    fn image(kind: FilterKind, enough: &Enough) -> SeenImage {
        let shape = Shape::Sphere { radius: 1.0 };
        let camera =
            camera_for(&shape.bounds(), shape.reach(), Some(osl_scene::glam::Vec3::Z * 5.0), [24, 24]);
        let view = camera.view().unwrap();
        let limits = osl_limits::Limits::default();
        let sight = Sight {
            view: &view,
            surface: &shape,
            pattern: Pattern::new(4, 0),
            filter: Filter::new(kind, kind.usual_width()),
            limits: &limits.running,
        };
        let mut shade = |seen: &Seen| {
            let words =
                seen.points.points().iter().map(|p| f32::from(u8::from(p.p.x > 0.0)).to_bits()).collect();
            let plane = Plane {
                output: "a".into(),
                ty: Type::FLOAT,
                component: 0,
                kind: Kind::Float,
                words,
                wide: Vec::new(),
            };
            Ok::<_, ()>(Frame { planes: vec![plane], ..Frame::default() })
        };
        let mut work = SeenWork::new(&sight);
        work.until(enough, &mut shade).unwrap();
        let bounds = if let Enough::Errors(bounds, _) = enough { bounds.clone() } else { Vec::new() };
        work.image(&bounds)
    }

    #[test]
    fn edges_are_covered_in_part_and_the_inside_is_a_mean() {
        for kind in FilterKind::ALL {
            let found = image(kind, &Enough::Samples(64));
            let values: Vec<f32> = found.frame.planes[0].as_floats().into_owned();
            let row = 12 * 24;
            assert_eq!(found.coverage[0], 0.0, "{kind:?}");
            assert!((found.coverage[row + 6] - 1.0).abs() < 1e-3, "{kind:?}");
            assert!(found.coverage.iter().any(|a| (0.2..0.8).contains(a)), "{kind:?}");
            assert!(values[row + 4].abs() < 0.1 && (values[row + 19] - 1.0).abs() < 0.1, "{kind:?}");
            // A mirror image has the opposite values.
            let both = values[row + 11] + values[row + 12];
            assert!((both - 1.0).abs() < 0.05, "{kind:?}: {both}");
            assert_eq!(found.tally.by_samples, [(64, 576)]);
        }
    }

    #[test]
    fn samples_go_where_the_error_is() {
        let found = image(FilterKind::Gaussian, &Enough::Errors(vec![0.05], 256));
        let counts = &found.tally.by_samples;
        assert_eq!(counts.first().map(|(n, _)| *n), Some(4), "{counts:?}");
        assert!(counts.last().is_some_and(|(n, pixels)| *n >= 64 && *pixels < 150), "{counts:?}");
        assert_eq!(found.tally.unfinished, 0);
        let few = image(FilterKind::Gaussian, &Enough::Errors(vec![0.001], 16));
        assert!(few.tally.unfinished > 10, "{:?}", few.tally);
    }
}
