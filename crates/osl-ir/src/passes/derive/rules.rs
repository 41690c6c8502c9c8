//! The derivative rules of lane operations (OSL language specification, chapter on derivatives).
//!
//! The list of operations names the rule of each: a function of this file, of `elementary` or of `vectors`. A
//! rule gets all arguments of the operation with their derivatives, and returns the value with its
//! derivatives. The value is the result of the operation, unless the form with derivatives computes it
//! differently.

use super::super::rewrite::Rewrite;
use super::Writer;
use super::dual::{Call, Dual, Tangent};
use super::elementary::{
    acos, arc_tangent, asin, atan, cbrt, cos, cosh, erf, erfc, exp, exp2, expm1, inversesqrt, linear_to_srgb,
    log, log2, log10, power, sin, sinh, sqrt, srgb_to_linear, tan, tanh,
};
use super::vectors::{
    cross, distance, dot, hsl_to_rgb, hsv_to_rgb, length, linear, linear_in, named, normalize, reflect,
    refract, rgb_to_hsl, rgb_to_hsv, transform, transform_point, xyy_to_xyz, xyz_to_xyy,
};
use crate::ir::{Derivative, LaneOp, ValueId};

/// Whether an operation needs the derivatives of its arguments. The others have no derivatives.
pub(super) fn asks(op: LaneOp) -> bool {
    matches!(op.derivative(), Derivative::Zero | Derivative::Rule)
}

/// Calls a rule with the number of arguments that it takes.
fn apply<const N: usize>(
    rule: fn(&mut Writer<'_>, [Dual; N], Call) -> Dual,
    w: &mut Writer<'_>,
    args: &[Dual],
    call: Call,
) -> Option<Dual> {
    Some(rule(w, args.try_into().ok()?, call))
}

/// Number of arguments in a line.
macro_rules! count {
    ($($arg:ident)*) => {
        [$(stringify!($arg)),*].len()
    };
}

macro_rules! call {
    (none $($rest:tt)*) => {
        None
    };
    (zero $($rest:tt)*) => {
        None
    };
    (late $($rest:tt)*) => {
        None
    };
    ($rule:ident $count:expr, $w:ident, $args:ident, $call:ident) => {
        apply::<{ $count }>($rule, $w, $args, $call)
    };
}

macro_rules! stamp {
    ($($name:ident $text:literal $class:ident ($($arg:ident),*) -> $ret:ident, $module:ident::$body:ident,
        $cost:ident $continuity:ident $precision:ident $domain:ident, $derivative:ident;)*) => {
        /// Value and derivatives of `result = op(args)`; `None` without derivatives.
        pub(super) fn derivative_of(w: &mut Writer<'_>, op: LaneOp, args: &[Dual], result: ValueId) -> Option<Dual> {
            let call = Call { op, result };
            match op {
                $(LaneOp::$name => call!($derivative count!($($arg)*), w, args, call)),*
            }
        }
    };
}

osl_numeric::for_each_lane_op!(stamp);

fn sum(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    call.with([0, 1].map(|i| w.sum(a.d[i], b.d[i])))
}

fn difference(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    call.with([0, 1].map(|i| w.difference(a.d[i], b.d[i])))
}

fn negative(w: &mut Writer<'_>, [a]: [Dual; 1], call: Call) -> Dual {
    call.with(a.d.map(|d| d.map(|d| w.lane(LaneOp::FNeg, &[d]))))
}

fn product(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    w.mul_with(call.result, a, b)
}

fn quotient(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    w.guarded_with(call.result, a, b)
}

fn modulo(w: &mut Writer<'_>, [a, b]: [Dual; 2], call: Call) -> Dual {
    let quotient = w.lane(LaneOp::FDiv, &[a.v, b.v]);
    let whole = w.lane(LaneOp::Floor, &[quotient]);
    call.with([0, 1].map(|i| {
        let change = w.scaled(b.d[i], whole);
        w.difference(a.d[i], change)
    }))
}

/// The derivatives of the first argument only.
fn first(_: &mut Writer<'_>, [a, _]: [Dual; 2], call: Call) -> Dual {
    call.with(a.d)
}

fn mix(w: &mut Writer<'_>, [a, b, t]: [Dual; 3], call: Call) -> Dual {
    let one = w.float(1.0);
    let rest = w.lane(LaneOp::FSub, &[one, t.v]);
    call.with([0, 1].map(|i| {
        let first = w.scaled(a.d[i], rest);
        let second = w.scaled(t.d[i], a.v);
        let third = w.scaled(t.d[i], b.v);
        let fourth = w.scaled(b.d[i], t.v);
        let left = w.difference(first, second);
        let left = w.sum(left, third);
        w.sum(left, fourth)
    }))
}

fn magnitude(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let zero = w.float(0.0);
    let positive = w.lane(LaneOp::Step, &[zero, x.v]);
    let turned = x.d.map(|d| d.map(|d| w.lane(LaneOp::FNeg, &[d])));
    call.with(w.select_tangents(turned, x.d, positive))
}

fn minimum(w: &mut Writer<'_>, [x, y]: [Dual; 2], call: Call) -> Dual {
    call.with(smaller(w, x, y))
}

fn maximum(w: &mut Writer<'_>, [x, y]: [Dual; 2], call: Call) -> Dual {
    call.with(larger(w, x, y))
}

fn clamp(w: &mut Writer<'_>, [x, low, high]: [Dual; 3], call: Call) -> Dual {
    call.with(between(w, x, low, high))
}

fn select(w: &mut Writer<'_>, [a, b, c]: [Dual; 3], call: Call) -> Dual {
    call.with(w.select_tangents(a.d, b.d, c.v))
}

fn choose(w: &mut Writer<'_>, [c, a, b]: [Dual; 3], call: Call) -> Dual {
    call.with([0, 1].map(|i| {
        if a.d[i].is_none() && b.d[i].is_none() {
            return None;
        }
        let zero = w.float(0.0);
        Some(w.lane(LaneOp::Choose, &[c.v, a.d[i].unwrap_or(zero), b.d[i].unwrap_or(zero)]))
    }))
}

/// `((3 - 2t) * t) * t` with the product rule, whose last bits differ from the form without derivatives.
fn smoothstep(w: &mut Writer<'_>, [low, high, x]: [Dual; 3], _: Call) -> Dual {
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
    let started = w.lane(LaneOp::Step, &[low.v, x.v]);
    let ended = w.lane(LaneOp::Step, &[high.v, x.v]);
    let v = w.select(inner.v, one, ended);
    let v = w.select(zero, v, started);
    let d = w.select_tangents(inner.d, [None; 2], ended);
    Dual { v, d: w.select_tangents([None; 2], d, started) }
}

fn linearstep(w: &mut Writer<'_>, [low, high, x]: [Dual; 3], call: Call) -> Dual {
    let d = between(w, x, low, high);
    let v = w.lane(LaneOp::Clamp, &[x.v, low.v, high.v]);
    let above = w.sub(Dual { v, d }, low);
    let width = w.sub(high, low);
    let quotient = w.guarded(above, width);
    // With equal edges it is a step, whose derivatives are zero without a sign.
    let [up, down] = [[low.v, high.v], [high.v, low.v]].map(|edges| w.lane(LaneOp::Step, &edges));
    let equal = w.lane(LaneOp::FMul, &[up, down]);
    call.with(w.select_tangents(quotient.d, [None; 2], equal))
}

/// Composing triples and taking them apart commutes with differentiation.
fn parts<const N: usize>(w: &mut Writer<'_>, args: [Dual; N], call: Call) -> Dual {
    components(w, &args, call, &[])
}

fn get(w: &mut Writer<'_>, args: [Dual; 2], call: Call) -> Dual {
    components(w, &args, call, &[1])
}

fn set(w: &mut Writer<'_>, args: [Dual; 3], call: Call) -> Dual {
    components(w, &args, call, &[1])
}

/// The same operation on derivatives, where some arguments are indices and stay unchanged.
fn components(w: &mut Writer<'_>, args: &[Dual], call: Call, indices: &[usize]) -> Dual {
    call.with([0, 1].map(|i| {
        if args.iter().all(|a| a.d[i].is_none()) {
            return None;
        }
        let mut list = Vec::new();
        for (at, arg) in args.iter().enumerate() {
            list.push(if indices.contains(&at) { arg.v } else { w.or_zero(arg.d[i], arg.v) });
        }
        Some(w.lane(call.op, &list))
    }))
}

fn smaller(w: &mut Writer<'_>, x: Dual, y: Dual) -> [Tangent; 2] {
    let first = w.lane(LaneOp::Step, &[x.v, y.v]);
    w.select_tangents(y.d, x.d, first)
}

fn larger(w: &mut Writer<'_>, x: Dual, y: Dual) -> [Tangent; 2] {
    let second = w.lane(LaneOp::Step, &[x.v, y.v]);
    w.select_tangents(x.d, y.d, second)
}

fn between(w: &mut Writer<'_>, x: Dual, low: Dual, high: Dual) -> [Tangent; 2] {
    let v = w.lane(LaneOp::Min, &[x.v, high.v]);
    let d = smaller(w, x, high);
    larger(w, Dual { v, d }, low)
}
