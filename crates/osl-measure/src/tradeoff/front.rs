//! The Pareto front, and which of two rows is better beyond the noise of the measurements.

use super::{Error, Row};

/// Errors that differ by less than this share are equal: that is how well an oracle repeats.
const ALIKE: f64 = 0.02;
/// Errors below this share of the oracle's own standard error are equal.
const UNSEEN: f64 = 0.1;

/// The measurements of one output.
#[derive(Clone, Copy)]
pub(super) struct Measured<'a> {
    pub(super) rows: &'a [Row],
    pub(super) errors: &'a [Error],
    /// The oracle's own standard error.
    pub(super) oracle: f64,
}

impl Measured<'_> {
    /// Whether a row is faster than another beyond the spread of both times.
    pub(super) fn is_faster(&self, row: usize, than: usize) -> bool {
        let ends = |at: usize| {
            self.rows.get(at).map(|row| [1.0 - row.spread, 1.0 + row.spread].map(|by| by * row.ns_per_pixel))
        };
        matches!((ends(row), ends(than)), (Some([_, high]), Some([low, _])) if high < low)
    }

    /// Whether a row has a smaller error than another, beyond the noise of the oracle.
    pub(super) fn is_closer(&self, row: usize, than: usize) -> bool {
        let error = |at: usize| {
            let rms = self.errors.get(at).map_or(f64::INFINITY, |error| error.rms);
            if rms.is_nan() { f64::INFINITY } else { rms.max(UNSEEN * self.oracle) }
        };
        error(row) < (1.0 - ALIKE) * error(than)
    }

    /// Whether a row makes another one needless: it is better in one respect and not worse in the other. Of
    /// two rows that do not differ, the first one does.
    fn beats(&self, row: usize, other: usize) -> bool {
        let better = [self.is_faster(row, other), self.is_closer(row, other)];
        let worse = [self.is_faster(other, row), self.is_closer(other, row)];
        match (better.contains(&true), worse.contains(&true)) {
            (true, false) => true,
            (false, false) => row < other,
            _ => false,
        }
    }

    /// The rows that no other row beats, the fastest first.
    pub(super) fn front(&self) -> Vec<usize> {
        let count = self.rows.len().min(self.errors.len());
        let mut front: Vec<usize> =
            (0..count).filter(|row| !(0..count).any(|other| self.beats(other, *row))).collect();
        let cost = |at: &usize| self.rows.get(*at).map_or(f64::INFINITY, |row| row.ns_per_pixel);
        front.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
        front
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn front(rows: &[(f64, f64)], errors: &[f64], oracle: f64) -> Vec<usize> {
        let row = |(ns_per_pixel, spread): &(f64, f64)| Row {
            variant: String::new(),
            setting: String::new(),
            options: String::new(),
            ns_per_pixel: *ns_per_pixel,
            spread: *spread,
            speed_up: 1.0,
            evaluations: 1.0,
        };
        let rows: Vec<Row> = rows.iter().map(row).collect();
        let errors: Vec<Error> =
            errors.iter().map(|rms| Error { rms: *rms, nearly_all: *rms, largest: *rms }).collect();
        Measured { rows: &rows, errors: &errors, oracle }.front()
    }

    #[test]
    fn the_front_has_what_nothing_beats() {
        let rows = [(4.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)];
        assert_eq!(front(&rows, &[0.1, 0.5, 0.6, 0.2], 0.0), [1, 3, 0]);
    }

    #[test]
    fn what_does_not_differ_beyond_the_noise_is_the_same() {
        // The same image, a little faster by chance.
        assert_eq!(front(&[(4.0, 0.1), (3.9, 0.1)], &[0.1, 0.1], 0.0), [0]);
        // As fast as far as can be seen, but clearly closer.
        assert_eq!(front(&[(4.0, 0.1), (4.5, 0.1)], &[0.2, 0.1], 0.0), [1]);
        // Clearly faster, and as close.
        assert_eq!(front(&[(4.0, 0.1), (2.0, 0.1)], &[0.1, 0.101], 0.0), [1]);
        // The oracle does not see these differences.
        assert_eq!(front(&[(1.0, 0.1), (4.0, 0.1)], &[0.02, 0.01], 0.2), [0]);
    }
}
