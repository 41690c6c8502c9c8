//! Drops the code that a renderer does not compile: from a call of an unknown closure to the end of the list
//! of operations that contains the call.
//!
//! Functions, loops and conditions that folding does not decide have separate lists; blocks, and branches of
//! conditions that folding decides, belong to the list around them.

use osl_hir::hir::{Arg, Expr, ExprKind, Init, Lvalue, Program, Step, Stmt, StmtKind};
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
        let mut open = FxHashSet::default();
        super::each_inst(body, &mut |inst| {
            if let Op::If { .. } = inst.op {
                open.insert(inst.span);
            }
        });
        Stops { calls: calls.into_iter().collect(), open }
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
        let any = |list: &[Expr]| list.iter().any(|e| self.expr(e));
        match &e.kind {
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::NullClosure
            | ExprKind::Error => false,
            ExprKind::Read(place) | ExprKind::Step { place, .. } => self.place(place),
            ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => self.expr(inner),
            ExprKind::Binary(_, a, b) => self.expr(a) || self.expr(b),
            ExprKind::Ternary(cond, a, b) => self.expr(cond) || self.expr(a) || self.expr(b),
            ExprKind::Assign(place, init) => self.place(place) || self.init(init),
            ExprKind::Triple(parts) => any(&parts[..]),
            ExprKind::Matrix(parts) | ExprKind::Comma(parts) => any(parts),
            ExprKind::Struct(parts) => parts.iter().any(|part| self.init(part)),
            ExprKind::Call(_, args) => args.iter().any(|arg| match arg {
                Arg::Alias(_) => false,
                Arg::Copy { value, back } => {
                    self.init(value) || back.as_ref().is_some_and(|place| self.place(place))
                }
            }),
            ExprKind::Builtin(call) => is(call.row.name) || any(&call.args),
            ExprKind::Operation(call) => is(&call.name) || any(&call.args),
        }
    }

    fn init(&self, init: &Init) -> bool {
        match init {
            Init::Value(e) => self.expr(e),
            Init::List(list) => list.iter().any(|init| self.init(init)),
        }
    }

    fn place(&self, place: &Lvalue) -> bool {
        place.path.iter().any(|step| match step {
            Step::Field(_) => false,
            Step::Element(at) | Step::Component(at) => self.expr(at),
            Step::Cell(row, column) => self.expr(row) || self.expr(column),
        })
    }
}
