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
    /// Whether a row is faster than another beyond the spread of both times: other work on the machine only
    /// adds, so the time of a row lies between its fastest round and the median.
    pub(super) fn is_faster(&self, row: usize, than: usize) -> bool {
        let ends = |at: usize| self.rows.get(at).map(|row| [row.ns_least, row.ns_per_pixel]);
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

    /// Whether a row is better than another in one respect, and whether it is worse in one.
    fn compared(&self, row: usize, other: usize) -> [bool; 2] {
        [(row, other), (other, row)].map(|(a, b)| self.is_faster(a, b) || self.is_closer(a, b))
    }

    /// The front, the fastest row first: no row of it is better than another one without being worse too, and
    /// for each row outside there is one in the front that is not worse. Of rows that do not differ, the
    /// first one is taken.
    ///
    /// A row leaves only because of a row that stays. "Not slower beyond the spread" does not carry over from
    /// row to row: if a row beats a second one, and that beats a third one, the first need not beat the
    /// third.
    pub(super) fn front(&self) -> Vec<usize> {
        let mut open: Vec<usize> = (0..self.rows.len().min(self.errors.len())).collect();
        let mut front: Vec<usize> = Vec::new();
        while let Some(first) = open.first().copied() {
            let beats = |a: usize, b: usize| self.compared(a, b) == [true, false];
            let is_free = |row: &usize| !open.iter().any(|other| beats(*other, *row));
            let stays = open.iter().copied().find(is_free).unwrap_or(first);
            open.retain(|row| *row != stays && self.compared(*row, stays)[0]);
            front.push(stays);
        }
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
            ns_least: (1.0 - spread) * ns_per_pixel,
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
        assert_eq!(front(&[(4.0, 0.2), (3.9, 0.2)], &[0.1, 0.1], 0.0), [0]);
        // As fast as far as can be seen, but clearly closer.
        assert_eq!(front(&[(4.0, 0.2), (4.5, 0.2)], &[0.2, 0.1], 0.0), [1]);
        // Clearly faster, and as close.
        assert_eq!(front(&[(4.0, 0.2), (2.0, 0.2)], &[0.1, 0.101], 0.0), [1]);
        // The oracle does not see these differences.
        assert_eq!(front(&[(1.0, 0.2), (4.0, 0.2)], &[0.02, 0.01], 0.2), [0]);
    }

    #[test]
    fn a_row_leaves_only_because_of_a_row_that_stays() {
        // Each row is beaten by the next one, whose time does not differ beyond the spread. The last one is
        // clearly slower than the first ones.
        let chain = [(13.0, 0.5), (22.0, 0.6), (50.0, 0.6), (110.0, 0.6), (300.0, 0.7)];
        assert_eq!(front(&chain, &[0.5, 0.4, 0.3, 0.2, 0.1], 0.0), [0, 2, 4]);
        // The second row would beat the first one, but the third one makes it needless.
        assert_eq!(front(&[(32.0, 0.1), (80.0, 0.8), (84.0, 0.1)], &[0.4, 0.3, 0.2], 0.0), [0, 2]);
    }

    /// Slow rounds make the median of the fastest row uncertain upwards only.
    #[test]
    fn the_fastest_row_stays_whatever_its_slow_rounds() {
        assert_eq!(front(&[(5.8, 0.05), (7.9, 0.2)], &[0.4, 0.3], 0.0), [0, 1]);
    }

    #[test]
    fn of_rows_in_a_circle_one_stays() {
        // The first beats the second by its time, and the second the third by its error. The third does not
        // differ from the first.
        let [a, b, c] = [(1.0, 0.0), (2.0, 0.0), (3.0, 0.9)];
        assert_eq!(front(&[c, a, b], &[0.1015, 0.1, 0.099], 0.0), [1]);
    }
}
