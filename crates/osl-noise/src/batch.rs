//! The fields over lanes: one loop for each field, dimension and form, compiled for each instruction set.
//!
//! Coordinates are one slice per dimension, one to four. If slices differ in length, the shortest counts;
//! with any other number of dimensions the output stays unchanged. A single point is a batch of one.

use crate::field::{Cell, Field, Hash, Kind, Perlin, Simplex};
use crate::float::{Float, Large};
use crate::lanes::{BLOCK, map};
use crate::number::Dual;
use crate::range::Range;
use crate::unroll::array;
use osl_simd::{Isa, Kernel};

/// One value per point.
pub fn eval<T: BatchFloat>(isa: Isa, kind: Kind, coords: &[&[T]], out: &mut [T]) {
    T::run(isa, Call { kind, coords, periods: &[], out: Out::One(out) });
}

/// Three values per point.
pub fn eval3<T: BatchFloat>(isa: Isa, kind: Kind, coords: &[&[T]], out: [&mut [T]; 3]) {
    T::run(isa, Call { kind, coords, periods: &[], out: Out::Three(out) });
}

/// One value per point of the field repeated with the periods, one slice per dimension.
pub fn eval_periodic<T: BatchFloat>(isa: Isa, kind: Kind, coords: &[&[T]], periods: &[&[T]], out: &mut [T]) {
    T::run(isa, Call { kind, coords, periods, out: Out::One(out) });
}

/// Three values per point of the field repeated with the periods.
pub fn eval3_periodic<T: BatchFloat>(
    isa: Isa,
    kind: Kind,
    coords: &[&[T]],
    periods: &[&[T]],
    out: [&mut [T]; 3],
) {
    T::run(isa, Call { kind, coords, periods, out: Out::Three(out) });
}

/// One value per point with its partials. `coords` are the values, then the partials of each in the first
/// direction, then those in the second; `out` is the value and both partials. `periods` may be empty. With
/// partials (1, 0) and (0, 1) the result is the gradient.
pub fn eval_dual<T: BatchFloat>(isa: Isa, kind: Kind, coords: &[&[T]], periods: &[&[T]], out: [&mut [T]; 3]) {
    T::run(isa, Call { kind, coords, periods, out: Out::Dual(out) });
}

/// Three values per point with their partials: `out` is the three values, then the three partials in the
/// first direction, then those in the second.
pub fn eval3_dual<T: BatchFloat>(
    isa: Isa,
    kind: Kind,
    coords: &[&[T]],
    periods: &[&[T]],
    out: [&mut [T]; 9],
) {
    T::run(isa, Call { kind, coords, periods, out: Out::Duals(out) });
}

#[derive(Debug)]
enum Out<'a, T> {
    One(&'a mut [T]),
    Three([&'a mut [T]; 3]),
    Dual([&'a mut [T]; 3]),
    Duals([&'a mut [T]; 9]),
}

impl<'a, T> Out<'a, T> {
    fn slices(&mut self) -> &mut [&'a mut [T]] {
        match self {
            Out::One(out) => std::slice::from_mut(out),
            Out::Three(out) | Out::Dual(out) => out,
            Out::Duals(out) => out,
        }
    }
}

/// The field, the form and the points of a call.
#[derive(Debug)]
pub struct Call<'a, T> {
    kind: Kind,
    coords: &'a [&'a [T]],
    periods: &'a [&'a [T]],
    out: Out<'a, T>,
}

/// A float in which batches are computed.
pub trait BatchFloat: Float {
    /// Computes a field. Not generic, so that it is compiled only in this crate.
    fn run(isa: Isa, call: Call<'_, Self>);
}

impl BatchFloat for f32 {
    fn run(isa: Isa, call: Call<'_, f32>) {
        by_kind(isa, call);
    }
}

impl BatchFloat for f64 {
    fn run(isa: Isa, call: Call<'_, f64>) {
        by_kind(isa, call);
    }
}

// The kernel is selected outside the functions that are compiled for each instruction set, so that each loop
// is a function of its own, which compiles much faster.

fn by_kind<T: Float>(isa: Isa, call: Call<'_, T>) {
    match call.kind {
        Kind::Cell => by_dimension(isa, Cell, call),
        Kind::Hash => by_dimension(isa, Hash, call),
        Kind::Perlin => by_dimension(isa, Perlin(Range::SIGNED), call),
        Kind::UPerlin => by_dimension(isa, Perlin(Range::UNSIGNED), call),
        Kind::Simplex => by_dimension(isa, Simplex(Range::SIGNED), call),
        Kind::USimplex => by_dimension(isa, Simplex(Range::UNSIGNED), call),
    }
}

fn by_dimension<T: Float, F: Field>(isa: Isa, field: F, call: Call<'_, T>) {
    let dual = matches!(call.out, Out::Dual(_) | Out::Duals(_));
    match call.coords.len() / if dual { 3 } else { 1 } {
        1 => by_form::<T, F, 1>(isa, field, call),
        2 => by_form::<T, F, 2>(isa, field, call),
        3 => by_form::<T, F, 3>(isa, field, call),
        4 => by_form::<T, F, 4>(isa, field, call),
        _ => {}
    }
}

/// `N` slices cut to length `n`. The caller has checked both numbers. The explicit length lets the compiler
/// remove bounds checks from the loop. If there are too few slices, all are empty.
#[inline(always)]
fn cut<'a, T, const N: usize>(slices: &[&'a [T]], from: usize, n: usize) -> [&'a [T]; N] {
    if slices.len() < from + N {
        return [&[]; N];
    }
    array(
        #[inline(always)]
        |a| &slices[from + a][..n],
    )
}

fn by_form<T: Float, F: Field, const D: usize>(isa: Isa, field: F, call: Call<'_, T>) {
    let Call { kind, coords, periods, mut out } = call;
    let lengths = coords.iter().chain(periods).map(|s| s.len());
    let n = lengths.chain(out.slices().iter().map(|s| s.len())).min().unwrap_or(0);
    if n < BLOCK {
        return padded::<T, F, D>(isa, field, (n, Call { kind, coords, periods, out }));
    }
    let periodic = periods.len() >= D;
    match out {
        Out::One(out) => {
            let (c, out): ([&[T]; D], _) = (cut(coords, 0, n), &mut out[..n]);
            if F::HAS_PERIODS && periodic {
                return T::dispatch_large(isa, OnePeriodic { field, c, p: cut(periods, 0, n), out });
            }
            if let Some(from) = rest(field.shared(isa, c, out), n) {
                T::dispatch(isa, One { field, c: c.map(|c| &c[from..]), out: &mut out[from..] });
            }
        }
        Out::Three([x, y, z]) => {
            let c: [&[T]; D] = cut(coords, 0, n);
            let out = [&mut x[..n], &mut y[..n], &mut z[..n]];
            if F::HAS_PERIODS && periodic {
                return T::dispatch_large(isa, ThreePeriodic { field, c, p: cut(periods, 0, n), out });
            }
            T::dispatch(isa, Three { field, c, out });
        }
        Out::Dual([v, dx, dy]) => {
            if F::IS_STEPPED {
                dx[..n].fill(T::lit(0.0));
                dy[..n].fill(T::lit(0.0));
                let coords = &coords[..D];
                return by_form::<T, F, D>(
                    isa,
                    field,
                    Call { kind, coords, periods, out: Out::One(&mut v[..n]) },
                );
            }
            let (c, p) = (Duals::<T, D>::new(coords, n), periodic.then(|| cut::<T, D>(periods, 0, n)));
            let (v, dx, dy) = (&mut v[..n], &mut dx[..n], &mut dy[..n]);
            let done = match p {
                None => field.shared_dual(isa, [c.v, c.dx, c.dy], [&mut *v, &mut *dx, &mut *dy]),
                Some(_) => 0,
            };
            if let Some(from) = rest(done, n) {
                let out = [&mut v[from..], &mut dx[from..], &mut dy[from..]];
                T::dispatch_large(isa, OneDual { field, c: c.part(from..n), p, out });
            }
        }
        Out::Duals(out) => {
            if F::IS_STEPPED {
                let [x, y, z, partials @ ..] = out;
                for partial in partials {
                    partial[..n].fill(T::lit(0.0));
                }
                let (coords, out) = (&coords[..D], Out::Three([&mut x[..n], &mut y[..n], &mut z[..n]]));
                return by_form::<T, F, D>(isa, field, Call { kind, coords, periods, out });
            }
            let (c, p) = (Duals::<T, D>::new(coords, n), periodic.then(|| cut::<T, D>(periods, 0, n)));
            let nine = ThreeDual { field, c, p, out, n };
            if p.is_none() { T::dispatch_nine(isa, nine) } else { nine.lane_by_lane() }
        }
    }
}

/// The first point that is left to compute when some of `n` are done; `None` if all are. If the others are
/// fewer than a block, they are computed with some that are done.
fn rest(done: usize, n: usize) -> Option<usize> {
    (done < n).then(|| done.min(n.saturating_sub(BLOCK)))
}

/// Computes a call with fewer points than a block: it adds points whose coordinates are 0, and drops their
/// results.
#[cold]
fn padded<T: Float, F: Field, const D: usize>(isa: Isa, field: F, (n, call): (usize, Call<'_, T>)) {
    let Call { kind, coords, periods, mut out } = call;
    // Three numbers for each dimension, and the periods.
    let mut lanes = [[T::lit(0.0); BLOCK]; 16];
    for (to, from) in lanes.iter_mut().zip(coords.iter().chain(periods)) {
        to[..n].copy_from_slice(&from[..n]);
    }
    let lanes = lanes.each_ref().map(|lanes| &lanes[..]);
    let (own_coords, own_periods) = lanes.split_at(coords.len().min(lanes.len()));
    let own_periods = &own_periods[..periods.len().min(own_periods.len())];
    let mut results = [[T::lit(0.0); BLOCK]; 9];
    let each = results.each_mut().map(|lanes| &mut lanes[..]);
    let own = match (&out, each) {
        (Out::One(_), [x, ..]) => Out::One(x),
        (Out::Three(_), [x, y, z, ..]) => Out::Three([x, y, z]),
        (Out::Dual(_), [x, y, z, ..]) => Out::Dual([x, y, z]),
        (Out::Duals(_), each) => Out::Duals(each),
    };
    by_form::<T, F, D>(isa, field, Call { kind, coords: own_coords, periods: own_periods, out: own });
    for (to, from) in out.slices().iter_mut().zip(&results) {
        to[..n].copy_from_slice(&from[..n]);
    }
}

struct One<'a, T, F, const D: usize> {
    field: F,
    c: [&'a [T]; D],
    out: &'a mut [T],
}

impl<T: Float, F: Field, const D: usize> Kernel for One<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let One { field, c, out } = self;
        map(
            [c],
            [out],
            #[inline(always)]
            |[c]| [field.one(c)],
        );
    }
}

struct OnePeriodic<'a, T, F, const D: usize> {
    field: F,
    c: [&'a [T]; D],
    p: [&'a [T]; D],
    out: &'a mut [T],
}

impl<T: Float, F: Field, const D: usize> Kernel for OnePeriodic<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let OnePeriodic { field, c, p, out } = self;
        map(
            [c, p],
            [out],
            #[inline(always)]
            |[c, p]| [field.one_periodic(c, p)],
        );
    }
}

struct Three<'a, T, F, const D: usize> {
    field: F,
    c: [&'a [T]; D],
    out: [&'a mut [T]; 3],
}

impl<T: Float, F: Field, const D: usize> Kernel for Three<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Three { field, c, out } = self;
        map(
            [c],
            out,
            #[inline(always)]
            |[c]| field.three(c),
        );
    }
}

struct ThreePeriodic<'a, T, F, const D: usize> {
    field: F,
    c: [&'a [T]; D],
    p: [&'a [T]; D],
    out: [&'a mut [T]; 3],
}

impl<T: Float, F: Field, const D: usize> Kernel for ThreePeriodic<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let ThreePeriodic { field, c, p, out } = self;
        map(
            [c, p],
            out,
            #[inline(always)]
            |[c, p]| field.three_periodic(c, p),
        );
    }
}

struct OneDual<'a, T, F, const D: usize> {
    field: F,
    c: Duals<'a, T, D>,
    p: Option<[&'a [T]; D]>,
    out: [&'a mut [T]; 3],
}

impl<T: Float, F: Field, const D: usize> Kernel for OneDual<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let OneDual { field, c: Duals { v, dx, dy }, p, out } = self;
        match p.filter(|_| F::HAS_PERIODS) {
            None => map(
                [v, dx, dy],
                out,
                #[inline(always)]
                |[v, dx, dy]| {
                    let d = field.one_dual(duals(v, dx, dy), None);
                    [d.v, d.dx, d.dy]
                },
            ),
            Some(p) => map(
                [v, dx, dy, p],
                out,
                #[inline(always)]
                |[v, dx, dy, p]| {
                    let d = field.one_dual(duals(v, dx, dy), Some(p));
                    [d.v, d.dx, d.dy]
                },
            ),
        }
    }
}

/// Nine results in vectors.
struct ThreeDual<'a, T, F, const D: usize> {
    field: F,
    c: Duals<'a, T, D>,
    /// Only used a lane at a time.
    p: Option<[&'a [T]; D]>,
    out: [&'a mut [T]; 9],
    n: usize,
}

impl<T: Float, F: Field, const D: usize> Kernel for ThreeDual<'_, T, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let ThreeDual { field, c: Duals { v, dx, dy }, p: _, out, n: _ } = self;
        map(
            [v, dx, dy],
            out,
            #[inline(always)]
            |[v, dx, dy]| flat(field.three_dual(duals(v, dx, dy), None)),
        );
    }
}

// A lane at a time, for machines without AVX2, for periods of nine results, and for nine results in double
// precision. Vectors would take the compiler longer than they save.

impl<T: Float, F: Field, const D: usize> Large for OnePeriodic<'_, T, F, D> {
    fn lane_by_lane(self) {
        let OnePeriodic { field, c, p, out } = self;
        for (i, out) in out.iter_mut().enumerate() {
            *out = apart(|| field.one_periodic(at(c, i), at(p, i)));
        }
    }
}

impl<T: Float, F: Field, const D: usize> Large for ThreePeriodic<'_, T, F, D> {
    fn lane_by_lane(self) {
        let ThreePeriodic { field, c, p, mut out } = self;
        for i in 0..out[0].len() {
            let values = apart(|| field.three_periodic(at(c, i), at(p, i)));
            store(&mut out, i, values);
        }
    }
}

impl<T: Float, F: Field, const D: usize> Large for OneDual<'_, T, F, D> {
    fn lane_by_lane(self) {
        let OneDual { field, c, p, mut out } = self;
        for i in 0..out[0].len() {
            let d = apart(|| field.one_dual(c.at(i), p.filter(|_| F::HAS_PERIODS).map(|p| at(p, i))));
            store(&mut out, i, [d.v, d.dx, d.dy]);
        }
    }
}

impl<T: Float, F: Field, const D: usize> Large for ThreeDual<'_, T, F, D> {
    fn lane_by_lane(self) {
        let ThreeDual { field, c, p, mut out, n } = self;
        for i in 0..n {
            let values = flat(apart(|| field.three_dual(c.at(i), p.map(|p| at(p, i)))));
            store(&mut out, i, values);
        }
    }
}

/// Does something in a function of its own, so that a loop over lanes stays one.
#[inline(never)]
fn apart<R>(f: impl FnOnce() -> R) -> R {
    f()
}

/// Stores the results of one lane.
fn store<T, const N: usize>(out: &mut [&mut [T]; N], lane: usize, values: [T; N]) {
    for (lanes, value) in out.iter_mut().zip(values) {
        lanes[lane] = value;
    }
}

/// The values, then the partials in the first direction, then those in the second.
#[inline(always)]
fn flat<T: Float>(d: [Dual<T>; 3]) -> [T; 9] {
    [d[0].v, d[1].v, d[2].v, d[0].dx, d[1].dx, d[2].dx, d[0].dy, d[1].dy, d[2].dy]
}

/// The coordinates of one point.
#[inline(always)]
fn at<T: Copy, const D: usize>(slices: [&[T]; D], i: usize) -> [T; D] {
    array(
        #[inline(always)]
        |a| slices[a][i],
    )
}

#[derive(Clone, Copy)]
struct Duals<'a, T, const D: usize> {
    v: [&'a [T]; D],
    dx: [&'a [T]; D],
    dy: [&'a [T]; D],
}

impl<'a, T: Float, const D: usize> Duals<'a, T, D> {
    #[inline(always)]
    fn new(coords: &[&'a [T]], n: usize) -> Self {
        Duals { v: cut(coords, 0, n), dx: cut(coords, D, n), dy: cut(coords, 2 * D, n) }
    }

    /// Some of the lanes.
    #[inline(always)]
    fn part(&self, lanes: std::ops::Range<usize>) -> Self {
        let [v, dx, dy] = [self.v, self.dx, self.dy].map(
            #[inline(always)]
            |slices| slices.map(|slice| &slice[lanes.clone()]),
        );
        Duals { v, dx, dy }
    }

    #[inline(always)]
    fn at(&self, i: usize) -> [Dual<T>; D] {
        duals(at(self.v, i), at(self.dx, i), at(self.dy, i))
    }
}

/// Numbers with their partials.
#[inline(always)]
fn duals<T: Copy, const D: usize>(v: [T; D], dx: [T; D], dy: [T; D]) -> [Dual<T>; D] {
    array(
        #[inline(always)]
        |a| Dual { v: v[a], dx: dx[a], dy: dy[a] },
    )
}
