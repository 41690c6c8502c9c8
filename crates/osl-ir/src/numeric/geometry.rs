//! Lengths, products and directions of three numbers.
//!
//! Sums run in the order x, y, z. This module does not distinguish points, vectors and normals, and must not
//! know spaces.

use super::arith::div;
use super::common;
use super::matrix;
use super::real::{Number, Real};

/// x, y, z.
pub type Triple<R> = [R; 3];

/// A smaller sum of squares has lost bits: twice the smallest normal float.
const UNDERFLOWS_BELOW: f32 = f32::from_bits(0x0100_0000);

/// a + b.
#[inline(always)]
pub fn add<R: Real>(a: Triple<R>, b: Triple<R>) -> Triple<R> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// a - b.
#[inline(always)]
pub fn sub<R: Real>(a: Triple<R>, b: Triple<R>) -> Triple<R> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Each component times `k`.
#[inline(always)]
pub fn scale<R: Real>(a: Triple<R>, k: R) -> Triple<R> {
    [a[0] * k, a[1] * k, a[2] * k]
}

/// Each component negated.
#[inline(always)]
pub fn neg<R: Real>(a: Triple<R>) -> Triple<R> {
    [-a[0], -a[1], -a[2]]
}

/// `yes` where `mask`, else `no`; both are computed.
#[inline(always)]
pub fn select<R: Number>(mask: bool, yes: Triple<R>, no: Triple<R>) -> Triple<R> {
    [R::select(mask, yes[0], no[0]), R::select(mask, yes[1], no[1]), R::select(mask, yes[2], no[2])]
}

/// The inner product.
#[inline(always)]
pub fn dot<R: Real>(a: Triple<R>, b: Triple<R>) -> R {
    (a[0] * b[0]).plus_product(a[1], b[1]).plus_product(a[2], b[2])
}

/// The outer product, right-handed.
#[inline(always)]
pub fn cross<R: Real>(a: Triple<R>, b: Triple<R>) -> Triple<R> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The length. If the squares would underflow, the vector is first scaled by its largest component.
///
/// The scaling costs three divisions on every lane. A loop may instead use [`length_unrescued`] and fall back
/// to this function only if [`length_underflows`] is true for some lane of the batch.
#[inline(always)]
pub fn length<R: Real>(v: Triple<R>) -> R {
    let square = dot(v, v);
    let rescued = rescued_length(v);
    R::select(square < R::lit(UNDERFLOWS_BELOW), rescued, square.sqrt())
}

#[inline(always)]
fn rescued_length<R: Real>(v: Triple<R>) -> R {
    let [x, y, z] = [v[0].abs(), v[1].abs(), v[2].abs()];
    let largest = R::select(x < y, y, x);
    let largest = R::select(largest < z, z, largest);
    let scaled = [x / largest, y / largest, z / largest];
    let length = largest * dot(scaled, scaled).sqrt();
    R::select(largest == R::lit(0.0), R::lit(0.0), length)
}

/// The length without scaling.
#[inline(always)]
pub fn length_unrescued<R: Real>(v: Triple<R>) -> R {
    dot(v, v).sqrt()
}

/// The value of [`length`] in the form that the reference uses together with derivatives: no scaling, and 0
/// if a component is NaN.
#[inline(always)]
pub fn length_with_derivative<R: Real>(v: Triple<R>) -> R {
    common::sqrt(dot(v, v))
}

/// Whether [`length`] and [`length_unrescued`] may differ for `v`.
#[inline(always)]
pub fn length_underflows<R: Real>(v: Triple<R>) -> bool {
    dot(v, v) < R::lit(UNDERFLOWS_BELOW)
}

/// The distance of two points, without scaling against underflow.
#[inline(always)]
pub fn distance<R: Real>(a: Triple<R>, b: Triple<R>) -> R {
    length_unrescued(sub(a, b))
}

/// The square of [`distance`].
#[inline(always)]
pub fn square_distance<R: Real>(a: Triple<R>, b: Triple<R>) -> R {
    let difference = sub(a, b);
    dot(difference, difference)
}

/// The distance of the point `q` from the segment `a`-`b`.
#[inline(always)]
pub fn distance_to_segment<R: Real>(a: Triple<R>, b: Triple<R>, q: Triple<R>) -> R {
    let along = sub(b, a);
    let square = dot(along, along);
    let t = common::clamp(div(dot(sub(q, a), along), square), R::lit(0.0), R::lit(1.0));
    let nearest = distance(q, add(a, scale(along, t)));
    R::select(square == R::lit(0.0), distance(q, a), nearest)
}

/// The vector scaled to length 1 by a reciprocal; zero if its length is not positive.
///
/// The folder's `normalize` of a constant divides instead: [`normalize_by_division`].
#[inline(always)]
pub fn normalize<R: Real>(v: Triple<R>) -> Triple<R> {
    let square = dot(v, v);
    let zero = [R::lit(0.0); 3];
    // The root of a number is positive exactly if the number is.
    select(square > R::lit(0.0), scale(v, square.inverse_root()), zero)
}

/// The vector divided by its (scaled) length: what the reference's optimizer makes of a constant vector.
#[inline(always)]
pub fn normalize_by_division<R: Real>(v: Triple<R>) -> Triple<R> {
    let length = length(v);
    select(length > R::lit(0.0), [v[0] / length, v[1] / length, v[2] / length], v)
}

/// `n` flipped to the side of `i`, judged by `reference`; a dot product of exactly 0 leaves it unchanged.
#[inline(always)]
pub fn faceforward<R: Real>(n: Triple<R>, i: Triple<R>, reference: Triple<R>) -> Triple<R> {
    select(dot(i, reference) > R::lit(0.0), neg(n), n)
}

/// The incident direction `i` reflected at the surface with unit normal `n`.
#[inline(always)]
pub fn reflect<R: Real>(i: Triple<R>, n: Triple<R>) -> Triple<R> {
    sub(i, scale(n, R::lit(2.0) * dot(n, i)))
}

/// The unit direction `i` refracted at the surface with unit normal `n` facing it. `eta` is the ratio of the
/// index of refraction on `i`'s side to that on the other. Zero for total reflection.
#[inline(always)]
pub fn refract<R: Real>(i: Triple<R>, n: Triple<R>, eta: R) -> Triple<R> {
    let one = R::lit(1.0);
    let cosine = dot(i, n);
    let k = one - eta * eta * (one - cosine * cosine);
    let through = sub(scale(i, eta), scale(n, eta * cosine + common::sqrt(k)));
    // NaN counts as negative: in OSL, a comparison with NaN is true.
    select(k >= R::lit(0.0), through, [R::lit(0.0); 3])
}

/// The results of [`fresnel`]: the shares of light and their directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fresnel<R> {
    /// Share reflected, 0..=1.
    pub reflected: R,
    /// Share transmitted, scaled by eta² for the change of solid angle.
    pub transmitted: R,
    /// Mirrored direction.
    pub reflection: Triple<R>,
    /// Refracted direction, zero for total reflection.
    pub refraction: Triple<R>,
}

/// Reflection and transmission of unpolarised light at a dielectric; arguments as for [`refract`].
#[inline(always)]
pub fn fresnel<R: Real>(i: Triple<R>, n: Triple<R>, eta: R) -> Fresnel<R> {
    let zero = R::lit(0.0);
    let one = R::lit(1.0);
    let c = dot(i, n).abs();
    let g_square = div(one, eta * eta) - one + c * c;
    let g = common::sqrt(g_square);
    let beta = g - c;
    let f = div(c * (g + c) - one, c * beta + one);
    let f = R::lit(0.5) * (one + f * f);
    let ratio = div(beta, g + c);
    let f = f * (ratio * ratio);
    // NaN counts as transmission.
    let stays = g_square < zero;
    Fresnel {
        reflected: R::select(stays, one, f),
        transmitted: R::select(stays, zero, (one - f) * eta * eta),
        reflection: reflect(i, n),
        refraction: select(stays, [zero; 3], refract(i, n, eta)),
    }
}

/// The point `p` rotated by `angle` radians around the axis from `a` to `b`.
#[inline(always)]
pub fn rotate<R: Real>(p: Triple<R>, angle: R, a: Triple<R>, b: Triple<R>) -> Triple<R> {
    let [x, y, z] = normalize(sub(b, a));
    let (s, c) = (angle.sin(), angle.cos());
    let zero = R::lit(0.0);
    let one = R::lit(1.0);
    let k = one - c;
    let turn = [
        x * x + (one - x * x) * c,
        x * y * k + z * s,
        x * z * k - y * s,
        zero,
        x * y * k - z * s,
        y * y + (one - y * y) * c,
        y * z * k + x * s,
        zero,
        x * z * k + y * s,
        y * z * k - x * s,
        z * z + (one - z * z) * c,
        zero,
        zero,
        zero,
        zero,
        one,
    ];
    add(matrix::transform_point(turn, sub(p, a)), a)
}
