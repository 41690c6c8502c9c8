//! One event in words: what was computed from what, and what that means.

use super::Kind;
use super::detect::{ALL_DIGITS, DetectedEvent, operands, part};
use crate::explain::{digits, json_of, written};
use crate::trace::{Exact, Node, Trace, What};
use osl_ir::ir::{Const, Kernel, LaneOp};
use osl_numeric::Domain;
use serde_json::Value;

/// An example of an event.
#[derive(Clone, Debug)]
pub(super) struct Example {
    pub(super) operands: Vec<Value>,
    pub(super) result: Option<Value>,
    /// The result in double precision, for a cancellation.
    pub(super) exact: Option<f64>,
    pub(super) text: String,
}

/// The example that an instruction gives.
pub(super) fn example(trace: &Trace, node: &Node, found: DetectedEvent) -> Example {
    let at = |value: &Const| match found.component.and_then(|component| part(value, component)) {
        Some(x) => Const::Float(x),
        None => value.clone(),
    };
    let given: Vec<Const> = operands(trace, node).unwrap_or_default().into_iter().map(at).collect();
    let result = node.strict.as_ref().map(at).filter(|_| found.kind != Kind::Index);
    let exact = (found.kind == Kind::Cancellation).then(|| exact(node, found.component)).flatten();
    let text = match (&node.what, &result) {
        (What::Note(kernel), _) => index(kernel, &given),
        (What::Lane(op), Some(result)) => text(found.kind, *op, &given, result, exact),
        (What::Kernel(..), Some(result)) => {
            format!("noise({}) is {}", list(&given), if_not_finite(found.kind, result))
        }
        _ => String::new(),
    };
    Example {
        operands: given.iter().map(json_of).collect(),
        result: result.as_ref().map(json_of),
        exact,
        text,
    }
}

fn exact(node: &Node, component: Option<usize>) -> Option<f64> {
    let numbers = node.exact.as_ref()?.numbers();
    numbers.get(component.unwrap_or(0)).or(numbers.first()).copied()
}

fn index(kernel: &Kernel, given: &[Const]) -> String {
    let (Kernel::CheckIndex { name }, [Const::Int(index), Const::Int(length)]) = (kernel, given) else {
        return String::new();
    };
    let (last, used) = (length.saturating_sub(1), (*index).clamp(0, length.saturating_sub(1).max(0)));
    format!("the index is {index}, but `{name}` has 0 to {last}; {used} is used")
}

fn text(kind: Kind, op: LaneOp, given: &[Const], result: &Const, exact: Option<f64>) -> String {
    let (formula, got) = (formula(op, given), show(result));
    match kind {
        Kind::IntOverflow => {
            format!("{formula} is outside of -2147483648 to 2147483647, so it wraps to {got}")
        }
        Kind::IntConversion if matches!(given, [Const::Float(x)] if x.is_nan()) => {
            format!("{formula}: NaN is no int; the language makes it {got}")
        }
        Kind::IntConversion => {
            format!("{formula} is outside of -2147483648 to 2147483647; the language makes it {got}")
        }
        Kind::ZeroDivision => format!("{formula} has no value; the language makes it {got}"),
        Kind::Domain => {
            format!("{formula} has no value, since {}; the language makes it {got}", domain(op, given))
        }
        Kind::Edges if op == LaneOp::Clamp => {
            format!("{formula}: the minimum is larger than the maximum; the result is {got}")
        }
        Kind::Edges => {
            let how = match given {
                [Const::Float(low), Const::Float(high), ..] if low == high => "are equal",
                _ => "are in reversed order",
            };
            format!("{formula}: the two edges {how}; the result is {got}")
        }
        Kind::Infinity if matches!(op, LaneOp::FDiv) => {
            format!("{formula} is too large for a float; the language makes it {got}")
        }
        Kind::Nan | Kind::Infinity | Kind::Denormal => {
            format!("{formula} is {}", if_not_finite(kind, result))
        }
        Kind::Cancellation => {
            let right = exact.zip(number(result)).and_then(|(exact, got)| digits(got, exact));
            let exact = exact.map_or_else(String::new, |x| show(&Const::Float(x as f32)));
            let left = match right.unwrap_or(ALL_DIGITS) {
                none if none < 1.0 => "no digit is".to_string(),
                one if one < 2.0 => "1 digit is".to_string(),
                more => format!("{} digits are", more.floor()),
            };
            format!("{formula} = {got}, but {exact} in double precision: {left} right")
        }
        Kind::Index => String::new(),
    }
}

/// A result that is NaN, infinite or denormal.
fn if_not_finite(kind: Kind, result: &Const) -> String {
    let got = show(result);
    match kind {
        Kind::Nan => "NaN, which is no number".to_string(),
        Kind::Infinity => format!("{got}: it is too large for a float"),
        _ => format!("{got}: so close to 0 that a float keeps fewer digits"),
    }
}

/// Why a function has no value.
fn domain(op: LaneOp, given: &[Const]) -> &'static str {
    match op.domain() {
        Domain::Roots => "roots need a number that is not negative",
        Domain::Logs if op == LaneOp::InverseSqrt => "inverse roots need a number above 0",
        Domain::Logs => "logarithms need a number above 0",
        Domain::Arcs => "arc functions need a number from -1 to 1",
        Domain::Powers if matches!(given, [Const::Float(base), ..] if *base == 0.0) => {
            "a negative power of 0 divides by 0"
        }
        Domain::Powers => "a negative base needs a whole exponent",
        Domain::Directions => "a vector of length 0 has no direction",
        Domain::Divisors | Domain::Everywhere => "it is not defined there",
    }
}

/// An operation with its operands, as in a source.
fn formula(op: LaneOp, given: &[Const]) -> String {
    let sign = match op {
        LaneOp::FAdd | LaneOp::IAdd => "+",
        LaneOp::FSub | LaneOp::ISub => "-",
        LaneOp::FMul | LaneOp::IMul => "*",
        LaneOp::FDiv | LaneOp::FDivBy | LaneOp::IDiv => "/",
        LaneOp::IMod => "%",
        _ => "",
    };
    match (op, given) {
        (_, [a, b]) if !sign.is_empty() => format!("{} {sign} {}", show(a), operand(b)),
        (LaneOp::ToInt, [x]) => format!("(int) {}", operand(x)),
        (LaneOp::FNeg | LaneOp::INeg, [x]) => format!("-{}", operand(x)),
        _ => {
            let name = op.text().split('.').next().unwrap_or_default();
            let name = if op == LaneOp::IAbs { "abs" } else { name };
            format!("{name}({})", list(given))
        }
    }
}

/// A value after a sign: negative numbers in parentheses.
fn operand(value: &Const) -> String {
    let text = show(value);
    if text.starts_with('-') { format!("({text})") } else { text }
}

fn list(values: &[Const]) -> String {
    values.iter().map(show).collect::<Vec<_>>().join(", ")
}

/// A value with just enough digits to know it.
fn show(value: &Const) -> String {
    let float = |x: f64| {
        let text = format!("{:?}", x as f32);
        text.strip_suffix(".0").map_or(text.clone(), str::to_string)
    };
    if matches!(value, Const::Matrix(_)) {
        "a matrix".to_string()
    } else {
        written(&Exact::widen(value), float)
    }
}

fn number(value: &Const) -> Option<f64> {
    match value {
        Const::Float(x) => Some(f64::from(*x)),
        _ => None,
    }
}
