//! Control flow: unreachable statements, endless loops, constant conditions.
//!
//! A condition from a macro is a switch that the user sets, so it is not reported; neither is the `1` of a
//! loop that a jump leaves, nor the `0` of `do … while (0)`, which makes a block that `break` can leave.

use super::constants::{Constants, is_plain};
use super::walk::{Event, Walk, bodies, each_stmt};
use super::{Findings, codes, flow, loops};
use crate::hir::{Expr, ExprKind, Stmt, StmtKind};
use osl_syntax::span::Span;

/// Reports unreachable statements, endless loops and constant conditions.
pub(super) fn run(walk: &Walk<'_>, found: &mut Findings<'_>) {
    let constants = Constants::of(walk, found);
    let mut jumps = Jumps { walk, constants, found };
    for body in bodies(walk.program) {
        jumps.unreachable(required_part(body));
        each_stmt(body, &mut |stmt| jumps.stmt(stmt));
    }
    walk.everything(&mut |event| {
        if let Event::Expr(e) = event
            && let ExprKind::Ternary(cond, ..) = &e.kind
        {
            jumps.condition(cond);
        }
    });
}

struct Jumps<'j, 'a, 'p> {
    walk: &'j Walk<'p>,
    constants: Constants,
    found: &'j mut Findings<'a>,
}

impl Jumps<'_, '_, '_> {
    fn stmt(&mut self, stmt: &Stmt) {
        match &stmt.kind {
            StmtKind::Block(list) => {
                self.unreachable(list);
                let leaves = list.last().is_some_and(|last| match &last.kind {
                    StmtKind::Loop { body, .. } => leaves(body, true),
                    _ => false,
                });
                loops::counted(self.walk, list, leaves, self.found);
            }
            StmtKind::If(cond, then, otherwise) => {
                self.unreachable(then);
                self.unreachable(otherwise);
                self.condition(cond);
            }
            StmtKind::Loop { cond, test_first, body, .. } => {
                self.unreachable(body);
                self.repetition(stmt, cond.as_ref(), *test_first, body);
            }
            _ => {}
        }
    }

    fn condition(&mut self, cond: &Expr) {
        let Some(value) = self.constants.value(cond) else { return };
        if !is_plain(self.walk, cond, self.found) {
            return;
        }
        let var = self.constants.variable(cond).and_then(|var| self.walk.var(var));
        let source = var.map(|var| (var.span, &*var.name));
        self.found.report(codes::constant_condition(cond.span, value.map(|v| v != 0.0), source));
    }

    fn repetition(&mut self, stmt: &Stmt, cond: Option<&Expr>, test_first: bool, body: &[Stmt]) {
        let value = match cond {
            None => Some(Some(1.0)),
            Some(cond) => self.constants.value(cond),
        };
        let at = cond.map_or(stmt.span, |c| c.span);
        match (value.map(|v| v.map(|v| v != 0.0)), cond) {
            (Some(Some(true)), _) if !leaves(body, true) => self.found.report(codes::endless(at)),
            (Some(Some(false)), Some(cond)) if test_first => self.condition(cond),
            (None, Some(_)) if !leaves(body, true) => loops::unchanged(self.walk, stmt, self.found),
            _ => {}
        }
    }

    /// Reports the first statement of the list after a jump.
    fn unreachable(&mut self, list: &[Stmt]) {
        for pair in list.windows(2) {
            let [before, after] = pair else { continue };
            if let Some((jump, what)) = self.jump(before) {
                self.found.report(codes::unreachable(after.span, jump, what));
                return;
            }
        }
    }

    /// The jump that certainly ends the statement, and its description.
    fn jump(&self, stmt: &Stmt) -> Option<(Span, &'static str)> {
        let last = |list: &[Stmt]| list.last().and_then(|stmt| self.jump(stmt));
        match &stmt.kind {
            StmtKind::Return(_) => Some((stmt.span, "`return` goes elsewhere")),
            StmtKind::Break => Some((stmt.span, "`break` goes elsewhere")),
            StmtKind::Continue => Some((stmt.span, "`continue` goes elsewhere")),
            StmtKind::Expr(e) if flow::is_exit(e) => Some((stmt.span, "`exit` ends the shader")),
            StmtKind::Block(inner) => last(inner),
            StmtKind::If(_, then, otherwise) => {
                last(then)?;
                last(otherwise)
            }
            StmtKind::Loop { cond, body, .. } => {
                let forever = cond.as_ref().is_none_or(|cond| self.constants.holds(cond));
                // A loop that never ends has a lint of its own.
                (forever && !breaks(body) && leaves(body, true))
                    .then_some((stmt.span, "only `return` ends this loop"))
            }
            StmtKind::Expr(_) | StmtKind::Declare(..) => None,
        }
    }
}

/// A body without the `return` that only follows an `exit` because a function has to end with one.
fn required_part(body: &[Stmt]) -> &[Stmt] {
    match body {
        [rest @ .., last] if matches!(last.kind, StmtKind::Return(Some(_))) => match rest.last() {
            Some(Stmt { kind: StmtKind::Expr(e), .. }) if flow::is_exit(e) => rest,
            _ => body,
        },
        _ => body,
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

/// Whether a `break` ends the loop around the list.
pub(super) fn breaks(list: &[Stmt]) -> bool {
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
