//! Structured operations: branches, loops and inlined functions.

use super::{Builder, Result};
use crate::hir::{Expr, ExprKind, Function, FunctionId, Stmt, StmtKind};
use crate::oso::errors;
use osl_ir::types::Type;
use osl_syntax::span::Span;
use std::ops::Range;
use std::sync::Arc;

/// The surroundings of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Around {
    depth: u64,
    /// Whether it is in a loop of the function.
    in_loop: bool,
}

impl Around {
    fn inner(self, in_loop: bool) -> Around {
        Around { depth: self.depth + 1, in_loop }
    }
}

impl Builder<'_, '_> {
    /// The statements of a range of operations.
    pub(super) fn block(&mut self, range: Range<usize>, around: Around) -> Result<Vec<Stmt>> {
        let file = self.file;
        let mut list = Vec::new();
        let mut at = range.start;
        while let Some(op) = file.ops.get(at).filter(|_| at < range.end) {
            let deepest = self.limits.oso_depth;
            if around.depth > deepest {
                let message = format!("blocks within blocks, more than {deepest} deep");
                return Err(errors::too_large(op.span, message));
            }
            let span = self.spans.get(at).copied().unwrap_or(op.span);
            let mut push = |kind| list.push(Stmt { kind, span });
            let mut next = at + 1;
            match op.name {
                "end" => break,
                "nop" | "useparam" => {}
                "if" => {
                    let [then, other] = self.jumps(at, range.end)?;
                    let cond = self.condition(at)?;
                    let inner = around.inner(around.in_loop);
                    let yes = self.block(at + 1..then, inner)?;
                    let no = self.block(then..other, inner)?;
                    push(StmtKind::If(cond, yes, no));
                    next = other;
                }
                "for" | "while" | "dowhile" => {
                    let [test, body, iter, end] = self.jumps(at, range.end)?;
                    list.extend(self.block(at + 1..test, around.inner(false))?);
                    let kind = self.loop_([test, body, iter, end], at, around)?;
                    list.push(Stmt { kind, span });
                    next = end;
                }
                "functioncall" | "functioncall_nr" => {
                    let [end] = self.jumps(at, range.end)?;
                    let body = self.block(at + 1..end, around.inner(false))?;
                    let name = self.called(at);
                    push(StmtKind::Expr(self.call_of(name, body, Type::VOID, span)));
                    next = end;
                }
                "break" | "continue" if !around.in_loop => {
                    return Err(errors::jump(op.span, format!("`{}` outside of a loop", op.name)));
                }
                "break" => push(StmtKind::Break),
                "continue" => push(StmtKind::Continue),
                "return" => push(StmtKind::Return(None)),
                _ => push(StmtKind::Expr(self.op(at)?)),
            }
            at = next;
        }
        Ok(list)
    }

    /// The condition is evaluated before each iteration, whatever operations it needs.
    fn loop_(&mut self, parts: [usize; 4], at: usize, around: Around) -> Result<StmtKind> {
        let [test, body, iter, end] = parts;
        let cond = self.condition(at)?;
        let span = cond.span;
        let before = self.block(test..body, around.inner(false))?;
        let cond = Some(self.evaluated(before, Some(cond), span));
        let rounds = self.block(body..iter, around.inner(true))?;
        let after = self.block(iter..end, around.inner(false))?;
        let iter = (!after.is_empty()).then(|| self.evaluated(after, None, span));
        let test_first = self.file.ops.get(at).is_some_and(|op| op.name != "dowhile");
        Ok(StmtKind::Loop { cond, test_first, iter, body: rounds })
    }

    /// Statements followed by a value, as one expression.
    fn evaluated(&mut self, before: Vec<Stmt>, value: Option<Expr>, span: Span) -> Expr {
        let ty = value.as_ref().map_or(Type::VOID, |v| v.ty);
        let straight = before.iter().all(|s| matches!(s.kind, StmtKind::Expr(_)));
        if straight {
            let expr = |s: Stmt| if let StmtKind::Expr(e) = s.kind { Some(e) } else { None };
            let list: Vec<Expr> = before.into_iter().filter_map(expr).chain(value).collect();
            return Expr { ty, kind: ExprKind::Comma(list), span };
        }
        let mut body = before;
        if let Some(value) = value {
            body.push(Stmt { kind: StmtKind::Return(Some(crate::hir::Init::Value(value))), span });
        }
        self.call_of("condition".into(), body, ty, span)
    }

    /// The call of a new function without formals.
    pub(super) fn call_of(&mut self, name: Arc<str>, body: Vec<Stmt>, ret: Type, span: Span) -> Expr {
        let id = FunctionId(self.functions.len() as u32);
        self.functions.push(Function { name, ret, formals: Vec::new(), body, span });
        Expr { ty: ret, kind: ExprKind::Call(id, Vec::new()), span }
    }

    /// The name of the inlined function.
    fn called(&mut self, at: usize) -> Arc<str> {
        let name = self.file.ops.get(at).and_then(|op| op.args.first().copied());
        match name.and_then(|arg| self.operand(arg, arg.1).ok()).map(|e| e.kind) {
            Some(ExprKind::Str(name)) => name,
            _ => "function".into(),
        }
    }

    /// The value of the condition.
    fn condition(&mut self, at: usize) -> Result<Expr> {
        let Some(op) = self.file.ops.get(at) else {
            return Err(errors::jump(Span::default(), "no operation"));
        };
        let span = self.spans.get(at).copied().unwrap_or(op.span);
        let Some(arg) = op.args.first() else {
            return Err(errors::operation(op.span, format!("`{}` without a condition", op.name)));
        };
        let cond = self.operand(*arg, span)?;
        if !crate::resolve::operators::has_truth(cond.ty) {
            return Err(errors::operation(arg.1, "this has no truth value"));
        }
        Ok(cond)
    }

    /// The indices of the operations at which the parts of an operation end, checked: each is after the
    /// previous one, and none is after the end of the block.
    fn jumps<const N: usize>(&self, at: usize, end: usize) -> Result<[usize; N]> {
        let Some(op) = self.file.ops.get(at) else {
            return Err(errors::jump(Span::default(), "no operation"));
        };
        let targets: Vec<usize> = op.jumps.iter().map(|target| *target as usize).collect();
        let Ok(targets) = <[usize; N]>::try_from(targets) else {
            let message = format!("`{}` names {N} operations, not {}", op.name, op.jumps.len());
            return Err(errors::jump(op.span, message));
        };
        let mut low = at + 1;
        for target in targets {
            if target < low || target > end {
                let message = format!("operation {target} does not lie between {low} and {end}");
                return Err(errors::jump(op.span, message));
            }
            low = target;
        }
        Ok(targets)
    }
}
