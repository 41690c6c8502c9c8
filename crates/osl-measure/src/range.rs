//! The range of the values of an image's component: smallest, largest and mean. It must not know which
//! component that is.

use serde::Serialize;

/// Values that are looked at side by side, so that the processor need not wait for one to take the next.
const LANES: usize = 8;
/// Rows of lanes that stay in the cache from one loop to the next.
const TOGETHER: usize = 512;

/// Smallest, largest and mean value of a component. An infinity or NaN is `null` in JSON.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// The smallest value that is not NaN; infinite without one.
    pub min: f32,
    /// The largest value that is not NaN; negatively infinite without one.
    pub max: f32,
    /// The mean of all values; NaN if one of them is.
    pub mean: f64,
    #[serde(skip)]
    count: usize,
}

impl Default for Range {
    fn default() -> Range {
        Range { min: f32::INFINITY, max: f32::NEG_INFINITY, mean: 0.0, count: 0 }
    }
}

impl Range {
    /// Adds values.
    pub fn add(&mut self, values: &[f32]) {
        let mut sums = [0.0_f64; LANES];
        let (mut least, mut most) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        let (parts, rest) = values.as_chunks::<LANES>();
        // Each inner loop is one of vectors; in a common loop, the compiler mixes their lanes.
        for some in parts.chunks(TOGETHER) {
            for part in some {
                sums.iter_mut().zip(part).for_each(|(sum, value)| *sum += f64::from(*value));
            }
            for part in some {
                least.iter_mut().zip(part).for_each(smaller);
            }
            for part in some {
                most.iter_mut().zip(part).for_each(larger);
            }
        }
        sums.iter_mut().zip(rest).for_each(|(sum, value)| *sum += f64::from(*value));
        least.iter_mut().zip(rest).for_each(smaller);
        most.iter_mut().zip(rest).for_each(larger);
        let before = self.count as f64;
        self.count += values.len();
        let sum: f64 = sums.iter().sum();
        self.mean = (self.mean * before + sum) / self.count.max(1) as f64;
        self.min = least.into_iter().fold(self.min, f32::min);
        self.max = most.into_iter().fold(self.max, f32::max);
    }
}

/// The smaller of two values. A comparison with NaN is false, so NaN is never the smallest.
fn smaller((least, value): (&mut f32, &f32)) {
    *least = if *value < *least { *value } else { *least };
}

/// The larger of two values; see [`smaller`].
fn larger((most, value): (&mut f32, &f32)) {
    *most = if *value > *most { *value } else { *most };
}

#[cfg(test)]
mod tests {
    use super::Range;

    #[test]
    fn pieces_of_any_length_have_the_range_of_the_whole() {
        let values: Vec<f32> = (0..1000u32).map(|n| (n * 7919 % 1000) as f32 - 250.0).collect();
        for length in [1, 3, 8, 100, 1000] {
            let mut range = Range::default();
            values.chunks(length).for_each(|part| range.add(part));
            assert_eq!((range.min, range.max), (-250.0, 749.0), "{length}");
            assert!((range.mean - 249.5).abs() < 1e-9, "{length}: {}", range.mean);
        }
    }

    #[test]
    fn nan_is_in_the_mean_alone() {
        let mut range = Range::default();
        range.add(&[2.0, f32::NAN, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, f32::INFINITY]);
        assert_eq!((range.min, range.max), (-1.0, f32::INFINITY));
        assert!(range.mean.is_nan());
    }

    #[test]
    fn nothing_has_no_range() {
        let mut range = Range::default();
        range.add(&[]);
        assert_eq!((range.min, range.max, range.mean), (f32::INFINITY, f32::NEG_INFINITY, 0.0));
    }
}
