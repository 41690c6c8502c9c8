//! The field at some points of one cell, a lane for each point: one impulse after the other adds its kernel
//! to all points that it reaches.
//!
//! The points share the impulses, and as much of an impulse's wave as their filters and directions allow.
//! Each lane has the bits of [`Site::field`].

use super::filter::{Filter, Filters};
use super::kernel::{Contribution, Seen, careful, contribution, seen};
use super::neighbourhood::{Impulse, Neighbourhood};
use super::params::{Params, Waves};
use super::site::{Site, Sites};
use super::{LANES, Lanes};
use crate::math::NEAR;
use crate::number::{Dual, Number};
use crate::unroll::array;

/// A value and its partials in both directions.
pub(super) type Values = [Lanes; 3];

/// Points with the same [key](super::site::Key). Either all of them have a filter, or none has one.
pub(super) struct Cluster {
    /// The first point.
    first: Site,
    len: usize,
    points: [usize; LANES],
    /// Offsets from the corner of the cell, in cells; NaN in unused lanes.
    way: [Lanes; 3],
    /// The box around the offsets.
    low: [f32; 3],
    high: [f32; 3],
    derivs: [[Lanes; 3]; 2],
    /// The vector that the caller gives for the waves.
    given: [Lanes; 3],
    filters: Option<Filters>,
    /// Whether the waves and filters of all points are the same.
    alike: bool,
}

impl Cluster {
    /// A cluster of at least one point with the same key, and at most [`LANES`]. Returns points that do not
    /// fit in `others`.
    pub(super) fn new(
        sites: &mut Sites<'_>,
        mut points: impl Iterator<Item = usize>,
        others: &mut Vec<usize>,
    ) -> Cluster {
        let start = points.next().unwrap_or(0);
        let first = sites.site(start);
        let mut cluster = Cluster {
            first,
            len: 0,
            points: [start; LANES],
            way: [[f32::NAN; LANES]; 3],
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
            derivs: [[[0.0; LANES]; 3]; 2],
            given: [[0.0; LANES]; 3],
            filters: first.filter.as_ref().map(Filters::new),
            alike: true,
        };
        cluster.push(start, &first);
        for point in points {
            if !cluster.push(point, &sites.site(point)) {
                others.push(point);
            }
        }
        cluster
    }

    /// Adds a point, unless the cluster is full or only one of both has a filter.
    fn push(&mut self, point: usize, site: &Site) -> bool {
        let lane = self.len;
        if lane >= LANES || site.filter.is_some() != self.first.filter.is_some() {
            return false;
        }
        let given = site.params.waves.given();
        for (axis, way) in site.way.into_iter().enumerate() {
            self.way[axis][lane] = way;
            // NaN leaves the box as it is.
            self.low[axis] = self.low[axis].min(way);
            self.high[axis] = self.high[axis].max(way);
            self.derivs[0][axis][lane] = site.derivs[0][axis];
            self.derivs[1][axis][lane] = site.derivs[1][axis];
            self.given[axis][lane] = given[axis];
        }
        self.alike &= given.map(f32::to_bits) == self.first.params.waves.given().map(f32::to_bits);
        if site.number != self.first.number {
            self.alike = false;
            if let (Some(filters), Some(filter)) = (&mut self.filters, &site.filter) {
                filters.set(lane, filter);
            }
        }
        self.points[lane] = point;
        self.len += 1;
        true
    }

    /// The numbers of the points.
    pub(super) fn points(&self) -> &[usize] {
        &self.points[..self.len.min(LANES)]
    }

    /// The first point, which has the same cells around it as the others.
    pub(super) fn first(&self) -> &Site {
        &self.first
    }

    /// The field of some impulses. `near` is working memory.
    #[inline(always)]
    pub(super) fn field<N: Number<Float = f32>>(
        &self,
        around: &Neighbourhood,
        near: &mut Vec<Impulse>,
    ) -> Values {
        around.near(self.low, self.high, near);
        let mut sums = match &self.filters {
            None => self.sum::<N>(None, near),
            Some(filters) => self.sum::<N>(Some(filters), near),
        };
        for x in sums.iter_mut().flatten() {
            *x = *x * self.first.params.scales[0] * self.first.params.scales[1];
        }
        sums
    }

    /// The sum of the kernels.
    #[inline(always)]
    fn sum<N: Number<Float = f32>>(&self, filters: Option<&Filters>, near: &[Impulse]) -> Values {
        let Params { waves, a, .. } = self.first.params;
        let mut totals = Totals::new();
        // If the caller gives the direction, no impulse changes it.
        let given = matches!(waves, Waves::Along(_));
        let filter = if filters.is_some() { self.first.filter.as_ref() } else { None };
        let mut views = Views::new();
        if given {
            self.view(filters, [0.0; 3], &mut views);
        }
        let mut common = Views::new();
        for impulses in near.chunks(LANES) {
            let mut seeds = [1; LANES];
            for (seed, impulse) in seeds.iter_mut().zip(impulses) {
                *seed = impulse.seed;
            }
            let drawn = waves.draw(&seeds);
            if self.alike && !given {
                for l in 0..LANES {
                    common.set(l, seen(filter, self.omega(0, drawn.direction(l))));
                }
            }
            for (i, impulse) in impulses.iter().enumerate() {
                let (r, inside) = self.offsets(impulse);
                if inside == [0; LANES] {
                    continue;
                }
                if !given && self.alike {
                    views = common.splat(i);
                } else if !given {
                    self.view(filters, drawn.direction(i), &mut views);
                }
                let phase = drawn.phase[i % LANES];
                let mut values = [[0.0; LANES]; 3];
                let mut odd = 0;
                for l in 0..LANES {
                    let filter = lane(filters, l);
                    let one: Contribution<N> =
                        contribution::<N, false>(filter.as_ref(), a, self.numbers(&r, l), views.at(l), phase);
                    let dual = one.value.dual();
                    (values[0][l], values[1][l], values[2][l]) = (dual.v, dual.dx, dual.dy);
                    let plain = (one.angle.abs() <= NEAR) & dual.v.is_finite();
                    odd |= if plain { 0 } else { inside[l] };
                }
                if odd != 0 {
                    self.with_care::<N>(&r, drawn.direction(i), phase, &mut values);
                }
                totals.add::<N>(impulse.cell, &values, &inside);
            }
        }
        totals.sum::<N>()
    }

    /// The offsets from an impulse, and the lanes that its kernel reaches.
    #[inline(always)]
    fn offsets(&self, impulse: &Impulse) -> ([Lanes; 3], [u32; LANES]) {
        let Params { radius, radius2, .. } = self.first.params;
        let Impulse { offset, position, .. } = *impulse;
        let (mut r, mut inside) = ([[0.0; LANES]; 3], [0; LANES]);
        for l in 0..LANES {
            let x = radius * ((self.way[0][l] - offset[0]) - position[0]);
            let y = radius * ((self.way[1][l] - offset[1]) - position[1]);
            let z = radius * ((self.way[2][l] - offset[2]) - position[2]);
            (r[0][l], r[1][l], r[2][l]) = (x, y, z);
            inside[l] = if x * x + y * y + z * z < radius2 { u32::MAX } else { 0 };
        }
        (r, inside)
    }

    /// The offset of a lane from an impulse, with its partials.
    #[inline(always)]
    fn numbers<N: Number<Float = f32>>(&self, r: &[Lanes; 3], l: usize) -> [N; 3] {
        array(
            #[inline(always)]
            |axis| {
                let [dx, dy] = &self.derivs;
                N::from_dual(Dual { v: r[axis][l], dx: dx[axis][l], dy: dy[axis][l] })
            },
        )
    }

    /// The frequency of an impulse with a direction, for a lane.
    #[inline(always)]
    fn omega(&self, l: usize, direction: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = &self.given;
        match self.first.params.waves {
            Waves::Along(_) => [x[l], y[l], z[l]],
            // The length is 1 in the first case.
            Waves::Isotropic | Waves::InPlane(_) => Waves::InPlane(x[l]).omega(direction),
        }
    }

    /// The wave with a direction, as each lane sees it.
    #[inline(always)]
    fn view(&self, filters: Option<&Filters>, direction: [f32; 3], views: &mut Views) {
        for l in 0..LANES {
            let filter = lane(filters, l);
            views.set(l, seen(filter.as_ref(), self.omega(l, direction)));
        }
    }

    /// Handles what the loop over lanes does not, see [`careful`].
    #[cold]
    #[inline(never)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step")]
    fn with_care<N: Number<Float = f32>>(
        &self,
        r: &[Lanes; 3],
        direction: [f32; 3],
        phase: f32,
        values: &mut Values,
    ) {
        for l in 0..LANES {
            let filter = lane(self.filters.as_ref(), l);
            let omega = self.omega(l, direction);
            let one = careful::<N>(filter.as_ref(), self.first.params.a, self.numbers(r, l), omega, phase);
            let Dual { v, dx, dy } = one.dual();
            (values[0][l], values[1][l], values[2][l]) = (v, dx, dy);
        }
    }
}

/// The filter of a lane.
#[inline(always)]
fn lane(filters: Option<&Filters>, l: usize) -> Option<Filter> {
    filters.map(
        #[inline(always)]
        |filters| filters.at(l),
    )
}

/// A wave as each of some lanes sees it.
#[derive(Clone, Copy)]
struct Views {
    omega: [Lanes; 3],
    damping: Lanes,
}

impl Views {
    fn new() -> Views {
        Views { omega: [[0.0; LANES]; 3], damping: [0.0; LANES] }
    }

    #[inline(always)]
    fn at(&self, l: usize) -> Seen {
        Seen { omega: [self.omega[0][l], self.omega[1][l], self.omega[2][l]], damping: self.damping[l] }
    }

    #[inline(always)]
    fn set(&mut self, l: usize, seen: Seen) {
        (self.omega[0][l], self.omega[1][l], self.omega[2][l]) =
            (seen.omega[0], seen.omega[1], seen.omega[2]);
        self.damping[l] = seen.damping;
    }

    /// All lanes as this one.
    #[inline(always)]
    fn splat(&self, l: usize) -> Views {
        let seen = self.at(l % LANES);
        Views { omega: seen.omega.map(|x| [x; LANES]), damping: [seen.damping; LANES] }
    }
}

/// Sums of kernels: the contributions of each cell are added up, then the cells.
struct Totals {
    /// The cell whose impulses are being added.
    cell: usize,
    total: Values,
    sum: Values,
}

impl Totals {
    fn new() -> Totals {
        Totals { cell: 0, total: [[0.0; LANES]; 3], sum: [[0.0; LANES]; 3] }
    }

    /// Adds the values of an impulse in some lanes.
    #[inline(always)]
    fn add<N: Number>(&mut self, cell: usize, values: &Values, inside: &[u32; LANES]) {
        if cell != self.cell {
            self.close::<N>();
            self.cell = cell;
        }
        for (total, values) in self.total.iter_mut().zip(values).take(N::PARTS) {
            for l in 0..LANES {
                total[l] = if inside[l] != 0 { total[l] + values[l] } else { total[l] };
            }
        }
    }

    /// Adds the total of the cell. Cells without impulses nearby are left out: sums start from 0 and are
    /// never −0, so that adding 0 would change nothing.
    #[inline(always)]
    fn close<N: Number>(&mut self) {
        for (sum, total) in self.sum.iter_mut().zip(&mut self.total).take(N::PARTS) {
            for l in 0..LANES {
                sum[l] += total[l];
                total[l] = 0.0;
            }
        }
    }

    #[inline(always)]
    fn sum<N: Number>(mut self) -> Values {
        self.close::<N>();
        self.sum
    }
}
