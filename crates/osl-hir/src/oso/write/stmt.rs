//! Statements: structured operations name the operations at which their parts end.

use super::Writer;
use super::place::is_pure;
use crate::hir::{Expr, ExprKind, Init, Stmt, StmtKind};
use osl_ir::types::Type;

impl Writer<'_> {
    /// The statements of a shader or function. A `return` at the very end is omitted.
    pub(super) fn body(&mut self, list: &[Stmt]) {
        self.stmts(list);
        let last_returns = matches!(list.last().map(|s| &s.kind), Some(StmtKind::Return(_)));
        if last_returns && self.ops.last().is_some_and(|op| op.name == "return" || op.name == "exit") {
            // No jump leads past it.
            self.ops.pop();
        }
    }

    fn stmts(&mut self, list: &[Stmt]) {
        for stmt in list {
            if self.is_full() {
                return;
            }
            self.span = stmt.span;
            self.stmt(stmt);
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Expr(e) => self.effect(e),
            StmtKind::Declare(var, init) => {
                let program = self.program;
                let Some(decl) = program.vars.get(var.0 as usize) else { return };
                let storage = self.allocate(decl.ty, &decl.name);
                match init {
                    Some(init) => self.store_init(&storage, decl.ty, init),
                    // A symbol is zero at first; only a loop reaches the declaration again.
                    None if self.loops > 0 => self.store_zero(&storage),
                    None => {}
                }
                self.bind(*var, storage);
            }
            StmtKind::Block(list) => self.stmts(list),
            StmtKind::If(cond, then, otherwise) => {
                let cond = self.truth(cond);
                let branch = self.emit("if", &[cond]);
                for side in [then, otherwise] {
                    self.stmts(side);
                    self.part_ends(branch);
                }
            }
            StmtKind::Loop { cond, test_first, iter, body } => {
                self.loop_(cond.as_ref(), *test_first, iter.as_ref(), body);
            }
            StmtKind::Break => {
                self.emit("break", &[]);
            }
            StmtKind::Continue => {
                self.emit("continue", &[]);
            }
            StmtKind::Return(value) => {
                if let Some(init) = value {
                    self.returned(init);
                }
                // Only an inlined function is something to return from.
                self.emit(if self.returns.is_empty() { "exit" } else { "return" }, &[]);
            }
        }
    }

    /// An expression that is evaluated only for its effect.
    fn effect(&mut self, e: &Expr) {
        self.span = e.span;
        match &e.kind {
            ExprKind::Comma(list) => list.iter().for_each(|item| self.effect(item)),
            // The old value is not used.
            ExprKind::Step { increment, place, .. } => {
                let kind = ExprKind::Step { prefix: true, increment: *increment, place: place.clone() };
                self.eval(&Expr { kind, ..e.clone() });
            }
            _ if is_pure(e) && !matches!(e.kind, ExprKind::Builtin(_)) => {}
            _ => {
                self.eval(e);
            }
        }
    }

    fn returned(&mut self, init: &Init) {
        match self.returns.last().cloned().flatten() {
            Some((storage, ty)) => self.store_init(&storage, ty, init),
            None => {
                if let Init::Value(e) = init {
                    self.eval(e);
                }
            }
        }
    }

    /// The condition is a separate int, computed by operations before each iteration.
    fn loop_(&mut self, cond: Option<&Expr>, test_first: bool, iter: Option<&Expr>, body: &[Stmt]) {
        let test = self.table.temp(Type::INT);
        let name = match (test_first, iter) {
            (true, Some(_)) => "for",
            (true, None) => "while",
            (false, _) => "dowhile",
        };
        let op = self.emit(name, &[test]);
        self.part_ends(op);
        self.loops += 1;
        match cond {
            Some(cond) => {
                let value = self.value(cond);
                let zero = self.zero_beside(value);
                self.emit_to("neq", test, &[value, zero]);
            }
            None => {
                let one = self.table.int(1);
                self.assign(test, one);
            }
        }
        self.part_ends(op);
        self.stmts(body);
        self.part_ends(op);
        if let Some(iter) = iter {
            self.effect(iter);
        }
        self.part_ends(op);
        self.loops -= 1;
    }
}

/// Whether no path reaches the end of the statements.
pub(super) fn ends(list: &[Stmt]) -> bool {
    list.iter().any(|stmt| match &stmt.kind {
        StmtKind::Return(_) => true,
        StmtKind::Block(list) => ends(list),
        StmtKind::If(_, then, otherwise) => ends(then) && ends(otherwise),
        _ => false,
    })
}
