//! Expressions as prefix forms.

use super::Printer;
use crate::ast::{BinaryOp, ExprId, ExprKind, UnaryOp};

/// The spelling of a binary operator.
pub(crate) fn binary_op(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Mul => "*",
        BinaryOp::Div => "/",
        BinaryOp::Mod => "%",
        BinaryOp::Add => "+",
        BinaryOp::Sub => "-",
        BinaryOp::Shl => "<<",
        BinaryOp::Shr => ">>",
        BinaryOp::Lt => "<",
        BinaryOp::Le => "<=",
        BinaryOp::Gt => ">",
        BinaryOp::Ge => ">=",
        BinaryOp::Eq => "==",
        BinaryOp::Ne => "!=",
        BinaryOp::BitAnd => "&",
        BinaryOp::BitXor => "^",
        BinaryOp::BitOr => "|",
        BinaryOp::And => "&&",
        BinaryOp::Or => "||",
    }
}

impl Printer<'_> {
    /// An expression on one line.
    pub(super) fn expr(&self, mut id: ExprId) -> String {
        // A chain of operators may be long.
        let mut chain = Vec::new();
        while let Some(ExprKind::Binary(op, a, b)) = self.ast.exprs.get(id.0 as usize).map(|e| &e.kind) {
            chain.push((*op, *b));
            id = *a;
        }
        let mut out: String = chain.iter().map(|(op, _)| format!("({} ", binary_op(*op))).collect();
        out.push_str(&self.operand(id));
        for (_, right) in chain.iter().rev() {
            out.push(' ');
            out.push_str(&self.expr(*right));
            out.push(')');
        }
        out
    }

    /// An expression that is not a binary operator.
    fn operand(&self, id: ExprId) -> String {
        let Some(e) = self.ast.exprs.get(id.0 as usize) else { return "<error>".to_owned() };
        let x = |e: &ExprId| self.expr(*e);
        match &e.kind {
            ExprKind::Int(v) => v.to_string(),
            ExprKind::Float(v) => format!("{v:?}"),
            ExprKind::Str(v) => format!("{v:?}"),
            ExprKind::Name(n) => n.to_string(),
            ExprKind::Unary(UnaryOp::Neg, a) => format!("(- {})", x(a)),
            ExprKind::Unary(UnaryOp::Not, a) => format!("(! {})", x(a)),
            ExprKind::Unary(UnaryOp::Compl, a) => format!("(~ {})", x(a)),
            ExprKind::Step { prefix, increment, target } => {
                let op = if *increment { "++" } else { "--" };
                let side = if *prefix { "pre" } else { "post" };
                format!("({side}{op} {})", x(target))
            }
            ExprKind::Binary(..) => self.expr(id),
            ExprKind::Assign { op, target, value } => {
                format!("({}= {} {})", op.map_or("", binary_op), x(target), x(value))
            }
            ExprKind::Ternary(c, a, b) => format!("(? {} {} {})", x(c), x(a), x(b)),
            ExprKind::Cast(ty, a) => format!("(cast {} {})", self.ty(ty), x(a)),
            ExprKind::Construct(ty, v) => format!("(new {}{})", self.ty(ty), self.all(v)),
            ExprKind::Call(n, v) => format!("(call {}{})", n.text, self.all(v)),
            ExprKind::Index(a, i) => format!("(index {} {})", x(a), x(i)),
            ExprKind::Field(a, n) => format!("(field {} {})", x(a), n.text),
            ExprKind::Comma(v) => format!("(,{})", self.all(v)),
            ExprKind::Paren(a) => format!("(paren {})", x(a)),
            ExprKind::InitList(v) => format!("{{{}}}", self.all(v).trim_start()),
            ExprKind::Error => "<error>".to_owned(),
        }
    }

    fn all(&self, v: &[ExprId]) -> String {
        v.iter().map(|e| format!(" {}", self.expr(*e))).collect()
    }
}
