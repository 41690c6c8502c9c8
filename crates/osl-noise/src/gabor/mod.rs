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
mod field;
mod filter;
mod kernel;
mod params;
mod waves;

use crate::number::{Dual, Number};
use cells::Cells;
use field::Site;
use filter::Filter;
use osl_simd::{Isa, Kernel};
pub use params::Options;
use params::Params;
use std::marker::PhantomData;

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
    isa.dispatch(Call::<f32, 1, 1>::new(points, options, [out]));
}

/// Three values per point, of independent fields. The first is that of [`eval`].
pub fn eval3(isa: Isa, points: Points<'_>, options: &[Options], out: [&mut [f32]; 3]) {
    isa.dispatch(Call::<f32, 3, 3>::new(points, options, out));
}

/// One value per point with its partials. `out` is the value, with the same bits as from [`eval`], and the
/// partials in both directions. The filter is taken as constant, so the partials follow from the chain rule
/// through the coordinates.
pub fn eval_dual(isa: Isa, points: Points<'_>, options: &[Options], out: [&mut [f32]; 3]) {
    isa.dispatch(Call::<Dual, 1, 3>::new(points, options, out));
}

/// Three values per point with their partials: `out` is the three values, then the three partials in the
/// first direction, then those in the second.
pub fn eval3_dual(isa: Isa, points: Points<'_>, options: &[Options], out: [&mut [f32]; 9]) {
    isa.dispatch(Call::<Dual, 3, 9>::new(points, options, out));
}

/// Evaluates fields of `SEEDS` seeds into `OUT` slices.
struct Call<'a, N, const SEEDS: usize, const OUT: usize> {
    points: Points<'a>,
    options: &'a [Options],
    out: [&'a mut [f32]; OUT],
    number: PhantomData<N>,
}

impl<'a, N, const SEEDS: usize, const OUT: usize> Call<'a, N, SEEDS, OUT> {
    fn new(points: Points<'a>, options: &'a [Options], out: [&'a mut [f32]; OUT]) -> Self {
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
}

/// Element `i` of the first three slices, 0 where a slice is missing.
fn triple(slices: &[&[f32]], i: usize) -> [f32; 3] {
    let mut out = [0.0; 3];
    for (to, from) in out.iter_mut().zip(slices) {
        *to = from.get(i).copied().unwrap_or(0.0);
    }
    out
}

impl<N: Number<Float = f32>, const SEEDS: usize, const OUT: usize> Kernel for Call<'_, N, SEEDS, OUT> {
    type Output = ();
    #[inline(always)]
    fn run(mut self) {
        let n = self.len();
        let Points { coords, partials, periods } = self.points;
        let (first, second) = partials.split_at(partials.len() / 2);
        let mut cells: [Cells; SEEDS] = std::array::from_fn(|_| Cells::new());
        let Some(mut params) = self.options.first().map(Params::new) else { return };
        for i in 0..n {
            let options = &self.options[if self.options.len() == 1 { 0 } else { i }];
            if self.options.len() > 1 && i > 0 {
                params = Params::new(options);
            }
            let (v, dx, dy) = (triple(coords, i), triple(first, i), triple(second, i));
            let site = Site {
                params: &params,
                p: [0, 1, 2].map(|a| N::from_dual(Dual { v: v[a], dx: dx[a], dy: dy[a] })),
                periods: if periods.is_empty() { None } else { Some(triple(periods, i)) },
                filter: if options.do_filter { Filter::new([dx, dy], params.a) } else { None },
            };
            for (seed, cells) in cells.iter_mut().enumerate() {
                let d = site.field(cells, seed as u32).dual();
                for (part, value) in [d.v, d.dx, d.dy].into_iter().enumerate() {
                    if let Some(out) = self.out.get_mut(part * SEEDS + seed) {
                        out[i] = value;
                    }
                }
            }
        }
    }
}
