//! Frequency and phase of an impulse.

use super::cells::draw;
use super::params::Waves;
use crate::math::sin_cos_rough;

pub(super) const TWO_PI: f32 = f32::from_bits(0x40c9_0fdb);

/// The cosine wave of a kernel: cos(2π ω·r + φ).
#[derive(Clone, Copy)]
pub(super) struct Wave {
    pub(super) omega: [f32; 3],
    pub(super) phase: f32,
}

impl Waves {
    /// How many numbers an impulse draws from its sequence.
    #[inline(always)]
    pub(super) fn draws(&self) -> u32 {
        match self {
            Waves::Isotropic => 3,
            Waves::Along(_) => 1,
            Waves::InPlane(_) => 2,
        }
    }

    /// Draws frequency and phase.
    #[inline(always)]
    pub(super) fn wave(&self, mut seed: u32) -> Wave {
        let omega = match *self {
            Waves::Isotropic => {
                let (s, c) = sin_cos_rough(TWO_PI * draw(&mut seed));
                let q = draw(&mut seed);
                let up = -(1.0 - q) + q;
                let rest = 1.0 - up * up;
                let out = (if rest > 0.0 { rest } else { 0.0 }).sqrt();
                let v = [c * out, s * out, up];
                // Already close to 1.
                let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
                [v[0] / length, v[1] / length, v[2] / length]
            }
            Waves::Along(direction) => direction,
            Waves::InPlane(length) => {
                let (s, c) = sin_cos_rough(TWO_PI * draw(&mut seed));
                [length * c, length * s, length * 0.0]
            }
        };
        Wave { omega, phase: TWO_PI * draw(&mut seed) }
    }
}
