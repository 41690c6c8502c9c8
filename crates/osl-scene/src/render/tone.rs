//! From radiance to what a screen shows.

use crate::math;

/// Where highlights begin to be compressed.
const KNEE: f32 = 0.7;

/// A linear value from 0 to 1 for a radiance: as it is up to 0.7; what is above nears 1.
pub fn tone(x: f32) -> f32 {
    if x <= KNEE {
        return x.max(0.0);
    }
    let room = 1.0 - KNEE;
    KNEE + room * (1.0 - math::exp(-(x - KNEE) / room))
}

/// What a screen shows of a radiance, from 0 to 1: [`tone`], through the curve of sRGB (IEC 61966-2-1).
pub fn display(x: f32) -> f32 {
    let x = tone(x);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * math::powf(x, 1.0 / 2.4) - 0.055 }
}
