//! Color: spaces and luminance. The working space is RGB with the primaries of Rec. 709.

use super::{Builtin, Compiled, Emitted, Site, Spaces};
use osl_ir::ir::{Builder, Const, Kernel, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("luminance", &["f(c)"], "C", LaneOp::Luminance, "Luminance of a linear RGB color.")
        .derivatives("that of dC")
        .extremes(
            "Nothing is clamped: negative light counts as negative. inf and nan stay, and inf against \
               -inf gives nan.",
        )
        .example("float y = luminance(color(u, v, 0.5));"),
    Builtin::compose(
        "transformc",
        &["c(s,s,c)", "c(s,c)"],
        "fromspace, tospace, Cfrom | tospace, Cfrom",
        transformc,
        "A color from one space (default rgb) to another: rgb, hsv, hsl, YIQ, XYZ, xyY, sRGB, linear.",
    )
    .spaces(Spaces::OfConversion)
    .derivatives("of the color, through each conversion")
    .extremes(
        "An unknown space is an error of the run, and the color stays. It stays from a space to itself if both names \
               are constants; else it goes to rgb and back. Hue wraps. Greys have hue and \
               saturation 0; hsv of a color without positive component has saturation 0. xyY of black, and \
               XYZ of y up to 1e-6, have 0 for the quotient. sRGB is straight below its small limit, \
               negatives included.",
    )
    .example("color hsv = transformc(\"rgb\", \"hsv\", color(u, v, 0.5));"),
    Builtin::compose(
        "blackbody",
        &["c(f)"],
        "temperatureK",
        |b, s| b.lane(LaneOp::Blackbody, s.args).into(),
        "Light of a black body at a temperature in kelvin, W/m² over the visible range.",
    )
    .derivatives("zero")
    .extremes(
        "Below 800 K it is (1e-6, 0, 0), also for negatives and -inf. From 12000 K on it is computed, \
               and grows with the temperature; for inf and nan it is black.",
    )
    .example("color glow = blackbody(1000 + 5000 * u);"),
    Builtin::compose(
        "wavelength_color",
        &["c(f)"],
        "wavelengthNm",
        |b, s| b.lane(LaneOp::Wavelength, s.args).into(),
        "Light of one wavelength in nanometres; black outside 380 to 780.",
    )
    .derivatives("zero")
    .extremes(
        "Black up to 375 and from 780 nm on, and for inf and nan; below 380 the first two samples are \
               continued; negative components are 0.",
    )
    .example("color pure = wavelength_color(mix(380, 780, u));"),
    Builtin::compose(
        "color in space",
        &["c(s,c)"],
        "space, C",
        from_space,
        "color(\"space\", a, b, c): coordinates of \"rgb\", \"hsv\", \"hsl\", \"YIQ\", \"XYZ\" or \"xyY\".",
    )
    .spaces(Spaces::OfColor)
    .compiled(Compiled::Parts("color"))
    .derivatives("zero")
    .extremes(
        "An unknown space is an error of the run, and the color is taken as it is. The rest as for \
               transformc.",
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
