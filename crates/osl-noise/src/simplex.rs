//! Signed simplex noise with its closed-form gradient.

use crate::float::Float;
use crate::hash::finish;
use crate::unroll::{array, each};

/// Value and gradient at a point. The seed distinguishes the three components of a triple.
#[inline(always)]
pub(crate) fn field<T: Float, const D: usize>(p: [T; D], seed: u32) -> (T, [T; D]) {
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
fn line<T: Float>(x: T, seed: u32) -> (T, T) {
    let (i, whole) = x.cell();
    let x0 = x - whole;
    let corner = |x: T, i: i32| {
        let xx = x * x;
        let t = T::lit(1.0) - xx;
        let t2 = t * t;
        let t4 = t2 * t2;
        let h = scramble(i as u32, seed, 0);
        let g = T::from_int((1 + (h & 7)) as i32).flip(h & 8);
        (t4 * g * x, t2 * t * g * xx, t4 * g)
    };
    let (n0, a0, b0) = corner(x0, i);
    let (n1, a1, b1) = corner(x0 - T::lit(1.0), i.wrapping_add(1));
    let d = (a0 + a1) * T::lit(-8.0) + (b0 + b1);
    let scale = T::known(0.36, 0.36);
    (scale * (n0 + n1), d * scale)
}

/// Skew, unskew and scale by dimension.
pub(crate) const F: [f32; 5] =
    [0.0, 0.0, f32::from_bits(0x3ebb_67ae), f32::from_bits(0x3eaa_aaab), f32::from_bits(0x3e9e_377a)];
pub(crate) const G: [f32; 5] =
    [0.0, 0.0, f32::from_bits(0x3e58_658c), f32::from_bits(0x3e2a_aaab), f32::from_bits(0x3e0d_8369)];
pub(crate) const SCALE: [f32; 5] = [0.0, 0.0, 64.0, 68.0, 54.0];
/// (√(d+1) − 1) / d, and (1 − 1/√(d+1)) / d.
const EXACT_F: [f64; 5] = [0.0, 0.0, 0.366_025_403_784_438_65, 1.0 / 3.0, 0.309_016_994_374_947_45];
const EXACT_G: [f64; 5] = [0.0, 0.0, 0.211_324_865_405_187_1, 1.0 / 6.0, 0.138_196_601_125_010_5];

/// For each axis: bit `h` of the first word is set if gradient `h` is +1 there; of the second word, if it is
/// −1.
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

/// One axis is 0 (selected by bits 3 and 4); bits 2, 1, 0 are the signs of the others, in order.
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
fn gradient<T: Float, const D: usize>(cell: [i32; D], seed: u32) -> [T; D] {
    let w: [u32; D] = array(
        #[inline(always)]
        |a| cell[a] as u32,
    );
    let (h, signs) = match D {
        2 => (scramble(w[0], w[1], seed) & 7, PLANE),
        3 => (scramble(w[0], w[1], scramble(w[2], seed, 0)) & 15, SPACE),
        _ => (scramble(w[0], w[1], scramble(w[2], w[3], seed)) & 31, HYPER),
    };
    // One shift for all axes, because not every machine has shifts by lane.
    let bit = 1_u32 << h;
    array(
        #[inline(always)]
        |a| {
            let [plus, minus] = signs[a];
            T::from_int(i32::from(bit & plus != 0) - i32::from(bit & minus != 0))
        },
    )
}

#[inline(always)]
fn sum<T: Float, const D: usize>(terms: [T; D]) -> T {
    let mut total = terms[0];
    each(
        D - 1,
        #[inline(always)]
        |a| total = total + terms[a + 1],
    );
    total
}

/// The sum over the corners.
#[derive(Clone, Copy)]
struct Sum<T, const D: usize> {
    value: T,
    toward: [T; D],
    derivs: [T; D],
}

/// The position of a point: the first corner of its simplex, the offset from there, and the ranks of the
/// axes.
#[derive(Clone, Copy)]
pub(crate) struct Site<T, const D: usize> {
    pub(crate) base: [i32; D],
    pub(crate) origin: [T; D],
    pub(crate) rank: [i32; D],
}

/// The offset from the first corner.
#[inline(always)]
fn origin<T: Float, const D: usize>(p: [T; D], base: [i32; D], whole: [T; D]) -> [T; D] {
    let mut total = base[0];
    each(
        D - 1,
        #[inline(always)]
        |a| total = total.wrapping_add(base[a + 1]),
    );
    let t = T::total(total, sum(whole)) * T::known(G[D], EXACT_G[D]);
    array(
        #[inline(always)]
        |a| p[a] - (whole[a] - t),
    )
}

#[inline(always)]
pub(crate) fn site<T: Float, const D: usize>(p: [T; D]) -> Site<T, D> {
    let s = sum(p) * T::known(F[D], EXACT_F[D]);
    let cells: [(i32, T); D] = array(
        #[inline(always)]
        |a| (p[a] + s).cell(),
    );
    let base: [i32; D] = array(
        #[inline(always)]
        |a| cells[a].0,
    );
    let origin = origin(
        p,
        base,
        array(
            #[inline(always)]
            |a| cells[a].1,
        ),
    );
    // The corners are visited along the axes in order of size; in three dimensions the first axis wins ties,
    // else the last.
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

/// The first corner of a simplex in three dimensions, and the ranks of the axes. The key holds the latter in
/// two bits each.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn unpack(key: [u32; 4]) -> ([i32; 3], [i32; 3]) {
    let base = array(
        #[inline(always)]
        |a| key[a] as i32,
    );
    let rank = array(
        #[inline(always)]
        |a| ((key[3] >> (2 * a)) & 3) as i32,
    );
    (base, rank)
}

/// The gradients of the corners of a simplex in three dimensions, corner by corner.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub(crate) fn gradients(key: [u32; 4], seed: u32) -> [u32; 24] {
    let (base, rank) = unpack(key);
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
fn skewed<T: Float, const D: usize>(p: [T; D], seed: u32) -> (T, [T; D]) {
    let Site { base, origin, rank } = site(p);
    let zero = T::lit(0.0);
    let mut total = Sum { value: zero, toward: [zero; D], derivs: [zero; D] };
    each(
        D + 1,
        #[inline(always)]
        |q| {
            let corner = corner(origin, rank, q, corner_gradient(base, rank, q, seed));
            if q == 0 {
                total = corner;
            } else {
                total.value = total.value + corner.value;
                each(
                    D,
                    #[inline(always)]
                    |a| {
                        total.toward[a] = total.toward[a] + corner.toward[a];
                        total.derivs[a] = total.derivs[a] + corner.derivs[a];
                    },
                );
            }
        },
    );
    let d = array(
        #[inline(always)]
        |a| (total.toward[a] * T::lit(-8.0) + total.derivs[a]) * T::lit(SCALE[D]),
    );
    (T::lit(SCALE[D]) * total.value, d)
}

/// Whether the `q`th corner is one further along an axis.
#[inline(always)]
pub(crate) fn offset<const D: usize>(rank: [i32; D], q: usize) -> [bool; D] {
    array(
        #[inline(always)]
        |a| rank[a] >= D as i32 - q as i32,
    )
}

#[inline(always)]
pub(crate) fn corner_gradient<T: Float, const D: usize>(
    base: [i32; D],
    rank: [i32; D],
    q: usize,
    seed: u32,
) -> [T; D] {
    let offset = offset(rank, q);
    gradient(
        array(
            #[inline(always)]
            |a| base[a].wrapping_add(i32::from(offset[a])),
        ),
        seed,
    )
}

/// The contribution of one corner of the simplex.
#[inline(always)]
fn corner<T: Float, const D: usize>(origin: [T; D], rank: [i32; D], q: usize, g: [T; D]) -> Sum<T, D> {
    let offset = offset(rank, q);
    let zero = T::lit(0.0);
    let way: [T; D] = array(
        #[inline(always)]
        |a| {
            let from = if offset[a] { origin[a] - T::lit(1.0) } else { origin[a] };
            if q == 0 { from } else { from + T::from_int(q as i32) * T::known(G[D], EXACT_G[D]) }
        },
    );
    let mut t = T::lit(0.5);
    each(
        D,
        #[inline(always)]
        |a| t = t - way[a] * way[a],
    );
    let inside = t >= zero;
    let keep = |x: T| if inside { x } else { zero };
    let t2 = keep(t * t);
    let t4 = keep(t2 * t2);
    let g: [T; D] = array(
        #[inline(always)]
        |a| keep(g[a]),
    );
    let dot = sum::<T, D>(array(
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
        derivs: array(
            #[inline(always)]
            |a| t4 * g[a],
        ),
    }
}
