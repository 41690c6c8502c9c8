//! The sky: one color, a gradient, or an image of all directions that is sampled by its brightness.

use super::Arriving;
use crate::math;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light from all directions.
#[derive(Clone, Debug)]
pub struct Sky {
    image: Option<Image>,
    /// The color straight below, and how it changes up to the color straight above.
    color: Vec3,
    rise: Vec3,
}

/// Directions as an image: the middle is −z, the right half faces +x, and the first row faces up to +y.
#[derive(Clone, Debug)]
struct Image {
    size: [usize; 2],
    pixels: Vec<Vec3>,
    /// Running sums of the rows' brightness.
    rows: Vec<f32>,
    /// Running sums within each row.
    columns: Vec<f32>,
}

impl Sky {
    /// One color in all directions.
    pub fn constant(color: Vec3) -> Sky {
        Sky::gradient(color, color)
    }

    /// A color straight below that changes evenly with height to one straight above.
    pub fn gradient(below: Vec3, above: Vec3) -> Sky {
        Sky { image: None, color: below, rise: above - below }
    }

    /// An image of `width` by `height` pixels, row by row from the top. Negative and non-finite values become
    /// 0.
    pub fn image([width, height]: [usize; 2], mut pixels: Vec<Vec3>) -> Sky {
        pixels.resize(width * height, Vec3::ZERO);
        for p in &mut pixels {
            *p = if p.is_finite() { p.max(Vec3::ZERO) } else { Vec3::ZERO };
        }
        let (mut rows, mut columns) = (Vec::with_capacity(height), Vec::with_capacity(pixels.len()));
        let mut total = 0.0_f64;
        for (y, row) in pixels.chunks(width.max(1)).enumerate() {
            let sine = math::sin(PI * (y as f32 + 0.5) / height as f32);
            let mut sum = 0.0_f64;
            for p in row {
                sum += f64::from(p.element_sum());
                columns.push(sum as f32);
            }
            total += sum * f64::from(sine);
            rows.push(total as f32);
        }
        if total == 0.0 {
            return Sky::constant(Vec3::ZERO);
        }
        Sky {
            color: Vec3::ZERO,
            rise: Vec3::ZERO,
            image: Some(Image { size: [width, height], pixels, rows, columns }),
        }
    }

    /// The direction for a position on the image; coordinates run from 0 to 1 from the left and from the top.
    pub fn direction([s, t]: [f32; 2]) -> Vec3 {
        let (sin_around, cos_around) = math::sin_cos(TAU * (s - 0.5));
        let (sin, cos) = math::sin_cos(PI * t);
        Vec3::new(sin * sin_around, cos, -sin * cos_around)
    }

    fn place(w: Vec3) -> [f32; 2] {
        let s = 0.5 + math::atan2(w.x, -w.z) / TAU;
        [s.clamp(0.0, 1.0), math::acos(w.y.clamp(-1.0, 1.0)) / PI]
    }

    /// Its radiance from a direction.
    pub fn radiance(&self, w: Vec3) -> Vec3 {
        match &self.image {
            None => self.color + self.rise * (0.5 + 0.5 * w.y),
            Some(image) => image.at(Sky::place(w)),
        }
    }

    /// Samples light from the image. A sky without one returns `None`, since sampling by the surface is
    /// better.
    pub fn sample(&self, u: [f32; 2]) -> Option<Arriving> {
        let image = self.image.as_ref()?;
        let (place, pdf) = image.choose(u)?;
        let wi = Sky::direction(place);
        let weight = self.radiance(wi) / pdf;
        Some(Arriving { wi, distance: f32::INFINITY, weight, pdf })
    }

    /// The density with which [`Sky::sample`] chooses a direction.
    pub fn pdf(&self, w: Vec3) -> f32 {
        self.image.as_ref().map_or(0.0, |image| image.density(Sky::place(w)))
    }
}

/// The index of the first running sum above `x`, and the position of `x` within that step, from 0 to 1.
fn find(sums: &[f32], x: f32) -> Option<(usize, f32)> {
    let at = sums.partition_point(|s| *s <= x).min(sums.len().checked_sub(1)?);
    let before = at.checked_sub(1).and_then(|b| sums.get(b)).copied().unwrap_or(0.0);
    let step = sums.get(at)? - before;
    Some((at, if step > 0.0 { ((x - before) / step).clamp(0.0, 1.0) } else { 0.5 }))
}

impl Image {
    fn pixel(&self, x: usize, y: usize) -> Vec3 {
        self.pixels.get(y * self.size[0] + x).copied().unwrap_or_default()
    }

    /// Interpolates the four pixels around a position.
    fn at(&self, [s, t]: [f32; 2]) -> Vec3 {
        let [width, height] = self.size;
        let (x, y) = (s * width as f32 - 0.5, (t * height as f32 - 0.5).clamp(0.0, height as f32 - 1.0));
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |step: usize| ((x.floor() + width as f32) as usize + step) % width;
        let row = |step: usize| (y as usize + step).min(height - 1);
        let along = |y: usize| self.pixel(column(0), y).lerp(self.pixel(column(1), y), fx);
        along(row(0)).lerp(along(row(1)), fy)
    }

    fn row(&self, y: usize) -> &[f32] {
        self.columns.get(y * self.size[0]..(y + 1) * self.size[0]).unwrap_or_default()
    }

    fn choose(&self, u: [f32; 2]) -> Option<([f32; 2], f32)> {
        let (y, v) = find(&self.rows, u[1] * self.rows.last()?)?;
        let (x, h) = find(self.row(y), u[0] * self.row(y).last()?)?;
        let place = [(x as f32 + h) / self.size[0] as f32, (y as f32 + v) / self.size[1] as f32];
        let pdf = self.density(place);
        (pdf > 0.0).then_some((place, pdf))
    }

    fn density(&self, [s, t]: [f32; 2]) -> f32 {
        let [width, height] = self.size;
        let (x, y) = ((s * width as f32) as usize, (t * height as f32) as usize);
        let (x, y) = (x.min(width - 1), y.min(height - 1));
        // Rows are weighted by the sine at their middle, the density by the sine at the position itself.
        let middle = math::sin(PI * (y as f32 + 0.5) / height as f32);
        let total = self.rows.last().copied().unwrap_or(0.0);
        let share = self.pixel(x, y).element_sum() * middle / total * (width * height) as f32;
        let sine = math::sin(PI * t).max(1e-6);
        share / (TAU * PI * sine)
    }
}
