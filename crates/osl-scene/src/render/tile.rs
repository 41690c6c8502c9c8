//! A tile of the picture: samples in rounds, until each pixel has its maximum or its value is accurate
//! enough.

use super::layers::Layers;
use super::path::{Notes, Sample, Tracer};
use super::sampler::Sampler;
use super::tone::display;
use super::{RenderOptions, World};
use glam::{DVec3, Vec3};
use osl_exec::RunError;

/// Side of a tile in pixels.
pub(super) const SIDE: usize = 32;
/// Samples per round: enough to fill the interpreter's batches.
const ROUND: u32 = 8;
/// Minimum samples before a pixel's error estimate is trusted.
const SURE: u32 = 16;

/// Statistics of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Pixel {
    count: u32,
    sum: DVec3,
    /// Sums of brightness and of its square.
    brightness: [f64; 2],
}

impl Pixel {
    fn add(&mut self, light: Vec3) {
        let light = if light.is_finite() { light.max(Vec3::ZERO) } else { Vec3::ZERO };
        let y = f64::from(light.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
        self.count += 1;
        self.sum += light.as_dvec3();
        self.brightness[0] += y;
        self.brightness[1] += y * y;
    }

    fn mean(&self) -> Vec3 {
        (self.sum / f64::from(self.count.max(1))).as_vec3()
    }

    /// The standard error of its displayed brightness, from 0 to 1.
    fn error(&self) -> f32 {
        let n = f64::from(self.count);
        if self.count < 2 {
            return f32::INFINITY;
        }
        let mean = self.brightness[0] / n;
        let variance = ((self.brightness[1] / n - mean * mean) / (n - 1.0)).max(0.0);
        let (mean, deviation) = (mean as f32, variance.sqrt() as f32);
        0.5 * (display(mean + deviation) - display(mean - deviation))
    }
}

/// A finished tile.
pub(super) struct Tile {
    /// Left and top, width and height.
    pub(super) area: [usize; 4],
    pixels: Vec<Pixel>,
    pub(super) layers: Layers,
    pub(super) notes: Notes,
}

impl Tile {
    /// Renders a tile of an image of this width.
    pub(super) fn render(
        world: &World,
        options: &RenderOptions,
        area: [usize; 4],
        width: usize,
    ) -> Result<Tile, RunError> {
        let [left, top, columns, rows] = area;
        let count = columns * rows;
        let (mut layers, mut notes) = (Layers::new(count), Notes::default());
        let mut pixels = vec![Pixel::default(); count];
        let mut open: Vec<usize> = (0..count).collect();
        let mut done = 0;
        while !open.is_empty() && done < options.samples {
            world.goes_on()?;
            let round = ROUND.min(options.samples - done);
            let mut samples = Vec::with_capacity(open.len() * round as usize);
            for pixel in &open {
                let (x, y) = (left + pixel % columns, top + pixel / columns);
                for index in done..done + round {
                    let sampler = Sampler::new((y * width + x) as u32, index, options.seed);
                    samples.push(Sample { pixel: *pixel, corner: [x as f32, y as f32], sampler });
                }
            }
            let (strategy, clamp) = (options.strategy, options.clamp);
            let mut tracer = Tracer { world, strategy, clamp, layers: &mut layers, notes: &mut notes };
            let light = tracer.trace(&samples)?;
            for (sample, light) in samples.iter().zip(light) {
                if let Some(pixel) = pixels.get_mut(sample.pixel) {
                    pixel.add(light);
                }
            }
            done += round;
            if let Some(most) = options.max_error.filter(|_| done >= SURE) {
                open = unsure(&pixels, columns, most);
            }
        }
        Ok(Tile { area, pixels, layers, notes })
    }

    /// Samples of a pixel.
    pub(super) fn count(&self, pixel: usize) -> u32 {
        self.pixels.get(pixel).map_or(0, |p| p.count)
    }

    pub(super) fn mean(&self, pixel: usize) -> Vec3 {
        self.pixels.get(pixel).map_or(Vec3::ZERO, Pixel::mean)
    }

    pub(super) fn error(&self, pixel: usize) -> f32 {
        self.pixels.get(pixel).map_or(0.0, Pixel::error)
    }
}

/// The pixels whose error, or that of a neighbour, is too large. A few samples of one pixel can all be wrong
/// in the same way, but hardly those of nine pixels.
fn unsure(pixels: &[Pixel], columns: usize, most: f32) -> Vec<usize> {
    let errors: Vec<f32> = pixels.iter().map(Pixel::error).collect();
    let rows = pixels.len() / columns.max(1);
    let worst = |pixel: usize| {
        let (x, y) = (pixel % columns, pixel / columns);
        let (xs, ys) = (x.saturating_sub(1)..(x + 2).min(columns), y.saturating_sub(1)..(y + 2).min(rows));
        let around = ys.flat_map(|y| xs.clone().map(move |x| y * columns + x));
        around.filter_map(|p| errors.get(p)).fold(0.0_f32, |a, b| a.max(*b))
    };
    (0..pixels.len()).filter(|p| worst(*p) > most).collect()
}
