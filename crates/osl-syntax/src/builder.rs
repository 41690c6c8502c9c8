//! The functions that the grammar's actions call: they build the tree and reject constructs that the rules
//! accept beyond the language.
//!
//! The rules accept any expression as an assignment target and any list as an initialiser, so that the
//! message can state the mistake instead of an unexpected token.

mod chains;
mod declare;
mod depth;
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
    expr_depths: Vec<chains::Depth>,
    stmt_depths: Vec<chains::Depth>,
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
            ast: Ast { strict: options.strict, ..Ast::default() },
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
        let (depth, cut) = self.expr_depth(&kind);
        if u64::from(depth.whole()) > self.options.limits.reading.nesting {
            self.deep(span);
            self.expr_depths.push(chains::Depth::default());
            return self.ast.expr(span, ExprKind::Error);
        }
        self.expr_depths.push(depth);
        let id = self.ast.expr(span, kind);
        if cut {
            self.ast.cuts.operators.insert(id);
        }
        id
    }

    /// Adds a statement, or an error node if it would be nested too deeply.
    pub(crate) fn stmt(&mut self, l: u32, r: u32, kind: StmtKind) -> StmtId {
        let span = self.span(l, r);
        let (depth, cut) = self.stmt_depth(&kind);
        if u64::from(depth.whole()) > self.options.limits.reading.nesting {
            self.deep(span);
            self.stmt_depths.push(chains::Depth::default());
            return self.ast.stmt(span, StmtKind::Error);
        }
        self.stmt_depths.push(depth);
        let id = self.ast.stmt(span, kind);
        if cut {
            self.ast.cuts.branches.insert(id);
        }
        id
    }

    fn deep(&mut self, span: Span) {
        // The constructs around it would only repeat the error.
        if !std::mem::replace(&mut self.too_deep, true) {
            self.report(errors::nesting(span, self.options.limits.reading.nesting));
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
