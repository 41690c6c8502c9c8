//! Turns IR into steps over registers.
//!
//! Varying values get a lane register for as long as they are needed; uniform values get words of the uniform
//! file. A component of a triple is a view into its register, not a copy. Steps keep the structure of the IR:
//! blocks nested in `If` and `Loop`.
//!
//! `compile` makes a program out of parts that `step`, beside this module, defines.

mod closures;
mod compile;
mod file;
mod homes;
mod lasting;
mod per_cell;
mod uses;
mod weight;

use crate::closures::ClosureKind;
use crate::error::RunError;
use crate::native::Plans;
use crate::register::LINE;
use crate::services::Services;
use crate::source::PointSource;
use crate::step::{Array, Location, Mark, Operand, OutputPlan, OutputSource, Seed, Step, Steps};
use compile::Compiler;
use osl_ir::global::Global;
use osl_ir::ir::{Assumptions, Axis, Body, Const, Input, Kernel, Kind, Op, Rate};
use osl_numeric::Arithmetic;
use rustc_hash::FxHashMap;
use std::sync::Arc;
pub(crate) use weight::SERIAL;

/// Sums up the weights of steps.
fn weigh(steps: &mut Steps) {
    for step in &mut steps.list {
        if let Step::PerCell { steps, .. } = step {
            weigh(steps);
        }
    }
    steps.weight = steps.list.iter().map(weight::weight).sum();
}

/// A compiled program: immutable, shared by all threads.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) steps: Steps,
    pub(crate) marks: Vec<Mark>,
    /// Number of components of each lane register.
    pub(crate) registers: Vec<u32>,
    /// Number of components of each register with a word for each cell.
    pub(crate) cells: Vec<u32>,
    /// The initial uniform file, with constants filled in.
    pub(crate) words: Vec<Seed>,
    pub(crate) arrays: Vec<Array>,
    /// Varying globals that are read, with their registers.
    pub(crate) globals: Vec<(Global, Operand)>,
    /// Derivatives of globals that are read.
    pub(crate) derivs: Vec<(Global, Axis, Operand)>,
    pub(crate) outputs: Vec<OutputPlan>,
    /// The kinds of closure components that it makes.
    pub(crate) closures: Arc<[ClosureKind]>,
    pub(crate) strings: Vec<Arc<str>>,
    error_messages: bool,
    /// The number of each string.
    pub(crate) numbers: FxHashMap<Arc<str>, u32>,
    /// The layers, each with the start of its source.
    layers: Vec<(u32, osl_ir::ir::Names)>,
    /// Machine code for sequences of its lane operations.
    pub(crate) native: Arc<Plans>,
    /// Number of groups of values per cell.
    pub(crate) groups: usize,
    /// Number of branches and loops.
    pub(crate) regions: u32,
    /// Number of steps whose result is the same in every batch.
    pub(crate) lasting: u32,
    /// Whether everything that it does is uniform, so that one run is enough.
    pub(crate) uniform: bool,
    /// Steps charged to each point before anything runs.
    pub(crate) base: u64,
    /// The live parameters, with their current values, and where the uniform file has them.
    inputs: Vec<Input>,
    input_words: Vec<(u32, u32)>,
    /// What it was compiled for.
    assumptions: Assumptions,
}

/// Default number of points in a batch.
const BATCH: usize = 256;
/// Maximum size of the registers of a wider batch, as measured.
const NEAR_BYTES: u64 = 256 << 10;

/// Whether points leave a loop one after the other.
fn has_uneven_loop(steps: &Steps) -> bool {
    steps.list.iter().any(|step| match step {
        Step::Loop { cond, body, .. } => {
            matches!(cond.location, Location::Lanes { .. }) || has_uneven_loop(body)
        }
        Step::If { then, otherwise, .. } => has_uneven_loop(then) || has_uneven_loop(otherwise),
        _ => false,
    })
}

/// Whether steps only compute values, without effects.
fn is_quiet(steps: &Steps) -> bool {
    steps.list.iter().all(|step| match step {
        Step::Lane(_) | Step::FindCells { .. } | Step::Load(_) | Step::Store(_) => true,
        Step::Kernel(step) => !step.kernel.has_effect() && !step.kernel.is_varying(),
        Step::If { then, otherwise, .. } => is_quiet(then) && is_quiet(otherwise),
        Step::Loop { body, .. } => is_quiet(body),
        Step::PerCell { steps, .. } => is_quiet(steps),
    })
}

impl Program {
    /// Compiles a body on which the `ssa` and `rate` passes have run.
    pub fn new(body: &Body) -> Program {
        let mut compiler = Compiler::new(body);
        let steps = compiler.block(body.entry);
        let closures = closures::kinds(body);
        let outputs = compiler.outputs(&closures);
        let Compiler {
            registers,
            cells,
            words,
            globals,
            derivs,
            inputs,
            strings,
            marks,
            regions,
            lasting,
            ..
        } = compiler;
        let arrays: Vec<Array> = body
            .slots
            .iter()
            .map(|slot| Array {
                words: slot.kind.words(),
                len: slot.len.unwrap_or(0),
                varying: slot.rate == Rate::Varying,
            })
            .collect();
        let uniform = registers.list.is_empty() && !arrays.iter().any(|a| a.varying) && is_quiet(&steps);
        let insts = body.insts();
        let error_messages = insts.map(|inst| &inst.op).any(|op| {
            matches!(
                op,
                Op::Kernel(
                    Kernel::Texture { quiet: true, .. }
                        | Kernel::Environment { quiet: true, .. }
                        | Kernel::Volume { quiet: true, .. },
                    _
                )
            )
        });
        Program {
            error_messages,
            uniform,
            base: weight::of_arrays(&arrays),
            steps,
            marks,
            registers: registers.list,
            cells: cells.list,
            words,
            arrays,
            globals,
            derivs,
            outputs,
            closures: closures.into(),
            strings: strings.list,
            numbers: strings.numbers,
            layers: body.layers.clone(),
            groups: per_cell::groups(body),
            regions,
            lasting: lasting.steps,
            native: Arc::new(Plans::new(regions)),
            inputs: body.inputs.clone(),
            input_words: inputs,
            assumptions: body.assumptions.clone(),
        }
    }

    /// The numbers that it computes with.
    pub fn arithmetic(&self) -> Arithmetic {
        self.assumptions.arithmetic
    }

    /// The live parameters, element by element, with the values of the next run.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Sets a live parameter, or an element of one, by its index in [`Program::inputs`]. Returns whether
    /// there is such a parameter and the value is of its kind.
    pub fn set_input(&mut self, index: usize, value: Const) -> bool {
        let numbers = matches!(value.kind(), Kind::Int | Kind::Float | Kind::Triple | Kind::Matrix);
        let input = self.inputs.get_mut(index).filter(|input| input.value.kind() == value.kind());
        let Some(input) = input.filter(|_| numbers) else { return false };
        let words = Seed::of(&value, |_| 0);
        for (_, at) in self.input_words.iter().filter(|(of, _)| *of as usize == index) {
            let at = *at as usize;
            if let Some(target) = self.words.get_mut(at..at + words.len()) {
                target.copy_from_slice(&words);
            }
        }
        input.value = value;
        true
    }

    /// Checks that a source and the spaces keep to what the program was compiled for.
    ///
    /// # Errors
    /// Something differs from point to point that the program takes for the same at all of them, the source
    /// traces rays and the program was compiled without them, or a space is not affine.
    pub(crate) fn accepts(&self, source: &dyn PointSource, services: &Services) -> Result<(), RunError> {
        let Assumptions { varying, derivs, traces, affine, .. } = &self.assumptions;
        let beyond =
            |here: &[Global], known: &[Global]| here.iter().find(|global| !known.contains(global)).copied();
        if let Some(global) = beyond(source.varying(), varying) {
            return Err(RunError::VariesMore(global));
        }
        if let Some(global) = beyond(source.varying_derivs(), derivs) {
            return Err(RunError::DerivsVaryMore(global));
        }
        if source.traces() && !traces {
            return Err(RunError::Traces);
        }
        if let Some(name) = affine.iter().find(|name| !services.spaces.is_affine(name)) {
            return Err(RunError::NotAffine(name.clone()));
        }
        Ok(())
    }

    /// The layer of a source location, and its names.
    pub fn names(&self, span: osl_ir::Span) -> Option<(usize, &osl_ir::ir::Names)> {
        osl_ir::ir::names_at(&self.layers, span)
    }

    /// Whether lookups report to the shader why they fail: the messages under
    /// [`Services::reference_texts`](crate::Services) then depend on which lookup comes first.
    pub fn has_error_messages(&self) -> bool {
        self.error_messages
    }

    /// The bits of a word of the uniform file, in single precision, if they are the same in every run.
    pub(crate) fn constant(&self, at: u32) -> Option<u32> {
        let is_input = self.input_words.iter().any(|(input, first)| {
            let words = self.inputs.get(*input as usize).map_or(0, |input| input.value.kind().words());
            (*first..*first + words).contains(&at)
        });
        match self.words.get(at as usize)? {
            Seed::Bits(bits) if !is_input => Some(*bits),
            Seed::Float(x) if !is_input => Some(x.to_bits()),
            _ => None,
        }
    }

    /// Whether a word of the uniform file is a constant of the shader.
    pub(crate) fn is_constant(&self, at: u32) -> bool {
        self.words.get(at as usize).is_some_and(|seed| *seed != Seed::Computed)
    }

    /// The name of the shader at a place of the source.
    pub(crate) fn shader(&self, span: osl_ir::Span) -> Arc<str> {
        self.names(span).map_or_else(|| "".into(), |(_, names)| names.shader.clone())
    }

    /// Number of lane registers and the words per lane that they hold, for reports.
    pub fn register_words(&self) -> (usize, u32) {
        (self.registers.len(), self.registers.iter().sum())
    }

    /// The best number of points in a batch: larger batches cost less per point, as long as the registers
    /// stay in the cache. Loops end sooner with fewer points.
    pub fn batch(&self) -> usize {
        let words: u64 = self.registers.iter().map(|words| u64::from(*words)).sum();
        let fits = |batch: &usize| words * 4 * *batch as u64 <= NEAR_BYTES;
        if has_uneven_loop(&self.steps) {
            BATCH
        } else {
            [8, 4, 2].map(|n| n * BATCH).into_iter().find(fits).unwrap_or(BATCH)
        }
    }

    /// Bytes of the registers and arrays of a point, for words of a size.
    fn point_bytes(&self, word: usize) -> u64 {
        let arrays = self.arrays.iter().filter(|a| a.varying).map(|a| u64::from(a.words) * u64::from(a.len));
        let words = arrays.chain(self.registers.iter().map(|words| u64::from(*words)));
        words.fold(0, u64::saturating_add).saturating_mul(word as u64).max(1)
    }

    /// Bytes of the uniform arrays, for words of a size.
    fn uniform_bytes(&self, word: usize) -> u64 {
        let arrays = self.arrays.iter().filter(|a| !a.varying).map(|a| u64::from(a.words) * u64::from(a.len));
        arrays.fold(0, u64::saturating_add).saturating_mul(word as u64)
    }

    /// The number of threads and of points in a batch, at most those given, for which the registers and
    /// arrays of all threads fit in the memory. First the batches are made narrower, then threads are
    /// reduced, down to one point per batch.
    ///
    /// # Errors
    /// The bytes of a single point, if they exceed the memory.
    pub(crate) fn fit(
        &self,
        (threads, batch): (usize, usize),
        bytes: u64,
        word: usize,
    ) -> Result<(usize, usize), u64> {
        let (point, uniform) = (self.point_bytes(word), self.uniform_bytes(word));
        let least = point.saturating_add(uniform);
        if least > bytes {
            return Err(least);
        }
        let line = point.saturating_mul(LINE as u64).saturating_add(uniform);
        let most = usize::try_from(bytes / line).unwrap_or(usize::MAX);
        if most == 0 {
            return Ok((1, 1));
        }
        let threads = threads.clamp(1, most);
        let room = (bytes / threads as u64).saturating_sub(uniform);
        let lanes = usize::try_from(room / point).unwrap_or(usize::MAX);
        Ok((threads, batch.min(lanes / LINE * LINE).max(LINE.min(batch))))
    }
}

impl OutputPlan {
    /// Number of elements of the output: 1 if it is not an array.
    pub(crate) fn ty_len(&self, program: &Program) -> usize {
        match self.source {
            OutputSource::Value(_) => 1,
            OutputSource::Array(array) => program.arrays.get(array as usize).map_or(1, |a| a.len as usize),
        }
    }
}
