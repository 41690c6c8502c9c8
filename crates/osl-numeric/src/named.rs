//! Color spaces of OpenColorIO's built-in configurations, by their names: primaries and transfer curves.
//!
//! Each space is given relative to the working space, linear RGB with the primaries of Rec. 709. Where white
//! points differ, colors are adapted by Bradford's matrix, as in these configurations. Spaces for displays
//! and the logarithms of cameras are missing.
//!
//! Sources: SMPTE ST 2065-1 (AP0), AMPAS S-2014-004 (ACEScg), S-2014-003 (ACEScc), S-2016-001 (ACEScct),
//! ITU-R BT.709 and BT.2020, SMPTE EG 432-1 (P3-D65), Adobe RGB (1998), IEC 61966-2-1 (sRGB).

use super::color::{ColorSystem, Matrix3, inverse, transform};
use super::geometry::Triple;
use super::real::{Number, Real, Scalar};
use pxfm::{f_exp2, f_log2, f_pow};
use std::f64::consts::LN_2;
use std::sync::LazyLock;

/// The primaries and the white point of a space.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gamut {
    Rec709,
    P3,
    Rec2020,
    Adobe,
    Ap0,
    Ap1,
    /// CIE XYZ, adapted to the white of the others.
    Xyz,
}

const D65: [f64; 2] = [0.3127, 0.3290];
const ACES_WHITE: [f64; 2] = [0.32168, 0.33767];

impl Gamut {
    const ALL: [Gamut; 7] =
        [Gamut::Rec709, Gamut::P3, Gamut::Rec2020, Gamut::Adobe, Gamut::Ap0, Gamut::Ap1, Gamut::Xyz];

    /// The matrix to CIE XYZ for row vectors, and the chromaticity of the white point.
    fn to_xyz(self) -> (Matrix3<f64>, [f64; 2]) {
        let (red, green, blue, white) = match self {
            Gamut::Rec709 => ([0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65),
            Gamut::P3 => ([0.68, 0.32], [0.265, 0.69], [0.15, 0.06], D65),
            Gamut::Rec2020 => ([0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65),
            Gamut::Adobe => ([0.64, 0.33], [0.21, 0.71], [0.15, 0.06], D65),
            Gamut::Ap0 => ([0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], ACES_WHITE),
            Gamut::Ap1 => ([0.713, 0.293], [0.165, 0.83], [0.128, 0.044], ACES_WHITE),
            Gamut::Xyz => return ([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], D65),
        };
        (ColorSystem::from_primaries(red, green, blue, white).xyz_from_rgb, white)
    }
}

/// The curve from the stored numbers of a space to light.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    Linear,
    /// A power; negative numbers stay.
    Gamma(f64),
    Srgb,
    AcesCc,
    AcesCct,
}

type Names = &'static [&'static str];

/// The spaces with their names.
const SPACES: [(Gamut, Curve, Names); 17] = {
    use Curve::{AcesCc, AcesCct, Gamma, Linear, Srgb};
    use Gamut::{Adobe, Ap0, Ap1, P3, Rec709, Rec2020, Xyz};
    [
        (
            Rec709,
            Linear,
            &[
                "Linear Rec.709 (sRGB)",
                "lin_rec709_srgb",
                "lin_rec709",
                "lin_rec709_scene",
                "lin_srgb",
                "scene-linear Rec.709-sRGB",
                "Utility - Linear - Rec.709",
                "Utility - Linear - sRGB",
            ],
        ),
        (Ap1, Linear, &["ACEScg", "lin_ap1", "lin_ap1_scene", "ACES - ACEScg"]),
        (Ap0, Linear, &["ACES2065-1", "aces2065_1", "lin_ap0", "lin_ap0_scene", "ACES - ACES2065-1"]),
        (Ap1, AcesCct, &["ACEScct", "acescct_ap1", "ACES - ACEScct"]),
        (Ap1, AcesCc, &["ACEScc", "acescc_ap1", "ACES - ACEScc"]),
        (
            P3,
            Linear,
            &[
                "Linear P3-D65",
                "lin_p3d65",
                "lin_p3d65_scene",
                "lin_displayp3",
                "scene-linear DCI-P3 D65",
                "Utility - Linear - P3-D65",
            ],
        ),
        (
            Rec2020,
            Linear,
            &[
                "Linear Rec.2020",
                "lin_rec2020",
                "lin_rec2020_scene",
                "scene-linear Rec.2020",
                "Utility - Linear - Rec.2020",
            ],
        ),
        (
            Adobe,
            Linear,
            &["Linear AdobeRGB", "lin_adobergb", "lin_adobergb_scene", "Utility - Linear - Adobe RGB"],
        ),
        (Xyz, Linear, &["CIE XYZ-D65 - Scene-referred", "CIE-XYZ-D65", "cie_xyz_d65", "lin_ciexyzd65_scene"]),
        (
            Rec709,
            Srgb,
            &[
                "sRGB Encoded Rec.709 (sRGB)",
                "sRGB - Texture",
                "srgb_tx",
                "srgb_texture",
                "srgb_rec709_scene",
                "sRGB",
                "Utility - sRGB - Texture",
                "Input - Generic - sRGB - Texture",
            ],
        ),
        (
            Rec709,
            Gamma(1.8),
            &[
                "Gamma 1.8 Encoded Rec.709",
                "Gamma 1.8 Rec.709 - Texture",
                "g18_rec709",
                "g18_rec709_tx",
                "g18_rec709_scene",
                "gamma 1.8 Rec.709",
                "Utility - Gamma 1.8 - Rec.709 - Texture",
            ],
        ),
        (
            Rec709,
            Gamma(2.2),
            &[
                "Gamma 2.2 Encoded Rec.709",
                "Gamma 2.2 Rec.709 - Texture",
                "g22_rec709",
                "g22_rec709_tx",
                "g22_rec709_scene",
                "gamma 2.2 Rec.709",
                "Utility - Gamma 2.2 - Rec.709 - Texture",
            ],
        ),
        (
            Rec709,
            Gamma(2.4),
            &[
                "Gamma 2.4 Encoded Rec.709",
                "Gamma 2.4 Rec.709 - Texture",
                "g24_rec709",
                "g24_rec709_tx",
                "g24_rec709_scene",
                "rec709_display",
                "gamma 2.4 Rec.709 (video)",
                "Utility - Rec.709 - Display",
            ],
        ),
        (
            Ap1,
            Srgb,
            &[
                "sRGB Encoded AP1",
                "sRGB Encoded AP1 - Texture",
                "srgb_ap1",
                "srgb_encoded_ap1_tx",
                "srgb_ap1_scene",
            ],
        ),
        (
            Ap1,
            Gamma(2.2),
            &["Gamma 2.2 Encoded AP1", "Gamma 2.2 AP1 - Texture", "g22_ap1", "g22_ap1_tx", "g22_ap1_scene"],
        ),
        (
            P3,
            Srgb,
            &[
                "sRGB Encoded P3-D65",
                "sRGB Encoded P3-D65 - Texture",
                "srgb_p3d65",
                "srgb_displayp3",
                "srgb_encoded_p3d65_tx",
                "srgb_p3d65_scene",
            ],
        ),
        // The exponent of Adobe's specification, 2 + 51/256.
        (
            Adobe,
            Gamma(563.0 / 256.0),
            &["Gamma 2.2 Encoded AdobeRGB", "g22_adobergb", "g22_adobergb_scene", "adobergb"],
        ),
    ]
};

/// The names of data that are no colors: a conversion from or to them does nothing.
const RAW: Names = &["Raw", "Utility - Raw"];

/// All names of color spaces.
pub fn names() -> impl Iterator<Item = &'static str> {
    SPACES.iter().flat_map(|(.., names)| *names).chain(RAW).copied()
}

/// Whether a name means data that are no colors. Case does not matter.
pub fn is_raw(name: &str) -> bool {
    RAW.iter().any(|known| known.eq_ignore_ascii_case(name))
}

/// The number of the conversion from a space to linear RGB, or from linear RGB to the space: even, or odd.
/// `None` if nothing has this name; its case does not matter.
pub fn number(name: &str, to_rgb: bool) -> Option<i32> {
    let is_called = |(.., names): &(Gamut, Curve, Names)| names.iter().any(|n| n.eq_ignore_ascii_case(name));
    let index = SPACES.iter().position(is_called)?;
    Some(2 * index as i32 + i32::from(!to_rgb))
}

/// Bradford's matrix from CIE XYZ to the responses that are scaled for another white, for row vectors.
const BRADFORD: Matrix3<f64> = [0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296];

/// For each gamut, the matrices to the working space and back, for row vectors.
static MATRICES: LazyLock<[[Matrix3<f64>; 2]; Gamut::ALL.len()]> = LazyLock::new(|| {
    let (working, white) = Gamut::Rec709.to_xyz();
    let from_xyz = inverse(&working);
    Gamut::ALL.map(|gamut| {
        let (to_xyz, own) = gamut.to_xyz();
        let to_rgb = product(&product(&to_xyz, &adaptation(own, white)), &from_xyz);
        [to_rgb, inverse(&to_rgb)]
    })
});

/// The matrix that adapts colors in CIE XYZ from a white point to another.
fn adaptation(from: [f64; 2], to: [f64; 2]) -> Matrix3<f64> {
    let response = |[x, y]: [f64; 2]| transform([x / y, 1.0, (1.0 - x - y) / y], &BRADFORD);
    let ([a, b, c], [x, y, z]) = (response(from), response(to));
    let scale = [x / a, 0.0, 0.0, 0.0, y / b, 0.0, 0.0, 0.0, z / c];
    product(&product(&BRADFORD, &scale), &inverse(&BRADFORD))
}

fn product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    let [a0, a1, a2, a3, a4, a5, a6, a7, a8] = *a;
    let rows = [[a0, a1, a2], [a3, a4, a5], [a6, a7, a8]].map(|row| transform(row, b));
    let [[x0, x1, x2], [y0, y1, y2], [z0, z1, z2]] = rows;
    [x0, x1, x2, y0, y1, y2, z0, z1, z2]
}

/// The color after the conversion with a number; unchanged if there is none. Computed in double precision.
#[inline(always)]
pub fn convert<R: Real>(c: Triple<R>, number: R::Int) -> Triple<R> {
    R::by_value([number], c, |[number], c| of_plain(c, [R::Plain::lit(0.0); 3], number).0)
}

/// How the result of [`convert`] changes where its argument is `c` and changes by `d`.
#[inline(always)]
pub fn tangent<R: Real>(c: Triple<R>, d: Triple<R>, number: R::Int) -> Triple<R> {
    let both = [c[0], c[1], c[2], d[0], d[1], d[2]];
    R::by_value([number], both, |[number], [x, y, z, a, b, c]| of_plain([x, y, z], [a, b, c], number).1)
}

/// The converted color and its change.
pub fn of_plain<S: Scalar>(c: Triple<S>, d: Triple<S>, number: i32) -> (Triple<S>, Triple<S>) {
    let Some((gamut, curve, _)) = usize::try_from(number / 2).ok().and_then(|at| SPACES.get(at)) else {
        return (c, d);
    };
    let (c, d) = (c.map(S::to_f64), d.map(S::to_f64));
    let mixed = |c: Triple<f64>, direction: usize| match (gamut, MATRICES.get(*gamut as usize)) {
        (Gamut::Rec709, _) | (_, None) => c,
        (_, Some(pair)) => transform(c, &pair[direction]),
    };
    let through = |c: Triple<f64>, d: Triple<f64>, curve: &dyn Fn(f64) -> (f64, f64)| {
        let [x, y, z] = c.map(curve);
        ([x.0, y.0, z.0], [x.1 * d[0], y.1 * d[1], z.1 * d[2]])
    };
    let (c, d) = if number % 2 == 0 {
        let (c, d) = through(c, d, &|x| curve.light(x));
        (mixed(c, 0), mixed(d, 0))
    } else {
        through(mixed(c, 1), mixed(d, 1), &|x| curve.stored(x))
    };
    let rounded = |x: f64| S::known(x as f32, x);
    (c.map(rounded), d.map(rounded))
}

/// The constants of the sRGB curve, with a straight part that meets the power without a step or a bend: the
/// straight part ends at this number.
const SRGB_BREAK: f64 = 0.055 / 1.4;
/// Its slope: light by stored number.
static SRGB_SLOPE: LazyLock<f64> = LazyLock::new(|| f_pow((SRGB_BREAK + 0.055) / 1.055, 2.4) / SRGB_BREAK);

/// Slope and offset of the straight part of ACEScct.
const CCT: [f64; 2] = [10.540_237_741_654_5, 0.072_905_534_195_835_5];

/// The stored number of ACEScc and ACEScct for light, where they are logarithms.
fn log_stored(x: f64) -> (f64, f64) {
    ((f_log2(x) + 9.72) / 17.52, 1.0 / (x * LN_2 * 17.52))
}

/// Its inverse.
fn log_light(x: f64) -> (f64, f64) {
    let light = f_exp2(x * 17.52 - 9.72);
    (light, light * LN_2 * 17.52)
}

impl Curve {
    /// The light of a stored number, and the slope there.
    fn light(self, x: f64) -> (f64, f64) {
        match self {
            Curve::Linear => (x, 1.0),
            Curve::Gamma(_) if x <= 0.0 => (x, 1.0),
            Curve::Gamma(power) => (f_pow(x, power), power * f_pow(x, power - 1.0)),
            Curve::Srgb if x <= SRGB_BREAK => (x * *SRGB_SLOPE, *SRGB_SLOPE),
            Curve::Srgb => {
                let base = (x + 0.055) / 1.055;
                (f_pow(base, 2.4), 2.4 / 1.055 * f_pow(base, 1.4))
            }
            Curve::AcesCct if x <= 0.155_251_141_552_511 => ((x - CCT[1]) / CCT[0], 1.0 / CCT[0]),
            Curve::AcesCct => log_light(x),
            Curve::AcesCc if x <= (9.72 - 15.0) / 17.52 => {
                let (light, slope) = log_light(x);
                ((light - HALF_STEP) * 2.0, slope * 2.0)
            }
            // The largest number of half precision ends the scale.
            Curve::AcesCc if x >= log_stored(65504.0).0 => (65504.0, 0.0),
            Curve::AcesCc => log_light(x),
        }
    }

    /// The stored number of light, and the slope there.
    fn stored(self, x: f64) -> (f64, f64) {
        match self {
            Curve::Linear => (x, 1.0),
            Curve::Gamma(_) if x <= 0.0 => (x, 1.0),
            Curve::Gamma(power) => (f_pow(x, 1.0 / power), f_pow(x, 1.0 / power - 1.0) / power),
            Curve::Srgb if x <= SRGB_BREAK * *SRGB_SLOPE => (x / *SRGB_SLOPE, 1.0 / *SRGB_SLOPE),
            Curve::Srgb => (1.055 * f_pow(x, 1.0 / 2.4) - 0.055, 1.055 / 2.4 * f_pow(x, 1.0 / 2.4 - 1.0)),
            Curve::AcesCct if x <= 0.007_812_5 => (CCT[0] * x + CCT[1], CCT[0]),
            Curve::AcesCc if x <= 0.0 => (log_stored(HALF_STEP).0, 0.0),
            Curve::AcesCc if x < 2.0 * HALF_STEP => {
                let (stored, slope) = log_stored(HALF_STEP + x * 0.5);
                (stored, slope * 0.5)
            }
            Curve::AcesCct | Curve::AcesCc => log_stored(x),
        }
    }
}

/// 2 to the power of -16.
const HALF_STEP: f64 = 1.0 / 65536.0;
