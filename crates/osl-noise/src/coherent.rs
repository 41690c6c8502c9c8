//! Shares lattice work between neighbouring points.
//!
//! Points that lie close together are mostly in a few cells of a lattice, and hashing a cell costs more than
//! everything else. So some hundred lanes are taken at a time. If they are in few cells ([`crate::cells`]),
//! each cell's table is made once, sixteen cells in a vector, and lanes read their words from registers.
//! Otherwise everything is computed lane by lane. The bits are the same either way. This pays only with
//! AVX-512, whose registers can hold a table's word for all cells.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]

mod perlin;
mod simplex;

use crate::cells::{self, Cells, MAX_CELLS};
use crate::range::Range;
use crate::unroll::{array, each};
use osl_simd::wide::{Floats, Proof, Words};
use osl_simd::{Isa, Kernel};
pub(crate) use perlin::Perlin;
pub(crate) use simplex::Simplex;
use std::cell::RefCell;

/// Lanes that are examined together.
const CHUNK: usize = 256;
/// Fewer lanes than this are not worth examining.
const FEW: usize = 48;
/// Lanes per register.
const WIDE: usize = 16;
/// Maximum number of words in a cell's key.
const KEYS: usize = 4;
/// Maximum number of words in a cell's table.
const WORDS: usize = 24;

/// The words that identify the cell of a point.
type Key = [u32; KEYS];
/// Precomputed data of a cell.
type Table = [u32; WORDS];

/// A field over a lattice whose points share the data of their cell.
pub(crate) trait Lattice<const D: usize>: Copy {
    /// Number of words of a key, and of a table.
    const SIZES: (usize, usize);
    /// The cells of points.
    fn key(proof: Proof, p: [Floats; D]) -> [Words; KEYS];
    /// The table of a cell.
    fn table(key: Key) -> Table;
    /// The values at points of known cells, before scaling to the range. `word` returns a word of each lane's
    /// table.
    fn placed(proof: Proof, p: [Floats; D], word: impl Fn(usize) -> Floats) -> Floats;
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
pub(crate) fn fill<L: Lattice<D>, const D: usize>(
    isa: Isa,
    range: Range,
    coords: [&[f32]; D],
    out: &mut [f32],
) -> usize {
    let Some(proof) = isa.wide() else { return 0 };
    let n = coords.iter().map(|c| c.len()).min().unwrap_or(0).min(out.len());
    ROOM.with(|room| {
        let Ok(mut room) = room.try_borrow_mut() else { return 0 };
        let mut start = 0;
        while n - start >= FEW {
            let end = start + (n - start).min(CHUNK) / WIDE * WIDE;
            let call = Chunk::<L, D> {
                proof,
                range,
                coords: coords.map(|c| &c[start..end]),
                out: &mut out[start..end],
                lattice: std::marker::PhantomData,
            };
            if !chunk(isa, call, &mut room) {
                break;
            }
            start = end;
        }
        start
    })
}

/// A few hundred points.
struct Chunk<'a, L, const D: usize> {
    proof: Proof,
    range: Range,
    coords: [&'a [f32]; D],
    out: &'a mut [f32],
    lattice: std::marker::PhantomData<L>,
}

fn chunk<L: Lattice<D>, const D: usize>(isa: Isa, call: Chunk<'_, L, D>, room: &mut Room) -> bool {
    let n = call.out.len().min(CHUNK);
    let Room { keys, index, scratch, tables } = room;
    let Chunk { proof, range, coords, out, .. } = call;
    if !isa.dispatch(Keys::<L, D> { proof, coords, keys, lattice: call.lattice }) {
        return false;
    }
    index[..n].fill(u32::MAX);
    let key_lanes = keys.each_ref().map(|k| &k[..n]);
    let found = cells::find(isa, &key_lanes[..L::SIZES.0], &mut index[..n], &mut scratch[..n]);
    let Some(cells) = found else { return false };
    isa.dispatch(Tables::<L, D> { cells, keys, tables, lattice: call.lattice });
    isa.dispatch(Placed::<L, D> { proof, range, coords, index, tables, out, lattice: call.lattice });
    true
}

/// Computes the key of each lane. False if coordinates are so large that nearby floats are no longer
/// fractional, or if they are −0 or so close below it that their fraction is 1, since the signs of zeros
/// would then differ.
struct Keys<'a, L, const D: usize> {
    proof: Proof,
    coords: [&'a [f32]; D],
    keys: &'a mut [[u32; CHUNK]; KEYS],
    lattice: std::marker::PhantomData<L>,
}

impl<L: Lattice<D>, const D: usize> Kernel for Keys<'_, L, D> {
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
        let blocks: [&[[f32; WIDE]]; D] = array(
            #[inline(always)]
            |a| self.coords[a].as_chunks().0,
        );
        let keys = self.keys.each_mut().map(|k| k.as_chunks_mut::<WIDE>().0);
        for i in 0..blocks[0].len().min(CHUNK / WIDE) {
            let p = array(
                #[inline(always)]
                |a| self.proof.floats(&blocks[a][i]),
            );
            let key = L::key(self.proof, p);
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
    lattice: std::marker::PhantomData<L>,
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

/// Computes the values of lanes whose tables are known.
struct Placed<'a, L, const D: usize> {
    proof: Proof,
    range: Range,
    coords: [&'a [f32]; D],
    index: &'a [u32; CHUNK],
    tables: &'a [[f32; MAX_CELLS]; WORDS],
    out: &'a mut [f32],
    lattice: std::marker::PhantomData<L>,
}

impl<L: Lattice<D>, const D: usize> Kernel for Placed<'_, L, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let proof = self.proof;
        let blocks: [&[[f32; WIDE]]; D] = array(
            #[inline(always)]
            |a| self.coords[a].as_chunks().0,
        );
        let index = self.index.as_chunks::<WIDE>().0;
        let (shift, factor) = (proof.all(self.range.shift), proof.all(self.range.factor));
        for (i, out) in self.out.as_chunks_mut::<WIDE>().0.iter_mut().enumerate() {
            let p = array(
                #[inline(always)]
                |a| proof.floats(&blocks[a][i]),
            );
            let cell = proof.words(&index[i]);
            let value = L::placed(
                proof,
                p,
                #[inline(always)]
                |j| cell.pick(proof.floats(&self.tables[j])),
            );
            ((value + shift) * factor).store(out);
        }
    }
}
