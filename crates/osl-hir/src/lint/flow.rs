//! Finds reads of uninitialised variables.
//!
//! Each body is walked once in the order of execution. Assigning a part of a variable, or passing it where it
//! may be written, counts as assigning it. Only certain cases are reported: no path assigns the variable; or
//! the first iteration of a loop reads it before the loop assigns it; or one side of an `if` leaves it
//! unassigned and there is no other condition between that `if` and the read, since the two conditions may be
//! related. Loops count as executed at least once. Strings and closures are empty at first in every
//! implementation and are not examined.

use super::state::{Assigned, Gap, State, assigned_in};
use super::walk::{Event, Walk, bodies};
use super::{Findings, codes};
use crate::builtins::Emit;
use crate::hir::{Expr, ExprKind, Stmt, StmtKind, VarId};
use osl_ir::types::Base;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// Reports reads of unassigned variables, watching `most` variables at a time.
pub(super) fn run(walk: &Walk<'_>, most: u64, found: &mut Findings<'_>) {
    let owners = Owners::of(walk);
    for (index, body) in bodies(walk.program).enumerate() {
        let mut flow = Flow { walk, found, owners: &owners, body: index, first: FxHashMap::default() };
        flow.list(body, &mut State::new(most));
        let mut reads: Vec<_> = flow.first.into_iter().collect();
        reads.sort_by_key(|(var, read)| (read.span, *var));
        for (var, read) in reads {
            report(walk, found, var, read);
        }
    }
}

fn report(walk: &Walk<'_>, found: &mut Findings<'_>, var: VarId, read: Read) {
    let Some(var) = walk.var(var) else { return };
    let (name, declared) = (&*var.name, var.span);
    if !found.is_written(declared, name) {
        return;
    }
    found.report(match read.gap {
        None => codes::uninitialized(read.span, name, declared),
        Some(Gap::FirstPass(at)) => codes::uninitialized_first_pass(read.span, name, declared, at),
        Some(Gap::Branch(cond, when)) => codes::maybe_uninitialized(read.span, name, declared, cond, when),
    });
}

/// The body to which each variable belongs; `None` if several use it, as nested functions do.
struct Owners(FxHashMap<VarId, Option<usize>>);

impl Owners {
    fn of(walk: &Walk<'_>) -> Owners {
        let mut owners = FxHashMap::default();
        for (index, body) in bodies(walk.program).enumerate() {
            walk.all(body, &mut |event| {
                if let Event::Read { var, .. } | Event::Write { var, .. } | Event::Output { var } = event {
                    let owner = owners.entry(var).or_insert(Some(index));
                    if *owner != Some(index) {
                        *owner = None;
                    }
                }
            });
        }
        Owners(owners)
    }
}

/// A read of an unassigned variable.
#[derive(Clone, Copy)]
struct Read {
    span: Span,
    gap: Option<Gap>,
}

struct Flow<'f, 'a, 'p> {
    walk: &'f Walk<'p>,
    found: &'f Findings<'a>,
    owners: &'f Owners,
    body: usize,
    /// The first such read of each variable; one is enough.
    first: FxHashMap<VarId, Read>,
}

impl<'p> Flow<'_, '_, 'p> {
    /// A block: its declarations are forgotten after it.
    fn list(&mut self, list: &'p [Stmt], state: &mut State) {
        for stmt in list {
            self.stmt(stmt, state);
        }
        for stmt in list {
            if let StmtKind::Declare(var, _) = &stmt.kind {
                state.forget(*var);
            }
        }
    }

    fn stmt(&mut self, stmt: &'p Stmt, state: &mut State) {
        match &stmt.kind {
            StmtKind::Declare(var, None) => {
                if self.is_watched(*var) {
                    state.declare(*var);
                }
            }
            StmtKind::Expr(e) => {
                self.own(stmt, state);
                state.dead |= is_exit(e);
            }
            StmtKind::Declare(_, Some(_)) => self.own(stmt, state),
            StmtKind::Block(inner) => self.list(inner, state),
            StmtKind::If(cond, then, otherwise) => {
                self.own(stmt, state);
                self.branch(cond.span, then, otherwise, state);
            }
            StmtKind::Loop { cond, test_first, iter, body } => {
                let assigned = assigned_in(self.walk, body, stmt);
                state.enter_loop(&assigned);
                if let (Some(cond), true) = (cond, *test_first) {
                    self.events(cond, state);
                }
                let mut inside = state.clone();
                self.list(body, &mut inside);
                // After a `continue`, more paths join than are distinguished here.
                inside.dead = false;
                inside.hide();
                inside.leave_loop(&assigned);
                if let Some(iter) = iter {
                    self.events(iter, &mut inside);
                }
                if let (Some(cond), false) = (cond, *test_first) {
                    self.events(cond, &mut inside);
                }
                state.leave_loop(&assigned);
            }
            StmtKind::Return(_) => {
                self.own(stmt, state);
                state.dead = true;
            }
            StmtKind::Break | StmtKind::Continue => state.dead = true,
        }
    }

    fn branch(&mut self, cond: Span, then: &'p [Stmt], otherwise: &'p [Stmt], state: &mut State) {
        let mut a = state.clone();
        a.hide();
        let mut b = a.clone();
        self.list(then, &mut a);
        self.list(otherwise, &mut b);
        state.join(cond, a, b);
    }

    fn is_watched(&self, var: VarId) -> bool {
        let watched = |base: Base| !matches!(base, Base::String | Base::Closure | Base::Error);
        let Some(v) = self.walk.var(var) else { return false };
        watched(v.ty.base) && self.owners.0.get(&var).is_none_or(|o| *o == Some(self.body))
    }

    fn own(&mut self, stmt: &'p Stmt, state: &mut State) {
        let walk = self.walk;
        let mut depth = 0;
        walk.own(stmt, &mut |event| self.event(event, state, &mut depth));
    }

    fn events(&mut self, e: &'p Expr, state: &mut State) {
        let walk = self.walk;
        let mut depth = 0;
        walk.expr(e, false, &mut |event| self.event(event, state, &mut depth));
    }

    /// `depth` counts the conditions within the expression.
    fn event(&mut self, event: Event<'p>, state: &mut State, depth: &mut u32) {
        match event {
            Event::Conditional(true) => *depth += 1,
            Event::Conditional(false) => *depth = depth.saturating_sub(1),
            Event::Expr(e) => {
                // A query about a variable is not a read of it. From here on the variable counts as assigned.
                if let ExprKind::Builtin(call) = &e.kind
                    && call.row.facts.asks.is_some()
                    && let Some(ExprKind::Read(place)) = call.args.first().map(|a| &a.kind)
                {
                    state.assign(place.var);
                }
            }
            Event::Read { var, span, .. } => {
                if state.dead || !self.found.in_main_file(span) {
                    return;
                }
                let gap = match (state.get(var), *depth) {
                    (Some(Assigned::No), _) => None,
                    (Some(Assigned::Gap(gap)), 0) => Some(gap),
                    _ => return,
                };
                self.first.entry(var).or_insert(Read { span, gap });
                state.assign(var);
            }
            Event::Write { var, .. } | Event::Output { var } => state.assign(var),
        }
    }
}

/// Whether the statement leaves the shader.
pub(super) fn is_exit(e: &Expr) -> bool {
    matches!(&e.kind, ExprKind::Builtin(call) if matches!(call.row.emit, Emit::Exit))
}
