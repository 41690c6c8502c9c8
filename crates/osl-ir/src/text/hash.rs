//! The hash of strings: FarmHash's `Hash64` in its portable form; 0 for the empty string.
//!
//! Source: Geoff Pike, FarmHash (public, "xo"). The crate of that name is wrong if a long string's length is
//! a multiple of 64, so the hash is implemented here. Words are read little-endian; the text is followed by
//! zeros, which no length reads.

const K0: u64 = 0xc3a5_c85c_97cb_3127;
const K1: u64 = 0xb492_b66f_be98_f273;
const K2: u64 = 0x9ae1_6a3b_2f90_404f;

/// The hash.
pub fn hash(s: &str) -> u64 {
    let bytes = Bytes(s.as_bytes());
    match s.len() {
        0 => 0,
        1..=3 => bytes.tiny(),
        4..=7 => join(bytes.n() + (bytes.half(0) << 3), bytes.half(s.len() - 4), K2.add(2 * bytes.n())),
        8..=16 => bytes.short(),
        17..=32 => bytes.medium(),
        33..=64 => {
            let (m0, m1) = (K2.sub(30), K2.sub(30).add(2 * bytes.n()));
            let (p, q) = (bytes.block(0, m0, 0, 0), bytes.block(s.len() - 32, m1, 0, 0));
            q.mul(m1).add(p).mul(m1)
        }
        65..=96 => {
            let (m0, m1) = (K2.sub(114), K2.sub(114).add(2 * bytes.n()));
            let (p, q) = (bytes.block(0, m0, 0, 0), bytes.block(32, m1, 0, 0));
            let r = bytes.block(s.len() - 32, m1, p, q);
            r.mul(9).add(p >> 17).add(q >> 21).mul(m1)
        }
        97..=256 => bytes.long(),
        _ => bytes.longest(),
    }
}

/// Wrapping arithmetic under short names.
trait Wrap {
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
}

impl Wrap for u64 {
    fn add(self, other: u64) -> u64 {
        self.wrapping_add(other)
    }
    fn sub(self, other: u64) -> u64 {
        self.wrapping_sub(other)
    }
    fn mul(self, other: u64) -> u64 {
        self.wrapping_mul(other)
    }
}

fn fold(v: u64) -> u64 {
    v ^ (v >> 47)
}

fn ror(v: u64, n: u32) -> u64 {
    v.rotate_right(n)
}

fn join(u: u64, v: u64, m: u64) -> u64 {
    let a = fold((u ^ v).mul(m));
    fold((v ^ a).mul(m)).mul(m)
}

type Pair = (u64, u64);

struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn n(&self) -> u64 {
        self.0.len() as u64
    }

    fn byte(&self, i: usize) -> u64 {
        self.0.get(i).copied().unwrap_or(0).into()
    }

    fn word(&self, i: usize) -> u64 {
        (0..8).fold(0, |word, k| word | self.byte(i + k) << (8 * k))
    }

    fn half(&self, i: usize) -> u64 {
        (0..4).fold(0, |word, k| word | self.byte(i + k) << (8 * k))
    }

    fn tiny(&self) -> u64 {
        let n = self.0.len();
        let y = self.byte(0) + (self.byte(n / 2) << 8);
        let z = self.n() + (self.byte(n - 1) << 2);
        fold(y.mul(K2) ^ z.mul(K0)).mul(K2)
    }

    fn short(&self) -> u64 {
        let m = K2.add(2 * self.n());
        let (a, b) = (self.word(0).add(K2), self.word(self.0.len() - 8));
        join(ror(b, 37).mul(m).add(a), ror(a, 25).add(b).mul(m), m)
    }

    fn medium(&self) -> u64 {
        let (n, m) = (self.0.len(), K2.add(2 * self.n()));
        let (a, b) = (self.word(0).mul(K1), self.word(8));
        let (c, d) = (self.word(n - 8).mul(m), self.word(n - 16).mul(K2));
        let u = ror(a.add(b), 43).add(ror(c, 30)).add(d);
        join(u, a.add(ror(b.add(K2), 18)).add(c), m)
    }

    /// A block of 32 bytes.
    fn block(&self, i: usize, m: u64, s0: u64, s1: u64) -> u64 {
        let (a, b) = (self.word(i).mul(K1), self.word(i + 8));
        let (c, d) = (self.word(i + 24).mul(m), self.word(i + 16).mul(K2));
        let u = ror(a.add(b), 43).add(ror(c, 30)).add(d).add(s0);
        let v = a.add(ror(b.add(K2), 18)).add(c).add(s1);
        let a = fold((u ^ v).mul(m));
        fold((v ^ a).mul(m))
    }

    fn pair(&self, i: usize, a: u64, b: u64) -> Pair {
        let [w, x, y, z] = [0, 8, 16, 24].map(|k| self.word(i + k));
        let a = a.add(w);
        let b = ror(b.add(a).add(z), 21);
        let c = a;
        let a = a.add(x).add(y);
        (a.add(z), b.add(ror(a, 44)).add(c))
    }

    /// Blocks of 64 bytes before the last 64 bytes, and the start of the latter.
    fn blocks(&self) -> (std::iter::StepBy<std::ops::Range<usize>>, usize) {
        let n = self.0.len();
        ((0..(n - 1) / 64 * 64).step_by(64), n - 64)
    }

    fn long(&self) -> u64 {
        let y = 81_u64.mul(K1).add(113);
        let mut state = Long {
            x: 81_u64.mul(K2).add(self.word(0)),
            y,
            z: fold(y.mul(K2).add(113)).mul(K2),
            v: (0, 0),
            w: (0, 0),
        };
        let (blocks, end) = self.blocks();
        for i in blocks {
            state.round(self, i, K1, 1);
        }
        let m = K1.add((state.z & 0xff) << 1);
        state.w.0 = state.w.0.add((self.n() - 1) & 63);
        state.v.0 = state.v.0.add(state.w.0);
        state.w.0 = state.w.0.add(state.v.0);
        state.round(self, end, m, 9);
        let Long { x, y, z, v, w } = state;
        let first = join(v.0, w.0, m).add(fold(y).mul(K0)).add(z);
        join(first, join(v.1, w.1, m).add(x), m)
    }

    fn longest(&self) -> u64 {
        let (mut x, mut y) = (81_u64, 113_u64);
        let mut z = fold(y.mul(K2)).mul(K2);
        let (mut v, mut w): (Pair, Pair) = ((81, 0), (0, 0));
        let mut u = x.sub(z);
        x = x.mul(K2);
        let m = K2.add(u & 0x82);
        let (blocks, e) = self.blocks();
        for i in blocks {
            let a: [u64; 8] = std::array::from_fn(|k| self.word(i + 8 * k));
            x = x.add(a[0]).add(a[1]);
            y = y.add(a[2]);
            z = z.add(a[3]);
            v = (v.0.add(a[4]), v.1.add(a[5]).add(a[1]));
            w = (w.0.add(a[6]), w.1.add(a[7]));
            x = ror(x, 26).mul(9);
            y = ror(y, 29);
            z = z.mul(m);
            v = (ror(v.0, 33), ror(v.1, 30));
            w.0 = (w.0 ^ x).mul(9);
            z = ror(z, 32).add(w.1);
            w.1 = w.1.add(z);
            z = z.mul(9);
            std::mem::swap(&mut u, &mut y);
            z = z.add(a[0]).add(a[6]);
            v = (v.0.add(a[2]), v.1.add(a[3]));
            w = (w.0.add(a[4]), w.1.add(a[5]).add(a[6]));
            x = x.add(a[1]);
            y = y.add(a[7]);
            y = y.add(v.0);
            v.0 = v.0.add(x.sub(y));
            v.1 = v.1.add(w.0);
            w.0 = w.0.add(v.1);
            w.1 = w.1.add(x.sub(y));
            x = x.add(w.1);
            w.1 = ror(w.1, 34);
            std::mem::swap(&mut u, &mut z);
        }
        u = u.mul(9);
        v = (ror(v.0, 20), ror(v.1, 28));
        w.0 = w.0.add((self.n() - 1) & 63);
        u = u.add(y);
        y = y.add(u);
        x = ror(y.sub(x).add(v.0).add(self.word(e + 8)), 37).mul(m);
        y = ror(y ^ v.1 ^ self.word(e + 48), 42).mul(m);
        x ^= w.1.mul(9);
        y = y.add(v.0).add(self.word(e + 40));
        z = ror(z.add(w.0), 33).mul(m);
        v = self.pair(e, v.1.mul(m), x.add(w.0));
        w = self.pair(e + 32, z.add(w.1), y.add(self.word(e + 16)));
        let last = |p: u64, q: u64, m: u64, r: u32| {
            let a = fold((p ^ q).mul(m));
            ror((q ^ a).mul(m), r).mul(m)
        };
        let first = join(v.0.add(x), w.0 ^ y, m).add(z).sub(u);
        last(first, last(v.1.add(y), w.1.add(z), K2, 30) ^ x, K2, 31)
    }
}

/// The state into which a string of 97 to 256 bytes is mixed.
struct Long {
    x: u64,
    y: u64,
    z: u64,
    v: Pair,
    w: Pair,
}

impl Long {
    fn round(&mut self, bytes: &Bytes<'_>, i: usize, m: u64, weight: u64) {
        let Long { x, y, z, v, w } = self;
        *x = ror(x.add(*y).add(v.0).add(bytes.word(i + 8)), 37).mul(m);
        *y = ror(y.add(v.1).add(bytes.word(i + 48)), 42).mul(m);
        *x ^= w.1.mul(weight);
        *y = y.add(v.0.mul(weight)).add(bytes.word(i + 40));
        *z = ror(z.add(w.0), 33).mul(m);
        *v = bytes.pair(i, v.1.mul(m), x.add(w.0));
        *w = bytes.pair(i + 32, z.add(w.1), y.add(bytes.word(i + 16)));
        std::mem::swap(x, z);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn known() {
        assert_eq!(super::hash("foo") as u32 as i32, 798_196_707);
    }
}
