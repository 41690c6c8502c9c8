//! Error distributions that differ between pixels only by a scale, which the estimates predict.
//!
//! Few pilot errors reach the bound, too few to count. But the ratios of errors to their local scale have one
//! common distribution, and from it follows the probability that each pixel exceeds the bound. At edges the
//! errors do not follow a common distribution; then this module reports so, and failures are counted instead.

use super::probe::ErrorPair;

/// The scale of an error is averaged over neighbours in the order of the estimates: one in so many of all
/// pixels, on each side.
const ALIKE: usize = 32;
/// Consecutive pixels in this order that share one scale.
const TOGETHER: usize = 16;
/// Minimum number of pixels to estimate scales.
const MANY: usize = 1024;
/// The check that errors are scaled compares predicted and counted failures at these shares of the bound, in
/// this many groups of pixels with similar estimates, up to this many standard deviations.
const SHARES: [f32; 3] = [0.25, 0.5, 1.0];
const GROUPS: usize = 8;
const CHANCE: f32 = 2.0;

/// The scale of each error, and the common distribution of error-to-scale ratios.
pub(super) struct Scaled {
    /// For each pixel, the index of its scale.
    of: Vec<u32>,
    sizes: Vec<f32>,
    /// The ratios of all pixels, ascending.
    times: Vec<f32>,
}

impl Scaled {
    /// `None` unless the errors near the bound differ only by a constant factor.
    /// `order` has the pixels in the order of their estimates.
    pub(super) fn of(tried: &[ErrorPair], order: &[(f32, u32)], bound: f32) -> Option<Scaled> {
        if tried.len() < MANY || tried.iter().any(|(_, error)| !error.is_finite()) {
            return None;
        }
        let order: Vec<usize> = order.iter().map(|(_, slot)| *slot as usize).collect();
        let sizes = sizes(tried, &order);
        let mut of = vec![0; tried.len()];
        order
            .chunks(TOGETHER)
            .zip(0..)
            .for_each(|(slots, size)| slots.iter().for_each(|slot| of[*slot] = size));
        let times = tried.iter().zip(&of).filter(|(_, size)| sizes[**size as usize] > 0.0);
        let mut times: Vec<f32> = times.map(|((_, error), size)| error / sizes[*size as usize]).collect();
        times.sort_unstable_by_key(|times| times.to_bits());
        let scaled = Scaled { of, sizes, times };
        let each = scaled.sizes.len().div_ceil(GROUPS);
        let fits = |bound: f32| {
            let mut groups = order.chunks(each * TOGETHER).zip(scaled.sizes.chunks(each));
            groups.all(|(slots, sizes)| {
                let seen = slots.iter().filter(|slot| tried[**slot].1 > bound).count() as f32;
                let said: f32 = sizes.iter().map(|size| scaled.chance(*size, bound)).sum();
                let said = said * slots.len() as f32 / sizes.len() as f32;
                (seen - said).abs() <= CHANCE * said.sqrt() + 1.0
            })
        };
        SHARES.iter().all(|share| fits(share * bound)).then_some(scaled)
    }

    /// For each pixel, the probability that its error exceeds a bound.
    pub(super) fn chances(&self, bound: f32) -> Vec<f32> {
        let chances: Vec<f32> = self.sizes.iter().map(|size| self.chance(*size, bound)).collect();
        self.of.iter().map(|size| chances[*size as usize]).collect()
    }

    fn chance(&self, size: f32, bound: f32) -> f32 {
        let below = self.times.partition_point(|times| times * size <= bound);
        (self.times.len() - below) as f32 / self.times.len().max(1) as f32
    }
}

/// The scales: root mean square errors of pixels with similar estimates, one for each group of `TOGETHER`
/// pixels.
fn sizes(tried: &[ErrorPair], order: &[usize]) -> Vec<f32> {
    let mut sums = vec![0.0_f64];
    let mut sum = 0.0;
    for slot in order {
        let size = f64::from(tried[*slot].1);
        sum += size * size;
        sums.push(sum);
    }
    let beside = tried.len() / ALIKE;
    let size = |at: usize| {
        let (from, to) = (at.saturating_sub(beside), (at + TOGETHER + beside).min(order.len()));
        ((sums[to] - sums[from]).max(0.0) / (to - from) as f64).sqrt() as f32
    };
    (0..order.len()).step_by(TOGETHER).map(size).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::pattern::hash;

    /// A pseudorandom number from 0 to 1.
    fn random(i: usize) -> f32 {
        (hash(i as u32) >> 8) as f32 / (1 << 24) as f32
    }

    /// Half the sum of four numbers from -1 to 1; above 1 in 2.1 % of the cases.
    fn error(i: usize) -> f32 {
        (0..4).map(|k| 2.0 * random(4 * i + k) - 1.0).sum::<f32>().abs() / 2.0
    }

    fn scaled(tried: &[ErrorPair], bound: f32) -> Option<Scaled> {
        let mut order: Vec<(f32, u32)> = tried.iter().zip(0..).map(|((e, _), slot)| (*e, slot)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        Scaled::of(tried, &order, bound)
    }

    #[test]
    fn what_is_rare_follows_from_what_is_not() {
        let size = |i: usize| 0.3 + 0.5 * random(100_000 + i);
        let tried: Vec<ErrorPair> = (0..4096).map(|i| (size(i), size(i) * error(i))).collect();
        let scaled = scaled(&tried, 1.0).expect("errors that are but scaled");
        let said: f32 = scaled.chances(1.0).iter().sum();
        let more = (0..400 * 4096).filter(|i| size(i % 4096) * error(*i) > 1.0).count() as f32 / 400.0;
        assert!((said / more - 1.0).abs() < 0.35, "{said} said, {more} true");
    }

    #[test]
    fn edges_are_not_scaled() {
        // The estimate misses hidden edges.
        let hidden = |i: usize| if i.is_multiple_of(50) { 0.8 } else { 0.01 * error(i) };
        let tried: Vec<ErrorPair> =
            (0..4096).map(|i| if i < 2048 { (0.001, hidden(i)) } else { (0.5, 0.5 * error(i)) }).collect();
        assert!(scaled(&tried, 0.7).is_none());
        let few: Vec<ErrorPair> = (0..100).map(|i| (0.5, error(i))).collect();
        assert!(scaled(&few, 1.0).is_none(), "few say nothing");
    }
}
