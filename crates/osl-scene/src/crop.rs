//! A rectangle of a grid: some of its points, with the values that they have in the whole grid.

use crate::Grid;
use crate::grid::GridArea;
use osl_exec::{Blocks, Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use std::ops::Range;

/// The points of a grid in some columns and rows. Their globals, derivatives and texture coordinates are
/// those of the whole grid, and so are the pixels that messages name.
#[derive(Clone, Debug, PartialEq)]
pub struct Crop {
    /// The whole grid.
    pub grid: Grid,
    part: GridArea,
}

impl Crop {
    /// All points of a grid.
    pub fn none(grid: Grid) -> Crop {
        let size = [grid.width, grid.height];
        Crop { grid, part: GridArea { first: [0; 2], size } }
    }

    /// The points in these columns and rows; columns and rows that the grid lacks are left out.
    pub fn new(grid: Grid, columns: Range<usize>, rows: Range<usize>) -> Crop {
        let within = |range: Range<usize>, n: usize| {
            let first = range.start.min(n);
            (first, range.end.clamp(first, n) - first)
        };
        let (x, width) = within(columns, grid.width);
        let (y, height) = within(rows, grid.height);
        Crop { grid, part: GridArea { first: [x, y], size: [width, height] } }
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.part.size[0], self.part.size[1])
    }

    /// The column and row in the whole grid of a column and row of the crop.
    pub fn whole(&self, [x, y]: [usize; 2]) -> [usize; 2] {
        [self.part.first[0] + x, self.part.first[1] + y]
    }

    fn order(&self) -> Blocks {
        Blocks::new(self.part.size[0], self.part.size[1])
    }
}

impl PointSource for Crop {
    fn count(&self) -> usize {
        self.part.size[0] * self.part.size[1]
    }

    fn blocks(&self) -> Option<Blocks> {
        Some(self.order())
    }

    fn pixel(&self, position: usize) -> usize {
        let width = self.part.size[0].max(1);
        let [x, y] = self.whole([position % width, position / width]);
        y * self.grid.width + x
    }

    fn varying(&self) -> &[Global] {
        self.grid.varying()
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        self.grid.uniform(global)
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        self.grid.deriv(global, axis)
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.grid.attribute_in(self.part, (object, name, element), point)
    }

    fn attribute_global(&self, object: &str, name: &str, element: Option<usize>) -> Option<Global> {
        self.grid.attribute_global(object, name, element)
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        self.grid.attribute_is_shared(object, name, element)
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        self.grid.fill_part(self.part, global, (first, width), lanes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_those_of_the_whole_grid() {
        for center in [false, true] {
            let grid = Grid { center, scale: [3.7, 0.3], offset: [0.1, -2.0], ..Grid::new(50, 37) };
            let crop = Crop::new(grid.clone(), 11..44, 20..37);
            assert_eq!((crop.size(), crop.count()), ((33, 17), 33 * 17));
            let values = |source: &dyn PointSource, count: usize| {
                let mut lanes = vec![0.0; count * 3];
                source.fill(Global::P, 0, count, &mut lanes);
                lanes
            };
            let (all, own) = (values(&grid, grid.count()), values(&crop, crop.count()));
            let place = |order: Blocks, count: usize| -> Vec<(usize, usize)> {
                (0..count).map(|point| order.pixel(point)).collect()
            };
            let whole = place(grid.order(), grid.count());
            for (point, (x, y)) in place(crop.order(), crop.count()).into_iter().enumerate() {
                let same = whole.iter().position(|pixel| *pixel == (x + 11, y + 20)).unwrap_or(usize::MAX);
                for c in 0..3 {
                    let (a, b) = (own[c * crop.count() + point], all[c * grid.count() + same]);
                    assert_eq!(a.to_bits(), b.to_bits(), "component {c} at ({x}, {y})");
                }
                assert_eq!(crop.attribute("", "t", None, point), grid.attribute("", "t", None, same));
            }
            assert_eq!(crop.pixel(34), 21 * 50 + 12);
        }
        let none = Crop::none(Grid::new(5, 3));
        assert_eq!((none.size(), none.pixel(7)), ((5, 3), 7));
    }
}
