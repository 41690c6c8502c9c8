//! The stopping rule: for each number of samples, the largest error estimate at which a pixel needs no
//! others.
//!
//! No formula knows how reliable an estimate is for an unknown shader, so the limits are fitted to pilot
//! pixels, whose errors are known from twice as many samples or more. One in a thousand pixels may exceed the
//! bound, and the question is where to spend that allowance. For a given price of a failed pixel, dynamic
//! programming from the last number of samples back to the first finds the limits that make the pilot
//! cheapest. Bisection finds the lowest price at which few enough pixels fail. Limits fit the pixels that
//! they were learned from too well, so those of one half of the pilot are judged on the other half
//! (cross-validation).

use super::above;
use super::probe::{ErrorPair, NEVER};
use pxfm::{f_expm1f, f_log1pf};

/// A number of samples and, for each pilot pixel, the estimated and the actual error at that number. The
/// estimate of a pixel that was finished earlier is below every limit.
#[derive(Clone, Debug)]
pub(super) struct Rung {
    pub(super) samples: u32,
    pub(super) tried: Vec<ErrorPair>,
    /// The pixels in the order of their estimates.
    order: Vec<u32>,
}

impl Rung {
    pub(super) fn new(samples: u32, tried: Vec<ErrorPair>) -> Rung {
        // The bits of estimates that are not negative have their order.
        let key =
            |((estimate, _), slot): (&ErrorPair, u64)| u64::from(estimate.max(0.0).to_bits()) << 32 | slot;
        let mut keys: Vec<u64> = tried.iter().zip(0..).map(key).collect();
        keys.sort_unstable();
        let order = keys.into_iter().map(|key| key as u32).collect();
        Rung { samples, tried, order }
    }

    /// The number of pixels above a bound if none had more samples.
    pub(super) fn failed(&self, bound: f32) -> usize {
        self.tried.iter().filter(|(_, error)| above(*error, bound)).count()
    }

    /// For each pixel, in the order of their estimates, the share of pixels with similar estimates that
    /// exceed a bound: one in 256 on either side, at least two.
    fn failing(&self, bound: f32) -> Vec<f32> {
        let mut sums = vec![0_u32];
        let mut sum = 0;
        for slot in &self.order {
            sum += u32::from(above(self.tried[*slot as usize].1, bound));
            sums.push(sum);
        }
        let beside = (self.order.len() / 256).max(2);
        let share = |at: usize| {
            let (from, to) = (at.saturating_sub(beside), (at + beside + 1).min(self.order.len()));
            (sums[to] - sums[from]) as f32 / (to - from) as f32
        };
        (0..self.order.len()).map(share).collect()
    }

    /// Every second pixel from `first` on.
    fn half(&self, first: usize) -> Rung {
        Rung::new(self.samples, self.tried.iter().skip(first).step_by(2).copied().collect())
    }
}

/// How to sample the pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct StoppingRule {
    /// Numbers of samples, each with the largest estimate at which a pixel is done; the last number finishes
    /// every pixel.
    pub(super) limits: Vec<(u32, f32)>,
    /// Pilot pixels that then exceed the bound.
    pub(super) failed: usize,
    /// Whether more pixels fail than allowed because the maximum number of samples is too small.
    pub(super) short: bool,
    /// The rate at which squared errors fall, as a power of the number of samples.
    pub(super) power: f32,
}

/// The cheapest limits at which at most `allowed` pilot pixels exceed `bound`. If there are none, the last
/// number of samples for all pixels.
pub(super) fn fit(rungs: &[Rung], bound: f32, allowed: f32) -> StoppingRule {
    let halves = [0, 1].map(|first| rungs.iter().map(|rung| rung.half(first)).collect::<Vec<_>>());
    let most = rungs.last().map_or(1.0, |rung| rung.samples as f32 * rung.tried.len() as f32);
    // From 0 to 1 the price rises; from 1 to 2 the limits shrink.
    let limits = |own: &[Rung], care: f32| {
        let mut limits = cheapest(own, bound, f_expm1f(care.min(1.0) * f_log1pf(most)));
        let shrunk = (2.0 - care).min(1.0);
        limits.iter_mut().rev().skip(1).for_each(|(_, limit)| {
            *limit = if shrunk > 0.0 && *limit >= 0.0 { *limit * shrunk } else { NEVER };
        });
        limits
    };
    let judged = |care: f32| {
        let one = |own: &[Rung], other: &[Rung]| failures(other, &limits(own, care), bound);
        let [first, second] = &halves;
        let (a, b) = rayon::join(|| one(first, second), || one(second, first));
        a + b
    };
    let (mut low, mut high) = (0.0, 2.0);
    let mut failed = judged(high);
    for _ in 0..if failed as f32 <= allowed { 6 } else { 0 } {
        let middle = 0.5 * (low + high);
        let found = judged(middle);
        if found as f32 <= allowed {
            (high, failed) = (middle, found);
        } else {
            low = middle;
        }
    }
    StoppingRule { limits: limits(rungs, high), failed, ..StoppingRule::default() }
}

/// The number of pixels that exceed a bound under some limits.
fn failures(rungs: &[Rung], limits: &[(u32, f32)], bound: f32) -> usize {
    let count = rungs.first().map_or(0, |rung| rung.tried.len());
    let fails = |slot: &usize| {
        let mut tried = rungs
            .iter()
            .zip(limits)
            .filter_map(|(rung, (_, limit))| rung.tried.get(*slot).filter(|(estimate, _)| estimate <= limit));
        tried.next().is_some_and(|(_, error)| above(*error, bound))
    };
    (0..count).filter(fails).count()
}

/// The cheapest limits at a given price of a failed pixel, in samples.
fn cheapest(rungs: &[Rung], bound: f32, price: f32) -> Vec<(u32, f32)> {
    let mut limits: Vec<(u32, f32)> = Vec::with_capacity(rungs.len());
    // The cost of each pixel from the next number of samples on.
    let mut ahead = vec![0.0_f32; rungs.first().map_or(0, |rung| rung.tried.len())];
    for rung in rungs.iter().rev() {
        let costs: Vec<f32> = rung.failing(bound).into_iter().map(|share| price * share).collect();
        let mut done = rung.order.len();
        let mut limit = f32::INFINITY;
        if let Some((next, _)) = limits.last() {
            let step = (next - rung.samples) as f32;
            ahead.iter_mut().for_each(|ahead| *ahead += step);
            let (mut gain, mut best) = (0.0_f64, 0.0);
            (limit, done) = (NEVER, 0);
            for (at, slot) in rung.order.iter().enumerate() {
                gain += f64::from(ahead[*slot as usize] - costs[at]);
                let estimate = |slot: &u32| rung.tried[*slot as usize].0;
                // Pixels with the same estimate are finished together.
                let ends = || rung.order.get(at + 1).is_none_or(|next| estimate(next) > estimate(slot));
                if gain > best && ends() {
                    (best, limit, done) = (gain, estimate(slot).max(0.0), at + 1);
                }
            }
        }
        let finished = rung.order.iter().zip(&costs).take(done);
        finished.for_each(|(slot, cost)| ahead[*slot as usize] = *cost);
        limits.push((rung.samples, limit));
    }
    limits.reverse();
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rungs of 2 and 8 samples for a hundred pixels.
    fn rungs(first: impl Fn(usize) -> ErrorPair, second: impl Fn(usize) -> ErrorPair) -> Vec<Rung> {
        vec![Rung::new(2, (0..100).map(first).collect()), Rung::new(8, (0..100).map(second).collect())]
    }

    #[test]
    fn those_go_on_whose_estimate_says_so() {
        let own = |i: usize| (i as f32 / 50.0, i as f32 / 50.0);
        let found = fit(&rungs(own, |_| (0.1, 0.1)), 1.0, 0.0);
        let limit = found.limits[0].1;
        assert!((0.6..=1.0).contains(&limit) && found.limits[1] == (8, f32::INFINITY), "{found:?}");
        assert_eq!(found.failed, 0);
    }

    #[test]
    fn failures_are_spent_where_they_save_most() {
        // One pixel of the worst kind that happens to have a good estimate.
        let own = |i: usize| (i as f32 / 100.0, if i == 40 { 2.0 } else { 0.1 });
        let never = fit(&rungs(own, |_| (0.1, 0.1)), 1.0, 0.0);
        assert!(never.failed == 0, "{never:?}");
        let one = fit(&rungs(own, |_| (0.1, 0.1)), 1.0, 1.0);
        assert_eq!((one.limits[0].1, one.failed), (0.99, 1));
    }

    #[test]
    fn where_nothing_helps_the_last_number_is_taken() {
        let bad = |_: usize| (0.5, 2.0);
        let found = fit(&rungs(bad, |i| (0.1, if i == 0 { 2.0 } else { 0.1 })), 1.0, 0.0);
        assert_eq!((found.limits, found.failed), (vec![(2, NEVER), (8, f32::INFINITY)], 1));
    }
}
