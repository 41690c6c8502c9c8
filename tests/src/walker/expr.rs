//! Expressions: operands are evaluated from left to right, but plain variables are read after all of them.

use super::place::Spot;
use super::{Stop, Value, Walker, math, ops};
use osl_hir::hir::{Expr, ExprKind, Init, Lvalue};
use osl_ir::types::{Base, Type};
use osl_syntax::ast::BinaryOp;

/// An operand: its value, or a variable that is read after the others are evaluated.
pub(super) enum Operand {
    Now(Value),
    Later(Spot),
}

impl Walker<'_> {
    pub(super) fn eval(&mut self, e: &Expr) -> Result<Value, Stop> {
        self.tick()?;
        Ok(match &e.kind {
            ExprKind::Int(n) => Value::Int(*n),
            ExprKind::Float(x) => Value::Float(*x),
            ExprKind::Str(text) => Value::Text(text.clone()),
            ExprKind::Read(place) => {
                let spot = self.spot(place)?;
                self.read(&spot)
            }
            ExprKind::Convert(inner) => {
                let value = self.eval(inner)?;
                converted(value, e.ty)
            }
            ExprKind::Unary(op, inner) => {
                let value = self.eval(inner)?;
                ops::unary(*op, &value)?
            }
            ExprKind::Binary(BinaryOp::And, a, b) => Value::Int((self.holds(a)? && self.holds(b)?).into()),
            ExprKind::Binary(BinaryOp::Or, a, b) => Value::Int((self.holds(a)? || self.holds(b)?).into()),
            ExprKind::Binary(op, a, b) => {
                let values = self.operands(&[a, b])?;
                ops::binary(*op, &values[0], &values[1], is_literal(b))?
            }
            ExprKind::Ternary(cond, a, b) => {
                let chosen = if self.holds(cond)? { a } else { b };
                self.eval(chosen)?
            }
            ExprKind::Assign(place, init) => {
                // The right side first, then the indices on the left.
                let operand = self.operand_of(place.ty, init)?;
                let before = match &operand {
                    Operand::Later(spot) => Some(self.read(spot)),
                    Operand::Now(_) => None,
                };
                let spot = self.spot(place)?;
                let value = self.settled(operand);
                if before.is_some_and(|before| format!("{before:?}") != format!("{value:?}")) {
                    return Err(Stop::Open("a variable on the right that an index on the left changes"));
                }
                self.write(&spot, value.clone());
                value
            }
            ExprKind::Step { prefix, increment, place } => {
                let spot = self.spot(place)?;
                let old = self.read(&spot);
                let new = ops::stepped(&old, *increment);
                self.write(&spot, new.clone());
                if *prefix { new } else { old }
            }
            ExprKind::Triple(parts) => {
                let values = self.operands(&parts.iter().collect::<Vec<_>>())?;
                Value::Triple([values[0].float(), values[1].float(), values[2].float()])
            }
            ExprKind::Matrix(cells) => {
                let values = self.operands(&cells.iter().collect::<Vec<_>>())?;
                Value::Matrix(std::array::from_fn(|at| values[at].float()))
            }
            ExprKind::Struct(parts) => self.made_from(e.ty, &Init::List(parts.clone()))?,
            ExprKind::Call(id, args) => self.call(*id, args)?,
            ExprKind::Builtin(call) => self.builtin(call)?,
            ExprKind::Comma(list) => {
                let mut last = Value::Nothing;
                for item in list {
                    last = self.eval(item)?;
                }
                last
            }
            ExprKind::NullClosure | ExprKind::Operation(_) | ExprKind::Error => {
                return Err(Stop::Open("closures"));
            }
        })
    }

    /// The value of a condition.
    pub(super) fn holds(&mut self, e: &Expr) -> Result<bool, Stop> {
        let value = self.eval(e)?;
        ops::holds(&value)
    }

    fn operands(&mut self, list: &[&Expr]) -> Result<Vec<Value>, Stop> {
        let mut operands = Vec::new();
        for e in list {
            operands.push(self.operand(e)?);
        }
        Ok(operands.into_iter().map(|o| self.settled(o)).collect())
    }

    /// An operand. A variable, or a field of one, is the variable itself; so is the result of `++x` and
    /// `x = y`.
    pub(super) fn operand(&mut self, e: &Expr) -> Result<Operand, Stop> {
        let place = match &e.kind {
            ExprKind::Read(place) => Some(place),
            ExprKind::Step { prefix: true, place, .. } | ExprKind::Assign(place, _) if is_plain(place) => {
                self.eval(e)?;
                Some(place)
            }
            _ => None,
        };
        match place.filter(|place| is_plain(place)) {
            Some(place) => Ok(Operand::Later(self.spot(place)?)),
            None => Ok(Operand::Now(self.eval(e)?)),
        }
    }

    fn operand_of(&mut self, ty: Type, init: &Init) -> Result<Operand, Stop> {
        match init {
            Init::Value(e) => self.operand(e),
            Init::List(_) => Ok(Operand::Now(self.made_from(ty, init)?)),
        }
    }

    pub(super) fn settled(&mut self, operand: Operand) -> Value {
        match operand {
            Operand::Now(value) => value,
            Operand::Later(spot) => self.read(&spot),
        }
    }
}

/// Whether a place is a variable, or a field of one.
pub(super) fn is_plain(place: &Lvalue) -> bool {
    place.path.iter().all(|step| matches!(step, osl_hir::hir::Step::Field(_)))
}

/// Whether an expression is written as a number.
pub(super) fn is_literal(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Int(_) | ExprKind::Float(_) => true,
        ExprKind::Unary(osl_syntax::ast::UnaryOp::Neg, inner) | ExprKind::Convert(inner) => is_literal(inner),
        _ => false,
    }
}

/// A value converted to another type.
fn converted(value: Value, to: Type) -> Value {
    match (to.base, &value) {
        (Base::Int, Value::Float(x)) => Value::Int(math::truncated(*x)),
        (Base::Float, Value::Int(_)) => Value::Float(value.float()),
        (Base::Color | Base::Point | Base::Vector | Base::Normal, Value::Int(_) | Value::Float(_)) => {
            Value::Triple(value.triple())
        }
        (Base::Matrix, Value::Int(_) | Value::Float(_)) => Value::Matrix(value.matrix()),
        _ => value,
    }
}
