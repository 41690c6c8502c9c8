//! Gradient noise at points of known cells.
//!
//! A table holds the gradients of a cell's corners as factors of the offset from the corner to the point: ±1,
//! ±2, or a zero whose product with the offset is −0. Adding −0 leaves any number unchanged.

use super::alone::Scratch;
use super::{Key, Lattice, Table};
use crate::float::Float;
use crate::perlin::{SCALE, corner_hashes, factors, terms};
use crate::unroll::{array, each};
use osl_simd::registers::{Floats, Registers};

/// The lattice of unit cubes.
#[derive(Clone, Copy)]
pub(crate) struct Perlin;

/// A cube that many lanes share.
#[derive(Clone, Copy)]
pub(crate) struct Shared<const D: usize> {
    pub(super) base: [f32; D],
    /// The two terms of each corner. In three dimensions, they are places in the scratch memory; in two
    /// dimensions, factors of the offsets.
    pub(super) terms: [[u32; 2]; 8],
}

/// The order of the axes in which three dimensions are blended.
pub(super) const ORDER: [usize; 3] = [2, 0, 1];

impl<const D: usize> Lattice<D> for Perlin {
    const SIZES: (usize, usize) = (D, D << D);

    #[inline(always)]
    fn key<R: Registers<N>, const N: usize>(r: R, p: [R::Floats; D]) -> [R::Words; 4] {
        let mut key = [r.each(0); 4];
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
    fn placed<R: Registers<N>, const N: usize>(
        r: R,
        p: [R::Floats; D],
        word: impl Fn(usize) -> R::Floats,
    ) -> R::Floats {
        let one = r.all(1.0);
        let near: [R::Floats; D] = array(
            #[inline(always)]
            |a| p[a] - p[a].floor(),
        );
        let far: [R::Floats; D] = array(
            #[inline(always)]
            |a| near[a] - one,
        );
        blend(
            r,
            near,
            #[inline(always)]
            |corner| {
                let mut sum = one;
                each(
                    D,
                    #[inline(always)]
                    |a| {
                        let way = if (corner >> a) & 1 == 1 { far[a] } else { near[a] };
                        let term = word(corner * D + a) * way;
                        sum = if a == 0 { term } else { sum + term };
                    },
                );
                sum
            },
        )
    }

    type Cell = Shared<D>;

    #[inline(always)]
    fn key_of(p: [f32; D]) -> Key {
        let mut key = [0; 4];
        each(
            D,
            #[inline(always)]
            |a| key[a] = p[a].cell().0 as u32,
        );
        key
    }

    #[inline(always)]
    fn cell(key: Key) -> Shared<D> {
        let cell: [u32; D] = array(
            #[inline(always)]
            |a| key[a],
        );
        let hashes = corner_hashes::<D>(cell);
        let mut shared = Shared { base: cell.map(|i| i as i32 as f32), terms: [[0; 2]; 8] };
        for corner in 0..1 << D {
            shared.terms[corner] = match D {
                2 => factors::<2>(hashes[corner], corner).map(f32::to_bits),
                _ => terms(hashes[corner])
                    .map(|(axis, negative)| place(corner, axis as usize, negative as usize) as u32),
            };
        }
        shared
    }

    #[inline(always)]
    fn within<R: Registers<N>, const N: usize>(
        r: R,
        p: [R::Floats; D],
        cell: &Shared<D>,
        scratch: &mut Scratch<N>,
    ) -> (R::Marks, R::Floats) {
        let one = r.all(1.0);
        let near: [R::Floats; D] = array(
            #[inline(always)]
            |a| p[a] - r.all(cell.base[a]),
        );
        let far: [R::Floats; D] = array(
            #[inline(always)]
            |a| near[a] - one,
        );
        let mut top = near[0];
        each(
            D,
            #[inline(always)]
            |a| {
                top = top.larger_word(near[a]);
                if D == 3 {
                    for (corner, way) in [(0, near[a]), (7, far[a])] {
                        way.store(scratch.at_mut(place(corner, a, 0)));
                        way.negative().store(scratch.at_mut(place(corner, a, 1)));
                    }
                }
            },
        );
        let value = blend(
            r,
            near,
            #[inline(always)]
            |corner| {
                let [first, second] = cell.terms[corner];
                if D == 3 {
                    let term = |at: u32| r.floats(scratch.at(at as usize));
                    return term(first) + term(second);
                }
                let way = |a: usize| if (corner >> a) & 1 == 1 { far[a] } else { near[a] };
                r.all(f32::from_bits(first)) * way(0) + r.all(f32::from_bits(second)) * way(1)
            },
        );
        (top.are_fractions(), value)
    }
}

/// Where the offset from a corner along an axis is in the scratch memory, or its negative.
#[inline(always)]
pub(super) fn place(corner: usize, axis: usize, negative: usize) -> usize {
    axis + 3 * ((corner >> axis) & 1) + 6 * negative
}

/// The value from the offsets to the near corner and the gradients' products at the corners.
#[inline(always)]
fn blend<R: Registers<N>, const N: usize, const D: usize>(
    r: R,
    near: [R::Floats; D],
    mut product: impl FnMut(usize) -> R::Floats,
) -> R::Floats {
    let one = r.all(1.0);
    let mut g = [one; 8];
    each(
        1 << D,
        #[inline(always)]
        |corner| g[corner] = product(corner),
    );
    let order = if D == 3 { ORDER } else { [0, 1, 1] };
    let mut done = 0;
    each(
        D,
        #[inline(always)]
        |step| {
            let axis = order[step];
            let t = near[axis];
            let weight = t * t * t * (t * (t * r.all(6.0) - r.all(15.0)) + r.all(10.0));
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
    g[0] * r.all(SCALE[D])
}
