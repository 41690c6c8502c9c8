//! From IR to steps over registers.
//!
//! Values that vary get a lane register for as long as they are needed; values that the batch shares get words
//! of the uniform file. A component of a triple is a view into its register, not a copy. Steps keep the
//! structure of the IR: blocks nested in `If` and `Loop`.

mod shared;
mod uses;
mod weight;

use crate::arithmetic::{Arithmetic, Word};
use crate::register::LINE;
use osl_ir::Span;
use osl_ir::hir::Global;
use osl_ir::ir::{Axis, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, Rate, SlotId, Source, ValueId};
use osl_ir::types::Type;
use rustc_hash::FxHashMap;
use std::sync::Arc;
use uses::Uses;

/// Bytes that the registers and arrays of all threads may take, where a batch of one cache line allows it.
const MAX_BYTES: u64 = 96 << 20;
/// Bytes that those of a thread may always take.
const MIN_BYTES: u64 = 8 << 20;

/// Where a value is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Place {
    /// A lane register, from this component on; and the group whose cells share the value.
    Lanes { reg: u32, component: u32, group: Option<u16> },
    /// Words of the uniform file, from this one on.
    Words(u32),
}

/// A value: where it is, how many words (of each lane) it has, and what they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Operand {
    pub(crate) place: Place,
    pub(crate) words: u32,
    pub(crate) kind: Kind,
}

/// Storage of an array.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array {
    pub(crate) words: u32,
    pub(crate) kind: Kind,
    pub(crate) len: u32,
    pub(crate) varying: bool,
}

/// Steps in order, with the mark of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steps {
    pub(crate) list: Vec<Step>,
    /// Index into the marks of the program.
    pub(crate) marks: Vec<u32>,
    /// What they count against the budget of a batch, those nested in them left out.
    pub(crate) weight: u64,
}

/// Sums up what steps count.
fn weigh(steps: &mut Steps) {
    for step in &mut steps.list {
        if let Step::Shared { steps, .. } = step {
            weigh(steps);
        }
    }
    steps.weight = steps.list.iter().map(weight::weight).sum();
}

/// What a step comes of, for profiles.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub(crate) name: String,
    pub(crate) span: Span,
    /// The mark of the step around it.
    pub(crate) around: Option<u32>,
}

/// One step of the interpreter.
#[derive(Clone, Debug)]
pub(crate) enum Step {
    Lane(LaneStep),
    Kernel(Box<KernelStep>),
    Load {
        array: u32,
        index: Operand,
        out: Operand,
    },
    Store {
        array: u32,
        index: Operand,
        value: Operand,
    },
    If {
        cond: Operand,
        then: Steps,
        otherwise: Steps,
        results: Vec<[Operand; 3]>,
    },
    Loop {
        params: Vec<LoopParam>,
        body: Steps,
        cond: Operand,
        span: Span,
    },
    /// Finds the cells of a group: points where all of `roots` are equal. Points read the outs that `exports` numbers.
    FindCells {
        group: u16,
        roots: Vec<Operand>,
        outs: Vec<Operand>,
        exports: Vec<usize>,
    },
    /// Runs steps once for each cell of a group, if it has few. Points read what `exports` names.
    Shared {
        group: u16,
        steps: Steps,
        exports: Vec<Operand>,
    },
}

/// A step that runs a lane operation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaneStep {
    pub(crate) op: LaneOp,
    /// Its arguments: the first `count` of these.
    args: [Operand; MAX_ARGS],
    count: u8,
    /// How many times it runs: once, or for each component of a triple.
    pub(crate) parts: u8,
    pub(crate) out: Operand,
}

/// Arguments of a lane operation at most.
pub(crate) const MAX_ARGS: usize = 4;

impl LaneStep {
    fn new(op: LaneOp, list: &[Operand], out: Operand) -> LaneStep {
        let mut args = [out; MAX_ARGS];
        args.iter_mut().zip(list).for_each(|(to, from)| *to = *from);
        let parts = out.words / words_of(op.shape().result).max(1);
        LaneStep { op, args, count: list.len().min(MAX_ARGS) as u8, parts: parts as u8, out }
    }

    /// Its arguments.
    pub(crate) fn args(&self) -> &[Operand] {
        &self.args[..usize::from(self.count)]
    }
}

/// A step that runs a kernel.
#[derive(Clone, Debug)]
pub(crate) struct KernelStep {
    pub(crate) kernel: Kernel,
    pub(crate) args: Vec<Operand>,
    /// Kinds of the arguments.
    pub(crate) kinds: Vec<Kind>,
    pub(crate) outs: Vec<Operand>,
    pub(crate) span: Span,
}

/// A value that a loop carries.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopParam {
    pub(crate) init: Operand,
    pub(crate) param: Operand,
    pub(crate) next: Operand,
    pub(crate) result: Operand,
}

/// An output that a run delivers.
#[derive(Clone, Debug)]
pub(crate) struct OutputPlan {
    pub(crate) name: Arc<str>,
    pub(crate) ty: Type,
    pub(crate) kind: Kind,
    pub(crate) source: OutputSource,
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum OutputSource {
    Value(Operand),
    Array(u32),
}

/// A word of the uniform file before a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Seed {
    /// An int, or the number of a string.
    Bits(u32),
    /// A float.
    Float(f32),
}

impl Seed {
    /// The word in an arithmetic.
    pub(crate) fn word<A: Arithmetic>(self) -> A::Word {
        match self {
            Seed::Bits(bits) => A::Word::of(bits),
            Seed::Float(x) => A::of(x),
        }
    }
}

/// A compiled program: immutable, shared by all threads.
#[derive(Clone, Debug)]
pub struct Program {
    pub(crate) steps: Steps,
    pub(crate) marks: Vec<Mark>,
    /// Components of each lane register.
    pub(crate) registers: Vec<u32>,
    /// The uniform file as it starts, constants filled in.
    pub(crate) words: Vec<Seed>,
    pub(crate) arrays: Vec<Array>,
    /// Varying globals that are read, with their registers.
    pub(crate) globals: Vec<(Global, Operand)>,
    /// Slopes of globals that are read.
    pub(crate) slopes: Vec<(Global, Axis, Operand)>,
    pub(crate) outputs: Vec<OutputPlan>,
    pub(crate) strings: Vec<Arc<str>>,
    /// The number of each string.
    pub(crate) numbers: FxHashMap<Arc<str>, u32>,
    /// The layers, each with the start of its source.
    layers: Vec<(u32, osl_ir::builtins::Names)>,
    /// Groups of values that points share.
    pub(crate) groups: usize,
    /// Whether all points share all that it does: one run is enough.
    pub(crate) shared: bool,
}

/// Points of a batch where nothing speaks for more.
const BATCH: usize = 256;
/// What the registers of a wider batch may take: measured, see docs/performance.md.
const NEAR_BYTES: u64 = 256 << 10;

fn has_loop(steps: &Steps) -> bool {
    steps.list.iter().any(|step| match step {
        Step::Loop { .. } => true,
        Step::If { then, otherwise, .. } => has_loop(then) || has_loop(otherwise),
        _ => false,
    })
}

/// Whether steps do no more than yield values.
fn is_quiet(steps: &Steps) -> bool {
    steps.list.iter().all(|step| match step {
        Step::Lane(_) | Step::FindCells { .. } | Step::Load { .. } | Step::Store { .. } => true,
        Step::Kernel(step) => !step.kernel.has_effect() && !step.kernel.is_varying(),
        Step::If { then, otherwise, .. } => is_quiet(then) && is_quiet(otherwise),
        Step::Loop { body, .. } => is_quiet(body),
        Step::Shared { steps, .. } => is_quiet(steps),
    })
}

impl Program {
    /// Compiles a body on which the `ssa` and `rate` passes have run.
    pub fn new(body: &Body) -> Program {
        let mut compiler = Compiler::new(body);
        let steps = compiler.block(body.entry);
        let outputs = compiler.outputs();
        let Compiler { registers, words, globals, slopes, strings, marks, .. } = compiler;
        let arrays: Vec<Array> = body
            .slots
            .iter()
            .map(|slot| Array {
                words: words_of(slot.kind),
                kind: slot.kind,
                len: slot.len.unwrap_or(0),
                varying: slot.rate == Rate::Varying,
            })
            .collect();
        let shared = registers.is_empty() && !arrays.iter().any(|a| a.varying) && is_quiet(&steps);
        Program {
            shared,
            steps,
            marks,
            registers,
            words,
            arrays,
            globals,
            slopes,
            outputs,
            strings: strings.list,
            numbers: strings.numbers,
            layers: body.layers.clone(),
            groups: shared::groups(body),
        }
    }

    /// The layer that a place of the source belongs to, and its names.
    pub fn names(&self, span: osl_ir::Span) -> Option<(usize, &osl_ir::builtins::Names)> {
        osl_ir::ir::names_at(&self.layers, span)
    }

    /// The name of the shader at a place of the source.
    pub(crate) fn shader(&self, span: osl_ir::Span) -> Arc<str> {
        self.names(span).map_or_else(|| "".into(), |(_, names)| names.shader.clone())
    }

    /// How many instructions a run can tell of: their numbers are below.
    pub fn instructions(&self) -> usize {
        self.marks.len()
    }

    /// What an instruction does, as `oslrun ir` names it, and the source that it comes from.
    pub fn instruction(&self, at: u32) -> Option<(&str, Span)> {
        self.marks.get(at as usize).map(|mark| (&*mark.name, mark.span))
    }

    /// Lane registers and the words of each lane that they hold, for reports.
    pub fn register_words(&self) -> (usize, u32) {
        (self.registers.len(), self.registers.iter().sum())
    }

    /// Points of a batch that suit the program: more of them cost less each, as long as what the registers hold stays near
    /// the processor. Loops end sooner for fewer points.
    pub fn batch(&self) -> usize {
        let words: u64 = self.registers.iter().map(|words| u64::from(*words)).sum();
        let fits = |batch: &usize| words * 4 * *batch as u64 <= NEAR_BYTES;
        if has_loop(&self.steps) {
            BATCH
        } else {
            [8, 4, 2].map(|n| n * BATCH).into_iter().find(fits).unwrap_or(BATCH)
        }
    }

    /// The widest batch for which the registers and arrays of so many threads fit the budget.
    pub(crate) fn widest(&self, threads: usize) -> usize {
        let arrays = self.arrays.iter().filter(|a| a.varying).map(|a| u64::from(a.words) * u64::from(a.len));
        let words = arrays.chain(self.registers.iter().map(|words| u64::from(*words))).sum::<u64>().max(1);
        let room = (MAX_BYTES / threads.max(1) as u64).max(MIN_BYTES) / 4;
        usize::try_from(room / words).unwrap_or(usize::MAX).max(LINE)
    }
}

/// Words (of each lane) of a kind.
pub(crate) fn words_of(kind: Kind) -> u32 {
    kind.words()
}

#[derive(Default)]
struct Strings {
    list: Vec<Arc<str>>,
    numbers: FxHashMap<Arc<str>, u32>,
}

impl Strings {
    fn number(&mut self, text: &Arc<str>) -> u32 {
        if let Some(number) = self.numbers.get(text) {
            return *number;
        }
        let number = self.list.len() as u32;
        self.list.push(text.clone());
        self.numbers.insert(text.clone(), number);
        number
    }
}

struct Compiler<'a> {
    body: &'a Body,
    places: Vec<Option<Place>>,
    /// For a view, the value whose register it looks into, and the component.
    views: Vec<Option<(ValueId, u32)>>,
    /// Which shared values single points read.
    exported: Vec<bool>,
    /// Position of the last use of each value.
    last_use: Vec<u32>,
    position: u32,
    /// Loops around the current position.
    loops: u32,
    registers: Vec<u32>,
    /// Free registers by component count.
    free: FxHashMap<u32, Vec<u32>>,
    /// Registers to free behind a position.
    ending: FxHashMap<u32, Vec<(u32, u32)>>,
    words: Vec<Seed>,
    globals: Vec<(Global, Operand)>,
    slopes: Vec<(Global, Axis, Operand)>,
    strings: Strings,
    marks: Vec<Mark>,
    /// The mark of the step that is being compiled.
    around: Option<u32>,
}

impl<'a> Compiler<'a> {
    fn new(body: &'a Body) -> Self {
        let values = body.values.len();
        let Uses { views, last_use, .. } = Uses::of(body);
        let exported = shared::exported(body, &views);
        let mut strings = Strings::default();
        strings.number(&"".into());
        Compiler {
            body,
            places: vec![None; values],
            views,
            exported,
            last_use,
            position: 0,
            loops: 0,
            registers: Vec::new(),
            free: FxHashMap::default(),
            ending: FxHashMap::default(),
            words: Vec::new(),
            globals: Vec::new(),
            slopes: Vec::new(),
            strings,
            marks: Vec::new(),
            around: None,
        }
    }

    fn operand(&mut self, v: ValueId) -> Operand {
        let kind = self.body.kind(v);
        let place = match self.places.get(v.index()).copied().flatten() {
            Some(place) => place,
            None => self.define(v),
        };
        Operand { place, words: words_of(kind), kind }
    }

    /// Gives a value its place. Values of a valid body are defined before they are used.
    fn define(&mut self, v: ValueId) -> Place {
        let words = words_of(self.body.kind(v));
        let place = if self.body.value(v).rate == Rate::Uniform {
            self.words.resize(self.words.len() + words as usize, Seed::Bits(0));
            Place::Words((self.words.len() - words as usize) as u32)
        } else {
            let reg = self.take_register(words);
            let last = self.last_use[v.index()].max(self.position);
            self.ending.entry(last).or_default().push((words, reg));
            Place::Lanes { reg, component: 0, group: shared::group(self.body, v) }
        };
        self.places[v.index()] = Some(place);
        place
    }

    fn take_register(&mut self, words: u32) -> u32 {
        if let Some(reg) = self.free.get_mut(&words).and_then(Vec::pop) {
            return reg;
        }
        self.registers.push(words);
        self.registers.len() as u32 - 1
    }

    /// Goes on to the next position, freeing what ended at this one.
    fn advance(&mut self) {
        if let Some(done) = self.ending.remove(&self.position) {
            for (words, reg) in done {
                self.free.entry(words).or_default().push(reg);
            }
        }
        self.position += 1;
    }

    fn block(&mut self, id: BlockId) -> Steps {
        let body = self.body;
        let mut steps = Steps::default();
        for inst in &body.block(id).insts {
            match shared::group_of(body, inst) {
                Some(group) => self.member(inst, group, &mut steps),
                None => self.marked(inst, &mut steps),
            }
        }
        weigh(&mut steps);
        steps
    }

    /// An instruction as steps, each with its mark.
    fn marked(&mut self, inst: &'a Inst, steps: &mut Steps) {
        let mark = self.mark(inst, inst.op.name());
        let around = self.around.replace(mark);
        self.inst(inst, &mut steps.list);
        self.around = around;
        steps.marks.resize(steps.list.len(), mark);
    }

    fn mark(&mut self, inst: &Inst, name: String) -> u32 {
        self.marks.push(Mark { name, span: inst.span, around: self.around });
        self.marks.len() as u32 - 1
    }

    /// An instruction of a group: together with those of the group before it.
    fn member(&mut self, inst: &'a Inst, group: u16, steps: &mut Steps) {
        if !matches!(steps.list.last(), Some(Step::Shared { group: last, .. }) if *last == group) {
            let mark = self.mark(inst, format!("shared{group}"));
            steps.list.push(Step::Shared { group, steps: Steps::default(), exports: Vec::new() });
            steps.marks.push(mark);
        }
        let around = std::mem::replace(&mut self.around, steps.marks.last().copied());
        let mut inner = Steps::default();
        self.marked(inst, &mut inner);
        self.around = around;
        let exported: Vec<ValueId> = inst
            .results
            .iter()
            .copied()
            .filter(|r| self.exported[r.index()] && self.views[r.index()].is_none())
            .collect();
        let found: Vec<Operand> = exported.into_iter().map(|r| self.operand(r)).collect();
        if let Some(Step::Shared { steps, exports, .. }) = steps.list.last_mut() {
            steps.list.extend(inner.list);
            steps.marks.extend(inner.marks);
            exports.extend(found);
        }
    }

    /// The place of a value that is there before the first step: its register held nothing before, and in a loop it
    /// holds nothing else.
    fn given(&mut self, inst: &Inst) -> Option<Operand> {
        let result = *inst.results.first()?;
        let words = words_of(self.body.kind(result));
        if self.body.value(result).rate == Rate::Varying {
            self.registers.push(words);
            let reg = self.registers.len() as u32 - 1;
            if self.loops == 0 {
                let last = self.last_use[result.index()].max(self.position);
                self.ending.entry(last).or_default().push((words, reg));
            }
            self.places[result.index()] = Some(Place::Lanes { reg, component: 0, group: None });
        }
        Some(self.operand(result))
    }

    fn result(&mut self, inst: &Inst) -> Option<Operand> {
        inst.results.first().map(|r| {
            self.define(*r);
            self.operand(*r)
        })
    }

    fn inst(&mut self, inst: &Inst, steps: &mut Vec<Step>) {
        match &inst.op {
            Op::Const(value) => {
                if let Some(out) = self.result(inst) {
                    self.constant(value, out, steps);
                }
                self.advance();
            }
            Op::Global(global) => {
                if let Some(out) = self.given(inst) {
                    self.globals.push((*global, out));
                }
                self.advance();
            }
            Op::Slope(global, axis) => {
                if let Some(out) = self.given(inst) {
                    self.slopes.push((*global, *axis, out));
                }
                self.advance();
            }
            Op::Lane(op, args) => {
                if !self.view(inst) {
                    let args: Vec<Operand> = args.iter().map(|a| self.operand(*a)).collect();
                    if let Some(out) = self.result(inst) {
                        steps.push(Step::Lane(LaneStep::new(*op, &args, out)));
                    }
                }
                self.advance();
            }
            Op::Kernel(kernel, args) => {
                let kinds = args.iter().map(|a| self.body.kind(*a)).collect();
                let args = args.iter().map(|a| self.operand(*a)).collect();
                let outs = inst
                    .results
                    .iter()
                    .map(|r| {
                        self.define(*r);
                        self.operand(*r)
                    })
                    .collect();
                let step = KernelStep { kernel: kernel.clone(), args, kinds, outs, span: inst.span };
                steps.push(Step::Kernel(Box::new(step)));
                self.advance();
            }
            Op::Share(group, roots) => {
                let roots = roots.iter().map(|v| self.operand(*v)).collect();
                inst.results.iter().for_each(|r| {
                    self.define(*r);
                });
                let outs = inst.results.iter().map(|r| self.operand(*r)).collect();
                let exports = inst.results.iter().enumerate().filter(|(_, r)| self.exported[r.index()]);
                let exports = exports.map(|(at, _)| at).collect();
                steps.push(Step::FindCells { group: *group, roots, outs, exports });
                self.advance();
            }
            Op::LoadElement(slot, index) => {
                let index = self.operand(*index);
                if let Some(out) = self.result(inst) {
                    steps.push(Step::Load { array: slot.0, index, out });
                }
                self.advance();
            }
            Op::StoreElement(slot, index, value) => {
                let (index, value) = (self.operand(*index), self.operand(*value));
                steps.push(Step::Store { array: slot.0, index, value });
                self.advance();
            }
            // The `ssa` and `derive` passes have removed these.
            Op::Load(SlotId(_)) | Op::Store(..) | Op::Derivative(..) => self.advance(),
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                let cond = self.operand(*cond);
                let results: Vec<Operand> = inst
                    .results
                    .iter()
                    .map(|r| {
                        self.define(*r);
                        self.operand(*r)
                    })
                    .collect();
                self.advance();
                let then = self.block(*then);
                let a: Vec<Operand> = then_yields.iter().map(|v| self.operand(*v)).collect();
                self.advance();
                let otherwise = self.block(*otherwise);
                let b: Vec<Operand> = else_yields.iter().map(|v| self.operand(*v)).collect();
                self.advance();
                let results = results.into_iter().zip(a).zip(b).map(|((r, a), b)| [r, a, b]).collect();
                steps.push(Step::If { cond, then, otherwise, results });
            }
            Op::Loop { init, params, body, cond, next } => {
                let first: Vec<Operand> = init.iter().map(|v| self.operand(*v)).collect();
                let mut carried = Vec::new();
                for ((param, result), init) in params.iter().zip(&inst.results).zip(first) {
                    self.define(*param);
                    self.define(*result);
                    let (param, result) = (self.operand(*param), self.operand(*result));
                    carried.push(LoopParam { init, param, next: init, result });
                }
                self.advance();
                self.loops += 1;
                let inner = self.block(*body);
                self.loops -= 1;
                for (carried, next) in carried.iter_mut().zip(next) {
                    carried.next = self.operand(*next);
                }
                let cond = self.operand(*cond);
                self.advance();
                steps.push(Step::Loop { params: carried, body: inner, cond, span: inst.span });
            }
        }
    }

    /// Makes the result a view of the argument where it is one. Tells whether it is.
    fn view(&mut self, inst: &Inst) -> bool {
        let Some(result) = inst.results.first().copied() else { return false };
        let Some((root, component)) = self.views.get(result.index()).copied().flatten() else { return false };
        let place = match self.operand(root).place {
            Place::Lanes { reg, component: base, group } => {
                Place::Lanes { reg, component: base + component, group }
            }
            Place::Words(at) => Place::Words(at + component),
        };
        self.places[result.index()] = Some(place);
        true
    }

    fn constant(&mut self, value: &Const, out: Operand, steps: &mut Vec<Step>) {
        let words: Vec<Seed> = match value {
            Const::Int(n) => vec![Seed::Bits(*n as u32)],
            Const::Float(x) => vec![Seed::Float(*x)],
            Const::Triple(t) => t.iter().map(|x| Seed::Float(*x)).collect(),
            Const::Matrix(m) => m.iter().map(|x| Seed::Float(*x)).collect(),
            Const::Str(s) => vec![Seed::Bits(self.strings.number(s))],
            Const::Null => vec![Seed::Bits(0)],
        };
        match out.place {
            Place::Words(at) => {
                let at = at as usize;
                if let Some(target) = self.words.get_mut(at..at + words.len()) {
                    target.copy_from_slice(&words);
                }
            }
            Place::Lanes { .. } => {
                // Only where the rate pass is off: spread a hidden uniform constant.
                let at = self.words.len() as u32;
                for (component, word) in words.iter().enumerate() {
                    self.words.push(*word);
                    let kind = if matches!(word, Seed::Float(_)) { Kind::Float } else { Kind::Int };
                    let from = Operand { place: Place::Words(at + component as u32), words: 1, kind };
                    let Place::Lanes { reg, component: base, group } = out.place else { continue };
                    let place = Place::Lanes { reg, component: base + component as u32, group };
                    let to = Operand { place, words: 1, kind };
                    let step = match word {
                        Seed::Bits(_) => LaneStep::new(LaneOp::IOr, &[from, from], to),
                        Seed::Float(_) => LaneStep::new(LaneOp::Still, &[from], to),
                    };
                    steps.push(Step::Lane(step));
                }
            }
        }
    }

    fn outputs(&mut self) -> Vec<OutputPlan> {
        let body = self.body;
        let mut plans = Vec::new();
        for output in &body.outputs {
            let (kind, source) = match output.source {
                Source::Value(v) => (body.kind(v), OutputSource::Value(self.operand(v))),
                Source::Slot(s) => (body.slot(s).kind, OutputSource::Array(s.0)),
            };
            plans.push(OutputPlan { name: output.name.clone(), ty: output.ty, kind, source });
        }
        plans
    }
}

impl OutputPlan {
    /// Elements of the output: 1 where it is no array.
    pub(crate) fn ty_len(&self, program: &Program) -> usize {
        match self.source {
            OutputSource::Value(_) => 1,
            OutputSource::Array(array) => program.arrays.get(array as usize).map_or(1, |a| a.len as usize),
        }
    }
}
