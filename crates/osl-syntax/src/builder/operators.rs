//! Binary operators: a chain of operands and operators becomes a tree by precedence.

use super::Builder;
use crate::ast::{BinaryOp, ExprId, ExprKind, UnaryOp};

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
            let kind = self.infinite(left.op, left.operand, operand);
            operand = self.expr(first, end, kind.unwrap_or(ExprKind::Binary(left.op, left.operand, operand)));
        }
        (operand, first)
    }

    /// The value of a quotient of literals by 0, if the options make it infinite.
    fn infinite(&self, op: BinaryOp, a: ExprId, b: ExprId) -> Option<ExprKind> {
        if !self.options.infinite_quotients || op != BinaryOp::Div {
            return None;
        }
        let (sign, a) = match self.get(a).kind {
            ExprKind::Unary(UnaryOp::Neg, a) => (-1.0, a),
            _ => (1.0, a),
        };
        let above = match (&self.get(a).kind, &self.get(b).kind) {
            (ExprKind::Float(a), ExprKind::Float(0.0) | ExprKind::Int(0)) => sign * *a,
            (ExprKind::Int(a), ExprKind::Float(0.0)) => sign * *a as f32,
            _ => return None,
        };
        (above != 0.0).then(|| ExprKind::Float(f32::INFINITY.copysign(above)))
    }
}

#[cfg(test)]
mod tests {
    use crate::{NoFiles, Options, parse};

    #[test]
    fn quotients_of_literals_by_zero_are_infinite_if_wanted() {
        let text = "shader a(float a = -1.0/0.0, float b = 1/0.0, float c = 0.0/0.0, int d = 1/0) {}";
        let infinite = |infinite_quotients| {
            let options = Options { infinite_quotients, ..Options::default() };
            let shown = format!("{:?}", parse("a.osl", text, &NoFiles, &options).ast);
            ["Float(-inf)", "Float(inf)"].map(|value| shown.matches(value).count())
        };
        assert_eq!((infinite(true), infinite(false)), ([1, 1], [0, 0]));
    }
}
