//! Light from all directions: a table of its brightness, by which directions are sampled.
//!
//! The table covers the azimuth around z and the cosine of the angle to z, so that all cells have the same
//! solid angle.

use glam::Vec3;
use osl_numeric::strict::{atan2, sincos};
use std::f32::consts::{PI, TAU};

/// A direction, of length 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direction {
    /// The direction.
    pub value: Vec3,
    /// Its changes to its neighbours along x and along y.
    pub derivs: [Vec3; 2],
}

/// The table.
#[derive(Clone, Debug)]
pub struct Table {
    side: usize,
    /// Light of each cell divided by its density, row by row.
    weights: Vec<Vec3>,
    /// Running sums of the rows' brightness, from 0 to 1.
    rows: Vec<f32>,
    /// Running sums within each row.
    columns: Vec<f32>,
}

/// A sampled direction and its light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// The direction, with its derivatives to the neighbouring cells.
    pub direction: Direction,
    /// The light divided by the density.
    pub weight: Vec3,
    /// The density by solid angle.
    pub pdf: f32,
}

/// Minimum number of cells along a side.
const MIN_SIDE: usize = 32;
/// The largest number below 1.
const BELOW_ONE: f32 = 0.999_999_94;

/// The direction at a position of a table, with its change from cell to cell.
fn direction(x: f32, y: f32, side: usize) -> Direction {
    let scale = 1.0 / side as f32;
    let (sin, cos) = sincos(TAU * x * scale);
    let height = 1.0 - 2.0 * y * scale;
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let step = 2.0 * scale;
    let outward = if radius > 0.0 { step * height / radius } else { 0.0 };
    Direction {
        value: Vec3::new(radius * cos, radius * sin, height),
        derivs: [
            Vec3::new(-radius * sin, radius * cos, 0.0) * (TAU * scale),
            Vec3::new(outward * cos, outward * sin, -step),
        ],
    }
}

/// Directions at the centers of all cells of a table, row by row.
pub fn centers(resolution: usize) -> Vec<Direction> {
    let side = resolution.max(MIN_SIDE);
    let cells = (0..side).flat_map(|y| (0..side).map(move |x| (x, y)));
    cells.map(|(x, y)| direction(x as f32 + 0.5, y as f32 + 0.5, side)).collect()
}

/// The difference between the running sum at an index and the previous one.
fn part(sums: &[f32], at: usize) -> f32 {
    let sum = |at: usize| sums.get(at).copied().unwrap_or(0.0);
    sum(at) - if at > 0 { sum(at - 1) } else { 0.0 }
}

/// The index whose step in the running sums contains a number from 0 to 1, and the position within that step.
pub(super) fn find(sums: &[f32], x: f32) -> (usize, f32) {
    let at = sums.partition_point(|sum| *sum <= x).min(sums.len().saturating_sub(1));
    let before = if at > 0 { sums.get(at - 1).copied().unwrap_or(0.0) } else { 0.0 };
    let inside = (x - before) / part(sums, at);
    (at, if inside.is_finite() { inside.clamp(0.0, BELOW_ONE) } else { 0.0 })
}

impl Table {
    /// A table of the light at [`centers`] of the same resolution.
    pub fn new(resolution: usize, light: Vec<Vec3>) -> Table {
        let side = resolution.max(MIN_SIDE);
        let mut weights = light;
        weights.resize(side * side, Vec3::ZERO);
        let (mut rows, mut columns) = (Vec::with_capacity(side), Vec::with_capacity(side * side));
        let mut total = 0.0;
        for row in weights.chunks(side) {
            let start = columns.len();
            let mut sum = 0.0;
            for cell in row {
                sum += cell.max_element();
                columns.push(sum);
            }
            total += sum;
            rows.push(total);
            if sum > 0.0 {
                columns.iter_mut().skip(start).for_each(|c| *c /= sum);
            }
        }
        if total > 0.0 {
            rows.iter_mut().for_each(|r| *r /= total);
        }
        let mut table = Table { side, weights: Vec::new(), rows, columns };
        for (at, weight) in weights.iter_mut().enumerate() {
            let pdf = table.pdf(at % side, at / side);
            *weight = if pdf > 0.0 { *weight / pdf } else { Vec3::ZERO };
        }
        table.weights = weights;
        table
    }

    /// The density in a cell, by solid angle.
    fn pdf(&self, x: usize, y: usize) -> f32 {
        let row = self.columns.get(y * self.side..).unwrap_or(&[]);
        part(&self.rows, y) * part(row, x) * (self.side * self.side) as f32 / (4.0 * PI)
    }

    /// The light from a direction divided by its density, and the density.
    pub fn light(&self, direction: Vec3) -> (Vec3, f32) {
        let turn = atan2(direction.y, direction.x) / TAU;
        let u = if turn < 0.0 { turn + 1.0 } else { turn };
        let cell = |x: f32| ((x * self.side as f32) as usize).min(self.side - 1);
        let (x, y) = (cell(u), cell((1.0 - direction.z) * 0.5));
        (self.weights.get(y * self.side + x).copied().unwrap_or_default(), self.pdf(x, y))
    }

    /// Chooses a direction by two numbers from 0 to 1.
    pub fn sample(&self, [xi, yi]: [f32; 2]) -> Chosen {
        let (y, in_row) = find(&self.rows, yi);
        let row = self.columns.get(y * self.side..(y + 1) * self.side).unwrap_or(&[]);
        let (x, in_cell) = find(row, xi);
        Chosen {
            direction: direction(x as f32 + in_cell, y as f32 + in_row, self.side),
            weight: self.weights.get(y * self.side + x).copied().unwrap_or_default(),
            pdf: self.pdf(x, y),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let light = centers(0).iter().map(|d| Vec3::new(0.1, 0.2, (d.value.y + 1.0).powi(3))).collect();
        Table::new(0, light)
    }

    #[test]
    fn directions_lead_to_their_own_cells() {
        let table = table();
        for k in 0..100 {
            let u = [(k as f32 * 0.618) % 1.0, (k as f32 + 0.5) / 100.0];
            let chosen = table.sample(u);
            assert!((chosen.direction.value.length() - 1.0).abs() < 1e-5);
            let (light, pdf) = table.light(chosen.direction.value);
            // Rounding may lead to a neighbouring cell.
            assert!((pdf / chosen.pdf - 1.0).abs() < 0.2, "{pdf} {}", chosen.pdf);
            assert!(light.distance(chosen.weight) < 0.2 * light.length());
        }
    }

    #[test]
    fn densities_sum_to_one_and_weights_to_the_light() {
        let table = table();
        let cell = 4.0 * PI / 1024.0;
        let sum: f32 = (0..1024).map(|k| table.pdf(k % 32, k / 32) * cell).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
        let (weight, pdf) = table.light(Vec3::Y);
        let light = weight * pdf;
        assert!((light.x - 0.1).abs() < 1e-4 && (light.z - 8.0).abs() < 0.3, "{light}");
    }

    #[test]
    fn darkness_has_no_direction() {
        let table = Table::new(0, Vec::new());
        assert_eq!(table.light(Vec3::X), (Vec3::ZERO, 0.0));
        assert_eq!(table.sample([0.3, 0.9]).pdf, 0.0);
    }
}
