//! Sharing lattice work between neighbours.
//!
//! Points that lie close together mostly lie in a few cells of a lattice, and what hashing tells about a cell costs more
//! than all the rest. So lanes are taken some hundreds at a time: where they are in few cells ([`crate::cells`]), each
//! cell's table is made once, sixteen cells in a vector, and the words of their cells are given to the lanes. Where they
//! are in many, all is computed lane by lane. The bits are the same either way.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]

use crate::cells::{self, Cells, MAX_CELLS};
use crate::field::Field;
use crate::simd::{Isa, Kernel};
use crate::unroll::{array, each};
use std::cell::RefCell;

/// Lanes that are looked at together.
const CHUNK: usize = 256;
/// Fewer lanes are not worth looking at.
const FEW: usize = 48;

/// Words that tell the cell of a point.
pub(crate) type Key = [u32; 5];
/// What is known of a cell.
pub(crate) type Table = [u32; 16];

/// Working memory of a thread. On cache lines, so that no vector lies on two of them.
#[repr(align(64))]
struct Room {
    keys: [[u32; CHUNK]; 5],
    index: [u32; CHUNK],
    scratch: [u32; CHUNK],
    tables: [[u32; MAX_CELLS]; 16],
    /// The table of each lane's cell, word by word.
    words: [[u32; CHUNK]; 16],
}

thread_local! {
    static ROOM: RefCell<Box<Room>> = RefCell::new(Box::new(Room {
        keys: [[0; CHUNK]; 5],
        index: [0; CHUNK],
        scratch: [0; CHUNK],
        tables: [[0; MAX_CELLS]; 16],
        words: [[0; CHUNK]; 16],
    }));
}

/// One value (`OUT` 1) or three at each point, as far as all slices go. Tells how many points it has done: where it
/// stops, they are in too many cells.
pub(crate) fn fill<F: Field, const D: usize, const OUT: usize>(
    isa: Isa,
    field: F,
    coords: [&[f32]; D],
    out: &mut [&mut [f32]; OUT],
) -> usize {
    let n = coords.iter().map(|c| c.len()).chain(out.iter().map(|o| o.len())).min().unwrap_or(0);
    ROOM.with(|room| {
        let Ok(mut room) = room.try_borrow_mut() else { return 0 };
        let mut start = 0;
        while n - start >= FEW {
            let here = start..n.min(start + CHUNK);
            let c = coords.map(|c| &c[here.clone()]);
            let mut o = out.each_mut().map(|o| &mut o[here.clone()]);
            if !chunk(isa, field, c, &mut o, &mut room) {
                break;
            }
            start = here.end;
        }
        start
    })
}

fn chunk<F: Field, const D: usize, const OUT: usize>(
    isa: Isa,
    field: F,
    coords: [&[f32]; D],
    out: &mut [&mut [f32]; OUT],
    room: &mut Room,
) -> bool {
    let n = coords.first().map_or(0, |c| c.len()).min(CHUNK);
    let Room { keys, index, scratch, tables, words } = room;
    isa.dispatch(Keys { field, coords, keys, n });
    index[..n].fill(u32::MAX);
    let key_lanes = keys.each_ref().map(|k| &k[..n]);
    let found = cells::find(isa, &key_lanes[..F::key_words::<D>()], &mut index[..n], &mut scratch[..n]);
    let Some(cells) = found else { return false };
    isa.dispatch(Tables::<F, D, OUT> { field, cells, keys, tables });
    for (words, table) in words.iter_mut().zip(tables.iter()).take(F::table_words::<D, OUT>()) {
        isa.look_up(table, &index[..n], &mut words[..n]);
    }
    isa.dispatch(Placed { field, coords, keys, words, out, n });
    true
}

/// Finds the key of each lane.
struct Keys<'a, F, const D: usize> {
    field: F,
    coords: [&'a [f32]; D],
    keys: &'a mut [[u32; CHUNK]; 5],
    n: usize,
}

impl<F: Field, const D: usize> Kernel for Keys<'_, F, D> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let n = self.n.min(CHUNK);
        let c = cut(self.coords, n);
        // Of known length, so that the loop has no checks.
        let keys = self.keys.each_mut().map(|k| &mut k[..n]);
        for i in 0..n {
            let key = self.field.key::<D>(point(c, i));
            each(
                F::key_words::<D>(),
                #[inline(always)]
                |j| keys[j][i] = key[j],
            );
        }
    }
}

/// Makes the tables of the cells, a cell in each lane.
struct Tables<'a, F, const D: usize, const OUT: usize> {
    field: F,
    cells: Cells,
    keys: &'a [[u32; CHUNK]; 5],
    tables: &'a mut [[u32; MAX_CELLS]; 16],
}

impl<F: Field, const D: usize, const OUT: usize> Kernel for Tables<'_, F, D, OUT> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let mut keys = [[0; MAX_CELLS]; 5];
        for (to, from) in keys.iter_mut().zip(self.keys) {
            for (word, lane) in to.iter_mut().zip(self.cells.lanes) {
                *word = from.get(lane).copied().unwrap_or(0);
            }
        }
        for cell in 0..MAX_CELLS {
            let mut key = [0; 5];
            each(
                F::key_words::<D>(),
                #[inline(always)]
                |j| key[j] = keys[j][cell],
            );
            let table = self.field.table::<D, OUT>(key);
            each(
                F::table_words::<D, OUT>(),
                #[inline(always)]
                |j| self.tables[j][cell] = table[j],
            );
        }
    }
}

/// Computes the values of lanes whose tables are known.
struct Placed<'a, 'o, F, const D: usize, const OUT: usize> {
    field: F,
    coords: [&'a [f32]; D],
    keys: &'a [[u32; CHUNK]; 5],
    words: &'a [[u32; CHUNK]; 16],
    out: &'a mut [&'o mut [f32]; OUT],
    n: usize,
}

impl<F: Field, const D: usize, const OUT: usize> Kernel for Placed<'_, '_, F, D, OUT> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Placed { field, coords, keys, words, out, n } = self;
        let n = out.iter().fold(n.min(CHUNK), |n, o| n.min(o.len()));
        let c = cut(coords, n);
        let (keys, words) = (keys.each_ref().map(|k| &k[..n]), words.each_ref().map(|w| &w[..n]));
        // Outputs are named one by one so that the compiler knows that they overlap with nothing.
        match &mut out[..] {
            [x] => {
                let x = &mut x[..n];
                for i in 0..n {
                    x[i] = placed::<F, D, OUT>(field, c, &keys, &words, i)[0];
                }
            }
            [x, y, z] => {
                let (x, y, z) = (&mut x[..n], &mut y[..n], &mut z[..n]);
                for i in 0..n {
                    let v = placed::<F, D, OUT>(field, c, &keys, &words, i);
                    x[i] = v[0];
                    y[i] = v[1 % OUT];
                    z[i] = v[2 % OUT];
                }
            }
            _ => {}
        }
    }
}

#[inline(always)]
fn placed<F: Field, const D: usize, const OUT: usize>(
    field: F,
    coords: [&[f32]; D],
    keys: &[&[u32]; 5],
    words: &[&[u32]; 16],
    i: usize,
) -> [f32; OUT] {
    let (mut key, mut table) = ([0; 5], [0; 16]);
    each(
        F::key_words::<D>(),
        #[inline(always)]
        |j| key[j] = keys[j][i],
    );
    each(
        F::table_words::<D, OUT>(),
        #[inline(always)]
        |j| table[j] = words[j][i],
    );
    field.placed::<D, OUT>(point(coords, i), key, table)
}

#[inline(always)]
fn cut<const D: usize>(coords: [&[f32]; D], n: usize) -> [&[f32]; D] {
    array(
        #[inline(always)]
        |a| &coords[a][..n],
    )
}

#[inline(always)]
fn point<const D: usize>(p: [&[f32]; D], i: usize) -> [f32; D] {
    array(
        #[inline(always)]
        |a| p[a][i],
    )
}
