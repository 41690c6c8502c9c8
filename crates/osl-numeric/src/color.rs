//! Conversions between color systems, one color at a time.
//!
//! Choices (which sixth of the hue circle, which component is largest) are blends, so that a loop over colors
//! vectorises. This module knows no names of color spaces except those of [`ColorSystem::named`].

use super::common::{max, min};
use super::geometry::{Triple, cross, dot, select};
use super::real::{Number, Real};

/// Red, green, blue in 0..=1 from hue, saturation, value; the hue counts turns and wraps.
#[inline(always)]
pub fn hsv_to_rgb<R: Number>(hsv: Triple<R>) -> Triple<R> {
    let [h, s, v] = hsv;
    let one = R::lit(1.0);
    let h = R::lit(6.0) * (h - h.floor());
    let sixth = h.floor();
    let f = h - sixth;
    let p = v * (one - s);
    let q = v * (one - s * f);
    let t = v * (one - s * (one - f));

    let is = |k: f32| sixth.eq(R::lit(k));
    // Rounding can make the hue a full turn, which is a seventh sixth; NaN selects the last colors.
    let red = R::select(is(1.0), q, R::select(is(2.0) | is(3.0), p, R::select(is(4.0), t, v)));
    let green = R::select(is(0.0), t, R::select(is(1.0) | is(2.0), v, R::select(is(3.0), q, p)));
    let blue = R::select(is(0.0) | is(1.0), p, R::select(is(2.0), t, R::select(is(3.0) | is(4.0), v, q)));
    select(s.lt(R::known(0.0001, 0.0001)), [v; 3], [red, green, blue])
}

/// Hue in turns 0..=1, saturation, value. A gray has hue 0.
#[inline(always)]
pub fn rgb_to_hsv<R: Number>(rgb: Triple<R>) -> Triple<R> {
    let [r, g, b] = rgb;
    let zero = R::lit(0.0);
    let largest = max(r, max(g, b));
    let range = largest - min(r, min(g, b));
    let s = R::select(largest.gt(zero), range / largest, zero);

    // From red, green or blue, whichever is largest, toward the second largest.
    let six_ranges = R::lit(6.0) * range;
    let from_red = (g - b) / six_ranges;
    let from_green = R::known(1.0 / 3.0, 1.0 / 3.0) + (b - r) / six_ranges;
    let from_blue = R::known(2.0 / 3.0, 2.0 / 3.0) + (r - g) / six_ranges;
    let h = R::select(r.eq(largest), from_red, R::select(g.eq(largest), from_green, from_blue));
    let h = R::select(h.lt(zero), h + R::lit(1.0), h);
    [R::select(s.gt(zero), h, zero), s, largest]
}

/// Red, green, blue from hue (turns), saturation, lightness.
#[inline(always)]
pub fn hsl_to_rgb<R: Number>(hsl: Triple<R>) -> Triple<R> {
    let [h, s, l] = hsl;
    let zero = R::lit(0.0);
    let one = R::lit(1.0);
    let value = R::select(l.le(R::lit(0.5)), l * (one + s), l * (one - s) + s);
    let smallest = R::lit(2.0) * l - value;
    let rgb = hsv_to_rgb([h, (value - smallest) / value, value]);
    select(value.le(zero), [zero; 3], rgb)
}

/// Hue (turns), saturation, lightness. A gray has hue and saturation 0.
#[inline(always)]
pub fn rgb_to_hsl<R: Number>(rgb: Triple<R>) -> Triple<R> {
    let [r, g, b] = rgb;
    let zero = R::lit(0.0);
    let [h, _, largest] = rgb_to_hsv(rgb);
    let smallest = min(r, min(g, b));
    let range = largest - smallest;
    let sum = smallest + largest;
    let l = R::lit(0.5) * sum;
    let s = range / R::select(l.le(R::lit(0.5)), sum, R::lit(2.0) - largest - smallest);
    let gray = smallest.eq(largest);
    [R::select(gray, zero, h), R::select(gray, zero, s), l]
}

/// Nine numbers, row by row; colors are row vectors.
pub type Matrix3<R> = [R; 9];

const RGB_TO_YIQ: Matrix3<f32> = [0.299, 0.596, 0.212, 0.587, -0.275, -0.523, 0.114, -0.321, 0.311];
const EXACT_RGB_TO_YIQ: Matrix3<f64> = [0.299, 0.596, 0.212, 0.587, -0.275, -0.523, 0.114, -0.321, 0.311];
const YIQ_TO_RGB: Matrix3<f32> = [1.0, 1.0, 1.0, 0.9557, -0.2716, -1.1082, 0.6199, -0.6469, 1.7051];
const EXACT_YIQ_TO_RGB: Matrix3<f64> = [1.0, 1.0, 1.0, 0.9557, -0.2716, -1.1082, 0.6199, -0.6469, 1.7051];

/// The constants of a matrix.
#[inline(always)]
fn known<R: Real>(single: &Matrix3<f32>, exact: &Matrix3<f64>) -> Matrix3<R> {
    // Straight code: an inner loop would prevent the vectorisation of a loop over colors.
    let [a, b, c, d, e, f, g, h, i] = *single;
    let [j, k, l, m, n, o, p, q, r] = *exact;
    let known = R::known;
    [
        known(a, j),
        known(b, k),
        known(c, l),
        known(d, m),
        known(e, n),
        known(f, o),
        known(g, p),
        known(h, q),
        known(i, r),
    ]
}

/// The color times a constant matrix.
#[inline(always)]
pub fn transform<R: Real>(c: Triple<R>, m: &Matrix3<R>) -> Triple<R> {
    [column(c, [m[0], m[3], m[6]]), column(c, [m[1], m[4], m[7]]), column(c, [m[2], m[5], m[8]])]
}

#[inline(always)]
fn column<R: Real>(c: Triple<R>, weights: [R; 3]) -> R {
    c[0] * weights[0] + c[1] * weights[1] + c[2] * weights[2]
}

/// The NTSC broadcast system from RGB.
#[inline(always)]
pub fn rgb_to_yiq<R: Real>(rgb: Triple<R>) -> Triple<R> {
    transform(rgb, &known(&RGB_TO_YIQ, &EXACT_RGB_TO_YIQ))
}

/// RGB from the NTSC broadcast system.
#[inline(always)]
pub fn yiq_to_rgb<R: Real>(yiq: Triple<R>) -> Triple<R> {
    transform(yiq, &known(&YIQ_TO_RGB, &EXACT_YIQ_TO_RGB))
}

/// Chromaticity x, y and luminance Y from CIE XYZ; the chromaticity of black is 0, 0.
#[inline(always)]
pub fn xyz_to_xyy<R: Number>(xyz: Triple<R>) -> Triple<R> {
    let [x, y, z] = xyz;
    let sum = x + y + z;
    let inverse = R::select(sum.ge(R::known(1.0e-6, 1.0e-6)), R::lit(1.0) / sum, R::lit(0.0));
    [x * inverse, y * inverse, y]
}

/// CIE XYZ from chromaticity x, y and luminance Y; 0 where y is.
#[inline(always)]
pub fn xyy_to_xyz<R: Number>(xyy: Triple<R>) -> Triple<R> {
    let [x, y, luminance] = xyy;
    let k = R::select(y.gt(R::known(1.0e-6, 1.0e-6)), luminance / y, R::lit(0.0));
    [k * x, luminance, k * (R::lit(1.0) - x - y)]
}

/// Light from one component of an sRGB pixel (IEC 61966-2-1).
#[inline(always)]
pub fn srgb_to_linear<R: Real>(x: R) -> R {
    let straight = x * R::known(1.0 / 12.92, 1.0 / 12.92);
    let curved =
        ((x + R::known(0.055, 0.055)) * R::known(1.0 / 1.055, 1.0 / 1.055)).pow_accurate(R::known(2.4, 2.4));
    R::select(x.le(R::known(0.04045, 0.04045)), straight, curved)
}

/// One component of an sRGB pixel from light (IEC 61966-2-1).
#[inline(always)]
pub fn linear_to_srgb<R: Real>(x: R) -> R {
    let curved =
        R::known(1.055, 1.055) * x.pow_accurate(R::known(1.0 / 2.4, 1.0 / 2.4)) - R::known(0.055, 0.055);
    R::select(x.le(R::known(0.003_130_8, 0.003_130_8)), R::known(12.92, 12.92) * x, curved)
}

/// An RGB space: the relation of its primaries to CIE XYZ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorSystem<R = f32> {
    /// XYZ to RGB, for row vectors.
    pub rgb_from_xyz: Matrix3<R>,
    /// RGB to XYZ, for row vectors.
    pub xyz_from_rgb: Matrix3<R>,
    /// The contributions of red, green and blue to the luminance; they sum to 1.
    pub luminance: Triple<R>,
}

/// Names of the systems in OSL; the default comes first.
pub const SYSTEMS: [&str; 13] = [
    "Rec709",
    "sRGB",
    "NTSC",
    "EBU",
    "PAL",
    "SECAM",
    "SMPTE",
    "HDTV",
    "CIE",
    "AdobeRGB",
    "XYZ",
    "ACES2065-1",
    "ACEScg",
];

const D65: [f64; 2] = [0.3127, 0.3291];
const ILLUMINANT_C: [f64; 2] = [0.3101, 0.3162];
const ILLUMINANT_E: [f64; 2] = [1.0 / 3.0, 1.0 / 3.0];
const ACES_WHITE: [f64; 2] = [0.32168, 0.33767];

impl<R: Real> ColorSystem<R> {
    /// OSL's default working space. Inlined, so that it is a few constants in a loop over colors.
    #[inline(always)]
    pub fn rec709() -> Self {
        Self::from_primaries([0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65)
    }

    /// The system with a number, which is the index of its name in [`SYSTEMS`]; Rec709 for any other number.
    pub fn numbered(number: i32) -> Self {
        let name = usize::try_from(number).ok().and_then(|at| SYSTEMS.get(at));
        name.and_then(|name| Self::named(name)).unwrap_or_else(Self::rec709)
    }

    /// The system with a name of OSL; `None` for any other.
    pub fn named(name: &str) -> Option<Self> {
        let (red, green, blue, white) = match name {
            "Rec709" | "sRGB" => return Some(Self::rec709()),
            "NTSC" => ([0.67, 0.33], [0.21, 0.71], [0.14, 0.08], ILLUMINANT_C),
            "EBU" | "PAL" | "SECAM" => ([0.64, 0.33], [0.29, 0.60], [0.15, 0.06], D65),
            "SMPTE" => ([0.630, 0.340], [0.310, 0.595], [0.155, 0.070], D65),
            "HDTV" => ([0.670, 0.330], [0.210, 0.710], [0.150, 0.060], D65),
            "CIE" => ([0.7355, 0.2645], [0.2658, 0.7243], [0.1669, 0.0085], ILLUMINANT_E),
            "AdobeRGB" => ([0.64, 0.33], [0.21, 0.71], [0.15, 0.06], D65),
            "XYZ" => ([1.0, 0.0], [0.0, 1.0], [0.0, 0.0], ILLUMINANT_E),
            "ACES2065-1" => ([0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], ACES_WHITE),
            "ACEScg" => ([0.713, 0.293], [0.165, 0.83], [0.128, 0.044], ACES_WHITE),
            _ => return None,
        };
        Some(Self::from_primaries(red, green, blue, white))
    }

    /// The system with these chromaticities (x, y), such that equal red, green and blue have that of `white`.
    #[inline(always)]
    pub fn from_primaries(red: [f64; 2], green: [f64; 2], blue: [f64; 2], white: [f64; 2]) -> Self {
        let [red, green, blue, white] =
            [primary::<R>(red), primary::<R>(green), primary::<R>(blue), primary::<R>(white)];
        // The rows of the inverse of the primaries, up to a factor each, which the white point determines.
        let r = weighted(cross(green, blue), white);
        let g = weighted(cross(blue, red), white);
        let b = weighted(cross(red, green), white);
        let rgb_from_xyz = [r[0], g[0], b[0], r[1], g[1], b[1], r[2], g[2], b[2]];
        let xyz_from_rgb = inverse(&rgb_from_xyz);
        let (of_red, of_green) = (xyz_from_rgb[1], xyz_from_rgb[4]);
        let luminance = [of_red, of_green, R::lit(1.0) - of_red - of_green];
        Self { rgb_from_xyz, xyz_from_rgb, luminance }
    }

    /// RGB of this system from CIE XYZ.
    #[inline(always)]
    pub fn to_rgb(&self, xyz: Triple<R>) -> Triple<R> {
        transform(xyz, &self.rgb_from_xyz)
    }

    /// CIE XYZ from RGB of this system.
    #[inline(always)]
    pub fn to_xyz(&self, rgb: Triple<R>) -> Triple<R> {
        transform(rgb, &self.xyz_from_rgb)
    }

    /// The luminance of an RGB color, in its unit.
    #[inline(always)]
    pub fn luminance_of(&self, rgb: Triple<R>) -> R {
        dot(rgb, self.luminance)
    }
}

/// x, y and z of a chromaticity.
#[inline(always)]
fn primary<R: Real>([x, y]: [f64; 2]) -> Triple<R> {
    let (x, y) = (R::known(x as f32, x), R::known(y as f32, y));
    [x, y, R::lit(1.0) - (x + y)]
}

/// A row divided by its share of the white point.
#[inline(always)]
fn weighted<R: Real>(row: Triple<R>, white: Triple<R>) -> Triple<R> {
    let weight = dot(row, white) / white[1];
    [row[0] / weight, row[1] / weight, row[2] / weight]
}

/// The inverse of a matrix that is known to be invertible: adjugate over determinant.
#[inline(always)]
pub(crate) fn inverse<R: Real>(m: &Matrix3<R>) -> Matrix3<R> {
    let minor = |a: usize, b: usize, c: usize, d: usize| m[a] * m[b] - m[c] * m[d];
    let adjugate = [
        minor(4, 8, 7, 5),
        minor(7, 2, 1, 8),
        minor(1, 5, 4, 2),
        minor(6, 5, 3, 8),
        minor(0, 8, 6, 2),
        minor(3, 2, 0, 5),
        minor(3, 7, 6, 4),
        minor(6, 1, 0, 7),
        minor(0, 4, 3, 1),
    ];
    let determinant = m[0] * adjugate[0] + m[1] * adjugate[3] + m[2] * adjugate[6];
    let [a, b, c, d, e, f, g, h, i] = adjugate;
    let over = determinant;
    [a / over, b / over, c / over, d / over, e / over, f / over, g / over, h / over, i / over]
}
