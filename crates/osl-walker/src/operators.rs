//! Operators: `-a`, `a + b`, `a == b` and their kin on values that have the same type already, or on a number
//! and a triple or a matrix.
//!
//! Floats follow IEEE 754, each operation rounded on its own, with two exceptions: a quotient that is not
//! finite is 0, and every comparison with NaN is true. Ints wrap around at 32 bits, and an int divided by 0
//! is 0. On triples an operator works component by component; `==` asks for all components.
//!
//! ```
//! use osl_walker::printed;
//! assert_eq!(printed(r#"float zero = 0; printf("%g", 1 / zero);"#), "0");
//! assert_eq!(printed(r#"printf("%d", 2147483647 + 1);"#), "-2147483648");
//! assert_eq!(printed(r#"printf("%g", 2 * color(1, 2, 3) + 1);"#), "3 5 7");
//! ```

use crate::state::{Stop, undefined};
use crate::value::Value;
use osl_numeric::matrix;
use osl_syntax::ast::{BinaryOp as B, UnaryOp as U};

/// Whether a value counts as true: a number other than 0, several numbers of which one is not 0, a string
/// that is not empty. NaN is true.
pub(crate) fn is_true(value: &Value) -> Result<bool, Stop> {
    let any = |numbers: &[f32]| match numbers.iter().any(|x| x.is_nan()) {
        true => Err(undefined("the truth of several numbers with a NaN among them")),
        false => Ok(numbers.iter().any(|x| *x != 0.0)),
    };
    match value {
        Value::Int(n) => Ok(*n != 0),
        Value::Float(x) => Ok(*x != 0.0),
        Value::Triple(t) => any(t),
        Value::Matrix(m) => any(m),
        Value::String(text) => Ok(!text.is_empty()),
        Value::Aggregate(_) | Value::Void => Err(undefined("the truth of an array or a struct")),
    }
}

/// `-a`, `!a`, `~a`.
pub(crate) fn unary(op: U, a: &Value) -> Result<Value, Stop> {
    Ok(match (op, a) {
        (U::Neg, Value::Int(n)) => Value::Int(n.wrapping_neg()),
        (U::Neg, Value::Float(x)) => Value::Float(-x),
        (U::Neg, Value::Triple(t)) => Value::Triple(t.map(|x| -x)),
        (U::Neg, Value::Matrix(m)) => Value::Matrix(m.map(|x| -x)),
        (U::Compl, Value::Int(n)) => Value::Int(!n),
        (U::Not, Value::Float(x)) if x.is_nan() => return Err(undefined("the negation of a NaN")),
        (U::Not, a) => Value::Int((!is_true(a)?).into()),
        _ => return Err(undefined("this operand")),
    })
}

/// The new value of `++a` and `--a`: each number of a triple or a matrix changes by 1.
pub(crate) fn incremented(a: &Value, up: bool) -> Value {
    let by = if up { 1.0 } else { -1.0 };
    match a {
        Value::Int(n) => Value::Int(n.wrapping_add(if up { 1 } else { -1 })),
        Value::Float(x) => Value::Float(x + by),
        Value::Triple(t) => Value::Triple(t.map(|x| x + by)),
        Value::Matrix(m) => Value::Matrix(m.map(|x| x + by)),
        other => other.clone(),
    }
}

/// `a op b`, except `&&` and `||`. `literal` says that b is written as a number.
pub(crate) fn binary(op: B, a: &Value, b: &Value, literal: bool) -> Result<Value, Stop> {
    Ok(match (a, b) {
        (Value::Int(a), Value::Int(b)) => Value::Int(ints(op, *a, *b)?),
        (Value::String(a), Value::String(b)) => Value::Int(match op {
            B::Eq => (a == b).into(),
            B::Ne => (a != b).into(),
            _ => return Err(undefined("arithmetic on strings")),
        }),
        (Value::Matrix(_), _) | (_, Value::Matrix(_)) => matrices(op, a, b)?,
        (Value::Triple(_), _) | (_, Value::Triple(_)) => triples(op, a.triple(), b.triple(), literal)?,
        (Value::Int(_) | Value::Float(_), Value::Int(_) | Value::Float(_)) => {
            let (a, b) = (a.float(), b.float());
            match compared(op, a, b) {
                Some(truth) => Value::Int(truth.into()),
                None => Value::Float(floats(op, a, b, literal)?),
            }
        }
        _ => return Err(undefined("these operands")),
    })
}

fn ints(op: B, a: i32, b: i32) -> Result<i32, Stop> {
    Ok(match op {
        B::Add => a.wrapping_add(b),
        B::Sub => a.wrapping_sub(b),
        B::Mul => a.wrapping_mul(b),
        B::Div | B::Mod if b == 0 => 0,
        B::Div => a.wrapping_div(b),
        B::Mod => a.wrapping_rem(b),
        // The low five bits of b count.
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
        B::And | B::Or => return Err(undefined("these operands")),
    })
}

fn floats(op: B, a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    match op {
        B::Add => Ok(a + b),
        B::Sub => Ok(a - b),
        B::Mul => Ok(a * b),
        B::Div => quotient(a, b, literal),
        _ => Err(undefined("these operands")),
    }
}

/// `a / b`: 0 if the quotient is not finite, except if b is a literal other than 0. Whether another divisor
/// counts as a constant depends on the optimiser, so the quotient is undefined where that matters.
pub(crate) fn quotient(a: f32, b: f32, literal: bool) -> Result<f32, Stop> {
    let q = a / b;
    if q.is_finite() || (literal && b != 0.0) {
        Ok(q)
    } else if b == 0.0 {
        Ok(0.0)
    } else {
        Err(undefined("a quotient that overflows"))
    }
}

/// Whether some components of a divisor are zero and others are not. If the optimiser finds it to be
/// constant, the quotients by the zeros are not guarded.
pub(crate) fn is_partly_zero(b: [f32; 3]) -> bool {
    b.contains(&0.0) && b.iter().any(|x| *x != 0.0)
}

/// The truth of a comparison; none for other operators.
fn compared(op: B, a: f32, b: f32) -> Option<bool> {
    let unordered = a.is_nan() || b.is_nan();
    Some(match op {
        B::Lt => unordered || a < b,
        B::Le => unordered || a <= b,
        B::Gt => unordered || a > b,
        B::Ge => unordered || a >= b,
        B::Eq => unordered || a == b,
        B::Ne => unordered || a != b,
        _ => return None,
    })
}

/// Equal if all components are equal, different if some are different; none for other operators.
fn equality(op: B, a: &[f32], b: &[f32]) -> Option<Value> {
    let mut truths = a.iter().zip(b).map(|(a, b)| compared(op, *a, *b) == Some(true));
    match op {
        B::Eq => Some(Value::Int(truths.all(|truth| truth).into())),
        B::Ne => Some(Value::Int(truths.any(|truth| truth).into())),
        _ => None,
    }
}

fn triples(op: B, a: [f32; 3], b: [f32; 3], literal: bool) -> Result<Value, Stop> {
    if let Some(truth) = equality(op, &a, &b) {
        return Ok(truth);
    }
    if op == B::Div && is_partly_zero(b) {
        return Err(undefined("a quotient of triples by a divisor that is partly zero"));
    }
    let [x, y, z] = std::array::from_fn(|at| floats(op, a[at], b[at], literal));
    Ok(Value::Triple([x?, y?, z?]))
}

/// `a * b` of matrices is their product, and `a / b` the product with the inverse. A number scales.
fn matrices(op: B, a: &Value, b: &Value) -> Result<Value, Stop> {
    if let Some(truth) = equality(op, &a.matrix(), &b.matrix()) {
        return Ok(truth);
    }
    Ok(Value::Matrix(match (op, a, b) {
        (B::Mul, Value::Matrix(a), Value::Matrix(b)) => product(a, b),
        (B::Mul, Value::Matrix(m), k) | (B::Mul, k, Value::Matrix(m)) => m.map(|x| x * k.float()),
        (B::Div, Value::Matrix(a), Value::Matrix(b)) => product(a, &matrix::inverse(*b)),
        (B::Div, Value::Matrix(m), k) => {
            let reciprocal = 1.0 / k.float();
            m.map(|x| x * reciprocal)
        }
        (B::Div, k, Value::Matrix(m)) => matrix::inverse(*m).map(|x| x * k.float()),
        _ => return Err(undefined("these operands")),
    }))
}

/// Rows times columns, summed in order.
fn product(a: &[f32; 16], b: &[f32; 16]) -> [f32; 16] {
    std::array::from_fn(|at| {
        let (row, column) = (at / 4, at % 4);
        let term = |k: usize| a[4 * row + k] * b[4 * k + column];
        term(0) + term(1) + term(2) + term(3)
    })
}
