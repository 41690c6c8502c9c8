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

/// Up to this many sample values fit on the stack: a short array, which is quickly cleared, and a long one.
const FEW: usize = 8;
const MANY: usize = 64;

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

/// The variance of the samples of a block, in the order of its pixel.
pub(super) fn variance(
    block: &Block,
    (words, kind, signs): (&[u32], Kind, &[f32]),
    (shown, order): (&Shown<'_>, &[u32]),
) -> f32 {
    if !block.sum.is_finite() {
        return f32::NAN;
    }
    let at = |i: usize| {
        let x = words.get(i).map_or(0.0, |word| value(*word, kind));
        signs.get(i).map_or(x, |sign| x * sign)
    };
    let scale = if signs.is_empty() { 1.0 } else { words.len() as f64 / block.weight };
    let scale = (scale * scale) as f32;
    let mut few = [0.0; FEW];
    let mut many = [0.0; MANY];
    let mut large = Vec::new();
    let cells = match order.len() {
        length if length <= FEW => few.get_mut(..length),
        length if length <= MANY => many.get_mut(..length),
        length => {
            large.resize(length, 0.0);
            Some(&mut large[..])
        }
    };
    let Some(cells) = cells else { return 0.0 };
    cells.iter_mut().zip(order).for_each(|(cell, i)| *cell = at(shown.first + *i as usize));
    within(shown.level, cells) * scale
}

/// The variance within rectangles, assumed equal along both axes.
fn within(level: u32, cells: &[f32]) -> f32 {
    // Loops over few cells are unrolled if their lengths are known.
    match level {
        1 => within_of(2, 1, cells),
        2 => within_of(2, 2, cells),
        3 => within_of(4, 2, cells),
        4 => within_of(4, 4, cells),
        _ => {
            let (columns, rows) = Pattern::rectangles(level);
            within_of(columns, rows, cells)
        }
    }
}

#[inline(always)]
fn within_of(columns: usize, rows: usize, cells: &[f32]) -> f32 {
    let Some(cells) = cells.get(..columns * rows) else { return 0.0 };
    let across = along(rows, columns, |y, x| cells[y * columns + x]);
    let down = along(columns, rows, |x, y| cells[y * columns + x]);
    match (across, down) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (a, b) => a.or(b).unwrap_or(0.0),
    }
}

/// The mean square deviation of values from the line through their neighbours, so that a linear gradient does
/// not count. With only two values, the deviation from each other.
#[inline(always)]
fn along(lines: usize, length: usize, at: impl Fn(usize, usize) -> f32) -> Option<f32> {
    let mut total = 0.0;
    match length {
        0 | 1 => None,
        2 => {
            (0..lines).for_each(|line| total += square(at(line, 1) - at(line, 0)));
            Some(0.5 * total / lines as f32)
        }
        _ => {
            for line in 0..lines {
                let (mut a, mut b) = (at(line, 0), at(line, 1));
                for i in 2..length {
                    let c = at(line, i);
                    total += square(a - 2.0 * b + c);
                    (a, b) = (b, c);
                }
            }
            // Independent values of variance s give 6 s.
            Some(total / (6 * lines * (length - 2)) as f32)
        }
    }
}

fn square(x: f32) -> f32 {
    x * x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_variance(words: &[u32], pattern: &Pattern, pixel: u32) -> Block {
        let found = block(words, Kind::Float, &[]);
        let shown = Shown::new(pattern, &(0..words.len() as u32)).expect("a power of two");
        let order = shown.order(pixel);
        Block { variance: variance(&found, (words, Kind::Float, &[]), (&shown, order)), ..found }
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
