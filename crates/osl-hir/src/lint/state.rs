//! The state of a variable's first assignment at one place of the program.

use super::walk::{Event, Walk};
use crate::hir::{Stmt, VarId};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;

/// Why a variable may lack a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gap {
    /// The condition at the span leaves it unassigned if it has this value.
    Branch(Span, bool),
    /// The loop assigns it at the span, so only the first iteration finds it unassigned.
    FirstPass(Span),
}

/// Whether a variable has been assigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Assigned {
    /// Certainly not assigned by anything executed so far.
    No,
    /// Assigned on every path, or reported already.
    Yes,
    /// Not assigned if control came through the gap, which is certainly possible from here.
    Gap(Gap),
    /// The same, but there is a condition in between, which may exclude the gap.
    Hidden(Gap),
    /// Assigned on some paths, which are too many to distinguish.
    Unknown,
}

impl Assigned {
    /// The state inside a further condition.
    fn hidden(self) -> Assigned {
        match self {
            Assigned::Gap(gap) => Assigned::Hidden(gap),
            other => other,
        }
    }
}

/// The visible variables without an initialiser. Others are not examined.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    vars: FxHashMap<VarId, Assigned>,
    /// Maximum number of watched variables, since every condition copies their states.
    most: usize,
    /// Whether control never reaches this place.
    pub(super) dead: bool,
}

impl State {
    /// Watches at most this many variables at a time.
    pub(super) fn new(most: u64) -> State {
        State { most: usize::try_from(most).unwrap_or(usize::MAX), ..State::default() }
    }

    pub(super) fn get(&self, var: VarId) -> Option<Assigned> {
        self.vars.get(&var).copied()
    }

    pub(super) fn declare(&mut self, var: VarId) {
        if self.vars.len() < self.most {
            self.vars.insert(var, Assigned::No);
        }
    }

    pub(super) fn assign(&mut self, var: VarId) {
        if let Some(state) = self.vars.get_mut(&var) {
            *state = Assigned::Yes;
        }
    }

    /// Stops examining a variable whose scope ends.
    pub(super) fn forget(&mut self, var: VarId) {
        self.vars.remove(&var);
    }

    /// Hides every gap.
    pub(super) fn hide(&mut self) {
        self.vars.values_mut().for_each(|state| *state = state.hidden());
    }

    /// Enters a loop that assigns these variables, each with the location.
    #[expect(clippy::iter_over_hash_type, reason = "each variable has a state of its own")]
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

    /// After a loop, the state of the variables that it assigns is unknown.
    #[expect(clippy::iter_over_hash_type, reason = "each variable has a state of its own")]
    pub(super) fn leave_loop(&mut self, assigned: &FxHashMap<VarId, Span>) {
        for var in assigned.keys() {
            if let Some(state) = self.vars.get_mut(var)
                && *state != Assigned::Yes
            {
                *state = Assigned::Unknown;
            }
        }
    }

    /// The state after a condition, from the state before it and those at the ends of its sides.
    #[expect(clippy::iter_over_hash_type, reason = "each variable has a state of its own")]
    pub(super) fn join(&mut self, cond: Span, then: State, otherwise: State) {
        if then.dead || otherwise.dead {
            self.dead = then.dead && otherwise.dead;
            // The following code runs only for one outcome of the condition, so gaps stay hidden.
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
                // Neither side has changed it.
                (Assigned::Hidden(x), Assigned::Hidden(y)) if x == y => *state,
                _ => Assigned::Unknown,
            };
        }
    }
}

/// The variables that the statements may write, including nested ones, each with the first location.
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
