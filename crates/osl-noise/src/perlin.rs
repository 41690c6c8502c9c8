//! Signed gradient noise: plain and dual, periodic or not.
//!
//! Each corner of the cell around a point has a gradient, which the hash of the corner chooses ([`terms`]).
//! The products of the gradients and the offsets from the corners are blended along one axis after the other
//! ([`blend`]). Points one by one, and registers of points in known cells (`coherent`), share these two.

use crate::float::Float;
use crate::hash::{flip, hash};
use crate::number::{Number, Ring};
use crate::unroll::{array, each};

/// Scale of the field for each dimension, so that it stays within −1 and 1.
const SCALE: [f32; 5] =
    [0.0, 0.25, f32::from_bits(0x3f29_5e9e), f32::from_bits(0x3f7b_645a), f32::from_bits(0x3f55_9b3d)];

/// The field's value.
#[inline(always)]
pub(crate) fn one<N: Number, const D: usize>(p: [N; D], periods: Option<[N::Float; D]>) -> N {
    Corners::new(p, periods).blend(
        #[inline(always)]
        |h| h,
    )
}

/// Three values: the gradients take different bytes of the same hash, so that the first equals [`one`].
#[inline(always)]
pub(crate) fn three<N: Number, const D: usize>(p: [N; D], periods: Option<[N::Float; D]>) -> [N; 3] {
    let corners = Corners::new(p, periods);
    [
        corners.blend(
            #[inline(always)]
            |h| h & 0xff,
        ),
        corners.blend(
            #[inline(always)]
            |h| (h >> 8) & 0xff,
        ),
        corners.blend(
            #[inline(always)]
            |h| (h >> 16) & 0xff,
        ),
    ]
}

/// The cell of a point.
#[inline(always)]
fn cells<N: Number, const D: usize>(p: [N; D]) -> [u32; D] {
    array(
        #[inline(always)]
        |a| p[a].value().cell().0 as u32,
    )
}

/// The hashes of the corners of a cell.
#[inline(always)]
pub(crate) fn corner_hashes<const D: usize>(cell: [u32; D]) -> [u32; 16] {
    hashes::<D>(array(
        #[inline(always)]
        |a| [cell[a], cell[a].wrapping_add(1)],
    ))
}

#[inline(always)]
fn hashes<const D: usize>(lattice: [[u32; 2]; D]) -> [u32; 16] {
    let mut hashes = [0; 16];
    each(
        1 << D,
        #[inline(always)]
        |corner| {
            hashes[corner] = hash::<D>(array(
                #[inline(always)]
                |a| lattice[a][(corner >> a) & 1],
            ))
        },
    );
    hashes
}

/// Data of the corners of a cell: their hashes, the offsets from them, and the weights.
struct Corners<N, const D: usize> {
    hashes: [u32; 16],
    /// Offsets from the near and the far corner, for each axis.
    near: [N; D],
    far: [N; D],
    weight: [N; D],
}

/// The weight of the far corners along an axis, from the offset to the near one.
#[inline(always)]
fn fade<T: Ring>(t: T) -> T {
    let c = |x: f32| t.like(x);
    t.mul(t).mul(t).mul(t.mul(t.mul(c(6.0)).sub(c(15.0))).add(c(10.0)))
}

/// The value between two corners.
#[inline(always)]
fn mix<T: Ring>(a: T, b: T, t: T) -> T {
    a.mul(t.like(1.0).sub(t)).add(b.mul(t))
}

/// The weights along all axes.
#[inline(always)]
pub(crate) fn weights<T: Ring, const D: usize>(near: [T; D]) -> [T; D] {
    array(
        #[inline(always)]
        |a| fade(near[a]),
    )
}

/// The field's value, from the product of gradient and offset at each corner, and from the weights.
#[inline(always)]
pub(crate) fn blend<T: Ring, const D: usize>(mut g: [T; 16], weight: &[T; D]) -> T {
    // The order is part of the definition, because it determines the last bits.
    let order: [usize; 4] = match (D, T::PARTS) {
        (1, _) => [0, 9, 9, 9],
        (2, _) => [0, 1, 9, 9],
        (3, _) => [2, 0, 1, 9],
        (_, 1) => [2, 0, 1, 3],
        _ => [3, 2, 0, 1],
    };
    let mut done = 0;
    each(
        D,
        #[inline(always)]
        |step| {
            let axis = order[step];
            each(
                1 << D,
                #[inline(always)]
                |corner| {
                    if corner & (done | 1 << axis) == 0 {
                        g[corner] = mix(g[corner], g[corner | 1 << axis], weight[axis]);
                    }
                },
            );
            done |= 1 << axis;
        },
    );
    g[0].times(SCALE[D])
}

/// Wraps a lattice integer into its period.
#[inline(always)]
fn reduce<F: Float>(i: u32, period: F) -> u32 {
    let i = i as i32;
    let p = period.cell().0.max(1);
    let r = i.wrapping_rem(p);
    (if r < 0 { r + p } else { r }) as u32
}

impl<N: Number, const D: usize> Corners<N, D> {
    #[inline(always)]
    fn new(p: [N; D], periods: Option<[N::Float; D]>) -> Self {
        let cell = cells(p);
        let hashes = match periods {
            Some(periods) => hashes::<D>(array(
                #[inline(always)]
                |a| [reduce(cell[a], periods[a]), reduce(cell[a].wrapping_add(1), periods[a])],
            )),
            None => corner_hashes(cell),
        };
        Corners::within(p, hashes)
    }

    /// The corners of a point's cell, with known hashes.
    #[inline(always)]
    fn within(p: [N; D], hashes: [u32; 16]) -> Self {
        let near: [N; D] = array(
            #[inline(always)]
            |a| {
                let x = p[a].value();
                p[a].with_value(x - x.cell().1)
            },
        );
        let far: [N; D] = array(
            #[inline(always)]
            |a| near[a].with_value(near[a].value() - N::Float::lit(1.0)),
        );
        Corners { hashes, near, far, weight: weights(near) }
    }

    /// The value whose gradients are chosen by some bits of the hashes.
    #[inline(always)]
    fn blend(&self, pick: impl Fn(u32) -> u32) -> N {
        let mut g = [N::constant(N::Float::lit(0.0)); 16];
        each(
            1 << D,
            #[inline(always)]
            |corner| {
                let way = array(
                    #[inline(always)]
                    |a| if (corner >> a) & 1 == 1 { self.far[a] } else { self.near[a] },
                );
                g[corner] = gradient::<N, D>(pick(self.hashes[corner]), way);
            },
        );
        blend(g, &self.weight)
    }
}

#[inline(always)]
fn select<T>(mask: bool, yes: T, no: T) -> T {
    if mask { yes } else { no }
}

/// The terms of a gradient's product with an offset, in two to four dimensions: the offset along the axis of
/// each term, or whatever belongs to an axis. There are three terms in four dimensions, else two. Bit `k` of
/// the gradient's number negates term `k`, and [`FACTOR`] scales it.
#[inline(always)]
pub(crate) fn terms<T: Copy, const D: usize>(g: u32, axes: [T; D]) -> [T; 3] {
    match D {
        2 => {
            let [x, y] = [axes[0], axes[1]];
            let is_low = g & 7 < 4;
            [select(is_low, x, y), select(is_low, y, x), x]
        }
        3 => {
            let [x, y, z] = [axes[0], axes[1], axes[2]];
            let m = g & 15;
            [select(m < 8, x, y), select(m < 4, y, select(m | 2 == 14, x, z)), x]
        }
        _ => {
            let [x, y, z, w] = [axes[0], axes[1], axes[2], axes[3]];
            let m = g & 31;
            [select(m < 24, x, y), select(m < 16, y, z), select(m < 8, z, w)]
        }
    }
}

/// What the second term of a gradient is multiplied by, for each dimension. The others are multiplied by 1.
const FACTOR: [f32; 5] = [0.0, 0.0, 2.0, 1.0, 1.0];

/// The gradient of a corner of a cell in two or three dimensions, as factors of the offset from there. The
/// offset is not negative from near corners and not positive from far ones; a zero factor has the sign that
/// makes the product −0.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn factors<const D: usize>(g: u32, corner: usize) -> [f32; D] {
    let axes: [usize; D] = array(
        #[inline(always)]
        |a| a,
    );
    let [first, second, _] = terms(g, axes);
    array(
        #[inline(always)]
        |a| {
            let zero = if (corner >> a) & 1 == 1 { 0.0 } else { -0.0 };
            let other = if second == a { flip(FACTOR[D], g & 2) } else { zero };
            if first == a { flip(1.0, g & 1) } else { other }
        },
    )
}

/// The gradient of a corner, chosen by the low bits of its hash, times the offset to the point.
#[inline(always)]
fn gradient<N: Number, const D: usize>(g: u32, way: [N; D]) -> N {
    if D == 1 {
        let c = N::Float::from_int((1 + (g & 7)) as i32);
        return way[0].scale(c.flip(g & 8));
    }
    let [first, second, third] = terms(g, way);
    let second = if D == 2 { second.times(FACTOR[D]) } else { second };
    let sum = first.negate_if(g & 1).add(second.negate_if(g & 2));
    if D == 4 { sum.add(third.negate_if(g & 4)) } else { sum }
}
