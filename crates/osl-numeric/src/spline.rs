//! Splines of floats at one point, and the search for the position at which they reach a value.
//!
//! The built-in `spline` is ordinary instructions over its knots; this module evaluates the same polynomials
//! for the search alone. A [`Curve`] is prepared once for all positions that are searched in the same knots.
//! The search is written in steps without branches, so that a caller can take them for many points at once.
//! Source: OSL language specification, chapter on splines.

use super::basis::{Basis, CONSTANT, SIXTH};
use super::tangent::Dual;
use super::{Number, Scalar};

/// Steps of the search in a segment, for single and for double precision; and the number of steps that
/// interpolate rather than bisect.
const STEPS: (f32, f64) = (32.0, 96.0);
const INTERPOLATED: i32 = 24;
/// The tolerance of the search, in x and in the value: for single and for double precision.
const NEAR: (f32, f64) = (1e-6, 1e-15);

/// A number in the search: a plain one, or one with its derivative.
pub trait Follow<R>: Number<Mask = bool> {
    /// A constant number.
    fn still(value: R) -> Self;
    /// The number.
    fn value(self) -> R;
    /// The value of a curve at the boundary between two segments.
    fn at_end(curve: &Curve<R>, end: &End<R>) -> Self;
}

impl<R: Scalar> Follow<R> for R {
    #[inline(always)]
    fn still(value: R) -> R {
        value
    }

    #[inline(always)]
    fn value(self) -> R {
        self
    }

    #[inline(always)]
    fn at_end(_: &Curve<R>, end: &End<R>) -> R {
        end.value
    }
}

impl<R: Scalar> Follow<R> for Dual<R> {
    fn still(value: R) -> Dual<R> {
        Dual { v: value, d: R::lit(0.0) }
    }

    fn value(self) -> R {
        self.v
    }

    fn at_end(curve: &Curve<R>, end: &End<R>) -> Dual<R> {
        // The derivative is 0 unless a knot is infinite.
        curve.at(Dual::still(end.place))
    }
}

/// The boundary between two segments.
#[derive(Clone, Copy, Debug)]
pub struct End<R> {
    place: R,
    value: R,
}

/// A spline over knots. Knots after the last repeat it, and no knots at all count as a single 0.
#[derive(Debug)]
pub struct Curve<R> {
    /// The basis of the coefficients in `rows`.
    basis: Option<&'static Basis>,
    rows: [[R; 4]; 4],
    /// Whether each segment has the value of a knot.
    is_constant: bool,
    segments: i32,
    /// The number of segments.
    scale: R,
    /// Coefficients of t³, t², t and 1 for each segment; at least one segment.
    pieces: Vec<[R; 4]>,
    /// The boundaries of the segments, one more than segments.
    ends: Vec<End<R>>,
    /// The values beyond which the result is 0 or 1.
    first: R,
    last: R,
    is_rising: bool,
}

/// The beginning of a search.
#[derive(Clone, Copy, Debug)]
pub enum Start<N> {
    /// The position is known.
    Found(N),
    /// It has to be searched.
    Between(Bracket<N>),
}

/// Two positions and the values there, between which a value is searched.
#[derive(Clone, Copy, Debug)]
pub struct Bracket<N> {
    /// The first position.
    pub x0: N,
    /// The second position.
    pub x1: N,
    /// The value at the first position.
    pub v0: N,
    /// The value at the second position.
    pub v1: N,
    /// Whether the first value was the lower one when the search began.
    pub is_rising: bool,
}

impl<R: Scalar> Default for Curve<R> {
    fn default() -> Self {
        let zero = R::lit(0.0);
        Curve {
            basis: None,
            rows: [[zero; 4]; 4],
            is_constant: false,
            segments: 0,
            scale: zero,
            pieces: Vec::new(),
            ends: Vec::new(),
            first: zero,
            last: zero,
            is_rising: false,
        }
    }
}

impl<R: Scalar> Curve<R> {
    /// Becomes the curve through the first `count` knots.
    pub fn prepare(&mut self, basis: &'static Basis, knots: &[R], count: usize) {
        if !self.basis.is_some_and(|known| std::ptr::eq(known, basis)) {
            (self.basis, self.rows) = (Some(basis), basis.rows.map(|row| row.map(coefficient)));
            self.is_constant = basis.name == CONSTANT;
        }
        let count = i32::try_from(count.min(knots.len())).unwrap_or(i32::MAX);
        let knot = |index: i32| {
            let index = usize::try_from(index).unwrap_or(0).min(knots.len().saturating_sub(1));
            knots.get(index).copied().unwrap_or(R::lit(0.0))
        };
        let (low, high) = if basis.step == 1 { (1, count - 2) } else { (0, count - 1) };
        self.is_rising = knot(1) < knot(count - 2);
        (self.first, self.last) = (knot(low), knot(high));
        self.segments = (count - 4) / basis.step + 1;
        self.scale = R::from_int(self.segments);
        self.pieces.clear();
        for segment in 0..self.segments.max(1) {
            let knots: [R; 4] = std::array::from_fn(|k| knot(segment * basis.step + k as i32));
            let [p0, p1, p2, p3] = knots;
            let piece = self.rows.map(|[b0, b1, b2, b3]| b0 * p0 + b1 * p1 + b2 * p2 + b3 * p3);
            self.pieces.push(if self.is_constant { [p1; 4] } else { piece });
        }
        let mut ends = std::mem::take(&mut self.ends);
        ends.clear();
        ends.extend((0..=self.segments).map(|index| {
            let place = R::from_int(index) / self.scale;
            End { place, value: self.at(place) }
        }));
        self.ends = ends;
    }

    /// The segment at a position, and the position in it.
    #[inline(always)]
    pub fn locate<N: Follow<R>>(&self, x: N) -> (i32, N) {
        let x = within(x) * N::still(self.scale);
        let segment = x.value().to_int().min(self.segments - 1).max(0);
        (segment, x - N::still(R::from_int(segment)))
    }

    /// The coefficients of each segment.
    #[inline(always)]
    pub fn pieces(&self) -> &[[R; 4]] {
        &self.pieces
    }

    /// The value at a position in a segment with these coefficients.
    #[inline(always)]
    pub fn value<N: Follow<R>>(&self, [a, b, c, d]: [R; 4], t: N) -> N {
        if self.is_constant {
            return N::still(d);
        }
        ((N::still(a) * t + N::still(b)) * t + N::still(c)) * t + N::still(d)
    }

    fn at<N: Follow<R>>(&self, x: N) -> N {
        let (segment, t) = self.locate(x);
        let piece = usize::try_from(segment).ok().and_then(|segment| self.pieces.get(segment));
        self.value(piece.copied().unwrap_or([R::lit(0.0); 4]), t)
    }

    /// Whether the position of the value `y` is the beginning of the curve, and whether it is the end; the
    /// beginning counts if both hold.
    #[inline(always)]
    pub fn is_outside(&self, y: R) -> (bool, bool) {
        let is_before = if self.is_rising { y <= self.first } else { y >= self.first };
        let is_behind = if self.is_rising { y >= self.last } else { y <= self.last };
        (is_before, is_behind)
    }

    /// The ends of each segment.
    pub fn brackets<N: Follow<R>>(&self) -> impl Iterator<Item = Bracket<N>> {
        self.ends.windows(2).filter_map(|ends| {
            let [from, to] = ends else { return None };
            let (v0, v1) = (N::at_end(self, from), N::at_end(self, to));
            Some(Bracket { x0: N::still(from.place), x1: N::still(to.place), v0, v1, is_rising: v0.lt(v1) })
        })
    }

    /// Begins to search for the position with the value `y`: the first segment that brackets it counts.
    pub fn start<N: Follow<R>>(&self, y: N) -> Start<N> {
        match self.is_outside(y.value()) {
            (true, _) => return Start::Found(N::lit(0.0)),
            (_, true) => return Start::Found(N::lit(1.0)),
            _ => {}
        }
        let mut x = N::lit(0.0);
        for bracket in self.brackets::<N>() {
            if !bracket.holds(y) {
                x = bracket.end_toward(y);
                continue;
            }
            return if bracket.is_level::<R>() { Start::Found(bracket.x0) } else { Start::Between(bracket) };
        }
        Start::Found(x)
    }

    /// The largest number of steps of a search.
    #[inline(always)]
    pub fn steps() -> i32 {
        R::known(STEPS.0, STEPS.1).to_int()
    }

    fn find<N: Follow<R>>(&self, y: N) -> N {
        match self.start(y) {
            Start::Found(x) => x,
            Start::Between(bracket) => self.search(y, bracket),
        }
    }

    /// The position of the value `y` in a bracket.
    pub fn search<N: Follow<R>>(&self, y: N, mut bracket: Bracket<N>) -> N {
        let mut x = bracket.x0;
        for step in 0..Self::steps() {
            x = bracket.guess(y, step);
            let is_done;
            (bracket, is_done) = bracket.narrowed::<R>(y, (x, self.at(x)));
            if is_done {
                break;
            }
        }
        x
    }

    /// The x, from 0 to 1, at which the spline reaches `y`. The spline should be monotonic; if it is not, the
    /// first segment that brackets `y` counts.
    pub fn inverse(&self, y: R) -> R {
        self.find(y)
    }

    /// The derivative of [`Curve::inverse`] if `y` changes by `change`: the result of differentiating the
    /// steps of its search, as in the reference. It is the reciprocal of the spline's slope only as far as
    /// the search has converged, and 0 beyond the ends.
    pub fn inverse_derivative(&self, y: R, change: R) -> R {
        self.find(Dual { v: y, d: change }).d
    }
}

impl<N: Number<Mask = bool>> Bracket<N> {
    /// Whether the value `y` is between the values of the bracket.
    #[inline(always)]
    pub fn holds(&self, y: N) -> bool {
        let (low, high) =
            (N::select(self.is_rising, self.v0, self.v1), N::select(self.is_rising, self.v1, self.v0));
        y.ge(low) & y.le(high)
    }

    /// The end whose side the value `y` is on, if it is not between the values.
    #[inline(always)]
    pub fn end_toward(&self, y: N) -> N {
        let low = N::select(self.is_rising, self.v0, self.v1);
        N::select(y.lt(low) == self.is_rising, self.x0, self.x1)
    }

    /// Whether the values are too close to interpolate between them: then the first position counts.
    #[inline(always)]
    pub fn is_level<R: Scalar>(&self) -> bool
    where
        N: Follow<R>,
    {
        (self.v0 - self.v1).value().abs() < R::known(NEAR.0, NEAR.1)
    }

    /// The next position to evaluate in the search for `y`.
    #[inline(always)]
    pub fn guess(&self, y: N, step: i32) -> N {
        let Bracket { x0, x1, v0, v1, .. } = *self;
        let (zero, one) = (N::lit(0.0), N::lit(1.0));
        let guess = (y - v0) / (v1 - v0);
        let is_inside = (step < INTERPOLATED) & guess.gt(zero) & guess.lt(one);
        let t = N::select(is_inside, guess, N::lit(0.5));
        x0 * (one - t) + x1 * t
    }

    /// The bracket after the curve was found to have the value `v` at `x`, and whether the search ends there.
    #[inline(always)]
    #[must_use]
    pub fn narrowed<R: Scalar>(&self, y: N, (x, v): (N, N)) -> (Self, bool)
    where
        N: Follow<R>,
    {
        let Bracket { x0, x1, v0, v1, is_rising } = *self;
        let is_first = v.lt(y) == is_rising;
        let (x0, v0) = (N::select(is_first, x, x0), N::select(is_first, v, v0));
        let (x1, v1) = (N::select(is_first, x1, x), N::select(is_first, v1, v));
        let near = R::known(NEAR.0, NEAR.1);
        let is_done = (x1 - x0).value().abs().lt(near) | (v - y).value().abs().lt(near);
        (Bracket { x0, x1, v0, v1, is_rising }, is_done)
    }
}

/// A coefficient of a basis. Those that are not exactly floats are sixths.
fn coefficient<R: Scalar>(c: f32) -> R {
    let sixths = [(SIXTH, 1.0), (-SIXTH, -1.0), (4.0 * SIXTH, 4.0)];
    match sixths.into_iter().find(|(single, _)| *single == c) {
        Some((_, sixths)) => R::known(c, sixths / 6.0),
        None => R::lit(c),
    }
}

/// A number clamped to 0 to 1; NaN stays.
#[inline(always)]
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
            let mut curve = Curve::default();
            curve.prepare(basis, &knots, 7);
            for (index, expected) in expected.into_iter().enumerate() {
                let x = (index % 6) as f32 * 0.2;
                let got = if index < 6 { curve.at(x) } else { curve.inverse(x) };
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
            let mut curve = Curve::default();
            curve.prepare(spline_basis(name), &knots, 6);
            for (y, expected) in [0.25_f32, 0.5].into_iter().zip(expected) {
                let got = f64::from(curve.inverse_derivative(y, 0.25));
                assert!((got - expected).abs() <= expected * 2e-7, "{name} {y}: {got:e} for {expected:e}");
            }
        }
    }

    #[test]
    fn too_few_knots_are_no_harm() {
        let mut curve = Curve::default();
        for basis in &BASES {
            for count in 0..4 {
                curve.prepare(basis, &[0.0_f32, 1.0, 2.0][..count.min(3)], count);
                assert!(curve.inverse(0.3).is_finite());
            }
            curve.prepare(basis, &[0.0; 7], 7);
            assert!(curve.inverse(f32::NAN).is_finite());
        }
    }
}
