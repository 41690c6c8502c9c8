//! Points without a slope, or with one on one side only: the exact derivatives by the rules.

use super::case::Case;
use super::measure;
use super::source::Point;

/// A call of `s` and `t`, their values, and the derivative if s changes by 1 and t by 16.
type Row = (&'static str, f32, f32, f32);

const ROWS: &[Row] = &[
    ("sqrt(s)", 0.0, 0.0, 0.0),
    ("sqrt(s)", -0.0, 0.0, 0.0),
    ("sqrt(s)", -4.0, 0.0, 0.0),
    ("sqrt(s)", f32::INFINITY, 0.0, 0.0),
    ("inversesqrt(s)", 0.0, 0.0, 0.0),
    ("inversesqrt(s)", -1.0, 0.0, 0.0),
    ("cbrt(s)", 0.0, 0.0, 0.0),
    ("asin(s)", 1.0, 0.0, 0.0),
    ("asin(s)", -1.0, 0.0, 0.0),
    ("asin(s)", 7.0, 0.0, 0.0),
    ("acos(s)", 1.0, 0.0, 0.0),
    ("acos(s)", -3.0, 0.0, 0.0),
    ("log(s)", 0.0, 0.0, 0.0),
    ("log(s)", -1.0, 0.0, 0.0),
    ("log(s)", 1e-39, 0.0, 0.0),
    ("log2(s)", 1e-38, 0.0, 0.0),
    ("log10(s)", -1.0, 0.0, 0.0),
    ("log(s, t)", 8.0, 1.0, 0.0),
    ("pow(s, t)", 0.0, 0.0, 0.0),
    ("pow(s, t)", 0.0, 1.0, 1.0),
    ("pow(s, t)", 0.0, 2.0, 0.0),
    // The logarithm counts as 0, so only s contributes.
    ("pow(s, t)", -1.0, 3.0, 3.0),
    ("hypot(s, t)", 0.0, 0.0, 0.0),
    // Squares that underflow.
    ("hypot(s, t)", 1e-30, 1e-30, 0.0),
    ("length(vector(s, t, 0))", 0.0, 0.0, 0.0),
    ("length(vector(s, t, 0))", 1e-30, 0.0, 0.0),
    ("distance(point(s), point(t))", 2.0, 2.0, 0.0),
    ("vector n = normalize(vector(s, t, 0)); f = n[0];", 0.0, 0.0, 0.0),
    ("atan2(s, t)", 0.0, 0.0, 0.0),
    ("s / t", 5.0, 0.0, 0.0),
    ("s / t", 0.0, 0.0, 0.0),
    ("tanh(s)", 1e10, 0.0, 0.0),
    // The exponential is clamped.
    ("erf(s)", 1e10, 0.0, 1.326_403_4e-38),
    ("erfc(s)", -20.0, 0.0, -1.326_403_4e-38),
    // Zero counts as positive.
    ("abs(s)", 0.0, 0.0, 1.0),
    ("abs(s)", -0.0, 0.0, 1.0),
    ("fabs(s)", -2.0, 0.0, -1.0),
    // Of two equal values, the first, and the second.
    ("min(s, t)", 3.0, 3.0, 1.0),
    ("max(s, t)", 3.0, 3.0, 16.0),
    ("clamp(s, t, 5)", 3.0, 3.0, 16.0),
    ("clamp(s, 1, t)", 3.0, 3.0, 1.0),
    // The remainder has the derivative of the dividend, and mod that of its formula.
    ("fmod(s, t)", 6.0, 3.0, 1.0),
    ("fmod(s, t)", 5.0, 0.0, 1.0),
    ("mod(s, t)", 6.0, 3.0, -31.0),
    ("mod(s, t)", 5.0, 0.0, 1.0),
    ("floor(s)", 2.0, 0.0, 0.0),
    ("step(s, t)", 2.0, 2.0, 0.0),
    ("smoothstep(0, 1, s)", 0.0, 0.0, 0.0),
    ("smoothstep(0, 1, s)", 1.0, 0.0, 0.0),
    ("smoothstep(s, t, 2)", 2.0, 2.0, 0.0),
    ("linearstep(0, 1, s)", 0.0, 0.0, 0.0),
    ("linearstep(0, 1, s)", 1.0, 0.0, 1.0),
    ("smooth_linearstep(0, 1, s, 0)", 0.5, 0.0, 1.0),
    ("aastep(s, t, 0, 0)", 1.0, 1.0, 0.0),
    ("s > t ? s : t", 2.0, 2.0, 16.0),
    ("select(s, t, s)", 0.0, 5.0, 1.0),
    ("mix(s, t, 0)", 3.0, 4.0, 1.0),
    // At both ends the spline keeps the derivative of x, beyond them not.
    ("float k[4] = { 0, 1, 2, 3 }; f = spline(\"linear\", s, k);", 0.0, 0.0, 1.0),
    ("float k[4] = { 0, 1, 2, 3 }; f = spline(\"linear\", s, k);", 1.0, 0.0, 1.0),
    ("float k[4] = { 0, 1, 2, 3 }; f = spline(\"linear\", s, k);", 1.5, 0.0, 0.0),
    ("float k[4] = { 0, 1, 2, 3 }; f = splineinverse(\"linear\", s, k);", 1.0, 0.0, 0.0),
    ("float k[4] = { 0, 1, 2, 3 }; f = splineinverse(\"linear\", s, k);", 1.5, 0.0, 1.0),
    ("vector n = refract(vector(s, 0, 0), vector(0, 1, 0), 2); f = n[0];", 1.0, 0.0, 0.0),
    ("determinant(matrix(s))", 1.0, 0.0, 0.0),
];

#[test]
fn rules_hold_where_there_is_no_slope() {
    let mut wrong = Vec::new();
    for (code, s, t, expected) in ROWS {
        let mut point = Point { x: [0.0; 11], d: [[0.0; 11]; 2] };
        (point.x[9], point.x[10]) = (*s, *t);
        (point.d[0][9], point.d[0][10]) = (1.0, 16.0);
        let got = match measure::computed(&Case::zero("edges", code, false), &[point]) {
            Ok(results) => results[0][1][0],
            Err(why) => {
                wrong.push(why);
                continue;
            }
        };
        // The sign of a derivative of 0 has no meaning.
        if got != *expected {
            wrong.push(format!("{code} at {s:?}, {t:?}: {got:?} rather than {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
