//! One impulse's kernel, a Gaussian times a cosine: plain in three dimensions, or filtered in the plane of
//! the surface.

use super::filter::Filter;
use super::waves::TWO_PI;
use crate::math;
use crate::number::Number;

const MINUS_PI: f32 = -f32::from_bits(0x4049_0fdb);

/// A kernel's contribution and the angle of its wave.
#[derive(Clone, Copy)]
pub(super) struct Contribution<N> {
    pub(super) value: N,
    pub(super) angle: f32,
}

/// A wave as a kernel sees it.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// Frequency: along the axes of space, or with a filter along its plane, changed by it, and its normal.
    pub(super) omega: [f32; 3],
    /// Factor of the kernel, 1 without a filter.
    pub(super) damping: f32,
}

/// What a filter makes of a frequency. The result depends on nothing else, so all impulses with the same
/// frequency share it, and so do all points with the same filter.
#[inline(always)]
pub(super) fn seen(filter: Option<&Filter>, omega: [f32; 3]) -> Seen {
    let Some(filter) = filter else { return Seen { omega, damping: 1.0 } };
    let [t, b, n] = filter.frame;
    let dot = |axis: [f32; 3]| omega[0] * axis[0] + omega[1] * axis[1] + omega[2] * axis[2];
    let mu = [dot(t), dot(b)];
    let y = filter.inverse_sum.row(mu);
    let damping = math::exp(-0.5 * (y[0] * mu[0] + y[1] * mu[1]));
    let shifted = filter.shift.row(mu);
    Seen { omega: [shifted[0], shifted[1], dot(n)], damping }
}

/// Plain or filtered. `FAR` permits waves of any frequency, see [`math::sin_cos`].
#[inline(always)]
pub(super) fn contribution<N: Number<Float = f32>, const FAR: bool>(
    filter: Option<&Filter>,
    a: f32,
    r: [N; 3],
    seen: Seen,
    phase: f32,
) -> Contribution<N> {
    match filter {
        None => wavelet::<N, 3, FAR>(N::constant(1.0), seen.omega, N::constant(phase), a, r),
        Some(filter) => filtered::<N, FAR>(filter, a, r, seen, phase),
    }
}

/// Handles what a loop over lanes does not: waves of extreme frequency, and the plain kernel in place of a
/// filtered one that is not finite.
#[cold]
#[inline(never)]
pub(super) fn careful<N: Number<Float = f32>>(
    filter: Option<&Filter>,
    a: f32,
    r: [N; 3],
    omega: [f32; 3],
    phase: f32,
) -> N {
    let one = contribution::<N, true>(filter, a, r, seen(filter, omega), phase).value;
    if filter.is_some() && !one.value().is_finite() {
        return contribution::<N, true>(None, a, r, seen(None, omega), phase).value;
    }
    one
}

/// weight · exp(−π a² |r|²) · cos(2π ω·r + φ).
#[inline(always)]
fn wavelet<N: Number<Float = f32>, const D: usize, const FAR: bool>(
    weight: N,
    omega: [f32; D],
    phase: N,
    a: f32,
    r: [N; D],
) -> Contribution<N> {
    let mut square = r[0].mul(r[0]).add(r[1].mul(r[1]));
    let mut along = r[0].scale(omega[0]).add(r[1].scale(omega[1]));
    if D > 2 {
        square = square.add(r[2].mul(r[2]));
        along = along.add(r[2].scale(omega[2]));
    }
    let gauss = bell(square.scale(MINUS_PI * (a * a)));
    let angle = along.scale(TWO_PI).add(phase);
    let (s, c) = math::sin_cos::<FAR>(angle.value());
    let cosine = angle.scale(-s).with_value(c);
    Contribution { value: weight.mul(gauss).mul(cosine), angle: angle.value() }
}

/// The exponential.
#[inline(always)]
fn bell<N: Number<Float = f32>>(x: N) -> N {
    let e = math::exp(x.value());
    x.scale(e).with_value(e)
}

/// The kernel restricted to the plane through the point, with its wave damped by the footprint. Source: Lagae
/// and others, *Procedural Noise using Sparse Gabor Convolution*, 2009, and the authors' *Improving Gabor
/// Noise*.
#[inline(always)]
fn filtered<N: Number<Float = f32>, const FAR: bool>(
    filter: &Filter,
    a: f32,
    r: [N; 3],
    seen: Seen,
    phase: f32,
) -> Contribution<N> {
    let [t, b, n] = filter.frame;
    let onto = |axis: [f32; 3]| r[0].scale(axis[0]).add(r[1].scale(axis[1])).add(r[2].scale(axis[2]));
    let away = onto(n).negate_if(1);
    let weight = bell(away.mul(away).scale(MINUS_PI * (a * a)));
    let [x, y, across] = seen.omega;
    let turn = away.scale(TWO_PI).scale(across);
    let phase = turn.negate_if(1).with_value(phase - turn.value());
    let weight = weight.scale(filter.footprint).scale(filter.overlap).scale(seen.damping);
    wavelet::<N, 2, FAR>(weight, [x, y], phase, filter.a, [onto(t), onto(b)])
}
