//! Calls of the program's own functions: binding formals to arguments.

use super::expr::is_plain;
use super::place::Spot;
use super::stmt::Flow;
use super::{Stop, Value, Walker};
use osl_hir::hir::{Arg, ExprKind, FunctionId, Init, Lvalue, VarKind};
use osl_ir::types::Type;

impl Walker<'_> {
    /// Calls a function. A variable, or a field of one, *is* the formal, output or not. Parts with an index
    /// that are given to outputs are copied, and written back in order after the call, except elements that
    /// are structs. All else is a value of the call's own.
    pub(super) fn call(&mut self, id: FunctionId, args: &[Arg]) -> Result<Value, Stop> {
        let program = self.program;
        let function = &program.functions[id.0 as usize];
        let mut bound = Vec::new();
        let mut back: Vec<(Spot, Spot)> = Vec::new();
        for (arg, formal) in args.iter().zip(&function.formals) {
            let var = &program.vars[formal.0 as usize];
            let output = matches!(var.kind, VarKind::Formal { output: true });
            let place = match arg {
                Arg::Alias(place) => Ok(place),
                Arg::Copy { value, .. } => place_of(value).ok_or(value),
            };
            let spot = match place {
                Ok(place) if is_plain(place) => self.spot(place)?,
                Ok(place) => {
                    let from = self.spot(place)?;
                    let value = self.read(&from);
                    let own = self.own(value);
                    if output && place.ty.as_struct().is_none() {
                        back.push((from, own.clone()));
                    }
                    own
                }
                Err(init) => {
                    let value = self.made_from(var.ty, init)?;
                    self.own(value)
                }
            };
            bound.push((*formal, spot));
        }
        for (formal, spot) in bound {
            self.bind(formal, spot);
        }
        let value = match self.statements_of(&function.body, function.ret)? {
            Flow::Return(value) => value,
            // Undefined in the language, zero here.
            _ if function.ret != Type::VOID => self.zero(function.ret),
            _ => Value::Nothing,
        };
        for (to, from) in back {
            let value = self.read(&from);
            self.write(&to, value);
        }
        Ok(value)
    }

    /// A variable without a name.
    fn own(&mut self, value: Value) -> Spot {
        self.cells.push(value);
        Spot::cell(self.cells.len() - 1)
    }
}

/// The place that an argument names.
fn place_of(init: &Init) -> Option<&Lvalue> {
    match init {
        Init::Value(e) => match &e.kind {
            ExprKind::Read(place) => Some(place),
            _ => None,
        },
        Init::List(_) => None,
    }
}
