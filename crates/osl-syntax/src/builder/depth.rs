//! The depth of the parts of an expression or statement.

use super::Builder;
use super::chains::Depth;
use crate::ast::{ExprId, ExprKind, StmtId, StmtKind};

impl Builder<'_> {
    pub(super) fn depth(&self, id: ExprId) -> u32 {
        self.expr_depths.get(id.0 as usize).map_or(0, Depth::whole)
    }

    fn depth_of_all<'i>(&self, ids: impl IntoIterator<Item = &'i ExprId>) -> u32 {
        ids.into_iter().map(|e| self.depth(*e)).max().unwrap_or(0)
    }

    pub(super) fn children_depth(&self, kind: &ExprKind) -> u32 {
        match kind {
            ExprKind::Int(_)
            | ExprKind::Float(_)
            | ExprKind::Str(_)
            | ExprKind::Name(_)
            | ExprKind::Error => 0,
            ExprKind::Unary(_, a) | ExprKind::Cast(_, a) | ExprKind::Field(a, _) | ExprKind::Paren(a) => {
                self.depth(*a)
            }
            ExprKind::Step { target, .. } => self.depth(*target),
            ExprKind::Binary(_, a, b) | ExprKind::Index(a, b) => self.depth_of_all([a, b]),
            ExprKind::Assign { target, value, .. } => self.depth_of_all([target, value]),
            ExprKind::Ternary(a, b, c) => self.depth_of_all([a, b, c]),
            ExprKind::Construct(_, v) | ExprKind::Call(_, v) | ExprKind::Comma(v) | ExprKind::InitList(v) => {
                self.depth_of_all(v)
            }
        }
    }

    pub(super) fn depth_of_stmt(&self, id: StmtId) -> u32 {
        self.stmt_depths.get(id.0 as usize).map_or(0, Depth::whole)
    }

    fn depth_of_stmts(&self, ids: &[StmtId]) -> u32 {
        ids.iter().map(|s| self.depth_of_stmt(*s)).max().unwrap_or(0)
    }

    pub(super) fn stmt_children_depth(&self, kind: &StmtKind) -> u32 {
        match kind {
            StmtKind::Empty | StmtKind::Break | StmtKind::Continue | StmtKind::Error => 0,
            StmtKind::Expr(e) => self.depth(*e),
            StmtKind::Return(e) => self.depth_of_all(e),
            StmtKind::Declare { vars, .. } => self.depth_of_all(vars.iter().filter_map(|v| v.init.as_ref())),
            StmtKind::Block(v) => self.depth_of_stmts(v),
            StmtKind::If { cond, then, otherwise } => {
                let otherwise = otherwise.map_or(0, |s| self.depth_of_stmt(s));
                self.depth(*cond).max(self.depth_of_stmt(*then)).max(otherwise)
            }
            StmtKind::While { cond, body } | StmtKind::DoWhile { body, cond } => {
                self.depth(*cond).max(self.depth_of_stmt(*body))
            }
            StmtKind::For { init, cond, iter, body } => {
                let head = self.depth_of_all(cond.iter().chain(iter));
                head.max(init.map_or(0, |s| self.depth_of_stmt(s))).max(self.depth_of_stmt(*body))
            }
            StmtKind::Function(f) => f.body.as_ref().map_or(0, |b| self.depth_of_stmts(&b.stmts)),
        }
    }
}
