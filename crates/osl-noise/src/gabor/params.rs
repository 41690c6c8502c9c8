//! The options of a caller, and the numbers derived from them alone.

use crate::math;

/// The options of Gabor noise. Every field accepts every value: values out of range are clamped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The direction of the waves: 0 for random directions, 1 for `direction`, anything else for random
    /// directions in the xy plane.
    pub anisotropic: i32,
    /// Frequency vector of the waves, in radians over 2π per unit of the kernel's radius. It is not
    /// normalised: its length is the frequency. If `anisotropic` is 1, direction and length count; if it is
    /// 0, neither does; otherwise only the length.
    pub direction: [f32; 3],
    /// Width of the band of frequencies in octaves, 0.01 to 100; a wider band makes smaller kernels.
    pub bandwidth: f32,
    /// Mean number of kernels that overlap at a point, 1 to 32.
    pub impulses: f32,
    /// Whether frequencies beyond the resolution of the coordinates' partials are damped. **The value then
    /// depends on the partials**, not only on the coordinates.
    pub do_filter: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            anisotropic: 0,
            direction: [1.0, 0.0, 0.0],
            bandwidth: 1.0,
            impulses: 16.0,
            do_filter: true,
        }
    }
}

/// How the frequency of an impulse is chosen.
#[derive(Clone, Copy)]
pub(super) enum Waves {
    /// A random direction, length 1.
    Isotropic,
    /// The given vector.
    Along([f32; 3]),
    /// A random direction in the xy plane, of this length.
    InPlane(f32),
}

impl Waves {
    pub(super) fn new(options: &Options) -> Waves {
        match options.anisotropic {
            0 => Waves::Isotropic,
            1 => Waves::Along(options.direction),
            _ => Waves::InPlane(math::length(options.direction)),
        }
    }

    /// The vector that they keep; the length is 1 if the caller gives none.
    pub(super) fn given(&self) -> [f32; 3] {
        match *self {
            Waves::Isotropic => [1.0, 0.0, 0.0],
            Waves::Along(direction) => direction,
            Waves::InPlane(length) => [length, 0.0, 0.0],
        }
    }

    /// The number of the kind.
    pub(super) fn kind(&self) -> u32 {
        match self {
            Waves::Isotropic => 0,
            Waves::Along(_) => 1,
            Waves::InPlane(_) => 2,
        }
    }
}

/// Numbers derived from the options.
#[derive(Clone, Copy)]
pub(super) struct Params {
    pub(super) waves: Waves,
    /// Width of the kernel's Gaussian: it falls as exp(−π a² r²).
    pub(super) a: f32,
    /// The kernel is cut at this distance; also the size of a cell.
    pub(super) radius: f32,
    pub(super) radius2: f32,
    pub(super) rinv: f32,
    /// Probability that a cell holds no impulse.
    pub(super) empty: f32,
    /// Factors of the sum, applied one after the other.
    pub(super) scales: [f32; 2],
}

/// NaN passes unchanged.
fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

impl Params {
    /// The numbers for options with the same bandwidth and impulses.
    pub(super) fn with(&self, options: &Options) -> Params {
        Params { waves: Waves::new(options), ..*self }
    }

    pub(super) fn new(options: &Options) -> Params {
        let e = f64::from(math::exp2_rough(clamp(options.bandwidth, 0.01, 100.0)));
        let a = ((2.0 * ((e - 1.0) / (e + 1.0))) * f64::from(f32::from_bits(0x4008_4074))) as f32;
        // At the cut, the Gaussian has the height 0.02.
        let radius = f32::from_bits(0x3f8e_d5da) / a;
        let radius2 = radius * radius;
        let radius3 = radius2 * radius;
        let lambda = clamp(options.impulses, 1.0, 32.0) / (f32::from_bits(0x4086_0a7c) * radius3);
        let variance = 1.0 / (f32::from_bits(0x40b5_04f3) * ((a * a) * a));
        Params {
            waves: Waves::new(options),
            a,
            radius,
            radius2,
            rinv: 1.0 / radius,
            empty: math::exp(-(lambda * radius3)),
            scales: [1.0 / lambda.sqrt(), (1.0 / (3.0 * variance.sqrt())) * 0.5],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_words() {
        let check = |bandwidth, impulses, words: [u32; 7]| {
            let p = Params::new(&Options { bandwidth, impulses, ..Options::default() });
            let got = [p.a, p.radius, p.radius2, p.rinv, p.empty, p.scales[0], p.scales[1]];
            assert_eq!(got.map(f32::to_bits), words);
        };
        check(
            1.0,
            16.0,
            [0x3fb5_ab45, 0x3f49_46fe, 0x3f1e_408f, 0x3fa2_ccde, 0x3cb3_ae72, 0x3eb6_a2c7, 0x3f2b_9617],
        );
        check(
            2.5,
            4.0,
            [0x403e_a1c4, 0x3ebf_d05d, 0x3e0f_b894, 0x402a_d50d, 0x3ec5_0987, 0x3e70_494a, 0x4002_6b2b],
        );
    }
}
