//! Where the samples of a pixel lie: Owen-scrambled Sobol points (Burley 2020). The first 2^m points of a
//! pixel have one point in each of 2^m equal rectangles. A few dozen scrambles are kept. A hash of the pixel
//! selects one, so that an image is the same however it is cut into pieces.

use rayon::prelude::*;
use std::sync::Arc;

/// Maximum samples per pixel: the length of the sequence, and so a property of the pattern.
pub const MAX_SAMPLES: u32 = 1 << 16;

/// Number of scrambles.
const SCRAMBLES: usize = 64;
/// So many more samples of each are made by all threads.
const MANY: usize = 64;

/// The samples of all pixels of an image, in 0..1 along both axes. A copy shares them.
#[derive(Clone, Debug)]
pub struct Pattern {
    seed: u32,
    count: usize,
    /// The first `count` samples of each scramble.
    samples: Arc<[[f32; 2]]>,
    /// For each sample count 2^m: the index of each rectangle's sample among the first and among the second
    /// 2^m samples of a scramble.
    orders: Arc<[Vec<u32>]>,
}

impl Pattern {
    /// Makes a pattern of `count` samples or more per pixel, at most [`MAX_SAMPLES`]. Another seed gives
    /// other samples.
    pub fn new(count: u32, seed: u32) -> Pattern {
        Pattern { seed, count: 0, samples: Arc::default(), orders: Arc::default() }.extended(count)
    }

    /// The same pattern with `count` samples or more per pixel. What is known is kept.
    fn extended(self, count: u32) -> Pattern {
        let count = count.clamp(1, MAX_SAMPLES).next_power_of_two() as usize;
        let scrambled = |scramble: usize| {
            let own = hash(scramble as u32 ^ self.seed.rotate_left(16));
            let known = self.samples.get(scramble * self.count..(scramble + 1) * self.count).unwrap_or(&[]);
            let more = known.len() as u32..count as u32;
            let mut samples = known.to_vec();
            samples.extend(more.map(|i| [0, 1].map(|axis| sobol_burley::sample(i, axis, own))));
            samples
        };
        let is_long = count - self.count >= MANY;
        let each: Vec<Vec<[f32; 2]>> = match is_long {
            true => (0..SCRAMBLES).into_par_iter().with_min_len(SCRAMBLES / 8).map(scrambled).collect(),
            false => (0..SCRAMBLES).map(scrambled).collect(),
        };
        let (seed, samples) = (self.seed, each.concat().into());
        let pattern = Pattern { seed, count, samples, orders: Arc::default() };
        // With more samples, the largest of the known counts has a second half.
        let order = |level: u32| match self.orders.get(level as usize) {
            Some(known) if 1 << level < self.count => known.clone(),
            _ => pattern.find_order(level),
        };
        let orders = (0..=count.trailing_zeros()).map(order).collect();
        Pattern { orders, ..pattern }
    }

    /// Samples per pixel.
    pub fn count(&self) -> u32 {
        self.count as u32
    }

    /// The same pattern, extended if it has fewer than `count` samples.
    #[must_use]
    pub fn with(self, count: u32) -> Pattern {
        if count <= self.count() { self } else { self.extended(count) }
    }

    /// The samples of a pixel; pixels are numbered row by row.
    pub fn of(&self, pixel: u32) -> &[[f32; 2]] {
        let first = self.first(pixel);
        self.samples.get(first..first + self.count).unwrap_or(&[])
    }

    /// The samples of all scrambles.
    pub(super) fn all(&self) -> &[[f32; 2]] {
        &self.samples
    }

    /// Where those of a pixel begin among them.
    pub(super) fn first(&self, pixel: u32) -> usize {
        self.scramble(pixel) * self.count
    }

    fn scramble(&self, pixel: u32) -> usize {
        hash(pixel.wrapping_mul(0x9e37_79b1) ^ self.seed) as usize % SCRAMBLES
    }

    /// Columns and rows of the rectangles that contain one of 2^level samples each.
    pub(super) fn rectangles(level: u32) -> (usize, usize) {
        (1 << level.div_ceil(2), 1 << (level / 2))
    }

    /// For the rectangles, row by row, the index of each one's sample among the first or the second 2^level
    /// samples of a pixel.
    pub(super) fn order(&self, pixel: u32, level: u32, second: bool) -> &[u32] {
        let size = 1 << level;
        let halves = if size < self.count { 2 } else { 1 };
        let first = (self.scramble(pixel) * halves + usize::from(second)) * size;
        self.orders.get(level as usize).and_then(|o| o.get(first..first + size)).unwrap_or(&[])
    }

    fn find_order(&self, level: u32) -> Vec<u32> {
        let size = 1 << level;
        let (columns, rows) = Pattern::rectangles(level);
        let mut orders = Vec::new();
        for samples in self.samples.chunks(self.count) {
            for half in samples.chunks(size).take(2) {
                let mut order = vec![0; size];
                for (i, [x, y]) in half.iter().enumerate() {
                    let (x, y) = ((x * columns as f32) as usize, (y * rows as f32) as usize);
                    if let Some(found) = order.get_mut(y * columns + x) {
                        *found = i as u32;
                    }
                }
                orders.extend(order);
            }
        }
        orders
    }
}

/// Mixes the bits of a number (Wellons' lowbias32).
pub(super) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_rectangle_has_one_sample_of_the_first_and_of_the_second() {
        let pattern = Pattern::new(64, 7);
        for pixel in 0..50 {
            for level in 0..=5 {
                for second in [false, true] {
                    let mut order = pattern.order(pixel, level, second).to_vec();
                    order.sort_unstable();
                    let all: Vec<u32> = (0..1 << level).collect();
                    assert_eq!(order, all, "pixel {pixel}, 2^{level} samples");
                }
            }
        }
    }

    #[test]
    fn more_samples_begin_with_the_same() {
        let (few, many) = (Pattern::new(4, 1), Pattern::new(4, 1).with(100));
        assert_eq!(many.count(), 128);
        assert_eq!(few.of(1234), &many.of(1234)[..4]);
        assert_ne!(few.of(1234), few.of(1235));
        let whole = Pattern::new(100, 1);
        assert_eq!((many.all(), &many.orders), (whole.all(), &whole.orders));
    }
}
