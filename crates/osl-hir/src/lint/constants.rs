//! Finds constant conditions: literals, and locals that keep a literal from their declaration on.
//!
//! Parameters do not count, since the user sets them, nor does code from macros.

use super::Findings;
use super::walk::{Walk, bodies, each_stmt};
use crate::hir::{Expr, ExprKind, Init, StmtKind, VarId};
use osl_ir::types::Type;
use osl_syntax::ast::{BinaryOp as B, UnaryOp};
use rustc_hash::FxHashMap;

/// The value of a constant, if it is easy to find.
type Value = Option<f64>;

/// The constants of a program.
pub(super) struct Constants {
    /// Locals that are never assigned after a declaration with a constant of literals.
    vars: FxHashMap<VarId, Value>,
}

impl Constants {
    /// Literals alone.
    pub(super) fn none() -> Constants {
        Constants { vars: FxHashMap::default() }
    }

    /// Collects the locals. A local that is computed from another is not followed.
    pub(super) fn of(walk: &Walk<'_>, found: &Findings<'_>) -> Constants {
        let none = Constants::none();
        let mut vars = FxHashMap::default();
        for body in bodies(walk.program) {
            each_stmt(body, &mut |stmt| {
                if let StmtKind::Declare(var, Some(Init::Value(value))) = &stmt.kind
                    && !walk.is_written(*var)
                    && let Some(constant) = none.value(value)
                    && is_plain(walk, value, found)
                {
                    vars.insert(*var, constant);
                }
            });
        }
        Constants { vars }
    }

    /// Whether the expression is a constant, and its value.
    pub(super) fn value(&self, e: &Expr) -> Option<Value> {
        match &e.kind {
            ExprKind::Int(n) => Some(Some(f64::from(*n))),
            ExprKind::Float(x) => Some(Some(f64::from(*x))),
            ExprKind::Str(text) => Some(Some(if text.is_empty() { 0.0 } else { 1.0 })),
            ExprKind::Read(place) if place.path.is_empty() => self.vars.get(&place.var).copied(),
            ExprKind::Convert(inner) => {
                let truncates = e.ty == Type::INT;
                self.value(inner).map(|value| value.map(|v| if truncates { v.trunc() } else { v }))
            }
            ExprKind::Unary(op, inner) => {
                let value = self.value(inner)?;
                Some(value.and_then(|v| match op {
                    UnaryOp::Not => Some(f64::from(v == 0.0)),
                    UnaryOp::Neg => Some(-v),
                    UnaryOp::Compl => None,
                }))
            }
            ExprKind::Binary(B::Eq | B::Ne, a, b) if a.ty == Type::STRING => {
                // The value of a string is its truth, from which equality does not follow.
                self.value(a).and(self.value(b)).map(|_| None)
            }
            ExprKind::Binary(op, a, b) => {
                let (a, b) = (self.value(a), self.value(b));
                if let Some(decided) = decided(*op, a.flatten()).or_else(|| decided(*op, b.flatten())) {
                    return Some(Some(decided));
                }
                Some(a?.zip(b?).and_then(|(a, b)| combine(*op, a, b)))
            }
            _ => None,
        }
    }

    /// The first local that makes the expression a constant.
    pub(super) fn variable(&self, e: &Expr) -> Option<VarId> {
        match &e.kind {
            ExprKind::Read(place) => Some(place.var).filter(|var| self.vars.contains_key(var)),
            ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => self.variable(inner),
            ExprKind::Binary(_, a, b) => self.variable(a).or_else(|| self.variable(b)),
            _ => None,
        }
    }

    /// Whether the expression is a constant that holds as a condition.
    pub(super) fn holds(&self, e: &Expr) -> bool {
        self.value(e).flatten().is_some_and(|v| v != 0.0)
    }
}

/// The value of `&&` or `||` if one side of it decides.
fn decided(op: B, side: Value) -> Value {
    match (op, side?) {
        (B::And, 0.0) => Some(0.0),
        (B::Or, v) if v != 0.0 => Some(1.0),
        _ => None,
    }
}

/// Comparisons and logic of constants; the folder handles arithmetic.
fn combine(op: B, a: f64, b: f64) -> Value {
    let truth = match op {
        B::Lt => a < b,
        B::Le => a <= b,
        B::Gt => a > b,
        B::Ge => a >= b,
        B::Eq => a == b,
        B::Ne => a != b,
        B::And => a != 0.0 && b != 0.0,
        B::Or => a != 0.0 || b != 0.0,
        _ => return None,
    };
    Some(f64::from(truth))
}

/// Whether the user wrote all parts of a constant here, without macros.
pub(super) fn is_plain(walk: &Walk<'_>, e: &Expr, found: &Findings<'_>) -> bool {
    let by_hand = |e: &Expr| found.text(e.span).starts_with(|c: char| !c.is_alphabetic() && c != '_');
    match &e.kind {
        ExprKind::Convert(inner) | ExprKind::Unary(_, inner) => is_plain(walk, inner, found),
        ExprKind::Binary(_, a, b) => is_plain(walk, a, found) && is_plain(walk, b, found),
        ExprKind::Read(place) => walk.var(place.var).is_some_and(|v| found.is_written(place.span, &v.name)),
        _ => by_hand(e),
    }
}
