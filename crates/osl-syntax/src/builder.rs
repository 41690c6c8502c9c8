//! The functions that the grammar's actions call: they build the tree and reject constructs that the rules
//! accept beyond the language.
//!
//! The rules accept any expression as an assignment target and any list as an initialiser, so that the
//! message can state the mistake instead of an unexpected token. This module must not know types or names.

mod declare;
mod express;
mod operators;

pub(crate) use declare::{ForHead, FormalParts, FunctionHead, ShaderHead};
pub(crate) use operators::Operated;

use crate::Options;
use crate::ast::{Ast, Expr, ExprId, ExprKind, Item, Name, StmtId, StmtKind};
use crate::diagnostic::{Diagnostic, Sink};
use crate::errors;
use crate::span::Span;
use crate::token::Token;
use std::sync::Arc;

/// The tree under construction.
pub(crate) struct Builder<'a> {
    tokens: &'a [Token],
    spans: &'a [Span],
    options: &'a Options,
    pub(crate) ast: Ast,
    pub(crate) diagnostics: Sink,
    /// The depth of the subtree below each expression and statement, so that later visitors may recurse.
    expr_depths: Vec<u32>,
    stmt_depths: Vec<u32>,
    /// The operands of all chains of operators that wait for an operand on their right.
    lefts: Vec<operators::Left>,
    too_deep: bool,
}

impl<'a> Builder<'a> {
    pub(crate) fn new(tokens: &'a [Token], spans: &'a [Span], options: &'a Options) -> Self {
        Self {
            tokens,
            spans,
            options,
            ast: Ast::default(),
            diagnostics: Sink::new(options.limits.reading.diagnostics),
            expr_depths: Vec::new(),
            stmt_depths: Vec::new(),
            lefts: Vec::new(),
            too_deep: false,
        }
    }

    /// The location of the tokens `l..r`.
    fn span(&self, l: u32, r: u32) -> Span {
        let first = self.token_span(l);
        match r.checked_sub(1).filter(|last| *last > l) {
            Some(last) => first.to(self.token_span(last)),
            None => first,
        }
    }

    fn token_span(&self, at: u32) -> Span {
        self.spans.get(at as usize).copied().unwrap_or_default()
    }

    fn report(&mut self, d: Diagnostic) {
        self.diagnostics.push(d);
    }

    /// Adds an expression, or an error node if it would be nested too deeply.
    pub(crate) fn expr(&mut self, l: u32, r: u32, kind: ExprKind) -> ExprId {
        let span = self.span(l, r);
        self.expr_at(span, kind)
    }

    fn expr_at(&mut self, span: Span, kind: ExprKind) -> ExprId {
        let depth = 1 + self.children_depth(&kind);
        if u64::from(depth) > self.options.limits.reading.nesting {
            self.deep(span);
            self.expr_depths.push(0);
            return self.ast.expr(span, ExprKind::Error);
        }
        self.expr_depths.push(depth);
        self.ast.expr(span, kind)
    }

    /// Adds a statement, or an error node if it would be nested too deeply.
    pub(crate) fn stmt(&mut self, l: u32, r: u32, kind: StmtKind) -> StmtId {
        let span = self.span(l, r);
        let depth = 1 + self.stmt_children_depth(&kind);
        if u64::from(depth) > self.options.limits.reading.nesting {
            self.deep(span);
            self.stmt_depths.push(0);
            return self.ast.stmt(span, StmtKind::Error);
        }
        self.stmt_depths.push(depth);
        self.ast.stmt(span, kind)
    }

    fn deep(&mut self, span: Span) {
        // The constructs around it would only repeat the error.
        if !std::mem::replace(&mut self.too_deep, true) {
            self.report(errors::nesting(span, self.options.limits.reading.nesting));
        }
    }

    fn depth(&self, id: ExprId) -> u32 {
        self.expr_depths.get(id.0 as usize).copied().unwrap_or(0)
    }

    fn depth_of_all<'i>(&self, ids: impl IntoIterator<Item = &'i ExprId>) -> u32 {
        ids.into_iter().map(|e| self.depth(*e)).max().unwrap_or(0)
    }

    fn children_depth(&self, kind: &ExprKind) -> u32 {
        match kind {
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Name(_)
            | ExprKind::Error => 0,
            ExprKind::Unary(_, a) | ExprKind::Cast(_, a) | ExprKind::Field(a, _) | ExprKind::Paren(a) => {
                self.depth(*a)
            }
            ExprKind::Step { target, .. } => self.depth(*target),
            ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => self.depth_of_all([a, b]),
            ExprKind::Assign { target, value, .. } => self.depth_of_all([target, value]),
            ExprKind::Ternary(a, b, c) => self.depth_of_all([a, b, c]),
            ExprKind::Construct(_, v) | ExprKind::Call(_, v) | ExprKind::Comma(v) | ExprKind::InitList(v) => {
                self.depth_of_all(v)
            }
        }
    }

    fn stmt_depth(&self, id: StmtId) -> u32 {
        self.stmt_depths.get(id.0 as usize).copied().unwrap_or(0)
    }

    fn depth_of_stmts(&self, ids: &[StmtId]) -> u32 {
        ids.iter().map(|s| self.stmt_depth(*s)).max().unwrap_or(0)
    }

    fn stmt_children_depth(&self, kind: &StmtKind) -> u32 {
        match kind {
            StmtKind::Empty | StmtKind::Break | StmtKind::Continue | StmtKind::Error => 0,
            StmtKind::Expr(e) => self.depth(*e),
            StmtKind::Return(e) => self.depth_of_all(e),
            StmtKind::Declare { vars, .. } => self.depth_of_all(vars.iter().filter_map(|v| v.init.as_ref())),
            StmtKind::Block(v) => self.depth_of_stmts(v),
            StmtKind::If { cond, then, otherwise } => {
                let otherwise = otherwise.map_or(0, |s| self.stmt_depth(s));
                self.depth(*cond).max(self.stmt_depth(*then)).max(otherwise)
            }
            StmtKind::While { cond, body } | StmtKind::DoWhile { body, cond } => {
                self.depth(*cond).max(self.stmt_depth(*body))
            }
            StmtKind::For { init, cond, iter, body } => {
                let head = self.depth_of_all(cond.iter().chain(iter));
                head.max(init.map_or(0, |s| self.stmt_depth(s))).max(self.stmt_depth(*body))
            }
            StmtKind::Function(f) => f.body.as_ref().map_or(0, |b| self.depth_of_stmts(&b.stmts)),
        }
    }

    /// Adds a declaration at file level.
    pub(crate) fn item(&mut self, item: Item) {
        self.ast.items.push(item);
    }

    /// A name as written.
    pub(crate) fn name(&mut self, l: u32, r: u32, text: Arc<str>) -> Name {
        Name { text, span: self.span(l, r) }
    }

    fn get(&self, id: ExprId) -> &Expr {
        const NONE: &Expr = &Expr { span: Span::new(0, 0), kind: ExprKind::Error };
        self.ast.exprs.get(id.0 as usize).unwrap_or(NONE)
    }

    /// A comma after the last argument or initialiser.
    pub(crate) fn trailing_comma(&mut self, at: u32) {
        self.report(errors::trailing_comma(self.options.strict, self.token_span(at)));
    }

    /// A `;` at file level.
    pub(crate) fn stray_semicolon(&mut self, at: u32) {
        self.report(errors::stray_semicolon(self.options.strict, self.token_span(at)));
    }

    /// A `}` at file level that closes nothing. Directly before the shader it is a quirk.
    pub(crate) fn stray_brace(&mut self, at: u32) {
        let span = self.token_span(at);
        if at.checked_sub(1).and_then(|n| self.tokens.get(n as usize)) == Some(&Token::Bad) {
            // The error before it explains the brace.
            return;
        }
        let before_shader = matches!(self.tokens.get(at as usize + 1), Some(Token::ShaderKind(_)));
        let behind_body = !self.ast.items.is_empty();
        self.report(match before_shader && behind_body {
            true => errors::stray_brace(self.options.strict, span),
            false => errors::stray_closer(span, "}"),
        });
    }
}
