//! Statements: executed in order, until one of them leaves the list.
//!
//! A statement completes in one of four ways: normally, by `break`, by `continue`, or by `return` with a
//! value. A block passes on what is not normal, a loop takes `break` and `continue`, and a call takes
//! `return`. `for`, `while` and `do` are one kind of loop; `do` does not test its condition before the first
//! iteration.
//!
//! ```
//! use osl_walker::printed;
//! let text = r#"
//!     for (int i = 0; i < 9; i++) {
//!         if (i == 1) continue;
//!         if (i == 4) break;
//!         printf("%d", i);
//!     }
//! "#;
//! assert_eq!(printed(text), "023");
//! ```

use crate::state::{Stop, Walker, undefined};
use crate::value::Value;
use osl_hir::hir::{Expr, Init, Program, Stmt, StmtKind, VarId};
use osl_ir::types::Type;

/// How a statement completes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Completion {
    Normal,
    Break,
    Continue,
    Return(Value),
}

impl Walker<'_> {
    /// Executes the statements of a function that returns a type.
    pub(crate) fn statements(&mut self, list: &[Stmt], ret: Type) -> Result<Completion, Stop> {
        for stmt in list {
            let completion = self.statement(stmt, ret)?;
            if completion != Completion::Normal {
                return Ok(completion);
            }
        }
        Ok(Completion::Normal)
    }

    fn statement(&mut self, stmt: &Stmt, ret: Type) -> Result<Completion, Stop> {
        self.step(stmt.span)?;
        match &stmt.kind {
            StmtKind::Expr(e) => {
                self.eval(e)?;
            }
            StmtKind::Declare(var, init) => self.declare(*var, init.as_ref())?,
            StmtKind::Block(list) => return self.statements(list, ret),
            StmtKind::If(condition, then, otherwise) => {
                let chosen = if self.condition(condition)? { then } else { otherwise };
                return self.statements(chosen, ret);
            }
            StmtKind::Loop { cond, test_first, iter, body } => {
                let mut tests = *test_first;
                while self.continues(stmt, cond.as_ref().filter(|_| tests))? {
                    match self.statements(body, ret)? {
                        Completion::Break => break,
                        Completion::Return(value) => return Ok(Completion::Return(value)),
                        Completion::Normal | Completion::Continue => {}
                    }
                    if let Some(iter) = iter {
                        self.eval(iter)?;
                    }
                    tests = true;
                }
            }
            StmtKind::Break => return Ok(Completion::Break),
            StmtKind::Continue => return Ok(Completion::Continue),
            StmtKind::Return(None) => return Ok(Completion::Return(Value::Void)),
            StmtKind::Return(Some(init)) => return Ok(Completion::Return(self.initial(ret, init)?)),
        }
        Ok(Completion::Normal)
    }

    /// Whether a loop has another iteration. No condition is a true one.
    fn continues(&mut self, stmt: &Stmt, condition: Option<&Expr>) -> Result<bool, Stop> {
        self.step(stmt.span)?;
        condition.map_or(Ok(true), |condition| self.condition(condition))
    }

    /// A declaration. Without an initialiser, the value is undefined in the language. Here it is zero, except
    /// for arrays that were declared before: renderers show what a former iteration left in them.
    fn declare(&mut self, var: VarId, init: Option<&Init>) -> Result<(), Stop> {
        let ty = self.type_of(var);
        let value = match init {
            Some(init) => self.initial(ty, init)?,
            None if self.is_bound(var) && has_array(self.program, ty) => {
                return Err(undefined("an array without values that is declared again"));
            }
            None => self.zero(ty),
        };
        let location = self.allocate(value);
        self.bind(var, location);
        Ok(())
    }
}

/// Whether a type is an array or has one in a field.
fn has_array(program: &Program, ty: Type) -> bool {
    let in_field = |id| program.structs.get(id).fields.iter().any(|field| has_array(program, field.ty));
    ty.is_array() || ty.as_struct().is_some_and(in_field)
}
