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
    /// Variance of one sample within its rectangle.
    pub(super) variance: f32,
    /// Number of samples.
    pub(super) count: u32,
}

impl Block {
    /// The mean.
    pub(super) fn mean(&self) -> f32 {
        (self.sum / self.weight) as f32
    }

    /// Adds later samples. Their variance replaces the earlier one, because their rectangles are smaller.
    pub(super) fn add(&mut self, later: &Block) {
        self.weight += later.weight;
        self.sum += later.sum;
        self.variance = later.variance;
        self.count += later.count;
    }

    /// The standard error of the mean; NaN if any sample is NaN.
    pub(super) fn error(&self) -> f32 {
        (self.variance / self.count.max(1) as f32).sqrt()
    }
}

/// Sums up the samples of a pixel.
pub(super) fn block(words: &[u32], kind: Kind, signs: &[f32]) -> Block {
    let (mut sum, mut weight) = (0.0, words.len() as f64);
    add(&mut sum, words, kind, signs);
    if !signs.is_empty() {
        weight = 0.0;
        signs.iter().take(words.len()).for_each(|sign| weight += f64::from(*sign));
        weight = steady(weight);
    }
    Block { weight, sum, variance: 0.0, count: words.len() as u32 }
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

fn value(word: u32, kind: Kind) -> f32 {
    if kind == Kind::Int { word as i32 as f32 } else { f32::from_bits(word) }
}

/// Which samples of pixels show their variance: the later half of samples 0..n, because the two halves are
/// complete patterns, as the rounds that double the sample count are. With up to four samples, all are used.
pub(super) struct Shown<'a> {
    pattern: &'a Pattern,
    /// The first of them, among the words of a pixel.
    first: usize,
    level: u32,
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

/// Pixels whose samples are summed up in step, so that the compiler puts them into vectors.
const STEP: usize = 8;

/// The samples of one plane for some pixels, pixel by pixel.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    /// The values, and the weights unless all are 1.
    pub(super) words: &'a [u32],
    pub(super) signs: &'a [f32],
    /// Number of samples of each pixel.
    pub(super) each: usize,
    pub(super) kind: Kind,
}

impl<'a> Samples<'a> {
    /// Those of so many pixels from one on.
    pub(super) fn some(&self, first: usize, pixels: usize) -> Samples<'a> {
        let range = first * self.each..(first + pixels) * self.each;
        Samples {
            words: self.words.get(range.clone()).unwrap_or(&[]),
            signs: self.signs.get(range).unwrap_or(&[]),
            ..*self
        }
    }
}

/// Sums up the samples of each of some pixels, and computes their variance if `shown` says how, given the
/// order of the samples of each pixel.
pub(super) fn blocks(samples: Samples<'_>, shown: Option<(&Shown<'_>, &[&[u32]])>, to: &mut [Block]) {
    let mut cells = Vec::new();
    let orders = |from: usize, count: usize| {
        shown.map(|(shown, orders)| (shown, orders.get(from..from + count).unwrap_or(&[])))
    };
    let (mut first, (steps, rest)) = (0, to.as_chunks_mut::<STEP>());
    for to in steps {
        *to = in_step(&samples.some(first, STEP), orders(first, STEP), &mut cells);
        first += STEP;
    }
    let mut cells = Vec::new();
    for to in rest {
        [*to] = in_step(&samples.some(first, 1), orders(first, 1), &mut cells);
        first += 1;
    }
}

/// The same for `N` pixels in step. `cells` is working memory.
fn in_step<const N: usize>(
    samples: &Samples<'_>,
    shown: Option<(&Shown<'_>, &[&[u32]])>,
    cells: &mut Vec<[f32; N]>,
) -> [Block; N] {
    let Samples { words, signs, each, kind } = *samples;
    let mut blocks = [Block::default(); N];
    let own = words.chunks_exact(each);
    for (at, (block, own)) in blocks.iter_mut().zip(own).enumerate() {
        *block = self::block(own, kind, signs.get(at * each..(at + 1) * each).unwrap_or(&[]));
    }
    let Some((shown, orders)) = shown else { return blocks };
    cells.clear();
    cells.resize(1 << shown.level, [0.0; N]);
    for (pixel, order) in orders.iter().enumerate().take(N) {
        let own = pixel * each + shown.first..(pixel + 1) * each;
        let words = words.get(own.clone()).unwrap_or(&[]);
        let cells = cells.iter_mut().map(|cell| &mut cell[pixel]).zip(*order);
        match (kind, signs.get(own)) {
            // The usual case, without a question for each sample.
            (Kind::Float, None) => {
                cells.for_each(|(cell, i)| {
                    *cell = words.get(*i as usize).map_or(0.0, |word| f32::from_bits(*word));
                });
            }
            (_, signs) => {
                let sign = |i: usize| signs.and_then(|signs| signs.get(i)).copied().unwrap_or(1.0);
                let at = |i: usize| words.get(i).map_or(0.0, |word| value(*word, kind) * sign(i));
                cells.for_each(|(cell, i)| *cell = at(*i as usize));
            }
        }
    }
    for (block, variance) in blocks.iter_mut().zip(within(shown.level, cells)) {
        let scale = if signs.is_empty() { 1.0 } else { f64::from(block.count) / block.weight };
        let scale = (scale * scale) as f32;
        block.variance = if block.sum.is_finite() { variance * scale } else { f32::NAN };
    }
    blocks
}

/// The variance within rectangles, assumed equal along both axes, for each of `N` pixels.
fn within<const N: usize>(level: u32, cells: &[[f32; N]]) -> [f32; N] {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn with_variance(words: &[u32], pattern: &Pattern, pixel: u32) -> Block {
        let shown = Shown::new(pattern, &(0..words.len() as u32)).expect("a power of two");
        let samples = Samples { words, signs: &[], each: words.len(), kind: Kind::Float };
        let mut found = [Block::default()];
        blocks(samples, Some((&shown, &[shown.order(pixel)])), &mut found);
        found[0]
    }

    /// Root mean square of the true and the estimated errors over many pixels.
    fn errors(n: u32, mean: f64, f: impl Fn([f32; 2], u32, usize) -> f32) -> (f64, f64) {
        let pattern = Pattern::new(n, 3);
        let (mut actual, mut estimated) = (0.0, 0.0);
        let pixels = 500;
        for pixel in 0..pixels {
            let own = &pattern.of(pixel)[..n as usize];
            let words: Vec<u32> = own.iter().enumerate().map(|(i, s)| f(*s, pixel, i).to_bits()).collect();
            let block = with_variance(&words, &pattern, pixel);
            actual += (f64::from(block.mean()) - mean).powi(2);
            estimated += f64::from(block.error()).powi(2);
        }
        ((actual / f64::from(pixels)).sqrt(), (estimated / f64::from(pixels)).sqrt())
    }

    #[test]
    fn estimates_of_noise_edges_and_slopes_are_of_the_right_size() {
        for n in [8, 16, 64, 256] {
            let white = |_: [f32; 2], pixel: u32, i: usize| {
                (super::super::pattern::hash(pixel * 7919 + i as u32) >> 8) as f32 / (1 << 24) as f32
            };
            let (actual, estimated) = errors(n, 0.5, white);
            assert!((0.9..1.2).contains(&(estimated / actual)), "noise, {n}: {actual} {estimated}");
            let edge = |[x, y]: [f32; 2], _: u32, _: usize| f32::from(u8::from(x + 0.37 * y > 0.6));
            let (actual, estimated) = errors(n, 1.0 - (0.6 - 0.185), edge);
            assert!((0.8..3.0).contains(&(estimated / actual)), "edge, {n}: {actual} {estimated}");
            let (actual, estimated) = errors(n, 1.0, |[x, y], _, _| x + y);
            assert!(estimated > actual, "slope, {n}: {actual} {estimated}");
        }
    }

    #[test]
    fn what_is_no_number_says_so() {
        let pattern = Pattern::new(4, 0);
        let words = [1.0_f32, f32::NAN, 0.0, 0.0].map(f32::to_bits);
        let block = with_variance(&words, &pattern, 0);
        assert!(block.mean().is_nan() && block.error().is_nan());
    }
}
