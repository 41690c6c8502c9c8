//! One executed instruction: its result again, in double precision and with other operands; whether its
//! result left the range of floats; and whether it reduces the range of its operand.
//!
//! A result is broken if the operation gives an ordinary number for the same operands in double precision. So
//! what follows from a broken operand is not broken itself. A function that is periodic, or takes the
//! fraction of its operand, magnifies what an earlier instruction rounded away, however it is written.

use crate::trace::{Exact, NodeId, Trace, What, eval, noise};
use osl_ir::ir::{Const, Kernel, LaneOp};
use osl_numeric::Cost;

/// The result of an operation or a noise with these operands; `None` for calls that cannot run again.
pub(super) fn again(what: &What, args: &[Exact]) -> Option<Exact> {
    match what {
        What::Lane(op) => eval(*op, args),
        What::Kernel(kernel, result) => noise(kernel, args, *result),
        _ => None,
    }
}

/// Whether the instruction computes, and so may round: taking a triple apart does not.
pub(super) fn computes(what: &What) -> bool {
    match what {
        What::Lane(op) => op.cost() != Cost::Part,
        What::Kernel(..) => true,
        _ => false,
    }
}

/// The difference of two numbers; infinite if only one of them is finite.
pub(super) fn difference(a: f64, b: f64) -> f64 {
    match (a == b || (a.is_nan() && b.is_nan()), (a - b).is_finite()) {
        (true, _) => 0.0,
        (false, true) => a - b,
        (false, false) => f64::INFINITY,
    }
}

/// The differences of two values, component by component.
pub(super) fn differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| difference(*a, *b)).collect()
}

/// Whether two values are the same; NaN is the same as NaN.
pub(super) fn is_same(a: &Exact, b: &Exact) -> bool {
    a == b || (a.kind() == b.kind() && are_equal(&a.numbers(), &b.numbers()))
}

fn are_equal(a: &[f64], b: &[f64]) -> bool {
    !a.is_empty() && differences(a, b).iter().all(|d| *d == 0.0)
}

/// The error of the largest component relative to its size; 0 if the exact value is 0.
pub(super) fn relative_error(strict: &Const, exact: &Exact) -> f64 {
    let (strict, exact) = (Exact::widen(strict).numbers(), exact.numbers());
    let size = exact.iter().map(|x| x.abs()).fold(0.0, f64::max);
    let error = differences(&strict, &exact).iter().map(|e| e.abs()).fold(0.0, f64::max);
    if size > 0.0 { error / size } else { 0.0 }
}

/// How a result left the range of floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Broken {
    /// It keeps few digits, since it is near the smallest float.
    Denormal,
    /// It is 0, since a step within the operation is smaller than the smallest float.
    UnderflowWithin,
    /// It is smaller than the smallest float, and became 0.
    Underflow,
    /// A step within the operation is larger than the largest float.
    OverflowWithin,
    /// It is larger than the largest float.
    Overflow,
    /// It is no number for another reason.
    Nan,
}

/// Operands above this size or below its inverse can overflow or underflow within an operation of several
/// steps.
const FAR: f64 = 1e10;

/// How the strict result of a node left the range of floats, if it did while the exact one is a number.
pub(super) fn broken(trace: &Trace, id: NodeId) -> Option<Broken> {
    let node = trace.node(id);
    let (strict, exact) = (Exact::widen(node.strict.as_ref()?), node.exact.as_ref()?);
    if !matches!(strict, Exact::Float(_) | Exact::Triple(_) | Exact::Matrix(_)) {
        return None;
    }
    let strict = strict.numbers();
    let is_ordinary = |s: &f64| s.is_finite() && s.abs() >= f64::from(f32::MIN_POSITIVE);
    if strict.iter().all(is_ordinary) {
        return None;
    }
    let given: Option<Vec<Exact>> =
        node.args.iter().map(|arg| trace.node(*arg).strict.as_ref().map(Exact::widen)).collect();
    let given = given?;
    let wide = again(&node.what, &given)?.numbers();
    let one = |((s, wide), exact): ((&f64, &f64), f64)| {
        if is_ordinary(s) || !wide.is_finite() || !exact.is_finite() || *wide == *s {
            return None;
        }
        let size = wide.abs();
        match *s {
            _ if size > f64::from(f32::MAX) => Some(Broken::Overflow),
            s if s.is_nan() => Some(Broken::Nan),
            s if s.is_infinite() => Some(Broken::OverflowWithin),
            s if size < f64::from(f32::MIN_POSITIVE) => {
                let is_rounding = (wide - s).abs() <= f64::from(f32::EPSILON) * size;
                let kind = if s == 0.0 { Broken::Underflow } else { Broken::Denormal };
                (!is_rounding).then_some(kind)
            }
            // The steps within the operation overflow or underflow.
            0.0 => {
                let sizes = || given.iter().flat_map(Exact::numbers).map(f64::abs).filter(|x| *x > 0.0);
                if sizes().any(|x| x > FAR) {
                    Some(Broken::OverflowWithin)
                } else {
                    sizes().any(|x| x < 1.0 / FAR).then_some(Broken::UnderflowWithin)
                }
            }
            _ => None,
        }
    };
    strict.iter().zip(&wide).zip(exact.numbers()).filter_map(one).max()
}

/// The number rounded to single precision, except one that single precision cannot hold: to leave its range
/// is no rounding.
pub(super) fn rounded_number(exact: f64) -> f64 {
    let rounded = f64::from(exact as f32);
    let is_out = !rounded.is_finite() || rounded.abs() < f64::from(f32::MIN_POSITIVE);
    if is_out { exact } else { rounded }
}

/// The same for a value.
pub(super) fn rounded_once(value: &Exact) -> Exact {
    match value {
        Exact::Float(_) | Exact::Triple(_) | Exact::Matrix(_) => {
            let numbers: Vec<f64> = value.numbers().into_iter().map(rounded_number).collect();
            Exact::of_numbers(value.kind(), &numbers)
        }
        _ => value.clone(),
    }
}

/// Instructions between a rounding to a whole number and the difference that takes the fraction.
const STEPS: usize = 4;

/// Whether a node repeats or reduces the range of its operand.
pub(super) fn reduces(trace: &Trace, id: NodeId) -> bool {
    let node = trace.node(id);
    match &node.what {
        What::Lane(LaneOp::Mod | LaneOp::ModBy | LaneOp::Fmod | LaneOp::FmodExact) => true,
        What::Lane(LaneOp::Sin | LaneOp::Cos | LaneOp::Tan) => {
            let size = |arg: &NodeId| {
                let exact = trace.node(*arg).exact.as_ref().map_or_else(Vec::new, Exact::numbers);
                exact.into_iter().fold(0.0, |most: f64, x| most.max(x.abs()))
            };
            node.args.iter().any(|arg| size(arg) > std::f64::consts::PI)
        }
        What::Lane(LaneOp::FSub | LaneOp::FAdd) => node.args.iter().any(|arg| is_whole(trace, *arg, STEPS)),
        What::Lane(op) => makes_whole(*op),
        What::Kernel(kernel, _) => matches!(
            **kernel,
            Kernel::Noise { .. }
                | Kernel::NamedNoise { .. }
                | Kernel::Texture { .. }
                | Kernel::Environment { .. }
                | Kernel::Volume { .. }
        ),
        _ => false,
    }
}

fn makes_whole(op: LaneOp) -> bool {
    matches!(op, LaneOp::Floor | LaneOp::Ceil | LaneOp::Trunc | LaneOp::Round | LaneOp::ToInt)
}

/// Whether a value is a whole number that was made from another one, or a multiple of one.
fn is_whole(trace: &Trace, id: NodeId, steps: usize) -> bool {
    let node = trace.node(id);
    let Some(steps) = steps.checked_sub(1) else { return false };
    match &node.what {
        What::Lane(op) if makes_whole(*op) => true,
        What::Lane(
            LaneOp::FMul
            | LaneOp::FNeg
            | LaneOp::ToFloat
            | LaneOp::Splat
            | LaneOp::Triple
            | LaneOp::X
            | LaneOp::Y
            | LaneOp::Z,
        )
        | What::Element => node.args.iter().any(|arg| is_whole(trace, *arg, steps)),
        _ => false,
    }
}
