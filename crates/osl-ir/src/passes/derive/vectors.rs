//! The derivative rules of vectors, matrices and colors.

use super::super::rewrite::Rewrite;
use super::Writer;
use super::dual::{Call, Dual, Tangent};
use crate::ir::{LaneOp as L, ValueId};

pub(super) fn dot(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    call.with(dot_tangents(w, a, b))
}

pub(super) fn cross(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    let (a1, b1) = (turned(w, a, [1, 2, 0]), turned(w, b, [2, 0, 1]));
    let (a2, b2) = (turned(w, a, [2, 0, 1]), turned(w, b, [1, 2, 0]));
    let (left, right) = (w.mul(a1, b1), w.mul(a2, b2));
    call.with(w.sub(left, right).d)
}

pub(super) fn length(w: &mut Writer<'_>, [a]: [Dual; 1], _: Call) -> Dual {
    size(w, a)
}

pub(super) fn distance(w: &mut Writer<'_>, [a, b]: [Dual; 2], _: Call) -> Dual {
    let way = w.sub(a, b);
    size(w, way)
}

pub(super) fn normalize(w: &mut Writer<'_>, [a]: [Dual; 1], call: Call) -> Dual {
    let size = size(w, a);
    let one = w.constant_dual(1.0);
    let inverse = w.guarded(one, size);
    call.with(w.mul(a, inverse).d)
}

pub(super) fn reflect(w: &mut Writer<'_>, [i, n]: [Dual; 2], call: Call) -> Dual {
    let v = w.lane(L::Dot, &[n.v, i.v]);
    let facing = Dual { v, d: dot_tangents(w, n, i) };
    let two = w.constant_dual(2.0);
    let twice = w.mul(two, facing);
    let along = w.mul(twice, n);
    call.with(w.sub(i, along).d)
}

pub(super) fn refract(w: &mut Writer<'_>, [i, n, eta]: [Dual; 3], call: Call) -> Dual {
    let v = w.lane(L::Dot, &[i.v, n.v]);
    let facing = Dual { v, d: dot_tangents(w, i, n) };
    let one = w.constant_dual(1.0);
    let square = w.mul(facing, facing);
    let rest = w.sub(one, square);
    let ratio = w.mul(eta, eta);
    let bent = w.mul(ratio, rest);
    let k = w.sub(one, bent);
    let v = w.lane(L::Sqrt, &[k.v]);
    let root = w.root(v, k);
    let ahead = w.mul(eta, i);
    let side = w.mul(eta, facing);
    let side = w.add(side, root);
    let side = w.mul(n, side);
    let out = w.sub(ahead, side);
    let zero = w.float(0.0);
    let passes = w.lane(L::Step, &[zero, k.v]);
    call.with(w.select_tangents([None; 2], out.d, passes))
}

/// The matrix has no derivatives. The result is the point after the perspective division.
pub(super) fn transform_point(w: &mut Writer<'_>, [m, p]: [Dual; 2], call: Call) -> Dual {
    let column = |w: &mut Writer<'_>, row: i32| {
        let (row, last) = (w.int(row), w.int(3));
        w.lane(L::MGet, &[m.v, row, last])
    };
    let [x, y, z, t] = [0, 1, 2, 3].map(|row| column(w, row));
    let weights = w.lane(L::Triple, &[x, y, z]);
    let scale = w.lane(L::Dot, &[p.v, weights]);
    let scale = w.lane(L::FAdd, &[scale, t]);
    call.with(p.d.map(|d| {
        d.map(|d| {
            let ahead = w.lane(L::TransformVector, &[m.v, d]);
            let change = w.lane(L::Dot, &[d, weights]);
            let back = w.lane(L::FMul, &[call.result, change]);
            let numerator = w.lane(L::FSub, &[ahead, back]);
            w.lane(L::FDiv, &[numerator, scale])
        })
    }))
}

/// The transformation of the derivatives; the matrix has none.
pub(super) fn transform(w: &mut Writer<'_>, [m, x]: [Dual; 2], call: Call) -> Dual {
    call.with(x.d.map(|d| d.map(|d| w.lane(call.op, &[m.v, d]))))
}

/// The same operation on the derivatives.
pub(super) fn linear(w: &mut Writer<'_>, [c]: [Dual; 1], call: Call) -> Dual {
    call.with(c.d.map(|d| d.map(|d| w.lane(call.op, &[d]))))
}

/// The same in an RGB system.
pub(super) fn linear_in(w: &mut Writer<'_>, [c, system]: [Dual; 2], call: Call) -> Dual {
    call.with(c.d.map(|d| d.map(|d| w.lane(call.op, &[d, system.v]))))
}

/// Derivatives by a separate operation, which takes the color, its derivative, and the number of the
/// conversion.
pub(super) fn named(w: &mut Writer<'_>, [c, number]: [Dual; 2], call: Call) -> Dual {
    call.with(c.d.map(|d| d.map(|d| w.lane(L::ConvertNamedTangent, &[c.v, d, number.v]))))
}

/// Derivatives by a separate operation, which takes the color and its derivative.
macro_rules! by_tangent {
    ($($rule:ident $op:ident;)*) => {$(
        pub(super) fn $rule(w: &mut Writer<'_>, [c]: [Dual; 1], call: Call) -> Dual {
            call.with(c.d.map(|d| d.map(|d| w.lane(L::$op, &[c.v, d]))))
        }
    )*};
}

by_tangent! {
    hsv_to_rgb HsvToRgbTangent;
    rgb_to_hsv RgbToHsvTangent;
    hsl_to_rgb HslToRgbTangent;
    rgb_to_hsl RgbToHslTangent;
    xyy_to_xyz XyyToXyzTangent;
    xyz_to_xyy XyzToXyyTangent;
}

fn component(w: &mut Writer<'_>, v: ValueId, at: usize) -> ValueId {
    w.lane([L::X, L::Y, L::Z][at], &[v])
}

/// The components of a derivative, added from the left.
fn total(w: &mut Writer<'_>, d: Tangent) -> Tangent {
    d.map(|d| {
        let [x, y, z] = [0, 1, 2].map(|at| component(w, d, at));
        let sum = w.lane(L::FAdd, &[x, y]);
        w.lane(L::FAdd, &[sum, z])
    })
}

fn dot_tangents(w: &mut Writer<'_>, a: Dual, b: Dual) -> [Tangent; 2] {
    let products = w.mul(a, b);
    products.d.map(|d| total(w, d))
}

/// The components in another order.
fn turned(w: &mut Writer<'_>, a: Dual, order: [usize; 3]) -> Dual {
    let turn = |w: &mut Writer<'_>, v: ValueId| {
        let [x, y, z] = order.map(|at| component(w, v, at));
        w.lane(L::Triple, &[x, y, z])
    };
    Dual { v: turn(w, a.v), d: a.d.map(|d| d.map(|d| turn(w, d))) }
}

/// The form with derivatives does not protect tiny vectors from underflow.
fn size(w: &mut Writer<'_>, a: Dual) -> Dual {
    let squared = w.lane(L::Dot, &[a.v, a.v]);
    let d = dot_tangents(w, a, a);
    let root = w.lane(L::Sqrt, &[squared]);
    w.root(root, Dual { v: squared, d })
}
