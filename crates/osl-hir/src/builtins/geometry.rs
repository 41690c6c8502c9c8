//! Geometry: products, lengths, directions.

use super::{Builtin, Emitted, Site};
use osl_ir::global::Global;
use osl_ir::ir::{Builder, Const, Kind, LaneOp};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::lane("dot", &["f(v,v)"], "A, B", LaneOp::Dot, "Returns the dot product of `A` and `B`.")
        .derivatives("A.dB + B.dA")
        .extremes(
            "The sum is computed as (xx + yy) + zz, and every step is rounded. Overflow gives inf, and \
             inf times 0 gives nan.",
        )
        .example("float c = dot(normalize(I), N);"),
    Builtin::lane("cross", &["v(v,v)"], "A, B", LaneOp::Cross, "Returns the cross product of `A` and `B`.")
        .derivatives("A x dB + dA x B")
        .extremes("Parallel vectors give 0. Overflow gives inf, and inf minus inf gives nan.")
        .example("vector side = cross(dPdu, dPdv);"),
    Builtin::lane("length", &["f(v)"], "V", LaneOp::Length, "Returns the length of `V`.")
        .derivatives("V.dV / length; 0 where the length is 0")
        .extremes(
            "The zero vector gives 0. Squares that underflow are corrected: length(vector(1e-30, 0, 0)) \
             is 1e-30; but if derivatives are needed, it is 0. From 1.84e19 on the squares overflow, and \
             the result is inf. nan gives nan, or 0 if derivatives are needed.",
        )
        .example("float far = length(vector(P));"),
    Builtin::compose(
        "distance",
        &["f(p,p)", "f(p,p,p)"],
        "P0, P1, Q",
        distance,
        "Returns the distance between the points `P0` and `P1`. With a third point, it returns the \
         distance of `Q` from the segment between them.",
    )
    .derivatives("by the formula; 0 where the distance is 0")
    .extremes(
        "Equal points give 0. Squares that underflow are not corrected: points closer than about \
         1e-23 have the distance 0. From 1.84e19 on the distance is inf. A segment of length 0 counts \
         as the point `P0`.",
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
        "Returns `V` scaled to length 1; the zero vector stays zero.",
    )
    .derivatives("those of V / length(V); 0 where the length is 0")
    .extremes(
        "The zero vector stays zero. Vectors shorter than about 1e-23 give zero, because their \
         squares underflow. From a length of 1.84e19 on, the squares overflow: finite components give \
         0, and infinite ones give nan. If a component is nan, all components of the result are 0.",
    )
    .example("vector toward = normalize(vector(P));"),
    Builtin::compose(
        "faceforward",
        &["v(v,v,v)", "v(v,v)"],
        "N, I, Nref",
        faceforward,
        "Turns `N` to face against the direction `I`: returns -N if dot(I, Nref) is positive, else \
         `N`. The default of `Nref` is the global Ng.",
    )
    .derivatives("those of N, negated where the result is -N")
    .extremes("If the dot product is exactly 0, the result is `N`. A dot product of nan counts as positive.")
    .example("normal front = faceforward(N, I);"),
    Builtin::lane(
        "reflect",
        &["v(v,v)"],
        "I, N",
        LaneOp::Reflect,
        "Returns the direction `I` reflected by a surface with the unit normal `N`.",
    )
    .derivatives("by the formula I - 2 (N.I) N")
    .extremes(
        "`N` is not normalized: a zero `N` gives `I`, and an `N` whose length is not 1 gives another \
         result. nan gives nan.",
    )
    .example("vector mirrored = reflect(I, N);"),
    Builtin::lane(
        "refract",
        &["v(v,v,f)"],
        "I, N, eta",
        LaneOp::Refract,
        "Returns the direction `I` refracted by a surface with the unit normal `N`. `eta` is the \
         ratio of the indices of refraction. At total reflection the result is the zero vector.",
    )
    .derivatives("by the formula; 0 at total reflection")
    .extremes(
        "Total reflection gives 0. `N` must face against `I`. An `eta` of 0 gives -N if `N` is a unit \
         vector. nan gives 0.",
    )
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
