//! Statements in order, loops iteration by iteration.

use super::{Stop, Value, Walker};
use osl_hir::hir::{Expr, Init, Stmt, StmtKind};
use osl_ir::types::{Base, Extent, Type};

/// How a statement ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Flow {
    Next,
    Break,
    Continue,
    Return(Value),
}

impl Walker<'_> {
    /// Executes statements until one leaves the list.
    pub(super) fn statements(&mut self, list: &[Stmt]) -> Result<Flow, Stop> {
        self.statements_of(list, Type::VOID)
    }

    /// Executes the statements of a function that returns a type.
    pub(super) fn statements_of(&mut self, list: &[Stmt], ret: Type) -> Result<Flow, Stop> {
        for stmt in list {
            let flow = self.statement(stmt, ret)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn statement(&mut self, stmt: &Stmt, ret: Type) -> Result<Flow, Stop> {
        self.tick()?;
        match &stmt.kind {
            StmtKind::Expr(e) => {
                self.eval(e)?;
            }
            StmtKind::Declare(var, init) => {
                let ty = self.program.vars[var.0 as usize].ty;
                let again = self.places[var.0 as usize].is_some();
                let value = match init {
                    Some(init) => self.made_from(ty, init)?,
                    // Its value is undefined: numbers are 0 here, arrays keep the values of the previous
                    // iteration.
                    None if again && self.holds_array(ty) => {
                        return Err(Stop::Open("an array that lives again without values"));
                    }
                    None => self.zero(ty),
                };
                self.bring_to_life(*var, value);
            }
            StmtKind::Block(list) => return self.statements_of(list, ret),
            StmtKind::If(cond, then, otherwise) => {
                let chosen = if self.holds(cond)? { then } else { otherwise };
                return self.statements_of(chosen, ret);
            }
            StmtKind::Loop { cond, test_first, iter, body } => {
                return self.repeat(cond.as_ref(), *test_first, iter.as_ref(), body, ret);
            }
            StmtKind::Break => return Ok(Flow::Break),
            StmtKind::Continue => return Ok(Flow::Continue),
            StmtKind::Return(None) => return Ok(Flow::Return(Value::Nothing)),
            StmtKind::Return(Some(init)) => return Ok(Flow::Return(self.made_from(ret, init)?)),
        }
        Ok(Flow::Next)
    }

    fn repeat(
        &mut self,
        cond: Option<&Expr>,
        test_first: bool,
        iter: Option<&Expr>,
        body: &[Stmt],
        ret: Type,
    ) -> Result<Flow, Stop> {
        let mut test = test_first;
        loop {
            self.tick()?;
            if test
                && let Some(cond) = cond
                && !self.holds(cond)?
            {
                return Ok(Flow::Next);
            }
            test = true;
            match self.statements_of(body, ret)? {
                Flow::Break => return Ok(Flow::Next),
                Flow::Return(value) => return Ok(Flow::Return(value)),
                Flow::Next | Flow::Continue => {}
            }
            if let Some(iter) = iter {
                self.eval(iter)?;
            }
        }
    }

    /// The value of a type that an initialiser gives: the parts of a list in order, missing ones zero.
    pub(super) fn made_from(&mut self, ty: Type, init: &Init) -> Result<Value, Stop> {
        let items = match init {
            Init::Value(e) => {
                let from = self.eval(e)?;
                let mut value = self.zero(ty);
                // An array takes as many elements as its source has.
                match (&mut value, ty.extent) {
                    (Value::Many(_), Extent::One | Extent::Array(_)) => value.assign(from),
                    _ => value = from,
                }
                return Ok(value);
            }
            Init::List(items) => items,
        };
        let mut parts = match (self.zero(ty), ty.extent) {
            (Value::Many(parts), Extent::Unsized) => vec![parts[0].clone(); items.len().max(1)],
            (Value::Many(parts), _) => parts,
            _ => return Err(Stop::Open("a list for what has no parts")),
        };
        for (index, item) in items.iter().enumerate().take(parts.len()) {
            let part = match (ty.base, ty.extent) {
                (Base::Struct(id), Extent::One) => self.program.structs.get(id).fields[index].ty,
                _ => ty.element(),
            };
            parts[index] = self.made_from(part, item)?;
        }
        Ok(Value::Many(parts))
    }
}
