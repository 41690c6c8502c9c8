//! Geometry: products, lengths, directions.

use super::{Builtin, Composed, Emitted, Site};
use osl_ir::global::Global;
use osl_ir::ir::{Builder, Const, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("dot", &["f(v,v)"], "A, B", LaneOp::Dot, "Scalar product.")
        .derivatives("A.dB + B.dA")
        .extremes(
            "The order of the sum is (xx + yy) + zz, each rounded. Overflow gives inf; inf times 0 gives \
               nan.",
        )
        .example("float c = dot(normalize(I), N);"),
    Builtin::lane("cross", &["v(v,v)"], "A, B", LaneOp::Cross, "Vector product.")
        .derivatives("A x dB + dA x B")
        .extremes("Of parallel vectors 0. Overflow gives inf, and inf less inf nan.")
        .example("vector side = cross(dPdu, dPdv);"),
    Builtin::lane("length", &["f(v)"], "V", LaneOp::Length, "Length of a vector.")
        .derivatives("V.dV / length; 0 where that is 0")
        .extremes(
            "0 for the zero vector. Squares that underflow are rescued: length(vector(1e-30, 0, 0)) is \
               1e-30, unless derivatives are needed, where it is 0. From 1.84e19 on squares overflow to \
               inf; nan stays, but is 0 where derivatives are needed.",
        )
        .example("float far = length(vector(P));"),
    Builtin::compose(
        "distance",
        &["f(p,p)", "f(p,p,p)"],
        "P0, P1, Q",
        distance,
        "Distance of two points, or of the third point from the segment between the first two.",
    )
    .derivatives("by the formula; 0 where the distance is 0")
    .extremes(
        "Equal points give 0. Squares are not rescued: points nearer than about 1e-23 have distance \
               0, and from 1.84e19 on it is inf. A segment of no length is its start.",
    )
    .example(
        "float from_origin = distance(P, point(0)); float from_segment = distance(point(0), point(1, \
              0, 0), P);",
    ),
    Builtin::lane(
        "normalize",
        &["n(n)", "v(v)"],
        "V",
        LaneOp::Normalize,
        "The vector at length 1; zero stays zero.",
    )
    .derivatives("of V / length(V); 0 where the length is 0")
    .extremes(
        "The zero vector stays zero, and so do vectors shorter than about 1e-23, whose squares \
               underflow. From a length of 1.84e19 on, where they overflow, finite components give 0 and \
               infinite ones nan. nan gives 0 in all components.",
    )
    .example("vector toward = normalize(vector(P));"),
    Builtin::compose(
        "faceforward",
        &["v(v,v,v)", "v(v,v)"],
        "N, I, Nref",
        faceforward,
        "N turned to face against I as seen from Nref (default Ng): -N where dot(I, Nref) is positive.",
    )
    .composed(Composed::FaceForward)
    .derivatives("those of N, turned with it")
    .extremes("N is kept where the dot product is exactly 0. A product of nan counts as positive.")
    .example("normal front = faceforward(N, I);"),
    Builtin::lane(
        "reflect",
        &["v(v,v)"],
        "I, N",
        LaneOp::Reflect,
        "I mirrored at the plane with the unit normal N.",
    )
    .composed(Composed::Reflect)
    .derivatives("by the formula I - 2 (N.I) N")
    .extremes(
        "N is taken as it is: a zero N gives I, one of another length than 1 another result. nan \
               stays.",
    )
    .example("vector mirrored = reflect(I, N);"),
    Builtin::lane(
        "refract",
        &["v(v,v,f)"],
        "I, N, eta",
        LaneOp::Refract,
        "I bent at the plane with the unit normal N, by the ratio eta of indices; zero at total reflection.",
    )
    .composed(Composed::Refract)
    .derivatives("by the formula; 0 at total reflection")
    .extremes("Total reflection gives 0. N has to face I. eta of 0 gives -N for a unit N; nan gives nan.")
    .example("vector bent = refract(normalize(I), N, 1 / 1.5);"),
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
    // The guarded division reduces a segment of length zero to its start.
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
