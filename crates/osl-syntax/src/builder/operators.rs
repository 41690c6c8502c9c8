//! Binary operators: a chain of operands and operators becomes a tree by precedence.

use super::Builder;
use crate::ast::{BinaryOp, ExprId, ExprKind};

/// An operand on the left, the token with which it begins, and the operator after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left {
    operand: ExprId,
    first: u32,
    op: BinaryOp,
}

/// A chain that has an operator without its right operand: where its operands begin among those that wait.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operated(usize);

impl Builder<'_> {
    /// The first operand of a chain, which begins with the token `l`, and its operator.
    pub(crate) fn first_operand(&mut self, l: u32, operand: ExprId, op: BinaryOp) -> Operated {
        let chain = Operated(self.lefts.len());
        self.lefts.push(Left { operand, first: l, op });
        chain
    }

    /// A further operand, and the operator after it.
    pub(crate) fn next_operand(
        &mut self,
        chain: Operated,
        l: u32,
        r: u32,
        operand: ExprId,
        op: BinaryOp,
    ) -> Operated {
        let (operand, first) = self.combine(chain, (l, r), operand, op.precedence());
        self.lefts.push(Left { operand, first, op });
        chain
    }

    /// The last operand. Returns the whole chain.
    pub(crate) fn last_operand(&mut self, chain: Operated, l: u32, r: u32, operand: ExprId) -> ExprId {
        self.combine(chain, (l, r), operand, 0).0
    }

    /// Combines an operand with those on its left whose operator binds at least so tightly: operators are
    /// left-associative. Returns the expression and its first token.
    fn combine(
        &mut self,
        Operated(start): Operated,
        (mut first, end): (u32, u32),
        mut operand: ExprId,
        precedence: u8,
    ) -> (ExprId, u32) {
        while self.lefts.len() > start
            && let Some(left) = self.lefts.pop_if(|left| left.op.precedence() >= precedence)
        {
            first = left.first;
            operand = self.expr(first, end, ExprKind::Binary(left.op, left.operand, operand));
        }
        (operand, first)
    }
}
