//! Color: spaces and luminance. The working space is RGB with the primaries of Rec. 709.

use super::{Builtin, Emitted, Site};
use crate::ir::{Builder, Kernel, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("luminance", &["f(c)"], LaneOp::Luminance, "Luminance of a linear RGB color."),
    Builtin::compose(
        "color in space",
        &["c(s,c)"],
        from_space,
        "color(\"space\", a, b, c): coordinates of \"rgb\", \"hsv\", \"hsl\", \"YIQ\", \"XYZ\" or \"xyY\".",
    ),
];

fn from_space(b: &mut Builder, s: &Site<'_>) -> Emitted {
    b.kernel(Kernel::ColorFrom, s.args, Kind::Triple).into()
}
