//! Frequency and phase of an impulse.

use super::cells::draw;
use super::params::Waves;
use super::{LANES, Lanes};
use crate::math::sin_cos_rough;

pub(super) const TWO_PI: f32 = f32::from_bits(0x40c9_0fdb);

/// What some impulses draw for their waves, cos(2π ω·r + φ), a lane for each impulse.
pub(super) struct Drawn {
    /// Vectors of length 1; 0 if the caller gives the direction.
    direction: [Lanes; 3],
    /// The phases φ.
    pub(super) phase: Lanes,
}

impl Drawn {
    /// The direction of an impulse.
    #[inline(always)]
    pub(super) fn direction(&self, l: usize) -> [f32; 3] {
        let l = l % LANES;
        [self.direction[0][l], self.direction[1][l], self.direction[2][l]]
    }
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

    /// Draws directions and phases from sequences.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "lanes of several arrays in step, which vectorises")]
    pub(super) fn draw(&self, seeds: &[u32; LANES]) -> Drawn {
        let mut drawn = Drawn { direction: [[0.0; LANES]; 3], phase: [0.0; LANES] };
        let [x, y, z] = &mut drawn.direction;
        // A loop for each kind: with the choice inside, the compiler does not vectorise it.
        match self {
            Waves::Isotropic => {
                for l in 0..LANES {
                    let mut seed = seeds[l];
                    [x[l], y[l], z[l]] = anywhere(&mut seed);
                    drawn.phase[l] = TWO_PI * draw(&mut seed);
                }
            }
            Waves::Along(_) => {
                for l in 0..LANES {
                    drawn.phase[l] = TWO_PI * draw(&mut { seeds[l] });
                }
            }
            Waves::InPlane(_) => {
                for l in 0..LANES {
                    let mut seed = seeds[l];
                    (y[l], x[l]) = sin_cos_rough(TWO_PI * draw(&mut seed));
                    drawn.phase[l] = TWO_PI * draw(&mut seed);
                }
            }
        }
        drawn
    }

    /// The frequency ω of an impulse with a drawn direction.
    #[inline(always)]
    pub(super) fn omega(&self, direction: [f32; 3]) -> [f32; 3] {
        match *self {
            Waves::Isotropic => direction,
            Waves::Along(given) => given,
            Waves::InPlane(length) => [length * direction[0], length * direction[1], length * direction[2]],
        }
    }
}

/// A random direction in space.
#[inline(always)]
fn anywhere(seed: &mut u32) -> [f32; 3] {
    let (s, c) = sin_cos_rough(TWO_PI * draw(seed));
    let q = draw(seed);
    let up = -(1.0 - q) + q;
    let rest = 1.0 - up * up;
    let out = (if rest > 0.0 { rest } else { 0.0 }).sqrt();
    let v = [c * out, s * out, up];
    // Already close to 1.
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    [v[0] / length, v[1] / length, v[2] / length]
}
