//! Vectors of points in one cell or a few: all lanes are computed with the data of one cell, then again with
//! those of the next, until each lane has its own.

use super::{Key, Lattice, Points};
use crate::unroll::array;
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

/// Computes points from the first one on, up to where vectors are in too many cells. Returns the number of
/// points done.
pub(super) struct Alone<'a, L, R, const N: usize, const D: usize>(pub(super) Points<'a, L, R, D>);

/// Number of cells that are remembered.
const KNOWN: usize = 4;
/// A vector may be computed this often again; more cells at once cost less by tables.
const ROUNDS: usize = 3;
/// The cost of a cell's data, in computations of a vector.
const CELL: usize = 2;
/// Further computations that are never too many. From there on, one for each vector is enough.
const SPARE: usize = 8;

impl<L: Lattice<D>, R: Registers<N>, const N: usize, const D: usize> Kernel for Alone<'_, L, R, N, D> {
    type Output = usize;
    #[inline(always)]
    fn run(self) -> usize {
        let Points { registers: r, range, coords, out, .. } = self.0;
        let blocks: [&[[f32; N]]; D] = array(
            #[inline(always)]
            |a| coords[a].as_chunks().0,
        );
        let out = out.as_chunks_mut::<N>().0;
        let (shift, factor) = (r.all(range.shift), r.all(range.factor));
        let mut scratch = Scratch([[0.0; N]; 16]);
        let point = |i: usize, lane: usize| -> [f32; D] {
            array(
                #[inline(always)]
                |a| blocks[a].get(i).and_then(|block| block.get(lane)).copied().unwrap_or(f32::NAN),
            )
        };
        let start = point(0, 0);
        if !are_small(start) {
            return 0;
        }
        let mut cells = Known::<L, D>::new(L::key_of(start));
        let mut spent = 0;
        for (done, out) in out.iter_mut().enumerate() {
            let p = array(
                #[inline(always)]
                |a| r.floats(&blocks[a][done]),
            );
            let (inside, mut value) = L::within(r, p, cells.current(), &mut scratch);
            let mut open = !inside;
            let mut round = 0;
            while let Some(lane) = open.first() {
                // Two cells alternate along their border.
                if round == 0 {
                    cells.swap();
                } else {
                    let next = point(done, lane);
                    if round == ROUNDS || spent > done + SPARE || !are_small(next) {
                        return done * N;
                    }
                    spent += cells.choose(L::key_of(next));
                }
                round += 1;
                spent += 1;
                let (inside, here) = L::within(r, p, cells.current(), &mut scratch);
                value = value.replaced_at(inside, here);
                open = open & !inside;
            }
            ((value + shift) * factor).store(out);
        }
        out.len() * N
    }
}

/// The last cells that were met.
struct Known<L: Lattice<D>, const D: usize> {
    keys: [Key; KNOWN],
    cells: [L::Cell; KNOWN],
    current: usize,
    /// The cell before the current one.
    last: usize,
    /// The place of the next new cell.
    next: usize,
}

impl<L: Lattice<D>, const D: usize> Known<L, D> {
    #[inline(always)]
    fn new(key: Key) -> Self {
        Known { keys: [key; KNOWN], cells: [L::cell(key); KNOWN], current: 0, last: 0, next: 1 }
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
