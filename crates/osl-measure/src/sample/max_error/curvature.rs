//! Cells of a lattice: their corners, the values that are interpolated between them, and their curvature,
//! which is the error estimate for interpolated pixels.
//!
//! A *curvature* is the absolute second difference between neighbouring lattice values.

use super::Work;
use crate::sample::error::Weights;
use crate::sample::rate::mix;
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

/// The corners of a pixel's cell: left, right, top, bottom.
pub(super) fn corners([width, height]: [usize; 2], [x, y]: [usize; 2], step: usize) -> [usize; 4] {
    let (left, top) = (x / step * step, y / step * step);
    [left, (left + step).min(width - 1), top, (top + step).min(height - 1)]
}

/// Interpolates the pixels of a cell that are not known yet.
pub(super) fn interpolate(values: &mut [f32], known: &[bool], width: usize, cell: [usize; 4]) {
    let [left, right, top, bottom] = cell;
    for y in top..=bottom {
        for x in left..=right {
            let at = y * width + x;
            if !known[at] {
                values[at] = Spot::between(width, cell, [x as f32, y as f32]).of(values);
            }
        }
    }
}

/// A position in a lattice, which is the same in every plane.
#[derive(Clone, Copy, Debug)]
pub(super) enum Spot {
    /// In a cell, or slightly outside: the pixels at its corners, row by row, and the shares of the way
    /// across and down.
    Between([usize; 4], [f32; 2]),
    /// Near a pixel of the lattice of all pixels that has eight neighbours: the one left above it, the width
    /// of the image, and the distances from it.
    Near(usize, usize, [f32; 2]),
}

impl Spot {
    /// A position in a cell, or slightly outside. The cell has its corners left, right, top and bottom.
    pub(super) fn between(width: usize, [left, right, top, bottom]: [usize; 4], [x, y]: [f32; 2]) -> Spot {
        let share = |at: f32, from: usize, to: usize| (at - from as f32) / (to - from).max(1) as f32;
        let shares = [share(x, left, right), share(y, top, bottom)];
        let [above, below] = [top, bottom].map(|y| y * width);
        Spot::Between([above + left, above + right, below + left, below + right], shares)
    }

    /// A position in the lattice of all pixels, which has at least three along each axis.
    pub(super) fn near([width, height]: [usize; 2], [x, y]: [f32; 2]) -> Spot {
        let nearest = |at: f32, size: usize| ((at + 0.5).max(1.0) as usize).min(size - 2);
        let (column, line) = (nearest(x, width), nearest(y, height));
        Spot::Near((line - 1) * width + column - 1, width, [x - column as f32, y - line as f32])
    }

    /// The lattice's prediction for one plane: interpolated between the corners of a cell or, in the lattice
    /// of all pixels, on the parabolas through a pixel and its neighbours.
    pub(super) fn of(&self, plane: &[f32]) -> f32 {
        match *self {
            Spot::Between([a, b, c, d], [s, t]) => {
                mix(mix(plane[a], plane[b], s), mix(plane[c], plane[d], s), t)
            }
            Spot::Near(first, width, [s, t]) => {
                let row = |number: usize| {
                    let row = &plane[first + number * width..first + number * width + 3];
                    [row[0], row[1], row[2]]
                };
                let [above, own, below] = [row(0), row(1), row(2)];
                let twist = 0.25 * s * t * (above[0] + below[2] - below[0] - above[2]);
                let down = curved([above[1], own[1], below[1]], t);
                own[1] + curved(own, s) + down + twist
            }
        }
    }
}

/// How much the parabola through three values differs from the middle one at a distance from it.
fn curved([a, here, b]: [f32; 3], t: f32) -> f32 {
    t * 0.5 * (b - a) + 0.5 * t * t * (a - 2.0 * here + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_filled_between_its_corners() {
        let mut values = vec![0.0; 25];
        let mut known = vec![false; 25];
        for (at, x) in [(0, 0.0), (4, 4.0), (20, 8.0), (24, 12.0)] {
            (values[at], known[at]) = (x, true);
        }
        interpolate(&mut values, &known, 5, [0, 4, 0, 4]);
        assert_eq!((values[12], values[2], values[10]), (6.0, 2.0, 4.0));
    }
}
