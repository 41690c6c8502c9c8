//! Vectors of points in one cell or a few: all lanes are computed with the data of one cell, then again with
//! those of the next, until each lane has its own.

use super::{Key, Lattice, Points};
use crate::unroll::{array, each};
use osl_simd::Kernel;
use osl_simd::registers::{Floats, Marks, Registers};

/// Memory for vectors that are selected by number, aligned to cache lines so that none crosses one.
#[repr(align(64))]
pub(crate) struct Scratch<const N: usize>([[f32; N]; 16]);

impl<const N: usize> Scratch<N> {
    /// A vector, by a number below 16.
    #[inline(always)]
    pub(crate) fn at(&self, place: usize) -> &[f32; N] {
        &self.0[place & 15]
    }

    /// The same, to write it.
    #[inline(always)]
    pub(crate) fn at_mut(&mut self, place: usize) -> &mut [f32; N] {
        &mut self.0[place & 15]
    }
}

/// Whether floats near all coordinates are fractional.
#[inline(always)]
fn are_small<const D: usize>(p: [f32; D]) -> bool {
    p.into_iter().all(|x| x.abs() < 1_048_576.0)
}

/// A lattice whose fields are computed with the data of one cell: values, and `S` − 1 partials of each.
pub(crate) trait InOneCell<const D: usize, const S: usize>: Lattice<D> {
    /// The points in a cell, and their values and partials before scaling to the range. Points whose fraction
    /// has an unusual sign are in no cell.
    fn within<R: Registers<N>, const N: usize>(
        r: R,
        p: [[R::Floats; D]; S],
        cell: &Self::Cell,
        scratch: &mut [Scratch<N>; S],
    ) -> (R::Marks, [R::Floats; S]);
}

/// Computes points from the first one on, up to where vectors are in too many cells. Returns the number of
/// points done.
pub(super) struct Alone<'a, L, R, const N: usize, const D: usize, const S: usize> {
    points: Points<'a, L, R, D, S>,
    scratch: [Scratch<N>; S],
}

impl<'a, L: InOneCell<D, S>, R: Registers<N>, const N: usize, const D: usize, const S: usize>
    Alone<'a, L, R, N, D, S>
{
    pub(super) fn new(points: Points<'a, L, R, D, S>) -> Self {
        Alone { points, scratch: std::array::from_fn(|_| Scratch([[0.0; N]; 16])) }
    }

    /// A point by its vector and lane; NaN beyond the end.
    #[inline(always)]
    fn point(&self, vector: usize, lane: usize) -> [f32; D] {
        array(
            #[inline(always)]
            |a| self.points.coords[0][a].get(vector * N + lane).copied().unwrap_or(f32::NAN),
        )
    }

    /// The points of a vector that are in a cell, and their results.
    #[inline(always)]
    fn within(&mut self, vector: usize, cell: &L::Cell) -> (R::Marks, [R::Floats; S]) {
        let Points { registers: r, coords, .. } = &self.points;
        let p = array(
            #[inline(always)]
            |k| {
                array(
                    #[inline(always)]
                    |a| r.floats(&coords[k][a].as_chunks().0[vector]),
                )
            },
        );
        L::within(*r, p, cell, &mut self.scratch)
    }

    /// Stores the results of a vector in the range of the field.
    #[inline(always)]
    fn store(&mut self, vector: usize, results: [R::Floats; S]) {
        let Points { registers: r, range, out, .. } = &mut self.points;
        let (shift, factor) = (r.all(range.shift), r.all(range.factor));
        each(
            S,
            #[inline(always)]
            |k| {
                let part = if k == 0 { results[0] + shift } else { results[k] };
                (part * factor).store(&mut out[k].as_chunks_mut().0[vector]);
            },
        );
    }
}

/// Number of cells that are remembered.
const KNOWN: usize = 4;
/// A vector may be computed this often again; more cells at once cost less by tables.
const ROUNDS: usize = 3;
/// The cost of a cell's data, in computations of a vector.
const CELL: usize = 2;
/// Further computations that are never too many. From there on, one for each vector is enough.
const SPARE: usize = 8;

/// Whether vectors of points seem to be in more cells than it pays to compute them for: in two of the
/// vectors, three points are in different cells.
#[inline(always)]
pub(super) fn are_scattered<L: Lattice<D>, const N: usize, const D: usize>(coords: [&[f32]; D]) -> bool {
    let point = |at: usize| {
        array(
            #[inline(always)]
            |a| coords[a].get(at).copied().unwrap_or(f32::NAN),
        )
    };
    let middle = coords[0].len() / 2 / N * N;
    [0, middle].into_iter().all(|vector| {
        let [a, b, c] = [0, N / 2, N - 1].map(|lane| L::key_of(point(vector + lane)));
        a != b && b != c && c != a
    })
}

impl<L: InOneCell<D, S>, R: Registers<N>, const N: usize, const D: usize, const S: usize> Kernel
    for Alone<'_, L, R, N, D, S>
{
    type Output = usize;
    #[inline(always)]
    fn run(mut self) -> usize {
        let start = self.point(0, 0);
        if !are_small(start) {
            return 0;
        }
        let count = self.points.out[0].len() / N;
        let mut cells = RecentCells::<L, D>::new(L::key_of(start));
        let mut spent = 0;
        for done in 0..count {
            let (inside, mut results) = self.within(done, cells.current());
            let mut open = !inside;
            let mut round = 0;
            while let Some(lane) = open.first() {
                // Two cells alternate along their border.
                if round == 0 {
                    cells.swap();
                } else {
                    let next = self.point(done, lane);
                    if round == ROUNDS || spent > done + SPARE || !are_small(next) {
                        return done * N;
                    }
                    spent += cells.choose(L::key_of(next));
                }
                round += 1;
                spent += 1;
                let (inside, here) = self.within(done, cells.current());
                results = array(
                    #[inline(always)]
                    |k| results[k].replaced_at(inside, here[k]),
                );
                open = open & !inside;
            }
            self.store(done, results);
        }
        count * N
    }
}

/// The last cells that were met.
struct RecentCells<L: Lattice<D>, const D: usize> {
    keys: [Key; KNOWN],
    cells: [L::Cell; KNOWN],
    current: usize,
    /// The cell before the current one.
    last: usize,
    /// The place of the next new cell.
    next: usize,
}

impl<L: Lattice<D>, const D: usize> RecentCells<L, D> {
    #[inline(always)]
    fn new(key: Key) -> Self {
        RecentCells { keys: [key; KNOWN], cells: [L::cell(key); KNOWN], current: 0, last: 0, next: 1 }
    }

    #[inline(always)]
    fn current(&self) -> &L::Cell {
        &self.cells[self.current % KNOWN]
    }

    #[inline(always)]
    fn swap(&mut self) {
        (self.current, self.last) = (self.last, self.current);
    }

    /// Makes a cell the current one, and returns the cost.
    #[inline(always)]
    fn choose(&mut self, key: Key) -> usize {
        let found = self.keys.iter().position(|known| *known == key);
        let (at, cost) = match found {
            Some(at) => (at, 0),
            None => {
                // Neither of the two cells that alternate.
                while self.next == self.current || self.next == self.last {
                    self.next = (self.next + 1) % KNOWN;
                }
                (self.keys[self.next], self.cells[self.next]) = (key, L::cell(key));
                (self.next, CELL)
            }
        };
        (self.current, self.last) = (at, self.current);
        cost
    }
}
