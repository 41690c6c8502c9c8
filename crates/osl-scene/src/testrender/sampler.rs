//! The random numbers of a path: an Owen-scrambled Sobol sequence in three dimensions.
//!
//! Pictures with few paths per pixel are compared with recorded ones, so the numbers are part of the format.
//! Sources: S. Joe and F. Kuo's direction numbers; B. Burley, "Practical Hash-based Owen Scrambling", 2020.

/// The numbers of one path, three at a time.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    seed: u32,
    /// The index of the path with its bits reversed, as scrambling requires.
    index: u32,
}

/// Number of distinct points in the sequence.
const MASK: u32 = 0xff_ffff;

/// The columns of the third dimension.
const THIRD: [u32; 24] = [
    0x1, 0x3, 0x6, 0x9, 0x17, 0x3a, 0x71, 0xa3, 0x116, 0x339, 0x677, 0x9aa, 0x1601, 0x3903, 0x7706, 0xaa09,
    0x10117, 0x3033a, 0x60671, 0x909a3, 0x17_1616, 0x3a_3939, 0x71_7777, 0xa3_aaaa,
];

impl Sampler {
    /// The numbers of a path through a pixel.
    pub fn new(x: usize, y: usize, path: usize) -> Sampler {
        let seed = ((x as u32 & 2047) << 22) | ((y as u32 & 2047) << 11);
        Sampler { seed, index: (path as u32).reverse_bits() }
    }

    /// The next three numbers, from 0 to less than 1.
    pub fn three(&mut self) -> [f32; 3] {
        let seeds = [0, 1, 2, 3].map(|k| hash(self.seed.wrapping_add(k)));
        self.seed = self.seed.wrapping_add(4);
        let k = scramble(self.index, seeds[0]) & MASK;
        let (mut second, mut third, mut column) = (0, 0, 1_u32);
        for (bit, other) in THIRD.iter().enumerate() {
            if (k >> bit) & 1 == 1 {
                second ^= column;
                third ^= other;
            }
            column ^= column << 1;
        }
        let unit = |value: u32, seed: u32| (scramble(value, seed) >> 8) as f32 / (1 << 24) as f32;
        [unit(k, seeds[1]), unit(second, seeds[2]), unit(third, seeds[3])]
    }
}

/// Mixes the bits of a seed.
fn hash(mut s: u32) -> u32 {
    s ^= s >> 16;
    s = s.wrapping_mul(0x21f0_aaad);
    s ^= s >> 15;
    s = s.wrapping_mul(0xd35a_2d97);
    s ^ (s >> 15)
}

/// Nested uniform scrambling of a number with reversed bits; the result has them in order.
fn scramble(mut p: u32, seed: u32) -> u32 {
    p ^= p.wrapping_mul(0x3d20_adea);
    p = p.wrapping_add(seed);
    p = p.wrapping_mul((seed >> 16) | 1);
    p ^= p.wrapping_mul(0x0552_6c56);
    p ^= p.wrapping_mul(0x53a2_2864);
    p.reverse_bits()
}

/// Maps a number from 0 to 1 to an offset from a pixel's center, distributed as a tent of width 2.
pub fn tent(j: f32) -> f32 {
    let j = 2.0 * j;
    if j < 1.0 { j.sqrt() - 1.0 } else { 1.0 - (2.0 - j).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_of_a_pixel_are_stratified_in_every_dimension() {
        for count in [16_usize, 64, 256] {
            let mut cells = vec![[0; 3]; count];
            for path in 0..count {
                let mut sampler = Sampler::new(5, 7, path);
                sampler.three();
                for (dimension, x) in sampler.three().into_iter().enumerate() {
                    assert!((0.0..1.0).contains(&x));
                    cells[(x * count as f32) as usize][dimension] += 1;
                }
            }
            assert!(cells.iter().all(|c| *c == [1; 3]), "one path in each interval");
        }
    }

    #[test]
    fn the_first_two_dimensions_fill_squares() {
        let mut cells = [0; 64];
        for path in 0..64 {
            let [x, y, _] = Sampler::new(1, 2, path).three();
            cells[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
        }
        assert_eq!(cells, [1; 64]);
    }

    #[test]
    fn pixels_and_calls_differ() {
        let mut a = Sampler::new(3, 4, 0);
        let (first, second) = (a.three(), a.three());
        assert_ne!(first, second);
        assert_ne!(first, Sampler::new(4, 3, 0).three());
        assert_eq!(first, Sampler::new(3 + 2048, 4, 0).three(), "the pattern repeats after 2048 pixels");
    }

    #[test]
    fn a_tent_reaches_one_pixel_to_both_sides() {
        assert_eq!((tent(0.0), tent(0.5)), (-1.0, 0.0));
        assert!((tent(0.125) + 0.5).abs() < 1e-6 && (tent(0.875) - 0.5).abs() < 1e-6);
    }
}
