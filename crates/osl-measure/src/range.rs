//! The range of the values of an image's component: smallest, largest and mean. It must not know which
//! component that is.

use serde::Serialize;

/// Values that are looked at side by side, so that the processor need not wait for one to take the next.
const LANES: usize = 8;

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
        let mut lanes = [(0.0f64, f32::INFINITY, f32::NEG_INFINITY); LANES];
        let (parts, rest) = values.as_chunks::<LANES>();
        for part in parts {
            lanes.iter_mut().zip(part).for_each(take);
        }
        lanes.iter_mut().zip(rest).for_each(take);
        let before = self.count as f64;
        self.count += values.len();
        let sum: f64 = lanes.iter().map(|lane| lane.0).sum();
        self.mean = (self.mean * before + sum) / self.count.max(1) as f64;
        self.min = lanes.iter().fold(self.min, |min, lane| min.min(lane.1));
        self.max = lanes.iter().fold(self.max, |max, lane| max.max(lane.2));
    }
}

/// Adds a value to the sum, the smallest and the largest value of a lane. A comparison with NaN is false, so
/// NaN is never the smallest or the largest.
fn take(((sum, min, max), value): (&mut (f64, f32, f32), &f32)) {
    *sum += f64::from(*value);
    *min = if *value < *min { *value } else { *min };
    *max = if *value > *max { *value } else { *max };
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
