//! Shading points at any position of an image, not only at pixel centres.

use osl_exec::{Datum, PointSource};
use osl_ir::global::Global;
use osl_ir::ir::Axis;
use osl_scene::answers::{At, components};
use osl_scene::{Crop, Grid, WithData};
use std::ops::Range;

/// A position in an image: a pixel and an offset from its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelPosition {
    /// Column and row.
    pub pixel: [u32; 2],
    /// **Units:** pixels. An offset beyond ±0.5 lies in a neighbour.
    pub offset: [f32; 2],
}

impl PixelPosition {
    /// The centre of a pixel.
    pub fn centre(pixel: [u32; 2]) -> PixelPosition {
        PixelPosition { pixel, offset: [0.0; 2] }
    }
}

/// The row of the last pixel. Pixels follow each other row by row, so that a division is rarely needed.
#[derive(Default)]
pub(super) struct Row {
    number: u32,
    first: u32,
}

impl Row {
    /// The column and the row of a pixel.
    #[inline(always)]
    pub(super) fn of(&mut self, pixel: u32, width: u32) -> [u32; 2] {
        if pixel.wrapping_sub(self.first) >= width {
            self.number = pixel / width;
            self.first = self.number * width;
        }
        [pixel - self.first, self.number]
    }
}

/// Positions in an image that are computed when they are needed.
pub trait Positions {
    /// How many there are.
    fn count(&self) -> usize;

    /// At most `count` of them from one on.
    fn some(&self, first: usize, count: usize) -> Vec<PixelPosition>;

    /// Writes the coordinates of the positions from one on, one in each lane. Returns false if one of them
    /// lies at the centre of a pixel along this axis: there, the grid's own points have bits of their own.
    fn along(&self, line: &Line, first: usize, lanes: &mut [f32]) -> bool;
}

/// How u or v of a grid follows from a position between pixel centres along its axis. It has no cases,
/// because it is computed for every sample of an image.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    axis: usize,
    /// The column or row of the grid at which the image begins.
    first: i32,
    /// The position of the first point of the grid, and how many points make up the unit.
    shift: f64,
    unit: f64,
    scale: f64,
    added: f64,
}

impl Line {
    fn of(grid: &Grid, axis: usize, first: usize) -> Line {
        let (shift, unit) = match (grid.center, [grid.width, grid.height][axis]) {
            (true, n) => (0.5, n.max(1)),
            (false, 1) => (0.5, 1),
            (false, n) => (0.0, n.max(2) - 1),
        };
        let [scale, added] = [grid.scale[axis], grid.offset[axis]].map(f64::from);
        Line { axis, first: first as i32, shift, unit: unit as f64, scale, added }
    }

    /// 0 for u, 1 for v.
    pub fn axis(&self) -> usize {
        self.axis
    }

    /// The coordinate at an offset from the centre of a pixel. **Units:** pixels.
    #[inline(always)]
    pub fn at(&self, pixel: i32, offset: f32) -> f32 {
        let here = f64::from(pixel.wrapping_add(self.first)) + f64::from(offset) + self.shift;
        (self.scale * (here / self.unit) + self.added) as f32
    }
}

/// A source whose points are the pixel centres of an image and which also has points between them. Its
/// derivatives are those of the pixel, wherever in the pixel a point lies.
pub trait Surface: PointSource {
    /// Pixels per row, and number of rows.
    fn size(&self) -> (usize, usize);

    /// Writes a varying global for some positions in the layout of [`PointSource::fill`]. Lanes after the
    /// last position get the last one's value. At offset 0 the value has the bits of the pixel's own point.
    fn fill_at(&self, global: Global, places: &[PixelPosition], width: usize, lanes: &mut [f32]);

    /// Writes a varying global for the centres of some pixels, which are numbered row by row.
    fn fill_centres(&self, global: Global, pixels: &[u32], width: usize, lanes: &mut [f32]) {
        let (mut row, columns) = (Row::default(), self.size().0.max(1) as u32);
        let places: Vec<PixelPosition> =
            pixels.iter().map(|pixel| PixelPosition::centre(row.of(*pixel, columns))).collect();
        self.fill_at(global, &places, width, lanes);
    }

    /// Writes a varying global for a range of positions in the layout of [`PointSource::fill`]. The range is
    /// as wide as a batch, and may end behind the last position.
    fn fill_between(&self, global: Global, places: &dyn Positions, range: Range<usize>, lanes: &mut [f32]) {
        self.fill_at(global, &places.some(range.start, range.len()), range.len(), lanes);
    }

    /// Writes a derivative of a varying global for some positions in the layout of [`PointSource::fill`].
    fn fill_deriv_at(
        &self,
        global: Global,
        axis: Axis,
        places: &[PixelPosition],
        width: usize,
        lanes: &mut [f32],
    ) {
        let _ = places;
        let deriv = self.deriv(global, axis);
        lanes.chunks_mut(width.max(1)).zip(deriv).for_each(|(lanes, x)| lanes.fill(x));
    }

    /// A named datum at a position; the same at all positions if [`PointSource::attribute_is_shared`].
    fn attribute_at(
        &self,
        object: &str,
        name: &str,
        element: Option<usize>,
        place: PixelPosition,
    ) -> Option<Datum> {
        let _ = (object, name, element, place);
        None
    }
}

/// u or v at a position. At exact pixels it has the bits of the grid's own points.
fn coordinate(grid: &Grid, axis: usize, place: &PixelPosition) -> f32 {
    let mut own = [0.0];
    coordinates(grid, axis, std::slice::from_ref(place), &mut own);
    own[0]
}

/// u or v at some positions.
fn coordinates(grid: &Grid, axis: usize, places: &[PixelPosition], lanes: &mut [f32]) {
    let line = Line::of(grid, axis, 0);
    let all = lanes.iter_mut().zip(places);
    all.for_each(|(x, place)| *x = line.at(place.pixel[axis] as i32, place.offset[axis]));
    let centres = lanes.iter_mut().zip(places).filter(|(_, place)| place.offset[axis] == 0.0);
    let n = [grid.width, grid.height][axis];
    centres.for_each(|(x, place)| *x = grid.coordinate(axis, place.pixel[axis] as usize, n));
}

/// Writes a global of a grid for so many places in the layout of [`PointSource::fill`]. `along` writes the
/// coordinate along an axis for each.
fn fill(
    global: Global,
    (places, width): (usize, usize),
    lanes: &mut [f32],
    mut along: impl FnMut(usize, &mut [f32]),
) {
    for (component, lanes) in lanes.chunks_mut(width.max(1)).enumerate() {
        let axis = match (global, component) {
            (Global::U, _) | (Global::P, 0) => 0,
            (Global::V, _) | (Global::P, 1) => 1,
            (Global::P, _) => {
                lanes.fill(1.0);
                continue;
            }
            _ => {
                lanes.fill(0.0);
                continue;
            }
        };
        let (here, behind) = lanes.split_at_mut(places.min(lanes.len()));
        along(axis, here);
        behind.fill(here.last().copied().unwrap_or(0.0));
    }
}

/// Writes a global of a grid for the centres of some pixels of a part of it, which begins at a pixel and is
/// so many columns wide.
fn fill_centres(
    (grid, first, columns): (&Grid, [usize; 2], usize),
    global: Global,
    pixels: &[u32],
    (width, lanes): (usize, &mut [f32]),
) {
    let columns = columns.max(1) as u32;
    fill(global, (pixels.len(), width), lanes, |axis, lanes| {
        let (mut row, n) = (Row::default(), [grid.width, grid.height][axis]);
        for (x, pixel) in lanes.iter_mut().zip(pixels) {
            *x = grid.coordinate(axis, row.of(*pixel, columns)[axis] as usize + first[axis], n);
        }
    });
}

/// Writes a global of a grid for a range of positions in a part of it, which begins at a pixel. Returns false
/// if one of them lies at the centre of a pixel.
fn fill_between(
    (grid, first): (&Grid, [usize; 2]),
    global: Global,
    places: &dyn Positions,
    (range, lanes): (Range<usize>, &mut [f32]),
) -> bool {
    let count = places.count().saturating_sub(range.start).min(range.len());
    let mut are_between = true;
    fill(global, (count, range.len()), lanes, |axis, lanes| {
        are_between &= places.along(&Line::of(grid, axis, first[axis]), range.start, lanes);
    });
    are_between
}

impl Surface for Grid {
    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    fn fill_at(&self, global: Global, places: &[PixelPosition], width: usize, lanes: &mut [f32]) {
        fill(global, (places.len(), width), lanes, |axis, lanes| coordinates(self, axis, places, lanes));
    }

    fn fill_centres(&self, global: Global, pixels: &[u32], width: usize, lanes: &mut [f32]) {
        fill_centres((self, [0; 2], self.width), global, pixels, (width, lanes));
    }

    fn fill_between(&self, global: Global, places: &dyn Positions, range: Range<usize>, lanes: &mut [f32]) {
        if !fill_between((self, [0; 2]), global, places, (range.clone(), lanes)) {
            self.fill_at(global, &places.some(range.start, range.len()), range.len(), lanes);
        }
    }

    fn attribute_at(
        &self,
        object: &str,
        name: &str,
        element: Option<usize>,
        place: PixelPosition,
    ) -> Option<Datum> {
        let axis = Grid::texture_axis(object, name, element)?;
        Some(self.texture_coordinate(axis, coordinate(self, axis, &place)))
    }
}

impl Surface for Crop {
    fn size(&self) -> (usize, usize) {
        Crop::size(self)
    }

    fn fill_at(&self, global: Global, places: &[PixelPosition], width: usize, lanes: &mut [f32]) {
        let places: Vec<PixelPosition> = places.iter().map(|place| whole(self, *place)).collect();
        self.grid.fill_at(global, &places, width, lanes);
    }

    fn fill_centres(&self, global: Global, pixels: &[u32], width: usize, lanes: &mut [f32]) {
        fill_centres((&self.grid, self.whole([0; 2]), Crop::size(self).0), global, pixels, (width, lanes));
    }

    fn fill_between(&self, global: Global, places: &dyn Positions, range: Range<usize>, lanes: &mut [f32]) {
        if !fill_between((&self.grid, self.whole([0; 2])), global, places, (range.clone(), lanes)) {
            self.fill_at(global, &places.some(range.start, range.len()), range.len(), lanes);
        }
    }

    fn attribute_at(
        &self,
        object: &str,
        name: &str,
        element: Option<usize>,
        place: PixelPosition,
    ) -> Option<Datum> {
        self.grid.attribute_at(object, name, element, whole(self, place))
    }
}

/// The place in the whole grid of a place in a crop. The centre of a neighbour has the bits of this
/// neighbour.
fn whole(crop: &Crop, place: PixelPosition) -> PixelPosition {
    let mut place =
        PixelPosition { pixel: crop.whole(place.pixel.map(|at| at as usize)).map(|at| at as u32), ..place };
    let size = [crop.grid.width, crop.grid.height];
    for ((pixel, offset), size) in place.pixel.iter_mut().zip(&mut place.offset).zip(size) {
        let moved = f64::from(*pixel) + f64::from(*offset);
        if *offset != 0.0 && offset.fract() == 0.0 && (0.0..size as f64).contains(&moved) {
            (*pixel, *offset) = (moved as u32, 0.0);
        }
    }
    place
}

impl<S: Surface> Surface for WithData<S> {
    fn size(&self) -> (usize, usize) {
        self.points.size()
    }

    fn fill_at(&self, global: Global, places: &[PixelPosition], width: usize, lanes: &mut [f32]) {
        self.points.fill_at(global, places, width, lanes);
    }

    fn fill_centres(&self, global: Global, pixels: &[u32], width: usize, lanes: &mut [f32]) {
        self.points.fill_centres(global, pixels, width, lanes);
    }

    fn fill_between(&self, global: Global, places: &dyn Positions, range: Range<usize>, lanes: &mut [f32]) {
        self.points.fill_between(global, places, range, lanes);
    }

    fn fill_deriv_at(
        &self,
        global: Global,
        axis: Axis,
        places: &[PixelPosition],
        width: usize,
        lanes: &mut [f32],
    ) {
        self.points.fill_deriv_at(global, axis, places, width, lanes);
    }

    fn attribute_at(
        &self,
        object: &str,
        name: &str,
        element: Option<usize>,
        place: PixelPosition,
    ) -> Option<Datum> {
        let own = self.data.find(object, name, element);
        let known = own.or_else(|| self.points.attribute_at(object, name, element, place));
        let global = |global: Global| {
            let mut lanes = [0.0; 3];
            match self.points.varying().contains(&global) {
                true => self.points.fill_at(global, &[place], 1, &mut lanes[..components(global)]),
                false => lanes = self.uniform(global),
            }
            lanes
        };
        let change = |global: Global, axis: Axis| {
            let mut lanes = [0.0; 3];
            self.points.fill_deriv_at(global, axis, &[place], 1, &mut lanes[..components(global)]);
            lanes
        };
        let [x, y] = place.pixel.map(|at| at as usize);
        let at = At { global: &global, change: &change, index: y * self.points.size().0 + x };
        self.data.answered(known, (object, name, element), &at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{Filter, Pattern};

    #[test]
    fn centres_have_the_bits_of_the_grid_and_neighbours_meet() {
        for center in [false, true] {
            let grid = Grid { center, scale: [3.7, 0.3], ..Grid::new(37, 1) };
            for i in 0..37 {
                let place = |offset| PixelPosition { pixel: [i, 0], offset: [offset, 0.0] };
                assert_eq!(coordinate(&grid, 0, &place(0.0)), grid.coordinate(0, i as usize, 37));
                let next = PixelPosition { pixel: [i + 1, 0], offset: [-0.5, 0.0] };
                assert_eq!(coordinate(&grid, 0, &place(0.5)), coordinate(&grid, 0, &next));
            }
        }
    }

    #[test]
    fn a_crop_has_the_bits_of_the_whole_grid() {
        for center in [false, true] {
            let grid = Grid { center, scale: [3.7, 0.3], offset: [0.1, -7.0], ..Grid::new(37, 23) };
            let crop = Crop::new(grid.clone(), 5..31, 4..20);
            let (columns, rows) = Surface::size(&crop);
            let own: Vec<u32> = (0..(columns * rows) as u32).step_by(7).collect();
            let whole = |pixel: &u32| {
                let [x, y] = crop.whole([*pixel as usize % columns, *pixel as usize / columns]);
                (y * grid.width + x) as u32
            };
            let all: Vec<u32> = own.iter().map(whole).collect();
            let (pattern, filter) = (Pattern::new(4, 1), Filter::default());
            for (own, all) in own.iter().zip(&all) {
                let at =
                    |pixel: u32, width: usize| Fixed { pixel, width, pattern: &pattern, filter: &filter };
                let (a, b) = (at(*own, columns), at(*all, grid.width));
                for global in [Global::P, Global::U, Global::V] {
                    let (mut x, mut y) = (vec![0.0; 12], vec![0.0; 12]);
                    crop.fill_between(global, &a, 0..4, &mut x);
                    grid.fill_between(global, &b, 0..4, &mut y);
                    assert_eq!(x, y, "{global:?}");
                    let (mut x, mut y) = (vec![0.0; 3], vec![0.0; 3]);
                    crop.fill_centres(global, &[*own], 1, &mut x);
                    grid.fill_centres(global, &[*all], 1, &mut y);
                    assert_eq!(x, y, "{global:?}");
                }
            }
        }
    }

    /// The samples of a pixel, which are those of pixel 0 of the pattern.
    struct Fixed<'a> {
        pixel: u32,
        width: usize,
        pattern: &'a Pattern,
        filter: &'a Filter,
    }

    impl Positions for Fixed<'_> {
        fn count(&self) -> usize {
            4
        }

        fn some(&self, first: usize, count: usize) -> Vec<PixelPosition> {
            let pixel = [self.pixel % self.width as u32, self.pixel / self.width as u32];
            let of =
                |sample: &[f32; 2]| PixelPosition { pixel, offset: sample.map(|s| self.filter.place(s).0) };
            self.pattern.of(0).iter().skip(first).take(count).map(of).collect()
        }

        fn along(&self, line: &Line, first: usize, lanes: &mut [f32]) -> bool {
            let places = self.some(first, lanes.len());
            let axis = line.axis();
            lanes.iter_mut().zip(&places).for_each(|(x, place)| {
                *x = line.at(place.pixel[axis] as i32, place.offset[axis]);
            });
            true
        }
    }
}
