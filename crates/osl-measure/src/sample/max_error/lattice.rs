//! Pixels on a lattice: computing them, interpolating between them, and how far off that may be.

use super::Work;
use crate::sample::rate::mix;
use osl_exec::Stop;

impl Work<'_, '_> {
    /// The corners of a cell of a lattice: left, right, top, bottom.
    pub(super) fn cell(&self, x: usize, y: usize, step: usize) -> [usize; 4] {
        let (left, top) = (x / step * step, y / step * step);
        [left, (left + step).min(self.width - 1), top, (top + step).min(self.height - 1)]
    }

    /// Computes the corners of those cells that are wanted, by their top left corner, and interpolates inside.
    pub(super) fn lattice(&mut self, step: usize, wanted: impl Fn(usize) -> bool) -> Result<(), Stop> {
        let mut corners = Vec::new();
        let mut cells = Vec::new();
        for y in (0..self.height).step_by(step) {
            for x in (0..self.width).step_by(step) {
                if wanted(y * self.width + x) {
                    let [left, right, top, bottom] = self.cell(x, y, step);
                    cells.push([left, right, top, bottom]);
                    for y in [top, bottom] {
                        corners.extend([left, right].map(|x| (y * self.width + x) as u32));
                    }
                }
            }
        }
        self.centres(corners)?;
        if step > 1 {
            let (width, known) = (self.width, &self.known);
            for values in &mut self.values {
                cells.iter().for_each(|cell| interpolate(values, known, width, *cell));
            }
        }
        Ok(())
    }

    /// For each pixel, the estimate of its error if it is interpolated from a lattice: an eighth of how the lattice bends at
    /// the corners around it.
    pub(super) fn bends(&self, step: usize) -> Vec<f32> {
        let mut bends = vec![0.0; self.width * self.height];
        for y in (0..self.height).step_by(step) {
            for x in (0..self.width).step_by(step) {
                let bend = self.bend([x, y], step, |plane, x, y| plane.get(y * self.width + x).copied());
                for y in y..(y + step).min(self.height) {
                    bends[y * self.width + x..y * self.width + (x + step).min(self.width)].fill(bend);
                }
            }
        }
        bends
    }

    pub(super) fn bend(
        &self,
        [x, y]: [usize; 2],
        step: usize,
        at: impl Fn(&[f32], usize, usize) -> Option<f32>,
    ) -> f32 {
        let [left, right, top, bottom] = self.cell(x, y, step);
        let (mut across, mut down) = (0.0_f32, 0.0_f32);
        let second =
            |before: Option<f32>, here: Option<f32>, behind: Option<f32>| match (before, here, behind) {
                (Some(a), Some(b), Some(c)) => {
                    let d = (a - 2.0 * b + c).abs();
                    if d.is_nan() { f32::INFINITY } else { d }
                }
                _ => 0.0,
            };
        let inside = |x: Option<usize>, n: usize| x.filter(|x| *x < n);
        for plane in &self.values {
            let at = |x: Option<usize>, y: Option<usize>| {
                at(plane, inside(x, self.width)?, inside(y, self.height)?)
            };
            let (columns, lines) =
                if step == 1 { (&[left][..], &[top][..]) } else { (&[left, right][..], &[top, bottom][..]) };
            for y in lines {
                for x in columns {
                    let here = at(Some(*x), Some(*y));
                    let (before, behind) = (x.checked_sub(step), Some(x + step));
                    across = across.max(second(at(before, Some(*y)), here, at(behind, Some(*y))));
                    let (above, below) = (y.checked_sub(step), Some(y + step));
                    down = down.max(second(at(Some(*x), above), here, at(Some(*x), below)));
                    if step == 1 {
                        // What is as small as a pixel may touch its corner alone.
                        across = across.max(second(at(before, above), here, at(behind, below)));
                        down = down.max(second(at(before, below), here, at(behind, above)));
                    }
                }
            }
        }
        (across + down) / 8.0
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
