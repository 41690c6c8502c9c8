//! Expressions: each yields a value, and may change variables while it is evaluated (side effects).
//!
//! Operands are evaluated from left to right. But an operand that is a variable, or a field of one, is read
//! only after all operands have been evaluated, so that it shows the side effects of operands on its right.
//! The same holds for the result of `x = y` and of `++x`, which is the variable. `&&`, `||` and `?:` evaluate
//! only the operands that decide. In an assignment the right side comes first, then the indices on the left.
//!
//! ```
//! use osl_walker::printed;
//! assert_eq!(printed(r#"int x = 1; printf("%d", x + (x = 2));"#), "4");
//! assert_eq!(printed(r#"int x = 1; printf("%d", x++ * 10 + x);"#), "12");
//! assert_eq!(printed(r#"int x = 1; if (x == 2 && x++) x = 9; printf("%d", x);"#), "1");
//! ```

use crate::operators::{binary, incremented, is_true, unary};
use crate::state::{Location, Stop, Walker, undefined, unsupported};
use crate::value::Value;
use osl_hir::hir::{Expr, ExprKind, Init, Lvalue};
use osl_ir::types::{Base, Extent, Type};
use osl_syntax::ast::{BinaryOp, UnaryOp};

/// An evaluated operand: a value, or a variable that is read when the other operands are evaluated.
pub(crate) enum Operand {
    Value(Value),
    Variable(Location),
}

impl Walker<'_> {
    /// Evaluates an expression.
    pub(crate) fn eval(&mut self, e: &Expr) -> Result<Value, Stop> {
        self.step(e.span)?;
        Ok(match &e.kind {
            ExprKind::Int(n) => Value::Int(*n),
            ExprKind::Float(x) => Value::Float(*x),
            ExprKind::Str(text) => Value::String(text.clone()),
            ExprKind::Read(place) => {
                let location = self.locate(place)?;
                self.read(&location)
            }
            ExprKind::Convert(inner) => self.eval(inner)?.converted(e.ty),
            ExprKind::Unary(op, inner) => unary(*op, &self.eval(inner)?)?,
            ExprKind::Binary(BinaryOp::And, a, b) => {
                Value::Int((self.condition(a)? && self.condition(b)?).into())
            }
            ExprKind::Binary(BinaryOp::Or, a, b) => {
                Value::Int((self.condition(a)? || self.condition(b)?).into())
            }
            ExprKind::Binary(op, a, b) => {
                let [left, right] = [self.operand(a)?, self.operand(b)?];
                binary(*op, &self.value_of(left), &self.value_of(right), is_literal(b))?
            }
            ExprKind::Ternary(condition, a, b) => {
                let chosen = if self.condition(condition)? { a } else { b };
                self.eval(chosen)?
            }
            ExprKind::Assign(place, init) => self.assignment(place, init)?,
            ExprKind::Step { prefix, increment, place } => {
                let location = self.locate(place)?;
                let old = self.read(&location);
                let new = incremented(&old, *increment);
                self.write(&location, new.clone());
                if *prefix { new } else { old }
            }
            ExprKind::Triple(parts) => {
                let values = self.floats(&parts[..])?;
                Value::Triple(std::array::from_fn(|at| values[at]))
            }
            ExprKind::Matrix(cells) => {
                let values = self.floats(cells)?;
                Value::Matrix(std::array::from_fn(|at| values[at]))
            }
            ExprKind::Struct(parts) => self.list(e.ty, parts)?,
            ExprKind::Call(function, args) => self.call(*function, args)?,
            ExprKind::Builtin(call) => self.builtin(call)?,
            ExprKind::Comma(list) => {
                let mut last = Value::Void;
                for item in list {
                    last = self.eval(item)?;
                }
                last
            }
            ExprKind::NullClosure | ExprKind::Operation(_) | ExprKind::Error => {
                return Err(unsupported("closures"));
            }
        })
    }

    /// The truth of a condition.
    pub(crate) fn condition(&mut self, e: &Expr) -> Result<bool, Stop> {
        is_true(&self.eval(e)?)
    }

    /// Evaluates an operand. A plain variable is not read yet.
    pub(crate) fn operand(&mut self, e: &Expr) -> Result<Operand, Stop> {
        let place = match &e.kind {
            ExprKind::Read(place) => Some(place),
            ExprKind::Step { prefix: true, place, .. } | ExprKind::Assign(place, _) if place.is_plain() => {
                self.eval(e)?;
                Some(place)
            }
            _ => None,
        };
        match place.filter(|place| place.is_plain()) {
            Some(place) => Ok(Operand::Variable(self.locate(place)?)),
            None => Ok(Operand::Value(self.eval(e)?)),
        }
    }

    /// The value of an operand, when all are evaluated.
    pub(crate) fn value_of(&self, operand: Operand) -> Value {
        match operand {
            Operand::Value(value) => value,
            Operand::Variable(location) => self.read(&location),
        }
    }

    /// The parts of `color(r, g, b)` and of `matrix(…)`, which are operands.
    fn floats(&mut self, parts: &[Expr]) -> Result<Vec<f32>, Stop> {
        let operands = parts.iter().map(|e| self.operand(e)).collect::<Result<Vec<_>, _>>()?;
        Ok(operands.into_iter().map(|operand| self.value_of(operand).float()).collect())
    }

    /// `place = init`. `place += x` reads as `place = place + x`.
    fn assignment(&mut self, place: &Lvalue, init: &Init) -> Result<Value, Stop> {
        let right = match init {
            Init::Value(e) => self.operand(e)?,
            Init::List(items) => Operand::Value(self.list(place.ty, items)?),
        };
        let before = match &right {
            Operand::Variable(location) => Some(self.read(location)),
            Operand::Value(_) => None,
        };
        let location = self.locate(place)?;
        let value = self.value_of(right);
        // As text, NaN equals itself, and 0 does not equal −0.
        if before.is_some_and(|before| format!("{before:?}") != format!("{value:?}")) {
            return Err(undefined("a variable on the right that an index on the left changes"));
        }
        self.write(&location, value.clone());
        Ok(value)
    }

    /// The value of a type that an initialiser gives.
    pub(crate) fn initial(&mut self, ty: Type, init: &Init) -> Result<Value, Stop> {
        match init {
            Init::Value(e) => {
                let from = self.eval(e)?;
                if ty.extent == Extent::Unsized {
                    return Ok(from);
                }
                let mut value = self.zero(ty);
                value.assign(from);
                Ok(value)
            }
            Init::List(items) => self.list(ty, items),
        }
    }

    /// `{ a, b }` as a value of an array or a struct: part by part in order. Missing parts are zero.
    fn list(&mut self, ty: Type, items: &[Init]) -> Result<Value, Stop> {
        let Value::Aggregate(mut parts) = self.zero(ty) else {
            return Err(undefined("a list for what has no parts"));
        };
        if ty.extent == Extent::Unsized {
            parts.resize(items.len().max(1), self.zero(ty.element()));
        }
        let program = self.program;
        for (index, (part, item)) in parts.iter_mut().zip(items).enumerate() {
            let part_type = match (ty.base, ty.extent) {
                (Base::Struct(id), Extent::One) => program.structs.get(id).fields[index].ty,
                _ => ty.element(),
            };
            *part = self.initial(part_type, item)?;
        }
        Ok(Value::Aggregate(parts))
    }
}

/// Whether an expression is written as a number. Some functions are exact only then.
pub(crate) fn is_literal(e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Int(_) | ExprKind::Float(_) => true,
        ExprKind::Unary(UnaryOp::Neg, inner) | ExprKind::Convert(inner) => is_literal(inner),
        _ => false,
    }
}
