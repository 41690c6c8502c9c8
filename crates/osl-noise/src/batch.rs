//! The fields over lanes: one loop for each field, dimension and form, compiled for each instruction set.
//!
//! Coordinates come as one slice for each dimension, one to four. Slices of unequal length count as far as the
//! shortest goes; other numbers of dimensions leave the output as it is. A single point is a batch of one.

use crate::coherent;
use crate::field::{Cell, Field, Hash, Kind, Perlin, Simplex};
use crate::number::Dual;
use crate::simd::{Isa, Kernel};
use crate::unroll::array;

/// One value a point.
pub fn eval(isa: Isa, kind: Kind, coords: &[&[f32]], out: &mut [f32]) {
    isa.dispatch(Call { kind, coords, periods: &[], out: Out::One(out) });
}

/// Three values a point.
pub fn eval3(isa: Isa, kind: Kind, coords: &[&[f32]], out: [&mut [f32]; 3]) {
    isa.dispatch(Call { kind, coords, periods: &[], out: Out::Three(out) });
}

/// One value a point of the field repeated with the periods, one slice for each dimension.
pub fn eval_periodic(isa: Isa, kind: Kind, coords: &[&[f32]], periods: &[&[f32]], out: &mut [f32]) {
    isa.dispatch(Call { kind, coords, periods, out: Out::One(out) });
}

/// Three values a point of the field repeated with the periods.
pub fn eval3_periodic(isa: Isa, kind: Kind, coords: &[&[f32]], periods: &[&[f32]], out: [&mut [f32]; 3]) {
    isa.dispatch(Call { kind, coords, periods, out: Out::Three(out) });
}

/// One value a point with its partials: `coords` are the values, then the partials of each in the first direction,
/// then those in the second; `out` is value and both partials. `periods` may be empty. With partials (1, 0) and
/// (0, 1) the result is the gradient.
pub fn eval_dual(isa: Isa, kind: Kind, coords: &[&[f32]], periods: &[&[f32]], out: [&mut [f32]; 3]) {
    isa.dispatch(Call { kind, coords, periods, out: Out::Dual(out) });
}

/// Three values a point with their partials: `out` is the three values, then the three partials in the first
/// direction, then in the second.
pub fn eval3_dual(isa: Isa, kind: Kind, coords: &[&[f32]], periods: &[&[f32]], out: [&mut [f32]; 9]) {
    isa.dispatch(Call { kind, coords, periods, out: Out::Duals(out) });
}

enum Out<'a> {
    One(&'a mut [f32]),
    Three([&'a mut [f32]; 3]),
    Dual([&'a mut [f32]; 3]),
    Duals([&'a mut [f32]; 9]),
}

struct Call<'a> {
    kind: Kind,
    coords: &'a [&'a [f32]],
    periods: &'a [&'a [f32]],
    out: Out<'a>,
}

impl Kernel for Call<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        match self.kind {
            Kind::Cell => by_dimension(Cell, self),
            Kind::Hash => by_dimension(Hash, self),
            Kind::Perlin => by_dimension(Perlin::<false>, self),
            Kind::UPerlin => by_dimension(Perlin::<true>, self),
            Kind::Simplex => by_dimension(Simplex::<false>, self),
            Kind::USimplex => by_dimension(Simplex::<true>, self),
        }
    }
}

#[inline(always)]
fn by_dimension<F: Field>(field: F, call: Call<'_>) {
    let dual = matches!(call.out, Out::Dual(_) | Out::Duals(_));
    match call.coords.len() / if dual { 3 } else { 1 } {
        1 => by_form::<F, 1>(field, call),
        2 => by_form::<F, 2>(field, call),
        3 => by_form::<F, 3>(field, call),
        4 => by_form::<F, 4>(field, call),
        _ => {}
    }
}

/// `N` slices cut to `n`. The caller has counted both, and a length that is `n` beyond doubt is what frees the loop
/// from checks. Where there are too few, all are empty.
#[inline(always)]
fn cut<'a, const N: usize>(slices: &[&'a [f32]], from: usize, n: usize) -> [&'a [f32]; N] {
    if slices.len() < from + N {
        return [&[]; N];
    }
    array(
        #[inline(always)]
        |a| &slices[from + a][..n],
    )
}

#[inline(always)]
fn by_form<F: Field, const D: usize>(field: F, call: Call<'_>) {
    let Call { coords, periods, out, .. } = call;
    let lengths = coords.iter().chain(periods).map(|s| s.len());
    let n = lengths.min().unwrap_or(0);
    let periodic = periods.len() >= D;
    match out {
        Out::One(out) => {
            let n = n.min(out.len());
            let c: [&[f32]; D] = cut(coords, 0, n);
            if periodic {
                let p: [&[f32]; D] = cut(periods, 0, n);
                fill(
                    &mut out[..n],
                    #[inline(always)]
                    |i| field.one_periodic(at(c, i), at(p, i)),
                );
            } else if const { F::SHARED[D][0] } {
                coherent::fill::<F, D, 1>(field, c, [&mut out[..n]]);
            } else {
                fill(
                    &mut out[..n],
                    #[inline(always)]
                    |i| field.one(at(c, i)),
                );
            }
        }
        Out::Three([x, y, z]) => {
            let n = n.min(x.len()).min(y.len()).min(z.len());
            let c: [&[f32]; D] = cut(coords, 0, n);
            let (x, y, z) = (&mut x[..n], &mut y[..n], &mut z[..n]);
            if periodic {
                let p: [&[f32]; D] = cut(periods, 0, n);
                fill3(
                    x,
                    y,
                    z,
                    #[inline(always)]
                    |i| field.three_periodic(at(c, i), at(p, i)),
                );
            } else if const { F::SHARED[D][1] } {
                coherent::fill::<F, D, 3>(field, c, [x, y, z]);
            } else {
                fill3(
                    x,
                    y,
                    z,
                    #[inline(always)]
                    |i| field.three(at(c, i)),
                );
            }
        }
        Out::Dual([v, dx, dy]) => {
            let n = n.min(v.len()).min(dx.len()).min(dy.len());
            let (c, p) = (Duals::<D>::new(coords, n), cut::<D>(periods, 0, n));
            fill3(
                &mut v[..n],
                &mut dx[..n],
                &mut dy[..n],
                #[inline(always)]
                |i| {
                    let d = field.one_dual(c.at(i), if periodic { Some(at(p, i)) } else { None });
                    [d.v, d.dx, d.dy]
                },
            );
        }
        Out::Duals(mut out) => {
            let n = out.iter().fold(n, |n, o| n.min(o.len()));
            let (c, p) = (Duals::<D>::new(coords, n), cut::<D>(periods, 0, n));
            for i in 0..n {
                let d = field.three_dual(c.at(i), if periodic { Some(at(p, i)) } else { None });
                let flat = [d[0].v, d[1].v, d[2].v, d[0].dx, d[1].dx, d[2].dx, d[0].dy, d[1].dy, d[2].dy];
                for (lanes, value) in out.iter_mut().zip(flat) {
                    lanes[i] = value;
                }
            }
        }
    }
}

/// One point of some slices.
#[inline(always)]
fn at<const D: usize>(slices: [&[f32]; D], i: usize) -> [f32; D] {
    array(
        #[inline(always)]
        |a| slices[a][i],
    )
}

#[derive(Clone, Copy)]
struct Duals<'a, const D: usize> {
    v: [&'a [f32]; D],
    dx: [&'a [f32]; D],
    dy: [&'a [f32]; D],
}

impl<'a, const D: usize> Duals<'a, D> {
    #[inline(always)]
    fn new(coords: &[&'a [f32]], n: usize) -> Self {
        Duals { v: cut(coords, 0, n), dx: cut(coords, D, n), dy: cut(coords, 2 * D, n) }
    }

    #[inline(always)]
    fn at(&self, i: usize) -> [Dual; D] {
        array(
            #[inline(always)]
            |a| Dual { v: self.v[a][i], dx: self.dx[a][i], dy: self.dy[a][i] },
        )
    }
}

// Closures say `inline(always)` because they are compiled for the baseline where they are not inlined.
// Outputs are parameters of their own so that the compiler knows that they overlap with nothing.
#[inline(always)]
fn fill(out: &mut [f32], f: impl Fn(usize) -> f32) {
    for (i, o) in out.iter_mut().enumerate() {
        *o = f(i);
    }
}

#[inline(always)]
fn fill3(x: &mut [f32], y: &mut [f32], z: &mut [f32], f: impl Fn(usize) -> [f32; 3]) {
    let n = x.len();
    let (y, z) = (&mut y[..n], &mut z[..n]);
    for i in 0..n {
        let v = f(i);
        x[i] = v[0];
        y[i] = v[1];
        z[i] = v[2];
    }
}
