//! Expressions: types are computed upward, the expected type is passed downward (overload choice by context).

use super::Resolver;
use super::errors;
use super::init::{Loss, convert_to};
use super::operators;
use crate::builtins;
use crate::hir::{Arg, Expr, ExprKind, Init, Lvalue};
use osl_ir::types::{Base, Type};
use osl_syntax::Reports;
use osl_syntax::ast::{self, BinaryOp, ExprId, UnaryOp};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;

impl Resolver<'_> {
    /// Resolves an expression. `expected` is the type preferred by its context, if there is one.
    pub(super) fn expr(&mut self, id: ExprId, expected: Option<Type>) -> Expr {
        let expr = self.resolve_expr(id, expected);
        if let Some(recorder) = &mut self.recorder {
            recorder.expression(self.ast[id].span, expr.ty);
        }
        expr
    }

    fn resolve_expr(&mut self, id: ExprId, expected: Option<Type>) -> Expr {
        let ast = self.ast;
        let span = ast[id].span;
        let error = Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        let of = |ty, kind| Expr { ty, kind, span };
        match &ast[id].kind {
            ast::ExprKind::Int(n) => of(Type::INT, ExprKind::Int(*n)),
            ast::ExprKind::Float(x) => of(Type::FLOAT, ExprKind::Float(*x)),
            ast::ExprKind::Str(s) => of(Type::STRING, ExprKind::Str(s.clone())),
            ast::ExprKind::Name(_) | ast::ExprKind::Index(..) | ast::ExprKind::Field(..) => {
                if !self.is_lvalue(id) {
                    let d = Diagnostic::error(
                        errors::NOT_AN_LVALUE,
                        span,
                        "only variables have elements and members",
                    )
                    .help("store the value in a variable first");
                    self.report(d);
                    return error;
                }
                match self.place(id) {
                    Some(place) => of(place.ty, ExprKind::Read(place)),
                    None => error,
                }
            }
            ast::ExprKind::Paren(inner) => Expr { span, ..self.expr(*inner, expected) },
            ast::ExprKind::Comma(list) => self.comma(list, expected, span),
            ast::ExprKind::Unary(op, inner) => self.unary(*op, *inner, expected, span),
            ast::ExprKind::Binary(..) => self.chain(id, expected),
            ast::ExprKind::Assign { op, target, value } => self.assign(*op, *target, *value, span),
            ast::ExprKind::Step { prefix, increment, target } => {
                let Some(place) = self.target(*target, "step") else { return error };
                let ty = place.ty;
                if ty == Type::STRING {
                    // Published compilers accept it, and the string stays unchanged.
                    self.report(errors::idle_step(span, "string"));
                    return of(ty, ExprKind::Read(place));
                }
                let steps = !ty.is_array() && (ty.is_number() || ty.is_triple() || ty == Type::MATRIX);
                if !steps && !ty.is_error() {
                    let message = format!("{} cannot be stepped", self.show_a(ty));
                    self.report(Diagnostic::error(errors::BAD_OPERANDS, span, message));
                    return error;
                }
                of(ty, ExprKind::Step { prefix: *prefix, increment: *increment, place })
            }
            ast::ExprKind::Ternary(c, a, b) => self.ternary(*c, *a, *b, expected, span),
            ast::ExprKind::Cast(spec, inner) => {
                let ty = self.type_spec(spec);
                let value = self.expr(*inner, Some(ty));
                self.cast(ty, value, span)
            }
            ast::ExprKind::Construct(spec, args) => {
                let ty = self.type_spec(spec);
                self.construct(ty, args, span)
            }
            ast::ExprKind::Call(name, args) => self.call(name, args, expected, span),
            ast::ExprKind::InitList(_) => {
                self.report(Diagnostic::error(errors::BAD_LIST, span, "a list may not stand here"));
                error
            }
            ast::ExprKind::Error => error,
        }
    }

    /// An expression whose value is used.
    pub(super) fn value(&mut self, id: ExprId, expected: Option<Type>) -> Expr {
        let value = self.expr(id, expected);
        self.used(value)
    }

    /// The value of an expression, or an error if it has none.
    pub(super) fn used(&mut self, value: Expr) -> Expr {
        if value.ty == Type::VOID {
            let d = Diagnostic::error(errors::VOID_VALUE, value.span, "this call has no value")
                .label("returns void");
            self.report(d);
            return Expr { ty: Type::ERROR, kind: ExprKind::Error, span: value.span };
        }
        value
    }

    fn comma(&mut self, list: &[ExprId], expected: Option<Type>, span: Span) -> Expr {
        let last = list.len().saturating_sub(1);
        let values: Vec<Expr> = list
            .iter()
            .enumerate()
            .map(|(i, e)| self.expr(*e, if i == last { expected } else { None }))
            .collect();
        let ty = values.last().map_or(Type::ERROR, |v| v.ty);
        Expr { ty, kind: ExprKind::Comma(values), span }
    }

    fn unary(&mut self, op: UnaryOp, inner: ExprId, expected: Option<Type>, span: Span) -> Expr {
        let operand = self.value(inner, expected);
        if operand.ty.is_error() {
            if op == UnaryOp::Not {
                return self.truth(span);
            }
            self.report_again(operand.span, "an operand");
            return operand;
        }
        if let Some(call) = self.operator_call(operators::unary_overload_name(op), &[&operand], span) {
            return call;
        }
        match (op, &operand.kind) {
            (UnaryOp::Neg, ExprKind::Int(n)) => {
                return Expr { ty: Type::INT, kind: ExprKind::Int(n.wrapping_neg()), span };
            }
            (UnaryOp::Neg, ExprKind::Float(x)) => {
                return Expr { ty: Type::FLOAT, kind: ExprKind::Float(-x), span };
            }
            _ => {}
        }
        match operators::unary(op, operand.ty) {
            Some(ty) => Expr { ty, kind: ExprKind::Unary(op, Box::new(operand)), span },
            None => {
                let symbol = match op {
                    UnaryOp::Neg => "-",
                    UnaryOp::Not => "!",
                    UnaryOp::Compl => "~",
                };
                let message = format!("`{symbol}` does not take {}", self.show_a(operand.ty));
                self.report(Diagnostic::error(errors::BAD_OPERANDS, span, message));
                Expr { ty: Type::ERROR, kind: ExprKind::Error, span }
            }
        }
    }

    /// The value of a logical operator whose operand has an error. The reference takes it for an int.
    fn truth(&self, span: Span) -> Expr {
        let ty = if self.reports == Reports::AsReference { Type::INT } else { Type::ERROR };
        Expr { ty, kind: ExprKind::Error, span }
    }

    /// `left op right` of resolved operands.
    pub(super) fn combine(&mut self, op: BinaryOp, left: Expr, right: Expr, span: Span) -> Expr {
        if left.ty.is_error() || right.ty.is_error() {
            if matches!(op, BinaryOp::And | BinaryOp::Or) {
                return self.truth(span);
            }
            if left.ty != right.ty {
                let failed = if left.ty.is_error() { left.span } else { right.span };
                self.report_again(failed, "an operand");
            }
            return Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        }
        if let Some(name) = operators::overload_name(op)
            && let Some(call) = self.operator_call(name, &[&left, &right], span)
        {
            return call;
        }
        let Some(ty) = operators::binary(op, left.ty, right.ty) else {
            let (l, r) = (self.show_a(left.ty), self.show_a(right.ty));
            let d = Diagnostic::error(
                errors::BAD_OPERANDS,
                span,
                format!("`{}` does not take {l} and {r}", operators::symbol(op)),
            )
            .also(left.span, l)
            .also(right.span, r);
            let d = match operators::instead(op, left.ty, right.ty) {
                Some(help) => d.help(help),
                None => d,
            };
            self.report(d);
            return Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        };
        let zero =
            matches!(right.kind, ExprKind::Int(0)) || matches!(right.kind, ExprKind::Float(x) if x == 0.0);
        if zero && matches!(op, BinaryOp::Div | BinaryOp::Mod) {
            self.report(errors::division_by_zero(right.span));
        }
        let (left, right) = if matches!(op, BinaryOp::And | BinaryOp::Or) {
            (left, right)
        } else {
            unify_numbers(left, right)
        };
        Expr { ty, kind: ExprKind::Binary(op, Box::new(left), Box::new(right)), span }
    }

    fn assign(&mut self, op: Option<BinaryOp>, target: ExprId, value: ExprId, span: Span) -> Expr {
        let error = Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        let Some(place) = self.target(target, "assign to") else {
            self.expr(value, None);
            return error;
        };
        let ty = place.ty;
        if matches!(self.ast[value].kind, ast::ExprKind::InitList(_)) {
            let d = Diagnostic::error(
                errors::BAD_LIST,
                self.ast[value].span,
                "a list initialises a declaration, it cannot be assigned",
            );
            self.report(d);
            return error;
        }
        let mut right = self.value(value, Some(ty));
        let value = match op {
            None => {
                step_in_place(&place, &mut right);
                right
            }
            Some(op) => {
                // The index expressions of the place are evaluated for the read and again for the write.
                let left = Expr { ty, kind: ExprKind::Read(place.clone()), span: place.span };
                self.combine(op, left, right, span)
            }
        };
        let loss = if op.is_some() { Loss::Compound } else { Loss::Cast };
        let value = self.convert(ty, value, loss);
        Expr { ty, kind: ExprKind::Assign(place, Box::new(Init::Value(value))), span }
    }

    fn ternary(&mut self, cond: ExprId, a: ExprId, b: ExprId, expected: Option<Type>, span: Span) -> Expr {
        let cond = self.value(cond, Some(Type::INT));
        let (a, b) = (self.value(a, expected), self.value(b, expected));
        let error = Expr { ty: Type::ERROR, kind: ExprKind::Error, span };
        if cond.ty.is_error() || a.ty.is_error() || b.ty.is_error() {
            let failed = match (a.ty.is_error(), b.ty.is_error()) {
                // The reference knows the type whatever the condition is.
                (false, false) if self.reports == Reports::AsReference => {
                    return Expr { ty: operators::ternary(a.ty, b.ty).unwrap_or(Type::ERROR), ..error };
                }
                (true, false) => a.span,
                (false, true) => b.span,
                _ => return error,
            };
            self.report_again(failed, "an operand");
            return error;
        }
        if !operators::has_truth(cond.ty) || cond.ty == Type::CLOSURE {
            let message = format!("{} has no truth value here", self.show_a(cond.ty));
            self.report(Diagnostic::error(errors::BAD_CONDITION, cond.span, message));
            return error;
        }
        let Some(ty) = operators::ternary(a.ty, b.ty) else {
            let (x, y) = (self.show_a(a.ty), self.show_a(b.ty));
            let d = Diagnostic::error(errors::BAD_TERNARY, span, format!("{x} and {y} have no common type"))
                .also(a.span, x)
                .also(b.span, y);
            self.report(d);
            return error;
        };
        let (a, b) = (convert_to(ty, a), convert_to(ty, b));
        Expr { ty, kind: ExprKind::Ternary(Box::new(cond), Box::new(a), Box::new(b)), span }
    }

    fn cast(&mut self, ty: Type, value: Expr, span: Span) -> Expr {
        if ty.is_error() || value.ty.is_error() {
            self.report_again(value.span, "cast");
            return Expr { ty, kind: ExprKind::Error, span };
        }
        let number_to = ty.is_number() || ty.is_triple() || ty == Type::MATRIX;
        let ok =
            value.ty == ty || (value.ty.is_number() && number_to) || (value.ty.is_triple() && ty.is_triple());
        if !ok {
            let (to, from) = (self.show_a(ty), self.show_a(value.ty));
            self.report(Diagnostic::error(errors::BAD_CAST, span, format!("cannot cast {from} to {to}")));
            return Expr { ty, kind: ExprKind::Error, span };
        }
        Expr { span, ..convert_to(ty, value) }
    }

    /// A constructor of a built-in type, or an initialiser list in its place.
    pub(super) fn construct(&mut self, ty: Type, args: &[ExprId], span: Span) -> Expr {
        let one = if ty == Type::MATRIX { None } else { Some(ty) };
        let each = if ty == Type::MATRIX { None } else { Some(Type::FLOAT) };
        let expected = if args.len() == 1 { one } else { each };
        let values: Vec<Expr> = args.iter().map(|e| self.value(*e, expected)).collect();
        let unmade = if self.reports == Reports::AsReference { Type::ERROR } else { ty };
        if let Some(failed) = values.iter().find(|v| v.ty.is_error()) {
            self.report_again(failed.span, "an argument");
            return Expr { ty: unmade, kind: ExprKind::Error, span };
        }
        let numbers = |v: &[Expr]| v.iter().all(|e| e.ty.is_number());
        let made = match (ty.base, values.len()) {
            (Base::Int | Base::Float, 1) if numbers(&values) => Some(Shape::Convert),
            (Base::Matrix, 1) if numbers(&values) || values[0].ty == Type::MATRIX => Some(Shape::Convert),
            (Base::Matrix, 16) if numbers(&values) => Some(Shape::Elements),
            (Base::Matrix, 2)
                if values[0].ty == Type::STRING
                    && (values[1].ty == Type::STRING || values[1].ty.is_number()) =>
            {
                Some(Shape::Space)
            }
            (Base::Matrix, 17) if values[0].ty == Type::STRING && numbers(&values[1..]) => Some(Shape::Space),
            (base, 1) if base.is_triple() && (numbers(&values) || values[0].ty.is_triple()) => {
                Some(Shape::Convert)
            }
            (base, 3) if base.is_triple() && numbers(&values) => Some(Shape::Elements),
            (base, 4) if base.is_triple() && values[0].ty == Type::STRING && numbers(&values[1..]) => {
                Some(Shape::Space)
            }
            _ => None,
        };
        let Some(shape) = made else {
            let types: Vec<String> = values.iter().map(|v| self.show(v.ty)).collect();
            let what = self.show_a(ty);
            let d = Diagnostic::error(
                errors::BAD_CONSTRUCTOR,
                span,
                format!("cannot make {what} from ({})", types.join(", ")),
            )
            .help(constructor_help(ty));
            self.report(d);
            return Expr { ty: unmade, kind: ExprKind::Error, span };
        };
        self.constructed(shape, ty, values, span)
    }

    fn constructed(&mut self, shape: Shape, ty: Type, mut values: Vec<Expr>, span: Span) -> Expr {
        let float = |e: Expr| convert_to(Type::FLOAT, e);
        let kind = match shape {
            Shape::Convert => match values.pop() {
                Some(value) => return Expr { span, ..convert_to(ty, value) },
                None => ExprKind::Error,
            },
            Shape::Elements if ty == Type::MATRIX => {
                ExprKind::Matrix(values.into_iter().map(float).collect())
            }
            Shape::Elements => match <[Expr; 3]>::try_from(values) {
                Ok(three) => ExprKind::Triple(Box::new(three.map(float))),
                Err(_) => ExprKind::Error,
            },
            Shape::Space => {
                let rest = values.split_off(1);
                let row = match (ty.base, rest.first().map(|e| e.ty)) {
                    (Base::Matrix, Some(Type::STRING)) => "matrix from spaces",
                    (Base::Matrix, _) => "matrix in space",
                    (Base::Color, _) => "color in space",
                    (Base::Point, _) => "point in space",
                    (Base::Vector, _) => "vector in space",
                    _ => "normal in space",
                };
                let inner = match ty.base {
                    Base::Matrix if rest.len() == 16 => vec![Expr {
                        ty: Type::MATRIX,
                        span,
                        kind: ExprKind::Matrix(rest.into_iter().map(float).collect()),
                    }],
                    Base::Matrix => rest
                        .into_iter()
                        .map(|e| if e.ty.is_number() { convert_to(Type::MATRIX, e) } else { e })
                        .collect(),
                    _ => match <[Expr; 3]>::try_from(rest) {
                        Ok(three) => {
                            vec![Expr { ty, span, kind: ExprKind::Triple(Box::new(three.map(float))) }]
                        }
                        Err(rest) => rest,
                    },
                };
                values.extend(inner);
                return self.builtin_constructor(row, ty, values, span);
            }
        };
        Expr { ty, kind, span }
    }

    fn builtin_constructor(&mut self, row: &str, ty: Type, args: Vec<Expr>, span: Span) -> Expr {
        let kind = match builtins::find(row) {
            Some(row) => {
                let outputs = vec![None; args.len()];
                let converted = Vec::new();
                ExprKind::Builtin(crate::hir::BuiltinCall { row, overload: 0, args, outputs, converted })
            }
            None => ExprKind::Error,
        };
        Expr { ty, kind, span }
    }

    /// The argument for a formal of a user function: by reference if possible.
    pub(super) fn argument(&mut self, formal: (Type, bool), value: Expr) -> Arg {
        let (ty, output) = formal;
        let plain = match &value.kind {
            ExprKind::Read(place) if self.structs.equivalent(ty, place.ty) => Some(place.clone()),
            _ => None,
        };
        match plain {
            Some(place) => {
                if output {
                    self.check_writable(place.var, place.span, true);
                }
                if place.is_plain() {
                    return Arg::Alias(place);
                }
                let back = (output && !place.is_only_copied_in()).then(|| place.clone());
                Arg::Copy { value: Init::Value(value), back }
            }
            None => Arg::Copy { value: Init::Value(convert_to(ty, value)), back: None },
        }
    }
}

#[derive(Clone, Copy)]
enum Shape {
    Convert,
    Elements,
    Space,
}

/// An int next to a float, triple or matrix becomes a float.
pub(crate) fn unify_numbers(left: Expr, right: Expr) -> (Expr, Expr) {
    let lift = |e: Expr, other: Type| {
        if e.ty == Type::INT && other != Type::INT && other != Type::CLOSURE {
            convert_to(Type::FLOAT, e)
        } else {
            e
        }
    };
    let (lt, rt) = (left.ty, right.ty);
    let float = |e: Expr| if e.ty == Type::INT { convert_to(Type::FLOAT, e) } else { e };
    if lt == Type::CLOSURE || rt == Type::CLOSURE {
        return (float(left), float(right));
    }
    (lift(left, rt), lift(right, lt))
}

fn constructor_help(ty: Type) -> &'static str {
    match ty.base {
        Base::Int | Base::Float => "it takes one number",
        Base::Matrix => "it takes 1 or 16 numbers, a space name before them, or two space names",
        Base::String => "strings have no constructor: use `format`",
        _ => "it takes 1 or 3 numbers, or a space name and 3 numbers",
    }
}

/// `i = i++`: the old value is stored in `i` itself, before the increment, so `i` has the new value after it.
fn step_in_place(target: &Lvalue, value: &mut Expr) {
    match &mut value.kind {
        ExprKind::Step { prefix, place, .. } if place.is_same_variable(target) => *prefix = true,
        ExprKind::Ternary(_, a, b) => {
            step_in_place(target, a);
            step_in_place(target, b);
        }
        ExprKind::Comma(list) => {
            if let Some(last) = list.last_mut() {
                step_in_place(target, last);
            }
        }
        _ => {}
    }
}
