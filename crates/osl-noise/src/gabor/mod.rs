//! Gabor noise: kernels, each a Gaussian times a cosine wave, scattered at random.
//!
//! # What a value depends on
//!
//! A value depends on the first three coordinates, their periods, the [`Options`], and, unlike any other
//! field, on **the partials of the coordinates**: with `do_filter` set, kernels are damped to what the
//! spacing of the points resolves. The filter needs partials in both directions that span an area; it is off
//! in one dimension and where partials are missing or parallel. A fourth coordinate and its period are
//! ignored; missing coordinates are 0. A period counts *cells*: in coordinates, the field repeats after the
//! floored period (at least 1) times the kernels' radius, which the bandwidth determines ([`radius`]).
//!
//! # Extremes
//!
//! Infinite or NaN coordinates give 0. Coordinates beyond the 32-bit cell numbers share the outermost cell.
//! NaN in bandwidth or impulses gives NaN or 0, the same on every machine. No input causes a long loop.
//!
//! # Sources
//!
//! A. Lagae, S. Lefebvre, G. Drettakis, P. Dutré, *Procedural Noise using Sparse Gabor Convolution*, 2009,
//! and A. Lagae, S. Lefebvre, P. Dutré, *Improving Gabor Noise*, 2011, with constants and orders of
//! evaluation that OSL renderers agree on. Renderers take exponentials, sines and cosines from a mathematical
//! library; here they are this crate's own, correctly rounded except for rare ties, so that results have the
//! same bits on every machine.

mod cells;
mod cluster;
mod field;
mod filter;
mod kernel;
mod neighbourhood;
mod params;
mod sharing;
mod site;
mod waves;

use crate::number::{Dual, Number};
use cells::Cells;
use cluster::Cluster;
use neighbourhood::Neighbourhood;
use osl_simd::{Isa, Kernel};
pub use params::Options;
use params::Params;
use sharing::{BLOCK, Sharing};
use site::Sites;
use std::marker::PhantomData;

/// Points or impulses that are processed together.
const LANES: usize = 16;
/// A number for each of them.
type Lanes = [f32; LANES];

/// Points to evaluate, as slices with one element per point. If lengths differ, the shortest counts.
#[derive(Clone, Copy, Debug, Default)]
pub struct Points<'a> {
    /// A slice for each dimension, one to four.
    pub coords: &'a [&'a [f32]],
    /// Empty, which means zero, or the partials of every coordinate in the first direction, then in the
    /// second.
    pub partials: &'a [&'a [f32]],
    /// Empty, or the period of every coordinate in cells.
    pub periods: &'a [&'a [f32]],
}

/// The radius of a kernel and size of a cell, in the unit of the coordinates.
pub fn radius(options: &Options) -> f32 {
    Params::new(options).radius
}

/// One value per point, about −1 to 1. `options` has either one element for all points or one per point. If
/// the number of slices fits no dimension, the output stays unchanged, here and below.
pub fn eval(isa: Isa, points: Points<'_>, options: &[Options], out: &mut [f32]) {
    isa.dispatch(Call::<f32>::new(points, options, &mut [out]));
}

/// Three values per point, of independent fields. The first is that of [`eval`].
pub fn eval3(isa: Isa, points: Points<'_>, options: &[Options], mut out: [&mut [f32]; 3]) {
    isa.dispatch(Call::<f32>::new(points, options, &mut out));
}

/// One value per point with its partials. `out` is the value, with the same bits as from [`eval`], and the
/// partials in both directions. The filter is taken as constant, so the partials follow from the chain rule
/// through the coordinates.
pub fn eval_dual(isa: Isa, points: Points<'_>, options: &[Options], mut out: [&mut [f32]; 3]) {
    isa.dispatch(Call::<Dual>::new(points, options, &mut out));
}

/// Three values per point with their partials: `out` is the three values, then the three partials in the
/// first direction, then those in the second.
pub fn eval3_dual(isa: Isa, points: Points<'_>, options: &[Options], mut out: [&mut [f32]; 9]) {
    isa.dispatch(Call::<Dual>::new(points, options, &mut out));
}

/// Maximum number of fields of a call, with the seeds 0, 1 and 2.
const FIELDS: usize = 3;

/// Evaluates fields into slices: a value for each field, then its partials.
struct Call<'a, 'o, N> {
    points: Points<'a>,
    options: &'a [Options],
    out: &'a mut [&'o mut [f32]],
    number: PhantomData<N>,
}

impl<'a, 'o, N: Number> Call<'a, 'o, N> {
    fn new(points: Points<'a>, options: &'a [Options], out: &'a mut [&'o mut [f32]]) -> Self {
        Call { points, options, out, number: PhantomData }
    }

    /// The number of points, if the slices fit together.
    fn len(&self) -> usize {
        let Points { coords, partials, periods } = self.points;
        let dims = coords.len();
        let fits = (1..=4).contains(&dims)
            && (partials.is_empty() || partials.len() == 2 * dims)
            && (periods.is_empty() || periods.len() == dims);
        if !fits {
            return 0;
        }
        let inputs = coords.iter().chain(partials).chain(periods).map(|s| s.len());
        let n = inputs.chain(self.out.iter().map(|o| o.len())).min().unwrap_or(0);
        if self.options.len() == 1 { n } else { n.min(self.options.len()) }
    }

    /// The number of fields.
    fn fields(&self) -> usize {
        (self.out.len() / N::PARTS).min(FIELDS)
    }

    /// Writes a field's value and partials at a point.
    #[inline(always)]
    fn write(&mut self, field: usize, point: usize, values: [f32; 3]) {
        let fields = self.fields();
        for (part, value) in values.into_iter().enumerate().take(N::PARTS) {
            if let Some(place) = self.out.get_mut(part * fields + field).and_then(|out| out.get_mut(point)) {
                *place = value;
            }
        }
    }
}

/// Below this number of points in a cell, a point alone is faster, an impulse per lane, than a cluster, a
/// point per lane.
const FEW: usize = 2;

impl<N: Number<Float = f32>> Kernel for Call<'_, '_, N> {
    type Output = ();
    #[inline(always)]
    fn run(mut self) {
        let Some(mut sites) = Sites::new(self.points, self.options) else { return };
        let mut cells: [Cells; FIELDS] = std::array::from_fn(|_| Cells::new());
        let mut around: [Neighbourhood; FIELDS] = std::array::from_fn(|_| Neighbourhood::default());
        let (mut sharing, mut near, mut alone) = (Sharing::new(), Vec::new(), Vec::new());
        let (n, fields) = (self.len(), self.fields());
        for start in (0..n).step_by(BLOCK) {
            sharing.clear();
            alone.clear();
            for i in start..n.min(start + BLOCK) {
                if !sharing.add(i - start, &sites.key(i)) {
                    alone.push(i);
                }
            }
            for points in sharing.lists() {
                let mut points = points.map(|i| start + i);
                let mut listed = false;
                while points.len() >= FEW {
                    let cluster = Cluster::new(&mut sites, points.by_ref().take(LANES), &mut alone);
                    for (field, around) in around.iter_mut().enumerate().take(fields) {
                        if !listed {
                            let cells = &mut cells[field];
                            cells.visit(&cluster.first().place(field as u32));
                            cells.list(&cluster.first().params, around);
                        }
                        let values = cluster.field::<N>(around, &mut near);
                        for (lane, point) in cluster.points().iter().enumerate() {
                            self.write(field, *point, values.map(|lanes| lanes[lane]));
                        }
                    }
                    listed = true;
                }
                alone.extend(points);
            }
            for i in &alone {
                let site = sites.site(*i);
                for (field, cells) in cells.iter_mut().enumerate().take(fields) {
                    let Dual { v, dx, dy } = site.field::<N>(cells, field as u32).dual();
                    self.write(field, *i, [v, dx, dy]);
                }
            }
        }
    }
}
