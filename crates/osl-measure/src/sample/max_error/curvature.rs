//! Curvature of a lattice: the error estimate for interpolated pixels.
//!
//! A *curvature* is the absolute second difference between neighbouring lattice values.

use super::Work;
use super::cell::corners;
use crate::sample::weights::Weights;
use rayon::prelude::*;

/// The curvatures of the cells of a lattice.
pub(super) struct Curvatures {
    step: usize,
    /// Cells of a lattice line.
    columns: usize,
    /// Infinite in lines of cells without pending pixels.
    cells: Vec<f32>,
}

impl Curvatures {
    /// The curvature of the cell that contains a pixel.
    pub(super) fn at(&self, [x, y]: [usize; 2]) -> f32 {
        self.cells.get(y / self.step * self.columns + x / self.step).copied().unwrap_or(f32::INFINITY)
    }
}

impl Work<'_, '_> {
    /// The curvatures of a lattice, in every line of cells with pending pixels.
    pub(super) fn curvatures(&self, step: usize, pending: &[bool]) -> Curvatures {
        let columns = self.width.div_ceil(step);
        let planes = self.planes();
        let mut cells = vec![f32::INFINITY; columns * self.height.div_ceil(step)];
        let lines = cells.par_chunks_mut(columns).zip(pending.par_chunks(step * self.width)).enumerate();
        lines.for_each(|(line, (cells, pending))| {
            if pending.contains(&true) {
                let one = |(column, cell): (usize, &mut f32)| *cell = planes.curvature([column, line], step);
                cells.iter_mut().enumerate().for_each(one);
            }
        });
        Curvatures { step, columns, cells }
    }

    /// The curvature of the cell that contains a pixel.
    pub(super) fn curvature(&self, [x, y]: [usize; 2], step: usize) -> f32 {
        self.planes().curvature([x / step, y / step], step)
    }

    fn planes(&self) -> Planes<'_> {
        Planes { width: self.width, height: self.height, values: &self.values, weights: &self.weights }
    }
}

/// The pixels of a band, plane by plane.
struct Planes<'a> {
    width: usize,
    height: usize,
    values: &'a [Vec<f32>],
    weights: &'a Weights,
}

impl Planes<'_> {
    /// The estimated error of a pixel that is interpolated in a cell: an eighth of the lattice's curvature at
    /// the corners of the cell. For the lattice of all pixels, the curvature of the image at the pixel.
    fn curvature(&self, [column, line]: [usize; 2], step: usize) -> f32 {
        let [left, right, top, bottom] =
            corners([self.width, self.height], [column * step, line * step], step);
        let (right, bottom) = if step == 1 { (left, top) } else { (right, bottom) };
        let nearest = |at: usize, size: usize| inside(size, step).map(|(first, last)| at.clamp(first, last));
        let columns = [left, right].map(|x| nearest(x, self.width));
        let lines = [top, bottom].map(|y| nearest(y, self.height));
        let (mut across, mut down) = (0.0_f32, 0.0_f32);
        let planes = self.values.iter().zip(self.weights.iter()).filter(|(_, weight)| *weight > 0.0);
        for (plane, weight) in planes {
            let second = |at: usize, by: usize| weight * bent(plane[at - by], plane[at], plane[at + by]);
            let some = if step == 1 { &[(0, 0)][..] } else { &[(0, 0), (1, 0), (0, 1), (1, 1)][..] };
            for (x, y) in some {
                if let Some(column) = columns[*x] {
                    across = across.max(second([top, bottom][*y] * self.width + column, step));
                }
                if let Some(line) = lines[*y] {
                    down = down.max(second(line * self.width + [left, right][*x], step * self.width));
                }
            }
            if let (1, Some(x), Some(y)) = (step, columns[0], lines[0]) {
                // A feature the size of a pixel may touch only its corner.
                across = across.max(second(y * self.width + x, self.width + 1));
                down = down.max(second(y * self.width + x, self.width - 1));
            }
        }
        (across + down) / 8.0
    }
}

/// The first and the last lattice position along an axis that have a neighbour on either side. They stand in
/// for the border positions.
fn inside(size: usize, step: usize) -> Option<(usize, usize)> {
    let last = size.saturating_sub(1 + step) / step * step;
    (last >= step).then_some((step, last))
}

/// Absolute second difference of three neighbours; infinite if any is NaN.
fn bent(before: f32, here: f32, behind: f32) -> f32 {
    let d = (before - 2.0 * here + behind).abs();
    if d.is_nan() { f32::INFINITY } else { d }
}
