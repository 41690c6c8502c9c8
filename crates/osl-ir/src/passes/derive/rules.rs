//! The derivative rules of lane operations (OSL language specification, chapter on derivatives).

use super::Writer;
use super::dual::Dual;
use crate::ir::{LaneOp, ValueId};
use crate::numeric::known::Known;

/// Whether an operation hands on the tangents of its arguments. The others have none.
pub(super) fn has_rule(op: LaneOp) -> bool {
    use LaneOp as L;
    let pieces = matches!(op, L::Floor | L::Ceil | L::Trunc | L::Round | L::Sign | L::Step | L::Logb);
    let float = !matches!(op.shape().result, crate::ir::Kind::Int | crate::ir::Kind::Str);
    let matrix = matches!(op.shape().result, crate::ir::Kind::Matrix) || matches!(op, L::MGet | L::MDet);
    float && !pieces && !matrix && !matches!(op, L::ToFloat)
}

/// Value and tangents of `result = op(args)`; the value is `result` itself unless the form with derivatives
/// computes it in another way.
pub(super) fn rule(w: &mut Writer<'_>, op: LaneOp, args: &[Dual], result: ValueId) -> Option<Dual> {
    use LaneOp as L;
    let same = |d| Dual { v: result, d };
    Some(match (op, args) {
        (L::FAdd, [a, b]) => same([0, 1].map(|i| w.sum(a.d[i], b.d[i]))),
        (L::FSub, [a, b]) => same([0, 1].map(|i| w.difference(a.d[i], b.d[i]))),
        (L::FNeg, [a]) => same(a.d.map(|d| d.map(|d| w.lane(L::FNeg, &[d])))),
        (L::FMul, [a, b]) => w.mul_with(result, *a, *b),
        (L::FDiv | L::FDivBy, [a, b]) => w.guarded_with(result, *a, *b),
        (L::Mod | L::ModBy, [a, b]) => {
            let quotient = w.lane(L::FDiv, &[a.v, b.v]);
            let whole = w.lane(L::Floor, &[quotient]);
            same([0, 1].map(|i| {
                let change = w.scaled(b.d[i], whole);
                w.difference(a.d[i], change)
            }))
        }
        (L::Fmod | L::FmodExact, [a, _]) => same(a.d),
        (L::Mix, [a, b, t]) => {
            let one = w.float(1.0);
            let rest = w.lane(L::FSub, &[one, t.v]);
            same([0, 1].map(|i| {
                let first = w.scaled(a.d[i], rest);
                let second = w.scaled(t.d[i], a.v);
                let third = w.scaled(t.d[i], b.v);
                let fourth = w.scaled(b.d[i], t.v);
                let left = w.difference(first, second);
                let left = w.sum(left, third);
                w.sum(left, fourth)
            }))
        }
        (L::Pow, [u, v]) => power(w, *u, *v),
        (L::Atan2, [y, x]) => arc_tangent(w, result, *y, *x),
        (L::Abs, [x]) => {
            let zero = w.float(0.0);
            let positive = w.lane(L::Step, &[zero, x.v]);
            let turned = x.d.map(|d| d.map(|d| w.lane(L::FNeg, &[d])));
            same(w.select_tangents(turned, x.d, positive))
        }
        (L::Min, [x, y]) => same(minimum(w, *x, *y)),
        (L::Max, [x, y]) => same(maximum(w, *x, *y)),
        (L::Clamp, [x, low, high]) => same(clamp(w, *x, *low, *high)),
        (L::Select, [a, b, c]) => same(w.select_tangents(a.d, b.d, c.v)),
        (L::Choose, [c, a, b]) => same([0, 1].map(|i| {
            if a.d[i].is_none() && b.d[i].is_none() {
                return None;
            }
            let zero = w.float(0.0);
            Some(w.lane(L::Choose, &[c.v, a.d[i].unwrap_or(zero), b.d[i].unwrap_or(zero)]))
        })),
        (L::Smoothstep, [low, high, x]) => smoothstep(w, *low, *high, *x),
        (L::Linearstep, [low, high, x]) => {
            let d = clamp(w, *x, *low, *high);
            let v = w.lane(L::Clamp, &[x.v, low.v, high.v]);
            let above = w.sub(Dual { v, d }, *low);
            let width = w.sub(*high, *low);
            let quotient = w.guarded(above, width);
            same(quotient.d)
        }
        (L::Triple | L::Splat | L::X | L::Y | L::Z | L::Get | L::Set, _) => same(parts(w, op, args)),
        (_, [x]) if op.shape().per_component => {
            let slope = slope(w, op, x.v, result)?;
            w.chain(result, slope, *x)
        }
        _ => return super::vectors::rule(w, op, args, result),
    })
}

/// The slope of a function of one number at `x`, where its value is `f`.
fn slope(w: &mut Writer<'_>, op: LaneOp, x: ValueId, f: ValueId) -> Option<ValueId> {
    use LaneOp as L;
    let squared = |w: &mut Writer<'_>, x: ValueId| w.lane(L::FMul, &[x, x]);
    let over = |w: &mut Writer<'_>, a: f32, b: ValueId| {
        let a = w.float(a);
        w.lane(L::FDivBy, &[a, b])
    };
    Some(match op {
        L::Sin => w.lane(L::Cos, &[x]),
        L::Cos => {
            let sin = w.lane(L::Sin, &[x]);
            w.lane(L::FNeg, &[sin])
        }
        L::Tan | L::Tanh => {
            let cos = w.lane(if op == L::Tan { L::Cos } else { L::Cosh }, &[x]);
            let square = squared(w, cos);
            over(w, 1.0, square)
        }
        L::Asin | L::Acos => {
            let minus = w.lane(L::FNeg, &[x]);
            let square = w.lane(L::FMul, &[minus, x]);
            let one = w.float(1.0);
            let rest = w.lane(L::FAdd, &[square, one]);
            let root = w.lane(L::Sqrt, &[rest]);
            let slope = over(w, if op == L::Asin { 1.0 } else { -1.0 }, root);
            let size = w.lane(L::Abs, &[x]);
            let outside = w.lane(L::Step, &[one, size]);
            let zero = w.float(0.0);
            w.select(slope, zero, outside)
        }
        L::Atan => {
            let square = squared(w, x);
            let one = w.float(1.0);
            let sum = w.lane(L::FAdd, &[square, one]);
            over(w, 1.0, sum)
        }
        L::Sinh => w.lane(L::Cosh, &[x]),
        L::Cosh => w.lane(L::Sinh, &[x]),
        L::Log => logarithm(w, x),
        L::Log2 | L::Log10 => {
            let base = w.known(if op == L::Log2 { Known::Ln2 } else { Known::Ln10 });
            let scaled = w.lane(L::FMul, &[x, base]);
            logarithm(w, scaled)
        }
        L::Exp => f,
        L::Exp2 => {
            let ln2 = w.known(Known::Ln2);
            w.lane(L::FMul, &[f, ln2])
        }
        L::SrgbToLinear => {
            let (offset, scale, exponent) =
                (w.known(Known::SrgbOffset), w.known(Known::SrgbScale), w.known(Known::SrgbPower));
            let base = w.lane(L::FAdd, &[x, offset]);
            let base = w.lane(L::FMul, &[base, scale]);
            let power = w.lane(L::Pow, &[base, exponent]);
            let factor = w.known(Known::SrgbFactor);
            let (straight, edge) = (w.known(Known::SrgbStraight), w.known(Known::SrgbEdge));
            let curved = w.lane(L::FMul, &[power, factor]);
            let not_above = w.lane(L::Step, &[x, edge]);
            w.select(curved, straight, not_above)
        }
        L::LinearToSrgb => {
            let (exponent, factor) = (w.known(Known::LinearPower), w.known(Known::LinearFactor));
            let power = w.lane(L::Pow, &[x, exponent]);
            let curved = w.lane(L::FMul, &[power, factor]);
            let (straight, edge) = (w.known(Known::LinearStraight), w.known(Known::LinearEdge));
            let not_above = w.lane(L::Step, &[x, edge]);
            w.select(curved, straight, not_above)
        }
        L::Expm1 => w.lane(L::Exp, &[x]),
        L::Erf | L::Erfc => {
            let minus = w.lane(L::FNeg, &[x]);
            let square = w.lane(L::FMul, &[minus, x]);
            let bell = w.lane(L::Exp, &[square]);
            let factor = if op == L::Erf { Known::TwoOverRootPi } else { Known::MinusTwoOverRootPi };
            let factor = w.known(factor);
            w.lane(L::FMul, &[bell, factor])
        }
        L::Sqrt => {
            let slope = over(w, 0.5, f);
            w.where_positive(x, slope)
        }
        L::InverseSqrt => {
            let half = w.float(-0.5);
            let scaled = w.lane(L::FMul, &[half, f]);
            let slope = w.lane(L::FDivBy, &[scaled, x]);
            w.where_positive(x, slope)
        }
        L::Cbrt => {
            let three = w.float(3.0);
            let scaled = w.lane(L::FMul, &[three, f]);
            let square = w.lane(L::FMul, &[scaled, f]);
            let slope = over(w, 1.0, square);
            let zero = w.float(0.0);
            w.select(zero, slope, f)
        }
        _ => return None,
    })
}

/// `1 / x`, or 0 below the normal numbers.
fn logarithm(w: &mut Writer<'_>, x: ValueId) -> ValueId {
    let one = w.float(1.0);
    let slope = w.lane(LaneOp::FDivBy, &[one, x]);
    let smallest = w.float(f32::MIN_POSITIVE);
    let normal = w.lane(LaneOp::Step, &[smallest, x]);
    let zero = w.float(0.0);
    w.select(zero, slope, normal)
}

/// `u` to the `v`, computed as `u^(v-1) * u`, which changes last bits and makes `pow(0, 0)` 0.
fn power(w: &mut Writer<'_>, u: Dual, v: Dual) -> Dual {
    use LaneOp as L;
    let one = w.float(1.0);
    let less = w.lane(L::FSub, &[v.v, one]);
    let below = w.lane(L::Pow, &[u.v, less]);
    let value = w.lane(L::FMul, &[below, u.v]);
    let by_u = w.lane(L::FMul, &[v.v, below]);
    let tangent = |w: &mut Writer<'_>, i: usize| {
        let left = w.scaled(u.d[i], by_u);
        let right = v.d[i].map(|d| {
            let log = w.lane(L::Log, &[u.v]);
            let log = w.where_positive(u.v, log);
            let by_v = w.lane(L::FMul, &[log, value]);
            w.lane(L::FMul, &[by_v, d])
        });
        w.sum(left, right)
    };
    Dual { v: value, d: [tangent(w, 0), tangent(w, 1)] }
}

/// The reference's own rule, whose signs are the opposite of the mathematical derivative's.
fn arc_tangent(w: &mut Writer<'_>, result: ValueId, y: Dual, x: Dual) -> Dual {
    use LaneOp as L;
    let (xx, yy) = (w.lane(L::FMul, &[x.v, x.v]), w.lane(L::FMul, &[y.v, y.v]));
    let squared = w.lane(L::FAdd, &[xx, yy]);
    let one = w.float(1.0);
    let k = w.lane(L::FDiv, &[one, squared]);
    let minus = w.lane(L::FNeg, &[x.v]);
    let by_y = w.lane(L::FMul, &[minus, k]);
    let by_x = w.lane(L::FMul, &[y.v, k]);
    let tangent = |w: &mut Writer<'_>, i: usize| {
        let left = w.scaled(y.d[i], by_y);
        let right = w.scaled(x.d[i], by_x);
        w.sum(left, right)
    };
    Dual { v: result, d: [tangent(w, 0), tangent(w, 1)] }
}

fn minimum(w: &mut Writer<'_>, x: Dual, y: Dual) -> [Option<ValueId>; 2] {
    let first = w.lane(LaneOp::Step, &[x.v, y.v]);
    w.select_tangents(y.d, x.d, first)
}

fn maximum(w: &mut Writer<'_>, x: Dual, y: Dual) -> [Option<ValueId>; 2] {
    let second = w.lane(LaneOp::Step, &[x.v, y.v]);
    w.select_tangents(x.d, y.d, second)
}

fn clamp(w: &mut Writer<'_>, x: Dual, low: Dual, high: Dual) -> [Option<ValueId>; 2] {
    let v = w.lane(LaneOp::Min, &[x.v, high.v]);
    let d = minimum(w, x, high);
    maximum(w, Dual { v, d }, low)
}

/// `((3 - 2t) * t) * t` by the product rule: other last bits than the form without derivatives.
fn smoothstep(w: &mut Writer<'_>, low: Dual, high: Dual, x: Dual) -> Dual {
    use LaneOp as L;
    let above = w.sub(x, low);
    let width = w.sub(high, low);
    let t = w.plain_quotient(above, width);
    let two = w.constant_dual(2.0);
    let three = w.constant_dual(3.0);
    let twice = w.mul(t, two);
    let weight = w.sub(three, twice);
    let product = w.mul(weight, t);
    let inner = w.mul(product, t);
    let (zero, one) = (w.float(0.0), w.float(1.0));
    let started = w.lane(L::Step, &[low.v, x.v]);
    let ended = w.lane(L::Step, &[high.v, x.v]);
    let v = w.select(inner.v, one, ended);
    let v = w.select(zero, v, started);
    let d = w.select_tangents(inner.d, [None; 2], ended);
    Dual { v, d: w.select_tangents([None; 2], d, started) }
}

/// Putting triples together and taking them apart commutes with taking tangents.
fn parts(w: &mut Writer<'_>, op: LaneOp, args: &[Dual]) -> [Option<ValueId>; 2] {
    let keep = |at: usize| matches!((op, at), (LaneOp::Get | LaneOp::Set, 1));
    [0, 1].map(|i| {
        if args.iter().all(|a| a.d[i].is_none()) {
            return None;
        }
        let mut list = Vec::new();
        for (at, arg) in args.iter().enumerate() {
            list.push(if keep(at) { arg.v } else { w.or_zero(arg.d[i], arg.v) });
        }
        Some(w.lane(op, &list))
    })
}
