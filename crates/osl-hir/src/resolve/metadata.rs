//! Metadata: constants attached to a parameter, a function or the shader, checked and read.
//!
//! A value is a literal, arithmetic on literals, a constructor of such, or a list of them for an array.

use super::Resolver;
use super::errors;
use crate::hir::MetaValue;
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::{self, Ast, BinaryOp, ExprId};
use std::sync::Arc;

impl Resolver<'_> {
    /// Reads metadata and reports values that are not constants of their type.
    pub(super) fn metadata(&mut self, list: &[ast::Metadatum]) -> Vec<(String, Arc<str>, MetaValue)> {
        let mut read = Vec::new();
        for datum in list {
            let ty = self.declared_type(&datum.ty, datum.array.as_ref(), false);
            let value = meta_value(self.ast, datum.value);
            self.check_metadatum(datum, ty, &value);
            read.push((self.show(ty), datum.name.text.clone(), value));
        }
        read
    }

    fn check_metadatum(&mut self, datum: &ast::Metadatum, ty: Type, value: &MetaValue) {
        let span = self.ast[datum.value].span;
        if ty.is_error() {
            return;
        }
        if *value == MetaValue::Unknown {
            return self.report(errors::open_metadata(span));
        }
        let is_list = matches!(self.ast[datum.value].kind, ast::ExprKind::InitList(_));
        let fits = match ty.extent {
            Extent::Array(n) => is_list && self.elements_fit(ty.base, datum.value, n as usize),
            _ => fits(ty.base, value),
        };
        if !fits {
            self.report(errors::metadata_type(span, &self.show_a(ty)));
        }
    }

    fn elements_fit(&self, element: Base, list: ExprId, length: usize) -> bool {
        let ast::ExprKind::InitList(items) = &self.ast[list].kind else { return false };
        items.len() <= length && items.iter().all(|item| fits(element, &meta_value(self.ast, *item)))
    }
}

/// Whether the value is one of the type.
fn fits(base: Base, value: &MetaValue) -> bool {
    match value {
        MetaValue::Text(_) => base == Base::String,
        MetaValue::Numbers(numbers) => match base {
            Base::Int | Base::Float => numbers.len() == 1,
            Base::Matrix => matches!(numbers.len(), 1 | 16),
            base => base.is_triple() && matches!(numbers.len(), 1 | 3),
        },
        MetaValue::Texts(_) | MetaValue::Unknown => false,
    }
}

/// The constant value of a metadatum, made from literals, their arithmetic and their constructors.
fn meta_value(ast: &Ast, id: ExprId) -> MetaValue {
    use ast::ExprKind as E;
    match &ast[id].kind {
        E::Str(text) => MetaValue::Text(text.clone()),
        E::Paren(inner) => meta_value(ast, *inner),
        E::Construct(_, args) => join_numbers(args.iter().map(|e| meta_value(ast, *e)).collect()),
        E::InitList(items) => {
            let values: Vec<MetaValue> = items.iter().map(|e| meta_value(ast, *e)).collect();
            let text = |v: &MetaValue| if let MetaValue::Text(t) = v { Some(t.clone()) } else { None };
            let texts: Option<Vec<Arc<str>>> = values.iter().map(text).collect();
            texts.filter(|t| !t.is_empty()).map_or_else(|| join_numbers(values), MetaValue::Texts)
        }
        _ => number(ast, id).map_or(MetaValue::Unknown, |n| MetaValue::Numbers(vec![n.value()])),
    }
}

/// A number with the type that arithmetic gives it.
#[derive(Clone, Copy)]
enum Number {
    Int(i32),
    Float(f32),
}

impl Number {
    fn value(self) -> f64 {
        match self {
            Number::Int(n) => f64::from(n),
            Number::Float(x) => f64::from(x),
        }
    }
}

/// Arithmetic on literals; division by zero gives 0, as everywhere in the language.
fn number(ast: &Ast, mut id: ExprId) -> Option<Number> {
    use ast::ExprKind as E;
    // A chain of operators may be long.
    let mut links = Vec::new();
    while let E::Binary(op, a, b) = ast[id].kind {
        links.push((op, b));
        id = a;
    }
    let first = operand(ast, id)?;
    links.into_iter().rev().try_fold(first, |left, (op, right)| {
        Some(match (left, number(ast, right)?) {
            (Number::Int(a), Number::Int(b)) => Number::Int(int_arithmetic(op, a, b)?),
            (a, b) => Number::Float(float_arithmetic(op, a.value() as f32, b.value() as f32)?),
        })
    })
}

/// A number that is not the result of a binary operator.
fn operand(ast: &Ast, id: ExprId) -> Option<Number> {
    use ast::ExprKind as E;
    Some(match &ast[id].kind {
        E::Int(n) => Number::Int(*n),
        E::Float(x) => Number::Float(*x),
        E::Paren(inner) => number(ast, *inner)?,
        E::Unary(ast::UnaryOp::Neg, inner) => match number(ast, *inner)? {
            Number::Int(n) => Number::Int(n.wrapping_neg()),
            Number::Float(x) => Number::Float(-x),
        },
        _ => return None,
    })
}

fn int_arithmetic(op: BinaryOp, a: i32, b: i32) -> Option<i32> {
    Some(match op {
        BinaryOp::Add => a.wrapping_add(b),
        BinaryOp::Sub => a.wrapping_sub(b),
        BinaryOp::Mul => a.wrapping_mul(b),
        BinaryOp::Div if b == 0 => 0,
        BinaryOp::Mod if b == 0 => 0,
        BinaryOp::Div => a.wrapping_div(b),
        BinaryOp::Mod => a.wrapping_rem(b),
        BinaryOp::BitAnd => a & b,
        BinaryOp::BitOr => a | b,
        BinaryOp::BitXor => a ^ b,
        BinaryOp::Shl => a.wrapping_shl(b as u32),
        BinaryOp::Shr => a.wrapping_shr(b as u32),
        _ => return None,
    })
}

fn float_arithmetic(op: BinaryOp, a: f32, b: f32) -> Option<f32> {
    Some(match op {
        BinaryOp::Add => a + b,
        BinaryOp::Sub => a - b,
        BinaryOp::Mul => a * b,
        BinaryOp::Div if b == 0.0 => 0.0,
        BinaryOp::Div => a / b,
        _ => return None,
    })
}

fn join_numbers(values: Vec<MetaValue>) -> MetaValue {
    let mut all = Vec::new();
    for value in values {
        match value {
            MetaValue::Numbers(n) => all.extend(n),
            _ => return MetaValue::Unknown,
        }
    }
    MetaValue::Numbers(all)
}
