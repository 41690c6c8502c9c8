//! Gradient noise at points of known cells.
//!
//! A table holds the gradients of a cell's corners as factors of the offset from the corner to the point: ±1,
//! ±2, or a zero whose product with the offset is −0. Adding −0 leaves any number unchanged. The formula is
//! that of [`crate::perlin`], on a [`Jet`] in place of a number.

use super::alone::{InOneCell, Scratch};
use super::{Key, Lattice, Table};
use crate::float::Float;
use crate::number::Ring;
use crate::perlin::{blend, corner_hashes, factors, terms, weights};
use crate::unroll::{array, each};
use osl_simd::registers::{Floats, Registers};

/// The lattice of unit cubes.
#[derive(Clone, Copy)]
pub(crate) struct Perlin;

/// A cube that many lanes share.
#[derive(Clone, Copy)]
pub(crate) struct Shared<const D: usize> {
    base: [f32; D],
    /// The two terms of each corner. In three dimensions, they are places in the scratch memory; in two
    /// dimensions, factors of the offsets.
    terms: [[u32; 2]; 8],
}

/// A register of numbers, each perhaps with partials: the values, then the partials in each direction.
#[derive(Clone, Copy)]
struct Jet<R: Registers<N>, const N: usize, const S: usize> {
    registers: R,
    parts: [R::Floats; S],
}

impl<R: Registers<N>, const N: usize, const S: usize> Jet<R, N, S> {
    #[inline(always)]
    fn from(registers: R, part: impl FnMut(usize) -> R::Floats) -> Self {
        Jet { registers, parts: array(part) }
    }
}

impl<R: Registers<N>, const N: usize, const S: usize> Ring for Jet<R, N, S> {
    const PARTS: usize = S;
    #[inline(always)]
    fn like(self, value: f32) -> Self {
        Jet::from(
            self.registers,
            #[inline(always)]
            |k| self.registers.all(if k == 0 { value } else { 0.0 }),
        )
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Jet::from(
            self.registers,
            #[inline(always)]
            |k| self.parts[k] + other.parts[k],
        )
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Jet::from(
            self.registers,
            #[inline(always)]
            |k| self.parts[k] - other.parts[k],
        )
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.parts, other.parts);
        Jet::from(
            self.registers,
            #[inline(always)]
            |k| if k == 0 { a[0] * b[0] } else { a[0] * b[k] + a[k] * b[0] },
        )
    }
    #[inline(always)]
    fn times(self, factor: f32) -> Self {
        let factor = self.registers.all(factor);
        Jet::from(
            self.registers,
            #[inline(always)]
            |k| self.parts[k] * factor,
        )
    }
}

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
        let weight = weights::<_, D>(array(
            #[inline(always)]
            |a| Jet { registers: r, parts: [near[a]] },
        ));
        let mut g = [weight[0]; 16];
        each(
            1 << D,
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
                g[corner] = Jet { registers: r, parts: [sum] };
            },
        );
        blend(g, &weight).parts[0]
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
                _ => {
                    let [first, second, _] = terms::<usize, 3>(hashes[corner], [0, 1, 2]);
                    let is_negative = |bit: u32| usize::from(hashes[corner] & bit != 0);
                    [place(corner, first, is_negative(1)), place(corner, second, is_negative(2))]
                        .map(|place| place as u32)
                }
            };
        }
        shared
    }
}

impl<const D: usize, const S: usize> InOneCell<D, S> for Perlin {
    #[inline(always)]
    fn within<R: Registers<N>, const N: usize>(
        r: R,
        p: [[R::Floats; D]; S],
        cell: &Shared<D>,
        scratch: &mut [Scratch<N>; S],
    ) -> (R::Marks, [R::Floats; S]) {
        let one = r.all(1.0);
        let near: [Jet<R, N, S>; D] = array(
            #[inline(always)]
            |a| {
                Jet::from(
                    r,
                    #[inline(always)]
                    |k| if k == 0 { p[0][a] - r.all(cell.base[a]) } else { p[k][a] },
                )
            },
        );
        let far: [[R::Floats; S]; D] = array(
            #[inline(always)]
            |a| {
                array(
                    #[inline(always)]
                    |k| if k == 0 { near[a].parts[0] - one } else { near[a].parts[k] },
                )
            },
        );
        let mut top = near[0].parts[0];
        each(
            D,
            #[inline(always)]
            |a| {
                top = top.larger_word(near[a].parts[0]);
                if D == 3 {
                    each(
                        S,
                        #[inline(always)]
                        |k| {
                            for (corner, way) in [(0, near[a].parts[k]), (7, far[a][k])] {
                                way.store(scratch[k].at_mut(place(corner, a, 0)));
                                way.negative().store(scratch[k].at_mut(place(corner, a, 1)));
                            }
                        },
                    );
                }
            },
        );
        let mut g = [near[0]; 16];
        each(
            1 << D,
            #[inline(always)]
            |corner| {
                let [first, second] = cell.terms[corner];
                g[corner] = Jet::from(
                    r,
                    #[inline(always)]
                    |k| {
                        if D == 3 {
                            let term = |at: u32| r.floats(scratch[k].at(at as usize));
                            return term(first) + term(second);
                        }
                        let way =
                            |a: usize| if (corner >> a) & 1 == 1 { far[a][k] } else { near[a].parts[k] };
                        r.all(f32::from_bits(first)) * way(0) + r.all(f32::from_bits(second)) * way(1)
                    },
                );
            },
        );
        (top.are_fractions(), blend(g, &weights(near)).parts)
    }
}

/// Where the offset from a corner along an axis is in the scratch memory, or its negative.
#[inline(always)]
fn place(corner: usize, axis: usize, negative: usize) -> usize {
    axis + 3 * ((corner >> axis) & 1) + 6 * negative
}
