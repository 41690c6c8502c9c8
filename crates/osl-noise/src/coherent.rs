//! Sharing lattice work between neighbours.
//!
//! Points that lie close together mostly lie in the same cell of a lattice, and what hashing tells about a cell costs
//! more than all the rest. So lanes are taken sixteen at a time: where the sixteen are in one cell, they share its
//! table; and the tables of sixteen such groups are made together, a vector at a time. Groups that straddle cells
//! are computed lane by lane. The bits are the same either way.

#![expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]

use crate::field::Field;
use crate::unroll::{array, each};

/// Lanes that may share a table, and groups whose tables are made together.
const LANES: usize = 16;

/// Words that tell the cell of a point.
pub(crate) type Key = [u32; 5];
/// What is known of a cell.
pub(crate) type Table = [u32; 16];

/// One value (`OUT` 1) or three at each point. All slices have the same length.
#[inline(always)]
pub(crate) fn fill<F: Field, const D: usize, const OUT: usize>(
    field: F,
    coords: [&[f32]; D],
    mut out: [&mut [f32]; OUT],
) {
    let n = coords[0].len();
    let mut start = 0;
    while start + LANES <= n {
        let groups = ((n - start) / LANES).min(LANES);
        let (reps, same) = representatives::<F, D>(field, coords, start, groups);
        let mut tables = [[0_u32; LANES]; 16];
        for g in 0..LANES {
            let mut key = [0; 5];
            each(
                F::key_words::<D>(),
                #[inline(always)]
                |j| key[j] = reps[j][g],
            );
            let table = field.table::<D, OUT>(key);
            each(
                F::table_words::<D, OUT>(),
                #[inline(always)]
                |j| tables[j][g] = table[j],
            );
        }
        for g in 0..groups {
            let base = start + g * LANES;
            let p = chunk::<D>(coords, base);
            let mut values = [[0.0; LANES]; OUT];
            if same[g] {
                let (mut key, mut table) = ([0; 5], [0; 16]);
                each(
                    F::key_words::<D>(),
                    #[inline(always)]
                    |j| key[j] = reps[j][g],
                );
                each(
                    F::table_words::<D, OUT>(),
                    #[inline(always)]
                    |j| table[j] = tables[j][g],
                );
                lanes(
                    &mut values,
                    #[inline(always)]
                    |i| field.placed::<D, OUT>(point(p, i), key, table),
                );
            } else {
                lanes(
                    &mut values,
                    #[inline(always)]
                    |i| field.each::<D, OUT>(point(p, i)),
                );
            }
            for (out, values) in out.iter_mut().zip(values) {
                if let Some(to) = out.get_mut(base..base + LANES) {
                    to.copy_from_slice(&values);
                }
            }
        }
        start += groups * LANES;
    }
    for i in start..n {
        let value = field.each::<D, OUT>(array(
            #[inline(always)]
            |a| coords[a][i],
        ));
        for (out, value) in out.iter_mut().zip(value) {
            out[i] = value;
        }
    }
}

/// The cell of the first lane of each group, and whether the others share it.
#[inline(always)]
fn representatives<F: Field, const D: usize>(
    field: F,
    coords: [&[f32]; D],
    start: usize,
    groups: usize,
) -> ([[u32; LANES]; 5], [bool; LANES]) {
    let (mut reps, mut same) = ([[0; LANES]; 5], [false; LANES]);
    for g in 0..groups {
        let p = chunk::<D>(coords, start + g * LANES);
        let mut keys = [[0_u32; LANES]; 5];
        for i in 0..LANES {
            let key = field.key::<D>(point(p, i));
            each(
                F::key_words::<D>(),
                #[inline(always)]
                |j| keys[j][i] = key[j],
            );
        }
        let mut differs = 0;
        each(
            F::key_words::<D>(),
            #[inline(always)]
            |j| {
                for i in 0..LANES {
                    differs |= keys[j][i] ^ keys[j][0];
                }
                reps[j][g] = keys[j][0];
            },
        );
        same[g] = differs == 0;
    }
    (reps, same)
}

/// The lanes of a group. Empty slices become zeros; the caller has counted.
#[inline(always)]
fn chunk<const D: usize>(coords: [&[f32]; D], base: usize) -> [&[f32; LANES]; D] {
    array(
        #[inline(always)]
        |a| coords[a].get(base..base + LANES).and_then(|c| c.try_into().ok()).unwrap_or(&[0.0; LANES]),
    )
}

#[inline(always)]
fn point<const D: usize>(p: [&[f32; LANES]; D], i: usize) -> [f32; D] {
    array(
        #[inline(always)]
        |a| p[a][i],
    )
}

#[inline(always)]
fn lanes<const OUT: usize>(out: &mut [[f32; LANES]; OUT], f: impl Fn(usize) -> [f32; OUT]) {
    for i in 0..LANES {
        let v = f(i);
        each(
            OUT,
            #[inline(always)]
            |c| out[c][i] = v[c],
        );
    }
}
