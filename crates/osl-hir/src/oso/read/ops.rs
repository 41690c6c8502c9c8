//! Single operations: operators, parts of variables, constructors. All others are built-in functions.

use super::file::Op;
use super::parts::{self, binary, part};
use super::{Builder, Result};
use crate::builtins;
use crate::hir::{BuiltinCall, Expr, ExprKind, Init, Lvalue};
use crate::oso::{errors, text};
use crate::resolve::{convert_to, operators};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::UnaryOp;
use osl_syntax::span::Span;

impl Builder<'_, '_> {
    /// The expression of an operation, including the storing of its result.
    pub(super) fn op(&mut self, at: usize) -> Result<Expr> {
        let file = self.file;
        let Some(op) = file.ops.get(at) else { return Err(errors::jump(Span::default(), "no operation")) };
        let span = self.spans.get(at).copied().unwrap_or(op.span);
        if let [to, of] = op.args.as_slice()
            && let Some(answer) = self.symbols.about_struct(op.name, of.0)
        {
            let to = self.place(*to, span)?;
            return self.store(to, Expr { ty: Type::INT, kind: ExprKind::Int(answer), span }, op.span);
        }
        let values = op.args.iter().map(|arg| self.operand(*arg, span)).collect::<Result<Vec<Expr>>>()?;
        let values = if MIXES.contains(&op.name) { of_result(values) } else { values };
        let wrong = || errors::operation(op.span, format!("`{}` does not take these arguments", op.name));
        match (name(op.name, &values), values.as_slice()) {
            ("clamp", [to, args @ ..]) => {
                let value = parts::clamp(to.ty, args, span).ok_or_else(wrong)?;
                let to = self.target(at, span)?;
                self.store(to, value, op.span)
            }
            ("assign" | "arraycopy", [to, from]) if lengths_differ(to.ty, from.ty) => {
                self.copy_elements(to, from, op.span)
            }
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
            (name, _) => self.library(at, name, values, span),
        }
    }

    /// Copies the elements that both arrays have. The longer array keeps the rest.
    fn copy_elements(&mut self, to: &Expr, from: &Expr, op: Span) -> Result<Expr> {
        let length = |ty: Type| if let Extent::Array(n) = ty.extent { n } else { 0 };
        let count = length(to.ty).min(length(from.ty));
        self.symbols.charge(u64::from(count), &self.limits, op)?;
        let mut list = Vec::new();
        for at in 0..count {
            let at = Expr { ty: Type::INT, kind: ExprKind::Int(at as i32), span: to.span };
            let (Some(place), Some(value)) = (element(to, &at), element(from, &at)) else { break };
            let value = Expr { ty: value.ty, kind: ExprKind::Read(value), span: to.span };
            list.push(self.store(place, value, op)?);
        }
        Ok(Expr { ty: Type::VOID, kind: ExprKind::Comma(list), span: to.span })
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

/// Operations on numbers that convert each operand to the type of the result before they compute.
const MIXES: [&str; 9] = ["add", "sub", "mul", "div", "mod", "fmod", "min", "max", "clamp"];

/// The operands of such an operation: its result, which comes first, is a number or is left alone.
fn of_result(values: Vec<Expr>) -> Vec<Expr> {
    let Some(ty) = values.first().map(|to| to.ty).filter(|ty| ty.is_number()) else { return values };
    values.into_iter().map(|e| if e.ty.is_number() { convert_to(ty, e) } else { e }).collect()
}

/// The name of the operation that runs: some have several names, and `mod` of floats is the function `fmod`.
fn name<'n>(name: &'n str, values: &[Expr]) -> &'n str {
    match name {
        "mod" | "fmod" if values.iter().all(|e| e.ty == Type::INT) => "mod",
        "mod" => "fmod",
        "strtoi" => "stoi",
        "strtof" => "stof",
        name => name,
    }
}

/// The symbol whose part an operation reads or writes.
pub(super) fn divided<'a>(op: &Op<'a>) -> Option<&'a str> {
    let at = match op.name {
        "compassign" | "mxcompassign" => 0,
        "compref" | "mxcompref" => 1,
        _ => return None,
    };
    op.args.get(at).map(|(name, _)| *name)
}

fn lengths_differ(a: Type, b: Type) -> bool {
    matches!((a.extent, b.extent), (Extent::Array(n), Extent::Array(m)) if n != m)
}

/// The element of an array.
fn element(array: &Expr, index: &Expr) -> Option<Lvalue> {
    let ExprKind::Read(place) = &array.kind else { return None };
    part(place.clone(), index, None)
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
    others.contains(&name) || text::OPERATORS.iter().any(|(n, _)| *n == name)
}

fn read(of: &Expr, index: &Expr, column: Option<&Expr>, span: Span) -> Option<Expr> {
    let ExprKind::Read(place) = &of.kind else { return None };
    let place = part(place.clone(), index, column)?;
    Some(Expr { ty: place.ty, kind: ExprKind::Read(place), span })
}

fn unary(op: UnaryOp, value: &Expr, span: Span) -> Option<Expr> {
    let ty = operators::unary(op, value.ty)?;
    Some(Expr { ty, kind: ExprKind::Unary(op, Box::new(value.clone())), span })
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
