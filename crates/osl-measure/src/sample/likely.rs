//! Clopper–Pearson limits of a proportion in a random sample: how large the share of all pixels above a bound
//! is, if that of some random pixels is known.

use pxfm::{f_exp, f_log, f_log1p};

/// The confidence of each limit.
pub const SURE: f64 = 0.95;

/// The limits of a share of which `seen` in `of` random pixels are known: it is below the first, or above the
/// second, with a probability of at most 5 % each (Clopper and Pearson, 1934).
pub fn share(seen: u64, of: u64) -> [f64; 2] {
    let seen = seen.min(of);
    let low = if seen == 0 { 0.0 } else { solve(|p| 1.0 - up_to(seen - 1, of, p) < 1.0 - SURE) };
    let high = if seen == of { 1.0 } else { solve(|p| up_to(seen, of, p) > 1.0 - SURE) };
    [low, high]
}

/// The largest probability that is too small.
fn solve(is_too_small: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if is_too_small(middle) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The probability of at most `seen` hits in `of` trials, each with probability `p`.
fn up_to(seen: u64, of: u64, p: f64) -> f64 {
    let odds = f_log(p) - f_log1p(-p);
    let mut term = of as f64 * f_log1p(-p);
    let mut sum = f_exp(term);
    for hit in 0..seen {
        term += f_log((of - hit) as f64 / (hit + 1) as f64) + odds;
        sum += f_exp(term);
    }
    sum.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_tables() {
        let near = |[low, high]: [f64; 2], wanted: [f64; 2]| {
            assert!((low - wanted[0]).abs() < 5e-5 && (high - wanted[1]).abs() < 5e-5, "{low} {high}");
        };
        // The rule of three: none of n leaves 3/n.
        near(share(0, 4096), [0.0, 3.0 / 4096.0]);
        near(share(5, 10), [0.2224, 0.7776]);
        near(share(10, 10), [0.7411, 1.0]);
        near(share(4000, 4096), [0.9723, 0.9803]);
    }

    #[test]
    fn one_pixel_in_a_thousand_can_be_seen() {
        assert!(share(0, 4096)[1] < 1e-3 && share(9, 4096)[0] > 1e-3);
        assert!(share(0, 256)[1] > 1e-3);
    }
}
