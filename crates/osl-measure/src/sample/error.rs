//! Sums over the samples of a pixel, and the estimated error of their mean.
//!
//! The samples are stratified: each equal rectangle of the pixel contains one. So their mean is far more
//! accurate than that of independent samples, most of all where the shader is smooth. The remaining error is
//! estimated from the differences between neighbouring rectangles.

use super::pattern::Pattern;
use osl_ir::ir::Kind;
use std::ops::Range;

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

/// Sums up the samples of a pixel.
pub(super) fn block(words: &[u32], kind: Kind, signs: &[f32]) -> Block {
    let mut sum = 0.0;
    add(&mut sum, words, kind, signs);
    Block { weight: weight(words.len(), signs), sum }
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
