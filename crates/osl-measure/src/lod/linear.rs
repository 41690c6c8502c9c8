//! Linear forms: an output as a constant and slopes along the coordinate and the width of a pixel, by least
//! squares.
//!
//! A slope is kept only if it is many standard errors from 0 and changes the output by more than may be
//! ignored. This module must not know shaders.

/// A point of a fit.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// The values of the columns.
    pub(super) columns: Vec<f64>,
    pub(super) wanted: f64,
    /// How much its squared error counts.
    pub(super) weight: f64,
    /// Points of one group may err alike.
    pub(super) group: usize,
}

/// A constant, and a slope along each column; columns without a slope have 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Form {
    pub(super) constant: f64,
    pub(super) slopes: Vec<f64>,
}

/// How many standard errors a slope is at least.
const SURE: f64 = 6.0;
/// Which share of a column's variance at least no other column explains.
const OWN: f64 = 1e-6;
/// Maximum number of decimals of a slope that is rounded.
const DECIMALS: u32 = 15;

/// The form with significant slopes, if there are any. Changes of the output up to `ignored` are ignored.
pub(super) fn fit(points: &[Point], ignored: f64) -> Option<Form> {
    let count = points.first()?.columns.len();
    let mut used: Vec<usize> = (0..count).collect();
    while !used.is_empty() {
        let fit = Fit::of(points, &used);
        let least = fit.slopes.iter().map(|slope| slope.doubt(ignored)).enumerate();
        let (at, doubt) = least.max_by(|a, b| a.1.total_cmp(&b.1))?;
        if doubt <= 1.0 {
            let mut slopes = vec![0.0; count];
            let mut constant = fit.wanted;
            for ((column, slope), middle) in used.iter().zip(&fit.slopes).zip(&fit.middles) {
                let value = shortest(slope.value, slope.uncertain);
                *slopes.get_mut(*column)? = value;
                constant -= value * middle;
            }
            return Some(Form { constant, slopes });
        }
        used.remove(at);
    }
    None
}

/// The number with the fewest decimals within a standard error: the others are chance. So a slope that is a
/// whole number stays right far away.
fn shortest(x: f64, uncertain: f64) -> f64 {
    let mut scale = 1.0;
    for _ in 0..DECIMALS {
        let rounded = (x * scale).round() / scale;
        if (rounded - x).abs() <= uncertain {
            return rounded;
        }
        scale *= 10.0;
    }
    x
}

/// A slope, its standard error, and by how much the column changes over all points.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    value: f64,
    uncertain: f64,
    reach: f64,
}

impl Slope {
    /// Above 1 if the slope may be chance or is not worth its cost; infinite if it is not known.
    fn doubt(self, ignored: f64) -> f64 {
        let by_chance = SURE * self.uncertain / self.value.abs();
        let doubt = by_chance.max(ignored / (self.value.abs() * self.reach));
        if doubt.is_finite() { doubt } else { f64::INFINITY }
    }
}

struct Fit {
    /// The mean of what is wanted, and of each column.
    wanted: f64,
    middles: Vec<f64>,
    slopes: Vec<Slope>,
}

impl Fit {
    /// Fits some columns. A column that others explain has the slope 0.
    fn of(points: &[Point], used: &[usize]) -> Fit {
        let total: f64 = points.iter().map(|point| point.weight).sum();
        let mean = |of: &dyn Fn(&Point) -> f64| {
            points.iter().map(|point| point.weight * of(point)).sum::<f64>() / total.max(f64::MIN_POSITIVE)
        };
        let value = |point: &Point, column: usize| point.columns.get(column).copied().unwrap_or(0.0);
        let wanted = mean(&|point| point.wanted);
        let middles: Vec<f64> = used.iter().map(|column| mean(&|point| value(point, *column))).collect();
        let spread = |(column, middle): (&usize, &f64)| {
            let variance = mean(&|point| (value(point, *column) - middle) * (value(point, *column) - middle));
            // What is left of a constant by rounding is no spread.
            if variance.sqrt() > 1e-9 * middle.abs() { variance.sqrt() } else { 0.0 }
        };
        let spreads: Vec<f64> = used.iter().zip(&middles).map(spread).collect();
        let scaled = |point: &Point| -> Vec<f64> {
            let each = used.iter().zip(middles.iter().zip(&spreads));
            each.map(
                |(column, (middle, spread))| {
                    if *spread > 0.0 { (value(point, *column) - middle) / spread } else { 0.0 }
                },
            )
            .collect()
        };
        let n = used.len();
        let mut table = vec![vec![0.0; n]; n];
        let mut right = vec![0.0; n];
        for point in points {
            let xs = scaled(point);
            for ((row, right), x) in table.iter_mut().zip(&mut right).zip(&xs) {
                *right += point.weight * x * (point.wanted - wanted) / total;
                row.iter_mut().zip(&xs).for_each(|(cell, y)| *cell += point.weight * x * y / total);
            }
        }
        let inverse = inverse(table);
        let times = |row: &[f64], list: &[f64]| row.iter().zip(list).map(|(a, b)| a * b).sum::<f64>();
        let slopes: Vec<f64> = inverse.iter().map(|row| times(row, &right)).collect();
        // Errors of points of one group are added before they are squared.
        let groups = points.iter().map(|point| point.group + 1).max().unwrap_or(0);
        let mut sums = vec![vec![0.0; n]; groups];
        for point in points {
            let xs = scaled(point);
            let error = point.wanted - wanted - times(&slopes, &xs);
            if let Some(sum) = sums.get_mut(point.group) {
                sum.iter_mut().zip(&xs).for_each(|(sum, x)| *sum += point.weight * x * error / total);
            }
        }
        let square = |x: f64| x * x;
        let uncertain = |row: &Vec<f64>| sums.iter().map(|sum| square(times(row, sum))).sum::<f64>().sqrt();
        let reach = |column: usize| {
            let values = points.iter().map(|point| value(point, column));
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            high - low
        };
        let one = |((column, spread), (slope, row)): ((&usize, &f64), (&f64, &Vec<f64>))| match *spread > 0.0
        {
            true => {
                Slope { value: slope / spread, uncertain: uncertain(row) / spread, reach: reach(*column) }
            }
            false => Slope::default(),
        };
        let slopes: Vec<Slope> =
            used.iter().zip(&spreads).zip(slopes.iter().zip(&inverse)).map(one).collect();
        Fit { wanted, middles, slopes }
    }
}

/// The inverse of a symmetric matrix with ones on its diagonal, by sweeping one column after the other.
/// Columns that earlier ones explain are left out: their rows and columns are 0.
fn inverse(mut table: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = table.len();
    let mut swept = vec![false; n];
    for k in 0..n {
        let Some(pivot_row) = table.get(k).cloned() else { continue };
        let pivot = pivot_row.get(k).copied().unwrap_or(0.0);
        if pivot <= OWN {
            continue;
        }
        if let Some(own) = swept.get_mut(k) {
            *own = true;
        }
        for (i, row) in table.iter_mut().enumerate() {
            let factor = row.get(k).copied().unwrap_or(0.0);
            for (j, (cell, other)) in row.iter_mut().zip(&pivot_row).enumerate() {
                *cell = match (i == k, j == k) {
                    (true, true) => -1.0 / pivot,
                    (true, false) => other / pivot,
                    (false, true) => factor / pivot,
                    (false, false) => *cell - factor * other / pivot,
                };
            }
        }
    }
    let keep =
        |i: usize, j: usize| swept.get(i).copied().unwrap_or(false) && swept.get(j).copied().unwrap_or(false);
    let row = |(i, row): (usize, &Vec<f64>)| {
        row.iter().enumerate().map(|(j, x)| if keep(i, j) { -x } else { 0.0 }).collect()
    };
    table.iter().enumerate().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a line of two coordinates with some noise, a third one that is constant, and one that is the
    /// sum of the first two.
    fn points(noise: f64, of: impl Fn(f64, f64) -> f64) -> Vec<Point> {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 24)
        };
        let one = |at: usize| {
            let (x, y) = (100.0 * random(), 100.0 * random());
            let wanted = of(x, y) + noise * (random() - 0.5);
            // Half of the points count little.
            let weight = if at.is_multiple_of(2) { 1.0 } else { 0.1 };
            Point { columns: vec![x, y, 0.7, x + y], wanted, weight, group: at % 16 }
        };
        (0..2000).map(one).collect()
    }

    #[test]
    fn significant_slopes_are_found_and_no_others() {
        let form = fit(&points(1.0, |x, _| 3.0 - 10.0 * x), 0.5).unwrap();
        assert!((form.slopes[0] + 10.0).abs() < 0.01 && (form.constant - 3.0).abs() < 0.2, "{form:?}");
        assert_eq!(form.slopes[1..], [0.0; 3]);
        let form = fit(&points(0.0, |x, y| 2.0 * x + 0.5 * y), 0.5).unwrap();
        let at = |x: f64, y: f64| {
            form.constant + form.slopes[0] * x + form.slopes[1] * y + form.slopes[3] * (x + y)
        };
        assert!((at(30.0, 50.0) - 85.0).abs() < 1e-9 && (at(500.0, -20.0) - 990.0).abs() < 1e-9, "{form:?}");
        assert_eq!(form.slopes[2], 0.0);
    }

    #[test]
    fn decimals_that_are_chance_are_left_out() {
        assert_eq!((shortest(3.999_99, 2e-5), shortest(3.999_99, 1e-6)), (4.0, 3.999_99));
        assert_eq!((shortest(-0.001_234_5, 1e-4), shortest(0.1, 0.0)), (-0.0012, 0.1));
        assert_eq!(shortest(1.0 / 3.0, 0.0), 1.0 / 3.0);
    }

    #[test]
    fn chance_and_small_changes_give_no_slope() {
        assert_eq!(fit(&points(1.0, |_, _| 0.0), 0.0), None);
        assert_eq!(fit(&points(0.001, |x, _| 0.004 * x), 0.5), None);
        assert!(fit(&points(0.001, |x, _| 0.006 * x), 0.5).is_some());
        assert_eq!(fit(&[], 0.5), None);
    }

    #[test]
    fn points_that_err_alike_are_no_proof() {
        // Two groups differ by chance; within them, all points are equal.
        let one = |at: usize| Point {
            columns: vec![(at % 2) as f64],
            wanted: (at % 2) as f64 + [0.0, 0.9, -0.9, 0.0][at % 4],
            weight: 1.0,
            group: at % 4,
        };
        assert_eq!(fit(&(0..1000).map(one).collect::<Vec<_>>(), 0.1), None);
    }
}
