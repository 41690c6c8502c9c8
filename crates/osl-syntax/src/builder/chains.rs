//! The depth of expressions and statements, and the places where long chains are cut.
//!
//! A chain of operators leans to the left, and a chain of `else if` to the right, so each link would be one
//! level deeper than the last. Generated shaders have chains of thousands of links. Such a chain is cut into
//! pieces: later stages keep the value of a piece in a variable, so that the pieces stand beside each other.
//! A chain that is shorter than half of the permitted nesting stays whole.

use super::Builder;
use crate::ast::{ExprKind, StmtId, StmtKind};

/// The part of the permitted nesting from which on a chain is cut.
const CUT_AT: u64 = 2;
/// The part of the permitted nesting that a piece has at least as links: a cut costs levels, so that parts of
/// a few links, nested in one another, are deeper with cuts than without them.
const MIN_LINKS: u64 = 32;

/// The depth of a tree; for a link of a chain, of the chain so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Depth {
    /// Of the last piece.
    piece: u32,
    /// Of the pieces before it, with what holds each of them; 0 if there are none.
    before: u32,
    /// Links of the last piece.
    links: u32,
}

impl Depth {
    /// The levels of the whole: the pieces stand beside each other on one more.
    pub(super) fn whole(&self) -> u32 {
        match self.before {
            0 => self.piece,
            before => 1 + before.max(self.piece),
        }
    }
}

impl Builder<'_> {
    /// The depth of an expression, and whether its left operand ends a piece.
    pub(super) fn expr_depth(&self, kind: &ExprKind) -> (Depth, bool) {
        let plain = Depth { piece: 1 + self.children_depth(kind), ..Depth::default() };
        let ExprKind::Binary(_, a, b) = kind else { return (plain, false) };
        let linked = matches!(self.get(*a).kind, ExprKind::Binary(..));
        let Some(chain) = self.expr_depths.get(a.0 as usize).copied().filter(|_| linked) else {
            return (Depth { links: 1, ..plain }, false);
        };
        self.link(chain, self.depth(*b))
    }

    /// The depth of a statement, and whether its `else` begins a piece.
    pub(super) fn stmt_depth(&self, kind: &StmtKind) -> (Depth, bool) {
        let plain = Depth { piece: 1 + self.stmt_children_depth(kind), ..Depth::default() };
        let StmtKind::If { cond, then, otherwise } = kind else { return (plain, false) };
        let linked = |id: &StmtId| {
            self.ast.stmts.get(id.0 as usize).is_some_and(|s| matches!(s.kind, StmtKind::If { .. }))
        };
        let chain = otherwise.filter(linked).and_then(|id| self.stmt_depths.get(id.0 as usize)).copied();
        let Some(chain) = chain else { return (Depth { links: 1, ..plain }, false) };
        self.link(chain, self.depth(*cond).max(self.depth_of_stmt(*then)))
    }

    /// The depth of a chain with one more link, whose own parts are `own` deep, and whether it is cut before
    /// the link. What keeps the value of a piece is a level of its own.
    fn link(&self, chain: Depth, own: u32) -> (Depth, bool) {
        let nesting = self.options.limits.reading.nesting;
        let long =
            u64::from(chain.piece) >= nesting / CUT_AT && u64::from(chain.links) >= nesting / MIN_LINKS;
        if long {
            let before = chain.before.max(1 + chain.piece);
            return (Depth { piece: 1 + own.max(1), before, links: 1 }, true);
        }
        let piece = 1 + chain.piece.max(own);
        (Depth { piece, links: chain.links + 1, ..chain }, false)
    }
}
