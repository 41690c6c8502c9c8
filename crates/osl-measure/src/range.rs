//! The range of the values of an image's component: smallest, largest and mean.

use osl_simd::{Isa, Kernel};
use rayon::prelude::*;
use serde::Serialize;

/// Values that are looked at side by side, so that the processor need not wait for one to take the next.
const LANES: usize = 16;
/// Rows of lanes that stay in the cache from one loop to the next.
const TOGETHER: usize = 256;
/// Values whose sum is added to that of others. It does not depend on the number of threads, so that a mean
/// has the same bits with each.
const PART: usize = 1 << 16;
/// The least number of values for which several threads are worth starting.
const MANY: usize = 1 << 19;

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
    sum: f64,
    #[serde(skip)]
    count: usize,
}

/// The values of a component: words of ints, or of floats.
#[derive(Clone, Copy, Debug)]
pub struct Values<'a> {
    /// The words.
    pub words: &'a [u32],
    /// Whether they are ints.
    pub ints: bool,
}

impl Default for Range {
    fn default() -> Range {
        Range { min: f32::INFINITY, max: f32::NEG_INFINITY, mean: 0.0, sum: 0.0, count: 0 }
    }
}

impl Range {
    /// The range of these values.
    #[must_use]
    pub fn of(values: Values<'_>) -> Range {
        let mut range = Range::default();
        values.words.chunks(PART).for_each(|words| range.join(part(Values { words, ..values })));
        range
    }

    /// Adds the values of each range, on all threads of the current pool.
    pub fn add_all(ranges: &mut [Range], values: &[Values<'_>]) {
        let parts: Vec<(usize, Values<'_>)> = values
            .iter()
            .enumerate()
            .flat_map(|(at, all)| all.words.chunks(PART).map(move |words| (at, Values { words, ..*all })))
            .collect();
        let count: usize = values.iter().map(|all| all.words.len()).sum();
        let found: Vec<Range> = match count < MANY {
            true => parts.iter().map(|(_, values)| part(*values)).collect(),
            false => parts.par_iter().map(|(_, values)| part(*values)).collect(),
        };
        for ((at, _), found) in parts.iter().zip(found) {
            if let Some(range) = ranges.get_mut(*at) {
                range.join(found);
            }
        }
    }

    /// Adds the values of another range.
    pub fn join(&mut self, other: Range) {
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
        self.sum += other.sum;
        self.count += other.count;
        self.mean = self.sum / self.count.max(1) as f64;
    }
}

/// The range of a part.
fn part(values: Values<'_>) -> Range {
    let isa = Isa::detect();
    match values.ints {
        true => isa.dispatch(Sweep(values.words, Ints)),
        false => isa.dispatch(Sweep(values.words, Floats)),
    }
}

/// What words mean.
trait Form {
    /// The value of a word, as a float.
    fn float(word: u32) -> f32;
}

struct Floats;
struct Ints;

impl Form for Floats {
    #[inline(always)]
    fn float(word: u32) -> f32 {
        f32::from_bits(word)
    }
}

impl Form for Ints {
    #[inline(always)]
    fn float(word: u32) -> f32 {
        word as i32 as f32
    }
}

/// One look at all values of a part.
struct Sweep<'a, F>(&'a [u32], F);

impl<F: Form> Kernel for Sweep<'_, F> {
    type Output = Range;
    #[inline(always)]
    fn run(self) -> Range {
        let mut sums = [0.0_f64; LANES];
        let (mut least, mut most) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        let (parts, rest) = self.0.as_chunks::<LANES>();
        // Each inner loop is one of vectors; in a common loop, the compiler mixes their lanes.
        for some in parts.chunks(TOGETHER) {
            for part in some {
                for (lane, word) in part.iter().enumerate() {
                    sums[lane] += f64::from(F::float(*word));
                }
            }
            for part in some {
                for (lane, word) in part.iter().enumerate() {
                    least[lane] = smaller(least[lane], F::float(*word));
                }
            }
            for part in some {
                for (lane, word) in part.iter().enumerate() {
                    most[lane] = larger(most[lane], F::float(*word));
                }
            }
        }
        for (lane, word) in rest.iter().enumerate() {
            let value = F::float(*word);
            sums[lane] += f64::from(value);
            (least[lane], most[lane]) = (smaller(least[lane], value), larger(most[lane], value));
        }
        let (sum, count) = (sums.iter().sum(), self.0.len());
        Range {
            min: least.into_iter().fold(f32::INFINITY, f32::min),
            max: most.into_iter().fold(f32::NEG_INFINITY, f32::max),
            mean: sum / count.max(1) as f64,
            sum,
            count,
        }
    }
}

/// The smaller of two values. A comparison with NaN is false, so NaN is never the smallest.
#[inline(always)]
fn smaller(least: f32, value: f32) -> f32 {
    if value < least { value } else { least }
}

/// The larger of two values; see [`smaller`].
#[inline(always)]
fn larger(most: f32, value: f32) -> f32 {
    if value > most { value } else { most }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(values: &[f32]) -> Vec<u32> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    fn floats(words: &[u32]) -> Values<'_> {
        Values { words, ints: false }
    }

    #[test]
    fn pieces_of_any_length_have_the_range_of_the_whole() {
        let values: Vec<u32> = (0..1000).map(|n: u32| ((n * 7919 % 1000) as f32 - 250.0).to_bits()).collect();
        for length in [1, 3, 16, 100, 1000] {
            let mut range = [Range::default()];
            values.chunks(length).for_each(|part| Range::add_all(&mut range, &[floats(part)]));
            assert_eq!((range[0].min, range[0].max), (-250.0, 749.0), "{length}");
            assert!((range[0].mean - 249.5).abs() < 1e-9, "{length}: {}", range[0].mean);
        }
    }

    #[test]
    fn a_mean_has_the_same_bits_with_any_number_of_threads() {
        let values: Vec<u32> = (0..MANY as u32 + 77).map(|n| (n as f32 * 0.37).sin().to_bits()).collect();
        let ints: Vec<u32> = (0..70_000).map(|n: i32| (n * 31 - 900_000) as u32).collect();
        let all = [floats(&values), Values { words: &ints, ints: true }];
        let of = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut ranges = [Range::default(); 2];
            pool.install(|| Range::add_all(&mut ranges, &all));
            ranges
        };
        let one = of(1);
        assert_eq!(one, [Range::of(all[0]), Range::of(all[1])]);
        assert_eq!((one[1].min, one[1].max), (-900_000.0, (69_999 * 31 - 900_000) as f32));
        for threads in [2, 3, 8] {
            let several = of(threads);
            assert_eq!(several, one);
            assert_eq!(several.map(|range| range.mean.to_bits()), one.map(|range| range.mean.to_bits()));
        }
    }

    #[test]
    fn every_instruction_set_finds_the_same() {
        let values: Vec<u32> = (0..4999u32).map(|n| ((n as f32 * 0.37).sin() * 1e-3).to_bits()).collect();
        let all: Vec<Range> =
            Isa::all().into_iter().map(|isa| isa.dispatch(Sweep(&values[..], Floats))).collect();
        assert!(all.iter().all(|range| *range == all[0]), "{all:?}");
    }

    #[test]
    fn nan_is_in_the_mean_alone() {
        let mut values = [0.0; 20];
        values[..3].copy_from_slice(&[2.0, f32::NAN, -1.0]);
        values[18] = f32::INFINITY;
        let range = Range::of(floats(&bits(&values)));
        assert_eq!((range.min, range.max), (-1.0, f32::INFINITY));
        assert!(range.mean.is_nan());
    }

    #[test]
    fn nothing_has_no_range() {
        let range = Range::of(floats(&[]));
        assert_eq!((range.min, range.max, range.mean), (f32::INFINITY, f32::NEG_INFINITY, 0.0));
    }
}
