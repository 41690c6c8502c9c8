//! The derivative rules of lane operations (OSL language specification, chapter on derivatives).
//!
//! A tangent of `None` is zero, and the rules leave out what it would only multiply.

use super::derive::Writer;
use crate::ir::{Axis, LaneOp, ValueId};

/// Whether an operation hands on the tangents of its arguments. The others count as constant.
pub(super) fn has_rule(op: LaneOp) -> bool {
    use LaneOp as L;
    matches!(
        op,
        L::FAdd
            | L::FSub
            | L::FMul
            | L::FDiv
            | L::FDivBy
            | L::FNeg
            | L::Mod
            | L::Fmod
            | L::Abs
            | L::Min
            | L::Max
            | L::Clamp
            | L::Mix
            | L::Choose
            | L::Select
            | L::Triple
            | L::Splat
            | L::X
            | L::Y
            | L::Z
            | L::Get
            | L::Set
            | L::Sin
            | L::Cos
            | L::Exp
            | L::Sqrt
            | L::Dot
            | L::Length
            | L::Distance
            | L::TransformPoint
            | L::TransformVector
    )
}

/// The tangent of `result = op(args)`.
pub(super) fn tangent(
    w: &mut Writer<'_>,
    op: LaneOp,
    args: &[ValueId],
    result: ValueId,
    axis: Axis,
) -> Option<ValueId> {
    use LaneOp as L;
    let d: Vec<Option<ValueId>> = args.iter().map(|a| w.tangent(*a, axis)).collect();
    if d.iter().all(Option::is_none) {
        return None;
    }
    match (op, args) {
        (L::FAdd, _) => sum(w, d[0], d[1]),
        (L::FSub, _) => difference(w, d[0], d[1]),
        (L::FNeg, _) => d[0].map(|d| w.lane(L::FNeg, &[d])),
        (L::FMul, [a, b]) => {
            let left = product(w, Some(*a), d[1]);
            let right = product(w, d[0], Some(*b));
            sum(w, left, right)
        }
        (L::FDiv | L::FDivBy, [_, b]) => {
            let change = product(w, Some(result), d[1]);
            let numerator = difference(w, d[0], change)?;
            let one = w.float(1.0);
            let reciprocal = w.lane(L::FDiv, &[one, *b]);
            Some(w.lane(L::FMul, &[reciprocal, numerator]))
        }
        (L::Mod, [a, b]) => {
            let change = d[1].map(|db| {
                let quotient = w.lane(L::FDiv, &[*a, *b]);
                let whole = w.lane(L::Floor, &[quotient]);
                w.lane(L::FMul, &[db, whole])
            });
            difference(w, d[0], change)
        }
        (L::Fmod, _) => d[0],
        (L::Sin, [x]) => {
            let cos = w.lane(L::Cos, &[*x]);
            product(w, Some(cos), d[0])
        }
        (L::Cos, [x]) => {
            let sin = w.lane(L::Sin, &[*x]);
            let minus = w.lane(L::FNeg, &[sin]);
            product(w, Some(minus), d[0])
        }
        (L::Exp, _) => product(w, Some(result), d[0]),
        (L::Sqrt, _) => {
            let half = w.float(0.5);
            let slope = w.lane(L::FDiv, &[half, result]);
            product(w, Some(slope), d[0])
        }
        (L::Mix, [a, b, t]) => {
            let one = w.float(1.0);
            let rest = w.lane(L::FSub, &[one, *t]);
            let first = product(w, d[0], Some(rest));
            let second = product(w, Some(*a), d[2]);
            let third = product(w, Some(*b), d[2]);
            let fourth = product(w, d[1], Some(*t));
            let left = difference(w, first, second);
            let left = sum(w, left, third);
            sum(w, left, fourth)
        }
        (L::Abs | L::Min | L::Max | L::Clamp | L::Choose | L::Select, _) => picked(w, op, args, axis),
        (L::Triple | L::Splat | L::X | L::Y | L::Z | L::Get | L::Set, _) => parts(w, op, args, axis),
        _ => vectors(w, op, args, &d, result),
    }
}

fn sum(w: &mut Writer<'_>, a: Option<ValueId>, b: Option<ValueId>) -> Option<ValueId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(w.lane(LaneOp::FAdd, &[a, b])),
        (a, b) => a.or(b),
    }
}

fn difference(w: &mut Writer<'_>, a: Option<ValueId>, b: Option<ValueId>) -> Option<ValueId> {
    match (a, b) {
        (Some(a), Some(b)) => Some(w.lane(LaneOp::FSub, &[a, b])),
        (None, Some(b)) => Some(w.lane(LaneOp::FNeg, &[b])),
        (a, None) => a,
    }
}

fn product(w: &mut Writer<'_>, a: Option<ValueId>, b: Option<ValueId>) -> Option<ValueId> {
    Some(w.lane(LaneOp::FMul, &[a?, b?]))
}

/// Functions that pick one of their arguments take its tangent.
fn picked(w: &mut Writer<'_>, op: LaneOp, args: &[ValueId], axis: Axis) -> Option<ValueId> {
    use LaneOp as L;
    let d = |w: &mut Writer<'_>, at: usize| w.tangent_or_zero(args[at], axis);
    // Not 0 exactly where x is above y, in each component.
    let above = |w: &mut Writer<'_>, x: ValueId, y: ValueId| {
        let difference = w.lane(L::FSub, &[x, y]);
        let zero = w.float(0.0);
        w.lane(L::Max, &[difference, zero])
    };
    Some(match op {
        L::Abs => {
            let zero = w.float(0.0);
            let negative = above(w, zero, args[0]);
            let tangent = d(w, 0);
            let turned = w.lane(L::FNeg, &[tangent]);
            w.lane(L::Select, &[tangent, turned, negative])
        }
        L::Min => {
            let second = above(w, args[0], args[1]);
            let (a, b) = (d(w, 0), d(w, 1));
            w.lane(L::Select, &[a, b, second])
        }
        L::Max => {
            let first = above(w, args[0], args[1]);
            let (a, b) = (d(w, 0), d(w, 1));
            w.lane(L::Select, &[b, a, first])
        }
        L::Clamp => {
            let over = above(w, args[0], args[2]);
            let limited = w.lane(L::Min, &[args[0], args[2]]);
            let inside = above(w, limited, args[1]);
            let (x, low, high) = (d(w, 0), d(w, 1), d(w, 2));
            let below = w.lane(L::Select, &[x, high, over]);
            w.lane(L::Select, &[low, below, inside])
        }
        L::Choose => {
            let (a, b) = (d(w, 1), d(w, 2));
            w.lane(L::Choose, &[args[0], a, b])
        }
        _ => {
            let (a, b) = (d(w, 0), d(w, 1));
            w.lane(L::Select, &[a, b, args[2]])
        }
    })
}

/// Putting triples together and taking them apart commutes with taking tangents.
fn parts(w: &mut Writer<'_>, op: LaneOp, args: &[ValueId], axis: Axis) -> Option<ValueId> {
    let keep = |at: usize| matches!((op, at), (LaneOp::Get | LaneOp::Set, 1));
    let mut list = Vec::new();
    for (at, arg) in args.iter().enumerate() {
        list.push(if keep(at) { *arg } else { w.tangent_or_zero(*arg, axis) });
    }
    Some(w.lane(op, &list))
}

fn vectors(
    w: &mut Writer<'_>,
    op: LaneOp,
    args: &[ValueId],
    d: &[Option<ValueId>],
    result: ValueId,
) -> Option<ValueId> {
    use LaneOp as L;
    let dot = |w: &mut Writer<'_>, a: Option<ValueId>, b: Option<ValueId>| Some(w.lane(L::Dot, &[a?, b?]));
    match (op, args) {
        (L::Dot, [a, b]) => {
            let left = dot(w, Some(*a), d[1]);
            let right = dot(w, d[0], Some(*b));
            sum(w, left, right)
        }
        (L::Length, [v]) => {
            let along = dot(w, Some(*v), d[0])?;
            Some(w.lane(L::FDiv, &[along, result]))
        }
        (L::Distance, [a, b]) => {
            let way = w.lane(L::FSub, &[*a, *b]);
            let change = difference(w, d[0], d[1]);
            let along = dot(w, Some(way), change)?;
            Some(w.lane(L::FDiv, &[along, result]))
        }
        // The matrix carries none; without perspective a point moves as a vector does.
        (L::TransformPoint | L::TransformVector, [m, _]) => {
            d[1].map(|d| w.lane(L::TransformVector, &[*m, d]))
        }
        _ => None,
    }
}
