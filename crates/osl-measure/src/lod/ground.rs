//! The points on which levels are measured: an image whose pixels are larger in pattern space, square or
//! elongated, so that it shows more of the pattern. Inputs that depend on the surface and the view take
//! random values, so that a mean over the points is a mean over surfaces.

use crate::sample::{PixelPosition, Surface};
use osl_exec::{Blocks, Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use osl_scene::Grid;
use pxfm::{f_cosf, f_sinf};
use serde::Serialize;

/// The sides of a pixel along both axes, as multiples of those in the given image.
pub(super) type Sides = [f64; 2];

/// How the size of a pixel is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum By {
    /// By its larger side.
    #[default]
    Side,
    /// By the square root of its area.
    Area,
}

impl By {
    /// The size of a pixel.
    pub(super) fn of(self, [x, y]: Sides) -> f64 {
        match self {
            By::Side => x.max(y),
            By::Area => (x * y).sqrt(),
        }
    }

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            By::Side => "the larger side",
            By::Area => "the square root of the area",
        }
    }
}

/// How many times as long as wide the elongated pixels are.
const ASPECTS: [f64; 2] = [4.0, 16.0];

/// Pixels of this size: a square one, and elongated ones along each axis with sides up to `largest`.
pub(super) fn shapes(size: f64, by: By, largest: f64) -> Vec<Sides> {
    let elongated = ASPECTS.into_iter().flat_map(|aspect| {
        let long = size * if by == By::Area { aspect.sqrt() } else { 1.0 };
        [[long, long / aspect], [long / aspect, long]]
    });
    let fits = |sides: &Sides| sides.iter().all(|side| *side <= largest);
    std::iter::once([size; 2]).chain(elongated.filter(fits)).collect()
}

/// Pixels of a grid, each seen from a direction of its own or all as in a run.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub(super) grid: Grid,
    varying: Vec<Global>,
    seed: u32,
    /// Whether all pixels have the surface and the view of a run.
    is_still: bool,
}

/// The times are from 0 to this, in seconds.
const TIME: f32 = 10.0;

impl Ground {
    /// The grid with pixels of these sides, `shift` images away from its origin.
    pub(super) fn new(grid: &Grid, sides: Sides, shift: f64, turned: &[Global], seed: u32) -> Ground {
        let mut scale = grid.scale;
        for (scale, side) in scale.iter_mut().zip(sides) {
            *scale = (f64::from(*scale) * side) as f32;
        }
        let mut offset = grid.offset;
        for (axis, offset) in offset.iter_mut().enumerate() {
            // The shift differs between the axes, so that nothing on a diagonal repeats.
            let own = shift * (1.0 + 0.37 * axis as f64);
            *offset += (own * f64::from(scale.get(axis).copied().unwrap_or(1.0))) as f32;
        }
        let varying = grid.varying().iter().chain(turned).copied().collect();
        Ground { grid: Grid { scale, offset, ..grid.clone() }, varying, seed, is_still: false }
    }

    /// The same with the surface and the view that a run has.
    pub(super) fn still(self) -> Ground {
        Ground { is_still: true, ..self }
    }

    /// The same pixels at the origin of another ground.
    pub(super) fn moved_to(mut self, other: &Ground) -> Ground {
        self.grid.offset = other.grid.offset;
        self
    }

    /// Random numbers from 0 to 1 of a pixel.
    fn random(&self, pixel: u32, index: u32) -> f32 {
        let mut x = pixel.wrapping_mul(0x9e37_79b1) ^ self.seed ^ index.wrapping_mul(0x85eb_ca6b);
        for (shift, factor) in [(16, 0x7feb_352d_u32), (15, 0x846c_a68b)] {
            x = (x ^ (x >> shift)).wrapping_mul(factor);
        }
        (x ^ (x >> 16)) as f32 / u32::MAX as f32
    }

    /// A direction, evenly spread over the sphere.
    fn direction(&self, pixel: u32, index: u32) -> [f32; 3] {
        let z = 2.0 * self.random(pixel, index) - 1.0;
        let turn = std::f32::consts::TAU * self.random(pixel, index + 1);
        let radius = (1.0 - z * z).max(0.0).sqrt();
        [radius * f_cosf(turn), radius * f_sinf(turn), z]
    }

    /// The value of a global that depends on the surface or the view.
    fn turned(&self, global: Global, pixel: u32) -> [f32; 3] {
        if self.is_still {
            return self.grid.uniform(global);
        }
        let normal = self.direction(pixel, 0);
        match global {
            Global::N | Global::Ng => normal,
            // The eye is on the side of the normal.
            Global::I => {
                let to = self.direction(pixel, 2);
                let side = if dot(to, normal) > 0.0 { -1.0 } else { 1.0 };
                to.map(|x| side * x)
            }
            Global::DPdu | Global::DPdv => {
                let other = self.direction(pixel, 4);
                let along = unit(cross(normal, other));
                if global == Global::DPdu { along } else { cross(normal, along) }
            }
            Global::Time => [TIME * self.random(pixel, 6); 3],
            _ => self.grid.uniform(global),
        }
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross([a, b, c]: [f32; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|x| x / length) } else { [1.0, 0.0, 0.0] }
}

impl PointSource for Ground {
    fn count(&self) -> usize {
        self.grid.count()
    }

    fn blocks(&self) -> Option<Blocks> {
        Some(self.grid.order())
    }

    fn varying(&self) -> &[Global] {
        &self.varying
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.grid.uniform(global)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.grid.deriv(global, axis)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        let order = self.grid.order();
        let last = self.count().saturating_sub(1);
        let place = |point: usize| {
            let (x, y) = order.pixel(point.min(last));
            PixelPosition { pixel: [x as u32, y as u32], offset: [0.0; 2] }
        };
        let places: Vec<PixelPosition> = (first..first + width).map(place).collect();
        self.fill_at(global, &places, width, lanes);
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.grid.attribute(object, name, element, point)
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        self.grid.attribute_global(object, name, element)
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.grid.attribute_is_shared(object, name, element)
    }
}

impl Surface for Ground {
    fn size(&self) -> (usize, usize) {
        self.grid.size()
    }

    fn fill_at(&self, global: Global, places: &[PixelPosition], width: usize, lanes: &mut [f32]) {
        if self.grid.varying().contains(&global) {
            return self.grid.fill_at(global, places, width, lanes);
        }
        let columns = self.grid.width.max(1) as u32;
        for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
            let mut last = 0.0;
            for (at, lane) in lanes.iter_mut().enumerate() {
                if let Some(PixelPosition { pixel: [x, y], .. }) = places.get(at) {
                    let value = self.turned(global, y * columns + x);
                    last = value.get(component).copied().unwrap_or(0.0);
                }
                *lane = last;
            }
        }
    }

    fn attribute_at(
        &self,
        object: &str,
        name: &str,
        element: Option<usize>,
        place: PixelPosition,
    ) -> Option<Datum> {
        self.grid.attribute_at(object, name, element, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_unit_vectors_that_fit_together() {
        let turned = [Global::N, Global::I, Global::DPdu, Global::DPdv];
        let ground = Ground::new(&Grid::new(8, 8), [4.0; 2], 0.0, &turned, 1);
        for pixel in 0..64 {
            let [n, i, u, v] = turned.map(|global| ground.turned(global, pixel));
            for a in [n, i, u, v] {
                assert!((dot(a, a) - 1.0).abs() < 1e-5, "{a:?}");
            }
            assert!(dot(n, i) <= 0.0 && dot(n, u).abs() < 1e-5 && dot(n, v).abs() < 1e-5);
            assert!(dot(cross(u, v), n) > 0.999);
        }
        let still = ground.clone().still();
        assert_eq!(still.turned(Global::N, 5), ground.grid.uniform(Global::N));
    }

    #[test]
    fn larger_pixels_are_as_many_and_have_their_own_sides() {
        let (near, far) = (Grid::new(8, 8), Ground::new(&Grid::new(8, 8), [4.0, 0.5], 2.0, &[], 1));
        assert_eq!(far.count(), near.count());
        assert_eq!(far.deriv(Global::U, Axis::X)[0], 4.0 * near.deriv(Global::U, Axis::X)[0]);
        assert_eq!((far.grid.offset[0], far.grid.scale), (8.0, [4.0, 0.5]));
    }

    #[test]
    fn pixels_of_all_shapes_have_the_same_size() {
        for by in [By::Side, By::Area] {
            let all = shapes(16.0, by, 64.0);
            assert_eq!(all.len(), 5);
            assert!(all.iter().all(|sides| by.of(*sides) == 16.0), "{all:?}");
        }
        assert_eq!(shapes(16.0, By::Area, 32.0), [[16.0; 2], [32.0, 8.0], [8.0, 32.0]]);
    }
}
