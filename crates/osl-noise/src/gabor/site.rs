//! The points of a call, one at a time: where a point is among the cells, with which numbers its field is
//! evaluated, and which other points share its impulses.

use super::Points;
use super::cells::CellBlock;
use super::filter::Filter;
use super::params::{Options, Params};
use crate::hash::floor;

/// Where and with which parameters a field is evaluated.
#[derive(Clone, Copy)]
pub(super) struct Site {
    pub(super) params: Params,
    /// Corner of the cell.
    pub(super) corner: [f32; 3],
    /// Offset from the corner to the point, in cells.
    pub(super) way: [f32; 3],
    /// Partials of the point in both directions, in the unit of the kernels.
    pub(super) derivs: [[f32; 3]; 2],
    pub(super) periods: Option<[f32; 3]>,
    pub(super) filter: Option<Filter>,
    /// Points with the same number have the same filter.
    pub(super) number: usize,
}

impl Site {
    /// The cells around the point, in the field with a seed.
    pub(super) fn place(&self, seed: u32) -> CellBlock {
        CellBlock { corner: self.corner, periods: self.periods, seed, empty: self.params.empty }
    }
}

/// What points have in common whose neighbourhoods have the same impulses.
pub(super) type Key = [u32; 9];

/// The points of a call. The numbers that depend only on options or partials are kept from point to point.
pub(super) struct Sites<'a> {
    points: Points<'a>,
    options: &'a [Options],
    last: (Options, Params),
    filter: Option<Filter>,
    filter_of: [u32; 7],
    /// How many filters there were before.
    filters: usize,
}

/// Element `i` of the first three slices, 0 where a slice is missing.
#[inline(always)]
fn triple(slices: &[&[f32]], i: usize) -> [f32; 3] {
    let mut out = [0.0; 3];
    for (to, from) in out.iter_mut().zip(slices) {
        *to = from.get(i).copied().unwrap_or(0.0);
    }
    out
}

impl<'a> Sites<'a> {
    /// The points with their options, one for all or one for each.
    pub(super) fn new(points: Points<'a>, options: &'a [Options]) -> Option<Sites<'a>> {
        let first = *options.first()?;
        let last = (first, Params::new(&first));
        Some(Sites { points, options, last, filter: None, filter_of: [0; 7], filters: 0 })
    }

    fn turn(&mut self, i: usize) {
        if self.options.len() == 1 {
            return;
        }
        let Some(options) = self.options.get(i) else { return };
        let words = |options: &Options| [options.bandwidth.to_bits(), options.impulses.to_bits()];
        let (last, params) = &mut self.last;
        if words(options) == words(last) {
            *params = params.with(options);
        } else {
            *params = Params::new(options);
        }
        *last = *options;
    }

    /// A point's cell and the offset in it.
    fn cell(&self, i: usize) -> [[f32; 3]; 2] {
        let p = triple(self.points.coords, i).map(|x| x * self.last.1.rinv);
        let corner = p.map(floor);
        [corner, [p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]]]
    }

    /// What a point shares.
    pub(super) fn key(&mut self, i: usize) -> Key {
        self.turn(i);
        let (options, params) = &self.last;
        let [corner, _] = self.cell(i);
        let [a, b, c] = corner.map(f32::to_bits);
        let [d, e, f] = triple(self.points.periods, i).map(f32::to_bits);
        [a, b, c, d, e, f, options.bandwidth.to_bits(), options.impulses.to_bits(), params.waves.kind()]
    }

    /// A point.
    pub(super) fn site(&mut self, i: usize) -> Site {
        self.turn(i);
        let (options, params) = self.last;
        let Points { partials, periods, .. } = self.points;
        let (first, second) = partials.split_at(partials.len() / 2);
        let partials = [triple(first, i), triple(second, i)];
        let [corner, way] = self.cell(i);
        let filter = if options.do_filter { self.filter(partials, params.a) } else { None };
        Site {
            params,
            corner,
            way,
            derivs: partials.map(|d| d.map(|x| x * params.rinv * params.radius)),
            periods: if periods.is_empty() { None } else { Some(triple(periods, i)) },
            filter,
            number: self.filters,
        }
    }

    /// The filter for some partials.
    fn filter(&mut self, partials: [[f32; 3]; 2], a: f32) -> Option<Filter> {
        let [[b, c, d], [e, f, g]] = partials;
        // A filter of partials that are 0 is `None`, as at the beginning.
        let of = [a, b, c, d, e, f, g].map(f32::to_bits);
        let differences = of.iter().zip(self.filter_of).fold(0, |sum, (a, b)| sum | (a ^ b));
        if differences != 0 {
            self.filter = Filter::new(partials, a);
            self.filter_of = of;
            self.filters += 1;
        }
        self.filter
    }
}
