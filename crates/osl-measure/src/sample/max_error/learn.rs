//! What the pilot teaches: for each sample count, the error estimate at which a pixel is done.
//!
//! One in a thousand pixels may exceed the bound, and the question is where to spend that allowance. For a
//! given price of a failed pixel, the limits that make the pilot cheapest are found from the last sample
//! count back to the first. The search takes the lowest price at which few enough pixels fail, judged with
//! limits that were learned from other pixels. If no price suffices, the limits are reduced.

use super::above;
use super::probe::{ErrorPair, NEVER};
use super::scaled::Scaled;
use pxfm::{f_expm1f, f_log1pf};
use rayon::prelude::*;
use std::sync::Arc;

/// A sample count and, for each pilot pixel, the estimated and the actual error at that count. A NaN estimate
/// marks a pixel that was finished earlier.
pub(super) struct Rung {
    pub(super) samples: u32,
    pub(super) tried: Vec<ErrorPair>,
    /// The pixels in the order of their estimates, which are 0 for a pixel that was finished earlier.
    order: Arc<[(f32, u32)]>,
    scaled: Option<Scaled>,
}

/// Pixels in the order of their estimates. A NaN estimate, of a pixel that was finished earlier, counts as 0.
pub(super) fn order(estimates: &[f32]) -> Arc<[(f32, u32)]> {
    // The bits of estimates, which are not negative, have their order.
    let key = |(estimate, slot): (&f32, u64)| u64::from(estimate.max(0.0).to_bits()) << 32 | slot;
    let mut keys: Vec<u64> = estimates.iter().zip(0..).map(key).collect();
    keys.sort_unstable();
    keys.into_iter().map(|key| (f32::from_bits((key >> 32) as u32), key as u32)).collect()
}

impl Rung {
    pub(super) fn new(samples: u32, tried: Vec<ErrorPair>, order: Arc<[(f32, u32)]>, bound: f32) -> Rung {
        let scaled = Scaled::of(&tried, &order, bound);
        Rung { samples, tried, order, scaled }
    }

    /// Expected number of pixels above the bound if none had more samples.
    pub(super) fn failed(&self, bound: f32) -> f32 {
        self.chances(bound).iter().sum()
    }

    /// Whether all errors together give each pixel's probability of failing.
    pub(super) fn is_scaled(&self) -> bool {
        self.scaled.is_some()
    }

    /// For each pixel, the probability that it exceeds the bound.
    fn chances(&self, bound: f32) -> Vec<f32> {
        match &self.scaled {
            Some(scaled) => scaled.chances(bound),
            None => self.tried.iter().map(|(_, error)| likely(*error, bound)).collect(),
        }
    }
}

/// How to sample the pixels.
#[derive(Debug, Default)]
pub(super) struct Steps {
    /// Sample counts, each with the largest estimate at which a pixel is done; the last count finishes every
    /// pixel.
    pub(super) limits: Vec<(u32, f32)>,
    /// Pilot pixels that then exceed the bound.
    pub(super) failed: f32,
    /// Total number of samples that the pilot's pixels take, and the number of rounds, added up over the
    /// pixels, after which their errors are estimated.
    pub(super) work: f64,
    pub(super) rounds: f64,
    /// Whether more pixels fail than allowed because the maximum sample count is too small.
    pub(super) short: bool,
    /// The rate at which squared errors fall, as a power of the sample count.
    pub(super) power: f32,
}

/// How often the search for prices and limits halves its interval.
const CARES: usize = 6;
/// Errors as shares of the bound: below the first a pixel passes, above the second it fails.
const DOUBT: [f32; 2] = [0.93, 1.07];
/// Neighbours that count, in the order of the estimates, when the probability of a pixel is averaged: one in
/// so many of all pilot pixels, on each side.
const BESIDE: usize = 256;

/// The cheapest limits at which at most `allowed` pilot pixels exceed `bound`. If there are none, the last
/// sample count for all pixels.
pub(super) fn steps(rungs: &[Rung], (bound, allowed): (f32, f32), estimating: f32) -> Steps {
    // Limits fit the pixels that they were learned from too well, so the limits of one half are judged on the
    // other half.
    let chances: Vec<Vec<f32>> = rungs.iter().map(|rung| rung.chances(bound)).collect();
    let [whole, first, second] = sorted(rungs, &chances);
    let most =
        rungs.last().map_or(1.0, |r| r.samples as f32) * rungs.first().map_or(1, |r| r.tried.len()) as f32;
    // From 0 to 1 the price rises; from 1 to 2 the limits shrink.
    let limits = |part: &[Sorted], care: f32| {
        let price = f_expm1f(care.min(1.0) * f_log1pf(most));
        priced(part, price, estimating).shrunk((2.0 - care).min(1.0))
    };
    let judged = |care: f32| {
        let one = |own: &[Sorted], other: &[Sorted]| off(other, &limits(own, care).limits);
        let (first, second) = rayon::join(|| one(&first, &second), || one(&second, &first));
        first + second
    };
    let (mut low, mut high) = (0.0, 2.0);
    let mut failed = judged(high);
    if failed <= allowed {
        for _ in 0..CARES {
            let middle = 0.5 * (low + high);
            let found = judged(middle);
            if found <= allowed {
                (high, failed) = (middle, found);
            } else {
                low = middle;
            }
        }
    }
    let mut steps = Steps { failed, ..limits(&whole, high) };
    steps.count(&whole);
    steps
}

/// Expected number of failures among some pixels under some limits.
fn off(rungs: &[Sorted], limits: &[(u32, f32)]) -> f32 {
    let mut chances = vec![0.0; rungs.first().map_or(0, |rung| rung.chances.len())];
    // The first rung at which a pixel is done counts, so that it is the last to write.
    for (rung, (_, limit)) in rungs.iter().zip(limits).rev() {
        for (chance, (estimate, own)) in chances.iter_mut().zip(rung.estimates.iter().zip(&rung.chances)) {
            *chance = if estimate <= limit { *own } else { *chance };
        }
    }
    chances.iter().sum()
}

/// Probability that a pixel exceeds the bound, given the pilot's estimate of its error.
fn likely(error: f32, bound: f32) -> f32 {
    let [never, always] = DOUBT.map(|share| share * bound);
    if above(error, always) { 1.0 } else { ((error - never) / (always - never)).max(0.0) }
}

/// The fewest samples, and rounds, of pixels that somehow know when they are done: limits need more.
pub(super) fn clairvoyant(rungs: &[Rung], bound: f32) -> [f64; 2] {
    let count = rungs.first().map_or(0, |rung| rung.tried.len());
    let mut least = [0.0; 2];
    for slot in 0..count {
        let is_done = |rung: &&Rung| !above(rung.tried[slot].1, bound);
        let at = rungs.iter().take_while(|rung| !is_done(rung)).count().min(rungs.len().saturating_sub(1));
        least[0] += rungs.get(at).map_or(0.0, |rung| f64::from(rung.samples));
        least[1] += (at + 1) as f64;
    }
    least
}

/// The smallest sample count that is enough for all pixels.
pub(super) fn fixed(rungs: &[Rung], bound: f32, allowed: f32) -> Option<u32> {
    rungs.iter().find(|rung| rung.failed(bound) <= allowed).map(|rung| rung.samples)
}

/// A rung and some of the pixels.
struct Sorted {
    samples: u32,
    /// For each pixel, the estimate, which is below every limit for one that was finished earlier, and the
    /// probability that it fails.
    estimates: Vec<f32>,
    chances: Vec<f32>,
    /// The pixels in the order of their estimates, with these; and for each, the probability that a pixel
    /// with a similar estimate fails.
    order: Vec<(f32, u32)>,
    off: Vec<f32>,
}

/// All pixels, those with an even number and those with an odd one, by rungs. The pixels of each part are
/// numbered anew.
fn sorted(rungs: &[Rung], chances: &[Vec<f32>]) -> [Vec<Sorted>; 3] {
    let each = |(rung, chances): (&Rung, &Vec<f32>)| {
        // The next pixel is in either half by chance, which no processor predicts: nothing may jump here.
        let mut halves = [0, 1].map(|_| Vec::with_capacity(rung.order.len() / 2 + 1));
        rung.order.iter().for_each(|(e, slot)| halves[(slot % 2) as usize].push((*e, slot / 2)));
        let [even, odd] = halves;
        [
            Sorted::new::<1>(rung, chances, (0, rung.order.to_vec())),
            Sorted::new::<2>(rung, chances, (0, even)),
            Sorted::new::<2>(rung, chances, (1, odd)),
        ]
    };
    let all: Vec<[Sorted; 3]> = rungs.par_iter().zip(chances).map(each).collect();
    let mut parts = [Vec::new(), Vec::new(), Vec::new()];
    all.into_iter().for_each(|rung| parts.iter_mut().zip(rung).for_each(|(part, one)| part.push(one)));
    parts
}

impl Sorted {
    /// Every `STEP`th pixel from one on, which are given in the order of their estimates.
    fn new<const STEP: usize>(
        rung: &Rung,
        chances: &[f32],
        (first, order): (usize, Vec<(f32, u32)>),
    ) -> Sorted {
        let known = |estimate: f32| if estimate.is_nan() { f32::NEG_INFINITY } else { estimate };
        let estimates = rung.tried.iter().skip(first).step_by(STEP).map(|(e, _)| known(*e)).collect();
        let chances: Vec<f32> = chances.iter().skip(first).step_by(STEP).copied().collect();
        let mut sums = Vec::with_capacity(order.len() + 1);
        let mut sum = 0.0_f32;
        sums.push(sum);
        for (_, slot) in &order {
            sum += chances[*slot as usize];
            sums.push(sum);
        }
        let beside = (order.len() / BESIDE).max(2);
        let average = |at: usize| {
            let (from, to) = (at.saturating_sub(beside), (at + beside + 1).min(order.len()));
            (sums[to] - sums[from]) / (to - from) as f32
        };
        let off = (0..order.len()).map(average).collect();
        Sorted { samples: rung.samples, estimates, chances, order, off }
    }
}

/// The cheapest limits at a given price of a failed pixel. A limit also costs `estimating` for each pixel.
fn priced(rungs: &[Sorted], price: f32, estimating: f32) -> Steps {
    let Some((last, before)) = rungs.split_last() else { return Steps::default() };
    let mut limits = vec![(last.samples, f32::INFINITY)];
    // The cost of a pixel from this rung on, if it is not finished here.
    let mut ahead = vec![0.0; last.order.len()];
    let finish = |rung: &Sorted, count: usize, ahead: &mut [f32]| {
        let done = rung.order.iter().zip(&rung.off).take(count);
        done.for_each(|((_, slot), off)| ahead[*slot as usize] = price * off);
    };
    finish(last, last.order.len(), &mut ahead);
    let mut next = last.samples;
    for rung in before.iter().rev() {
        let step = (next - rung.samples) as f32;
        let cost = f64::from(estimating) * rung.order.len() as f64;
        let (mut gain, mut best, mut count) = (0.0_f64, cost, 0);
        for (at, ((estimate, slot), off)) in rung.order.iter().zip(&rung.off).enumerate() {
            gain += f64::from(step + ahead[*slot as usize] - price * off);
            // Pixels with the same estimate are finished together.
            let ends = || rung.order.get(at + 1).is_none_or(|(next, _)| next > estimate);
            if gain > best && ends() {
                (best, count) = (gain, at + 1);
            }
        }
        let limit = if count == 0 { NEVER } else { rung.order[count - 1].0 };
        limits.push((rung.samples, limit));
        let step = if count == 0 { step } else { step + estimating };
        ahead.iter_mut().for_each(|ahead| *ahead += step);
        finish(rung, count, &mut ahead);
        next = rung.samples;
    }
    limits.reverse();
    Steps { limits, ..Steps::default() }
}

impl Steps {
    /// These limits times a factor, except the last.
    fn shrunk(mut self, share: f32) -> Steps {
        let before = self.limits.len().saturating_sub(1);
        for (_, limit) in self.limits.iter_mut().take(before) {
            *limit = if share > 0.0 && *limit >= 0.0 { *limit * share } else { NEVER };
        }
        self
    }

    /// Adds up the samples that the pilot would take.
    fn count(&mut self, rungs: &[Sorted]) {
        let mut done = vec![false; rungs.first().map_or(0, |rung| rung.order.len())];
        let mut left = done.len();
        for (rung, (samples, limit)) in rungs.iter().zip(&self.limits) {
            self.rounds += if *limit > NEVER { left as f64 } else { 0.0 };
            for (_, slot) in rung.order.iter().take_while(|(estimate, _)| estimate <= limit) {
                if !done[*slot as usize] {
                    done[*slot as usize] = true;
                    left -= 1;
                    self.work += f64::from(*samples);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rungs of 2 and 8 samples for a hundred pixels.
    fn rungs(first: impl Fn(usize) -> ErrorPair, second: impl Fn(usize) -> ErrorPair) -> Vec<Rung> {
        let rung = |samples: u32, tried: Vec<ErrorPair>| {
            let estimates: Vec<f32> = tried.iter().map(|(estimate, _)| *estimate).collect();
            Rung::new(samples, tried, order(&estimates), 1.0)
        };
        vec![rung(2, (0..100).map(first).collect()), rung(8, (0..100).map(second).collect())]
    }

    #[test]
    fn those_go_on_whose_estimate_says_so() {
        let own = |i: usize| (i as f32 / 50.0, i as f32 / 50.0);
        let found = steps(&rungs(own, |_| (0.1, 0.1)), (1.0, 0.0), 0.0);
        let limit = found.limits[0].1;
        assert!((0.6..1.0).contains(&limit) && found.limits[1] == (8, f32::INFINITY), "{found:?}");
        assert_eq!(found.failed, 0.0);
    }

    #[test]
    fn failures_are_spent_where_they_save_most() {
        // One pixel of the worst kind that happens to have a good estimate.
        let own = |i: usize| (i as f32 / 100.0, if i == 40 { 2.0 } else { 0.1 });
        let never = steps(&rungs(own, |_| (0.1, 0.1)), (1.0, 0.0), 0.0);
        assert!(never.limits[0].1 < 0.4 && never.failed == 0.0, "{never:?}");
        let one = steps(&rungs(own, |_| (0.1, 0.1)), (1.0, 1.0), 0.0);
        assert_eq!((one.limits[0].1, one.failed, one.work), (0.99, 1.0, 200.0));
    }

    #[test]
    fn where_nothing_helps_the_best_is_taken() {
        let bad = |_: usize| (0.5, 2.0);
        let found = steps(&rungs(bad, |i| (0.1, if i == 0 { 2.0 } else { 0.1 })), (1.0, 0.0), 0.0);
        assert_eq!((found.limits[0].1, found.failed), (NEVER, 1.0));
    }
}
