//! Expressions that are constants, as the table of symbols writes them.

use super::table::Value;
use crate::hir::{Expr, ExprKind};
use osl_ir::types::{Base, Type};

/// The type and values of a constant; `None` for anything else. Conversions are those of a run.
pub(super) fn constant(e: &Expr) -> Option<Vec<Value>> {
    match &e.kind {
        ExprKind::Int(n) => Some(vec![Value::Int(*n)]),
        ExprKind::Float(x) => (!x.is_nan()).then(|| vec![Value::Float(*x)]),
        ExprKind::Str(text) => Some(vec![Value::Text(text.clone())]),
        ExprKind::Triple(parts) => parts.iter().map(float).collect(),
        ExprKind::Matrix(cells) => cells.iter().map(float).collect(),
        ExprKind::Convert(inner) => converted(e.ty, inner),
        _ => None,
    }
}

fn float(e: &Expr) -> Option<Value> {
    match constant(e)?.as_slice() {
        [Value::Float(x)] => Some(Value::Float(*x)),
        _ => None,
    }
}

fn converted(to: Type, inner: &Expr) -> Option<Vec<Value>> {
    let values = constant(inner)?;
    if inner.ty.is_triple() && to.is_triple() {
        return Some(values);
    }
    let x = match values.as_slice() {
        [Value::Int(n)] => *n as f32,
        [Value::Float(x)] => *x,
        _ => return None,
    };
    Some(match to.base {
        Base::Float => vec![Value::Float(x)],
        Base::Matrix => (0..16).map(|at| Value::Float(if at % 5 == 0 { x } else { 0.0 })).collect(),
        base if base.is_triple() => vec![Value::Float(x); 3],
        _ => return None,
    })
}

/// Zero, or the empty string; nothing for a closure.
pub(super) fn zero(base: Base) -> Vec<Value> {
    match base {
        Base::Int => vec![Value::Int(0)],
        Base::Float => vec![Value::Float(0.0)],
        Base::Matrix => vec![Value::Float(0.0); 16],
        Base::String => vec![Value::Text("".into())],
        base if base.is_triple() => vec![Value::Float(0.0); 3],
        _ => Vec::new(),
    }
}
