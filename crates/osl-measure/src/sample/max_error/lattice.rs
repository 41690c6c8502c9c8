//! Pixels on a lattice: computing them, interpolating between them, and accepting the interpolated pixels.

use super::cell::{Spot, corners, interpolate};
use super::curvature::Curvatures;
use super::policy::{COARSE, WHOLE, WIDEST};
use super::{Work, above, add_set, count, scatter};
use crate::sample::rate::{mix, stretch, ticks};
use osl_exec::RunError;
use rayon::prelude::*;

/// A curvature above this multiple of the limit marks an edge.
const EDGE: f32 = 4.0;
/// Rows of pixels that a thread handles together.
const ROWS: usize = 32;

impl Work<'_, '_> {
    /// The corners of a cell of a lattice: left, right, top, bottom.
    pub(super) fn cell(&self, x: usize, y: usize, step: usize) -> [usize; 4] {
        corners([self.width, self.height], [x, y], step)
    }

    /// Calls `visit` with every pixel that the error estimate of a cell reads: the cell's corners and their
    /// neighbours.
    pub(super) fn around(&self, [x, y]: [usize; 2], step: usize, mut visit: impl FnMut(usize)) {
        let [left, right, top, bottom] = self.cell(x, y, step);
        let (far, low) = if step == 1 { (left + 1, top + 1) } else { (right + step, bottom + step) };
        let columns = [left.saturating_sub(step), left, right, far].map(|x| x.min(self.width - 1));
        let lines = [top.saturating_sub(step), top, bottom, low].map(|y| y.min(self.height - 1));
        lines.into_iter().for_each(|y| columns.iter().for_each(|x| visit(y * self.width + x)));
    }

    /// Computes the coarsest lattice.
    pub(super) fn coarse(&mut self) -> Result<(), RunError> {
        let (width, rows) = (self.width, 0..self.height);
        let (columns, lines) = (ticks(0..width, COARSE), ticks(rows.clone(), COARSE));
        let mut pixels: Vec<u32> = Vec::with_capacity(columns.len() * lines.len());
        lines.iter().for_each(|y| pixels.extend(columns.iter().map(|x| (y * width + x) as u32)));
        pixels.iter().for_each(|pixel| self.known[*pixel as usize] = true);
        self.evaluations += pixels.len() as u64;
        let known = self.shading.centres(&self.in_image(&pixels), &mut self.said)?;
        let planes = known.into_iter().map(|plane| {
            let mut values = vec![0.0; width * rows.len()];
            pixels.iter().zip(plane).for_each(|(pixel, x)| values[*pixel as usize] = x);
            values
        });
        self.values = planes.collect();
        self.keep(COARSE);
        Ok(())
    }

    /// Interpolates the pixels that were not computed in the coarsest lattice, unless a finer one was
    /// computed as a whole. This is done as late as possible, because it takes time for every pixel.
    pub(super) fn fill(&mut self) {
        if self.filled.is_none() {
            self.interpolate([COARSE; 2]);
        }
    }

    /// Interpolates the pixels that were not computed in a lattice that was.
    fn interpolate(&mut self, steps: [usize; 2]) {
        let (width, rows) = (self.width, 0..self.height);
        let (columns, lines) = (ticks(0..width, steps[0]), ticks(rows.clone(), steps[1]));
        self.filled = Some(steps);
        let known = count(&self.known);
        if known == self.known.len() {
            return;
        }
        // At the pixels of the lattice, the interpolated value is the computed one.
        let mut others = Vec::new();
        if known > columns.len() * lines.len() {
            self.each_row(steps, |is_tick, known| *is_tick = !*is_tick & known, &mut others);
        }
        for values in &mut self.values {
            let mut corners = Vec::with_capacity(columns.len() * lines.len());
            for y in &lines {
                let row = &values[y * width..(y + 1) * width];
                corners.extend(columns.iter().map(|x| row[*x]));
            }
            let own: Vec<f32> = others.iter().map(|at| values[*at as usize]).collect();
            stretch(&corners, (&columns, &lines), &rows, (values, width));
            scatter(&others, &own, values);
        }
    }

    /// Computes the pixels that cells with pending pixels, and their estimates, need; then interpolates
    /// inside these cells. If most pixels are pending, the whole lattice is computed, which is quicker.
    pub(super) fn lattice(&mut self, step: usize, pending: &[bool]) -> Result<(), RunError> {
        if count(pending) as f32 > WHOLE * pending.len() as f32 {
            return self.whole(step);
        }
        let mut needed = vec![false; pending.len()];
        if step == 1 {
            self.beside(pending, &mut needed);
        } else {
            for at in self.wanted(step, pending) {
                self.around([at as usize % self.width, at as usize / self.width], step, |pixel| {
                    needed[pixel] = true;
                });
            }
        }
        self.centres(&needed)?;
        self.cells(step, pending)
    }

    /// Sets the flags of some pixels and of their eight neighbours.
    fn beside(&self, pixels: &[bool], flags: &mut [bool]) {
        let rows = flags.par_chunks_mut(self.width).with_min_len(ROWS).enumerate();
        rows.for_each(|(y, flags)| {
            for y in y.saturating_sub(1)..(y + 2).min(self.height) {
                let row = &pixels[y * self.width..(y + 1) * self.width];
                flags.iter_mut().zip(row).for_each(|(flag, pixel)| *flag |= pixel);
                flags.iter_mut().skip(1).zip(row).for_each(|(flag, before)| *flag |= before);
                flags.iter_mut().zip(row.iter().skip(1)).for_each(|(flag, behind)| *flag |= behind);
            }
        });
    }

    /// Computes a whole lattice and interpolates all pixels that were not computed.
    pub(super) fn whole(&mut self, step: usize) -> Result<(), RunError> {
        self.grid([step; 2])
    }

    /// Computes every second column, and the last one, around some pixels, and interpolates between them.
    pub(super) fn between_columns(&mut self, pixels: &[usize]) -> Result<(), RunError> {
        let reach = (WIDEST / 2.0) as usize + 1;
        let (width, height) = (self.width, self.height);
        let around = |pixel: &usize, reach_across: usize| {
            let (x, y) = (pixel % width, pixel / width);
            let columns = x.saturating_sub(reach_across)..(x + reach_across + 1).min(width);
            let lines = y.saturating_sub(reach)..(y + reach + 1).min(height);
            lines.flat_map(move |y| columns.clone().map(move |x| (x, y * width + x)))
        };
        let is_column = |x: usize| x.is_multiple_of(2) || x + 1 == width;
        let mut needed = Vec::new();
        for pixel in pixels {
            let columns = around(pixel, reach + 1).filter(|(x, _)| is_column(*x));
            needed.extend(columns.map(|(_, at)| at as u32));
        }
        self.compute_missing(needed)?;
        for (_, at) in pixels.iter().flat_map(|pixel| around(pixel, reach)) {
            if !self.known[at] {
                self.values.iter_mut().for_each(|plane| plane[at] = mix(plane[at - 1], plane[at + 1], 0.5));
            }
        }
        Ok(())
    }

    /// Computes every second column and interpolates the others.
    pub(super) fn columns(&mut self) -> Result<(), RunError> {
        self.grid([2, 1])
    }

    /// The pixels of a lattice that were not computed yet.
    fn missing(&self, steps: [usize; 2]) -> Vec<u32> {
        let mut pixels = Vec::new();
        self.each_row(steps, |is_tick, known| *is_tick &= !known, &mut pixels);
        pixels
    }

    /// Adds the pixels that `choose` chooses, row by row. It gets whether each belongs to a lattice, and
    /// whether it was computed.
    fn each_row(&self, steps: [usize; 2], choose: impl Fn(&mut bool, bool), pixels: &mut Vec<u32>) {
        let is_tick = |at: usize, step: usize, size: usize| at.is_multiple_of(step) || at + 1 == size;
        let columns: Vec<bool> = (0..self.width).map(|x| is_tick(x, steps[0], self.width)).collect();
        let mut flags = vec![false; self.width];
        for (y, known) in self.known.chunks(self.width.max(1)).enumerate() {
            if is_tick(y, steps[1], self.height) {
                flags.copy_from_slice(&columns);
            } else {
                flags.fill(false);
            }
            flags.iter_mut().zip(known).for_each(|(flag, known)| choose(flag, *known));
            add_set(&flags, (y * self.width) as u32, pixels);
        }
    }

    fn grid(&mut self, steps: [usize; 2]) -> Result<(), RunError> {
        let missing = self.missing(steps);
        if missing.is_empty() && self.filled == Some(steps) {
            return Ok(());
        }
        self.compute(&missing)?;
        if steps[0] == steps[1] {
            self.keep(steps[0]);
        }
        if steps == [1; 2] {
            self.filled = Some(steps);
        } else {
            self.interpolate(steps);
        }
        Ok(())
    }

    /// Computes the corners of the cells with pending pixels and interpolates inside these cells.
    pub(super) fn cells(&mut self, step: usize, pending: &[bool]) -> Result<(), RunError> {
        self.fill();
        if step == 1 {
            // A cell is one pixel.
            return self.centres(pending);
        }
        let cells = self.wanted(step, pending);
        let mut needed = vec![false; pending.len()];
        let size = [self.width, self.height];
        let cell = |at: &u32| corners(size, [*at as usize % size[0], *at as usize / size[0]], step);
        for [left, right, top, bottom] in cells.iter().map(cell) {
            [top, bottom]
                .iter()
                .for_each(|y| [left, right].iter().for_each(|x| needed[y * size[0] + x] = true));
        }
        self.centres(&needed)?;
        let known = &self.known;
        self.filled = Some([0; 2]);
        for values in &mut self.values {
            cells.iter().for_each(|at| interpolate(values, known, size[0], cell(at)));
        }
        Ok(())
    }

    /// The cells with pending pixels, by their top left corners.
    fn wanted(&self, step: usize, pending: &[bool]) -> Vec<u32> {
        let mut cells = Vec::new();
        let mut any = vec![false; self.width];
        for (line, rows) in pending.chunks(step * self.width).enumerate() {
            any.fill(false);
            for row in rows.chunks(self.width) {
                any.iter_mut().zip(row).for_each(|(any, pending)| *any |= pending);
            }
            if any.iter().fold(false, |all, any| all | any) {
                let columns = any.chunks(step).enumerate().filter(|(_, cell)| cell.contains(&true));
                cells.extend(columns.map(|(column, _)| (line * step * self.width + column * step) as u32));
            }
        }
        cells
    }

    /// Settles the pending pixels of cells whose estimate is at most `limit`. Pixels next to one far above
    /// the limit stay pending, because an edge may reach into them.
    pub(super) fn settle(&self, step: usize, limit: f32, curvatures: &Curvatures, pending: &mut [bool]) {
        if limit < 0.0 {
            return;
        }
        if curvatures.are_below(limit) {
            pending.fill(false);
            return;
        }
        if step > 1 {
            let rows = pending.par_chunks_mut(self.width).with_min_len(ROWS);
            rows.enumerate().for_each(|(y, row)| {
                let curvatures = curvatures.row(y / step);
                match step {
                    2 => settle_cells::<2>(row, curvatures, limit),
                    _ => settle_cells::<COARSE>(row, curvatures, limit),
                }
            });
            return;
        }
        let rows = pending.par_chunks_mut(self.width).with_min_len(ROWS).enumerate();
        let edges: Vec<Vec<usize>> =
            rows.map(|(y, row)| settle_pixels(row, curvatures.row(y), limit)).collect();
        for (y, edges) in edges.into_iter().enumerate() {
            for x in edges {
                for y in y.saturating_sub(1)..(y + 2).min(self.height) {
                    let row = y * self.width;
                    pending[row + x.saturating_sub(1)..row + (x + 2).min(self.width)].fill(true);
                }
            }
        }
    }

    /// A position in a lattice.
    pub(super) fn spot(&self, [x, y]: [f32; 2], step: usize) -> Spot {
        if step == 1 {
            return Spot::near([self.width, self.height], [x, y]);
        }
        let nearest = |at: f32, size: usize| (at.max(0.0) as usize).min(size - 1);
        let cell = self.cell(nearest(x, self.width), nearest(y, self.height), step);
        Spot::between(self.width, cell, [x, y])
    }
}

/// Settles the pixels of a row whose curvature is at most a limit. Returns those that were pending and whose
/// curvature is far above it.
fn settle_pixels(row: &mut [bool], curvatures: &[f32], limit: f32) -> Vec<usize> {
    let is_edge = |pending: bool, curvature: f32| pending & above(curvature, EDGE * limit);
    let pairs = row.iter().zip(curvatures);
    let mut edges = Vec::new();
    if pairs.fold(false, |any, (pending, curvature)| any | is_edge(*pending, *curvature)) {
        let pairs = row.iter().zip(curvatures).enumerate();
        let found = pairs.filter(|(_, (pending, curvature))| is_edge(**pending, **curvature));
        edges.extend(found.map(|(x, _)| x));
    }
    row.iter_mut().zip(curvatures).for_each(|(pending, curvature)| *pending &= above(*curvature, limit));
    edges
}

/// Settles the pixels of a row in cells of a width whose curvature is at most a limit.
fn settle_cells<const STEP: usize>(row: &mut [bool], curvatures: &[f32], limit: f32) {
    let (cells, last) = row.as_chunks_mut::<STEP>();
    let (inner, border) = curvatures.split_at(cells.len().min(curvatures.len()));
    for (cell, curvature) in cells.iter_mut().zip(inner) {
        let stays = above(*curvature, limit);
        cell.iter_mut().for_each(|pending| *pending &= stays);
    }
    if border.first().is_some_and(|curvature| *curvature <= limit) {
        last.fill(false);
    }
}
