//! Simplex noise in three dimensions at points of known simplices.

use super::{Key, Lattice, Table};
use crate::simplex::{F, G, SCALE, gradients};
use crate::unroll::{array, each};
use osl_simd::wide::{Floats, Marks, Proof, Words};

/// The lattice of simplices.
#[derive(Clone, Copy)]
pub(crate) struct Simplex;

/// The first corners of the points' simplices, the offsets from there, and which axes are at least as long as
/// others: x and y, x and z, y and z.
struct Site {
    base: [Floats; 3],
    origin: [Floats; 3],
    order: [Marks; 3],
}

#[inline(always)]
fn site(proof: Proof, p: [Floats; 3]) -> Site {
    let s = (p[0] + p[1] + p[2]) * proof.all(F[3]);
    let base: [Floats; 3] = array(
        #[inline(always)]
        |a| (p[a] + s).floor(),
    );
    let t = (base[0] + base[1] + base[2]) * proof.all(G[3]);
    let origin: [Floats; 3] = array(
        #[inline(always)]
        |a| p[a] - (base[a] - t),
    );
    let [x, y, z] = origin;
    Site { base, origin, order: [x.at_least(y), x.at_least(z), y.at_least(z)] }
}

impl Lattice<3> for Simplex {
    const SIZES: (usize, usize) = (4, 12);

    #[inline(always)]
    fn key(proof: Proof, p: [Floats; 3]) -> [Words; 4] {
        let Site { base: [x, y, z], order: [xy, xz, yz], .. } = site(proof, p);
        // Each comparison raises the rank of one axis; ranks have two bits each.
        let [one, two, three] = [1, 4, 16].map(|rank| proof.each(rank));
        let ranks = proof.each(0).plus(xy, one, two).plus(xz, one, three).plus(yz, two, three);
        [x.whole(), y.whole(), z.whole(), ranks]
    }

    #[inline(always)]
    fn table(key: Key) -> Table {
        gradients(key, 0)
    }

    #[inline(always)]
    fn placed(proof: Proof, p: [Floats; 3], word: impl Fn(usize) -> Floats) -> Floats {
        let Site { origin, order: [xy, xz, yz], .. } = site(proof, p);
        // The axes along which the second corner is further, and those of the third.
        let first = [xy & xz, yz & !xy, !(xz | yz)];
        let second = [xy | xz, yz | !xy, !(xz & yz)];
        let (zero, half, one) = (proof.all(0.0), proof.all(0.5), proof.all(1.0));
        let mut total = zero;
        each(
            4,
            #[inline(always)]
            |q| {
                let back = proof.all(q as f32 * G[3]);
                let way: [Floats; 3] = array(
                    #[inline(always)]
                    |a| match q {
                        0 => origin[a],
                        1 => origin[a].less_at(first[a], one) + back,
                        2 => origin[a].less_at(second[a], one) + back,
                        _ => (origin[a] - one) + back,
                    },
                );
                let t = half - way[0] * way[0] - way[1] * way[1] - way[2] * way[2];
                let dot = word(3 * q) * way[0] + word(3 * q + 1) * way[1] + word(3 * q + 2) * way[2];
                let t2 = t * t;
                let value = (t2 * t2).times_at(t.at_least(zero), dot);
                total = if q == 0 { value } else { total + value };
            },
        );
        proof.all(SCALE[3]) * total
    }
}
