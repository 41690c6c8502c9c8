//! Light at a boundary: Fresnel's law, and the rotation of points about an axis.

use super::{Builtin, Emitted, Site};
use osl_ir::ir::{Builder, LaneOp, ValueId};

pub(super) static ROWS: &[Builtin] = &[
    Builtin::compose(
        "fresnel",
        &["x(v,n,f,of,of,ov,ov)", "x(v,n,f,of,of)"],
        "I, N, eta, Kr, Kt, R, T",
        fresnel,
        "Computes the fractions of light that are reflected, `Kr`, and transmitted, `Kt`, and their \
         directions `R` and `T`.",
    )
    .derivatives("by the formulas, for every output")
    .extremes(
        "At total reflection `Kr` is 1, `Kt` is 0 and `T` is zero. Divisions by 0 give 0: for an \
         `eta` of 0, 1/eta^2 counts as 0, which gives total reflection unless `I` and `N` are \
         parallel. If `I` is zero, `Kr` and `Kt` are finite.",
    )
    .example("float kr, kt; vector r, t; fresnel(normalize(I), N, 1 / 1.5, kr, kt, r, t);"),
    Builtin::compose(
        "rotate",
        &["p(p,f,p,p)", "p(p,f,v)"],
        "Q, angle, P0, P1 | Q, angle, axis",
        rotate,
        "Rotates the point `Q` by `angle`, in radians. It turns about the line through the points \
         `P0` and `P1`, or about `axis` through the origin.",
    )
    .derivatives("those of Q and P0; angle and the axis go through a matrix, which has no derivatives")
    .extremes(
        "If the axis has length 0, the point is not rotated but scaled by the cosine of `angle`. An \
         angle of inf counts as one with cosine -1 and sine 1, and -inf as one with cosine -1 and \
         sine -1.",
    )
    .example("point turned = rotate(P, M_PI_4, vector(0, 0, 1));"),
    Builtin::compose(
        "artistic_ior",
        &["x(c,c,oc,oc)"],
        "reflectivity, edge_color, ior, extinction",
        artistic_ior,
        "Computes the index of refraction, `ior`, and the `extinction` of a metal. The metal is given \
         by its `reflectivity` and `edge_color`.",
    )
    .derivatives("by the formulas, for both outputs")
    .extremes(
        "`reflectivity` is clamped to 0 to 0.99. If the number under the square root for `extinction` \
         is negative, it counts as 0. If `reflectivity` is nan, both outputs are 0; but if it is \
         known when compiling, `ior` is nan.",
    )
    .example("color n, k; artistic_ior(color(0.9, 0.6, 0.3), color(1), n, k);"),
];

fn fresnel(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let (i, n, eta) = (s.arg(0), s.arg(1), s.arg(2));
    let (zero, half, one) = (b.float(0.0), b.float(0.5), b.float(1.0));
    let reflected = b.lane(L::Reflect, &[i, n]);
    let facing = b.lane(L::Dot, &[i, n]);
    let c = b.lane(L::Abs, &[facing]);
    let square = b.lane(L::FMul, &[eta, eta]);
    let inverse = b.lane(L::FDiv, &[one, square]);
    let cc = b.lane(L::FMul, &[c, c]);
    let g = b.lane(L::FSub, &[inverse, one]);
    let g = b.lane(L::FAdd, &[g, cc]);
    let passes = b.lane(L::FGe, &[g, zero]);
    let g = b.lane(L::Sqrt, &[g]);
    let beta = b.lane(L::FSub, &[g, c]);
    let sum = b.lane(L::FAdd, &[g, c]);
    let upper = b.lane(L::FMul, &[c, sum]);
    let upper = b.lane(L::FSub, &[upper, one]);
    let lower = b.lane(L::FMul, &[c, beta]);
    let lower = b.lane(L::FAdd, &[lower, one]);
    let f = b.lane(L::FDiv, &[upper, lower]);
    let ff = b.lane(L::FMul, &[f, f]);
    let f = b.lane(L::FAdd, &[one, ff]);
    let f = b.lane(L::FMul, &[half, f]);
    let ratio = b.lane(L::FDiv, &[beta, sum]);
    let ratio = b.lane(L::FMul, &[ratio, ratio]);
    let f = b.lane(L::FMul, &[f, ratio]);
    let kr = b.lane(L::Choose, &[passes, f, one]);
    let rest = b.lane(L::FSub, &[one, f]);
    let kt = b.lane(L::FMul, &[rest, eta]);
    let kt = b.lane(L::FMul, &[kt, eta]);
    let kt = b.lane(L::Choose, &[passes, kt, zero]);
    let mut outputs = vec![(3, kr), (4, kt)];
    if s.args.len() > 5 {
        let through = b.lane(L::Refract, &[i, n, eta]);
        let none = b.lane(L::Splat, &[zero]);
        let through = b.lane(L::Choose, &[passes, through, none]);
        outputs.extend([(5, reflected), (6, through)]);
    }
    Emitted { result: None, outputs }
}

fn rotate(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let (p, angle) = (s.arg(0), s.arg(1));
    let (origin, along) = if s.args.len() == 4 {
        (Some(s.arg(2)), b.lane(L::FSub, &[s.arg(3), s.arg(2)]))
    } else {
        (None, s.arg(2))
    };
    let axis = b.lane(L::Normalize, &[along]);
    let cos = b.lane(L::Cos, &[angle]);
    let sin = b.lane(L::Sin, &[angle]);
    let one = b.float(1.0);
    let rest = b.lane(L::FSub, &[one, cos]);
    let u = [L::X, L::Y, L::Z].map(|part| b.lane(part, &[axis]));
    let mut matrix = b.lane(L::MDiag, &[one]);
    for row in 0..3 {
        for column in 0..3 {
            let cell = turn(b, u, row, column, [one, cos, sin, rest]);
            let (r, c) = (b.int(row as i32), b.int(column as i32));
            matrix = b.lane(L::MSet, &[matrix, r, c, cell]);
        }
    }
    let start = origin.map_or(p, |a| b.lane(L::FSub, &[p, a]));
    let turned = b.lane(L::TransformPoint, &[matrix, start]);
    origin.map_or(turned, |a| b.lane(L::FAdd, &[turned, a])).into()
}

/// A cell of the matrix that rotates about the unit axis `u`; the numbers are 1, cosine, sine and 1 − cosine.
fn turn(b: &mut Builder, u: [ValueId; 3], row: usize, column: usize, k: [ValueId; 4]) -> ValueId {
    use LaneOp as L;
    let [one, cos, sin, rest] = k;
    if row == column {
        let square = b.lane(L::FMul, &[u[row], u[row]]);
        let other = b.lane(L::FSub, &[one, square]);
        let other = b.lane(L::FMul, &[other, cos]);
        return b.lane(L::FAdd, &[square, other]);
    }
    let (first, second) = (u[row.min(column)], u[row.max(column)]);
    let product = b.lane(L::FMul, &[first, second]);
    let product = b.lane(L::FMul, &[product, rest]);
    let side = b.lane(L::FMul, &[u[3 - row - column], sin]);
    // Cyclic pairs (x, y), (y, z), (z, x) add the sine.
    let op = if column == (row + 1) % 3 { L::FAdd } else { L::FSub };
    b.lane(op, &[product, side])
}

fn artistic_ior(b: &mut Builder, s: &Site<'_>) -> Emitted {
    use LaneOp as L;
    let (zero, one, limit) = (b.float(0.0), b.float(1.0), b.float(0.99));
    let r = b.lane(L::Clamp, &[s.arg(0), zero, limit]);
    let root = b.lane(L::Sqrt, &[r]);
    let fraction = |b: &mut Builder, x: ValueId, flip: bool| {
        let (more, less) = (b.lane(L::FAdd, &[one, x]), b.lane(L::FSub, &[one, x]));
        b.lane(L::FDiv, &if flip { [less, more] } else { [more, less] })
    };
    let (low, high) = (fraction(b, r, true), fraction(b, root, false));
    let n = b.lane(L::Mix, &[high, low, s.arg(1)]);
    let squared = |b: &mut Builder, op: LaneOp| {
        let x = b.lane(op, &[n, one]);
        b.lane(L::FMul, &[x, x])
    };
    let above = squared(b, L::FAdd);
    let above = b.lane(L::FMul, &[above, r]);
    let below = squared(b, L::FSub);
    let k = b.lane(L::FSub, &[above, below]);
    let rest = b.lane(L::FSub, &[one, r]);
    let k = b.lane(L::FDiv, &[k, rest]);
    let zeros = b.lane(L::Splat, &[zero]);
    let k = b.lane(L::Max, &[zeros, k]);
    let k = b.lane(L::Sqrt, &[k]);
    Emitted { result: None, outputs: vec![(2, n), (3, k)] }
}
