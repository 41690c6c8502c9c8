//! Splines of floats at one point, and the search for the position at which they reach a value.
//!
//! The built-in `spline` is ordinary instructions over its knots; this module evaluates the same polynomials
//! for the search alone. It must not know arrays of the language. Source: OSL language specification, chapter
//! on splines.

use super::basis::Basis;
use super::tangent::Dual;
use super::{Number, Scalar};

/// Steps of the search in a segment, for single and for double precision; and the number of steps that
/// interpolate rather than bisect.
const STEPS: (f32, f64) = (32.0, 96.0);
const INTERPOLATED: i32 = 24;
/// The tolerance of the search, in x and in the value: for single and for double precision.
const NEAR: (f32, f64) = (1e-6, 1e-15);

/// A number in the search: a plain one, or one with its derivative.
trait Follow<R>: Number<Mask = bool> + PartialOrd {
    /// A constant number.
    fn still(value: R) -> Self;
    /// The number.
    fn value(self) -> R;
}

impl<R: Scalar> Follow<R> for R {
    fn still(value: R) -> R {
        value
    }

    fn value(self) -> R {
        self
    }
}

impl<R: Scalar> Follow<R> for Dual<R> {
    fn still(value: R) -> Dual<R> {
        Dual { v: value, d: R::lit(0.0) }
    }

    fn value(self) -> R {
        self.v
    }
}

/// A spline over knots; knots after the last repeat it, and no knots at all count as a single 0.
struct Spline<'a, R> {
    basis: &'a Basis,
    knots: &'a [R],
    count: i32,
}

impl<R: Scalar> Spline<'_, R> {
    fn segments(&self) -> i32 {
        (self.count - 4) / self.basis.step + 1
    }

    fn knot(&self, index: i32) -> R {
        let last = self.knots.len().saturating_sub(1);
        let index = usize::try_from(index).unwrap_or(0).min(last);
        self.knots.get(index).copied().unwrap_or(R::lit(0.0))
    }

    /// The coefficients of a row. Those that are not exactly floats are sixths.
    fn row(&self, row: usize) -> [R; 4] {
        let exact = |c: f32| R::known(c, (f64::from(c) * 6.0).round_ties_even() / 6.0);
        let of_sixths = |c: f32| f64::from(c) * 2.0 != (f64::from(c) * 2.0).round_ties_even();
        self.basis.rows[row].map(|c| if of_sixths(c) { exact(c) } else { R::lit(c) })
    }

    fn at<N: Follow<R>>(&self, x: N) -> N {
        let segments = self.segments();
        let x = within(x) * N::still(R::from_int(segments));
        let segment = x.value().to_int().min(segments - 1).max(0);
        if self.basis.name == "constant" {
            return N::still(self.knot(segment + 1));
        }
        let t = x - N::still(R::from_int(segment));
        let start = segment * self.basis.step;
        let mut value = N::lit(0.0);
        for index in 0..4 {
            let [b0, b1, b2, b3] = self.row(index);
            let knot = |k| self.knot(start + k);
            let term = b0 * knot(0) + b1 * knot(1) + b2 * knot(2) + b3 * knot(3);
            let term = N::still(term);
            value = if index == 0 { term } else { value * t + term };
        }
        value
    }

    /// Searches for `y` between two positions. Returns whether they bracket it, and the position: one end if
    /// they do not.
    fn search<N: Follow<R>>(&self, y: N, from: R, to: R) -> (bool, N) {
        let (mut x0, mut x1) = (N::still(from), N::still(to));
        let near = R::known(NEAR.0, NEAR.1);
        let (mut v0, mut v1) = (self.at(x0), self.at(x1));
        let rising = v0 < v1;
        let (low, high) = if rising { (v0, v1) } else { (v1, v0) };
        if !(y >= low && y <= high) {
            return (false, if (y < low) == rising { x0 } else { x1 });
        }
        if (v0 - v1).value().abs() < near {
            return (true, x0);
        }
        let mut x = x0;
        for step in 0..R::known(STEPS.0, STEPS.1).to_int() {
            let guess = (y - v0) / (v1 - v0);
            let inside = step < INTERPOLATED && guess > N::lit(0.0) && guess < N::lit(1.0);
            let t = if inside { guess } else { N::lit(0.5) };
            x = x0 * (N::lit(1.0) - t) + x1 * t;
            let v = self.at(x);
            if (v < y) == rising {
                (x0, v0) = (x, v);
            } else {
                (x1, v1) = (x, v);
            }
            if (x1 - x0).value().abs() < near || (v - y).value().abs() < near {
                break;
            }
        }
        (true, x)
    }
}

/// The x, from 0 to 1, at which the spline over the first `count` knots reaches `y`. The spline should be
/// monotonic; if it is not, the first segment that brackets `y` counts.
pub fn inverse<R: Scalar>(basis: &Basis, y: R, knots: &[R], count: usize) -> R {
    find(basis, y, knots, count)
}

/// The derivative of [`inverse`] if `y` changes by `change`: the result of differentiating the steps of its
/// search, as in the reference. It is the reciprocal of the spline's slope only as far as the search has
/// converged, and 0 beyond the ends.
pub fn inverse_derivative<R: Scalar>(basis: &Basis, y: R, change: R, knots: &[R], count: usize) -> R {
    find(basis, Dual { v: y, d: change }, knots, count).d
}

fn find<R: Scalar, N: Follow<R>>(basis: &Basis, y: N, knots: &[R], count: usize) -> N {
    let count = i32::try_from(count.min(knots.len())).unwrap_or(i32::MAX);
    let spline = Spline { basis, knots, count };
    let (low, high) = if basis.step == 1 { (1, count - 2) } else { (0, count - 1) };
    let rising = spline.knot(1) < spline.knot(count - 2);
    let (first, last) = (spline.knot(low), spline.knot(high));
    let value = y.value();
    if if rising { value <= first } else { value >= first } {
        return N::lit(0.0);
    }
    if if rising { value >= last } else { value <= last } {
        return N::lit(1.0);
    }
    let segments = spline.segments();
    let mut x = N::lit(0.0);
    for segment in 0..segments {
        let place = |s: i32| R::from_int(s) / R::from_int(segments);
        let (found, at) = spline.search(y, place(segment), place(segment + 1));
        x = at;
        if found {
            break;
        }
    }
    x
}

/// A number clamped to 0 to 1; NaN stays.
fn within<N: Number>(x: N) -> N {
    let x = N::select(x.lt(N::lit(0.0)), N::lit(0.0), x);
    N::select(x.gt(N::lit(1.0)), N::lit(1.0), x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::{BASES, basis as spline_basis};

    /// The check table of the specification.
    #[test]
    fn the_table_of_the_specification() {
        let knots = [0.0, 0.0, 0.2, 0.5, 0.7, 1.0, 1.0];
        let rows: [(&str, [f32; 12]); 6] = [
            (
                "catmull-rom",
                [
                    0., 0.1504, 0.3824, 0.5824, 0.7584, 0.9999999, 0., 0.249999, 0.4137481, 0.625, 0.8306831,
                    1.,
                ],
            ),
            (
                "bezier",
                [0., 0.0896, 0.3328, 0.6288, 0.8816, 1., 0., 0.3045466, 0.4421251, 0.5784648, 0.7295624, 1.],
            ),
            (
                "bspline",
                [
                    0.03333334, 0.1688, 0.3774667, 0.5774667, 0.7681334, 0.95, 0., 0.2330997, 0.4206389,
                    0.625, 0.8303805, 1.,
                ],
            ),
            (
                "hermite",
                [0., 0.0224, 0.1152, 0.284, 0.428, 0.6999999, 0., 0.499999, 0.7662891, 0.9440997, 1., 1.],
            ),
            ("linear", [0., 0.16, 0.38, 0.58, 0.76, 1., 0., 0.249999, 0.4166667, 0.625, 0.8333334, 1.]),
            ("constant", [0., 0., 0.2, 0.5, 0.7, 0.7, 0., 0.249999, 0.4999995, 0.749999, 0.75, 1.]),
        ];
        for (name, expected) in rows {
            let basis = spline_basis(name);
            assert_eq!(basis.name, name);
            let spline = Spline { basis, knots: &knots, count: 7 };
            for (index, expected) in expected.into_iter().enumerate() {
                let x = (index % 6) as f32 * 0.2;
                let got = if index < 6 { spline.at(x) } else { inverse(basis, x, &knots, 7) };
                assert!((got - expected).abs() < 2e-6, "{name} {index}: {got} for {expected}");
            }
        }
    }

    /// Derivatives printed by the reference at y = 1/4 and 1/2, where y changes by 1/4: the search with
    /// derivatives, step by step.
    #[test]
    fn slopes_are_those_of_the_search() {
        let knots = [0.0, 0.0, 0.2, 0.6, 1.0, 1.0];
        let printed: [(&str, [f64; 2]); 5] = [
            ("catmull-rom", [0.235423192, 0.193496525]),
            ("bspline", [0.268280745, 0.211686164]),
            ("linear", [0.208333313, 0.208333313]),
            ("bezier", [0.322751522, 0.228222534]),
            ("constant", [0.000905557186, 7.92741776e-06]),
        ];
        for (name, expected) in printed {
            for (y, expected) in [0.25_f32, 0.5].into_iter().zip(expected) {
                let got = f64::from(inverse_derivative(spline_basis(name), y, 0.25, &knots, 6));
                assert!((got - expected).abs() <= expected * 2e-7, "{name} {y}: {got:e} for {expected:e}");
            }
        }
    }

    #[test]
    fn too_few_knots_are_no_harm() {
        for basis in &BASES {
            for count in 0..4 {
                assert!(inverse::<f32>(basis, 0.3, &[0.0, 1.0, 2.0][..count.min(3)], count).is_finite());
            }
            assert!(inverse(basis, f32::NAN, &[0.0; 7], 7).is_finite());
        }
    }
}
