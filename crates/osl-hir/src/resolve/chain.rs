//! Chains of binary operators and of `else if`.
//!
//! Their links are followed in a loop, and long chains are cut into pieces, so that the resolved tree is not
//! deep (see `Cuts` of the syntax tree). The value of a piece is kept in a variable that no source can name.
//! Evaluation has the same order and the same values as that of the whole chain.

use super::Resolver;
use crate::hir::{CHAIN, Expr, ExprKind, Init, Lvalue, Stmt, StmtKind, Var, VarId, VarKind};
use osl_ir::types::Type;
use osl_syntax::ast::{self, BinaryOp, ExprId, StmtId};
use osl_syntax::span::Span;

impl Resolver<'_> {
    /// A binary operator, and the operators of the same chain on its left.
    pub(super) fn chain(&mut self, id: ExprId, expected: Option<Type>) -> Expr {
        let ast = self.ast;
        let mut links = Vec::new();
        let mut first = id;
        while let ast::ExprKind::Binary(op, a, b) = ast[first].kind {
            if matches!(op, BinaryOp::Lt | BinaryOp::Le | BinaryOp::Gt | BinaryOp::Ge) {
                self.needs_no_choice(a);
                self.needs_no_choice(b);
            }
            links.push((first, op, b));
            first = a;
        }
        let mut pieces = Vec::new();
        let mut left = self.value(first, expected);
        while let Some((link, op, right)) = links.pop() {
            if ast.cuts.operators.contains(&link) && !left.ty.is_error() {
                left = self.kept(left, &mut pieces);
            }
            let right = self.value(right, expected);
            left = self.combine(op, left, right, ast[link].span);
            if link != id {
                if let Some(recorder) = &mut self.recorder {
                    recorder.expression(ast[link].span, left.ty);
                }
                left = self.used(left);
            }
        }
        if pieces.is_empty() || left.ty.is_error() {
            return left;
        }
        let (ty, span) = (left.ty, left.span);
        pieces.push(left);
        Expr { ty, kind: ExprKind::Comma(pieces), span }
    }

    /// Stores a value in a variable, and reads it from there.
    fn kept(&mut self, value: Expr, pieces: &mut Vec<Expr>) -> Expr {
        let (ty, span) = (value.ty, value.span);
        let place = self.unnamed(ty, span);
        pieces.push(assignment(place.clone(), value));
        Expr { ty, kind: ExprKind::Read(place), span }
    }

    /// A new variable that no source can name.
    fn unnamed(&mut self, ty: Type, span: Span) -> Lvalue {
        let var = VarId(self.vars.len() as u32);
        self.vars.push(Var { name: CHAIN.into(), ty, kind: VarKind::Local, span });
        Lvalue { var, path: Vec::new(), ty, span }
    }

    /// An `if`, and the `if`s that follow in its `else`.
    pub(super) fn branches(&mut self, id: StmtId, out: &mut Vec<Stmt>) {
        let ast = self.ast;
        let mut rest = None;
        let mut piece: Vec<(Expr, Vec<Stmt>, Span)> = Vec::new();
        let mut is_first = true;
        let mut next = Some(id);
        while let Some(at) = next {
            let span = ast[at].span;
            let ast::StmtKind::If { cond, then, otherwise } = &ast[at].kind else { break };
            let cond = self.condition(*cond, true);
            piece.push((cond, self.body(*then), span));
            let goes_on = otherwise.filter(|s| matches!(ast[*s].kind, ast::StmtKind::If { .. }));
            next = goes_on;
            if goes_on.is_some() && !ast.cuts.branches.contains(&at) {
                continue;
            }
            let last = match goes_on {
                // The next piece runs where this one ends in its `else`.
                Some(cut) => {
                    let place = rest.get_or_insert_with(|| self.unnamed(Type::INT, ast[cut].span)).clone();
                    if is_first {
                        out.push(Stmt { kind: StmtKind::Declare(place.var, None), span });
                    }
                    vec![set(&place, 1, ast[cut].span)]
                }
                None => otherwise.map(|s| self.body(s)).unwrap_or_default(),
            };
            let mut whole = last;
            for (cond, then, span) in piece.drain(..).rev() {
                whole = vec![Stmt { kind: StmtKind::If(cond, then, whole), span }];
            }
            match &rest {
                Some(place) if !is_first => {
                    let span = whole.first().map_or(span, |s| s.span);
                    whole.insert(0, set(place, 0, span));
                    let cond = Expr { ty: Type::INT, kind: ExprKind::Read(place.clone()), span };
                    out.push(Stmt { kind: StmtKind::If(cond, whole, Vec::new()), span });
                }
                _ => out.append(&mut whole),
            }
            is_first = false;
        }
    }
}

fn assignment(place: Lvalue, value: Expr) -> Expr {
    let (ty, span) = (value.ty, value.span);
    Expr { ty, kind: ExprKind::Assign(place, Box::new(Init::Value(value))), span }
}

/// The statement `place = n;`.
fn set(place: &Lvalue, n: i32, span: Span) -> Stmt {
    let value = Expr { ty: Type::INT, kind: ExprKind::Int(n), span };
    Stmt { kind: StmtKind::Expr(assignment(place.clone(), value)), span }
}
