//! The changes of values from a pixel to its neighbours.

use super::{Builtin, Emitted, Site};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Builder, Kind, LaneOp, ValueId};

const EACH: &[&str] = &["f(f)", "v(p)", "v(v)", "v(n)", "c(c)"];

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "Dx",
        EACH,
        "a",
        |b, s| b.derivative(s.arg(0), Axis::X).into(),
        "Returns how much `a` changes from one pixel to the next in the row; the derivatives of the \
         result are zero.",
    )
    .derivatives("zero: no second derivatives")
    .extremes(
        "The result is 0 for values without derivatives: constants, ints, N, Ng, dPdu, dPdv, time and \
         unconnected parameters. Assignments in a branch that was not executed have no effect. If a \
         value is not finite, the result may be inf or nan.",
    )
    .example("float du = Dx(u);"),
    Builtin::compose(
        "Dy",
        EACH,
        "a",
        |b, s| b.derivative(s.arg(0), Axis::Y).into(),
        "Returns how much `a` changes from one row of pixels to the next; the derivatives of the \
         result are zero.",
    )
    .derivatives("zero: no second derivatives")
    .extremes(
        "The result is 0 for values without derivatives: constants, ints, N, Ng, dPdu, dPdv, time and \
         unconnected parameters. Assignments in a branch that was not executed have no effect. If a \
         value is not finite, the result may be inf or nan.",
    )
    .example("float dv = Dy(v);"),
    Builtin::compose(
        "Dz",
        EACH,
        "a",
        |b, s| zero(b, s.arg(0)).into(),
        "Returns how much `a` changes in depth, which is 0 on a surface.",
    )
    .derivatives("zero: no second derivatives")
    .extremes("The result is always 0.")
    .example("vector depth = Dz(P);"),
    Builtin::compose(
        "filterwidth",
        &["f(f)", "v(p)", "v(v)"],
        "x",
        |b, s| width(b, s.arg(0)).into(),
        "Returns the length of the change of `x` along both axes, per component: sqrt(Dx*Dx + Dy*Dy).",
    )
    .derivatives("zero: no second derivatives")
    .extremes(
        "Values without derivatives give 0, and so does a change that is nan. Changes below about 1e-23 \
         give 0, because their squares underflow; changes above 1.84e19 give inf.",
    )
    .example("float w = filterwidth(u);"),
    Builtin::compose(
        "area",
        &["f(p)"],
        "p",
        |b, s| {
            let across = across(b, s.arg(0));
            b.lane(LaneOp::Length, &[across]).into()
        },
        "Returns the area that the position `p` covers over one pixel.",
    )
    .derivatives("zero: no second derivatives")
    .extremes("The result is 0 if the position does not change, or if it changes along one line only.")
    .example("float covered = area(P);"),
    Builtin::compose(
        "calculatenormal",
        &["v(p)"],
        "p",
        calculatenormal,
        "Returns the normal of the surface that the position `p` describes: Dx(p) x Dy(p), or \
         Dy(p) x Dx(p) where Dx(P) x Dy(P) points away from N. Its length is not 1.",
    )
    .derivatives("zero: no second derivatives")
    .extremes(
        "The result is 0 if the position does not change, or if it changes along one line only; \
         normalize keeps this 0.",
    )
    .example("normal n = normalize(calculatenormal(P));"),
    Builtin::compose(
        "aastep",
        &["f(f,f,f,f)", "f(f,f,f)", "f(f,f)"],
        "edge, s, dedge, ds | edge, s, ds",
        aastep,
        "Returns 0 below `edge`, 1 above it, and a ramp as wide as a pixel in between. The ramp's \
         width is the sum of `dedge` and `ds`; if one of them is not given, the filter width of \
         `edge` or `s` takes its place.",
    )
    .derivatives("by the formula; 0 outside the ramp")
    .extremes(
        "If the width is 0, the result is a step: 0 up to the edge and at the edge, 1 above it. The \
         signs of `dedge` and `ds` have no effect. nan in `edge` or `s` gives 0, because the test \
         against the lower end holds.",
    )
    .example("float y = aastep(0.5, u);"),
];

fn zero(b: &mut Builder, like: ValueId) -> ValueId {
    let kind = b.body.kind(like);
    b.constant(osl_ir::ir::Const::zero(kind))
}

fn width(b: &mut Builder, of: ValueId) -> ValueId {
    let [xx, yy] = Axis::BOTH.map(|axis| {
        let d = b.derivative(of, axis);
        b.lane(LaneOp::FMul, &[d, d])
    });
    let sum = b.lane(LaneOp::FAdd, &[xx, yy]);
    b.lane(LaneOp::Sqrt, &[sum])
}

fn across(b: &mut Builder, of: ValueId) -> ValueId {
    let [x, y] = Axis::BOTH.map(|axis| b.derivative(of, axis));
    b.lane(LaneOp::Cross, &[x, y])
}

/// The product of the changes, with the sign for the handedness of the image.
fn calculatenormal(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let normal = across(b, s.arg(0));
    let flipped = b.global(Global::LeftHanded, Kind::Float);
    // 1 or -1: uniform on a grid, where it costs one product.
    let (one, two) = (b.float(1.0), b.float(2.0));
    let twice = b.lane(LaneOp::FMul, &[two, flipped]);
    let sign = b.lane(LaneOp::FSub, &[one, twice]);
    b.lane(LaneOp::FMul, &[normal, sign]).into()
}

fn aastep(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let (edge, x) = (s.arg(0), s.arg(1));
    // Four arguments: both widths given; three: that of the edge is measured; two: both are.
    let (first, second) = match s.args.len() {
        4 => (s.arg(2), s.arg(3)),
        3 => (width(b, edge), s.arg(2)),
        _ => (width(b, edge), width(b, x)),
    };
    let (first, second) = (b.lane(L::Abs, &[first]), b.lane(L::Abs, &[second]));
    let span = b.lane(L::FAdd, &[first, second]);
    let half = b.float(0.5);
    let half = b.lane(L::FMul, &[half, span]);
    let low = b.lane(L::FSub, &[edge, half]);
    let high = b.lane(L::FAdd, &[edge, half]);
    let (zero, one) = (b.float(0.0), b.float(1.0));
    let above = b.lane(L::FSub, &[x, low]);
    let ramp = b.lane(L::FDiv, &[above, span]);
    let ended = b.lane(L::FGe, &[x, high]);
    let ramp = b.lane(L::Choose, &[ended, one, ramp]);
    let before = b.lane(L::FLe, &[x, low]);
    b.lane(L::Choose, &[before, zero, ramp]).into()
}
