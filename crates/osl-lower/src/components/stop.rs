//! Drops the code that a renderer does not compile: from a call of an unknown closure to the end of the list
//! of operations that contains the call.
//!
//! Functions, loops and conditions that folding does not decide have separate lists; blocks, and branches of
//! conditions that folding decides, belong to the list around them.

use osl_hir::hir::{Expr, ExprKind, Init, Program, Stmt, StmtKind};
use osl_ir::ir::{Body, Op};
use osl_syntax::span::Span;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Calls at which compiling stops.
#[derive(Clone, Debug, Default)]
pub struct Stops {
    /// Names of closures, and the locations of their calls.
    calls: FxHashSet<(Arc<str>, Span)>,
    /// Conditions that are still open after folding.
    open: FxHashSet<Span>,
}

impl Stops {
    /// The stops of a body after the passes, for the calls that do not compile.
    pub fn new(body: &Body, calls: impl IntoIterator<Item = (Arc<str>, Span)>) -> Stops {
        let branches = body.insts_from(body.entry).filter(|inst| matches!(inst.op, Op::If { .. }));
        Stops { calls: calls.into_iter().collect(), open: branches.map(|inst| inst.span).collect() }
    }
}

/// Drops from a program the code that is not compiled; `base` maps its locations to those of the body.
pub fn stop(program: &mut Program, stops: &Stops, base: u32) {
    let stopper = Stopper { stops, base };
    for function in &mut program.functions {
        stopper.list(&mut function.body);
    }
    stopper.list(&mut program.shader.body);
}

struct Stopper<'s> {
    stops: &'s Stops,
    base: u32,
}

impl Stopper<'_> {
    /// Processes a list. Returns whether it was cut off.
    fn list(&self, list: &mut Vec<Stmt>) -> bool {
        for at in 0..list.len() {
            let Some(stmt) = list.get_mut(at) else { break };
            let (stays, stopped) = self.stmt(stmt);
            if stopped {
                list.truncate(at + usize::from(stays));
                return true;
            }
        }
        false
    }

    /// Whether the statement stays, and whether nothing after it does.
    fn stmt(&self, stmt: &mut Stmt) -> (bool, bool) {
        match &mut stmt.kind {
            StmtKind::Expr(e) => self.gone(self.expr(e)),
            StmtKind::Declare(_, init) | StmtKind::Return(init) => {
                self.gone(init.as_ref().is_some_and(|init| self.init(init)))
            }
            StmtKind::Block(list) => (true, self.list(list)),
            StmtKind::If(cond, then, otherwise) => {
                if self.expr(cond) {
                    return (false, true);
                }
                let stopped = self.list(then) | self.list(otherwise);
                (true, stopped && !self.stops.open.contains(&cond.span.moved(self.base)))
            }
            StmtKind::Loop { body, .. } => {
                self.list(body);
                (true, false)
            }
            StmtKind::Break | StmtKind::Continue => (true, false),
        }
    }

    fn gone(&self, stopped: bool) -> (bool, bool) {
        (!stopped, stopped)
    }

    /// Whether the expression contains a call that does not compile.
    fn expr(&self, e: &Expr) -> bool {
        let is = |name: &str| {
            let call = (Arc::from(name), e.span.moved(self.base));
            self.stops.calls.contains(&call)
        };
        let own = match &e.kind {
            ExprKind::Builtin(call) => is(call.row.name),
            ExprKind::Operation(call) => is(&call.name),
            _ => false,
        };
        own || e.parts().into_iter().any(|part| self.expr(part))
    }

    fn init(&self, init: &Init) -> bool {
        init.exprs().into_iter().any(|e| self.expr(e))
    }
}
