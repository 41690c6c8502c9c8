//! The color spaces by name: which operations convert between them. Folding and running share it.

use crate::LaneOp;
use crate::color::SYSTEMS;
use crate::named;

/// The operations of a conversion between two color spaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path {
    /// To linear RGB, and from there.
    legs: [Leg; 2],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    ops: &'static [LaneOp],
    /// The second operand of operations that take a number.
    number: i32,
}

impl Path {
    /// The conversion between two spaces; `None` if one is unknown. A system of RGB primaries is given by its
    /// number in [`SYSTEMS`]; its own name means RGB. Without a system, RGB is linear Rec. 709, and the
    /// spaces of [`named`] are known, too.
    pub fn between(from: &str, to: &str, system: Option<i32>) -> Option<Path> {
        if system.is_none() && (named::is_raw(from) || named::is_raw(to)) {
            let nothing = |name| leg(name, true, system).is_some() || named::is_raw(name);
            let none = Leg { ops: &[], number: 0 };
            return (nothing(from) && nothing(to)).then_some(Path { legs: [none; 2] });
        }
        Some(Path { legs: [leg(from, true, system)?, leg(to, false, system)?] })
    }

    /// The operations in order, each with its second operand if it takes one.
    pub fn steps(self) -> impl Iterator<Item = (LaneOp, Option<i32>)> {
        self.legs
            .into_iter()
            .flat_map(|leg| leg.ops.iter().map(move |op| (*op, op.takes_number().then_some(leg.number))))
    }
}

/// The operations that convert a color from a space to RGB, or from RGB to a space, in order.
fn leg(space: &str, to_rgb: bool, system: Option<i32>) -> Option<Leg> {
    let number = system.unwrap_or(0);
    if let Some(ops) = own(space, to_rgb, number) {
        return Some(Leg { ops, number });
    }
    let number = named::number(space, to_rgb).filter(|_| system.is_none())?;
    Some(Leg { ops: &[LaneOp::ConvertNamed], number })
}

/// The same for the spaces that the language itself knows.
fn own(space: &str, to_rgb: bool, system: i32) -> Option<&'static [LaneOp]> {
    use LaneOp as L;
    let own = usize::try_from(system).ok().and_then(|at| SYSTEMS.get(at));
    let usual = system == 0;
    Some(match (space, to_rgb) {
        _ if own.is_some_and(|own| *own == space) => &[],
        ("rgb" | "RGB" | "linear" | "Rec709" | "lin_srgb" | "scene_linear", _) => &[],
        ("hsv", true) => &[L::HsvToRgb],
        ("hsv", false) => &[L::RgbToHsv],
        ("hsl", true) => &[L::HslToRgb],
        ("hsl", false) => &[L::RgbToHsl],
        ("YIQ", true) => &[L::YiqToRgb],
        ("YIQ", false) => &[L::RgbToYiq],
        ("XYZ", true) if usual => &[L::XyzToRgb],
        ("XYZ", false) if usual => &[L::RgbToXyz],
        ("xyY", true) if usual => &[L::XyyToXyz, L::XyzToRgb],
        ("xyY", false) if usual => &[L::RgbToXyz, L::XyzToXyy],
        ("XYZ", true) => &[L::XyzToRgbIn],
        ("XYZ", false) => &[L::RgbToXyzIn],
        ("xyY", true) => &[L::XyyToXyz, L::XyzToRgbIn],
        ("xyY", false) => &[L::RgbToXyzIn, L::XyzToXyy],
        ("sRGB", true) => &[L::SrgbToLinear],
        ("sRGB", false) => &[L::LinearToSrgb],
        _ => return None,
    })
}
