//! Parts of values, and the operators. Operators on triples and matrices that the language has only for
//! numbers are expanded into their components.

use crate::builtins;
use crate::hir::{BuiltinCall, Expr, ExprKind, Lvalue, Step};
use crate::resolve::{convert_to, operators, unify_numbers};
use osl_ir::types::Type;
use osl_syntax::ast::{BinaryOp, UnaryOp};
use osl_syntax::span::Span;

/// A part of a place: an element, a component or a cell.
pub(super) fn part(place: Lvalue, index: &Expr, column: Option<&Expr>) -> Option<Lvalue> {
    let int = |e: &Expr| (e.ty == Type::INT).then(|| Box::new(e.clone()));
    let (step, ty) = match column {
        Some(column) if place.ty == Type::MATRIX => (Step::Cell(int(index)?, int(column)?), Type::FLOAT),
        None if place.ty.is_array() => (Step::Element(int(index)?), place.ty.element()),
        None if place.ty.is_triple() => (Step::Component(int(index)?), Type::FLOAT),
        _ => return None,
    };
    let mut place = place;
    place.path.push(step);
    Some(Lvalue { ty, ..place })
}

/// The component of a triple or the cell of a matrix, by its index; a number stands for each of them.
pub(super) fn component(e: &Expr, at: usize) -> Option<Expr> {
    let int = |n: usize| Expr { ty: Type::INT, kind: ExprKind::Int(n as i32), span: e.span };
    match &e.kind {
        _ if e.ty.is_number() => Some(convert_to(Type::FLOAT, e.clone())),
        ExprKind::Triple(parts) => parts.get(at).cloned(),
        ExprKind::Matrix(cells) => cells.get(at).cloned(),
        ExprKind::Read(place) => {
            let place = match e.ty {
                Type::MATRIX => part(place.clone(), &int(at / 4), Some(&int(at % 4))),
                _ => part(place.clone(), &int(at), None),
            }?;
            Some(Expr { ty: place.ty, kind: ExprKind::Read(place), span: e.span })
        }
        _ => None,
    }
}

/// A triple or a matrix of the results for the components of the arguments.
pub(super) fn each(
    ty: Type,
    args: &[Expr],
    span: Span,
    of: impl Fn(Vec<Expr>) -> Option<Expr>,
) -> Option<Expr> {
    let one = |at| of(args.iter().map(|e| component(e, at)).collect::<Option<_>>()?);
    let kind = match ty {
        Type::MATRIX => ExprKind::Matrix((0..16).map(one).collect::<Option<_>>()?),
        _ if ty.is_triple() => ExprKind::Triple(Box::new([one(0)?, one(1)?, one(2)?])),
        _ => return None,
    };
    Some(Expr { ty, kind, span })
}

/// The value of a binary operator.
pub(super) fn binary(op: BinaryOp, a: Expr, b: Expr, span: Span) -> Option<Expr> {
    if matches!(op, BinaryOp::Eq | BinaryOp::Ne) && (a.ty == Type::CLOSURE || b.ty == Type::CLOSURE) {
        return has_closure(op, a, b, span);
    }
    // A function's color can stand for a point of its caller (an output argument), and weights a closure too.
    let weight = |e: Expr| if e.ty.is_triple() { convert_to(Type::COLOR, e) } else { e };
    let is_weighted = op == BinaryOp::Mul && (a.ty == Type::CLOSURE || b.ty == Type::CLOSURE);
    let (a, b) = if is_weighted { (weight(a), weight(b)) } else { (a, b) };
    let Some(ty) = operators::binary(op, a.ty, b.ty) else {
        return match op {
            BinaryOp::Lt | BinaryOp::Le | BinaryOp::Gt | BinaryOp::Ge => ordered(op, &a, &b, span),
            BinaryOp::Add | BinaryOp::Sub if a.ty == Type::MATRIX || b.ty == Type::MATRIX => {
                matrix_sum(op, &a, &b, span)
            }
            _ => None,
        };
    };
    let (a, b) = if matches!(op, BinaryOp::And | BinaryOp::Or) { (a, b) } else { unify_numbers(a, b) };
    Some(Expr { ty, kind: ExprKind::Binary(op, Box::new(a), Box::new(b)), span })
}

/// A closure compared with 0: whether there is one.
fn has_closure(op: BinaryOp, a: Expr, b: Expr, span: Span) -> Option<Expr> {
    let closure = if a.ty == Type::CLOSURE { a } else { b };
    let not = |e: Expr| Expr { ty: Type::INT, kind: ExprKind::Unary(UnaryOp::Not, Box::new(e)), span };
    let none = not(closure);
    Some(if op == BinaryOp::Eq { none } else { not(none) })
}

/// A sum or difference of matrices, or of a matrix and a number.
pub(super) fn matrix_sum(op: BinaryOp, a: &Expr, b: &Expr, span: Span) -> Option<Expr> {
    let args = [a.clone(), b.clone()];
    each(Type::MATRIX, &args, span, |pair| {
        let [a, b] = <[Expr; 2]>::try_from(pair).ok()?;
        binary(op, a, b, span)
    })
}

/// `x` clamped to `lo` first and then to `hi`, which wins if they are reversed. The function of the language
/// has the other order, and another result for NaN.
pub(super) fn clamp(to: Type, args: &[Expr], span: Span) -> Option<Expr> {
    if !to.is_number() {
        return each(to, args, span, |parts| clamp(Type::FLOAT, &parts, span));
    }
    let [x, lo, hi] = args else { return None };
    let choose = |op, a: Expr, b: &Expr| {
        let cond = binary(op, a.clone(), b.clone(), span)?;
        let kind = ExprKind::Ternary(Box::new(cond), Box::new(b.clone()), Box::new(a));
        Some(Expr { ty: to, kind, span })
    };
    args.iter().all(|e| e.ty == to).then_some(())?;
    choose(BinaryOp::Gt, choose(BinaryOp::Lt, x.clone(), lo)?, hi)
}

/// A comparison by order: of triples, for all components; of strings, by their hashes, since the format
/// compares addresses, whose order means nothing.
pub(super) fn ordered(op: BinaryOp, a: &Expr, b: &Expr, span: Span) -> Option<Expr> {
    if a.ty == Type::STRING && b.ty == Type::STRING {
        return binary(op, hash(a)?, hash(b)?, span);
    }
    let one = |at| binary(op, component(a, at)?, component(b, at)?, span);
    binary(BinaryOp::And, binary(BinaryOp::And, one(0)?, one(1)?, span)?, one(2)?, span)
}

fn hash(text: &Expr) -> Option<Expr> {
    let row = builtins::find("hash")?;
    let is_text = |s: &builtins::Signature| {
        matches!(s.params[..], [builtins::Param { ty: builtins::ParamType::Of(Type::STRING), .. }])
    };
    let overload = row.signatures().iter().position(is_text)?;
    let call =
        BuiltinCall { row, overload, args: vec![text.clone()], outputs: vec![None], converted: Vec::new() };
    Some(Expr { ty: Type::INT, kind: ExprKind::Builtin(call), span: text.span })
}
