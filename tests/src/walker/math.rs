//! Mathematical functions, by the language's definitions.

use super::Stop;

/// `a / b`: 0 if the quotient is not finite, except if the divisor is a literal other than 0. Whether another
/// divisor counts as a constant depends on the optimiser, so the quotient is undefined where that matters.
pub(super) fn quotient(a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    let q = a / b;
    if q.is_finite() || (literal && b != 0.0) {
        Ok(q)
    } else if b == 0.0 {
        Ok(0.0)
    } else {
        Err(Stop::Open("overflow of a division"))
    }
}

/// Whether some components of a divisor are zero and others are not. If the optimiser finds it to be
/// constant, the quotients by the zeros are not guarded.
pub(super) fn is_mixed(b: [f32; 3]) -> bool {
    b.contains(&0.0) && b.iter().any(|x| *x != 0.0)
}

/// A float converted to an int: without its fraction; the smallest int if it is out of range.
pub(super) fn truncated(x: f32) -> i32 {
    if (-2_147_483_648.0..2_147_483_648.0).contains(&x) { x as i32 } else { i32::MIN }
}

/// The remainder of a truncated quotient.
pub(super) fn fmod(a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    let exact = a % b;
    if literal && b != 0.0 {
        return Ok(exact);
    }
    if b == 0.0 {
        return Ok(0.0);
    }
    let stepwise = a - truncated(a / b) as f32 * b;
    // If folding finds that the divisor is constant, the remainder is exact.
    if stepwise.to_bits() == exact.to_bits() { Ok(exact) } else { Err(Stop::Open("fmod by a variable")) }
}

/// The library's formula, in which the divisor is a variable.
pub(super) fn modulo(a: f32, b: f32) -> Result<f32, Stop> {
    Ok(a - b * quotient(a, b, false)?.floor())
}

pub(super) fn sign(x: f32) -> f32 {
    if x < 0.0 {
        -1.0
    } else if x == 0.0 {
        0.0
    } else {
        1.0
    }
}

/// Halves are rounded away from zero.
pub(super) fn round(x: f32) -> f32 {
    x.round()
}

pub(super) fn min(x: f32, y: f32) -> f32 {
    if x > y { y } else { x }
}

pub(super) fn max(x: f32, y: f32) -> f32 {
    if x <= y { y } else { x }
}

pub(super) fn clamp(x: f32, lo: f32, hi: f32) -> f32 {
    max(min(x, hi), lo)
}

pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// The second argument if the condition is not 0.
pub(super) fn select(a: f32, b: f32, c: f32) -> f32 {
    if c != 0.0 { b } else { a }
}

pub(super) fn step(edge: f32, x: f32) -> f32 {
    if x < edge { 0.0 } else { 1.0 }
}

pub(super) fn smoothstep(e0: f32, e1: f32, x: f32) -> f32 {
    if x < e0 {
        0.0
    } else if x >= e1 {
        1.0
    } else {
        let t = (x - e0) / (e1 - e0);
        (3.0 - 2.0 * t) * (t * t)
    }
}

pub(super) fn linearstep(e0: f32, e1: f32, x: f32) -> Result<f32, Stop> {
    if e0 == e1 {
        return Ok(step(e0, x));
    }
    quotient(clamp(x, e0, e1) - e0, e1 - e0, false)
}

pub(super) fn sqrt(x: f32) -> f32 {
    if x >= 0.0 { x.sqrt() } else { 0.0 }
}

pub(super) fn inversesqrt(x: f32) -> f32 {
    if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 }
}

pub(super) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The length; if the squares would underflow, that of the scaled vector.
pub(super) fn length(v: [f32; 3]) -> f32 {
    let square = dot(v, v);
    if square < 2.350_988_7e-38 {
        let largest = v.iter().fold(0.0_f32, |m, x| m.max(x.abs()));
        if largest == 0.0 {
            return 0.0;
        }
        let scaled = v.map(|x| x / largest);
        return dot(scaled, scaled).sqrt() * largest;
    }
    square.sqrt()
}

pub(super) fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d: [f32; 3] = std::array::from_fn(|at| a[at] - b[at]);
    dot(d, d).sqrt()
}

pub(super) fn normalize(v: [f32; 3]) -> [f32; 3] {
    let square = dot(v, v);
    if square == 0.0 {
        return [0.0; 3];
    }
    let by = 1.0 / square.sqrt();
    v.map(|x| x * by)
}

pub(super) fn faceforward(n: [f32; 3], i: [f32; 3], reference: [f32; 3]) -> [f32; 3] {
    // Like comparisons in the language: true for NaN.
    let facing = dot(i, reference);
    if facing > 0.0 || facing.is_nan() { n.map(|x| -x) } else { n }
}

pub(super) fn reflect(i: [f32; 3], n: [f32; 3]) -> [f32; 3] {
    let twice = 2.0 * dot(n, i);
    std::array::from_fn(|at| i[at] - twice * n[at])
}

pub(super) fn refract(i: [f32; 3], n: [f32; 3], eta: f32) -> [f32; 3] {
    let along = dot(i, n);
    let k = 1.0 - eta * eta * (1.0 - along * along);
    if k < 0.0 || k.is_nan() {
        return [0.0; 3];
    }
    let by = eta * along + sqrt(k);
    std::array::from_fn(|at| eta * i[at] - n[at] * by)
}

pub(super) fn luminance(c: [f32; 3]) -> f32 {
    c[0] * 0.212_507_23 + c[1] * 0.715_350_15 + c[2] * 0.072_142_6
}
