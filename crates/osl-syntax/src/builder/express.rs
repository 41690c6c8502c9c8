//! Expressions.

use super::Builder;
use crate::ast::{BinaryOp, ExprId, ExprKind, Name, TypeSpec};
use crate::errors;

/// Maximum number of consecutive indices: those of an array of matrices.
const MAX_INDICES: usize = 3;

impl Builder<'_> {
    /// `a, b, c`; a single expression stays itself.
    pub(crate) fn comma(&mut self, l: u32, r: u32, parts: Vec<ExprId>) -> ExprId {
        match parts.as_slice() {
            [one] => *one,
            _ => self.expr(l, r, ExprKind::Comma(parts)),
        }
    }

    /// `( inner )`.
    pub(crate) fn paren(&mut self, l: u32, r: u32, inner: ExprId) -> ExprId {
        if matches!(self.get(inner).kind, ExprKind::Comma(_)) {
            self.report(errors::comma_operator(self.span(l, r)));
        }
        self.expr(l, r, ExprKind::Paren(inner))
    }

    /// `callee(args)`.
    pub(crate) fn call(&mut self, l: u32, r: u32, callee: Name, args: Vec<ExprId>) -> ExprId {
        self.check_lists(&args);
        self.expr(l, r, ExprKind::Call(callee, args))
    }

    /// `type(args)`.
    pub(crate) fn construct(&mut self, l: u32, r: u32, ty: TypeSpec, args: Vec<ExprId>) -> ExprId {
        self.check_lists(&args);
        self.expr(l, r, ExprKind::Construct(ty, args))
    }

    /// `{ values }`.
    pub(crate) fn init_list(&mut self, l: u32, r: u32, values: Vec<ExprId>) -> ExprId {
        self.check_lists(&values);
        self.expr(l, r, ExprKind::InitList(values))
    }

    /// Reports empty lists.
    pub(super) fn check_lists<'i>(&mut self, values: impl IntoIterator<Item = &'i ExprId>) {
        for id in values {
            let value = self.get(*id);
            if matches!(&value.kind, ExprKind::InitList(v) if v.is_empty()) {
                self.report(errors::empty_initializer(value.span));
            }
        }
    }

    /// `++x`, `x--` and the like.
    pub(crate) fn step(&mut self, l: u32, r: u32, prefix: bool, increment: bool, target: ExprId) -> ExprId {
        self.check_target(target, if increment { "increment" } else { "decrement" });
        self.expr(l, r, ExprKind::Step { prefix, increment, target })
    }

    /// `base[index]`.
    pub(crate) fn index(&mut self, l: u32, r: u32, base: ExprId, index: ExprId) -> ExprId {
        let mut n_indices = 1;
        let mut inner = base;
        while let ExprKind::Index(next, _) = self.get(inner).kind {
            n_indices += 1;
            inner = next;
        }
        if !self.is_lvalue(base) {
            let e = self.get(base);
            self.report(errors::not_indexable(e.span, "index", matches!(e.kind, ExprKind::Str(_))));
        } else if n_indices == MAX_INDICES + 1 {
            self.report(errors::too_many_indices(self.get(index).span));
        }
        self.expr(l, r, ExprKind::Index(base, index))
    }

    /// `base.field`.
    pub(crate) fn field(&mut self, l: u32, r: u32, base: ExprId, field: Name) -> ExprId {
        if !self.is_lvalue(base) {
            self.report(errors::not_indexable(self.get(base).span, "take a field of", false));
        }
        self.expr(l, r, ExprKind::Field(base, field))
    }

    /// Whether an expression has the form of a variable: a name with fields and indices. The bases were
    /// checked when they were made, so only the outermost form is examined; error nodes pass, since they were
    /// reported already.
    fn is_lvalue(&self, id: ExprId) -> bool {
        matches!(
            self.get(id).kind,
            ExprKind::Name(_) | ExprKind::Index(..) | ExprKind::Field(..) | ExprKind::Error
        )
    }

    fn check_target(&mut self, target: ExprId, action: &str) {
        if !self.is_lvalue(target) {
            self.report(errors::not_assignable(self.get(target).span, action));
        }
    }

    /// `target = value`. An assignment may be the right operand of any operator, where it binds looser than
    /// everything on its right: `a + b = c` is `a + (b = c)`. So its target is the last operand on its left.
    pub(crate) fn assign(
        &mut self,
        l: u32,
        r: u32,
        op: Option<BinaryOp>,
        left: ExprId,
        value: ExprId,
    ) -> ExprId {
        let Some((rebuild, inner)) = self.split_last(left) else {
            self.check_target(left, "assign to");
            return self.expr(l, r, ExprKind::Assign { op, target: left, value });
        };
        let end = self.get(value).span;
        if !self.is_lvalue(inner) {
            self.check_target(left, "assign to");
            return self.expr(l, r, ExprKind::Assign { op, target: left, value });
        }
        let span = self.get(inner).span.to(end);
        let mut node = self.expr_at(span, ExprKind::Assign { op, target: inner, value });
        for (span, kind) in rebuild.into_iter().rev() {
            let kind = match kind {
                ExprKind::Binary(op, a, _) => ExprKind::Binary(op, a, node),
                ExprKind::Ternary(a, b, _) => ExprKind::Ternary(a, b, node),
                ExprKind::Unary(op, _) => ExprKind::Unary(op, node),
                ExprKind::Cast(ty, _) => ExprKind::Cast(ty, node),
                other => other,
            };
            node = self.expr_at(span.to(end), kind);
        }
        node
    }

    /// The last operand of an operator expression, with the operators around it, outermost first.
    fn split_last(&self, id: ExprId) -> Option<(Vec<(crate::span::Span, ExprKind)>, ExprId)> {
        let mut around = Vec::new();
        let mut at = id;
        loop {
            let e = self.get(at);
            at = match e.kind {
                ExprKind::Binary(_, _, b) => b,
                ExprKind::Ternary(_, _, c) => c,
                ExprKind::Unary(_, a) | ExprKind::Cast(_, a) => a,
                _ => break,
            };
            around.push((e.span, e.kind.clone()));
        }
        (!around.is_empty()).then_some((around, at))
    }
}
