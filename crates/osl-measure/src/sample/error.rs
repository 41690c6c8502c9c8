//! Sums over the samples of a pixel, and the estimated error of their mean.
//!
//! The samples are stratified: each equal rectangle of the pixel contains one. So their mean is far more
//! accurate than that of independent samples, most of all where the shader is smooth. The remaining error is
//! estimated from the differences between neighbouring rectangles.

use super::pattern::Pattern;
use osl_ir::ir::Kind;
use std::ops::Range;
use std::sync::Arc;

/// The sums over some samples of a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Block {
    /// Sum of the weights.
    pub(super) weight: f64,
    /// Sum of values times weights.
    pub(super) sum: f64,
}

impl Block {
    /// The mean.
    pub(super) fn mean(&self) -> f32 {
        (self.sum / self.weight) as f32
    }
}

/// What `of` makes of the sums of each pixel with `each` samples. `signs` has the weights of all samples, or
/// none if all are 1.
pub(super) fn blocks<T>(
    (words, kind): (&[u32], Kind),
    each: usize,
    signs: &[f32],
    of: impl Fn(Block) -> T,
) -> Vec<T> {
    if signs.is_empty() && kind != Kind::Int {
        // Of a known number, without a question for each sample.
        match each {
            2 => return few::<2, T>(words, of),
            4 => return few::<4, T>(words, of),
            8 => return few::<8, T>(words, of),
            16 => return few::<16, T>(words, of),
            _ => {}
        }
    }
    let one = |(own, at): (&[u32], usize)| {
        let (signs, mut sum) = (signs.get(at..at + each).unwrap_or(&[]), 0.0);
        add(&mut sum, own, kind, signs);
        of(Block { weight: weight(own.len(), signs), sum })
    };
    words.chunks_exact(each).zip((0..).step_by(each)).map(one).collect()
}

/// The same for `EACH` floats of each pixel, all with the weight 1.
fn few<const EACH: usize, T>(words: &[u32], of: impl Fn(Block) -> T) -> Vec<T> {
    let one = |own: &[u32; EACH]| {
        let sum = own.iter().fold(0.0, |sum, word| sum + f64::from(f32::from_bits(*word)));
        of(Block { weight: EACH as f64, sum })
    };
    words.as_chunks::<EACH>().0.iter().map(one).collect()
}

/// The sum of the weights of some samples. `signs` has the weight of each, or none if all are 1.
#[inline(always)]
pub(super) fn weight(samples: usize, signs: &[f32]) -> f64 {
    if signs.is_empty() {
        return samples as f64;
    }
    let mut weight = 0.0;
    signs.iter().take(samples).for_each(|sign| weight += f64::from(*sign));
    steady(weight)
}

/// Adds the samples of a pixel, times their weights, to a sum.
pub(super) fn add(sum: &mut f64, words: &[u32], kind: Kind, signs: &[f32]) {
    if signs.is_empty() {
        words.iter().for_each(|word| *sum += f64::from(value(*word, kind)));
    } else {
        words.iter().zip(signs).for_each(|(word, sign)| *sum += f64::from(value(*word, kind) * sign));
    }
}

/// The sum of the weights of a few samples may be nearly 0. This keeps the result imprecise but not absurd.
pub(super) fn steady(weight: f64) -> f64 {
    if weight.abs() < 0.25 { 0.25_f64.copysign(weight) } else { weight }
}

/// The value of a sample.
#[inline(always)]
pub(super) fn value(word: u32, kind: Kind) -> f32 {
    if kind == Kind::Int { word as i32 as f32 } else { f32::from_bits(word) }
}

/// Which samples of pixels show their variance: the later half of samples 0..n, because the two halves are
/// complete patterns, as the rounds that double the sample count are. With up to four samples, all are used.
pub(super) struct Shown<'a> {
    pattern: &'a Pattern,
    /// The first of them, among the words of a pixel.
    pub(super) first: usize,
    /// There are 2^level of them.
    pub(super) level: u32,
    second: bool,
}

impl<'a> Shown<'a> {
    /// `None` if these samples show no variance.
    pub(super) fn new(pattern: &'a Pattern, samples: &Range<u32>) -> Option<Shown<'a>> {
        let end = samples.end as usize;
        if !end.is_power_of_two() || end == 1 {
            return None;
        }
        let from = if samples.start == 0 && end <= 4 { 0 } else { end / 2 };
        let first = from.saturating_sub(samples.start as usize);
        Some(Shown { pattern, first, level: (end - from).trailing_zeros(), second: from > 0 })
    }

    /// The order of a pixel's samples, which is the same for all its planes.
    pub(super) fn order(&self, pixel: u32) -> &'a [u32] {
        self.pattern.order(pixel, self.level, self.second)
    }
}

/// The variance within rectangles, assumed equal along both axes, for each of `N` pixels.
#[inline(always)]
pub(super) fn within<const N: usize>(level: u32, cells: &[[f32; N]]) -> [f32; N] {
    let (columns, rows) = Pattern::rectangles(level);
    let Some(cells) = cells.get(..columns * rows) else { return [0.0; N] };
    let across = along(rows, columns, |y, x| &cells[y * columns + x]);
    let down = along(columns, rows, |x, y| &cells[y * columns + x]);
    match (across, down) {
        (Some(a), Some(b)) => std::array::from_fn(|lane| 0.5 * (a[lane] + b[lane])),
        (a, b) => a.or(b).unwrap_or([0.0; N]),
    }
}

/// The mean square deviation of values from the line through their neighbours, so that a linear gradient does
/// not count. With only two values, the deviation from each other.
#[inline(always)]
fn along<'a, const N: usize>(
    lines: usize,
    length: usize,
    at: impl Fn(usize, usize) -> &'a [f32; N],
) -> Option<[f32; N]> {
    let mut total = [0.0; N];
    let divisor = match length {
        0 | 1 => return None,
        2 => {
            for line in 0..lines {
                let (a, b) = (at(line, 0), at(line, 1));
                for lane in 0..N {
                    let apart = b[lane] - a[lane];
                    total[lane] += apart * apart;
                }
            }
            2.0 * lines as f32
        }
        _ => {
            for line in 0..lines {
                for i in 2..length {
                    let (a, b, c) = (at(line, i - 2), at(line, i - 1), at(line, i));
                    for lane in 0..N {
                        let apart = a[lane] - 2.0 * b[lane] + c[lane];
                        total[lane] += apart * apart;
                    }
                }
            }
            // Independent values of variance s give 6 s.
            (6 * lines * (length - 2)) as f32
        }
    };
    Some(total.map(|total| total / divisor))
}

/// Factors on the errors of the planes, so that one bound holds for all.
#[derive(Clone, Debug)]
pub(super) struct Weights(Arc<[f32]>);

impl Weights {
    /// The same bound for all planes.
    pub(super) fn equal(planes: usize) -> Weights {
        Weights(vec![1.0; planes].into())
    }

    /// The smallest of some bounds, and the factors that make it stand for all. A plane with an infinite
    /// bound does not count.
    pub(super) fn of(bounds: &[f32]) -> (f32, Weights) {
        let smallest = bounds.iter().copied().fold(f32::INFINITY, f32::min);
        let smallest = if smallest.is_finite() { smallest } else { 1.0 };
        let weight = |bound: &f32| if bound.is_finite() { smallest / bound } else { 0.0 };
        (smallest, Weights(bounds.iter().map(weight).collect()))
    }

    /// The factor of each plane.
    pub(super) fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        self.0.iter().copied()
    }
}

/// An error times the factor of its plane. An error without a bound does not count, even if it is NaN.
#[inline(always)]
pub(super) fn weighted(error: f32, weight: f32) -> f32 {
    if weight > 0.0 { error * weight } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_smallest_bound_stands_for_all() {
        let (smallest, weights) = Weights::of(&[0.5, 0.125, f32::INFINITY]);
        assert_eq!(smallest, 0.125);
        assert_eq!(weights.iter().collect::<Vec<_>>(), [0.25, 1.0, 0.0]);
        assert_eq!(weighted(f32::NAN, 0.0), 0.0);
    }
}
