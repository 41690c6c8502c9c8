//! The safe range of a swept number: how far it may go from the given setting before points are wrong.
//!
//! The error does not grow evenly with the number: `1000 + u` rounds another way than `900 + u`, and what
//! overflows may be right again further out. So more than the powers of ten is tried, most of it near the end
//! of the range.

use super::trial::Trial;

/// The values of a decade that are tried within a range.
const COARSE: [f64; 2] = [2.0, 5.0];

/// The values of a decade that are tried near its end. They have two digits, so that a report shows them as
/// they are.
const FINE: [f64; 12] = [1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3, 3.9, 4.7, 5.6, 6.8, 8.2];

/// Shares of the end at which a range is tested at last. They are no round numbers, with which sums may be
/// exact.
const TESTS: [f64; 16] = [
    0.984, 0.967, 0.949, 0.931, 0.913, 0.894, 0.871, 0.846, 0.822, 0.793, 0.761, 0.727, 0.683, 0.637, 0.583,
    0.523,
];

/// The value that is tried where the errors of two powers of ten are alike, and below a share of the
/// tolerance.
const QUIET: ([f64; 1], f64) = ([3.0], 0.25);

/// Errors that differ by less than this factor are alike.
const ALIKE: f64 = 1.25;

/// How far the points stay right in one direction.
pub(super) struct Reach {
    /// The tried values at which they are right, from the given setting on.
    right: Vec<f64>,
    /// The first value after those at which they are wrong; `None` if there is none.
    pub(super) wrong: Option<f64>,
    /// Why the run stops there, if it does.
    pub(super) stopped: Option<String>,
    /// The last power of ten at which they are right, if that is further out: values between are wrong.
    pub(super) decade: Option<f64>,
    goes_up: bool,
}

impl Reach {
    /// The last value at which they are right; `None` if they are wrong at the first one.
    pub(super) fn last(&self) -> Option<f64> {
        self.right.last().copied()
    }

    fn is_before(&self, a: f64, b: f64) -> bool {
        if self.goes_up { a < b } else { a > b }
    }

    /// Tries these values in their order, until one is wrong. That one ends the range.
    fn holds_at(&mut self, values: &[f64], at: &dyn Fn(f64) -> Trial) -> bool {
        for by in values {
            let trial = at(*by);
            if trial.is_right() {
                continue;
            }
            self.right.extend(values.iter().take_while(|value| *value != by));
            let goes_up = self.goes_up;
            self.right.retain(|value| *value != *by && (*value < *by) == goes_up);
            self.sort();
            (self.wrong, self.stopped) = (Some(*by), trial.stopped);
            return false;
        }
        true
    }

    fn sort(&mut self) {
        self.right.sort_by(f64::total_cmp);
        self.right.dedup();
        if !self.goes_up {
            self.right.reverse();
        }
    }

    /// Numbers with these digits that lie between two others, the nearer ones first.
    fn between(&self, near: f64, far: f64, digits: &[f64]) -> Vec<f64> {
        let (low, high) = (near.min(far), near.max(far));
        let decades = pxfm::f_log10(low).floor() as i32..=pxfm::f_log10(high).ceil() as i32;
        let of = |decade| digits.iter().map(move |digit| digit * pxfm::f_exp10(f64::from(decade)));
        // Powers of ten are not exact.
        let is_inside = |x: &f64| *x > low * (1.0 + 1e-9) && *x < high * (1.0 - 1e-9);
        let mut list: Vec<f64> = decades.flat_map(of).filter(is_inside).collect();
        if !self.goes_up {
            list.reverse();
        }
        list
    }
}

/// Follows the trials of the powers of ten in one direction, the nearest to the given setting first. `at`
/// tries another value. One in `thin` of the tests of the end is made.
pub(super) fn reach(
    decades: &[(f64, &Trial)],
    goes_up: bool,
    (tolerance, thin): (f64, usize),
    at: &dyn Fn(f64) -> Trial,
) -> Reach {
    let count = decades.iter().position(|(_, trial)| !trial.is_right()).unwrap_or(decades.len());
    let (right, rest) = decades.split_at_checked(count).unwrap_or((decades, &[]));
    let decade = rest.first().map(|(by, trial)| (*by, trial.stopped.clone()));
    let mut reach = Reach {
        right: right.iter().map(|(by, _)| *by).collect(),
        wrong: decade.as_ref().map(|(by, _)| *by),
        stopped: decade.as_ref().and_then(|(_, why)| why.clone()),
        decade: None,
        goes_up,
    };
    for pair in right.windows(2) {
        let [(near, before), (far, after)] = pair else { continue };
        let digits = match (is_quiet(before, after, tolerance), thin) {
            (true, 1) => &QUIET.0[..],
            (true, _) => &[],
            (false, _) => &COARSE,
        };
        if !reach.holds_at(&reach.between(*near, *far, digits), at) {
            break;
        }
    }
    let (Some(first), Some(end)) = (reach.right.first().copied(), reach.wrong) else { return reach };
    let decade_before = if goes_up { end / 10.0 } else { end * 10.0 };
    let start = if reach.is_before(first, decade_before) { decade_before } else { first };
    let digits: Vec<f64> = FINE.iter().copied().step_by(thin.clamp(1, 2)).collect();
    let fine = reach.between(start, end, &digits);
    if reach.holds_at(&fine, at) {
        reach.right.extend(fine);
        reach.sort();
    }
    while let Some(last) = reach.last().filter(|last| reach.is_before(first, *last)) {
        let tests =
            TESTS.iter().step_by(thin.max(1)).map(|part| if goes_up { last * part } else { last / part });
        let tests: Vec<f64> = tests.filter(|by| reach.is_before(first, *by)).collect();
        let kept = reach.right.clone();
        if reach.holds_at(&tests, at) {
            break;
        }
        // The range ends at a number with two digits.
        let end = reach.wrong;
        reach.right = kept;
        reach.right.retain(|by| end.is_none_or(|end| if goes_up { *by < end } else { *by > end }));
    }
    // Beyond the last right power of ten, the next one shows the failure best.
    let last_decade = right.last().map(|(by, _)| *by);
    reach.decade = last_decade.filter(|by| reach.last().is_some_and(|last| reach.is_before(last, *by)));
    if let (Some(last), Some(end), Some((by, why))) = (last_decade, reach.wrong, decade)
        && reach.is_before(last, end)
    {
        (reach.wrong, reach.stopped) = (Some(by), why);
    }
    reach
}

/// Whether little seems to happen between two powers of ten.
fn is_quiet(a: &Trial, b: &Trial, tolerance: f64) -> bool {
    let pairs =
        || a.outcomes.iter().zip(&b.outcomes).map(|(a, b)| (a.worst.min(b.worst), a.worst.max(b.worst)));
    pairs().all(|(least, most)| most < QUIET.1 * tolerance && most < ALIKE * least.max(1e-9))
}

#[cfg(test)]
mod tests {
    use super::super::trial::{Outcome, Setting};
    use super::*;

    fn trial(error: f64) -> Trial {
        let outcome = Outcome {
            output: "r".to_string(),
            nan: 0.0,
            infinite: 0.0,
            range: [0.0, 1.0],
            rms: error,
            worst: error,
            wrong: f64::from(u8::from(error > 0.01)),
            flipped: 0.0,
        };
        Trial { setting: Setting::AsGiven, outcomes: vec![outcome], stopped: None }
    }

    fn reached(error: &dyn Fn(f64) -> f64, goes_up: bool) -> Reach {
        let decades: Vec<f64> = (0..=12).map(|n| f64::powi(if goes_up { 10.0 } else { 0.1 }, n)).collect();
        let trials: Vec<Trial> = decades.iter().map(|by| trial(error(*by))).collect();
        let list: Vec<(f64, &Trial)> = decades.into_iter().zip(&trials).collect();
        reach(&list, goes_up, (0.01, 1), &|by| trial(error(by)))
    }

    #[test]
    fn the_end_is_a_value_that_was_tried() {
        let up = reached(&|by| by * 1e-6, true);
        assert_eq!((up.last(), up.wrong), (Some(1e4), Some(1e5)));
        let up = reached(&|by| by * 1.4e-6, true);
        assert_eq!((up.last(), up.wrong), (Some(6.8e3), Some(1e4)));
        let down = reached(&|by| 1e-4 / by, false);
        assert!((down.last().unwrap_or(0.0) - 0.01).abs() < 1e-9);
        let all = reached(&|_| 1e-8, true);
        assert_eq!((all.last().map(f64::round), all.wrong), (Some(1e12), None));
    }

    #[test]
    fn what_is_wrong_between_powers_of_ten_ends_the_range() {
        // Wrong from 130 to 700, and from 2e4 on.
        let bad = |by: f64| (130.0..700.0).contains(&by) || by >= 2e4;
        let up = reached(&|by| if bad(by) { 0.1 } else { 0.004 + by * 1e-9 }, true);
        assert_eq!((up.last(), up.decade.map(f64::round)), (Some(120.0), Some(1e4)));
        assert!(up.wrong.is_some_and(|by| bad(by) && by < 700.0));
    }

    #[test]
    fn round_numbers_alone_do_not_count() {
        // Right where the number has two digits, and else only up to 300.
        let error = |by: f64| {
            let digits = by / f64::powi(10.0, by.log10().floor() as i32);
            let is_round = (digits * 10.0 - (digits * 10.0).round()).abs() < 1e-6;
            if by > 1e4 || (by > 300.0 && !is_round) { 0.1 } else { 0.004 + 1e-7 * by }
        };
        let up = reached(&error, true);
        assert!(up.last().is_some_and(|last| last <= 300.0), "{:?}", up.last());
    }
}
