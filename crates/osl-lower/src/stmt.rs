//! Statements: branches, loops, and jumps as flags.

use super::flow::{self, Flow, RETURNED};
use super::{LoopFlags, Lowerer};
use osl_hir::builtins::Emitted;
use osl_hir::hir::{CHAIN, Expr, ExprKind, Stmt, StmtKind, VarId};
use osl_ir::ir::{BlockId, Const, Kind, LaneOp, Note, Op, SlotId, Test, ValueId, Values};
use osl_limits::Compiling;
use osl_syntax::span::Span;

impl Lowerer<'_> {
    /// Lowers statements in order. Code after a statement that may leave runs only where it did not leave.
    pub(super) fn stmts(&mut self, list: &[Stmt]) {
        let Compiling { nested_jumps, jump_depth, .. } = self.b.limits;
        let max_nested = if u64::from(self.depth) < jump_depth { nested_jumps } else { 0 };
        let mut left = Flow::default();
        let mut rest = list;
        while !rest.is_empty() {
            let exits = self.exits;
            let mut n_lowered = rest.len();
            if left.may_leave() {
                self.guarded(left, |l| n_lowered = l.nested(rest, max_nested));
            } else {
                n_lowered = self.nested(rest, max_nested);
            }
            let (lowered, after) = rest.split_at(n_lowered.min(rest.len()));
            if after.is_empty() {
                return;
            }
            left = left.or(flow::of_list(lowered));
            left.returns |= self.exits > exits;
            rest = after;
        }
    }

    /// Lowers statements in order; the code after a jump goes into a nested block, up to a maximum nesting
    /// depth. Returns the number of statements that are finished: lowered, or never reached.
    fn nested(&mut self, list: &[Stmt], max_nested: u64) -> usize {
        for (index, stmt) in list.iter().enumerate() {
            if !self.has_room() {
                break;
            }
            let n_lowered = index + 1;
            let rest = list.get(n_lowered..).unwrap_or(&[]);
            let flow = flow::of(stmt);
            if !rest.is_empty()
                && max_nested > 0
                && let Some(n_of_rest) = self.split_if(stmt, rest, max_nested - 1)
            {
                return n_lowered + n_of_rest;
            }
            let exits = self.exits;
            self.stmt(stmt);
            let flow = Flow { returns: flow.returns || self.exits > exits, ..flow };
            self.unsure = false;
            if flow.always {
                break;
            }
            if flow.may_leave() && !rest.is_empty() {
                let mut n_of_rest = 0;
                if max_nested > 0 {
                    self.guarded(flow, |l| n_of_rest = l.nested(rest, max_nested - 1));
                }
                return n_lowered + n_of_rest;
            }
        }
        list.len()
    }

    /// `if (c) { …; return } rest` is `if (c) { …; return } else { rest }`: no flag is tested. If the
    /// statement has this form, lowers it and returns how many statements of the rest are finished.
    fn split_if(&mut self, stmt: &Stmt, rest: &[Stmt], max_nested: u64) -> Option<usize> {
        let StmtKind::If(cond, then, otherwise) = &stmt.kind else { return None };
        // A tap needs a place after the statement.
        if self.tapping.follows(stmt) {
            return None;
        }
        let (first, second) = (flow::of_list(then), flow::of_list(otherwise));
        let mut n_of_rest = 0;
        match (first.always, second.always) {
            (true, false) if !second.may_leave() => {
                self.begin(stmt);
                self.branch(
                    cond,
                    |l| l.stmts(then),
                    |l| {
                        l.stmts(otherwise);
                        n_of_rest = l.nested(rest, max_nested);
                    },
                );
            }
            (false, true) if !first.may_leave() => {
                self.begin(stmt);
                self.branch(
                    cond,
                    |l| {
                        l.stmts(then);
                        n_of_rest = l.nested(rest, max_nested);
                    },
                    |l| l.stmts(otherwise),
                );
            }
            _ => return None,
        }
        Some(n_of_rest)
    }

    /// Begins a statement.
    fn begin(&mut self, stmt: &Stmt) {
        self.at(stmt.span);
        self.telling.here = self.b.span;
        if !matches!(stmt.kind, StmtKind::Block(_)) {
            self.b.note(&[], |_| Note::Reach);
        }
    }

    fn is_of_chain(&self, var: VarId) -> bool {
        self.program.vars.get(var.0 as usize).is_some_and(|var| &*var.name == CHAIN)
    }

    fn branch(&mut self, cond: &Expr, then: impl FnOnce(&mut Self), otherwise: impl FnOnce(&mut Self)) {
        let place = cond.span;
        let before = self.ops_so_far();
        // No source has the test whether a long chain goes on.
        let written = !matches!(&cond.kind, ExprKind::Read(place) if self.is_of_chain(place.var));
        self.reads_for("if", 0);
        let cond = self.truth(cond);
        self.count_op();
        let tested = self.ops_so_far();
        self.at(place);
        if written {
            self.b.note(&[cond], |_| Note::Branch(Test::If));
        }
        let then = |l: &mut Self| {
            l.tap_branch(place, true);
            then(l);
        };
        let otherwise = |l: &mut Self| {
            l.tap_branch(place, false);
            otherwise(l);
        };
        if self.unsure {
            // The condition may have ended the shader: then neither branch runs.
            self.guarded(RETURNED, |l| l.if_else(cond, then, otherwise));
        } else {
            self.if_else(cond, then, otherwise);
        }
        // The reference omits an `if` whose contents vanish.
        if self.ops_so_far() == tested {
            self.forget_ops(before);
        }
    }

    /// `if` on a value.
    pub(super) fn if_else(
        &mut self,
        cond: ValueId,
        then: impl FnOnce(&mut Self),
        otherwise: impl FnOnce(&mut Self),
    ) {
        let at = self.b.span;
        let then = self.in_block(then);
        let otherwise = self.in_block(otherwise);
        self.b.span = at;
        let op = Op::If { cond, then, otherwise, then_yields: Values::new(), else_yields: Values::new() };
        self.b.push(op, Values::new());
    }

    pub(super) fn in_block(&mut self, work: impl FnOnce(&mut Self)) -> BlockId {
        let (block, ()) = self.b.in_block(|_| ());
        let outer = std::mem::replace(&mut self.b.current, block);
        self.depth += 1;
        work(self);
        self.depth -= 1;
        self.b.current = outer;
        block
    }

    /// Runs `work` only where no jump of this flow was taken.
    pub(super) fn guarded(&mut self, flow: Flow, work: impl FnOnce(&mut Self)) {
        let live = self.live(flow);
        // Inside, no point has left the shader.
        let outer = std::mem::replace(&mut self.unsure, false);
        self.if_else(live, work, |_| ());
        self.unsure |= outer;
    }

    /// Runs `work` only where no point has left the shader within this statement.
    pub(super) fn where_live(&mut self, work: impl FnOnce(&mut Self)) {
        if self.unsure {
            self.guarded(RETURNED, work);
        } else {
            work(self);
        }
    }

    /// The results of a built-in where no point has left the shader within this statement, and zero
    /// elsewhere.
    pub(super) fn emitted_where_live(&mut self, work: impl FnOnce(&mut Self) -> Emitted) -> Emitted {
        if !self.unsure {
            return work(self);
        }
        let live = self.live(RETURNED);
        let mut found = Emitted::default();
        let mut slots: Vec<SlotId> = Vec::new();
        let then = self.in_block(|l| {
            let outer = std::mem::replace(&mut l.unsure, false);
            found = work(l);
            l.unsure |= outer;
            // Values of a block are not visible outside it.
            for value in found.result.into_iter().chain(found.outputs.iter().map(|(_, value)| *value)) {
                let slot = l.b.slot(l.b.body.kind(value), None, "yields".into());
                l.b.store(slot, value);
                slots.push(slot);
            }
        });
        let otherwise = self.in_block(|_| ());
        for slot in &slots {
            let zero = self.b.constant(Const::zero(self.b.body.slot(*slot).kind));
            self.b.store(*slot, zero);
        }
        let op =
            Op::If { cond: live, then, otherwise, then_yields: Values::new(), else_yields: Values::new() };
        self.b.push(op, Values::new());
        let mut loaded = slots.into_iter().map(|slot| self.b.load(slot));
        if found.result.is_some() {
            found.result = loaded.next();
        }
        for ((_, value), slot) in found.outputs.iter_mut().zip(loaded) {
            *value = slot;
        }
        found
    }

    /// 1 where no jump of this flow was taken.
    fn live(&mut self, flow: Flow) -> ValueId {
        let mut flags: Vec<SlotId> = Vec::new();
        if let Some(frame) = self.frames.last() {
            if flow.returns {
                flags.push(frame.returned);
            }
            if let Some(inner) = frame.loops.last() {
                if flow.breaks {
                    flags.push(inner.broke);
                }
                if flow.continues {
                    flags.push(inner.continued);
                }
            }
        }
        let mut left: Option<ValueId> = None;
        for flag in flags {
            let value = self.b.load(flag);
            left = Some(match left {
                None => value,
                Some(before) => self.b.lane(LaneOp::IOr, &[before, value]),
            });
        }
        let zero = self.b.int(0);
        match left {
            Some(left) => self.b.lane(LaneOp::IEq, &[left, zero]),
            None => self.b.int(1),
        }
    }

    fn stmt(&mut self, stmt: &Stmt) {
        self.begin(stmt);
        let exits = self.exits;
        match &stmt.kind {
            StmtKind::Expr(e) => {
                self.eval(e);
            }
            StmtKind::Declare(var, init) => {
                let decl = &self.program.vars[var.0 as usize];
                let storage = self.allocate(decl.ty, &decl.name);
                match init {
                    Some(init) => self.store_init(&storage, decl.ty, init),
                    None => {
                        self.store_zero(&storage);
                        self.mark_unset(*var, &storage);
                    }
                }
                self.bind(*var, storage);
            }
            StmtKind::Block(list) => self.stmts(list),
            StmtKind::If(cond, then, otherwise) => {
                self.branch(cond, |l| l.stmts(then), |l| l.stmts(otherwise))
            }
            StmtKind::Loop { cond, test_first, iter, body } => {
                self.loop_(cond.as_ref(), *test_first, iter.as_ref(), body, stmt.span)
            }
            StmtKind::Break => {
                self.tap_before_jump(stmt);
                if let Some(flags) = self.loop_flags() {
                    self.set_flag(flags.broke, 1);
                }
            }
            StmtKind::Continue => {
                self.tap_before_jump(stmt);
                if let Some(flags) = self.loop_flags() {
                    self.set_flag(flags.continued, 1);
                }
            }
            StmtKind::Return(value) => {
                if let Some(init) = value {
                    self.store_return(init);
                }
                self.tap_before_jump(stmt);
                if let Some(frame) = self.frames.last() {
                    let returned = frame.returned;
                    self.set_flag(returned, 1);
                }
            }
        }
        if !matches!(stmt.kind, StmtKind::Break | StmtKind::Continue | StmtKind::Return(_)) {
            self.tap_after(stmt, exits);
        }
    }

    fn loop_flags(&self) -> Option<LoopFlags> {
        self.frames.last()?.loops.last().copied()
    }

    /// Every loop becomes one that tests at the end: `go` tells whether the point runs another iteration.
    fn loop_(
        &mut self,
        cond: Option<&Expr>,
        test_first: bool,
        iter: Option<&Expr>,
        body: &[Stmt],
        span: Span,
    ) {
        let flags = LoopFlags { broke: self.flag("broke"), continued: self.flag("continued") };
        self.count_op();
        self.b.note(&[], |_| Note::Loop);
        let go = self.b.slot(Kind::Int, None, "go".into());
        if let Some(frame) = self.frames.last_mut() {
            frame.loops.push(flags);
        }
        let block = self.in_block(|l| {
            l.set_flag(go, 0);
            if test_first {
                let test = l.loop_test(cond);
                let round = |l: &mut Self| l.round((body, span), flags, iter, |l| l.b.int(1), go);
                l.where_live(|l| l.if_else(test, round, |_| ()));
            } else {
                l.round((body, span), flags, iter, |l| l.loop_test(cond), go);
            }
        });
        let outer = std::mem::replace(&mut self.b.current, block);
        let again = self.b.load(go);
        self.b.current = outer;
        if let Some(frame) = self.frames.last_mut() {
            frame.loops.pop();
        }
        self.at(span);
        let op = Op::Loop {
            init: Values::new(),
            params: Values::new(),
            body: block,
            cond: again,
            next: Values::new(),
        };
        self.b.push(op, Values::new());
    }

    fn loop_test(&mut self, cond: Option<&Expr>) -> ValueId {
        match cond {
            Some(cond) => self.truth(cond),
            None => self.b.int(1),
        }
    }

    /// One iteration: the body, then the iteration expression and the next test, unless the loop was left.
    fn round(
        &mut self,
        (body, span): (&[Stmt], Span),
        flags: LoopFlags,
        iter: Option<&Expr>,
        test: impl FnOnce(&mut Self) -> ValueId,
        go: SlotId,
    ) {
        self.set_flag(flags.continued, 0);
        self.at(span);
        self.b.note(&[], |_| Note::Round);
        self.tap_start(span);
        let exits = self.exits;
        self.stmts(body);
        let flow = flow::of_list(body);
        let returns = flow.returns || self.exits > exits;
        let leaving = Flow { continues: false, always: false, returns, ..flow };
        let finish = |l: &mut Self| {
            l.tap_round(span);
            l.at(span);
            l.telling.here = l.b.span;
            if let Some(iter) = iter {
                l.eval(iter);
            }
            let again = test(l);
            l.where_live(|l| l.b.store(go, again));
        };
        if leaving.may_leave() {
            self.guarded(leaving, finish);
        } else {
            finish(self);
        }
    }
}
