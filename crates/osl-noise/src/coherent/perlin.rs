//! Gradient noise at points of known cells.
//!
//! A table holds the gradients of a cell's corners as factors of the offset from the corner to the point: ±1,
//! ±2, or a zero whose product with the offset is −0. Adding −0 leaves any number unchanged.

use super::{Key, Lattice, Table};
use crate::perlin::{SCALE, corner_hashes, factors};
use crate::unroll::{array, each};
use osl_simd::wide::{Floats, Proof, Words};

/// The lattice of unit cubes.
#[derive(Clone, Copy)]
pub(crate) struct Perlin;

impl<const D: usize> Lattice<D> for Perlin {
    const SIZES: (usize, usize) = (D, D << D);

    #[inline(always)]
    fn key(proof: Proof, p: [Floats; D]) -> [Words; 4] {
        let mut key = [proof.each(0); 4];
        each(
            D,
            #[inline(always)]
            |a| key[a] = p[a].floor().whole(),
        );
        key
    }

    #[inline(always)]
    fn table(key: Key) -> Table {
        let hashes = corner_hashes::<D>(array(
            #[inline(always)]
            |a| key[a],
        ));
        let mut table = [0; 24];
        each(
            1 << D,
            #[inline(always)]
            |corner| {
                let factors = factors::<D>(hashes[corner], corner);
                each(
                    D,
                    #[inline(always)]
                    |a| table[corner * D + a] = factors[a].to_bits(),
                );
            },
        );
        table
    }

    #[inline(always)]
    fn placed(proof: Proof, p: [Floats; D], word: impl Fn(usize) -> Floats) -> Floats {
        let one = proof.all(1.0);
        let near: [Floats; D] = array(
            #[inline(always)]
            |a| p[a] - p[a].floor(),
        );
        let far: [Floats; D] = array(
            #[inline(always)]
            |a| near[a] - one,
        );
        let mut g = [one; 8];
        each(
            1 << D,
            #[inline(always)]
            |corner| {
                each(
                    D,
                    #[inline(always)]
                    |a| {
                        let way = if (corner >> a) & 1 == 1 { far[a] } else { near[a] };
                        let term = word(corner * D + a) * way;
                        g[corner] = if a == 0 { term } else { g[corner] + term };
                    },
                );
            },
        );
        let order = if D == 3 { [2, 0, 1] } else { [0, 1, 1] };
        let mut done = 0;
        each(
            D,
            #[inline(always)]
            |step| {
                let axis = order[step];
                let t = near[axis];
                let weight = t * t * t * (t * (t * proof.all(6.0) - proof.all(15.0)) + proof.all(10.0));
                let rest = one - weight;
                each(
                    1 << D,
                    #[inline(always)]
                    |corner| {
                        if corner & (done | 1 << axis) == 0 {
                            g[corner] = g[corner] * rest + g[corner | 1 << axis] * weight;
                        }
                    },
                );
                done |= 1 << axis;
            },
        );
        g[0] * proof.all(SCALE[D])
    }
}
