//! The derivative rules of elementary functions: most multiply the argument's derivatives by a factor.

use super::super::rewrite::Rewrite;
use super::Writer;
use super::dual::{Call, Dual};
use crate::ir::{LaneOp as L, ValueId};
use osl_numeric::library_constants::LibraryConstant;

/// `number / b`.
fn over(w: &mut Writer<'_>, number: f32, b: ValueId) -> ValueId {
    let number = w.float(number);
    w.lane(L::FDivBy, &[number, b])
}

pub(super) fn sin(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let derivative = w.lane(L::Cos, &[x.v]);
    w.chain(call.result, derivative, x)
}

pub(super) fn cos(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let sin = w.lane(L::Sin, &[x.v]);
    let derivative = w.lane(L::FNeg, &[sin]);
    w.chain(call.result, derivative, x)
}

pub(super) fn tan(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    one_over_square(w, L::Cos, x, call)
}

pub(super) fn tanh(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    one_over_square(w, L::Cosh, x, call)
}

/// A function whose derivative is 1 over the square of another.
fn one_over_square(w: &mut Writer<'_>, of: L, x: Dual, call: Call) -> Dual {
    let root = w.lane(of, &[x.v]);
    let square = w.lane(L::FMul, &[root, root]);
    let derivative = over(w, 1.0, square);
    w.chain(call.result, derivative, x)
}

pub(super) fn asin(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    arc(w, 1.0, x, call)
}

pub(super) fn acos(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    arc(w, -1.0, x, call)
}

/// A derivative of `sign / √(1 - x²)`, and 0 from -1 down and from 1 up.
fn arc(w: &mut Writer<'_>, sign: f32, x: Dual, call: Call) -> Dual {
    let minus = w.lane(L::FNeg, &[x.v]);
    let square = w.lane(L::FMul, &[minus, x.v]);
    let one = w.float(1.0);
    let rest = w.lane(L::FAdd, &[square, one]);
    let root = w.lane(L::Sqrt, &[rest]);
    let derivative = over(w, sign, root);
    let size = w.lane(L::Abs, &[x.v]);
    let outside = w.lane(L::Step, &[one, size]);
    let zero = w.float(0.0);
    let derivative = w.select(derivative, zero, outside);
    w.chain(call.result, derivative, x)
}

pub(super) fn atan(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let square = w.lane(L::FMul, &[x.v, x.v]);
    let one = w.float(1.0);
    let sum = w.lane(L::FAdd, &[square, one]);
    let derivative = over(w, 1.0, sum);
    w.chain(call.result, derivative, x)
}

/// The reference's own rule for `atan2`, whose signs are the opposite of the mathematical derivative's.
pub(super) fn arc_tangent(w: &mut Writer<'_>, [y, x]: [Dual; 2], call: Call) -> Dual {
    let (xx, yy) = (w.lane(L::FMul, &[x.v, x.v]), w.lane(L::FMul, &[y.v, y.v]));
    let squared = w.lane(L::FAdd, &[xx, yy]);
    let one = w.float(1.0);
    let k = w.lane(L::FDiv, &[one, squared]);
    let minus = w.lane(L::FNeg, &[x.v]);
    let by_y = w.lane(L::FMul, &[minus, k]);
    let by_x = w.lane(L::FMul, &[y.v, k]);
    call.with([0, 1].map(|i| {
        let left = w.scaled(y.d[i], by_y);
        let right = w.scaled(x.d[i], by_x);
        w.sum(left, right)
    }))
}

pub(super) fn sinh(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let derivative = w.lane(L::Cosh, &[x.v]);
    w.chain(call.result, derivative, x)
}

pub(super) fn cosh(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let derivative = w.lane(L::Sinh, &[x.v]);
    w.chain(call.result, derivative, x)
}

pub(super) fn exp(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    w.chain(call.result, call.result, x)
}

pub(super) fn exp2(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let ln2 = w.library_constant(LibraryConstant::Ln2);
    let derivative = w.lane(L::FMul, &[call.result, ln2]);
    w.chain(call.result, derivative, x)
}

pub(super) fn expm1(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let derivative = w.lane(L::Exp, &[x.v]);
    w.chain(call.result, derivative, x)
}

pub(super) fn log(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let derivative = reciprocal(w, x.v);
    w.chain(call.result, derivative, x)
}

pub(super) fn log2(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    logarithm(w, LibraryConstant::Ln2, x, call)
}

pub(super) fn log10(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    logarithm(w, LibraryConstant::Ln10, x, call)
}

/// The logarithm to a base, with the base's natural logarithm.
fn logarithm(w: &mut Writer<'_>, base: LibraryConstant, x: Dual, call: Call) -> Dual {
    let base = w.library_constant(base);
    let scaled = w.lane(L::FMul, &[x.v, base]);
    let derivative = reciprocal(w, scaled);
    w.chain(call.result, derivative, x)
}

/// `1 / x`, or 0 below the normal numbers.
fn reciprocal(w: &mut Writer<'_>, x: ValueId) -> ValueId {
    let one = w.float(1.0);
    let derivative = w.lane(L::FDivBy, &[one, x]);
    let smallest = w.float(f32::MIN_POSITIVE);
    let normal = w.lane(L::Step, &[smallest, x]);
    let zero = w.float(0.0);
    w.select(zero, derivative, normal)
}

/// `u` to the `v`, computed as `u^(v-1) * u`, which changes the last bits and makes `pow(0, 0)` 0.
pub(super) fn power(w: &mut Writer<'_>, [u, v]: [Dual; 2], _: Call) -> Dual {
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

pub(super) fn erf(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    bell(w, LibraryConstant::TwoOverRootPi, x, call)
}

pub(super) fn erfc(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    bell(w, LibraryConstant::MinusTwoOverRootPi, x, call)
}

/// A derivative of `factor · exp(-x²)`.
fn bell(w: &mut Writer<'_>, factor: LibraryConstant, x: Dual, call: Call) -> Dual {
    let minus = w.lane(L::FNeg, &[x.v]);
    let square = w.lane(L::FMul, &[minus, x.v]);
    let bell = w.lane(L::Exp, &[square]);
    let factor = w.library_constant(factor);
    let derivative = w.lane(L::FMul, &[bell, factor]);
    w.chain(call.result, derivative, x)
}

pub(super) fn sqrt(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    w.root(call.result, x)
}

pub(super) fn inversesqrt(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let half = w.float(-0.5);
    let scaled = w.lane(L::FMul, &[half, call.result]);
    let derivative = w.lane(L::FDivBy, &[scaled, x.v]);
    let derivative = w.where_positive(x.v, derivative);
    w.chain(call.result, derivative, x)
}

pub(super) fn cbrt(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let three = w.float(3.0);
    let scaled = w.lane(L::FMul, &[three, call.result]);
    let square = w.lane(L::FMul, &[scaled, call.result]);
    let derivative = over(w, 1.0, square);
    let zero = w.float(0.0);
    let derivative = w.select(zero, derivative, call.result);
    w.chain(call.result, derivative, x)
}

pub(super) fn srgb_to_linear(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let (offset, scale, exponent) = (
        w.library_constant(LibraryConstant::SrgbOffset),
        w.library_constant(LibraryConstant::SrgbScale),
        w.library_constant(LibraryConstant::SrgbPower),
    );
    let base = w.lane(L::FAdd, &[x.v, offset]);
    let base = w.lane(L::FMul, &[base, scale]);
    let power = w.lane(L::Pow, &[base, exponent]);
    let factor = w.library_constant(LibraryConstant::SrgbFactor);
    let (straight, edge) =
        (w.library_constant(LibraryConstant::SrgbStraight), w.library_constant(LibraryConstant::SrgbEdge));
    let curved = w.lane(L::FMul, &[power, factor]);
    let not_above = w.lane(L::Step, &[x.v, edge]);
    let derivative = w.select(curved, straight, not_above);
    w.chain(call.result, derivative, x)
}

pub(super) fn linear_to_srgb(w: &mut Writer<'_>, [x]: [Dual; 1], call: Call) -> Dual {
    let (exponent, factor) =
        (w.library_constant(LibraryConstant::LinearPower), w.library_constant(LibraryConstant::LinearFactor));
    let power = w.lane(L::Pow, &[x.v, exponent]);
    let curved = w.lane(L::FMul, &[power, factor]);
    let (straight, edge) = (
        w.library_constant(LibraryConstant::LinearStraight),
        w.library_constant(LibraryConstant::LinearEdge),
    );
    let not_above = w.lane(L::Step, &[x.v, edge]);
    let derivative = w.select(curved, straight, not_above);
    w.chain(call.result, derivative, x)
}
