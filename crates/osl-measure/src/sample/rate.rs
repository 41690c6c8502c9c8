//! One evaluation for several pixels: the pixels of a lattice are computed, the others are interpolated.

use super::image::{Image, Shading};
use osl_exec::{Frame, RunError};
use rayon::prelude::*;
use std::borrow::Cow;
use std::fmt;
use std::ops::Range;

/// Distance between evaluated pixels, along x and along y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate(pub [u32; 2]);

impl Rate {
    /// All rates.
    pub const ALL: [Rate; 4] = [Rate([1, 1]), Rate([2, 1]), Rate([2, 2]), Rate([4, 4])];

    /// The rate with a name such as `2x1`.
    pub fn from_name(name: &str) -> Option<Rate> {
        Rate::ALL.into_iter().find(|rate| rate.to_string() == name)
    }

    /// Distance between the rows that are computed.
    pub fn rows(self) -> usize {
        self.0[1] as usize
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0[0], self.0[1])
    }
}

/// The computed columns or rows of a range: every `step`th and the last.
pub(super) fn ticks(range: Range<usize>, step: usize) -> Vec<usize> {
    let last = range.end.saturating_sub(1);
    let mut ticks: Vec<usize> = range.step_by(step.max(1)).collect();
    if ticks.last().is_some_and(|t| *t != last) {
        ticks.push(last);
    }
    ticks
}

/// Renders some rows of an image at a rate. The lattice begins at the first of the rows. So an image in
/// pieces equals the image in one piece if each piece has whole steps and shares its border row with the
/// next.
///
/// # Errors
/// A loop exceeds its budget.
pub fn at_rate(shading: &Shading<'_>, rows: Range<usize>, rate: Rate) -> Result<Image, RunError> {
    if rate == Rate([1, 1]) {
        return shading.rows(rows, 1);
    }
    let (width, height) = shading.surface.size();
    let rows = rows.start.min(height)..rows.end.min(height);
    // The next lattice row after the last row, with which the next piece begins.
    let step = rate.rows();
    let below = if rows.is_empty() { rows.end } else { (rows.end - 1 - rows.start).div_ceil(step) * step };
    let end = (rows.start + below + 1).min(height).max(rows.end);
    let columns = ticks(0..width, rate.0[0] as usize);
    let lines = ticks(rows.start..end, step);
    let pixels: Vec<u32> =
        lines.iter().flat_map(|y| columns.iter().map(move |x| (y * width + x) as u32)).collect();
    let mut said = Frame::default();
    let known = shading.centres(&pixels, &mut said)?;
    let values: Vec<Vec<f32>> =
        known.iter().map(|plane| stretched(plane, &columns, &lines, width, &rows)).collect();
    let mut image = shading.image(values, said, (rows.len() * width, pixels.len() as u64));
    image.tally.note_centres(pixels.len() as u64);
    Ok(image)
}

/// All pixels of some rows, interpolated from a lattice.
pub(super) fn stretched(
    known: &[f32],
    columns: &[usize],
    lines: &[usize],
    width: usize,
    rows: &Range<usize>,
) -> Vec<f32> {
    let mut values = vec![0.0; rows.len() * width];
    stretch(known, (columns, lines), rows, (&mut values, width));
    values
}

/// The same into the values of the rows, which are all replaced.
pub(super) fn stretch(
    known: &[f32],
    (columns, lines): (&[usize], &[usize]),
    rows: &Range<usize>,
    (values, width): (&mut [f32], usize),
) {
    let shares: Vec<f32> = (0..width).map(|x| between(columns, x).1).collect();
    // The pixels from each column to the next.
    let next = columns.iter().skip(1).copied().chain([width]);
    let widths: Vec<usize> = columns.iter().zip(next).map(|(column, next)| next - column).collect();
    let row = |line: usize| known.get(line * columns.len()..(line + 1) * columns.len()).unwrap_or(&[]);
    let fill = |(at, out): (usize, &mut [f32])| {
        let (line, t) = between(lines, rows.start + at);
        let (above, below) = (row(line), row((line + 1).min(lines.len().saturating_sub(1))));
        let blended: Cow<'_, [f32]> = if t == 0.0 {
            above.into()
        } else {
            above.iter().zip(below).map(|(a, b)| mix(*a, *b, t)).collect()
        };
        let done = match widths.first() {
            Some(2) => stretch_cells::<2>(&blended, &widths, out),
            Some(4) => stretch_cells::<4>(&blended, &widths, out),
            _ => 0,
        };
        let pixels = done * widths.first().unwrap_or(&0);
        let (mut out, mut shares) =
            (out.get_mut(pixels..).unwrap_or_default(), shares.get(pixels..).unwrap_or(&[]));
        let (blended, widths) = (blended.get(done..).unwrap_or(&[]), widths.get(done..).unwrap_or(&[]));
        let ends = blended.iter().zip(blended.iter().skip(1).chain(blended.last()));
        for ((a, b), wide) in ends.zip(widths) {
            let (cell, behind) = out.split_at_mut(*wide);
            let (own, others) = shares.split_at(*wide);
            cell.iter_mut().zip(own).for_each(|(out, t)| *out = mix(*a, *b, *t));
            (out, shares) = (behind, others);
        }
    };
    values.par_chunks_mut(width.max(1)).with_min_len(32).enumerate().for_each(fill);
}

/// Interpolates the first pixels of a row, as far as the distance between the columns that are known is
/// `STEP`. Returns how many cells these are.
fn stretch_cells<const STEP: usize>(known: &[f32], widths: &[usize], out: &mut [f32]) -> usize {
    let count = widths.iter().take_while(|width| **width == STEP).count();
    let (cells, _) = out.as_chunks_mut::<STEP>();
    for (cell, ends) in cells.iter_mut().zip(known.windows(2)).take(count) {
        let [a, b] = [ends[0], ends[1]];
        for (at, out) in cell.iter_mut().enumerate() {
            *out = mix(a, b, at as f32 / STEP as f32);
        }
    }
    count.min(cells.len()).min(known.len().saturating_sub(1))
}

/// The last tick at or before a position, and the fraction of the way to the next tick.
fn between(ticks: &[usize], x: usize) -> (usize, f32) {
    let at = ticks.partition_point(|tick| *tick <= x).saturating_sub(1);
    (at, share(ticks, at, x))
}

fn share(ticks: &[usize], at: usize, x: usize) -> f32 {
    match (ticks.get(at), ticks.get(at + 1)) {
        (Some(a), Some(b)) => (x - a.min(&x)) as f32 / (b - a).max(1) as f32,
        _ => 0.0,
    }
}

/// Linear interpolation; exactly `a` at 0, whatever `b` is.
#[inline]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    if t == 0.0 { a } else { a + (b - a) * t }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_the_lattice_a_slope_stays_a_slope() {
        let (width, rows) = (11, 0..7);
        let (columns, lines) = (ticks(0..width, 4), ticks(0..7, 4));
        assert_eq!((&columns[..], &lines[..]), (&[0, 4, 8, 10][..], &[0, 4, 6][..]));
        let known: Vec<f32> =
            lines.iter().flat_map(|y| columns.iter().map(move |x| (x + 10 * y) as f32)).collect();
        let values = stretched(&known, &columns, &lines, width, &rows);
        for (i, value) in values.iter().enumerate() {
            assert!((value - (i % width + 10 * (i / width)) as f32).abs() < 1e-5, "{i}: {value}");
        }
    }

    #[test]
    fn names_are_read_back() {
        for rate in Rate::ALL {
            assert_eq!(Rate::from_name(&rate.to_string()), Some(rate));
        }
        assert_eq!(Rate::from_name("3x1"), None);
    }
}
