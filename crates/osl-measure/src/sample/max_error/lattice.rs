//! Pixels on a lattice: computing them, interpolating between them, and accepting the interpolated pixels.

use super::curvature::{Curvatures, Spot, corners, interpolate};
use super::policy::COARSE;
use super::{Work, above};
use crate::sample::rate::{stretch, ticks};
use osl_exec::RunError;
use rayon::prelude::*;

impl Work<'_, '_> {
    /// The corners of a cell of a lattice: left, right, top, bottom.
    pub(super) fn cell(&self, [x, y]: [usize; 2], step: usize) -> [usize; 4] {
        corners([self.width, self.height], [x, y], step)
    }

    /// Calls `visit` with every pixel that the error estimate of a cell reads: the cell's corners and their
    /// neighbours.
    pub(super) fn around(&self, [x, y]: [usize; 2], step: usize, mut visit: impl FnMut(usize)) {
        let [left, right, top, bottom] = self.cell([x, y], step);
        let (far, low) = if step == 1 { (left + 1, top + 1) } else { (right + step, bottom + step) };
        let columns = [left.saturating_sub(step), left, right, far].map(|x| x.min(self.width - 1));
        let lines = [top.saturating_sub(step), top, bottom, low].map(|y| y.min(self.height - 1));
        lines.into_iter().for_each(|y| columns.iter().for_each(|x| visit(y * self.width + x)));
    }

    /// Computes the coarsest lattice, and interpolates the other pixels.
    pub(super) fn coarse(&mut self) -> Result<(), RunError> {
        let (width, rows) = (self.width, 0..self.height);
        let (columns, lines) = (ticks(0..width, COARSE), ticks(rows.clone(), COARSE));
        let pixels: Vec<u32> =
            lines.iter().flat_map(|y| columns.iter().map(move |x| (y * width + x) as u32)).collect();
        pixels.iter().for_each(|pixel| self.known[*pixel as usize] = true);
        self.evaluations += pixels.len() as u64;
        let known = self.shading.centres(&self.in_image(&pixels), &mut self.said)?;
        let planes = known.into_iter().map(|plane| {
            let mut values = vec![0.0; width * rows.len()];
            stretch(&plane, (&columns, &lines), &rows, (&mut values, width));
            values
        });
        self.values = planes.collect();
        Ok(())
    }

    /// Computes the pixels that cells with pending pixels, and their estimates, need; then interpolates
    /// inside these cells.
    pub(super) fn lattice(&mut self, step: usize, pending: &[bool]) -> Result<(), RunError> {
        let width = self.width;
        let mut cells: Vec<[usize; 2]> = Vec::new();
        for (line, rows) in pending.chunks(step * width).enumerate() {
            let is_wanted =
                |x: &usize| rows.chunks(width).any(|row| row[*x..(*x + step).min(width)].contains(&true));
            cells.extend((0..width).step_by(step).filter(is_wanted).map(|x| [x, line * step]));
        }
        let mut needed = vec![false; pending.len()];
        for cell in &cells {
            self.around(*cell, step, |pixel| needed[pixel] = true);
        }
        let missing = (0..needed.len()).filter(|at| needed[*at] && !self.known[*at]);
        self.compute(&missing.map(|at| at as u32).collect::<Vec<_>>())?;
        let size = [width, self.height];
        for values in &mut self.values {
            cells.iter().for_each(|at| interpolate(values, &self.known, width, corners(size, *at, step)));
        }
        Ok(())
    }

    /// Settles the pending pixels of cells whose estimate is at most `limit`.
    pub(super) fn settle(&self, limit: f32, curvatures: &Curvatures, pending: &mut [bool]) {
        let rows = pending.par_chunks_mut(self.width).with_min_len(32).enumerate();
        rows.for_each(|(y, row)| {
            let one = |(x, pending): (usize, &mut bool)| *pending &= above(curvatures.at([x, y]), limit);
            row.iter_mut().enumerate().for_each(one);
        });
    }

    /// A position in a lattice.
    pub(super) fn spot(&self, [x, y]: [f32; 2], step: usize) -> Spot {
        if step == 1 && self.width > 2 && self.height > 2 {
            return Spot::near([self.width, self.height], [x, y]);
        }
        let nearest = |at: f32, size: usize| (at.max(0.0) as usize).min(size - 1);
        let cell = self.cell([nearest(x, self.width), nearest(y, self.height)], step);
        Spot::between(self.width, cell, [x, y])
    }
}
