//! Geometry: products, lengths, directions.

use super::{Builtin, Emitted, Site};
use crate::hir::Global;
use crate::ir::{Builder, Const, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("dot", &["f(v,v)"], LaneOp::Dot, "Scalar product."),
    Builtin::lane("cross", &["v(v,v)"], LaneOp::Cross, "Vector product."),
    Builtin::lane("length", &["f(v)"], LaneOp::Length, "Length of a vector."),
    Builtin::compose(
        "distance",
        &["f(p,p)", "f(p,p,p)"],
        distance,
        "Distance of two points, or of the third point from the segment between the first two.",
    ),
    Builtin::lane(
        "normalize",
        &["n(n)", "v(v)"],
        LaneOp::Normalize,
        "The vector at length 1; zero stays zero.",
    ),
    Builtin::compose(
        "faceforward",
        &["v(v,v,v)", "v(v,v)"],
        faceforward,
        "N turned to face against I as seen from Nref (default Ng): -N where dot(I, Nref) is positive.",
    ),
    Builtin::lane("reflect", &["v(v,v)"], LaneOp::Reflect, "I mirrored at the plane with the unit normal N."),
    Builtin::lane(
        "refract",
        &["v(v,v,f)"],
        LaneOp::Refract,
        "I bent at the plane with the unit normal N, by the ratio eta of indices; zero at total reflection.",
    ),
];

fn distance(b: &mut Builder, s: &Site<'_>) -> Emitted {
    if s.args.len() == 2 {
        return b.lane(LaneOp::Distance, s.args).into();
    }
    let (start, end, point) = (s.arg(0), s.arg(1), s.arg(2));
    let along = b.lane(LaneOp::FSub, &[end, start]);
    let from_start = b.lane(LaneOp::FSub, &[point, start]);
    let squared = b.lane(LaneOp::Dot, &[along, along]);
    let projected = b.lane(LaneOp::Dot, &[from_start, along]);
    // The guarded division makes a segment of no length its start.
    let t = b.lane(LaneOp::FDiv, &[projected, squared]);
    let (zero, one) = (b.float(0.0), b.float(1.0));
    let t = b.lane(LaneOp::Clamp, &[t, zero, one]);
    let step = b.lane(LaneOp::FMul, &[t, along]);
    let nearest = b.lane(LaneOp::FAdd, &[start, step]);
    b.lane(LaneOp::Distance, &[point, nearest]).into()
}

fn faceforward(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let reference = if s.args.len() == 3 { s.arg(2) } else { b.global(Global::Ng, Kind::Triple) };
    let facing = b.lane(LaneOp::Dot, &[s.arg(1), reference]);
    let zero = b.constant(Const::Float(0.0));
    let away = b.lane(LaneOp::FGt, &[facing, zero]);
    let turned = b.lane(LaneOp::FNeg, &[s.arg(0)]);
    b.lane(LaneOp::Choose, &[away, turned, s.arg(0)]).into()
}
