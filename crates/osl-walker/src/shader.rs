//! A shader: globals, parameters, body, outputs.
//!
//! A *global* such as `u` or `N` is a property of the shading point. It is a variable that has its value
//! before the shader begins; who calls the walker supplies it. A *parameter* has a default, which is an
//! expression: defaults are evaluated in order, and may read globals and the parameters before them. (A value
//! from outside or a connected layer would replace the default; the walker has neither.) Parameters declared
//! `output` are the results. `exit()` ends the shader, and what the outputs hold then is the result.
//!
//! ```
//! use osl_hir::{hir::Global, resolve::resolve_parsed};
//! use osl_walker::{Value, walk};
//!
//! let text = "surface s(float a = 2 * u, output float r = a + 1) { if (u > 0.5) exit(); r = 0; }";
//! let options = osl_syntax::Options::default();
//! let parsed = osl_syntax::parse("s.osl", text, &osl_syntax::NoFiles, &options);
//! let program = resolve_parsed(&parsed, options.reports, &options.limits).program.map_err(|_| "errors")?;
//! let point = |global| match global {
//!     Global::U => Value::Float(0.75),
//!     Global::V | Global::Time => Value::Float(0.0),
//!     _ => Value::Triple([0.0; 3]),
//! };
//! assert_eq!(walk(&program, &point)?.outputs[0].1, Value::Float(2.5));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::state::{Error, Stop, Walker};
use crate::value::Value;
use osl_hir::hir::{Global, Param, Program, VarId, VarKind};
use osl_ir::types::Type;
use std::collections::BTreeSet;

/// The results of a shader at a point.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// The value of each output parameter, in the order of declaration.
    pub outputs: Vec<(VarId, Value)>,
    /// The text of `printf`.
    pub printed: String,
    /// What the shader reported by `error` and `warning`, and the indices that were out of range, each once.
    pub messages: BTreeSet<String>,
}

/// The results of a shader at a point with these globals, all parameters having their defaults. A global's
/// value must have its type: floats for `u`, `v`, `time` and `dtime`, triples for the others.
///
/// # Errors
/// The language leaves a value undefined, or the walker does not know what the shader uses.
pub fn walk(program: &Program, globals: &dyn Fn(Global) -> Value) -> Result<Outcome, Error> {
    let mut walker = Walker::new(program);
    for (index, var) in program.vars.iter().enumerate() {
        if let VarKind::Global(global) = var.kind {
            let location = walker.allocate(globals(global));
            walker.bind(VarId(index as u32), location);
        }
    }
    match walker.shader() {
        Ok(()) | Err(Stop::Exit) => {}
        Err(Stop::Error(reason)) => return Err(Error { reason, span: walker.span }),
    }
    let mut outputs = Vec::new();
    for Param { var, .. } in program.shader.params.iter().filter(|param| param.output) {
        let location = walker.location_of(*var);
        outputs.push((*var, walker.read(&location)));
    }
    Ok(Outcome { outputs, printed: walker.printed, messages: walker.messages })
}

impl Walker<'_> {
    /// Evaluates the defaults, then executes the body. An output is zero until its default is evaluated,
    /// which `exit` in an earlier default may prevent.
    fn shader(&mut self) -> Result<(), Stop> {
        let program = self.program;
        for Param { var, init, .. } in &program.shader.params {
            let value = self.initial(self.type_of(*var), init)?;
            let location = self.allocate(value);
            self.bind(*var, location);
        }
        self.statements(&program.shader.body, Type::VOID)?;
        Ok(())
    }
}
