//! A round of samples of some pixels: their new sums, how far the round moved their means, and their errors.
//!
//! All planes of eight pixels are examined together, so that the compiler puts the pixels into vectors.

use super::error::{Shown, value, weight, within};
use super::error::{Weights, weighted};
use osl_exec::Plane;
use osl_ir::ir::Kind;
use osl_simd::{Isa, Kernel};
use std::ops::Range;

/// Pixels per SIMD group.
pub(super) const STEP: usize = 8;

/// The samples of a round: of each pixel the same number.
pub(super) struct Round<'a> {
    /// The values, pixel by pixel, and the weights unless all are 1.
    pub(super) planes: &'a [Plane],
    pub(super) signs: &'a [f32],
    /// Samples of each pixel in this round, and in all rounds so far.
    pub(super) each: usize,
    pub(super) samples: u32,
    /// Which of them show the error, if that is wanted.
    pub(super) shown: Option<&'a Shown<'a>>,
    /// Factors on the errors of the planes.
    pub(super) weights: &'a Weights,
}

/// The sums of earlier rounds: plane by plane those of all pixels, and the weights unless all are 1.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    pub(super) values: Vec<Vec<f64>>,
    pub(super) weights: Vec<f64>,
}

impl Sums {
    /// No samples of some pixels.
    pub(super) fn new(planes: usize, pixels: usize) -> Sums {
        Sums { values: vec![vec![0.0; pixels]; planes], weights: Vec::new() }
    }

    /// Takes over the sums that a round found at some slots.
    pub(super) fn take(&mut self, slots: &[usize], found: &Found) {
        if !found.weights.is_empty() {
            self.weights.resize(self.values.first().map_or(0, Vec::len), 0.0);
            put(slots, &found.weights, &mut self.weights);
        }
        self.values.iter_mut().zip(&found.sums).for_each(|(to, from)| put(slots, from, to));
    }

    /// The means, plane by plane, given the number of samples of each pixel.
    pub(super) fn means(&self, each: &[u32]) -> Vec<Vec<f32>> {
        let mean = |sum: &f64, weight: f64| (sum / weight) as f32;
        let plane = |plane: &Vec<f64>| match self.weights.is_empty() {
            true => plane.iter().zip(each).map(|(sum, each)| mean(sum, f64::from(*each))).collect(),
            false => plane.iter().zip(&self.weights).map(|(sum, weight)| mean(sum, *weight)).collect(),
        };
        self.values.iter().map(plane).collect()
    }
}

/// Ascending numbers as a range; `None` if a number is missing between the first and the last.
pub(super) fn as_range<I: Copy + TryInto<usize>>(numbers: &[I]) -> Option<Range<usize>> {
    let at = |number: Option<&I>| (*number?).try_into().ok();
    let (first, last) = (at(numbers.first())?, at(numbers.last())?);
    (last.checked_sub(first)? == numbers.len() - 1).then_some(first..last + 1)
}

/// Writes values to their places, which are in order.
pub(super) fn put<I: Copy + TryInto<usize>, T: Copy>(places: &[I], values: &[T], to: &mut [T]) {
    if let Some(to) = as_range(places).and_then(|range| to.get_mut(range))
        && to.len() == values.len()
    {
        to.copy_from_slice(values);
        return;
    }
    for (place, value) in places.iter().zip(values) {
        if let Some(to) = (*place).try_into().ok().and_then(|place| to.get_mut(place)) {
            *to = *value;
        }
    }
}

/// What a round found of some pixels, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Found {
    /// The sums of all samples so far, plane by plane, and their weights unless all are 1.
    pub(super) sums: Vec<Vec<f64>>,
    pub(super) weights: Vec<f64>,
    /// How far the round moved the mean; the largest over the planes. 0 in the first round.
    pub(super) moved: Vec<f32>,
    /// The standard error of the mean, the largest over the planes; NaN if any sample is NaN. 0 if it is not
    /// wanted.
    pub(super) errors: Vec<f32>,
}

impl Round<'_> {
    /// Examines the pixels of the round: their slots in the sums, and, if errors are wanted, their numbers in
    /// the pattern.
    pub(super) fn of(&self, slots: &[usize], numbers: &[u32], before: &Sums) -> Found {
        Isa::detect().dispatch(Examined { round: self, slots, numbers, before })
    }

    /// The same for up to `STEP` pixels.
    #[inline(always)]
    fn in_step(
        &self,
        (first, slots, numbers): (usize, &[usize], &[u32]),
        before: &Sums,
        memory: &mut Memory,
        found: &mut Found,
    ) {
        let Round { signs, each, samples, .. } = *self;
        let count = slots.len().min(STEP);
        let range = first * each..(first + count) * each;
        let signs = signs.get(range.clone()).unwrap_or(&[]);
        let is_first = samples as usize == each;
        // Of the earlier rounds, and of this one.
        let (mut old, mut own) = ([f64::from(samples) - each as f64; STEP], [each as f64; STEP]);
        if !signs.is_empty() {
            for ((slot, signs), (old, own)) in
                slots.iter().zip(signs.chunks(each)).zip(old.iter_mut().zip(&mut own))
            {
                *old = before.weights.get(*slot).copied().unwrap_or(0.0);
                *own = weight(each, signs);
            }
        }
        let all: [f64; STEP] = std::array::from_fn(|lane| old[lane] + own[lane]);
        if !signs.is_empty() {
            found.weights.extend_from_slice(&all[..count]);
        }
        let (mut moved, mut errors) = ([0.0_f32; STEP], [0.0_f32; STEP]);
        let planes = self.planes.iter().zip(self.weights.iter()).zip(&before.values).zip(&mut found.sums);
        for (((plane, factor), before), to) in planes {
            let words = plane.words.get(range.clone()).unwrap_or(&[]);
            memory.turn(words, (plane.kind, signs), each);
            let mut later = [0.0; STEP];
            for values in &memory.values {
                (0..STEP).for_each(|lane| later[lane] += f64::from(values[lane]));
            }
            let mut sums = later;
            if !is_first {
                let mut earlier = [0.0; STEP];
                let pairs = earlier.iter_mut().zip(slots);
                pairs.for_each(|(sum, slot)| *sum = before.get(*slot).copied().unwrap_or(0.0));
                sums = std::array::from_fn(|lane| earlier[lane] + later[lane]);
                for lane in 0..STEP {
                    let apart = (sums[lane] / all[lane]) as f32 - (earlier[lane] / old[lane]) as f32;
                    moved[lane] = moved[lane].max(weighted(apart.abs(), factor));
                }
            }
            to.extend_from_slice(&sums[..count]);
            let Some(shown) = self.shown.filter(|_| factor > 0.0) else { continue };
            memory.sort(shown, numbers);
            let variances = within(shown.level, &memory.cells);
            for lane in 0..STEP {
                let scale = each as f64 / own[lane];
                let variance = variances[lane] * (scale * scale) as f32;
                let error = (variance / samples as f32).sqrt() * factor;
                // An infinite sample says no more than one that is no number.
                let error = if later[lane].is_finite() { error } else { f32::NAN };
                // What is no number stays.
                if error > errors[lane] || error.is_nan() {
                    errors[lane] = error;
                }
            }
        }
        found.moved.extend_from_slice(&moved[..count]);
        found.errors.extend_from_slice(&errors[..count]);
    }
}

/// Some pixels of a round.
struct Examined<'a> {
    round: &'a Round<'a>,
    slots: &'a [usize],
    numbers: &'a [u32],
    before: &'a Sums,
}

impl Kernel for Examined<'_> {
    type Output = Found;

    #[inline(always)]
    fn run(self) -> Found {
        let Examined { round, slots, numbers, before } = self;
        let count = slots.len();
        let mut found = Found {
            sums: round.planes.iter().map(|_| Vec::with_capacity(count)).collect(),
            moved: Vec::with_capacity(count),
            errors: Vec::with_capacity(count),
            weights: Vec::new(),
        };
        let cells = round.shown.map_or(0, |shown| 1 << shown.level);
        let mut memory = Memory { values: vec![[0.0; STEP]; round.each], cells: vec![[0.0; STEP]; cells] };
        for (at, slots) in slots.chunks(STEP).enumerate() {
            let numbers = numbers.get(at * STEP..).unwrap_or(&[]);
            round.in_step((at * STEP, slots, numbers), before, &mut memory, &mut found);
        }
        found
    }
}

/// Working memory for `STEP` pixels.
struct Memory {
    /// For each sample, the values of the pixels.
    values: Vec<[f32; STEP]>,
    /// For each rectangle, the values of the samples in it.
    cells: Vec<[f32; STEP]>,
}

impl Memory {
    /// Takes over the samples of one plane, which are given pixel by pixel, times their weights.
    #[inline(always)]
    fn turn(&mut self, words: &[u32], (kind, signs): (Kind, &[f32]), each: usize) {
        for (lane, words) in words.chunks_exact(each).take(STEP).enumerate() {
            let values = self.values.iter_mut().map(|values| &mut values[lane]).zip(words);
            // The usual case, without a question for each sample.
            if kind == Kind::Float && signs.is_empty() {
                values.for_each(|(to, word)| *to = f32::from_bits(*word));
                continue;
            }
            let signs = signs.get(lane * each..(lane + 1) * each).unwrap_or(&[]).iter().copied();
            let signs = signs.chain(std::iter::repeat(1.0));
            values.zip(signs).for_each(|((to, word), sign)| *to = value(*word, kind) * sign);
        }
    }

    /// Sorts the samples that show the error into the rectangles that contain them.
    #[inline(always)]
    fn sort(&mut self, shown: &Shown<'_>, numbers: &[u32]) {
        let own = self.values.get(shown.first..).unwrap_or(&[]);
        for (lane, number) in numbers.iter().take(STEP).enumerate() {
            let order = shown.order(*number);
            let cells = self.cells.iter_mut().map(|cell| &mut cell[lane]).zip(order);
            cells.for_each(|(cell, i)| *cell = own.get(*i as usize).map_or(0.0, |values| values[lane]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::pattern::Pattern;
    use super::*;
    use osl_ir::types::Type;

    fn plane(values: impl IntoIterator<Item = f32>) -> Plane {
        let words = values.into_iter().map(f32::to_bits).collect();
        Plane {
            output: "r".into(),
            ty: Type::FLOAT,
            component: 0,
            kind: Kind::Float,
            words,
            wide: Vec::new(),
        }
    }

    /// A first round of some samples of pixels, which are numbered from `first` on.
    fn first_round(values: &[Vec<f32>], pattern: &Pattern, first: u32) -> Found {
        let each = values[0].len();
        let planes = [plane(values.concat())];
        let shown = Shown::new(pattern, &(0..each as u32));
        let samples = each as u32;
        let weights = Weights::equal(1);
        let round =
            Round { planes: &planes, signs: &[], each, samples, shown: shown.as_ref(), weights: &weights };
        let slots: Vec<usize> = (0..values.len()).collect();
        let numbers: Vec<u32> = (first..).take(slots.len()).collect();
        round.of(&slots, &numbers, &Sums::new(1, slots.len()))
    }

    /// Root mean square of the true and the estimated errors over many pixels.
    fn errors(n: u32, mean: f64, f: impl Fn([f32; 2], u32, usize) -> f32) -> (f64, f64) {
        let pattern = Pattern::new(n, 3);
        let (mut actual, mut estimated) = (0.0, 0.0);
        let pixels = 500;
        for pixel in 0..pixels {
            let own = &pattern.of(pixel)[..n as usize];
            let values = own.iter().enumerate().map(|(i, s)| f(*s, pixel, i)).collect();
            let found = first_round(&[values], &pattern, pixel);
            actual += (found.sums[0][0] / f64::from(n) - mean).powi(2);
            estimated += f64::from(found.errors[0]).powi(2);
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
        let found = first_round(&[vec![1.0, f32::NAN, 0.0, 0.0]], &pattern, 0);
        assert!(found.sums[0][0].is_nan() && found.errors[0].is_nan());
    }

    #[test]
    fn pixels_in_step_are_as_each_alone() {
        let pattern = Pattern::new(16, 3);
        let values = |pixel: u32, from: u32| -> Vec<f32> {
            let one = |i: u32| (super::super::pattern::hash(pixel * 977 + i) >> 8) as f32;
            (from..from + 8).map(one).collect()
        };
        let all: Vec<Vec<f32>> = (0..21).map(|pixel| values(pixel, 0)).collect();
        let together = first_round(&all, &pattern, 0);
        let mut before = Sums::new(1, all.len());
        before.take(&(0..all.len()).collect::<Vec<_>>(), &together);
        // The second round looks at every second pixel.
        let slots: Vec<usize> = (0..all.len()).step_by(2).collect();
        let second = |slots: &[usize]| {
            let planes = [plane(slots.iter().flat_map(|slot| values(*slot as u32, 8)))];
            let (shown, weights) = (Shown::new(&pattern, &(8..16)), Weights::equal(1));
            let numbers: Vec<u32> = slots.iter().map(|slot| *slot as u32).collect();
            let shown = shown.as_ref();
            let round = Round { planes: &planes, signs: &[], each: 8, samples: 16, shown, weights: &weights };
            round.of(slots, &numbers, &before)
        };
        let later = second(&slots);
        for (at, slot) in slots.iter().enumerate() {
            let alone = first_round(&all[*slot..=*slot], &pattern, *slot as u32);
            assert_eq!(
                (alone.sums[0][0], alone.errors[0]),
                (together.sums[0][*slot], together.errors[*slot])
            );
            let alone = second(&[*slot]);
            let one = (later.sums[0][at], later.moved[at], later.errors[at]);
            assert_eq!((alone.sums[0][0], alone.moved[0], alone.errors[0]), one);
            let sums: f32 = values(*slot as u32, 0).iter().chain(&values(*slot as u32, 8)).sum();
            assert!((f64::from(sums) / one.0 - 1.0).abs() < 1e-5 && one.1 > 0.0 && one.2 > 0.0);
        }
    }
}
