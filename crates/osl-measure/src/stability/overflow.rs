//! Overflow and underflow: the first place where a number becomes infinite, NaN, or 0 because it is too
//! small.
//!
//! A result is broken if the operation gives an ordinary number for the same operands in double precision. So
//! what follows from a broken operand is not broken itself.

use super::rerun::again;
use crate::trace::{Exact, NodeId, Trace};

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
