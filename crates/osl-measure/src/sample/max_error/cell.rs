//! A cell of a lattice: its corners, and the values that are interpolated between them.
//!
//! This module must not know which cells are interpolated, nor whether that is good enough.

use crate::sample::rate::mix;

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
                values[at] = between(values, width, cell, [x as f32, y as f32]);
            }
        }
    }
}

/// The value at a position in a cell, or slightly outside, from its corners.
pub(super) fn between(
    values: &[f32],
    width: usize,
    [left, right, top, bottom]: [usize; 4],
    [x, y]: [f32; 2],
) -> f32 {
    let share = |at: f32, from: usize, to: usize| (at - from as f32) / (to - from).max(1) as f32;
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
