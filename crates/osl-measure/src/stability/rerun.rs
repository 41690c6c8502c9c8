//! One traced instruction again, in double precision and with other operands; and differences of values.

use crate::trace::{Exact, What, eval, noise};
use osl_ir::ir::Const;
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
