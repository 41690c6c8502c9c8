//! From radiance to display values.

use crate::math;

/// Highlights are compressed from here on.
const KNEE: f32 = 0.7;

/// Maps a radiance to a linear value from 0 to 1: unchanged up to 0.7, asymptotically to 1 above.
pub fn tone(x: f32) -> f32 {
    if x <= KNEE {
        return x.max(0.0);
    }
    let room = 1.0 - KNEE;
    KNEE + room * (1.0 - math::exp(-(x - KNEE) / room))
}

/// The display value of a radiance, from 0 to 1: [`tone`], then the sRGB curve (IEC 61966-2-1).
pub fn display(x: f32) -> f32 {
    let x = tone(x);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * math::powf(x, 1.0 / 2.4) - 0.055 }
}
