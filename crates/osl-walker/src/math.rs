//! Functions of numbers and vectors, by the formulas of the language's standard library.
//!
//! The order of the operations is part of each definition, because every one of them is rounded. Comparisons
//! here are those of IEEE 754, false for NaN.

use crate::operators::quotient;
use crate::state::{Stop, undefined};
use crate::value::Value;
use osl_numeric::strict;

/// `a − b·trunc(a/b)`, exact if b is a literal; 0 if b is 0.
pub(crate) fn fmod(a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    let exact = a % b;
    if literal && b != 0.0 {
        return Ok(exact);
    }
    if b == 0.0 {
        return Ok(0.0);
    }
    let stepwise = a - Value::Float(a / b).int() as f32 * b;
    // If the optimiser finds that the divisor is constant, the remainder is exact.
    if stepwise.to_bits() == exact.to_bits() { Ok(exact) } else { Err(undefined("fmod by a variable")) }
}

/// `a % b` of ints, and a if b is 0.
pub(crate) fn int_modulo(a: i32, b: i32) -> i32 {
    if b == 0 { a } else { a.wrapping_rem(b) }
}

/// The natural logarithm, or that to a base: a quotient of two.
pub(crate) fn log(n: &[f32]) -> Result<f32, Stop> {
    match n {
        [x, base] => quotient(strict::log(*x), strict::log(*base), false),
        _ => Ok(strict::log(n[0])),
    }
}

/// The root of the sum of squares.
pub(crate) fn hypot(n: &[f32]) -> Result<f32, Stop> {
    Ok(sqrt(n.iter().map(|x| x * x).reduce(|sum, square| sum + square).unwrap_or(0.0)))
}

/// `a − b·floor(a/b)`, where the quotient by 0 is 0.
pub(crate) fn modulo(a: f32, b: f32) -> Result<f32, Stop> {
    Ok(a - b * quotient(a, b, false)?.floor())
}

/// −1, 0 or 1; 1 for NaN.
pub(crate) fn sign(x: f32) -> f32 {
    if x < 0.0 {
        -1.0
    } else if x == 0.0 {
        0.0
    } else {
        1.0
    }
}

pub(crate) fn min(x: f32, y: f32) -> f32 {
    if x > y { y } else { x }
}

pub(crate) fn max(x: f32, y: f32) -> f32 {
    if x <= y { y } else { x }
}

pub(crate) fn clamp(x: f32, lo: f32, hi: f32) -> f32 {
    max(min(x, hi), lo)
}

pub(crate) fn step(edge: f32, x: f32) -> f32 {
    if x < edge { 0.0 } else { 1.0 }
}

/// A cubic from 0 at `e0` to 1 at `e1`, flat outside.
pub(crate) fn smoothstep(e0: f32, e1: f32, x: f32) -> f32 {
    if x < e0 {
        0.0
    } else if x >= e1 {
        1.0
    } else {
        let t = (x - e0) / (e1 - e0);
        (3.0 - 2.0 * t) * (t * t)
    }
}

/// A line from 0 at `e0` to 1 at `e1`, flat outside.
pub(crate) fn linearstep(e0: f32, e1: f32, x: f32) -> Result<f32, Stop> {
    if e0 == e1 {
        return Ok(step(e0, x));
    }
    quotient(clamp(x, e0, e1) - e0, e1 - e0, false)
}

/// The square root; 0 for negative numbers and NaN.
pub(crate) fn sqrt(x: f32) -> f32 {
    if x >= 0.0 { x.sqrt() } else { 0.0 }
}

/// The reciprocal of the square root; 0 unless x is positive.
pub(crate) fn inversesqrt(x: f32) -> f32 {
    if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 }
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The length. If the square is below twice the smallest normal number, it is computed from the vector
/// divided by its largest component.
pub(crate) fn length(v: [f32; 3]) -> f32 {
    let square = dot(v, v);
    if square < 2.0 * f32::MIN_POSITIVE {
        let largest = v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        if largest == 0.0 {
            return 0.0;
        }
        let scaled = v.map(|x| x / largest);
        return dot(scaled, scaled).sqrt() * largest;
    }
    square.sqrt()
}

pub(crate) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d: [f32; 3] = std::array::from_fn(|at| a[at] - b[at]);
    dot(d, d).sqrt()
}

/// The vector divided by its length; zero if its square is 0.
pub(crate) fn normalize(v: [f32; 3]) -> Result<[f32; 3], Stop> {
    let square = dot(v, v);
    if square.is_nan() {
        return Err(undefined("the direction of a NaN"));
    }
    if square == 0.0 {
        return Ok([0.0; 3]);
    }
    let reciprocal = 1.0 / square.sqrt();
    Ok(v.map(|x| x * reciprocal))
}

/// `n`, turned so that it faces against `i`, as `reference` does.
pub(crate) fn faceforward(n: [f32; 3], i: [f32; 3], reference: [f32; 3]) -> [f32; 3] {
    // A comparison in the language, which is true for NaN.
    let facing = dot(i, reference);
    if facing > 0.0 || facing.is_nan() { n.map(|x| -x) } else { n }
}

/// `i` mirrored at the plane with normal n, which has length 1.
pub(crate) fn reflect(i: [f32; 3], n: [f32; 3]) -> [f32; 3] {
    let twice = 2.0 * dot(n, i);
    std::array::from_fn(|at| i[at] - twice * n[at])
}

/// `i` refracted with the ratio of indices `eta`, by Snell's law; zero for total internal reflection.
pub(crate) fn refract(i: [f32; 3], n: [f32; 3], eta: f32) -> [f32; 3] {
    let along = dot(i, n);
    let k = 1.0 - eta * eta * (1.0 - along * along);
    if k < 0.0 || k.is_nan() {
        return [0.0; 3];
    }
    let by = eta * along + sqrt(k);
    std::array::from_fn(|at| eta * i[at] - n[at] * by)
}

/// The luminance of linear RGB with the primaries of Rec. 709.
pub(crate) fn luminance(c: [f32; 3]) -> f32 {
    c[0] * 0.212_507_23 + c[1] * 0.715_350_15 + c[2] * 0.072_142_6
}

pub(crate) fn transpose(m: [f32; 16]) -> [f32; 16] {
    std::array::from_fn(|at| m[at % 4 * 4 + at / 4])
}
