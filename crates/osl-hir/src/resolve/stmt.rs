//! Statements.

use super::errors;
use super::unknown::{BEFORE_ASSIGNMENT, BEFORE_NAME};
use super::{Context, Resolver};
use crate::hir::{Init, Stmt, StmtKind, VarKind};
use osl_ir::types::{Base, Type};
use osl_syntax::ast::{self, StmtId};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::span::Span;

impl Resolver<'_> {
    /// Resolves a list of statements in the innermost scope.
    pub(super) fn stmts(&mut self, list: &[StmtId]) -> Vec<Stmt> {
        self.stmts_expecting(list, None)
    }

    /// The same, where a bare expression has an expected type: in the body of a function, as in published
    /// compilers, the type that the function returns.
    pub(super) fn stmts_expecting(&mut self, list: &[StmtId], expected: Option<Type>) -> Vec<Stmt> {
        let mut out = Vec::new();
        for id in list {
            self.stmt(*id, expected, &mut out);
        }
        out
    }

    /// The statement as the body of an `if` or loop: it has no scope of its own, so that a lone declaration
    /// stays visible after it, as in the language.
    pub(super) fn body(&mut self, id: StmtId) -> Vec<Stmt> {
        self.stmts(&[id])
    }

    fn stmt(&mut self, id: StmtId, expected: Option<Type>, out: &mut Vec<Stmt>) {
        let ast = self.ast;
        let stmt = &ast[id];
        let span = stmt.span;
        let kind = match &stmt.kind {
            ast::StmtKind::Empty | ast::StmtKind::Error => return,
            ast::StmtKind::Expr(e) => {
                if let Some(declared) = self.undeclared(*e, span) {
                    out.push(declared);
                    return;
                }
                if self.misspelt_jump(*e) {
                    return;
                }
                StmtKind::Expr(self.expr(*e, expected))
            }
            ast::StmtKind::Declare { ty, vars } => {
                for var in vars {
                    self.local(ty, var, out);
                }
                return;
            }
            ast::StmtKind::Block(list) => StmtKind::Block(self.within_scope(|r| r.stmts(list))),
            ast::StmtKind::If { .. } => return self.branches(id, out),
            ast::StmtKind::While { cond, body } => {
                let cond = Some(self.condition(*cond, false));
                StmtKind::Loop { cond, test_first: true, iter: None, body: self.loop_body(*body) }
            }
            ast::StmtKind::DoWhile { body, cond } => {
                let body = self.loop_body(*body);
                let cond = Some(self.condition(*cond, false));
                StmtKind::Loop { cond, test_first: false, iter: None, body }
            }
            ast::StmtKind::For { init, cond, iter, body } => StmtKind::Block(self.within_scope(|r| {
                let mut list = init.map(|s| r.stmts(&[s])).unwrap_or_default();
                let cond = cond.map(|e| r.condition(e, false));
                let iter = iter.map(|e| r.expr(e, None));
                let kind = StmtKind::Loop { cond, test_first: true, iter, body: r.loop_body(*body) };
                list.push(Stmt { kind, span });
                list
            })),
            ast::StmtKind::Break => {
                self.inside_loop(span, "break");
                StmtKind::Break
            }
            ast::StmtKind::Continue => {
                self.inside_loop(span, "continue");
                StmtKind::Continue
            }
            ast::StmtKind::Return(value) => StmtKind::Return(self.return_value(*value, span)),
            ast::StmtKind::Function(decl) => {
                self.function(decl);
                return;
            }
        };
        out.push(Stmt { kind, span });
    }

    fn local(&mut self, ty: &ast::TypeSpec, var: &ast::Declarator, out: &mut Vec<Stmt>) {
        self.keywords = if var.init.is_some() { BEFORE_ASSIGNMENT } else { BEFORE_NAME };
        let ty = self.declared_type(ty, var.array.as_ref(), false);
        self.keywords = &[];
        // The initialiser sees the outer variable of this name, so it is resolved first.
        let outer = self.declaring.replace(var.name.text.clone());
        let init = var.init.map(|e| self.local_init(ty, e));
        self.declaring = outer;
        let id = self.declare(&var.name, ty, VarKind::Local);
        out.push(Stmt { kind: StmtKind::Declare(id, init), span: var.name.span });
    }

    fn loop_body(&mut self, body: StmtId) -> Vec<Stmt> {
        self.context.loops += 1;
        let body = self.body(body);
        self.context.loops -= 1;
        body
    }

    fn inside_loop(&mut self, span: Span, what: &str) {
        if self.context.loops == 0 {
            let d = Diagnostic::error(errors::OUTSIDE_LOOP, span, format!("`{what}` outside of a loop"));
            self.report(d);
        }
    }

    pub(super) fn condition(&mut self, id: ast::ExprId, closures: bool) -> crate::hir::Expr {
        let expr = self.expr(id, None);
        let ty = expr.ty;
        let bad = ty.is_array()
            || matches!(ty.base, Base::Struct(_) | Base::Void)
            || (ty.base == Base::Closure && !closures);
        if bad && !ty.is_error() {
            let message = format!("{} has no truth value here", self.show_a(ty));
            self.report(Diagnostic::error(errors::BAD_CONDITION, expr.span, message));
        }
        expr
    }

    fn return_value(&mut self, value: Option<ast::ExprId>, span: Span) -> Option<Init> {
        self.returns = true;
        let Context { ret, .. } = self.context;
        let message = match (ret, value) {
            (None, Some(_)) => "a shader returns no value: write `return;`".to_string(),
            (Some(Type::VOID), Some(_)) => "a void function returns no value".to_string(),
            (Some(ty), None) if ty != Type::VOID => format!("this function returns {}", self.show_a(ty)),
            (Some(ty), Some(e)) => return Some(self.returned(ty, e)),
            (_, None) => return None,
        };
        self.report(Diagnostic::error(errors::BAD_RETURN, span, message));
        None
    }
}
