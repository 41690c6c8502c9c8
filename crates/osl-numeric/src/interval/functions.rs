//! The elementary functions on intervals: the exact function at the ends, widened by the error of the strict
//! one. A single float gives the strict function itself.
//!
//! The bounds of the errors are about twice the errors that the tests find, among them one that compares all
//! floats.

use super::{Interval, down, up};
use crate::real::Real;
use crate::strict;

const PI: f32 = std::f32::consts::PI;
const PI_2: f32 = std::f32::consts::FRAC_PI_2;
/// The largest and the smallest exponential.
const LARGEST: f32 = f32::from_bits(0x7e80_0000);
const SMALLEST: f32 = f32::MIN_POSITIVE;

/// A function of one argument that is monotone, with the error of the strict one.
#[derive(Clone, Copy, Debug)]
pub struct Error {
    /// Its name in shaders.
    pub name: &'static str,
    /// The strict function.
    pub strict: fn(f32) -> f32,
    /// The exact function.
    pub exact: fn(f64) -> f64,
    /// Whether it falls.
    pub falls: bool,
    /// The first argument for which the bound of the error holds. For smaller ones, the strict function is in
    /// `lo..=hi`, and not beyond its value at `from` by more than the error.
    pub from: f32,
    /// The last argument, likewise.
    pub to: f32,
    /// The error is at most this plus `relative` times the magnitude of the exact result.
    pub absolute: f64,
    /// See `absolute`.
    pub relative: f64,
    /// The smallest result for any number.
    pub lo: f32,
    /// The largest result for any number.
    pub hi: f32,
    /// Arguments that separate the results: smaller arguments do not give larger results than this one
    /// (smaller results, if it falls), and larger arguments do not give smaller ones.
    pub knots: &'static [f32],
}

impl Error {
    /// The results for an interval.
    pub(super) fn of(&self, x: Interval) -> Interval {
        if let Some(x) = x.value() {
            return Interval::point((self.strict)(x));
        }
        let mut nan = Interval::NONE;
        if x.nan {
            for sign in [f32::NAN, -f32::NAN] {
                nan = nan.hull(Interval::point((self.strict)(sign)));
            }
        }
        if x.is_empty() {
            return nan;
        }
        let (low, high) = if self.falls { (x.hi, x.lo) } else { (x.lo, x.hi) };
        // Whether the end that gives the smallest result, or the largest, is where the bound holds.
        let at = |x: f32| (self.exact)(f64::from(x.clamp(self.from, self.to)));
        let is_beyond = |x: f32, low: bool| if low != self.falls { x < self.from } else { x > self.to };
        let error = |y: f64| self.absolute + self.relative * y.abs();
        let lo = if is_beyond(low, true) { self.lo } else { down(at(low) - error(at(low))).max(self.lo) };
        let hi = if is_beyond(high, false) { self.hi } else { up(at(high) + error(at(high))).min(self.hi) };
        let mut result = Interval::new(lo, hi);
        for knot in self.knots {
            let value = (self.strict)(*knot);
            let below = if self.falls { x.lo >= *knot } else { x.hi <= *knot };
            let above = if self.falls { x.hi <= *knot } else { x.lo >= *knot };
            if below {
                result = result.clip(f32::NEG_INFINITY, value);
            }
            if above {
                result = result.clip(value, f32::INFINITY);
            }
        }
        result.hull(nan)
    }
}

macro_rules! functions {
    ($($id:ident $name:ident $(falls $falls:literal)? ($from:expr, $to:expr) error ($absolute:expr, $relative:expr) in ($lo:expr, $hi:expr)
        knots $knots:expr;)*) => {
        $(
            pub(super) const $id: Error = Error {
                name: stringify!($name),
                strict: strict::$name::<f32>,
                exact: <f64 as Real>::$name,
                falls: false $(|| $falls)?,
                from: $from,
                to: $to,
                absolute: $absolute,
                relative: $relative,
                lo: $lo,
                hi: $hi,
                knots: $knots,
            };
        )*

        /// The monotone functions with the errors of their strict forms. (`cosh` is given by its right half.)
        pub const ERRORS: &[Error] = &[$($id),*];
    };
}

functions! {
    ASIN asin (-1.0, 1.0) error (1e-4, 0.0) in (-PI_2, PI_2) knots &[0.0];
    ACOS acos falls true (-1.0, 1.0) error (1e-4, 0.0) in (0.0, PI) knots &[];
    ATAN atan (f32::MIN, f32::MAX) error (2e-5, 0.0) in (-PI_2, PI_2) knots &[0.0];
    SINH sinh (-87.0, 87.0) error (2e-7, 4e-5) in (-LARGEST, LARGEST) knots &[0.0];
    COSH cosh (0.0, 87.0) error (0.0, 4e-5) in (0.999, LARGEST) knots &[0.0];
    TANH tanh (f32::MIN, f32::MAX) error (1e-5, 0.0) in (-1.0, 1.0) knots &[0.0];
    EXP exp (-87.0, 87.0) error (0.0, 3e-5) in (SMALLEST, LARGEST) knots &[0.0];
    EXP2 exp2 (-126.0, 126.0) error (0.0, 3e-5) in (SMALLEST, LARGEST) knots &[0.0];
    EXPM1 expm1 (-87.0, 87.0) error (1e-5, 3e-5) in (-1.0, LARGEST) knots &[0.0];
    LOG log (f32::MIN_POSITIVE, f32::MAX) error (5e-6, 4e-7) in (-87.5, 89.0) knots &[1.0];
    LOG2 log2 (f32::MIN_POSITIVE, f32::MAX) error (5e-6, 4e-7) in (-126.1, 128.1) knots &[1.0];
    LOG10 log10 (f32::MIN_POSITIVE, f32::MAX) error (5e-6, 4e-7) in (-38.0, 38.6) knots &[1.0];
    CBRT cbrt (f32::MIN, f32::MAX) error (1e-12, 3e-6) in (-7.1e12, 7.1e12) knots &[0.0];
    ERF erf (f32::MIN, f32::MAX) error (6e-6, 0.0) in (-1.0, 1.0) knots &[0.0];
}

/// The cube root: infinities have none.
pub(super) fn cbrt(x: Interval) -> Interval {
    CBRT.of(x).or_nan(x.has_infinity())
}

/// The largest angle for which the strict sine has the error [`OF_SINE`].
pub(super) const ANGLES: f32 = 1e4;
/// The error of sine and cosine.
pub(super) const OF_SINE: f64 = 1e-6;

pub(super) fn sine(x: Interval) -> Interval {
    wave(x, strict::sin::<f32>, <f64 as Real>::sin, std::f64::consts::FRAC_PI_2)
}

pub(super) fn cosine(x: Interval) -> Interval {
    wave(x, strict::cos::<f32>, <f64 as Real>::cos, 0.0)
}

/// A sine whose maxima are at `peak` and whole turns from there.
fn wave(x: Interval, strict: fn(f32) -> f32, exact: fn(f64) -> f64, peak: f64) -> Interval {
    use std::f64::consts::{PI, TAU};
    if let Some(x) = x.value() {
        return Interval::point(strict(x));
    }
    let all = Interval::new(-1.0, 1.0);
    if x.nan || !x.is_within(-ANGLES, ANGLES) {
        return if x.is_empty() && !x.nan { Interval::NONE } else { all };
    }
    if x.is_empty() {
        return Interval::NONE;
    }
    let (a, b) = (f64::from(x.lo), f64::from(x.hi));
    let (at_a, at_b) = (exact(a), exact(b));
    // Whether there is a whole number of turns from `from` within the interval, or almost.
    let passes = |from: f64| ((a - from) / TAU - 1e-6).ceil() <= (b - from) / TAU + 1e-6;
    let lo = if passes(peak + PI) { -1.0 } else { at_a.min(at_b) - OF_SINE };
    let hi = if passes(peak) { 1.0 } else { at_a.max(at_b) + OF_SINE };
    Interval::outward(lo, hi).meet(all)
}

/// The error of the tangent is at most this times 1 + tan².
pub(super) const OF_TANGENT: f64 = 5e-7;
/// The largest tangent for which this holds.
pub(super) const STEEPEST: f64 = 1e4;
/// The largest angle for which this holds.
pub(super) const TANGENT_ANGLES: f32 = 1e3;

pub(super) fn tangent(x: Interval) -> Interval {
    use std::f64::consts::{FRAC_PI_2, PI};
    if let Some(x) = x.value() {
        return Interval::point(strict::tan(x));
    }
    if x.is_empty() {
        return x;
    }
    let whole = || Interval::ANY.numbers().or_nan(x.nan || x.has_infinity());
    if x.nan || !x.is_within(-TANGENT_ANGLES, TANGENT_ANGLES) {
        return whole();
    }
    let (a, b) = (f64::from(x.lo), f64::from(x.hi));
    let (at_a, at_b) = (<f64 as Real>::tan(a), <f64 as Real>::tan(b));
    let branch = |x: f64| ((x + FRAC_PI_2) / PI).floor();
    if branch(a) != branch(b) || at_a > at_b || at_a.abs().max(at_b.abs()) > STEEPEST {
        return whole();
    }
    let error = |t: f64| OF_TANGENT * (1.0 + t * t);
    Interval::outward(at_a - error(at_a), at_b + error(at_b))
}

/// The error of the angle of a vector.
pub(super) const OF_ATAN2: f64 = 2e-5;

pub(super) fn atan2(y: Interval, x: Interval) -> Interval {
    if let (Some(y), Some(x)) = (y.value(), x.value()) {
        return Interval::point(strict::atan2(y, x));
    }
    let whole = Interval::new(-PI, PI);
    if y.nan || x.nan {
        return whole.or_nan(true);
    }
    if y.is_empty() || x.is_empty() {
        return Interval::NONE;
    }
    let mut result = whole;
    if y.lo > 0.0 || y.hi < 0.0 || x.lo > 0.0 {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for (y, x) in [(y.lo, x.lo), (y.lo, x.hi), (y.hi, x.lo), (y.hi, x.hi)] {
            let angle = <f64 as Real>::atan2(f64::from(y), f64::from(x));
            (lo, hi) = (lo.min(angle), hi.max(angle));
        }
        result = Interval::outward(lo - OF_ATAN2, hi + OF_ATAN2).meet(whole);
    }
    // The sign is that of y, and the size on the right half is at most a right angle.
    if y.lo.is_sign_positive() {
        result = result.meet(Interval::new(0.0, PI));
    }
    if y.hi.is_sign_negative() {
        result = result.meet(Interval::new(-PI, -0.0));
    }
    if x.lo.is_sign_positive() {
        result = result.meet(Interval::new(-PI_2, PI_2));
    }
    result
}

/// The strict power has the same steps: two to the power of the exponent times the logarithm, and special
/// cases.
pub(super) fn pow(x: Interval, y: Interval) -> Interval {
    if let (Some(x), Some(y)) = (x.value(), y.value()) {
        return Interval::point(strict::pow(x, y));
    }
    let magnitude = EXP2.of(y * LOG2.of(x.abs()));
    let mut result = if x.hi > 0.0 || x.nan { magnitude } else { Interval::NONE };
    if x.lo < 0.0 {
        let of_negative = match y.value() {
            Some(y) if y.trunc() == y && y.abs() < 16_777_216.0 => {
                if y % 2.0 == 0.0 {
                    magnitude
                } else {
                    -magnitude
                }
            }
            Some(y) if y.trunc() != y => Interval::point(0.0),
            _ => magnitude.hull(-magnitude).hull(Interval::point(0.0)),
        };
        result = result.hull(of_negative);
    }
    if x.has_zero() {
        result = result.hull(Interval::point(0.0));
    }
    // The special exponents, the first of which takes precedence.
    let special = |exponent: f32, of: Interval, result: Interval| match y.value() {
        Some(y) if y == exponent => of,
        Some(_) => result,
        None if y.contains(exponent) || (exponent == 0.0 && y.has_zero()) => result.hull(of),
        None => result,
    };
    let square = square(x);
    let square = square
        .clip(f32::NEG_INFINITY, f32::MAX)
        .hull(if square.hi == f32::INFINITY { Interval::point(f32::MAX) } else { Interval::NONE })
        .or_nan(x.nan);
    result = special(2.0, square, result);
    result = special(1.0, x, result);
    if x.has_zero() && !y.has_zero() {
        result = result.hull(Interval::point(0.0));
    }
    special(0.0, Interval::point(1.0), result)
}

/// The square of a number, which is never negative.
pub(super) fn square(x: Interval) -> Interval {
    x.abs().increasing(|x| x * x)
}

/// The sum of the squares, in the order of the inner product of a vector with itself.
pub(super) fn square_of(v: [Interval; 3]) -> Interval {
    square(v[0]) + square(v[1]) + square(v[2])
}

/// Sums of squares below this are computed again from a scaled vector.
const SMALL_SQUARE: f32 = f32::from_bits(0x0100_0000);
/// No vector with a smaller square is longer.
const SMALL_LENGTH: f32 = 3.2e-19;

/// The length of a vector, with the rescue of small ones.
pub(super) fn length(square: Interval, v: [Interval; 3]) -> Interval {
    if let (Some(square), [Some(x), Some(y), Some(z)]) = (square.value(), v.map(Interval::value)) {
        return Interval::point(<f32 as Real>::length(square, [x, y, z]));
    }
    let square = square.meet(square_of(v)).or_nan(square.nan);
    let mut result = square.meet(Interval::new(SMALL_SQUARE, f32::INFINITY)).sqrt();
    if square.lo < SMALL_SQUARE {
        result = result.hull(Interval::new(0.0, SMALL_LENGTH));
    }
    result.or_nan(square.nan)
}

/// The remainder for a varying divisor.
pub(super) fn fmod(a: Interval, b: Interval) -> Interval {
    if let (Some(a), Some(b)) = (a.value(), b.value()) {
        return Interval::point(strict::fmod(a, b));
    }
    let zero = if b.has_zero() { Interval::point(0.0) } else { Interval::NONE };
    let quotient = a / b;
    let is_plain =
        ![a, b].iter().any(|x| x.nan || x.has_infinity()) && !b.has_zero() && quotient.is_within(-1e9, 1e9);
    if !is_plain {
        return Interval::ANY;
    }
    let whole = quotient.trunc();
    if whole.lo == whole.hi {
        // The strict function makes −0 a 0.
        return (a - Interval::point(whole.lo + 0.0) * b).hull(zero);
    }
    // The quotient is rounded, so that it may reach the next whole number; and so are product and difference.
    let (size, divisor) = (f64::from(a.magnitude()), f64::from(b.magnitude()));
    let error = 4e-7 * size + 1e-44;
    let most = divisor * (1.0 + 1e-6) + error;
    let lo = if a.lo >= 0.0 { -error } else { -most };
    let hi = if a.hi <= 0.0 { error } else { most };
    Interval::outward(lo, hi).hull(zero)
}

/// The exact remainder.
pub(super) fn fmod_exact(a: Interval, b: Interval) -> Interval {
    if let (Some(a), Some(b)) = (a.value(), b.value()) {
        return Interval::point(a % b);
    }
    let Some(b) = b.value().filter(|b| *b != 0.0 && b.is_finite()) else { return Interval::ANY };
    if a.is_empty() {
        return a;
    }
    let numbers = a.clip(f32::MIN, f32::MAX);
    let nan = a.nan || a.has_infinity();
    if numbers.is_empty() {
        return Interval::NONE.or_nan(nan);
    }
    let (lo, hi) = (numbers.lo % b, numbers.hi % b);
    // Both differences are multiples of the divisor, and exact in double precision unless they are large.
    let base = |x: f32, rest: f32| f64::from(x) - f64::from(rest);
    let is_small = numbers.magnitude() < 1e6 * b.abs();
    let result =
        if is_small && base(numbers.lo, lo) == base(numbers.hi, hi) && (numbers.lo > 0.0 || numbers.hi < 0.0)
        {
            Interval::new(lo, hi)
        } else {
            let size = b.abs().min(numbers.magnitude());
            let lo = if numbers.lo >= 0.0 { -0.0 } else { -size };
            Interval::new(lo, if numbers.hi <= 0.0 { 0.0 } else { size })
        };
    result.or_nan(nan)
}

/// The power for curves of colors: rounded once, so that it is monotone up to a unit in the last place.
pub(super) fn pow_accurate(x: Interval, y: Interval) -> Interval {
    if let (Some(x), Some(y)) = (x.value(), y.value()) {
        return Interval::point(strict::pow_accurate(x, y));
    }
    let Some(y) = y.value().filter(|y| *y > 0.0 && *y < 4.0) else { return Interval::ANY };
    if x.is_empty() || !x.is_within(1e-9, 1e9) {
        return if x.is_empty() && !x.nan { x } else { Interval::ANY };
    }
    let at = |x: f32| f64::from(strict::pow_accurate(x, y));
    Interval::outward(at(x.lo) * (1.0 - 3e-7), at(x.hi) * (1.0 + 3e-7))
}
