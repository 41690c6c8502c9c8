//! A second implementation of the language: it walks the resolved tree at one point.
//!
//! It defines the meaning of statements, expressions, places and calls from the rules of the language only:
//! no inlining, no splitting of structs, no passes, no lanes. Variables are trees of values, and a formal
//! that stands for a variable refers to its tree. It is small and slow. It must not call the lowering, the
//! passes or the interpreter; elementary functions (sines, noise, the text of a number) come from the
//! libraries that recorded vectors check. If the language leaves a value undefined (see [`Stop::Open`]), the
//! walker says so instead of choosing one. It does not know closures, textures, spaces, messages and
//! derivatives.

mod arguments;
mod builtins;
mod expr;
mod math;
mod ops;
mod place;
mod stmt;
mod value;

pub use builtins::KNOWN;
pub use value::Value;

use osl_hir::hir::{Global, Program, VarId, VarKind};
use place::Spot;
use std::collections::BTreeSet;

/// Why a walk ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The shader called `exit`.
    Exit,
    /// The language leaves the behaviour undefined, or the walker does not know it.
    Open(&'static str),
}

/// The input of a point: its globals.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// The coordinates on the patch.
    pub u: f32,
    /// The coordinates on the patch.
    pub v: f32,
}

impl Point {
    /// The value of a global on the grid of unit patches.
    fn global(&self, global: Global) -> Value {
        match global {
            Global::U => Value::Float(self.u),
            Global::V => Value::Float(self.v),
            Global::P => Value::Triple([self.u, self.v, 1.0]),
            Global::N | Global::Ng => Value::Triple([0.0, 0.0, 1.0]),
            Global::I => Value::Triple([0.0, 0.0, -1.0]),
            Global::DPdu => Value::Triple([1.0, 0.0, 0.0]),
            Global::DPdv => Value::Triple([0.0, 1.0, 0.0]),
            Global::Time | Global::Dtime => Value::Float(0.0),
            _ => Value::Triple([0.0; 3]),
        }
    }
}

/// The results of a point.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Each part of each output that is not an array, by the name of its plane: `a`, `s.m0`, `a[2]`.
    pub outputs: Vec<(String, Value)>,
    /// The printed text.
    pub printed: String,
    /// Errors and warnings, each once.
    pub messages: BTreeSet<String>,
}

/// Maximum number of statements and expressions of a walk.
const MAX_STEPS: u32 = 300_000;

struct Walker<'a> {
    program: &'a Program,
    /// The variables, current and former.
    cells: Vec<Value>,
    /// The current place of each variable of the program.
    places: Vec<Option<Spot>>,
    outcome: Outcome,
    steps: u32,
}

/// The results of a program at a point.
///
/// # Errors
/// The language leaves a value undefined, or the program uses something that the walker does not know.
pub fn walk(program: &Program, point: Point) -> Result<Outcome, &'static str> {
    let mut walker = Walker {
        program,
        cells: Vec::new(),
        places: vec![None; program.vars.len()],
        outcome: Outcome::default(),
        steps: 0,
    };
    for (index, var) in program.vars.iter().enumerate() {
        if let VarKind::Global(global) = var.kind {
            walker.bring_to_life(VarId(index as u32), point.global(global));
        }
    }
    // A parameter's default may read the parameters before it.
    let ended = walker.shader();
    match ended {
        Ok(()) | Err(Stop::Exit) => Ok(walker.finish()),
        Err(Stop::Open(why)) => Err(why),
    }
}

impl Walker<'_> {
    fn shader(&mut self) -> Result<(), Stop> {
        let program = self.program;
        for param in &program.shader.params {
            let ty = program.vars[param.var.0 as usize].ty;
            let zero = self.zero(ty);
            self.bring_to_life(param.var, zero);
        }
        for param in &program.shader.params {
            let ty = program.vars[param.var.0 as usize].ty;
            let value = self.made_from(ty, &param.init)?;
            let spot = self.variable(param.var);
            self.write(&spot, value);
        }
        self.statements(&program.shader.body)?;
        Ok(())
    }

    fn finish(mut self) -> Outcome {
        let program = self.program;
        for param in program.shader.params.iter().filter(|param| param.output) {
            let var = &program.vars[param.var.0 as usize];
            let spot = self.variable(param.var);
            let value = self.read(&spot);
            let mut parts = Vec::new();
            self.parts(var.ty, var.name.to_string(), &value, &mut parts);
            self.outcome.outputs.append(&mut parts);
        }
        self.outcome
    }

    /// Counts a step.
    fn tick(&mut self) -> Result<(), Stop> {
        self.steps += 1;
        if self.steps > MAX_STEPS { Err(Stop::Open("too many steps")) } else { Ok(()) }
    }

    /// A new place for a variable; references to the old place keep it.
    fn bring_to_life(&mut self, var: VarId, value: Value) {
        self.cells.push(value);
        self.places[var.0 as usize] = Some(Spot::cell(self.cells.len() - 1));
    }
}
