//! The color spaces by name: which operations convert from and to RGB. Folding and running share it. This
//! module must not know how the operations compute.

use crate::LaneOp;
use crate::color::SYSTEMS;

/// The operations that convert a color from a space to RGB, or from RGB to a space, in order. `None` for an
/// unknown space.
pub fn path(space: &str, to_rgb: bool) -> Option<&'static [LaneOp]> {
    use LaneOp as L;
    Some(match (space, to_rgb) {
        ("rgb" | "RGB" | "linear" | "Rec709" | "lin_srgb" | "scene_linear", _) => &[],
        ("hsv", true) => &[L::HsvToRgb],
        ("hsv", false) => &[L::RgbToHsv],
        ("hsl", true) => &[L::HslToRgb],
        ("hsl", false) => &[L::RgbToHsl],
        ("YIQ", true) => &[L::YiqToRgb],
        ("YIQ", false) => &[L::RgbToYiq],
        ("XYZ", true) => &[L::XyzToRgb],
        ("XYZ", false) => &[L::RgbToXyz],
        ("xyY", true) => &[L::XyyToXyz, L::XyzToRgb],
        ("xyY", false) => &[L::RgbToXyz, L::XyzToXyy],
        ("sRGB", true) => &[L::SrgbToLinear],
        ("sRGB", false) => &[L::LinearToSrgb],
        _ => return None,
    })
}

/// The same for colors with the primaries of a system, given by its number: the system's own name means RGB.
pub fn path_in(space: &str, to_rgb: bool, system: i32) -> Option<&'static [LaneOp]> {
    use LaneOp as L;
    let own = usize::try_from(system).ok().and_then(|at| SYSTEMS.get(at));
    if system == 0 {
        return path(space, to_rgb);
    }
    Some(match (space, to_rgb) {
        _ if own.is_some_and(|own| *own == space) => &[],
        ("XYZ", true) => &[L::XyzToRgbIn],
        ("XYZ", false) => &[L::RgbToXyzIn],
        ("xyY", true) => &[L::XyyToXyz, L::XyzToRgbIn],
        ("xyY", false) => &[L::RgbToXyzIn, L::XyzToXyy],
        _ => return path(space, to_rgb),
    })
}
