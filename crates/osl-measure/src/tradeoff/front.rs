//! The Pareto front.

use super::{Error, Row};

/// Rows that no other row beats in both time and error, the fastest first.
pub(super) fn front(rows: &[Row], errors: &[Error]) -> Vec<usize> {
    let cost = |at: usize| rows.get(at).map_or(f64::INFINITY, |row| row.ns_per_pixel);
    let error = |at: usize| errors.get(at).map_or(f64::INFINITY, |e| e.rms);
    let mut order: Vec<usize> = (0..rows.len().min(errors.len())).collect();
    order.sort_by(|a, b| cost(*a).total_cmp(&cost(*b)).then(error(*a).total_cmp(&error(*b))));
    let mut best = f64::INFINITY;
    order.retain(|at| {
        let better = error(*at) < best;
        best = best.min(error(*at));
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_has_what_nothing_beats() {
        let row = |ns: f64| Row {
            variant: String::new(),
            setting: String::new(),
            ns_per_pixel: ns,
            spread: 0.0,
            speed_up: 1.0,
            evaluations: 1.0,
        };
        let error = |rms: f64| Error { rms, nearly_all: rms, largest: rms };
        let rows = [row(4.0), row(1.0), row(2.0), row(3.0)];
        let errors = [error(0.1), error(0.5), error(0.6), error(0.2)];
        assert_eq!(front(&rows, &errors), [1, 3, 0]);
    }
}
