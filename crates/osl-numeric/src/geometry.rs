//! Lengths, products and directions of three numbers.
//!
//! Sums run in the order x, y, z. This module does not distinguish points, vectors and normals, and must not
//! know spaces.

use super::common;
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
pub fn select<R: Number>(mask: R::Mask, yes: Triple<R>, no: Triple<R>) -> Triple<R> {
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
/// Where derivatives are wanted, the rules of the `derive` pass write another form, without the scaling.
#[inline(always)]
pub fn length<R: Real>(v: Triple<R>) -> R {
    R::length(dot(v, v), v)
}

/// [`length`] by operations, where `square` is the inner product of the vector with itself.
#[inline(always)]
pub(super) fn length_by_square<R: Real>(square: R, v: Triple<R>) -> R {
    let rescued = rescued_length(v);
    R::select(square.lt(R::lit(UNDERFLOWS_BELOW)), rescued, square.sqrt())
}

#[inline(always)]
fn rescued_length<R: Real>(v: Triple<R>) -> R {
    let [x, y, z] = [v[0].abs(), v[1].abs(), v[2].abs()];
    let largest = R::select(x.lt(y), y, x);
    let largest = R::select(largest.lt(z), z, largest);
    let scaled = [x / largest, y / largest, z / largest];
    let length = largest * dot(scaled, scaled).sqrt();
    R::select(largest.eq(R::lit(0.0)), R::lit(0.0), length)
}

/// The length without scaling.
#[inline(always)]
pub fn length_unrescued<R: Real>(v: Triple<R>) -> R {
    dot(v, v).sqrt()
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

/// The vector scaled to length 1 by a reciprocal; zero if its length is not positive.
#[inline(always)]
pub fn normalize<R: Real>(v: Triple<R>) -> Triple<R> {
    let square = dot(v, v);
    let zero = [R::lit(0.0); 3];
    // The root of a number is positive exactly if the number is.
    select(square.gt(R::lit(0.0)), scale(v, square.inverse_root()), zero)
}

/// `n` flipped to the side of `i`, judged by `reference`; a dot product of exactly 0 leaves it unchanged.
#[inline(always)]
pub fn faceforward<R: Real>(n: Triple<R>, i: Triple<R>, reference: Triple<R>) -> Triple<R> {
    select(dot(i, reference).gt(R::lit(0.0)), neg(n), n)
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
    select(k.ge(R::lit(0.0)), through, [R::lit(0.0); 3])
}
