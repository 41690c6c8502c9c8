//! Single operations: operators, parts of variables, constructors. All others are built-in functions.

use super::{Builder, Result};
use crate::builtins;
use crate::hir::{BuiltinCall, Expr, ExprKind, Init, Lvalue, Step};
use crate::oso::{errors, text};
use crate::resolve::{convert_to, operators, unify_numbers};
use osl_ir::types::{Base, Type};
use osl_syntax::ast::{BinaryOp, UnaryOp};
use osl_syntax::span::Span;

impl Builder<'_, '_> {
    /// The expression of an operation, including the storing of its result.
    pub(super) fn op(&mut self, at: usize) -> Result<Expr> {
        let file = self.file;
        let Some(op) = file.ops.get(at) else { return Err(errors::jump(Span::default(), "no operation")) };
        let span = self.spans.get(at).copied().unwrap_or(op.span);
        let values = op.args.iter().map(|arg| self.operand(*arg, span)).collect::<Result<Vec<Expr>>>()?;
        let wrong = || errors::operation(op.span, format!("`{}` does not take these arguments", op.name));
        match (op.name, values.as_slice()) {
            ("aassign" | "compassign", [_, index, value]) => {
                let to = self.target(at, span)?;
                let to = part(to, index, None).ok_or_else(wrong)?;
                self.store(to, value.clone(), op.span)
            }
            ("mxcompassign", [_, row, column, value]) => {
                let to = self.target(at, span)?;
                let to = part(to, row, Some(column)).ok_or_else(wrong)?;
                self.store(to, value.clone(), op.span)
            }
            (name, values) if is_value(name) => {
                let (_, args) = values.split_first().ok_or_else(wrong)?;
                let to = self.target(at, span)?;
                let value = value(name, args, span).ok_or_else(wrong)?;
                self.store(to, value, op.span)
            }
            _ => self.library(at, values, span),
        }
    }

    /// The place of the first argument.
    pub(super) fn target(&mut self, at: usize, span: Span) -> Result<Lvalue> {
        let op = self.file.ops.get(at);
        match op.and_then(|op| op.args.first().copied()) {
            Some(arg) => self.place(arg, span),
            None => Err(errors::operation(op.map_or(span, |op| op.span), "an operation without a result")),
        }
    }

    /// The assignment of a value, converted to the type of its place.
    pub(super) fn store(&mut self, to: Lvalue, value: Expr, op: Span) -> Result<Expr> {
        let span = value.span;
        let zero =
            matches!(value.kind, ExprKind::Int(0)) || matches!(value.kind, ExprKind::Float(x) if x == 0.0);
        let value = if to.ty == Type::CLOSURE && zero {
            Expr { ty: to.ty, kind: ExprKind::NullClosure, span }
        } else if self.structs.assignable(to.ty, value.ty) {
            convert_to(to.ty, value)
        } else {
            let (to, from) = (self.structs.show(to.ty), self.structs.show(value.ty));
            return Err(errors::operation(op, format!("{from} cannot be stored as {to}")));
        };
        Ok(Expr { ty: to.ty, kind: ExprKind::Assign(to, Box::new(Init::Value(value))), span })
    }
}

/// The value of an operator, a part of a variable, or a constructor.
fn value(name: &str, args: &[Expr], span: Span) -> Option<Expr> {
    if let Some((_, op)) = text::OPERATORS.iter().find(|(n, _)| *n == name)
        && let [a, b] = args
    {
        return binary(*op, a.clone(), b.clone(), span);
    }
    match (name, args) {
        ("assign" | "arraycopy", [value]) => Some(value.clone()),
        ("neg", [value]) => unary(UnaryOp::Neg, value, span),
        ("compl", [value]) => unary(UnaryOp::Compl, value, span),
        ("aref" | "compref", [of, index]) => read(of, index, None, span),
        ("mxcompref", [of, row, column]) => read(of, row, Some(column), span),
        ("color", args) => triple(Type::COLOR, args, span),
        ("point", args) => triple(Type::POINT, args, span),
        ("vector", args) => triple(Type::VECTOR, args, span),
        ("normal", args) => triple(Type::NORMAL, args, span),
        ("matrix", args) => matrix(args, span),
        _ => None,
    }
}

/// Whether an operation returns a value without being a library function.
fn is_value(name: &str) -> bool {
    let others = [
        "assign",
        "arraycopy",
        "neg",
        "compl",
        "aref",
        "compref",
        "mxcompref",
        "color",
        "point",
        "vector",
        "normal",
        "matrix",
    ];
    // Compilers write `mod` only for the operator, and inline the function with this name.
    others.contains(&name) || text::OPERATORS.iter().any(|(n, _)| *n == name)
}

/// A part of a place: an element, a component or a cell.
fn part(place: Lvalue, index: &Expr, column: Option<&Expr>) -> Option<Lvalue> {
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

fn read(of: &Expr, index: &Expr, column: Option<&Expr>, span: Span) -> Option<Expr> {
    if let ExprKind::Read(place) = &of.kind {
        let place = part(place.clone(), index, column)?;
        return Some(Expr { ty: place.ty, kind: ExprKind::Read(place), span });
    }
    // A component of a constant.
    let (ExprKind::Triple(parts), ExprKind::Int(at), None) = (&of.kind, &index.kind, column) else {
        return None;
    };
    parts.get(usize::try_from(*at).ok()?).cloned()
}

fn unary(op: UnaryOp, value: &Expr, span: Span) -> Option<Expr> {
    let ty = operators::unary(op, value.ty)?;
    Some(Expr { ty, kind: ExprKind::Unary(op, Box::new(value.clone())), span })
}

fn binary(op: BinaryOp, a: Expr, b: Expr, span: Span) -> Option<Expr> {
    if matches!(op, BinaryOp::Eq | BinaryOp::Ne) && (a.ty == Type::CLOSURE || b.ty == Type::CLOSURE) {
        return has_closure(op, a, b, span);
    }
    // A function's color can stand for a point of its caller (an output argument), and weights a closure too.
    let weight = |e: Expr| if e.ty.is_triple() { convert_to(Type::COLOR, e) } else { e };
    let is_weighted = op == BinaryOp::Mul && (a.ty == Type::CLOSURE || b.ty == Type::CLOSURE);
    let (a, b) = if is_weighted { (weight(a), weight(b)) } else { (a, b) };
    let ty = operators::binary(op, a.ty, b.ty)?;
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

/// A triple of one or three numbers, in a space or not.
fn triple(ty: Type, args: &[Expr], span: Span) -> Option<Expr> {
    let float = |e: &Expr| e.ty.is_number().then(|| convert_to(Type::FLOAT, e.clone()));
    match args {
        [one] if one.ty.is_number() || one.ty.is_triple() => Some(convert_to(ty, one.clone())),
        [x, y, z] => {
            let parts = Box::new([float(x)?, float(y)?, float(z)?]);
            Some(Expr { ty, kind: ExprKind::Triple(parts), span })
        }
        [space, rest @ ..] if space.ty == Type::STRING && rest.len() == 3 => {
            let row = match ty.base {
                Base::Color => "color in space",
                Base::Point => "point in space",
                Base::Vector => "vector in space",
                _ => "normal in space",
            };
            constructor(row, ty, vec![space.clone(), triple(ty, rest, span)?], span)
        }
        _ => None,
    }
}

/// A matrix of one or sixteen numbers, in a space or not, or from one space to another.
fn matrix(args: &[Expr], span: Span) -> Option<Expr> {
    match args {
        [one] if one.ty.is_number() || one.ty == Type::MATRIX => Some(convert_to(Type::MATRIX, one.clone())),
        [from, to] if from.ty == Type::STRING && to.ty == Type::STRING => {
            constructor("matrix from spaces", Type::MATRIX, args.to_vec(), span)
        }
        [space, rest @ ..] if space.ty == Type::STRING && rest.iter().all(|e| e.ty.is_number()) => {
            constructor("matrix in space", Type::MATRIX, vec![space.clone(), matrix(rest, span)?], span)
        }
        _ if args.len() == 16 && args.iter().all(|e| e.ty.is_number()) => {
            let cells = args.iter().map(|e| convert_to(Type::FLOAT, e.clone())).collect();
            Some(Expr { ty: Type::MATRIX, kind: ExprKind::Matrix(cells), span })
        }
        _ => None,
    }
}

fn constructor(row: &str, ty: Type, args: Vec<Expr>, span: Span) -> Option<Expr> {
    let outputs = vec![None; args.len()];
    let call = BuiltinCall { row: builtins::find(row)?, overload: 0, args, outputs, converted: Vec::new() };
    Some(Expr { ty, kind: ExprKind::Builtin(call), span })
}
