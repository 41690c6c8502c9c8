//! Curvature of a lattice: the error estimate for interpolated pixels.
//!
//! A *curvature* is the absolute second difference between neighbouring lattice values.

use super::cell::corners;
use super::{Work, count};
use crate::sample::rate::ticks;
use crate::sample::weights::Weights;
use osl_simd::{Isa, Kernel};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// The curvatures of the cells of a lattice.
pub(super) struct Curvatures {
    step: usize,
    /// Cells of a lattice line.
    columns: usize,
    /// Infinite in lines without pending pixels, unless they are known too.
    cells: Vec<f32>,
    /// Which lines are known.
    wanted: Vec<bool>,
}

impl Curvatures {
    /// The curvatures of the cells of a lattice line.
    pub(super) fn row(&self, line: usize) -> &[f32] {
        self.cells.get(line * self.columns..(line + 1) * self.columns).unwrap_or(&[])
    }

    /// Whether no known curvature exceeds a limit.
    pub(super) fn are_below(&self, limit: f32) -> bool {
        let mut rows = self.cells.chunks(self.columns.max(1)).zip(&self.wanted);
        rows.all(|(row, wanted)| !wanted || row.iter().all(|curvature| *curvature <= limit))
    }

    /// The curvature of the cell that contains a pixel.
    pub(super) fn at(&self, [x, y]: [usize; 2]) -> f32 {
        self.row(y / self.step).get(x / self.step).copied().unwrap_or(f32::INFINITY)
    }
}

/// The pixels of a band, plane by plane.
struct Planes<'a> {
    width: usize,
    height: usize,
    values: &'a [Vec<f32>],
    weights: &'a Weights,
}

impl<'a> Planes<'a> {
    /// The planes that have a bound, with their factors.
    fn weighty(&self) -> impl Iterator<Item = (&'a Vec<f32>, f32)> {
        self.values.iter().zip(self.weights.iter()).filter(|(_, weight)| *weight > 0.0)
    }
}

/// Lines of cells that a thread examines together.
const BAND: usize = 16;

impl Work<'_, '_> {
    /// The curvatures of a lattice, for every cell with pending pixels. Those of a lattice that was computed
    /// as a whole are kept for every cell, because they change no more.
    pub(super) fn curvatures(&mut self, step: usize, pending: &[bool]) -> Arc<Curvatures> {
        let Some(kept) = self.kept(step) else {
            let lines = pending.chunks(step * self.width).map(|line| count(line) > 0).collect();
            return Arc::new(self.planes().curvatures(step, lines));
        };
        if let Some(kept) = kept.curvatures.clone() {
            return kept;
        }
        let lines = vec![true; self.height.div_ceil(step)];
        let found = Arc::new(self.planes().curvatures(step, lines));
        if let Some(kept) = self.kept(step) {
            kept.curvatures = Some(found.clone());
        }
        found
    }

    /// The curvature of one cell, given by its top left corner.
    pub(super) fn curvature(&self, corner: [usize; 2], step: usize) -> f32 {
        self.planes().curvature(corner, step)
    }

    fn planes(&self) -> Planes<'_> {
        Planes { width: self.width, height: self.height, values: &self.values, weights: &self.weights }
    }
}

impl Planes<'_> {
    /// The curvatures of a lattice: [`curvature`](Self::curvature) of each of its cells, in some of the lines
    /// of cells.
    fn curvatures(&self, step: usize, wanted: Vec<bool>) -> Curvatures {
        let columns = self.width.div_ceil(step);
        let (across, down) = (ticks(0..self.width, step).len(), ticks(0..self.height, step));
        let lattices: Vec<(Cow<'_, [f32]>, f32)> =
            self.weighty().map(|(plane, weight)| (self.lattice(plane, &down, step), weight)).collect();
        let isa = Isa::detect();
        let mut cells = vec![f32::INFINITY; columns * wanted.len()];
        cells.par_chunks_mut(columns * BAND).enumerate().for_each(|(band, cells)| {
            let (first, lines) = (band * BAND, (&down[..], across));
            isa.dispatch(Band {
                planes: self,
                lattices: &lattices,
                step,
                lines,
                wanted: &wanted,
                first,
                cells,
            });
        });
        Curvatures { step, columns, cells, wanted }
    }

    /// The pixels of a lattice alone, row by row. `lines` are its rows.
    fn lattice<'p>(&self, plane: &'p [f32], lines: &[usize], step: usize) -> Cow<'p, [f32]> {
        if step == 1 {
            return Cow::Borrowed(plane);
        }
        // Between the last column of the lattice and the border, the border is a column too.
        let has_border = !(self.width - 1).is_multiple_of(step);
        let mut pixels = Vec::with_capacity(lines.len() * (self.width / step + 2));
        for y in lines {
            let row = &plane[y * self.width..(y + 1) * self.width];
            pixels.extend(row.chunks(step).map(|cell| cell[0]));
            pixels.extend(row.last().filter(|_| has_border));
        }
        pixels.into()
    }

    /// The curvatures at the pixels of one lattice line, which has a number and is a row of the image: along
    /// the line, and across it. `lattices` are the pixels of the lattice in each plane, and the plane's
    /// factor.
    #[inline(always)]
    fn line(
        &self,
        lattices: &[(Cow<'_, [f32]>, f32)],
        (number, y): (usize, usize),
        step: usize,
        (across, down): (&mut [f32], &mut [f32]),
    ) {
        let columns = across.len();
        let last = inside(self.width, step).map_or(0, |(_, last)| last / step);
        let middle = inside(self.height, step).map(|(first, last)| y.clamp(first, last) / step);
        // At the borders, use the curvature of the neighbouring column.
        let mut twist = vec![0.0; if step == 1 { columns } else { 0 }];
        for (pixels, weight) in lattices {
            let weight = *weight;
            let row = |line: usize| &pixels[line * columns..(line + 1) * columns];
            let here = row(number);
            seconds(&mut across[..=last], [here; 3], ([0, 1, 2], weight));
            let Some(middle) = middle else { continue };
            let rows = [row(middle - 1), row(middle), row(middle + 1)];
            for (down, ((a, b), c)) in down.iter_mut().zip(rows[0].iter().zip(rows[1]).zip(rows[2])) {
                *down = larger(*down, weight * bent(*a, *b, *c));
            }
            if step == 1 {
                // A feature the size of a pixel may touch only its corner.
                seconds(&mut across[..=last], rows, ([0, 1, 2], weight));
                seconds(&mut twist[..=last], rows, ([2, 1, 0], weight));
            }
        }
        let of_border = |of: &mut [f32]| {
            if last > 0 && !of.is_empty() {
                of[0] = of[1];
                let end = of[last];
                of[last + 1..].fill(end);
            }
        };
        of_border(across);
        of_border(&mut twist);
        down.iter_mut().zip(twist).for_each(|(down, twist)| *down = larger(*down, twist));
    }

    /// The estimated error of a pixel that is interpolated in a cell: an eighth of the lattice's curvature at
    /// the corners of the cell. For the lattice of all pixels, the curvature of the image at the pixel.
    fn curvature(&self, [x, y]: [usize; 2], step: usize) -> f32 {
        let [left, right, top, bottom] = corners([self.width, self.height], [x, y], step);
        let (right, bottom) = if step == 1 { (left, top) } else { (right, bottom) };
        let nearest = |at: usize, size: usize| inside(size, step).map(|(first, last)| at.clamp(first, last));
        let columns = [left, right].map(|x| nearest(x, self.width));
        let lines = [top, bottom].map(|y| nearest(y, self.height));
        let (mut across, mut down) = (0.0_f32, 0.0_f32);
        for (plane, weight) in self.weighty() {
            let second = |at: usize, by: usize| weight * bent(plane[at - by], plane[at], plane[at + by]);
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (own_x, own_y) = ([left, right][x], [top, bottom][y]);
                if let Some(x) = columns[x] {
                    across = across.max(second(own_y * self.width + x, step));
                }
                if let Some(y) = lines[y] {
                    down = down.max(second(y * self.width + own_x, step * self.width));
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

/// Some lines of cells.
struct Band<'a> {
    planes: &'a Planes<'a>,
    /// The pixels of the lattice in each plane, and the plane's factor.
    lattices: &'a [(Cow<'a, [f32]>, f32)],
    step: usize,
    /// The rows of the lattice, and the number of its columns.
    lines: (&'a [usize], usize),
    /// Which lines of cells of the image are wanted.
    wanted: &'a [bool],
    /// The number of the first line.
    first: usize,
    cells: &'a mut [f32],
}

impl Kernel for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Band { planes, lattices, step, lines: (rows, across), wanted, first, cells } = self;
        let line_of = |number: usize, largest: &mut Vec<f32>| {
            largest.clear();
            largest.resize(2 * across, 0.0);
            planes.line(lattices, (number, rows[number]), step, largest.split_at_mut(across));
        };
        // The largest curvatures over all planes at the pixels of the lattice lines above and below the
        // cells: along the line, then across it.
        let (mut above, mut below) = (Vec::new(), Vec::new());
        let mut known = None;
        for (line, cells) in (first..).zip(cells.chunks_mut(planes.width.div_ceil(step))) {
            if wanted.get(line) != Some(&true) {
                continue;
            }
            if known == Some(line) {
                std::mem::swap(&mut above, &mut below);
            } else {
                line_of(line, &mut above);
            }
            let (along, over) = above.split_at(across);
            if step == 1 {
                let both = along.iter().zip(over);
                cells.iter_mut().zip(both).for_each(|(cell, (a, b))| *cell = (a + b) / 8.0);
                continue;
            }
            let next = (line + 1).min(rows.len() - 1);
            line_of(next, &mut below);
            known = Some(next);
            let (along_below, over_below) = below.split_at(across);
            for (column, cell) in cells.iter_mut().enumerate() {
                // A border that is a column of the lattice has a cell of its own.
                let next = (column + 1).min(across - 1);
                let largest = |above: &[f32], below: &[f32]| {
                    larger(larger(above[column], below[column]), larger(above[next], below[next]))
                };
                *cell = (largest(along, along_below) + largest(over, over_below)) / 8.0;
            }
        }
    }
}

/// The first and the last lattice position along an axis that have a neighbour on either side. They stand in
/// for the border positions.
fn inside(size: usize, step: usize) -> Option<(usize, usize)> {
    let last = size.saturating_sub(1 + step) / step * step;
    (last >= step).then_some((step, last))
}

/// Raises the largest curvatures, from the second column on, to at least the curvatures across three rows.
/// The previous, the current and the next column are read from the rows in the order `at`: the same row three
/// times, or a diagonal. `weight` is the factor of the plane.
#[inline(always)]
fn seconds(largest: &mut [f32], rows: [&[f32]; 3], (at, weight): ([usize; 3], f32)) {
    let part = |i: usize| rows[i].get(at[i]..).unwrap_or(&[]);
    let (a, b, c) = (part(0), part(1), part(2));
    for (largest, ((a, b), c)) in largest.iter_mut().skip(1).zip(a.iter().zip(b).zip(c)) {
        *largest = larger(*largest, weight * bent(*a, *b, *c));
    }
}

/// Absolute second difference of three neighbours; infinite if any is NaN.
#[inline(always)]
fn bent(before: f32, here: f32, behind: f32) -> f32 {
    let d = (before - 2.0 * here + behind).abs();
    if d.is_nan() { f32::INFINITY } else { d }
}

/// The larger of two numbers.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bends_of_all_cells_are_those_of_each() {
        for [width, height] in [[1, 1], [2, 3], [3, 2], [5, 9], [8, 8], [9, 5], [13, 1], [33, 18]] {
            let plane = |seed: usize| -> Vec<f32> {
                let value = |at: usize| (((at + seed) * 7919) % 1009) as f32;
                (0..width * height).map(|at| if at == 17 { f32::NAN } else { value(at) }).collect()
            };
            let values = [plane(1), plane(200)];
            let planes = Planes { width, height, values: &values, weights: &Weights::equal(2) };
            for step in [1, 2, 4] {
                let curvatures = planes.curvatures(step, vec![true; height.div_ceil(step)]);
                for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                    let own = planes.curvature([x / step * step, y / step * step], step);
                    assert_eq!(curvatures.at([x, y]), own, "{x} {y} of {width} {height} by {step}");
                }
            }
        }
    }
}
