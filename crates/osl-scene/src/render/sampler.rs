//! Random numbers from 0 to 1 for a sample of a pixel: they depend only on the seed, the pixel and the
//! sample.

use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};

/// Mixes bits. The finalizer of MurmurHash3, by A. Appleby.
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x85eb_ca6b);
    x ^= x >> 13;
    x = x.wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

/// The numbers of one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    index: u32,
    seed: u32,
}

impl Sampler {
    /// Sample number `index` of a pixel.
    pub(super) fn new(pixel: u32, index: u32, seed: u32) -> Sampler {
        Sampler { index: index & 0xffff, seed: mix(pixel ^ mix(seed.wrapping_add(0x9e37_79b9))) }
    }

    /// Four numbers; another `set` gives others. The numbers of a pixel's samples are evenly distributed.
    pub(super) fn four(&self, set: u32) -> [f32; 4] {
        let round = set / NUM_DIMENSION_SETS_4D;
        let seed = if round == 0 { self.seed } else { mix(self.seed ^ round) };
        sample_4d(self.index, set % NUM_DIMENSION_SETS_4D, seed)
    }

    /// An endless stream of independent numbers.
    pub(super) fn stream(&self, set: u32) -> Stream {
        Stream(mix(self.seed ^ mix(self.index ^ mix(set))) | 1)
    }
}

/// A stream of numbers: G. Marsaglia's xorshift, 2003.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream(u32);

impl Stream {
    pub(super) fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (mix(self.0) >> 8) as f32 / (1 << 24) as f32
    }
}
