//! What is known of a variable's first assignment at one place of the program.

use super::walk::{Event, Walk};
use crate::hir::{Stmt, VarId};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// Variables that are watched at a time: every condition copies what is known of them.
const MAX_WATCHED: usize = 256;

/// Why a variable may lack a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gap {
    /// The condition at the span leaves it unassigned where it is this.
    Branch(Span, bool),
    /// The loop assigns it at the span, so that only the first pass finds nothing.
    FirstPass(Span),
}

/// Whether a variable has been assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Assigned {
    /// Nothing that has run so far can have assigned it.
    No,
    /// On every way, or all that can be said has been said.
    Yes,
    /// Not across the gap, which a way from here leads to for certain.
    Gap(Gap),
    /// As before, but a condition stands between: it may well exclude the gap.
    Hidden(Gap),
    /// On some ways, too many to tell.
    Unknown,
}

impl Assigned {
    /// As seen from within a further condition.
    fn hidden(self) -> Assigned {
        match self {
            Assigned::Gap(gap) => Assigned::Hidden(gap),
            other => other,
        }
    }
}

/// The variables without initialiser that are in view. What is missing here is not watched.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    vars: FxHashMap<VarId, Assigned>,
    /// Whether control comes here at all.
    pub(super) dead: bool,
}

impl State {
    pub(super) fn get(&self, var: VarId) -> Option<Assigned> {
        self.vars.get(&var).copied()
    }

    pub(super) fn declare(&mut self, var: VarId) {
        if self.vars.len() < MAX_WATCHED {
            self.vars.insert(var, Assigned::No);
        }
    }

    pub(super) fn assign(&mut self, var: VarId) {
        if let Some(state) = self.vars.get_mut(&var) {
            *state = Assigned::Yes;
        }
    }

    /// Ends the watch: a declaration goes out of view.
    pub(super) fn forget(&mut self, var: VarId) {
        self.vars.remove(&var);
    }

    /// Hides every gap.
    pub(super) fn hide(&mut self) {
        self.vars.values_mut().for_each(|state| *state = state.hidden());
    }

    /// On the way into a loop that assigns these variables, each with the place.
    pub(super) fn enter_loop(&mut self, assigned: &FxHashMap<VarId, Span>) {
        for (var, span) in assigned {
            if let Some(state) = self.vars.get_mut(var) {
                *state = match *state {
                    Assigned::No => Assigned::Gap(Gap::FirstPass(*span)),
                    Assigned::Yes => Assigned::Yes,
                    Assigned::Gap(_) | Assigned::Hidden(_) | Assigned::Unknown => Assigned::Unknown,
                };
            }
        }
    }

    /// Behind a loop: of what it assigns nothing certain is known any more.
    pub(super) fn leave_loop(&mut self, assigned: &FxHashMap<VarId, Span>) {
        for var in assigned.keys() {
            if let Some(state) = self.vars.get_mut(var)
                && *state != Assigned::Yes
            {
                *state = Assigned::Unknown;
            }
        }
    }

    /// The state behind a condition, from this state before it and those at the ends of its sides.
    pub(super) fn join(&mut self, cond: Span, then: State, otherwise: State) {
        if then.dead || otherwise.dead {
            self.dead = then.dead && otherwise.dead;
            // What follows runs only for one outcome of the condition, so gaps stay hidden.
            let alive = if then.dead { otherwise } else { then };
            self.vars = alive.vars;
            self.hide();
            return;
        }
        for (var, state) in &mut self.vars {
            let (Some(a), Some(b)) = (then.get(*var), otherwise.get(*var)) else { continue };
            *state = match (a, b) {
                (Assigned::Yes, Assigned::Yes) => Assigned::Yes,
                (Assigned::No, Assigned::No) => Assigned::No,
                (Assigned::Yes, Assigned::No) => Assigned::Gap(Gap::Branch(cond, false)),
                (Assigned::No, Assigned::Yes) => Assigned::Gap(Gap::Branch(cond, true)),
                // Neither side has touched it.
                (Assigned::Hidden(x), Assigned::Hidden(y)) if x == y => *state,
                _ => Assigned::Unknown,
            };
        }
    }
}

/// The variables that the statements, nested ones included, may write, each with its first place.
pub(super) fn assigned_in<'p>(walk: &Walk<'p>, body: &'p [Stmt], head: &'p Stmt) -> FxHashMap<VarId, Span> {
    let mut found = FxHashMap::default();
    let mut note = |event: Event<'p>| match event {
        Event::Write { var, span } => {
            found.entry(var).or_insert(span);
        }
        Event::Output { var } => {
            found.entry(var).or_insert(head.span);
        }
        Event::Expr(_) | Event::Read { .. } | Event::Conditional(_) => {}
    };
    walk.all(body, &mut note);
    walk.own(head, &mut note);
    found
}
