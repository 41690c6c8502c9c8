//! Pixels on a lattice: computing them, interpolating between them, and how far off that may be.

use super::{COARSE, Work};
use crate::sample::rate::{mix, stretched, ticks};
use osl_exec::Stop;
use std::ops::Range;

impl Work<'_, '_> {
    /// The corners of a cell of a lattice: left, right, top, bottom.
    pub(super) fn cell(&self, x: usize, y: usize, step: usize) -> [usize; 4] {
        let (left, top) = (x / step * step, y / step * step);
        [left, (left + step).min(self.width - 1), top, (top + step).min(self.height - 1)]
    }

    /// What the estimate of the error in the cell of a pixel is made of: its corners, and those around it.
    pub(super) fn around(&self, [x, y]: [usize; 2], step: usize) -> impl Iterator<Item = u32> + use<> {
        let [left, right, top, bottom] = self.cell(x, y, step);
        let (far, low) = if step == 1 { (left + 1, top + 1) } else { (right + step, bottom + step) };
        let columns = [left.saturating_sub(step), left, right, far].map(|x| x.min(self.width - 1));
        let lines = [top.saturating_sub(step), top, bottom, low].map(|y| y.min(self.height - 1));
        let width = self.width;
        lines.into_iter().flat_map(move |y| columns.map(|x| (y * width + x) as u32))
    }

    /// Computes what those cells need that are wanted, by their top left corner, and interpolates inside.
    pub(super) fn lattice(&mut self, step: usize, wanted: impl Fn(usize) -> bool) -> Result<(), Stop> {
        let mut needed = Vec::new();
        let mut cells = Vec::new();
        for y in (0..self.height).step_by(step) {
            for x in (0..self.width).step_by(step) {
                if wanted(y * self.width + x) {
                    cells.push(self.cell(x, y, step));
                    needed.extend(self.around([x, y], step));
                }
            }
        }
        self.centres(needed)?;
        if step > 1 {
            let (width, known) = (self.width, &self.known);
            for values in &mut self.values {
                cells.iter().for_each(|cell| interpolate(values, known, width, *cell));
            }
        }
        Ok(())
    }

    /// Computes the coarsest lattice and interpolates all pixels between. Yields the estimates of their errors.
    pub(super) fn coarse(&mut self) -> Result<Bends, Stop> {
        let (width, rows) = (self.width, 0..self.height);
        let columns = ticks(0..width, COARSE);
        let lines = ticks(rows.clone(), COARSE);
        let pixels: Vec<u32> =
            lines.iter().flat_map(|y| columns.iter().map(move |x| (y * width + x) as u32)).collect();
        pixels.iter().for_each(|pixel| self.known[*pixel as usize] = true);
        self.evaluations += pixels.len() as u64;
        let all: Vec<u32> = pixels.iter().map(|pixel| pixel + self.first).collect();
        let known = self.shading.centres(&all, &mut self.said)?;
        self.values = known.iter().map(|plane| stretched(plane, &columns, &lines, width, &rows)).collect();
        Ok(Bends::new(&known, &columns, &lines, [width, self.height]))
    }

    /// The estimate of the error of a pixel that is interpolated in a cell, from the values around it: an eighth of how the
    /// lattice bends at its corners. For the lattice of all pixels, how the image bends at a pixel.
    pub(super) fn bend(&self, [x, y]: [usize; 2], step: usize) -> f32 {
        let [left, right, top, bottom] = self.cell(x, y, step);
        let (right, bottom) = if step == 1 { (left, top) } else { (right, bottom) };
        let (mut across, mut down) = (0.0_f32, 0.0_f32);
        for plane in &self.values {
            for (x, y) in [(left, top), (right, top), (left, bottom), (right, bottom)] {
                let before = x >= step && x + step < self.width;
                let above = y >= step && y + step < self.height;
                let at = y * self.width + x;
                let (side, line) = (step, step * self.width);
                let second = |by: usize| bent(plane[at - by], plane[at], plane[at + by]);
                if before {
                    across = across.max(second(side));
                }
                if above {
                    down = down.max(second(line));
                }
                if step == 1 && before && above {
                    // What is as small as a pixel may touch its corner alone.
                    across = across.max(second(line + side));
                    down = down.max(second(line - side));
                }
            }
        }
        (across + down) / 8.0
    }
}

/// How far a value is off the line between its neighbours; infinite where one is no number.
fn bent(before: f32, here: f32, behind: f32) -> f32 {
    let d = (before - 2.0 * here + behind).abs();
    if d.is_nan() { f32::INFINITY } else { d }
}

/// For each cell of the coarsest lattice, the estimate of the error of its pixels.
pub(super) struct Bends {
    size: [usize; 2],
    /// Cells of a row, and rows of them.
    cells: [usize; 2],
    bends: Vec<f32>,
}

impl Bends {
    fn new(known: &[Vec<f32>], columns: &[usize], lines: &[usize], size: [usize; 2]) -> Bends {
        let [nx, ny] = [columns.len(), lines.len()];
        let (mut across, mut down) = (vec![0.0_f32; nx * ny], vec![0.0_f32; nx * ny]);
        for plane in known {
            for y in 0..ny {
                for x in 0..nx {
                    let at = y * nx + x;
                    if x > 0 && x + 1 < nx {
                        across[at] = across[at].max(bent(plane[at - 1], plane[at], plane[at + 1]));
                    }
                    if y > 0 && y + 1 < ny {
                        down[at] = down[at].max(bent(plane[at - nx], plane[at], plane[at + nx]));
                    }
                }
            }
        }
        let cells = [nx.saturating_sub(1).max(1), ny.saturating_sub(1).max(1)];
        let mut bends = Vec::with_capacity(cells[0] * cells[1]);
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let (right, below) = ((x + 1).min(nx.max(1) - 1), (y + 1).min(ny.max(1) - 1));
                let corners = [(x, y), (right, y), (x, below), (right, below)];
                let most = |list: &[f32]| {
                    corners.iter().filter_map(|(x, y)| list.get(y * nx + x)).fold(0.0_f32, |m, d| m.max(*d))
                };
                bends.push((most(&across) + most(&down)) / 8.0);
            }
        }
        Bends { size, cells, bends }
    }

    /// The estimate of a pixel.
    pub(super) fn at(&self, pixel: usize) -> f32 {
        let (x, y) = (pixel % self.size[0], pixel / self.size[0]);
        let [x, y] = [(x / COARSE).min(self.cells[0] - 1), (y / COARSE).min(self.cells[1] - 1)];
        self.bends.get(y * self.cells[0] + x).copied().unwrap_or(f32::INFINITY)
    }

    /// Calls `visit` with each estimate and pieces of rows that it holds for.
    pub(super) fn each(&self, mut visit: impl FnMut(f32, Range<usize>)) {
        let [width, height] = self.size;
        for y in 0..height {
            let mut x = 0;
            while x < width {
                let last = x / COARSE + 1 >= self.cells[0];
                let end = if last { width } else { x + COARSE };
                visit(self.at(y * width + x), y * width + x..y * width + end);
                x = end;
            }
        }
    }
}

/// Interpolates the pixels of a cell that are not known. The last row and column of a band belong to its last cells.
pub(super) fn interpolate(values: &mut [f32], known: &[bool], width: usize, cell: [usize; 4]) {
    let [left, right, top, bottom] = cell;
    for y in top..=bottom {
        for x in left..=right {
            let at = y * width + x;
            if !known[at] {
                values[at] = between(values, width, cell, [x, y]);
            }
        }
    }
}

/// The value at a place within a cell, from its corners.
pub(super) fn between(
    values: &[f32],
    width: usize,
    [left, right, top, bottom]: [usize; 4],
    [x, y]: [usize; 2],
) -> f32 {
    let share = |at: usize, from: usize, to: usize| (at - from) as f32 / (to - from).max(1) as f32;
    let (s, t) = (share(x, left, right), share(y, top, bottom));
    let line = |y: usize| mix(values[y * width + left], values[y * width + right], s);
    mix(line(top), line(bottom), t)
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
