//! Operators on values.

use super::{Stop, Value, math};
use osl_numeric::matrix;
use osl_syntax::ast::{BinaryOp as B, UnaryOp as U};

/// Whether a value is true. NaN is true; the result for NaN among several numbers is undefined.
pub(super) fn holds(value: &Value) -> Result<bool, Stop> {
    Ok(match value {
        Value::Int(n) => *n != 0,
        Value::Float(x) => *x != 0.0,
        Value::Triple(t) => some(t)?,
        Value::Matrix(m) => some(m)?,
        Value::Text(text) => !text.is_empty(),
        Value::Many(_) | Value::Nothing => return Err(Stop::Open("no condition")),
    })
}

fn some(numbers: &[f32]) -> Result<bool, Stop> {
    if numbers.iter().any(|x| x.is_nan()) {
        return Err(Stop::Open("NaN among the numbers of a condition"));
    }
    Ok(numbers.iter().any(|x| *x != 0.0))
}

/// `-a`, `!a`, `~a`.
pub(super) fn unary(op: U, a: &Value) -> Result<Value, Stop> {
    Ok(match (op, a) {
        (U::Neg, Value::Int(n)) => Value::Int(n.wrapping_neg()),
        (U::Neg, Value::Float(x)) => Value::Float(-x),
        (U::Neg, Value::Triple(t)) => Value::Triple(t.map(|x| -x)),
        (U::Neg, Value::Matrix(m)) => Value::Matrix(m.map(|x| -x)),
        (U::Compl, Value::Int(n)) => Value::Int(!n),
        (U::Not, Value::Float(x)) if x.is_nan() => return Err(Stop::Open("not of a NaN")),
        (U::Not, a) => Value::Int((!holds(a)?).into()),
        _ => return Err(Stop::Open("an operand of no type")),
    })
}

/// `++` and `--`: applied to each number of a triple, and to all sixteen of a matrix.
pub(super) fn stepped(a: &Value, up: bool) -> Value {
    let by = if up { 1.0 } else { -1.0 };
    match a {
        Value::Int(n) => Value::Int(n.wrapping_add(if up { 1 } else { -1 })),
        Value::Float(x) => Value::Float(x + by),
        Value::Triple(t) => Value::Triple(t.map(|x| x + by)),
        Value::Matrix(m) => Value::Matrix(m.map(|x| x + by)),
        other => other.clone(),
    }
}

/// `a op b`. `literal` means that the divisor is written as a number.
pub(super) fn binary(op: B, a: &Value, b: &Value, literal: bool) -> Result<Value, Stop> {
    Ok(match (a, b) {
        (Value::Int(a), Value::Int(b)) => Value::Int(ints(op, *a, *b)?),
        (Value::Text(a), Value::Text(b)) => Value::Int(match op {
            B::Eq => (a == b).into(),
            B::Ne => (a != b).into(),
            _ => return Err(Stop::Open("strings have no arithmetic")),
        }),
        (Value::Matrix(_), _) | (_, Value::Matrix(_)) => matrices(op, a, b)?,
        (Value::Triple(_), _) | (_, Value::Triple(_)) => triples(op, a.triple(), b.triple(), literal)?,
        (Value::Int(_) | Value::Float(_), Value::Int(_) | Value::Float(_)) => {
            let (a, b) = (a.float(), b.float());
            match compared(op, a, b) {
                Some(truth) => Value::Int(truth.into()),
                None => Value::Float(float(op, a, b, literal)?),
            }
        }
        _ => return Err(Stop::Open("operands of no type")),
    })
}

/// All comparisons with a NaN are true.
fn compared(op: B, a: f32, b: f32) -> Option<bool> {
    let open = a.is_nan() || b.is_nan();
    Some(match op {
        B::Lt => open || a < b,
        B::Le => open || a <= b,
        B::Gt => open || a > b,
        B::Ge => open || a >= b,
        B::Eq => open || a == b,
        B::Ne => open || a != b,
        _ => return None,
    })
}

/// Equal if all components are, different if some are.
fn equality(op: B, a: &[f32], b: &[f32]) -> bool {
    let mut truths = a.iter().zip(b).map(|(a, b)| compared(op, *a, *b) == Some(true));
    if op == B::Eq { truths.all(|truth| truth) } else { truths.any(|truth| truth) }
}

fn float(op: B, a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    Ok(match op {
        B::Add => a + b,
        B::Sub => a - b,
        B::Mul => a * b,
        B::Div => math::quotient(a, b, literal)?,
        _ => return Err(Stop::Open("operands of no type")),
    })
}

fn triples(op: B, a: [f32; 3], b: [f32; 3], literal: bool) -> Result<Value, Stop> {
    if let B::Eq | B::Ne = op {
        return Ok(Value::Int(equality(op, &a, &b).into()));
    }
    if op == B::Div && math::is_mixed(b) {
        return Err(Stop::Open("a triple of divisors with a zero"));
    }
    let mut result = [0.0; 3];
    for at in 0..3 {
        result[at] = float(op, a[at], b[at], literal)?;
    }
    Ok(Value::Triple(result))
}

fn matrices(op: B, a: &Value, b: &Value) -> Result<Value, Stop> {
    if let B::Eq | B::Ne = op {
        return Ok(Value::Int(equality(op, &a.matrix(), &b.matrix()).into()));
    }
    Ok(Value::Matrix(match (op, a, b) {
        (B::Mul, Value::Matrix(a), Value::Matrix(b)) => product(a, b),
        (B::Mul, Value::Matrix(m), k) | (B::Mul, k, Value::Matrix(m)) => m.map(|x| x * k.float()),
        (B::Div, Value::Matrix(a), Value::Matrix(b)) => product(a, &matrix::inverse(*b)),
        (B::Div, Value::Matrix(m), k) => {
            let k = 1.0 / k.float();
            m.map(|x| x * k)
        }
        (B::Div, k, Value::Matrix(m)) => matrix::inverse(*m).map(|x| x * k.float()),
        _ => return Err(Stop::Open("operands of no type")),
    }))
}

/// Rows times columns.
fn product(a: &[f32; 16], b: &[f32; 16]) -> [f32; 16] {
    std::array::from_fn(|at| {
        let (row, column) = (at / 4, at % 4);
        let term = |k: usize| a[4 * row + k] * b[4 * k + column];
        term(0) + term(1) + term(2) + term(3)
    })
}

fn ints(op: B, a: i32, b: i32) -> Result<i32, Stop> {
    Ok(match op {
        B::Add => a.wrapping_add(b),
        B::Sub => a.wrapping_sub(b),
        B::Mul => a.wrapping_mul(b),
        B::Div if b == 0 => 0,
        B::Div => a.wrapping_div(b),
        B::Mod if b == 0 => 0,
        B::Mod => a.wrapping_rem(b),
        B::Shl => a.wrapping_shl(b.cast_unsigned()),
        B::Shr => a.wrapping_shr(b.cast_unsigned()),
        B::BitAnd => a & b,
        B::BitXor => a ^ b,
        B::BitOr => a | b,
        B::Lt => (a < b).into(),
        B::Le => (a <= b).into(),
        B::Gt => (a > b).into(),
        B::Ge => (a >= b).into(),
        B::Eq => (a == b).into(),
        B::Ne => (a != b).into(),
        B::And | B::Or => return Err(Stop::Open("handled before")),
    })
}
