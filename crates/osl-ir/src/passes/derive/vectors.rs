//! The derivative rules of vectors, matrices and colors.

use super::Writer;
use super::dual::{Dual, Tangent};
use crate::ir::{LaneOp, ValueId};

/// Value and tangents of `result = op(args)`, as for the lane operations.
pub(super) fn rule(w: &mut Writer<'_>, op: LaneOp, args: &[Dual], result: ValueId) -> Option<Dual> {
    use LaneOp as L;
    let same = |d| Dual { v: result, d };
    Some(match (op, args) {
        (L::Dot, [a, b]) => same(dot(w, *a, *b)),
        (L::Cross, [a, b]) => same(cross(w, *a, *b)),
        (L::Length, [a]) => length(w, *a),
        (L::Distance, [a, b]) => {
            let way = w.sub(*a, *b);
            length(w, way)
        }
        (L::Normalize, [a]) => {
            let size = length(w, *a);
            let one = w.constant_dual(1.0);
            let inverse = w.guarded(one, size);
            same(w.mul(*a, inverse).d)
        }
        (L::HsvToRgb | L::RgbToHsv | L::HslToRgb | L::RgbToHsl | L::XyyToXyz | L::XyzToXyy, [c]) => {
            let tangent = match op {
                L::HsvToRgb => L::HsvToRgbTangent,
                L::RgbToHsv => L::RgbToHsvTangent,
                L::HslToRgb => L::HslToRgbTangent,
                L::RgbToHsl => L::RgbToHslTangent,
                L::XyyToXyz => L::XyyToXyzTangent,
                _ => L::XyzToXyyTangent,
            };
            same(c.d.map(|d| d.map(|d| w.lane(tangent, &[c.v, d]))))
        }
        (L::Reflect, [i, n]) => {
            let v = w.lane(L::Dot, &[n.v, i.v]);
            let facing = Dual { v, d: dot(w, *n, *i) };
            let two = w.constant_dual(2.0);
            let twice = w.mul(two, facing);
            let along = w.mul(twice, *n);
            same(w.sub(*i, along).d)
        }
        (L::Refract, [i, n, eta]) => same(refract(w, *i, *n, *eta)),
        (L::TransformPoint, [m, p]) => same(transform_point(w, m.v, *p, result)),
        (L::TransformVector | L::TransformNormal, [m, x]) => {
            same(x.d.map(|d| d.map(|d| w.lane(op, &[m.v, d]))))
        }
        (L::Luminance | L::YiqToRgb | L::XyzToRgb | L::RgbToYiq | L::RgbToXyz, [c]) => {
            same(c.d.map(|d| d.map(|d| w.lane(op, &[d]))))
        }
        (L::LuminanceIn | L::XyzToRgbIn | L::RgbToXyzIn, [c, system]) => {
            same(c.d.map(|d| d.map(|d| w.lane(op, &[d, system.v]))))
        }
        _ => return None,
    })
}

fn component(w: &mut Writer<'_>, v: ValueId, at: usize) -> ValueId {
    w.lane([LaneOp::X, LaneOp::Y, LaneOp::Z][at], &[v])
}

/// The components of a tangent, added from the left.
fn total(w: &mut Writer<'_>, d: Tangent) -> Tangent {
    d.map(|d| {
        let [x, y, z] = [0, 1, 2].map(|at| component(w, d, at));
        let sum = w.lane(LaneOp::FAdd, &[x, y]);
        w.lane(LaneOp::FAdd, &[sum, z])
    })
}

fn dot(w: &mut Writer<'_>, a: Dual, b: Dual) -> [Tangent; 2] {
    let products = w.mul(a, b);
    products.d.map(|d| total(w, d))
}

/// The components in another order.
fn turned(w: &mut Writer<'_>, a: Dual, order: [usize; 3]) -> Dual {
    let turn = |w: &mut Writer<'_>, v: ValueId| {
        let [x, y, z] = order.map(|at| component(w, v, at));
        w.lane(LaneOp::Triple, &[x, y, z])
    };
    Dual { v: turn(w, a.v), d: a.d.map(|d| d.map(|d| turn(w, d))) }
}

fn cross(w: &mut Writer<'_>, a: Dual, b: Dual) -> [Tangent; 2] {
    let (a1, b1) = (turned(w, a, [1, 2, 0]), turned(w, b, [2, 0, 1]));
    let (a2, b2) = (turned(w, a, [2, 0, 1]), turned(w, b, [1, 2, 0]));
    let (left, right) = (w.mul(a1, b1), w.mul(a2, b2));
    w.sub(left, right).d
}

/// The form with derivatives does not rescue tiny vectors from underflow.
fn length(w: &mut Writer<'_>, a: Dual) -> Dual {
    let squared = w.lane(LaneOp::Dot, &[a.v, a.v]);
    let d = dot(w, a, a);
    let root = w.lane(LaneOp::Sqrt, &[squared]);
    w.root(root, Dual { v: squared, d })
}

fn refract(w: &mut Writer<'_>, i: Dual, n: Dual, eta: Dual) -> [Tangent; 2] {
    let v = w.lane(LaneOp::Dot, &[i.v, n.v]);
    let facing = Dual { v, d: dot(w, i, n) };
    let one = w.constant_dual(1.0);
    let square = w.mul(facing, facing);
    let rest = w.sub(one, square);
    let ratio = w.mul(eta, eta);
    let bent = w.mul(ratio, rest);
    let k = w.sub(one, bent);
    let v = w.lane(LaneOp::Sqrt, &[k.v]);
    let root = w.root(v, k);
    let ahead = w.mul(eta, i);
    let side = w.mul(eta, facing);
    let side = w.add(side, root);
    let side = w.mul(n, side);
    let out = w.sub(ahead, side);
    let zero = w.float(0.0);
    let passes = w.lane(LaneOp::Step, &[zero, k.v]);
    w.select_tangents([None; 2], out.d, passes)
}

/// The matrix carries none. `q` is the point after the perspective division.
fn transform_point(w: &mut Writer<'_>, m: ValueId, p: Dual, q: ValueId) -> [Tangent; 2] {
    use LaneOp as L;
    let column = |w: &mut Writer<'_>, row: i32| {
        let (row, last) = (w.int(row), w.int(3));
        w.lane(L::MGet, &[m, row, last])
    };
    let [x, y, z, t] = [0, 1, 2, 3].map(|row| column(w, row));
    let weights = w.lane(L::Triple, &[x, y, z]);
    let scale = w.lane(L::Dot, &[p.v, weights]);
    let scale = w.lane(L::FAdd, &[scale, t]);
    p.d.map(|d| {
        d.map(|d| {
            let ahead = w.lane(L::TransformVector, &[m, d]);
            let change = w.lane(L::Dot, &[d, weights]);
            let back = w.lane(L::FMul, &[q, change]);
            let numerator = w.lane(L::FSub, &[ahead, back]);
            w.lane(L::FDiv, &[numerator, scale])
        })
    })
}
