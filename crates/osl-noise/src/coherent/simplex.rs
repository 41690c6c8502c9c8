//! Simplex noise in three dimensions at points of known simplices.

use super::alone::{InOneCell, Scratch};
use super::{Key, Lattice, Table};
use crate::simplex::{self, F, G, SCALE, gradients};
use crate::unroll::{array, each};
use osl_simd::registers::{Floats, Registers, Words};

/// The lattice of simplices.
#[derive(Clone, Copy)]
pub(crate) struct Simplex;

/// The first corners of the points' simplices, the offsets from there, and which axes are at least as long as
/// others: x and y, x and z, y and z.
struct Site<F, M> {
    base: [F; 3],
    origin: [F; 3],
    order: [M; 3],
}

#[inline(always)]
fn site<R: Registers<N>, const N: usize>(r: R, p: [R::Floats; 3]) -> Site<R::Floats, R::Marks> {
    let s = (p[0] + p[1] + p[2]) * r.all(F[3]);
    let base: [R::Floats; 3] = array(
        #[inline(always)]
        |a| (p[a] + s).floor(),
    );
    let t = (base[0] + base[1] + base[2]) * r.all(G[3]);
    let origin: [R::Floats; 3] = array(
        #[inline(always)]
        |a| p[a] - (base[a] - t),
    );
    let [x, y, z] = origin;
    Site { base, origin, order: [x.at_least(y), x.at_least(z), y.at_least(z)] }
}

/// A simplex that many lanes share.
#[derive(Clone, Copy)]
pub(crate) struct Shared {
    /// The first corner before skewing, and its position.
    base: [f32; 3],
    corner: [f32; 3],
    /// Which axes are at least as long as others.
    order: [bool; 3],
    /// What the second and the third corner are further by.
    further: [[f32; 3]; 2],
    gradients: [[f32; 3]; 4],
}

impl Lattice<3> for Simplex {
    const SIZES: (usize, usize) = (4, 12);

    #[inline(always)]
    fn key<R: Registers<N>, const N: usize>(r: R, p: [R::Floats; 3]) -> [R::Words; 4] {
        let Site { base: [x, y, z], order: [xy, xz, yz], .. } = site(r, p);
        // Each comparison raises the rank of one axis; ranks have two bits each.
        let [one, two, three] = [1, 4, 16].map(
            #[inline(always)]
            |rank| r.each(rank),
        );
        let ranks = r.each(0).plus(xy, one, two).plus(xz, one, three).plus(yz, two, three);
        [x.whole(), y.whole(), z.whole(), ranks]
    }

    #[inline(always)]
    fn table(key: Key) -> Table {
        gradients(key, 0)
    }

    #[inline(always)]
    fn placed<R: Registers<N>, const N: usize>(
        r: R,
        p: [R::Floats; 3],
        word: impl Fn(usize) -> R::Floats,
    ) -> R::Floats {
        let Site { origin, order: [xy, xz, yz], .. } = site(r, p);
        // The axes along which the second corner is further, and those of the third.
        let first = [xy & xz, yz & !xy, !(xz | yz)];
        let second = [xy | xz, yz | !xy, !(xz & yz)];
        let one = r.all(1.0);
        corners(
            r,
            #[inline(always)]
            |q, a| match q {
                0 => origin[a],
                1 => origin[a].less_at(first[a], one),
                2 => origin[a].less_at(second[a], one),
                _ => origin[a] - one,
            },
            word,
        )
    }

    type Cell = Shared;

    #[inline(always)]
    fn key_of(p: [f32; 3]) -> Key {
        let simplex::Site { base: [x, y, z], rank, .. } = simplex::site(p);
        [x as u32, y as u32, z as u32, (rank[0] | rank[1] << 2 | rank[2] << 4) as u32]
    }

    #[inline(always)]
    fn cell(key: Key) -> Shared {
        let (base, rank) = simplex::unpack(key);
        let whole = base.map(|i| i as f32);
        let t = (whole[0] + whole[1] + whole[2]) * G[3];
        let further = [1, 2].map(|q| simplex::offset(rank, q).map(|far| f32::from(u8::from(far))));
        let gradients = [0, 1, 2, 3].map(|q| simplex::corner_gradient(base, rank, q, 0));
        let order = [rank[0] > rank[1], rank[0] > rank[2], rank[1] > rank[2]];
        Shared { base: whole, corner: whole.map(|x| x - t), order, further, gradients }
    }
}

impl InOneCell<3, 1> for Simplex {
    #[inline(always)]
    fn within<R: Registers<N>, const N: usize>(
        r: R,
        [p]: [[R::Floats; 3]; 1],
        cell: &Shared,
        _: &mut [Scratch<N>; 1],
    ) -> (R::Marks, [R::Floats; 1]) {
        let s = (p[0] + p[1] + p[2]) * r.all(F[3]);
        let place: [R::Floats; 3] = array(
            #[inline(always)]
            |a| (p[a] + s) - r.all(cell.base[a]),
        );
        let is_in_cube = place[0].larger_word(place[1]).larger_word(place[2]).are_fractions();
        let origin: [R::Floats; 3] = array(
            #[inline(always)]
            |a| p[a] - r.all(cell.corner[a]),
        );
        let [x, y, z] = origin;
        let order: [R::Marks; 3] = array(
            #[inline(always)]
            |i| [x.at_least(y), x.at_least(z), y.at_least(z)][i] ^ r.marks(cell.order[i]),
        );
        let one = r.all(1.0);
        let value = corners(
            r,
            #[inline(always)]
            |q, a| match q {
                0 => origin[a],
                3 => origin[a] - one,
                _ => origin[a] - r.all(cell.further[q - 1][a]),
            },
            #[inline(always)]
            |j| r.all(cell.gradients[j / 3][j % 3]),
        );
        (is_in_cube & !(order[0] | order[1] | order[2]), [value])
    }
}

/// The value from the offsets of a simplex's corners before they are skewed back, by corner and axis, and
/// from their gradients.
#[inline(always)]
fn corners<R: Registers<N>, const N: usize>(
    r: R,
    from: impl Fn(usize, usize) -> R::Floats,
    gradient: impl Fn(usize) -> R::Floats,
) -> R::Floats {
    let (zero, half) = (r.all(0.0), r.all(0.5));
    let mut total = zero;
    each(
        4,
        #[inline(always)]
        |q| {
            let back = r.all(q as f32 * G[3]);
            let way: [R::Floats; 3] = array(
                #[inline(always)]
                |a| if q == 0 { from(q, a) } else { from(q, a) + back },
            );
            let t = half - way[0] * way[0] - way[1] * way[1] - way[2] * way[2];
            let dot = gradient(3 * q) * way[0] + gradient(3 * q + 1) * way[1] + gradient(3 * q + 2) * way[2];
            let t2 = t * t;
            let value = (t2 * t2).times_at(t.at_least(zero), dot);
            total = if q == 0 { value } else { total + value };
        },
    );
    r.all(SCALE[3]) * total
}
