//! Initialisers and conversions: how a value is converted to the type of its destination.

use super::Resolver;
use super::errors;
use crate::hir::{Expr, ExprKind, Init};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::{self, ExprId};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;

/// The context of an initialiser, which determines the permitted form of a list.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Site {
    /// A shader parameter: a list may be empty or short.
    Param,
    /// A local variable or return value: a list may be short.
    Local,
    /// A field or element within a list.
    Nested,
    /// An argument: a list must be complete.
    Argument,
}

/// The message for a float that becomes an int.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Loss {
    /// None: the caller has reported it.
    Judged,
    /// A warning with a fix that inserts a cast.
    Cast,
    /// A warning: the value is part of `op=`, so no cast can be inserted.
    Compound,
}

impl Resolver<'_> {
    /// The default of a shader parameter.
    pub(super) fn param_init(&mut self, ty: Type, id: ExprId) -> Init {
        self.init(ty, id, Site::Param)
    }

    /// The initialiser of a local.
    pub(super) fn local_init(&mut self, ty: Type, id: ExprId) -> Init {
        self.init(ty, id, Site::Local)
    }

    /// A field of a struct constructor.
    pub(super) fn field_init(&mut self, ty: Type, id: ExprId) -> Init {
        self.init(ty, id, Site::Nested)
    }

    /// A list as an argument.
    pub(super) fn argument_list(&mut self, ty: Type, id: ExprId) -> Init {
        self.init(ty, id, Site::Argument)
    }

    /// The value of a `return`. Unlike in assignments, float to int is an error.
    pub(super) fn returned(&mut self, ty: Type, id: ExprId) -> Init {
        if matches!(self.ast[id].kind, ast::ExprKind::InitList(_)) {
            return self.init(ty, id, Site::Local);
        }
        let value = self.expr(id, Some(ty));
        if ty == Type::CLOSURE && value.ty.is_number() {
            let d = errors::not_assignable(value.span, "a closure color", &self.show_a(value.ty));
            self.report(d.help("return a variable that holds the null closure"));
            return Init::Value(value);
        }
        if ty == Type::INT && value.ty == Type::FLOAT {
            self.report(
                errors::not_assignable(value.span, "an int", "a float")
                    .help("write `(int)` before the value")
                    .suggest("cast it", errors::cast_to_int(value.span, is_operand(&value))),
            );
            return Init::Value(value);
        }
        Init::Value(self.convert(ty, value, Loss::Judged))
    }

    fn init(&mut self, ty: Type, id: ExprId, site: Site) -> Init {
        let ast = self.ast;
        let ast::ExprKind::InitList(items) = &ast[id].kind else {
            let value = self.expr(id, Some(ty));
            return Init::Value(self.convert(ty, value, Loss::Cast));
        };
        let span = ast[id].span;
        if ty.is_error() {
            return Init::List(Vec::new());
        }
        let structure = ty.as_struct();
        let slots = match (ty.extent, ty.base) {
            (Extent::Array(n), _) => n as usize,
            (Extent::Unsized, _) => items.len(),
            (Extent::One, Base::Struct(id)) => self.structs.get(id).fields.len(),
            (Extent::One, Base::Matrix) => 16,
            (Extent::One, base) if base.is_triple() => 3,
            _ => {
                let message = format!("{} is not made from a list", self.show_a(ty));
                self.report(Diagnostic::error(errors::BAD_LIST, span, message));
                return Init::List(Vec::new());
            }
        };
        let by_parts = ty.is_array() || structure.is_some();
        if !by_parts {
            return Init::Value(self.construct(ty, items, span));
        }
        if items.is_empty() && site != Site::Param {
            self.report(Diagnostic::error(errors::BAD_LIST, span, "an empty list initialises nothing here"));
        }
        if structure.is_some_and(|id| self.is_open_struct(id.0)) {
            // The dropped fields may have been the destinations.
        } else if items.len() > slots {
            let message =
                format!("{} for the {slots} of {}", errors::count(items.len(), "value"), self.show_a(ty));
            self.report(Diagnostic::error(errors::BAD_LIST, span, message).label("too many values"));
        } else if items.len() < slots && site == Site::Argument {
            let message =
                format!("{} for the {slots} of {}", errors::count(items.len(), "value"), self.show_a(ty));
            self.report(
                Diagnostic::error(errors::BAD_LIST, span, message).label("an argument needs all of them"),
            );
        }
        let mut parts = Vec::new();
        for (index, item) in items.iter().take(slots).enumerate() {
            let part = match structure {
                Some(id) => self.structs.get(id).fields.get(index).map_or(Type::ERROR, |f| f.ty),
                None => ty.element(),
            };
            if site == Site::Local && ty.is_array() && self.ignores_element(part, *item) {
                parts.push(Init::Value(zero(part, ast[*item].span)));
                continue;
            }
            let inner = if site == Site::Argument { Site::Argument } else { Site::Nested };
            parts.push(self.init(part, *item, inner));
        }
        Init::List(parts)
    }

    /// Whether the element is a literal that published compilers accept but that cannot be intended: a string
    /// among numbers, or the reverse.
    fn ignores_element(&mut self, element: Type, item: ExprId) -> bool {
        let item = &self.ast[item];
        let given = match item.kind {
            ast::ExprKind::Str(_) if element.is_number() => "a string",
            ast::ExprKind::Int(_) if element == Type::STRING => "an int",
            ast::ExprKind::Float(_) if element == Type::STRING => "a float",
            _ => return false,
        };
        let d = errors::element_ignored(item.span, &self.show_a(element), given);
        self.report(d);
        true
    }

    /// The value converted to type `to`. Reports impossible conversions; `loss` selects the message for float
    /// to int.
    pub(super) fn convert(&mut self, to: Type, value: Expr, loss: Loss) -> Expr {
        if value.ty.is_error() && !to.is_error() {
            self.report_again(value.span, "assigned or returned");
        }
        if to.is_error() || value.ty.is_error() {
            return value;
        }
        if value.ty == Type::VOID {
            let d = Diagnostic::error(errors::VOID_VALUE, value.span, "this call has no value")
                .label("returns void");
            self.report(d);
            return Expr { ty: to, span: value.span, kind: ExprKind::Error };
        }
        if to == Type::CLOSURE && is_zero(&value) {
            return Expr { ty: to, span: value.span, kind: ExprKind::NullClosure };
        }
        if !self.structs.assignable(to, value.ty) {
            let (to_text, from) = (self.show_a(to), self.show_a(value.ty));
            let d = errors::not_assignable(value.span, &to_text, &from);
            self.report(match self.instead_of(to, &value) {
                Some(help) => d.help(help),
                None => d,
            });
            return Expr { ty: to, span: value.span, kind: ExprKind::Error };
        }
        if loss != Loss::Judged && to == Type::INT && value.ty == Type::FLOAT {
            let d = Diagnostic::warning(
                errors::PRECISION,
                value.span,
                "a float stored in an int loses its fraction",
            )
            .label("truncated toward zero");
            self.report(match loss {
                Loss::Cast => d
                    .help("write `(int)` before the value to say so")
                    .fix("cast it", errors::cast_to_int(value.span, is_operand(&value))),
                _ => d.help("write the operation out, with `(int)` before its value, to say so"),
            });
        }
        convert_to(to, value)
    }
}

/// Wraps the value in a conversion if its type differs. The caller has checked that the conversion exists.
pub(crate) fn convert_to(to: Type, value: Expr) -> Expr {
    if value.ty == to || to.is_array() || matches!(to.base, Base::Struct(_)) {
        return value;
    }
    let span = value.span;
    match (to, &value.kind) {
        (Type::FLOAT, ExprKind::Int(n)) => Expr { ty: to, span, kind: ExprKind::Float(*n as f32) },
        _ => Expr { ty: to, span, kind: ExprKind::Convert(Box::new(value)) },
    }
}

/// Zero, or the empty string.
fn zero(ty: Type, span: Span) -> Expr {
    let kind = match ty {
        Type::INT => ExprKind::Int(0),
        Type::FLOAT => ExprKind::Float(0.0),
        _ => ExprKind::Str("".into()),
    };
    Expr { ty, kind, span }
}

/// Whether a cast before it applies to the whole of it.
pub(super) fn is_operand(value: &Expr) -> bool {
    match &value.kind {
        ExprKind::Binary(..) | ExprKind::Ternary(..) | ExprKind::Assign(..) | ExprKind::Comma(_) => false,
        // The source text of a conversion is not visible here.
        ExprKind::Convert(_) => false,
        _ => true,
    }
}

fn is_zero(value: &Expr) -> bool {
    match &value.kind {
        ExprKind::Int(n) => *n == 0,
        ExprKind::Float(x) => *x == 0.0,
        // The parser of published compilers folds sums of literals, so `0+0` counts.
        ExprKind::Binary(_, a, b) => value.ty.is_number() && is_zero(a) && is_zero(b),
        ExprKind::Unary(_, a) => is_zero(a),
        _ => false,
    }
}
