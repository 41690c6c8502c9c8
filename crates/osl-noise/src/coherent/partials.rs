//! Gradient noise in three dimensions with partials, for vectors of points in one cell or a few.
//!
//! Hashing a cell costs half of its noise with partials, so lanes share it as those of plain noise do
//! (`alone`). The operations are those of [`Dual`](crate::number::Dual), in the same order.

use super::FEW;
use super::alone::{self, Form};
use super::perlin::{ORDER, Perlin, Shared, place};
use crate::perlin::SCALE;
use crate::range::Range;
use crate::unroll::{array, each};
use osl_simd::registers::{Floats, Registers};
use osl_simd::{Isa, Kernel};

/// Values, or results, then their partials in two directions.
pub(crate) type Three<T> = [T; 3];

/// A vector of numbers with partials.
#[derive(Clone, Copy)]
struct Dual<F> {
    v: F,
    dx: F,
    dy: F,
}

impl<F> Dual<F> {
    #[inline(always)]
    fn constant<R: Registers<N, Floats = F>, const N: usize>(r: R, x: f32) -> Dual<F> {
        Dual { v: r.all(x), dx: r.all(0.0), dy: r.all(0.0) }
    }

    #[inline(always)]
    fn plus<const N: usize>(self, b: Dual<F>) -> Dual<F>
    where
        F: Floats<N>,
    {
        Dual { v: self.v + b.v, dx: self.dx + b.dx, dy: self.dy + b.dy }
    }

    #[inline(always)]
    fn minus<const N: usize>(self, b: Dual<F>) -> Dual<F>
    where
        F: Floats<N>,
    {
        Dual { v: self.v - b.v, dx: self.dx - b.dx, dy: self.dy - b.dy }
    }

    #[inline(always)]
    fn times<const N: usize>(self, b: Dual<F>) -> Dual<F>
    where
        F: Floats<N>,
    {
        Dual { v: self.v * b.v, dx: self.v * b.dx + self.dx * b.v, dy: self.v * b.dy + self.dy * b.v }
    }

    #[inline(always)]
    fn scaled<const N: usize>(self, k: F) -> Dual<F>
    where
        F: Floats<N>,
    {
        Dual { v: self.v * k, dx: self.dx * k, dy: self.dy * k }
    }
}

/// Offsets to a corner of the cell, or their partials, by [`place`].
#[repr(align(64))]
struct Offsets<const N: usize>([[f32; N]; 16]);

impl<const N: usize> Offsets<N> {
    /// Stores what belongs to an axis, for the near corner and the far one.
    #[inline(always)]
    fn store<R: Registers<N>>(&mut self, axis: usize, near: R::Floats, far: R::Floats) {
        for (corner, way) in [(0, near), (7, far)] {
            way.store(&mut self.0[place(corner, axis, 0) & 15]);
            way.negative().store(&mut self.0[place(corner, axis, 1) & 15]);
        }
    }

    /// The sum of the two terms of a corner.
    #[inline(always)]
    fn sum<R: Registers<N>>(&self, r: R, [first, second]: [u32; 2]) -> R::Floats {
        let term = |at: u32| r.floats(&self.0[(at & 15) as usize]);
        term(first) + term(second)
    }
}

/// Points with partials.
struct Partials<'a, R, const N: usize> {
    registers: R,
    range: Range,
    coords: Three<[&'a [f32]; 3]>,
    out: Three<&'a mut [f32]>,
    offsets: Three<Offsets<N>>,
}

impl<R: Registers<N>, const N: usize> Form<Perlin, R, N, 3> for Partials<'_, R, N> {
    type Results = Dual<R::Floats>;
    #[inline(always)]
    fn count(&self) -> usize {
        self.out[0].len() / N
    }
    #[inline(always)]
    fn point(&self, vector: usize, lane: usize) -> [f32; 3] {
        self.coords[0].map(
            #[inline(always)]
            |c| c.get(vector * N + lane).copied().unwrap_or(f32::NAN),
        )
    }
    #[inline(always)]
    fn within(&mut self, vector: usize, cell: &Shared<3>) -> (R::Marks, Dual<R::Floats>) {
        let r = self.registers;
        let one = r.all(1.0);
        let c = |x: f32| Dual::constant(r, x);
        let part = |coords: &[&[f32]; 3], a: usize| r.floats(&coords[a].as_chunks().0[vector]);
        let [v, dx, dy] = &self.coords;
        let near: [Dual<R::Floats>; 3] = array(
            #[inline(always)]
            |a| Dual { v: part(v, a) - r.all(cell.base[a]), dx: part(dx, a), dy: part(dy, a) },
        );
        let mut top = near[0].v;
        let [values, along_x, along_y] = &mut self.offsets;
        each(
            3,
            #[inline(always)]
            |a| {
                top = top.larger_word(near[a].v);
                values.store::<R>(a, near[a].v, near[a].v - one);
                along_x.store::<R>(a, near[a].dx, near[a].dx);
                along_y.store::<R>(a, near[a].dy, near[a].dy);
            },
        );
        let mut g = [c(0.0); 8];
        each(
            8,
            #[inline(always)]
            |corner| {
                let terms = cell.terms[corner];
                g[corner] =
                    Dual { v: values.sum(r, terms), dx: along_x.sum(r, terms), dy: along_y.sum(r, terms) };
            },
        );
        let mut done = 0;
        each(
            3,
            #[inline(always)]
            |step| {
                let axis = ORDER[step];
                let t = near[axis];
                let weight = t.times(t).times(t).times(t.times(t.times(c(6.0)).minus(c(15.0))).plus(c(10.0)));
                let rest = c(1.0).minus(weight);
                each(
                    8,
                    #[inline(always)]
                    |corner| {
                        if corner & (done | 1 << axis) == 0 {
                            g[corner] = g[corner].times(rest).plus(g[corner | 1 << axis].times(weight));
                        }
                    },
                );
                done |= 1 << axis;
            },
        );
        (top.are_fractions(), g[0].scaled(r.all(SCALE[3])))
    }
    #[inline(always)]
    fn replaced_at(results: Dual<R::Floats>, marks: R::Marks, others: Dual<R::Floats>) -> Dual<R::Floats> {
        Dual {
            v: results.v.replaced_at(marks, others.v),
            dx: results.dx.replaced_at(marks, others.dx),
            dy: results.dy.replaced_at(marks, others.dy),
        }
    }
    #[inline(always)]
    fn store(&mut self, vector: usize, Dual { v, dx, dy }: Dual<R::Floats>) {
        let r = self.registers;
        let v = v + r.all(self.range.shift);
        let Dual { v, dx, dy } = Dual { v, dx, dy }.scaled(r.all(self.range.factor));
        for (out, part) in self.out.iter_mut().zip([v, dx, dy]) {
            part.store(&mut out.as_chunks_mut().0[vector]);
        }
    }
}

impl<R: Registers<N>, const N: usize> Kernel for Partials<'_, R, N> {
    type Output = usize;
    #[inline(always)]
    fn run(self) -> usize {
        alone::run::<Perlin, R, _, N, 3>(self)
    }
}

/// Computes gradient noise with partials at points of three dimensions, as long as vectors of points are in
/// few cells. All slices have the same length. Returns the number of points done.
pub(crate) fn fill(isa: Isa, range: Range, coords: Three<[&[f32]; 3]>, out: Three<&mut [f32]>) -> usize {
    match (isa.wide(), isa.narrow()) {
        (Some(r), _) => fill_with::<_, 16>(r, range, coords, out),
        (_, Some(r)) => fill_with::<_, 8>(r, range, coords, out),
        _ => 0,
    }
}

fn fill_with<R: Registers<N>, const N: usize>(
    registers: R,
    range: Range,
    coords: Three<[&[f32]; 3]>,
    out: Three<&mut [f32]>,
) -> usize {
    let lengths = coords.iter().flatten().map(|c| c.len()).chain(out.iter().map(|o| o.len()));
    let n = lengths.min().unwrap_or(0) / N * N;
    if n < FEW {
        return 0;
    }
    let coords = coords.map(|part| part.map(|c| &c[..n]));
    if alone::are_scattered::<Perlin, N, 3>(coords[0]) {
        return 0;
    }
    let out = out.map(|o| &mut o[..n]);
    let offsets = std::array::from_fn(|_| Offsets([[0.0; N]; 16]));
    registers.dispatch(Partials { registers, range, coords, out, offsets })
}
