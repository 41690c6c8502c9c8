//! The order of the points of an image: in blocks, so that neighbours on the image are neighbours in a batch.
//!
//! Rows of blocks of 32 × 32 follow each other; a row is ordered by blocks, a block by its rows. So a batch
//! covers a few blocks, or some rows of one, and mostly sees few cells of a pattern. Blocks at the right and
//! lower border are narrower or lower. `area` divides them into tiles.

mod area;

pub(crate) use area::{Area, PlaneArea, areas, cut};

/// Side of a block in points.
const SIDE: usize = 32;

/// The blocks of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Blocks {
    width: usize,
    height: usize,
}

/// A block, or a part of one: its position, and which of its points follow.
struct Piece {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    /// The first of the remaining points.
    first: usize,
    /// Number of remaining points in it.
    left: usize,
}

impl Blocks {
    /// The blocks of an image with this size.
    pub fn new(width: usize, height: usize) -> Blocks {
        Blocks { width, height }
    }

    /// Number of points in a row of blocks: after each multiple of it, the image is complete so far.
    pub fn period(&self) -> usize {
        SIDE * self.width.max(1)
    }

    fn piece(&self, point: usize) -> Piece {
        let row = point / self.period();
        let y = row * SIDE;
        let height = SIDE.min(self.height.saturating_sub(y)).max(1);
        let rest = point - row * self.period();
        let column = rest / (SIDE * height);
        let x = column * SIDE;
        let width = SIDE.min(self.width.saturating_sub(x)).max(1);
        let first = rest - column * SIDE * height;
        Piece { x, y, width, height, first, left: (width * height).saturating_sub(first).max(1) }
    }

    /// Column and row of a point.
    pub fn pixel(&self, point: usize) -> (usize, usize) {
        let piece = self.piece(point);
        let (x, y) = piece.inside(piece.first);
        (piece.x + x, piece.y + y)
    }

    /// The index of a point in row-by-row order.
    pub fn position(&self, point: usize) -> usize {
        let (x, y) = self.pixel(point);
        y * self.width + x
    }

    /// Calls `visit` for `count` points from `first` on, in order, with column and row of each.
    pub fn each(&self, first: usize, count: usize, mut visit: impl FnMut(usize, (usize, usize))) {
        let mut done = 0;
        while done < count {
            let piece = self.piece(first + done);
            let here = piece.left.min(count - done);
            for index in 0..here {
                let (x, y) = piece.inside(piece.first + index);
                visit(done + index, (piece.x + x, piece.y + y));
            }
            done += here;
        }
    }

    /// Writes a value of the column (axis 0) or row (axis 1) of each point from `first` on.
    pub fn along(&self, axis: usize, first: usize, lanes: &mut [f32], value: impl Fn(usize) -> f32) {
        let mut done = 0;
        while done < lanes.len() {
            let piece = self.piece(first + done);
            let here = piece.left.min(lanes.len() - done);
            let to = &mut lanes[done..done + here];
            let (corner, side) = if axis == 0 { (piece.x, piece.width) } else { (piece.y, piece.height) };
            let mut values = [0.0; SIDE];
            values.iter_mut().enumerate().take(side).for_each(|(i, v)| *v = value(corner + i));
            // Row by row: the rest of the first row, then whole ones.
            let (mut x, mut y) = piece.inside(piece.first);
            let mut rest = to;
            while !rest.is_empty() {
                let (row, next) = rest.split_at_mut((piece.width - x).min(rest.len()));
                match axis {
                    0 => row.copy_from_slice(&values[x..x + row.len()]),
                    _ => row.fill(values[y]),
                }
                (x, y, rest) = (0, y + 1, next);
            }
            done += here;
        }
    }
}

impl Piece {
    /// Column and row of a point within the block.
    fn inside(&self, index: usize) -> (usize, usize) {
        (index % self.width, index / self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_once_and_rows_of_blocks_complete() {
        for (width, height) in [(1, 1), (5, 3), (16, 16), (17, 33), (40, 20), (64, 48)] {
            let blocks = Blocks::new(width, height);
            let mut seen = vec![0; width * height];
            let mut by_each = Vec::new();
            blocks.each(0, width * height, |_, pixel| by_each.push(pixel));
            for (point, pixel) in by_each.iter().enumerate() {
                assert_eq!(blocks.pixel(point), *pixel);
                seen[blocks.position(point)] += 1;
                assert_eq!(point / blocks.period(), pixel.1 / SIDE, "{width}x{height} {point}");
            }
            assert!(seen.iter().all(|n| *n == 1), "{width}x{height}");
        }
    }

    #[test]
    fn columns_and_rows_are_those_of_the_pixels() {
        let blocks = Blocks::new(37, 50);
        for (first, count) in [(0, 256), (256, 256), (100, 300), (37 * 32 - 80, 300), (37 * 50 - 10, 10)] {
            let (mut x, mut y) = (vec![0.0; count], vec![0.0; count]);
            blocks.along(0, first, &mut x, |i| i as f32);
            blocks.along(1, first, &mut y, |i| i as f32);
            for lane in 0..count {
                assert_eq!((x[lane] as usize, y[lane] as usize), blocks.pixel(first + lane));
            }
        }
    }

    #[test]
    fn neighbours_stay_together() {
        let blocks = Blocks::new(96, 64);
        let mut corners = (usize::MAX, 0, usize::MAX, 0);
        blocks.each(1024, 1024, |_, (x, y)| {
            corners = (corners.0.min(x), corners.1.max(x), corners.2.min(y), corners.3.max(y));
        });
        assert_eq!(corners, (32, 63, 0, 31));
    }
}
