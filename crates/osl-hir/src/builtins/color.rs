//! Color: spaces and luminance. The working space is RGB with the primaries of Rec. 709.

use super::{Builtin, Compiled, Emitted, Site, Spaces};
use osl_ir::ir::{Builder, Const, Kernel, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane(
        "luminance",
        &["f(c)"],
        "C",
        LaneOp::Luminance,
        "Returns the luminance of `C`, a linear RGB color.",
    )
    .derivatives("the luminance of dC")
    .extremes(
        "Nothing is clamped: negative components count as negative. inf gives inf, nan gives nan, and \
         inf together with -inf gives nan.",
    )
    .example("float y = luminance(color(u, v, 0.5));"),
    Builtin::compose(
        "transformc",
        &["c(s,s,c)", "c(s,c)"],
        "fromspace, tospace, Cfrom | tospace, Cfrom",
        transformc,
        "Converts the color `Cfrom` from the space `fromspace` (default rgb) to `tospace`. The spaces \
         are rgb, hsv, hsl, YIQ, XYZ, xyY, sRGB and linear, and the scene spaces of OpenColorIO's built-in \
         configurations, such as ACEScg, lin_rec2020 and \"sRGB - Texture\", in any case; rgb is linear \
         Rec. 709.",
    )
    .spaces(Spaces::OfConversion)
    .derivatives("those of the color, through each conversion")
    .extremes(
        "An unknown space is a run-time error, and the color is returned unchanged. If both spaces \
         are the same, the color is also unchanged if both names are constants; otherwise it is \
         converted to rgb and back. The hue wraps around. Greys have hue 0 and saturation 0, and in \
         hsv a color without a positive component has saturation 0. From XYZ to xyY, black gives 0 \
         for x and y; from xyY to XYZ, a y up to 1e-6 gives 0 for X and Z. sRGB is a straight line \
         below its small limit, also for negative components. A conversion from or to Raw does nothing.",
    )
    .example("color hsv = transformc(\"rgb\", \"hsv\", color(u, v, 0.5));"),
    Builtin::compose(
        "blackbody",
        &["c(f)"],
        "temperatureK",
        |b, s| b.lane(LaneOp::Blackbody, s.args).into(),
        "Returns the light of a black body at a temperature of `temperatureK` kelvin, in W/m² over \
         the visible range.",
    )
    .derivatives("zero")
    .extremes(
        "Below 800 K the result is (1e-6, 0, 0), also for negative numbers and -inf. From 12000 K on \
         it is computed instead of read from a table, and grows with the temperature. inf and nan \
         give black.",
    )
    .example("color glow = blackbody(1000 + 5000 * u);"),
    Builtin::compose(
        "wavelength_color",
        &["c(f)"],
        "wavelengthNm",
        |b, s| b.lane(LaneOp::Wavelength, s.args).into(),
        "Returns the color of light of one wavelength, `wavelengthNm`, in nanometres; it is black \
         outside 375 to 780.",
    )
    .derivatives("zero")
    .extremes(
        "The result is black up to 375 nm, from 780 nm on, and for inf and nan. Below 380 nm the line \
         through the first two samples is continued. Negative components are set to 0.",
    )
    .example("color pure = wavelength_color(mix(380, 780, u));"),
    Builtin::compose(
        "color in space",
        &["c(s,c)"],
        "space, C",
        from_space,
        "Makes a color from coordinates in a named space: color(\"space\", a, b, c). The spaces are \
         \"rgb\", \"hsv\", \"hsl\", \"YIQ\", \"XYZ\" and \"xyY\", and those of OpenColorIO that transformc knows.",
    )
    .spaces(Spaces::OfColor)
    .compiled(Compiled::Parts("color"))
    .derivatives("zero")
    .extremes(
        "An unknown space is a run-time error, and the coordinates are used as red, green and blue. \
         Otherwise the result is that of transformc.",
    )
    .example("color c = color(\"hsv\", u, 1, 1);"),
];

fn transformc(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let (from, color) = match s.args {
        [from, _, color] => (*from, *color),
        _ => (b.constant(Const::Str("rgb".into())), s.arg(1)),
    };
    let to = s.arg(s.args.len().saturating_sub(2));
    b.kernel(Kernel::ColorBetween, &[from, to, color], Kind::Triple).into()
}

fn from_space(b: &mut Builder, s: &Site<'_>) -> Emitted {
    // Derivatives of a color given in a space are zero.
    let color = b.lane(LaneOp::Still, &[s.arg(1)]);
    let rgb = b.constant(Const::Str("RGB".into()));
    b.kernel(Kernel::ColorBetween, &[s.arg(0), rgb, color], Kind::Triple).into()
}
