//! From radiance to display values.

use crate::math;

/// Highlights are compressed from here on.
const KNEE: f32 = 0.7;

/// A curve from radiance to the linear values of a display.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Unchanged up to 0.7, and asymptotically to 1 above: see [`tone`].
    #[default]
    Soft,
    /// Unchanged up to 1, and 1 above.
    Clip,
    /// Contrast like that of film: dark in the shadows, soft in the highlights, and pale where it is very
    /// bright. K. Narkowicz, "ACES Filmic Tone Mapping Curve", 2016.
    Filmic,
}

impl Curve {
    /// All curves.
    pub const ALL: [Curve; 3] = [Curve::Soft, Curve::Clip, Curve::Filmic];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Curve::Soft => "soft",
            Curve::Clip => "srgb",
            Curve::Filmic => "filmic",
        }
    }

    /// The curve with a name.
    pub fn from_name(name: &str) -> Option<Curve> {
        Curve::ALL.into_iter().find(|curve| curve.name() == name)
    }

    /// Maps a radiance to a linear value from 0 to 1. NaN becomes 0.
    pub fn apply(self, x: f32) -> f32 {
        let x = x.max(0.0);
        match self {
            Curve::Soft => tone(x),
            Curve::Clip => x.min(1.0),
            // Beyond this the curve is 1, and its terms overflow.
            Curve::Filmic if x > 1e6 => 1.0,
            Curve::Filmic => {
                // The curve is made for scenes whose white is at 0.6 of the brightest value.
                let x = 0.6 * x;
                ((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)).clamp(0.0, 1.0)
            }
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_rise_from_0_to_1() {
        for curve in Curve::ALL {
            assert_eq!(Curve::from_name(curve.name()), Some(curve));
            let values: Vec<f32> = (0..2000).map(|n| curve.apply(n as f32 * 0.01)).collect();
            assert!(values.windows(2).all(|pair| pair[0] <= pair[1]), "{curve:?}");
            assert!(values.iter().all(|x| (0.0..=1.0).contains(x)), "{curve:?}");
            assert_eq!((curve.apply(-1.0), curve.apply(f32::NAN)), (0.0, 0.0), "{curve:?}");
            assert!(curve.apply(f32::INFINITY) > 0.99 && curve.apply(3e38) > 0.99, "{curve:?}");
        }
        assert_eq!(Curve::Soft.apply(0.5), 0.5);
        assert_eq!(Curve::Clip.apply(2.0), 1.0);
    }
}
