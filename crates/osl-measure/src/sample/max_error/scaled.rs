//! Errors that are alike but for their size, which the estimates tell.
//!
//! Few errors of a pilot are as large as the bound, too few to count. But many are as many times larger than others of their
//! size as an error has to be to reach it: from the distribution of these multiples, of all pixels together, follows how
//! likely each pixel is off. Where there are edges, errors are not alike; then this says so, and pixels are counted.

use super::peek::Tried;

/// Pixels for each one before and behind a pixel in the order of estimates that tell the size of its error.
const ALIKE: usize = 32;
/// Pixels without which sizes say nothing.
const MANY: usize = 1024;
/// Shares of the bound at which it is seen whether errors are but scaled, in so many groups of pixels of like estimates, and
/// how many standard deviations the number of larger errors may be off in each.
const SHARES: [f32; 3] = [0.25, 0.5, 1.0];
const GROUPS: usize = 8;
const CHANCE: f32 = 2.0;

/// Sizes of errors, and how many times larger errors are than their size.
pub(super) struct Scaled {
    /// By pixel.
    sizes: Vec<f32>,
    /// Of all pixels, ascending.
    times: Vec<f32>,
}

impl Scaled {
    /// None where errors are not but scaled, as far as errors near the bound tell.
    pub(super) fn of(tried: &[Tried], bound: f32) -> Option<Scaled> {
        if tried.len() < MANY || tried.iter().any(|(_, error)| !error.is_finite()) {
            return None;
        }
        let mut order: Vec<usize> = (0..tried.len()).collect();
        // What is no number was done before.
        let estimate = |slot: &usize| if tried[*slot].0.is_nan() { 0.0 } else { tried[*slot].0 };
        order.sort_by(|a, b| estimate(a).total_cmp(&estimate(b)));
        let mut scaled = Scaled { sizes: sizes(tried, &order), times: Vec::new() };
        let times = tried.iter().zip(&scaled.sizes).filter(|(_, size)| **size > 0.0);
        scaled.times = times.map(|((_, error), size)| error / size).collect();
        scaled.times.sort_by(f32::total_cmp);
        let fits = |slots: &[usize], bound: f32| {
            let seen = slots.iter().filter(|slot| tried[**slot].1 > bound).count() as f32;
            let said: f32 = slots.iter().map(|slot| scaled.chance(scaled.sizes[*slot], bound)).sum();
            (seen - said).abs() <= CHANCE * said.sqrt() + 1.0
        };
        let each = order.len().div_ceil(GROUPS);
        let all = SHARES.iter().all(|share| order.chunks(each).all(|slots| fits(slots, share * bound)));
        all.then_some(scaled)
    }

    /// By pixel, how likely its error is above a bound.
    pub(super) fn chances(&self, bound: f32) -> Vec<f32> {
        self.sizes.iter().map(|size| self.chance(*size, bound)).collect()
    }

    fn chance(&self, size: f32, bound: f32) -> f32 {
        let below = self.times.partition_point(|times| times * size <= bound);
        (self.times.len() - below) as f32 / self.times.len().max(1) as f32
    }
}

/// By pixel, the root mean square of the errors of those of like estimates. `order`: the pixels by their estimates.
fn sizes(tried: &[Tried], order: &[usize]) -> Vec<f32> {
    let mut sums = vec![0.0_f64];
    let mut sum = 0.0;
    for slot in order {
        sum += f64::from(tried[*slot].1).powi(2);
        sums.push(sum);
    }
    let beside = tried.len() / ALIKE;
    let mut sizes = vec![0.0; tried.len()];
    for (at, slot) in order.iter().enumerate() {
        let (from, to) = (at.saturating_sub(beside), (at + beside + 1).min(order.len()));
        sizes[*slot] = ((sums[to] - sums[from]).max(0.0) / (to - from) as f64).sqrt() as f32;
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::pattern::hash;

    /// Numbers of 0 to 1.
    fn random(i: usize) -> f32 {
        (hash(i as u32) >> 8) as f32 / (1 << 24) as f32
    }

    /// Half the sum of four numbers of -1 to 1: above 1 in 2.1 % of the cases.
    fn error(i: usize) -> f32 {
        (0..4).map(|k| 2.0 * random(4 * i + k) - 1.0).sum::<f32>().abs() / 2.0
    }

    #[test]
    fn what_is_rare_follows_from_what_is_not() {
        let size = |i: usize| 0.3 + 0.5 * random(100_000 + i);
        let tried: Vec<Tried> = (0..4096).map(|i| (size(i), size(i) * error(i))).collect();
        let scaled = Scaled::of(&tried, 1.0).expect("errors that are but scaled");
        let said: f32 = scaled.chances(1.0).iter().sum();
        let more = (0..400 * 4096).filter(|i| size(i % 4096) * error(*i) > 1.0).count() as f32 / 400.0;
        assert!((said / more - 1.0).abs() < 0.35, "{said} said, {more} true");
    }

    #[test]
    fn edges_are_not_scaled() {
        // Where an edge hides, the estimate knows nothing of it.
        let hidden = |i: usize| if i % 50 == 0 { 0.8 } else { 0.01 * error(i) };
        let tried: Vec<Tried> =
            (0..4096).map(|i| if i < 2048 { (0.001, hidden(i)) } else { (0.5, 0.5 * error(i)) }).collect();
        assert!(Scaled::of(&tried, 0.7).is_none());
        let few: Vec<Tried> = (0..100).map(|i| (0.5, error(i))).collect();
        assert!(Scaled::of(&few, 1.0).is_none(), "few say nothing");
    }
}
