//! Signed gradient noise: plain and dual, periodic or not.

use crate::float::Float;
use crate::hash::hash;
use crate::number::Number;
use crate::unroll::{array, each};

/// Scale of the field for each dimension, so that it stays within −1 and 1.
pub(crate) const SCALE: [f32; 5] =
    [0.0, 0.25, f32::from_bits(0x3f29_5e9e), f32::from_bits(0x3f7b_645a), f32::from_bits(0x3f55_9b3d)];

/// The field's value.
#[inline(always)]
pub(crate) fn one<N: Number, const D: usize, const DUAL: bool>(
    p: [N; D],
    periods: Option<[N::Float; D]>,
) -> N {
    Corners::new(p, periods).one::<DUAL>()
}

/// Three values: the gradients take different bytes of the same hash, so that the first equals [`one`].
#[inline(always)]
pub(crate) fn three<N: Number, const D: usize, const DUAL: bool>(
    p: [N; D],
    periods: Option<[N::Float; D]>,
) -> [N; 3] {
    Corners::new(p, periods).three::<DUAL>()
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

#[inline(always)]
fn fade<N: Number>(t: N) -> N {
    let c = |x: f32| N::constant(N::Float::lit(x));
    t.mul(t).mul(t).mul(t.mul(t.mul(c(6.0)).sub(c(15.0))).add(c(10.0)))
}

#[inline(always)]
fn mix<N: Number>(a: N, b: N, t: N) -> N {
    a.mul(N::constant(N::Float::lit(1.0)).sub(t)).add(b.mul(t))
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
        let weight = array(
            #[inline(always)]
            |a| fade(near[a]),
        );
        Corners { hashes, near, far, weight }
    }

    /// The field's value.
    #[inline(always)]
    fn one<const DUAL: bool>(&self) -> N {
        self.blend::<DUAL>(
            #[inline(always)]
            |h| h,
        )
    }

    /// Three values.
    #[inline(always)]
    fn three<const DUAL: bool>(&self) -> [N; 3] {
        [
            self.blend::<DUAL>(
                #[inline(always)]
                |h| h & 0xff,
            ),
            self.blend::<DUAL>(
                #[inline(always)]
                |h| (h >> 8) & 0xff,
            ),
            self.blend::<DUAL>(
                #[inline(always)]
                |h| (h >> 16) & 0xff,
            ),
        ]
    }

    #[inline(always)]
    fn blend<const DUAL: bool>(&self, pick: impl Fn(u32) -> u32) -> N {
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
        // The order is part of the definition, because it determines the last bits.
        let order: [usize; 4] = match (D, DUAL) {
            (1, _) => [0, 9, 9, 9],
            (2, _) => [0, 1, 9, 9],
            (3, _) => [2, 0, 1, 9],
            (_, false) => [2, 0, 1, 3],
            (_, true) => [3, 2, 0, 1],
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
                            g[corner] = mix(g[corner], g[corner | 1 << axis], self.weight[axis]);
                        }
                    },
                );
                done |= 1 << axis;
            },
        );
        g[0].scale(N::Float::lit(SCALE[D]))
    }
}

/// The two terms of the gradient of a corner of a cell in three dimensions: the axis of each, and whether it
/// is negative (1) or not (0).
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn terms(g: u32) -> [(u32, u32); 2] {
    let m = g & 15;
    let inner = if m | 2 == 14 { 0 } else { 2 };
    [(u32::from(m >= 8), g & 1), (if m < 4 { 1 } else { inner }, (g >> 1) & 1)]
}

/// The gradient of a corner of a cell in two or three dimensions, as factors of the offset from there. The
/// offset is not negative from near corners and not positive from far ones; a zero factor has the sign that
/// makes the product −0.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn factors<const D: usize>(g: u32, corner: usize) -> [f32; D] {
    let zero: [f32; D] = array(
        #[inline(always)]
        |a| if (corner >> a) & 1 == 1 { 0.0 } else { -0.0 },
    );
    let s = crate::hash::flip(1.0, g & 1);
    let t = crate::hash::flip(if D == 2 { 2.0 } else { 1.0 }, g & 2);
    let m = g & if D == 2 { 7 } else { 15 };
    // The axis of the first term, then of the second.
    let first = u32::from(m >= if D == 2 { 4 } else { 8 });
    let second = match D {
        2 => 1 - first,
        _ => {
            let inner = if m | 2 == 14 { 0 } else { 2 };
            if m < 4 { 1 } else { inner }
        }
    };
    array(
        #[inline(always)]
        |a| {
            let other = if second == a as u32 { t } else { zero[a] };
            if first == a as u32 { s } else { other }
        },
    )
}

/// The gradient of a corner, chosen by the low bits of its hash, times the offset to the point.
#[inline(always)]
fn gradient<N: Number, const D: usize>(g: u32, way: [N; D]) -> N {
    match D {
        1 => {
            let m = g & 15;
            let c = N::Float::from_int((1 + (m & 7)) as i32);
            way[0].scale(c.flip(m & 8))
        }
        2 => {
            let m = g & 7;
            let first = m < 4;
            let s = N::select(first, way[0], way[1]);
            let t = N::select(first, way[1], way[0]).scale(N::Float::lit(2.0));
            s.negate_if(m & 1).add(t.negate_if(m & 2))
        }
        3 => {
            let m = g & 15;
            let s = N::select(m < 8, way[0], way[1]);
            let t = N::select(m < 4, way[1], N::select(m | 2 == 14, way[0], way[2]));
            s.negate_if(m & 1).add(t.negate_if(m & 2))
        }
        _ => {
            let m = g & 31;
            let s = N::select(m < 24, way[0], way[1]);
            let t = N::select(m < 16, way[1], way[2]);
            let r = N::select(m < 8, way[2], way[3]);
            s.negate_if(m & 1).add(t.negate_if(m & 2)).add(r.negate_if(m & 4))
        }
    }
}
