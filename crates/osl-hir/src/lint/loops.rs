//! Loops that cannot do what they seem to: nothing changes their condition, they never run, or they count
//! away from their end.
//!
//! Only conditions are judged that compute with variables and literals.

use super::constants::Constants;
use super::walk::{Event, Walk};
use super::{Findings, codes};
use crate::hir::{Expr, ExprKind, Init, Stmt, StmtKind, VarId};
use osl_syntax::ast::BinaryOp as B;
use rustc_hash::FxHashSet;
use std::cell::Cell;

/// Reports a condition that stays as it is, in a loop that no jump leaves.
pub(super) fn unchanged(walk: &Walk<'_>, stmt: &Stmt, found: &mut Findings<'_>) {
    let StmtKind::Loop { cond: Some(cond), iter, body, .. } = &stmt.kind else { return };
    // A `;` in place of the body has a lint of its own.
    if body.is_empty() {
        return;
    }
    let mut read = Vec::new();
    if !only_reads(cond, &mut read) || read.is_empty() {
        return;
    }
    let mut written: FxHashSet<VarId> = FxHashSet::default();
    let calls = Cell::new(false);
    let mut note = |event: Event<'_>| match event {
        Event::Write { var, .. } | Event::Output { var } => {
            written.insert(var);
        }
        Event::Expr(Expr { kind: ExprKind::Call(..), .. }) => calls.set(true),
        _ => {}
    };
    walk.all(body, &mut note);
    if let Some(iter) = iter {
        walk.expr(iter, false, &mut note);
    }
    if calls.get() {
        // Functions within the shader may write its variables.
        walk.program.functions.iter().for_each(|function| walk.all(&function.body, &mut note));
    }
    let names: Vec<&str> = read.iter().filter_map(|id| walk.var(*id)).map(|var| &*var.name).collect();
    let by_hand = names.iter().all(|name| found.text(cond.span).contains(name));
    if by_hand && !read.iter().any(|var| written.contains(var)) {
        found.report(codes::unchanged_condition(cond.span, &names));
    }
}

/// Whether an expression only computes with variables and literals; collects the variables.
fn only_reads(e: &Expr, read: &mut Vec<VarId>) -> bool {
    match &e.kind {
        ExprKind::Int(_) | ExprKind::Float(_) => true,
        ExprKind::Read(place) if place.path.is_empty() => {
            if !read.contains(&place.var) {
                read.push(place.var);
            }
            true
        }
        ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => only_reads(inner, read),
        ExprKind::Binary(_, a, b) => only_reads(a, read) && only_reads(b, read),
        _ => false,
    }
}

/// Reports a `for` that never runs, or whose counter goes away from the end; `leaves`: a jump leaves it.
pub(super) fn counted(walk: &Walk<'_>, list: &[Stmt], leaves: bool, found: &mut Findings<'_>) {
    let [
        first,
        Stmt { kind: StmtKind::Loop { cond: Some(cond), test_first: true, iter: Some(iter), body }, .. },
    ] = list
    else {
        return;
    };
    let (var, start) = match &first.kind {
        StmtKind::Declare(var, Some(Init::Value(value))) => (*var, value),
        StmtKind::Expr(Expr { kind: ExprKind::Assign(place, value), .. }) if place.path.is_empty() => {
            match &**value {
                Init::Value(value) => (place.var, value),
                Init::List(_) => return,
            }
        }
        _ => return,
    };
    let ExprKind::Binary(op @ (B::Lt | B::Le | B::Gt | B::Ge), left, right) = &cond.kind else { return };
    let is_counter =
        |e: &Expr| matches!(&e.kind, ExprKind::Read(place) if place.var == var && place.path.is_empty());
    let literals = Constants::none();
    let number = |e: &Expr| literals.value(e).flatten();
    let Some(name) = walk.var(var).map(|var| &*var.name).filter(|_| is_counter(left)) else { return };
    if !found.text(cond.span).contains(name) {
        return;
    }
    let upward = matches!(op, B::Lt | B::Le);
    if let (Some(from), Some(to)) = (number(start), number(right)) {
        let holds = match op {
            B::Lt => from < to,
            B::Le => from <= to,
            B::Gt => from > to,
            _ => from >= to,
        };
        if !holds {
            return found.report(codes::never_runs(cond.span, name, start.span, found.text(start.span)));
        }
    }
    let ExprKind::Step { increment, place, .. } = &iter.kind else { return };
    let mut written = false;
    walk.all(body, &mut |event| {
        written |= matches!(event, Event::Write { var: of, .. } | Event::Output { var: of } if of == var);
    });
    if place.var == var && *increment != upward && !written && !leaves {
        found.report(codes::counts_away(cond.span, name, *increment, iter.span));
    }
}
