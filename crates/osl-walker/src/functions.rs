//! Functions of the shader: a call binds the formals to the arguments, then executes the body.
//!
//! An argument that is a variable, or a field of one, is passed by reference, whether the formal is an
//! `output` or not: both names have one location. A part with an index, such as `a[i]`, is passed by value to
//! an ordinary formal, and by value and result to an `output`: it is copied in, and copied back after the
//! call. (Structs in arrays are copied in only.) All other arguments are passed by value. The language has no
//! recursion, so each formal has at most one location at a time.
//!
//! ```
//! use osl_walker::printed;
//! let text = r#"
//!     void twice(output float x, float y) { x *= 2; x += y; }
//!     float a = 1; float b[2] = { 10, 20 };
//!     twice(a, a);       // By reference: y is also a, and already 2 when it is added.
//!     twice(b[0], a);    // By value and result.
//!     printf("%g %g", a, b[0]);
//! "#;
//! assert_eq!(printed(text), "4 24");
//! ```

use crate::state::{Location, Stop, Walker};
use crate::statements::Completion;
use crate::value::Value;
use osl_hir::hir::{Arg, ExprKind, FunctionId, Init, Lvalue, VarId, VarKind};
use osl_ir::types::Type;

impl Walker<'_> {
    /// Calls a function.
    pub(crate) fn call(&mut self, id: FunctionId, args: &[Arg]) -> Result<Value, Stop> {
        let program = self.program;
        let function = &program.functions[id.0 as usize];
        let mut results: Vec<(Location, Location)> = Vec::new();
        let mut bound = Vec::new();
        for (arg, formal) in args.iter().zip(&function.formals) {
            bound.push((*formal, self.argument(arg, *formal, &mut results)?));
        }
        for (formal, location) in bound {
            self.bind(formal, location);
        }
        let value = match self.statements(&function.body, function.ret)? {
            Completion::Return(value) => value,
            // Undefined in the language, zero here.
            _ if function.ret != Type::VOID => self.zero(function.ret),
            _ => Value::Void,
        };
        for (argument, formal) in results {
            let value = self.read(&formal);
            self.write(&argument, value);
        }
        Ok(value)
    }

    /// The location that an argument gives to a formal. `results` gets the pairs of locations to copy back.
    fn argument(
        &mut self,
        arg: &Arg,
        formal: VarId,
        results: &mut Vec<(Location, Location)>,
    ) -> Result<Location, Stop> {
        let place = match arg {
            Arg::Alias(place) => Ok(place),
            Arg::Copy { value, .. } => place_of(value).ok_or(value),
        };
        match place {
            Ok(place) if place.is_plain() => self.locate(place),
            Ok(place) => {
                let argument = self.locate(place)?;
                let own = self.allocate(self.read(&argument));
                let kind = self.program.vars[formal.0 as usize].kind;
                if kind == (VarKind::Formal { output: true }) && !place.is_only_copied_in() {
                    results.push((argument, own.clone()));
                }
                Ok(own)
            }
            Err(init) => {
                let value = self.initial(self.type_of(formal), init)?;
                Ok(self.allocate(value))
            }
        }
    }
}

/// The variable, or the part of one, that an argument names.
fn place_of(init: &Init) -> Option<&Lvalue> {
    match init {
        Init::Value(e) => match &e.kind {
            ExprKind::Read(place) => Some(place),
            _ => None,
        },
        Init::List(_) => None,
    }
}
