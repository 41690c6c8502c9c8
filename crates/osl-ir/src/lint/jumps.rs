//! Where control goes: statements that it never reaches, loops that it never leaves, conditions that are constants.
//!
//! A condition that a macro writes is a switch for the user to set, and no finding; so is the `1` of a loop that a
//! jump leaves, and the `0` of `do … while (0)`, which makes a block that `break` can leave.

use super::walk::{Event, Walk, bodies, each_stmt};
use super::{Findings, codes, flow};
use crate::hir::{Expr, ExprKind, Stmt, StmtKind};
use osl_syntax::ast::{BinaryOp as B, UnaryOp};
use osl_syntax::span::Span;

/// Reports unreachable statements, endless loops and constant conditions.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    for body in bodies(walk.program) {
        unreachable(body, found);
        each_stmt(body, &mut |stmt| match &stmt.kind {
            StmtKind::Block(list) => unreachable(list, found),
            StmtKind::If(cond, then, otherwise) => {
                unreachable(then, found);
                unreachable(otherwise, found);
                condition(cond, found);
            }
            StmtKind::Loop { cond, test_first, body, .. } => {
                unreachable(body, found);
                repetition(stmt, cond.as_ref(), *test_first, body, found);
            }
            _ => {}
        });
    }
    walk.everything(&mut |event| {
        if let Event::Expr(e) = event
            && let ExprKind::Ternary(cond, ..) = &e.kind
        {
            condition(cond, found);
        }
    });
}

fn condition(cond: &Expr, found: &mut Findings<'_>) {
    if let Some(value) = constant(cond)
        && is_plain(cond, found)
    {
        found.report(codes::constant_condition(cond.span, value.map(|v| v != 0.0)));
    }
}

fn repetition(stmt: &Stmt, cond: Option<&Expr>, test_first: bool, body: &[Stmt], found: &mut Findings<'_>) {
    let value = match cond {
        None => Some(Some(1.0)),
        Some(cond) => constant(cond),
    };
    let at = cond.map_or(stmt.span, |c| c.span);
    match value.map(|v| v.map(|v| v != 0.0)) {
        Some(Some(true)) if !leaves(body, true) => found.report(codes::endless(at)),
        Some(Some(false)) if test_first => {
            if let Some(cond) = cond {
                condition(cond, found);
            }
        }
        _ => {}
    }
}

/// Whether a statement leaves the loop around the list; `own` tells whether a `break` here is that loop's.
fn leaves(list: &[Stmt], own: bool) -> bool {
    list.iter().any(|stmt| match &stmt.kind {
        StmtKind::Break => own,
        StmtKind::Return(_) => true,
        StmtKind::Expr(e) => flow::is_exit(e),
        StmtKind::Block(inner) => leaves(inner, own),
        StmtKind::If(_, then, otherwise) => leaves(then, own) || leaves(otherwise, own),
        StmtKind::Loop { body, .. } => leaves(body, false),
        StmtKind::Declare(..) | StmtKind::Continue => false,
    })
}

/// Reports the first statement of the list that stands behind a jump.
fn unreachable(list: &[Stmt], found: &mut Findings<'_>) {
    for pair in list.windows(2) {
        let [before, after] = pair else { continue };
        if let Some((jump, what)) = jump(before) {
            found.report(codes::unreachable(after.span, jump, what));
            return;
        }
    }
}

/// The jump that surely ends the statement, and what it does.
fn jump(stmt: &Stmt) -> Option<(Span, &'static str)> {
    match &stmt.kind {
        StmtKind::Return(_) => Some((stmt.span, "`return` goes elsewhere")),
        StmtKind::Break => Some((stmt.span, "`break` goes elsewhere")),
        StmtKind::Continue => Some((stmt.span, "`continue` goes elsewhere")),
        StmtKind::Expr(e) if flow::is_exit(e) => Some((stmt.span, "`exit` ends the shader")),
        StmtKind::Block(inner) => inner.last().and_then(jump),
        StmtKind::If(_, then, otherwise) => {
            then.last().and_then(jump)?;
            otherwise.last().and_then(jump)
        }
        StmtKind::Loop { cond, body, .. } => {
            let forever = cond.as_ref().is_none_or(|c| constant(c).flatten().is_some_and(|v| v != 0.0));
            // A loop without any way out has its own finding.
            (forever && !breaks(body) && leaves(body, true))
                .then_some((stmt.span, "only `return` ends this loop"))
        }
        StmtKind::Expr(_) | StmtKind::Declare(..) => None,
    }
}

/// Whether a `break` ends the loop around the list.
fn breaks(list: &[Stmt]) -> bool {
    list.iter().any(|stmt| match &stmt.kind {
        StmtKind::Break => true,
        StmtKind::Block(inner) => breaks(inner),
        StmtKind::If(_, then, otherwise) => breaks(then) || breaks(otherwise),
        StmtKind::Loop { .. }
        | StmtKind::Return(_)
        | StmtKind::Expr(_)
        | StmtKind::Declare(..)
        | StmtKind::Continue => false,
    })
}

/// Whether the expression is a constant, and its value where it is simple to tell.
fn constant(e: &Expr) -> Option<Option<f64>> {
    match &e.kind {
        ExprKind::Int(n) => Some(Some(f64::from(*n))),
        ExprKind::Float(x) => Some(Some(f64::from(*x))),
        ExprKind::Str(text) => Some(Some(if text.is_empty() { 0.0 } else { 1.0 })),
        ExprKind::Convert(inner) => constant(inner),
        ExprKind::Unary(op, inner) => {
            let value = constant(inner)?;
            Some(value.and_then(|v| match op {
                UnaryOp::Not => Some(f64::from(v == 0.0)),
                UnaryOp::Neg => Some(-v),
                UnaryOp::Compl => None,
            }))
        }
        ExprKind::Binary(op, a, b) => {
            let (a, b) = (constant(a)?, constant(b)?);
            Some(a.zip(b).and_then(|(a, b)| combine(*op, a, b)))
        }
        _ => None,
    }
}

/// Comparisons and logic of constants; arithmetic is left to the folder.
fn combine(op: B, a: f64, b: f64) -> Option<f64> {
    let truth = match op {
        B::Lt => a < b,
        B::Le => a <= b,
        B::Gt => a > b,
        B::Ge => a >= b,
        B::Eq => a == b,
        B::Ne => a != b,
        B::And => a != 0.0 && b != 0.0,
        B::Or => a != 0.0 || b != 0.0,
        _ => return None,
    };
    Some(f64::from(truth))
}

/// Whether the user wrote all literals of a constant here, rather than names of macros.
fn is_plain(e: &Expr, found: &Findings<'_>) -> bool {
    let by_hand = |e: &Expr| found.text(e.span).starts_with(|c: char| !c.is_alphabetic() && c != '_');
    match &e.kind {
        ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => is_plain(inner, found),
        ExprKind::Binary(_, a, b) => is_plain(a, found) && is_plain(b, found),
        _ => by_hand(e),
    }
}
