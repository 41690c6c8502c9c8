//! One impulse's kernel, a Gaussian times a cosine: plain in three dimensions, or filtered in the plane of
//! the surface.

use super::filter::Filter;
use super::waves::{TWO_PI, Wave};
use crate::math;
use crate::number::Number;

const MINUS_PI: f32 = -f32::from_bits(0x4049_0fdb);

/// A kernel's contribution and the angle of its wave.
#[derive(Clone, Copy)]
pub(super) struct Contribution<N> {
    pub(super) value: N,
    pub(super) angle: f32,
}

/// Plain or filtered. `FAR` permits waves of any frequency, see [`math::sin_cos`].
#[inline(always)]
pub(super) fn contribution<N: Number<Float = f32>, const FAR: bool>(
    filter: Option<&Filter>,
    a: f32,
    r: [N; 3],
    wave: Wave,
) -> Contribution<N> {
    match filter {
        None => wavelet::<N, 3, FAR>(N::constant(1.0), wave.omega, N::constant(wave.phase), a, r),
        Some(filter) => filtered::<N, FAR>(filter, a, r, wave),
    }
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
    wave: Wave,
) -> Contribution<N> {
    let [t, b, n] = filter.frame;
    let onto = |axis: [f32; 3]| r[0].scale(axis[0]).add(r[1].scale(axis[1])).add(r[2].scale(axis[2]));
    let dot = |v: [f32; 3], axis: [f32; 3]| v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
    let away = onto(n).negate_if(1);
    let weight = bell(away.mul(away).scale(MINUS_PI * (a * a)));
    let turn = away.scale(TWO_PI).scale(dot(wave.omega, n));
    let phase = turn.negate_if(1).with_value(wave.phase - turn.value());
    let mu = [dot(wave.omega, t), dot(wave.omega, b)];
    let y = filter.inverse_sum.row(mu);
    let damping = math::exp(-0.5 * (y[0] * mu[0] + y[1] * mu[1]));
    let weight = weight.scale(filter.footprint).scale(filter.overlap).scale(damping);
    wavelet::<N, 2, FAR>(weight, filter.shift.row(mu), phase, filter.a, [onto(t), onto(b)])
}
