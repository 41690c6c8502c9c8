//! Matrices and named spaces. Row vectors multiply from the left; a space's matrix takes points of that space
//! to common space.

use super::{Builtin, Compiled, Emitted, Site, Spaces};
use osl_ir::ir::{Builder, Const, Kernel, Kind, LaneOp, ValueId};
use osl_ir::types::Type;

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "transform",
        &[
            "n(m,n)",
            "v(m,v)",
            "p(m,p)",
            "n(s,s,n)",
            "v(s,s,v)",
            "p(s,s,p)",
            "n(s tospace,n)",
            "v(s tospace,v)",
            "p(s tospace,p)",
        ],
        "fromspace, tospace, p | Mto, p",
        transform,
        "Transforms the point, vector or normal `p` by a matrix, or from one named space to another. \
         The default of `fromspace` is common. A point is multiplied by the whole matrix. The \
         translation does not change a vector. A normal is multiplied by the inverse transpose, so \
         that it stays perpendicular to a surface that is stretched; the translation does not change \
         it either.",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::ByResult(&[(Type::VECTOR, "transformv"), (Type::NORMAL, "transformn")]))
    .derivatives("those of the point, vector or normal; the matrix has none")
    .extremes(
        "If the fourth coordinate of a transformed point is 0, the result is 0; if the division by it \
         overflows, the result is inf. A singular matrix does not change normals, since its inverse \
         counts as the identity. An unknown space is a run-time error and changes nothing.",
    )
    .example("point p = transform(matrix(2), P); vector up = transform(\"shader\", vector(0, 1, 0));"),
    Builtin::compose(
        "transformu",
        &["f(s,s,f)", "f(s,f)"],
        "fromunits, tounits, x | tounits, x",
        transformu,
        "Converts `x` from one unit to another; the default of `fromunits` is common. Units of length are \
         mm, cm, m, km, in, ft, mi and the names of spaces; units of time are s, frames and common. A unit \
         of common space counts as a metre, common time as seconds, and a second has 24 frames. No known \
         renderer runs this function, although the language specification has it.",
    )
    .derivatives("those of x, converted")
    .extremes(
        "An unknown unit is a run-time error and counts as common, and so does a unit of time that is \
         converted to or from a length. The unit of a space is the length of its x axis.",
    )
    .example("float metres = transformu(\"cm\", \"m\", 250 * u);"),
    Builtin::compose(
        "getmatrix",
        &["i(s,s,om)", "i(s,om)"],
        "fromspace, tospace, M | fromspace, M",
        getmatrix,
        "Stores the matrix from `fromspace` to `tospace` (default common) in `M`. Returns 1 if both \
         spaces are known, else 0.",
    )
    .query()
    .spaces(Spaces::Coordinates)
    .derivatives("none: matrices have none")
    .extremes(
        "An unknown space is a run-time error and counts as common space: the result is 0, and `M` is \
         the matrix of the other space. The matrix of \"common\" and of \"world\" is the identity. \
         The inverse of a singular matrix counts as the identity.",
    )
    .example("matrix m; int known = getmatrix(\"shader\", m);"),
    Builtin::lane(
        "determinant",
        &["f(m)"],
        "M",
        LaneOp::MDet,
        "Returns the determinant of the 4x4 matrix `M`.",
    )
    .derivatives("zero")
    .extremes(
        "A singular matrix gives 0, apart from rounding. If products overflow, the result is inf or \
         nan.",
    )
    .example("float volume = determinant(matrix(2));"),
    Builtin::lane(
        "transpose",
        &["m(m)"],
        "M",
        LaneOp::MTranspose,
        "Returns `M` with rows and columns exchanged.",
    )
    .derivatives("none: matrices have none")
    .extremes("The elements are moved without any change, inf and nan too.")
    .example("matrix m = transpose(matrix(\"shader\", \"world\"));"),
    Builtin::compose(
        "point in space",
        &["p(s,p)"],
        "space, p",
        into_common,
        "Makes a point from coordinates in a named space: point(\"space\", x, y, z).",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::Parts("point"))
    .derivatives("those of the coordinates")
    .extremes("An unknown space is a run-time error, and the coordinates are used unchanged.")
    .example("point x = point(\"shader\", u, v, 0);"),
    Builtin::compose(
        "vector in space",
        &["v(s,v)"],
        "space, v",
        into_common,
        "Makes a vector from coordinates in a named space: vector(\"space\", x, y, z).",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::Parts("vector"))
    .derivatives("those of the coordinates")
    .extremes("An unknown space is a run-time error, and the coordinates are used unchanged.")
    .example("vector x = vector(\"shader\", u, v, 0);"),
    Builtin::compose(
        "normal in space",
        &["n(s,n)"],
        "space, n",
        into_common,
        "Makes a normal from coordinates in a named space: normal(\"space\", x, y, z).",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::Parts("normal"))
    .derivatives("those of the coordinates")
    .extremes("An unknown space is a run-time error, and the coordinates are used unchanged.")
    .example("normal x = normal(\"shader\", u, v, 0);"),
    Builtin::compose(
        "matrix in space",
        &["m(s,m)"],
        "space, M",
        matrix_in_space,
        "Makes a matrix relative to a named space: matrix(\"space\", …).",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::Parts("matrix"))
    .derivatives("none: matrices have none")
    .extremes("An unknown space is a run-time error, and its matrix counts as the identity.")
    .example("matrix m = matrix(\"shader\", 2);"),
    Builtin::compose(
        "matrix from spaces",
        &["m(s,s)"],
        "fromspace, tospace",
        between,
        "Makes the matrix that transforms points from one named space to another: matrix(\"from\", \
         \"to\").",
    )
    .spaces(Spaces::Coordinates)
    .compiled(Compiled::As("matrix"))
    .derivatives("none: matrices have none")
    .extremes(
        "An unknown space is a run-time error and counts as common space. The inverse of a singular \
         matrix counts as the identity.",
    )
    .example("matrix m = matrix(\"shader\", \"world\");"),
];

/// The matrix for coordinates: they stay unchanged unless both spaces are known.
fn space_matrix(b: &mut Builder, from: ValueId, to: ValueId) -> ValueId {
    b.kernel(Kernel::SpaceMatrix { both: true }, &[from, to], Kind::Matrix)
}

fn common(b: &mut Builder) -> ValueId {
    b.constant(Const::Str("common".into()))
}

fn apply(b: &mut Builder, ty: Type, matrix: ValueId, value: ValueId) -> Emitted {
    let op = match ty {
        Type::POINT => LaneOp::TransformPoint,
        Type::NORMAL => LaneOp::TransformNormal,
        _ => LaneOp::TransformVector,
    };
    b.lane(op, &[matrix, value]).into()
}

fn transform(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let ty = s.signature.ret;
    match (b.body.kind(s.arg(0)), s.args.len()) {
        (Kind::Matrix, _) => apply(b, ty, s.arg(0), s.arg(1)),
        (_, 3) => {
            let matrix = space_matrix(b, s.arg(0), s.arg(1));
            apply(b, ty, matrix, s.arg(2))
        }
        _ => {
            let from = common(b);
            let matrix = space_matrix(b, from, s.arg(0));
            apply(b, ty, matrix, s.arg(1))
        }
    }
}

/// Units of length in tenths of a millimetre: all are whole.
const LENGTHS: [(&str, f32); 7] = [
    ("mm", 10.0),
    ("cm", 100.0),
    ("m", METRE),
    ("km", 1e7),
    ("in", 254.0),
    ("ft", 3048.0),
    ("mi", 16_093_440.0),
];
const METRE: f32 = 1e4;
/// Units of time in frames.
const TIMES: [(&str, f32); 2] = [("s", 24.0), ("frames", 1.0)];

fn transformu(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let (from, to, x) = match s.args {
        [from, to, x] => (*from, *to, *x),
        _ => (common(b), s.arg(0), s.arg(1)),
    };
    let of_time = |b: &mut Builder, name| {
        let zero = b.int(0);
        let times = TIMES.map(|(unit, _)| is_named(b, name, unit));
        let is_time = times.into_iter().fold(zero, |any, one| b.lane(LaneOp::IOr, &[any, one]));
        let is_common = is_named(b, name, "common");
        (is_time, b.lane(LaneOp::IOr, &[is_time, is_common]))
    };
    let ((a, may_a), (z, may_z)) = (of_time(b, from), of_time(b, to));
    // Common is a time beside a unit of time, and a length otherwise.
    let (any, both) = (b.lane(LaneOp::IOr, &[a, z]), b.lane(LaneOp::IAnd, &[may_a, may_z]));
    let times = b.lane(LaneOp::IAnd, &[any, both]);
    let (from, to) = (unit(b, from, times), unit(b, to, times));
    let scaled = b.lane(LaneOp::FMul, &[x, from]);
    b.lane(LaneOp::FDiv, &[scaled, to]).into()
}

fn is_named(b: &mut Builder, name: ValueId, unit: &str) -> ValueId {
    let unit = b.constant(Const::Str(unit.into()));
    b.lane(LaneOp::SEq, &[name, unit])
}

/// The size of a unit, of time or of length. Other names are those of spaces.
fn unit(b: &mut Builder, name: ValueId, times: ValueId) -> ValueId {
    let common = common(b);
    let lengths = LENGTHS.map(|(unit, size)| (is_named(b, name, unit), size));
    let known = lengths.iter().fold(times, |any, (one, _)| b.lane(LaneOp::IOr, &[any, *one]));
    let space = b.choose(known, common, name);
    let matrix = space_matrix(b, space, common);
    let axis = b.constant(Const::Triple([1.0, 0.0, 0.0]));
    let axis = b.lane(LaneOp::TransformVector, &[matrix, axis]);
    let axis = b.lane(LaneOp::Length, &[axis]);
    let metre = b.float(METRE);
    let mut length = b.lane(LaneOp::FMul, &[axis, metre]);
    for (is, size) in lengths {
        let size = b.float(size);
        length = b.choose(is, size, length);
    }
    let mut time = b.float(TIMES[0].1);
    for (unit, size) in TIMES {
        let (is, size) = (is_named(b, name, unit), b.float(size));
        time = b.choose(is, size, time);
    }
    b.choose(times, time, length)
}

fn getmatrix(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let to = if s.args.len() == 3 { s.arg(1) } else { common(b) };
    let found = b.kernel_of(Kernel::FindSpace, &[s.arg(0), to], &[Kind::Int, Kind::Matrix]);
    Emitted { result: Some(found[0]), outputs: vec![(s.args.len() - 1, found[1])] }
}

fn into_common(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let to = common(b);
    let matrix = space_matrix(b, s.arg(0), to);
    apply(b, s.signature.ret, matrix, s.arg(1))
}

fn matrix_in_space(b: &mut Builder, s: &Site<'_>) -> Emitted {
    let to = common(b);
    let space = space_matrix(b, s.arg(0), to);
    b.lane(LaneOp::MMul, &[space, s.arg(1)]).into()
}

fn between(b: &mut Builder, s: &Site<'_>) -> Emitted {
    b.kernel(Kernel::SpaceMatrix { both: false }, &[s.arg(0), s.arg(1)], Kind::Matrix).into()
}
