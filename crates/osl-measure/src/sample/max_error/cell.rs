//! A cell of a lattice: its corners, and the values that are interpolated between them.

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
