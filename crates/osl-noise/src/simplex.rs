//! Signed simplex noise with its closed-form gradient.

use crate::hash::{cell, finish};
use crate::unroll::{array, each};

/// Value and gradient at a point. The seed tells the three components of a triple apart.
#[inline(always)]
pub(crate) fn field<const D: usize>(p: [f32; D], seed: u32) -> (f32, [f32; D]) {
    if D == 1 {
        let (v, g) = line(p[0], seed);
        return (v, [g; D]);
    }
    skewed(p, seed)
}

#[inline(always)]
fn scramble(p: u32, q: u32, r: u32) -> u32 {
    finish(p, q, r ^ 0xdead_beef)
}

#[inline(always)]
fn line(x: f32, seed: u32) -> (f32, f32) {
    let i = cell(x);
    let x0 = x - i as f32;
    let corner = |x: f32, i: i32| {
        let xx = x * x;
        let t = 1.0 - xx;
        let t2 = t * t;
        let t4 = t2 * t2;
        let h = scramble(i as u32, seed, 0);
        let g = crate::number::flip((1 + (h & 7)) as f32, h & 8);
        (t4 * g * x, t2 * t * g * xx, t4 * g)
    };
    let (n0, a0, b0) = corner(x0, i);
    let (n1, a1, b1) = corner(x0 - 1.0, i.wrapping_add(1));
    let d = (a0 + a1) * -8.0 + (b0 + b1);
    (0.36 * (n0 + n1), d * 0.36)
}

/// Skew, unskew and scale by dimension.
pub(crate) const F: [f32; 5] =
    [0.0, 0.0, f32::from_bits(0x3ebb_67ae), f32::from_bits(0x3eaa_aaab), f32::from_bits(0x3e9e_377a)];
pub(crate) const G: [f32; 5] =
    [0.0, 0.0, f32::from_bits(0x3e58_658c), f32::from_bits(0x3e2a_aaab), f32::from_bits(0x3e0d_8369)];
pub(crate) const SCALE: [f32; 5] = [0.0, 0.0, 64.0, 68.0, 54.0];

/// Bit `h` of the first word of an axis: gradient `h` has +1 there; of the second: −1. Axis by axis.
type Signs = [[u32; 2]; 4];

const fn bits(list: &[u32]) -> u32 {
    let (mut word, mut i) = (0, 0);
    while i < list.len() {
        word |= 1 << list[i];
        i += 1;
    }
    word
}

const PLANE: Signs =
    [[bits(&[1, 3, 7]), bits(&[0, 2, 4])], [bits(&[3, 4, 6]), bits(&[0, 5, 7])], [0; 2], [0; 2]];
const SPACE: Signs = [
    [bits(&[0, 4, 8, 9, 12]), bits(&[2, 6, 10, 11, 13])],
    [bits(&[1, 5, 9, 10, 14]), bits(&[3, 7, 8, 11, 15])],
    [bits(&[0, 1, 2, 3, 12, 13]), bits(&[4, 5, 6, 7, 14, 15])],
    [0; 2],
];
const HYPER: Signs = hyper();

/// One axis is 0 (bits 3 and 4 say which); the signs of the others, in order, are bits 2, 1, 0.
const fn hyper() -> Signs {
    let mut signs = [[0; 2]; 4];
    let mut h = 0;
    while h < 32 {
        let (mut axis, mut bit) = (0, 2);
        while axis < 4 {
            if axis != h >> 3 {
                signs[axis][(h >> bit) & 1] |= 1 << h;
                bit = if bit == 0 { 0 } else { bit - 1 };
            }
            axis += 1;
        }
        h += 1;
    }
    signs
}

#[inline(always)]
fn gradient<const D: usize>(cell: [i32; D], seed: u32) -> [f32; D] {
    let w: [u32; D] = array(
        #[inline(always)]
        |a| cell[a] as u32,
    );
    let (h, signs) = match D {
        2 => (scramble(w[0], w[1], seed) & 7, PLANE),
        3 => (scramble(w[0], w[1], scramble(w[2], seed, 0)) & 15, SPACE),
        _ => (scramble(w[0], w[1], scramble(w[2], w[3], seed)) & 31, HYPER),
    };
    // One shift for all axes: not every machine has shifts by lanes.
    let bit = 1_u32 << h;
    array(
        #[inline(always)]
        |a| {
            let [plus, minus] = signs[a];
            (i32::from(bit & plus != 0) - i32::from(bit & minus != 0)) as f32
        },
    )
}

#[inline(always)]
fn sum<const D: usize>(terms: [f32; D]) -> f32 {
    let mut total = terms[0];
    each(
        D - 1,
        #[inline(always)]
        |a| total += terms[a + 1],
    );
    total
}

/// What the corners add up to.
#[derive(Clone, Copy)]
struct Sum<const D: usize> {
    value: f32,
    toward: [f32; D],
    slope: [f32; D],
}

/// Where a point is: the first corner of its simplex and the way from there, and how the axes rank.
#[derive(Clone, Copy)]
struct Site<const D: usize> {
    base: [i32; D],
    origin: [f32; D],
    rank: [i32; D],
}

/// The way from the first corner.
#[inline(always)]
fn origin<const D: usize>(p: [f32; D], base: [i32; D]) -> [f32; D] {
    let mut total = base[0];
    each(
        D - 1,
        #[inline(always)]
        |a| total = total.wrapping_add(base[a + 1]),
    );
    let t = total as f32 * G[D];
    array(
        #[inline(always)]
        |a| p[a] - (base[a] as f32 - t),
    )
}

#[inline(always)]
fn site<const D: usize>(p: [f32; D]) -> Site<D> {
    let s = sum(p) * F[D];
    let base: [i32; D] = array(
        #[inline(always)]
        |a| cell(p[a] + s),
    );
    let origin = origin(p, base);
    // The corners are entered along the axes in order of size; in space ties go to the first axis, else to the last.
    let outranks = |a: usize, b: usize| if D == 3 { origin[a] >= origin[b] } else { origin[a] > origin[b] };
    let rank: [i32; D] = array(
        #[inline(always)]
        |a| {
            let mut rank = 0;
            each(
                D,
                #[inline(always)]
                |b| {
                    if b < a {
                        rank += i32::from(!outranks(b, a));
                    } else if b > a {
                        rank += i32::from(outranks(a, b));
                    }
                },
            );
            rank
        },
    );
    Site { base, origin, rank }
}

/// The gradients of the corners of a simplex of space, corner by corner. The key is its first corner, and the ranks of the
/// axes, two bits for each.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn gradients(key: [u32; 4], seed: u32) -> [u32; 24] {
    let base = array(
        #[inline(always)]
        |a| key[a] as i32,
    );
    let rank = array(
        #[inline(always)]
        |a| ((key[3] >> (2 * a)) & 3) as i32,
    );
    let mut table = [0; 24];
    each(
        4,
        #[inline(always)]
        |q| {
            let g: [f32; 3] = corner_gradient(base, rank, q, seed);
            each(
                3,
                #[inline(always)]
                |a| table[q * 3 + a] = g[a].to_bits(),
            );
        },
    );
    table
}

#[inline(always)]
fn skewed<const D: usize>(p: [f32; D], seed: u32) -> (f32, [f32; D]) {
    let Site { base, origin, rank } = site(p);
    let mut total = Sum { value: 0.0, toward: [0.0; D], slope: [0.0; D] };
    each(
        D + 1,
        #[inline(always)]
        |q| {
            let corner = corner(origin, rank, q, corner_gradient(base, rank, q, seed));
            if q == 0 {
                total = corner;
            } else {
                total.value += corner.value;
                each(
                    D,
                    #[inline(always)]
                    |a| {
                        total.toward[a] += corner.toward[a];
                        total.slope[a] += corner.slope[a];
                    },
                );
            }
        },
    );
    let d = array(
        #[inline(always)]
        |a| (total.toward[a] * -8.0 + total.slope[a]) * SCALE[D],
    );
    (SCALE[D] * total.value, d)
}

/// Whether the `q`th corner is one further along an axis.
#[inline(always)]
fn offset<const D: usize>(rank: [i32; D], q: usize) -> [bool; D] {
    array(
        #[inline(always)]
        |a| rank[a] >= D as i32 - q as i32,
    )
}

#[inline(always)]
fn corner_gradient<const D: usize>(base: [i32; D], rank: [i32; D], q: usize, seed: u32) -> [f32; D] {
    let offset = offset(rank, q);
    gradient(
        array(
            #[inline(always)]
            |a| base[a].wrapping_add(i32::from(offset[a])),
        ),
        seed,
    )
}

/// What one corner of the simplex adds.
#[inline(always)]
fn corner<const D: usize>(origin: [f32; D], rank: [i32; D], q: usize, g: [f32; D]) -> Sum<D> {
    let offset = offset(rank, q);
    let way: [f32; D] = array(
        #[inline(always)]
        |a| {
            let from = if offset[a] { origin[a] - 1.0 } else { origin[a] };
            if q == 0 { from } else { from + q as f32 * G[D] }
        },
    );
    let mut t = 0.5;
    each(
        D,
        #[inline(always)]
        |a| t -= way[a] * way[a],
    );
    let inside = t >= 0.0;
    let keep = |x: f32| if inside { x } else { 0.0 };
    let t2 = keep(t * t);
    let t4 = keep(t2 * t2);
    let g: [f32; D] = array(
        #[inline(always)]
        |a| keep(g[a]),
    );
    let dot = sum::<D>(array(
        #[inline(always)]
        |a| g[a] * way[a],
    ));
    let pull = (t2 * t) * dot;
    Sum {
        value: keep(t4 * dot),
        toward: array(
            #[inline(always)]
            |a| pull * way[a],
        ),
        slope: array(
            #[inline(always)]
            |a| t4 * g[a],
        ),
    }
}
