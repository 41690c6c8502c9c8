//! Shares lattice work between neighbouring points.
//!
//! Points that lie close together are mostly in a few cells of a lattice, and hashing a cell costs more than
//! everything else. While each vector of points is in one or two cells, its values are computed with the data
//! of one cell for all lanes (`alone`). Otherwise some hundred lanes are taken at a time. If they are in few
//! cells ([`crate::cells`]), each cell's table is made once, sixteen cells in a vector, and lanes read their
//! words from registers. What remains is computed lane by lane. The bits are the same in all three ways. This
//! pays with AVX2 and AVX-512, whose registers can hold a table's word for all cells. Points with partials
//! share cells in the first way only.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]

mod alone;
mod perlin;
mod simplex;

use crate::cells::{self, Cells, MAX_CELLS};
use crate::range::Range;
use crate::unroll::{array, each};
use alone::{Alone, InOneCell};
use osl_simd::registers::{Floats, Registers, Words};
use osl_simd::{Isa, Kernel};
pub(crate) use perlin::Perlin;
pub(crate) use simplex::Simplex;
use std::cell::RefCell;
use std::marker::PhantomData;

/// Lanes that are examined together.
const CHUNK: usize = 256;
/// Fewer lanes than this are not worth examining.
const FEW: usize = 48;
/// Maximum number of words in a cell's key.
const KEYS: usize = 4;
/// Maximum number of words in a cell's table.
const WORDS: usize = 24;
/// How often in a row too many cells are met at once before a call looks for them only by chunks.
const TRIES: usize = 3;

/// The words that identify the cell of a point.
type Key = [u32; KEYS];
/// Precomputed data of a cell.
type Table = [u32; WORDS];

/// A field over a lattice whose points share the data of their cell.
pub(crate) trait Lattice<const D: usize>: Copy {
    /// Number of words of a key, and of a table.
    const SIZES: (usize, usize);
    /// The cells of points.
    fn key<R: Registers<N>, const N: usize>(r: R, p: [R::Floats; D]) -> [R::Words; KEYS];
    /// The table of a cell.
    fn table(key: Key) -> Table;
    /// The values at points of known cells, before scaling to the range. `word` returns a word of each lane's
    /// table.
    fn placed<R: Registers<N>, const N: usize>(
        r: R,
        p: [R::Floats; D],
        word: impl Fn(usize) -> R::Floats,
    ) -> R::Floats;

    /// The data of a cell that many lanes share.
    type Cell: Copy;
    /// The key of the cell of a point.
    fn key_of(p: [f32; D]) -> Key;
    /// The data of a cell.
    fn cell(key: Key) -> Self::Cell;
}

/// Working memory of a thread, aligned to cache lines so that no vector crosses one.
#[repr(align(64))]
struct Room {
    keys: [[u32; CHUNK]; KEYS],
    index: [u32; CHUNK],
    scratch: [u32; CHUNK],
    tables: [[f32; MAX_CELLS]; WORDS],
}

thread_local! {
    static ROOM: RefCell<Box<Room>> = RefCell::new(Box::new(Room {
        keys: [[0; CHUNK]; KEYS],
        index: [0; CHUNK],
        scratch: [0; CHUNK],
        tables: [[0.0; MAX_CELLS]; WORDS],
    }));
}

/// Computes a value at each point, up to the length of the shortest slice. Returns the number of points done.
/// It stops where the remaining points are too few, are in too many cells, or lie where register arithmetic
/// would give other bits.
pub(crate) fn fill<L: InOneCell<D, 1>, const D: usize>(
    isa: Isa,
    range: Range,
    coords: [&[f32]; D],
    out: &mut [f32],
) -> usize {
    match (isa.wide(), isa.narrow()) {
        (Some(r), _) => fill_with::<L, _, 16, D>(isa, r, range, coords, out),
        (_, Some(r)) => fill_with::<L, _, 8, D>(isa, r, range, coords, out),
        _ => 0,
    }
}

fn fill_with<L: InOneCell<D, 1>, R: Registers<N>, const N: usize, const D: usize>(
    isa: Isa,
    registers: R,
    range: Range,
    coords: [&[f32]; D],
    out: &mut [f32],
) -> usize {
    let n = coords.iter().map(|c| c.len()).min().unwrap_or(0).min(out.len()) / N * N;
    if n < FEW {
        return 0;
    }
    ROOM.with(|room| {
        let Ok(mut room) = room.try_borrow_mut() else { return 0 };
        let is_scattered = alone::are_scattered::<L, N, D>(coords.map(|c| &c[..n]));
        let (mut start, mut tries) = (0, if is_scattered { 0 } else { TRIES });
        while start < n {
            if tries > 0 {
                let coords = coords.map(|c| &c[start..n]);
                let out = [&mut out[start..n]];
                let call = Points { registers, range, coords: [coords], out, lattice: PhantomData };
                let done = registers.dispatch(Alone::<L, R, N, D, 1>::new(call));
                tries = if done >= CHUNK { TRIES } else { tries - 1 };
                start += done;
                if start == n {
                    break;
                }
            }
            let end = ((start / CHUNK + 1) * CHUNK).min(n);
            let coords = coords.map(|c| &c[start..end]);
            let out = [&mut out[start..end]];
            let call = Points { registers, range, coords: [coords], out, lattice: PhantomData };
            if !chunk::<L, R, N, D>(isa, call, &mut room) {
                break;
            }
            start = end;
        }
        start
    })
}

/// Computes a value with its two partials at each point, as long as vectors of points are in few cells. The
/// coordinates are values, then partials in the first direction, then in the second. Returns the number of
/// points done.
pub(crate) fn fill_dual<L: InOneCell<D, 3>, const D: usize>(
    isa: Isa,
    range: Range,
    coords: [[&[f32]; D]; 3],
    out: [&mut [f32]; 3],
) -> usize {
    match (isa.wide(), isa.narrow()) {
        (Some(r), _) => fill_dual_with::<L, _, 16, D>(r, range, coords, out),
        (_, Some(r)) => fill_dual_with::<L, _, 8, D>(r, range, coords, out),
        _ => 0,
    }
}

fn fill_dual_with<L: InOneCell<D, 3>, R: Registers<N>, const N: usize, const D: usize>(
    registers: R,
    range: Range,
    coords: [[&[f32]; D]; 3],
    out: [&mut [f32]; 3],
) -> usize {
    let lengths = coords.iter().flatten().map(|c| c.len()).chain(out.iter().map(|o| o.len()));
    let n = lengths.min().unwrap_or(0) / N * N;
    if n < FEW {
        return 0;
    }
    let coords = coords.map(|part| part.map(|c| &c[..n]));
    if alone::are_scattered::<L, N, D>(coords[0]) {
        return 0;
    }
    let out = out.map(|o| &mut o[..n]);
    registers.dispatch(Alone::new(Points { registers, range, coords, out, lattice: PhantomData::<L> }))
}

/// Points whose number is a multiple of `N`: `S` sets of coordinates and results, the first for the values
/// and the others for their partials.
struct Points<'a, L, R, const D: usize, const S: usize> {
    registers: R,
    range: Range,
    coords: [[&'a [f32]; D]; S],
    out: [&'a mut [f32]; S],
    lattice: PhantomData<L>,
}

fn chunk<L: Lattice<D>, R: Registers<N>, const N: usize, const D: usize>(
    isa: Isa,
    call: Points<'_, L, R, D, 1>,
    room: &mut Room,
) -> bool {
    let n = call.out[0].len().min(CHUNK);
    let Room { keys, index, scratch, tables } = room;
    let Points { registers, coords: [coords], lattice, .. } = call;
    if !registers.dispatch(Keys::<L, R, N, D> { registers, coords, keys, lattice }) {
        return false;
    }
    index[..n].fill(u32::MAX);
    let key_lanes = keys.each_ref().map(|k| &k[..n]);
    let found = cells::find(isa, &key_lanes[..L::SIZES.0], &mut index[..n], &mut scratch[..n]);
    let Some(cells) = found else { return false };
    registers.dispatch(Tables::<L, D> { cells, keys, tables, lattice });
    if N == 8 && cells.count <= N {
        registers.dispatch(Placed::<L, R, N, D, true> { points: call, index, tables });
    } else {
        registers.dispatch(Placed::<L, R, N, D, false> { points: call, index, tables });
    }
    true
}

/// Computes the key of each lane. False if coordinates are so large that nearby floats are no longer
/// fractional, or if they are −0 or so close below it that their fraction is 1, since the signs of zeros
/// would then differ.
struct Keys<'a, L, R, const N: usize, const D: usize> {
    registers: R,
    coords: [&'a [f32]; D],
    keys: &'a mut [[u32; CHUNK]; KEYS],
    lattice: PhantomData<L>,
}

impl<L: Lattice<D>, R: Registers<N>, const N: usize, const D: usize> Kernel for Keys<'_, L, R, N, D> {
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        const LARGE: u32 = 1_048_576.0_f32.to_bits();
        const BELOW: u32 = 0x3300_0000;
        let mut odd = false;
        for c in self.coords {
            for x in c {
                let bits = x.to_bits();
                odd |= (bits & 0x7fff_ffff >= LARGE) | (bits.wrapping_sub(0x8000_0000) <= BELOW);
            }
        }
        if odd {
            return false;
        }
        let blocks: [&[[f32; N]]; D] = array(
            #[inline(always)]
            |a| self.coords[a].as_chunks().0,
        );
        let keys = self.keys.each_mut().map(|k| k.as_chunks_mut::<N>().0);
        for i in 0..blocks[0].len().min(CHUNK / N) {
            let p = array(
                #[inline(always)]
                |a| self.registers.floats(&blocks[a][i]),
            );
            let key = L::key(self.registers, p);
            each(
                L::SIZES.0,
                #[inline(always)]
                |j| key[j].store(&mut keys[j][i]),
            );
        }
        true
    }
}

/// Makes the tables of the cells, one cell per lane.
struct Tables<'a, L, const D: usize> {
    cells: Cells,
    keys: &'a [[u32; CHUNK]; KEYS],
    tables: &'a mut [[f32; MAX_CELLS]; WORDS],
    lattice: PhantomData<L>,
}

impl<L: Lattice<D>, const D: usize> Kernel for Tables<'_, L, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let mut keys = [[0; MAX_CELLS]; KEYS];
        for (to, from) in keys.iter_mut().zip(self.keys).take(L::SIZES.0) {
            for (word, lane) in to.iter_mut().zip(self.cells.lanes) {
                *word = from.get(lane).copied().unwrap_or(0);
            }
        }
        for cell in 0..MAX_CELLS {
            let table = L::table(array(
                #[inline(always)]
                |j| keys[j][cell],
            ));
            for j in 0..L::SIZES.1 {
                self.tables[j][cell] = f32::from_bits(table[j]);
            }
        }
    }
}

/// Computes the values of lanes whose tables are known. `LOW`: there are at most eight tables.
struct Placed<'a, L, R, const N: usize, const D: usize, const LOW: bool> {
    points: Points<'a, L, R, D, 1>,
    index: &'a [u32; CHUNK],
    tables: &'a [[f32; MAX_CELLS]; WORDS],
}

impl<L: Lattice<D>, R: Registers<N>, const N: usize, const D: usize, const LOW: bool> Kernel
    for Placed<'_, L, R, N, D, LOW>
{
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Points { registers: r, range, coords: [coords], out: [out], .. } = self.points;
        let blocks: [&[[f32; N]]; D] = array(
            #[inline(always)]
            |a| coords[a].as_chunks().0,
        );
        let index = self.index.as_chunks::<N>().0;
        let (shift, factor) = (r.all(range.shift), r.all(range.factor));
        for (i, out) in out.as_chunks_mut::<N>().0.iter_mut().enumerate() {
            let p = array(
                #[inline(always)]
                |a| r.floats(&blocks[a][i]),
            );
            let cell = r.words(&index[i]);
            let value = L::placed(
                r,
                p,
                #[inline(always)]
                |j| {
                    let table = &self.tables[j];
                    if LOW { cell.pick_low(table) } else { cell.pick(table) }
                },
            );
            ((value + shift) * factor).store(out);
        }
    }
}
