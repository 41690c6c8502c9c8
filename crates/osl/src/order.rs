//! The order in which points are shaded, and where their values are in the lists of a client.

use std::ops::Range;

/// Columns of a block. Rows of 32, as the command shades its grid, would take longer: the memory of the lists
/// is read in pieces of a row.
const COLUMNS: usize = 64;
/// Rows of a block.
const ROWS: usize = 32;

/// The order of the pixels of an image: by blocks, so that neighbours on the image are neighbours in a batch.
/// Rows of blocks follow each other; a row is ordered by blocks, a block by its rows. Blocks at the right and
/// lower border are narrower or lower.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Order {
    width: usize,
    count: usize,
}

impl Order {
    /// The order of so many pixels in rows of this width, which is not 0.
    pub(crate) fn new(width: usize, count: usize) -> Order {
        Order { width: width.max(1), count }
    }

    /// The position of a point in the lists; points after the last one have those after the end.
    pub(crate) fn position(self, point: usize) -> usize {
        let rows = self.rows(point);
        rows.start + rows.inside
    }

    /// The pieces of some points that follow each other: the position of their first one, and where they are
    /// among the points.
    pub(crate) fn runs(self, first: usize, count: usize) -> impl Iterator<Item = (usize, Range<usize>)> {
        let (mut done, mut rows) = (0, Rows { start: 0, inside: 0, width: 0, left: 0 });
        std::iter::from_fn(move || {
            if rows.left == 0 {
                rows = self.rows(first + done);
            }
            let (position, length) = (rows.start + rows.inside, (rows.width - rows.inside).min(count - done));
            (rows.start, rows.inside, rows.left) = (rows.start + self.width, 0, rows.left - 1);
            done += length;
            (length > 0).then_some((position, done - length..done))
        })
    }

    /// The rows of a block, from one of its points on; all points after the last one are in one row.
    fn rows(self, point: usize) -> Rows {
        if point >= self.count {
            return Rows { start: point, inside: 0, width: usize::MAX, left: 1 };
        }
        let y = point / (self.width * ROWS) * ROWS;
        let height = ROWS.min(self.count / self.width - y);
        let rest = point - y * self.width;
        let x = rest / (COLUMNS * height) * COLUMNS;
        let (width, rest) = (COLUMNS.min(self.width - x), rest - x * height);
        let row = rest / width;
        Rows { start: (y + row) * self.width + x, inside: rest % width, width, left: height - row }
    }
}

/// Rows of a block: the position where the first one starts, how many of its points come before, and the
/// width and number of the rows.
struct Rows {
    start: usize,
    inside: usize,
    width: usize,
    left: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_comes_once() {
        for (width, height) in [(1, 1), (5, 3), (128, 16), (129, 17), (300, 40), (1, 70), (4000, 2)] {
            let order = Order::new(width, width * height);
            let mut positions: Vec<usize> = (0..width * height).map(|point| order.position(point)).collect();
            for first in [0, 1, width * height / 3] {
                let runs = order.runs(first, width * height - first);
                let found: Vec<usize> = runs.flat_map(|(at, to)| at..at + to.len()).collect();
                assert_eq!(found, positions[first..], "{width} by {height}");
            }
            positions.sort_unstable();
            assert!(positions.into_iter().eq(0..width * height), "{width} by {height}");
        }
    }
}
