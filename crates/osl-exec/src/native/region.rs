//! Branches and loops as code: a block with everything in them, for all lanes of a batch.
//!
//! A recorder walks the steps and writes lane operations as `plan` does. A loop becomes a loop of the block,
//! whose lanes leave one after the other. Small sides of a branch are computed for all lanes; a large one is
//! skipped if no lane of a vector takes it. Uniform values are computed in every lane, like others, and their
//! results are taken from a lane that ran. Steps that are not written here have no code, and neither has the
//! region around them: the interpreter runs it. It also does so if the code stops, because of the budget or
//! because an index is out of range: the code has then changed nothing that it reads, except arrays.

use super::plan::{ArraySource, Constants, Files, Writer, lend};
use super::{Shape, record};
use crate::lanes::LaneInput;
use crate::step::{
    Array, KernelStep, LaneStep, LoadStep, Location, LoopParam, Operand, Step, Steps, StoreStep,
};
use osl_ir::ir::Kernel;
use osl_lanes::Word;
use osl_native::{Binary, Code, IntCompare, MaskValue, Next, Outcome, Scratch, Value};
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;

/// Weight of a side of a branch up to which it is computed for all lanes.
const SMALL: u64 = 24;
/// Maximum number of elements in an array to which lanes write at different indices.
const FEW: u32 = 16;
/// Maximum number of elements in an array that is written: it is copied, and cleared as a whole.
const MAX_WRITTEN: u32 = 256;
/// Maximum cost of a round: beyond, the interpreter charges it.
const MAX_COST: u64 = 1 << 24;

/// A region, and what its code depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Form {
    /// Its number.
    pub(crate) region: u32,
    /// Whether it runs for every lane of the batch, without a mask.
    pub(crate) all: bool,
    /// For each group of cells that it reads, in order: whether the batch has one cell.
    pub(crate) ones: u32,
}

/// The code of a region.
#[derive(Debug)]
pub(crate) struct RegionPlan {
    code: Code,
    arrays: Vec<ArraySource>,
    /// Uniform results: the words of the uniform file, in the order of the code's results.
    pub(crate) uniform: Vec<u32>,
    /// The arrays that it writes.
    pub(crate) written: Vec<u32>,
}

impl RegionPlan {
    /// Records and compiles a branch or a loop. `is_one` says whether a batch has one cell of a group.
    pub(crate) fn new(
        step: &Step,
        form: Form,
        shape: Shape,
        (constant, program): (Constants<'_>, &[Array]),
        is_one: &dyn Fn(u16) -> bool,
    ) -> Option<RegionPlan> {
        let mut sources = BTreeSet::from([ArraySource::Words, ArraySource::Results, ArraySource::Numbers]);
        each_array(step, &mut |array| {
            sources.insert(ArraySource::Array(array));
        });
        if !form.all {
            sources.insert(ArraySource::Mask);
        }
        each_operand(step, &mut |operand| {
            if let Location::Lanes { reg, cells, .. } = operand.location {
                sources.insert(match cells {
                    Some(cells) if is_one(cells.group) => ArraySource::Cells(cells.reg),
                    _ => ArraySource::Register(reg),
                });
            }
        });
        let writer = Writer::new(&sources, constant, shape);
        let mut recorder = Recorder { writer, uniform: FxHashMap::default(), arrays: program, is_one };
        let mask = match recorder.writer.array(ArraySource::Mask) {
            Some(mask) => recorder.writer.block.lanes(mask, 0),
            None => recorder.writer.block.bits(u32::MAX),
        };
        let active = recorder.writer.block.not_zero(mask);
        recorder.step(step, active)?;
        let uniform = recorder.keep(step)?;
        let numbers = 0..program.len() as u32;
        let writer = &recorder.writer;
        let written = writer.block.written_at();
        let is_written = |array: &u32| {
            writer.array(ArraySource::Array(*array)).is_some_and(|array| written.contains(&array))
        };
        let written = numbers.filter(is_written).collect();
        let block = recorder.writer.block;
        // The interpreter may have to start again.
        if block.overwrites_inputs() {
            return None;
        }
        let code = Code::for_batches(&block, shape.target, shape.width)?;
        Some(RegionPlan { code, arrays: sources.into_iter().collect(), uniform, written })
    }

    /// Bytes of its code.
    pub(super) fn bytes(&self) -> usize {
        self.code.size()
    }

    /// Computes a batch, within a budget for each vector; see [`Code::run_within`].
    pub(crate) fn run<W: Word>(
        &self,
        files: &mut Files<'_, W>,
        lanes: usize,
        scratch: &mut Scratch,
        budget: u32,
        goes_on: impl FnMut(u32) -> bool,
    ) -> Outcome {
        self.code.run_within(lend(&self.arrays, files), 0..lanes, scratch, budget, goes_on)
    }
}

/// Calls `visit` with each operand of a step and of those in it.
pub(crate) fn each_operand(step: &Step, visit: &mut dyn FnMut(Operand)) {
    match step {
        Step::Lane(step) => step.args().iter().chain([&step.out]).for_each(|operand| visit(*operand)),
        Step::If { cond, then, otherwise, results, .. } => {
            visit(*cond);
            results.iter().flatten().for_each(|operand| visit(*operand));
            then.list.iter().chain(&otherwise.list).for_each(|step| each_operand(step, visit));
        }
        Step::Loop { params, body, cond, .. } => {
            visit(*cond);
            for LoopParam { init, param, next, result, .. } in params {
                [init, param, next, result].into_iter().for_each(|operand| visit(*operand));
            }
            body.list.iter().for_each(|step| each_operand(step, visit));
        }
        Step::Load(step) => [step.index, step.out].into_iter().for_each(visit),
        Step::Store(step) => [step.index, step.value].into_iter().for_each(visit),
        Step::Kernel(step) => step.args.iter().for_each(|operand| visit(*operand)),
        // These have no code.
        Step::FindCells { .. } | Step::PerCell { .. } => {}
    }
}

/// Calls `visit` with each array that a step and those in it access.
fn each_array(step: &Step, visit: &mut dyn FnMut(u32)) {
    match step {
        Step::Load(step) => visit(step.array),
        Step::Store(step) => visit(step.array),
        Step::If { then, otherwise, .. } => {
            then.list.iter().chain(&otherwise.list).for_each(|step| each_array(step, visit));
        }
        Step::Loop { body, .. } => body.list.iter().for_each(|step| each_array(step, visit)),
        Step::Lane(_) | Step::Kernel(_) | Step::FindCells { .. } | Step::PerCell { .. } => {}
    }
}

/// Whether steps are computed for all lanes if some take them.
fn is_small(steps: &Steps) -> bool {
    sized(steps).1
}

/// The cost of steps, with that of small sides of branches in them.
fn weight(steps: &Steps) -> u64 {
    sized(steps).0
}

/// [`weight`] and [`is_small`] in one walk: each of them needs both of every side within, so that two walks
/// would take twice as long for each level of branches.
fn sized(steps: &Steps) -> (u64, bool) {
    let (mut weight, mut is_small) = (steps.weight, true);
    for step in &steps.list {
        match step {
            Step::If { then, otherwise, .. } => {
                for (cost, small) in [then, otherwise].map(sized) {
                    weight += if small { cost } else { 0 };
                    is_small &= small;
                }
            }
            Step::Loop { .. } => is_small = false,
            _ => {}
        }
    }
    (weight, is_small && weight <= SMALL)
}

/// The cost of a round as the code counts it.
fn cost(weight: u64) -> Option<u32> {
    (weight <= MAX_COST).then_some(weight as u32)
}

struct Recorder<'a> {
    writer: Writer<'a>,
    /// Words of the uniform file that the region computes.
    uniform: FxHashMap<u32, Value>,
    arrays: &'a [Array],
    is_one: &'a dyn Fn(u16) -> bool,
}

impl Recorder<'_> {
    fn steps(&mut self, steps: &Steps, active: MaskValue) -> Option<()> {
        steps.list.iter().try_for_each(|step| self.step(step, active))
    }

    fn step(&mut self, step: &Step, active: MaskValue) -> Option<()> {
        match step {
            Step::Lane(step) => self.lane(step),
            Step::If { cond, then, otherwise, results, .. } => {
                self.branch(*cond, [then, otherwise], results, active)
            }
            Step::Loop { params, body, cond, .. } => self.repeat(params, body, *cond, active),
            Step::Load(step) => self.load(step),
            Step::Store(step) => self.store(step, active),
            Step::Kernel(step) => self.check(step, active),
            Step::FindCells { .. } | Step::PerCell { .. } => None,
        }
    }

    /// An array, the words between its elements, and the word at which an element starts.
    fn place(&mut self, array: u32, index: Operand) -> Option<(Array, u32, Value)> {
        let plan = *self.arrays.get(array as usize)?;
        let stride = plan.words.checked_mul(if plan.varying { self.writer.width } else { 1 })?;
        let last = plan.len.checked_sub(1)?;
        last.checked_add(1)?.checked_mul(stride).filter(|words| *words < 1 << 28)?;
        let index = self.value(index, 0)?;
        let block = &mut self.writer.block;
        let (last, factor) = (block.bits(last), block.bits(stride));
        let index = block.binary(Binary::WordMin, index, last);
        Some((plan, stride, block.binary(Binary::IntMul, index, factor)))
    }

    fn load(&mut self, step: &LoadStep) -> Option<()> {
        let (plan, stride, start) = self.place(step.array, step.index)?;
        let array = self.writer.array(ArraySource::Array(step.array))?;
        let (width, most) = (self.writer.width, (plan.len - 1) * stride);
        let numbers = self.writer.array(ArraySource::Numbers)?;
        let block = &mut self.writer.block;
        let mut values = Vec::new();
        for component in 0..plan.words {
            values.push(match (plan.varying, step.index.location) {
                (true, Location::Words(_)) => block.lanes_at(array, component * width, start, most),
                (true, Location::Lanes { .. }) => {
                    let number = block.lanes(numbers, 0);
                    let start = block.binary(Binary::IntAdd, start, number);
                    block.gather(array, component * width, start, most + width - 1)
                }
                (false, _) => block.gather(array, component, start, most),
            });
        }
        self.define(step.out, &values)
    }

    fn store(&mut self, step: &StoreStep, active: MaskValue) -> Option<()> {
        let (plan, stride, start) = self.place(step.array, step.index)?;
        let array = self.writer.array(ArraySource::Array(step.array))?;
        if !plan.varying || plan.len > MAX_WRITTEN {
            return None;
        }
        let width = self.writer.width;
        for component in 0..plan.words {
            let (value, word) = (self.value(step.value, component)?, component * width);
            let block = &mut self.writer.block;
            if matches!(step.index.location, Location::Words(_)) {
                let most = (plan.len - 1) * stride;
                let old = block.lanes_at(array, word, start, most);
                let new = block.choose(active, value, old);
                block.store_at(array, word, (start, most), new);
            } else if plan.len <= FEW {
                for element in 0..plan.len {
                    let (here, zero) = (block.bits(element * stride), block.bits(0));
                    let is_here = block.compare_ints(IntCompare::Equal, start, here);
                    let is_here = block.both(active, is_here);
                    let old = block.lanes_at(array, word + element * stride, zero, 0);
                    let new = block.choose(is_here, value, old);
                    block.store_at(array, word + element * stride, (zero, 0), new);
                }
            } else {
                return None;
            }
        }
        Some(())
    }

    /// A check of an index: the code stops where it is out of range, and the interpreter reports it.
    fn check(&mut self, step: &KernelStep, active: MaskValue) -> Option<()> {
        let (Kernel::CheckIndex { .. }, &[index, length]) = (&step.kernel, &step.args[..]) else {
            return None;
        };
        let (index, length) = (self.value(index, 0)?, self.value(length, 0)?);
        let block = &mut self.writer.block;
        // Without its sign, a negative index is a large number.
        let sign = block.bits(0x8000_0000);
        let [index, length] = [index, length].map(|x| block.binary(Binary::Xor, x, sign));
        let beyond = block.compare_ints(IntCompare::LessEqual, length, index);
        let beyond = block.both(active, beyond);
        block.stop_if(beyond);
        Some(())
    }

    /// One component of a value; a single component stands for all.
    fn value(&mut self, operand: Operand, component: u32) -> Option<Value> {
        let component = if operand.words == 1 { 0 } else { component };
        let from = match operand.location {
            Location::Words(at) => match self.uniform.get(&(at + component)) {
                Some(value) => return Some(*value),
                None => LaneInput::Words(at),
            },
            Location::Lanes { component, cells: Some(cells), .. } if (self.is_one)(cells.group) => {
                LaneInput::Cell(cells.reg, component)
            }
            Location::Lanes { reg, component, .. } => LaneInput::Lanes(reg, component * self.writer.width),
        };
        self.writer.value(from, component)
    }

    /// All components of a value, as many as another has.
    fn values(&mut self, operand: Operand, like: Operand) -> Option<Vec<Value>> {
        (0..like.words).map(|component| self.value(operand, component)).collect()
    }

    fn define(&mut self, operand: Operand, values: &[Value]) -> Option<()> {
        for (component, value) in (0..).zip(values) {
            match operand.location {
                Location::Words(at) => {
                    self.uniform.insert(at + component, *value);
                }
                Location::Lanes { reg, component: base, .. } => {
                    let array = self.writer.array(ArraySource::Register(reg))?;
                    let word = (base + component) * self.writer.width;
                    self.writer.block.store(array, word, *value, false);
                }
            }
        }
        Some(())
    }

    fn lane(&mut self, step: &LaneStep) -> Option<()> {
        if !record::is_known(step.op, self.writer.style) {
            return None;
        }
        let shape = step.op.shape();
        let parts = u32::from(step.parts);
        let mut results = Vec::new();
        for part in 0..parts {
            let mut args = Vec::with_capacity(9);
            for (arg, kind) in step.args().iter().zip(shape.args) {
                let parted = parts > 1 && arg.words > 1;
                for component in 0..if parted { 1 } else { kind.words() } {
                    args.push(self.value(*arg, component + if parted { part } else { 0 })?);
                }
            }
            let style = self.writer.style;
            results.extend(record::operation(&mut self.writer.block, step.op, &args, style)?);
        }
        self.define(step.out, &results)
    }

    fn condition(&mut self, cond: Operand) -> Option<MaskValue> {
        let value = self.value(cond, 0)?;
        Some(self.writer.block.not_zero(value))
    }

    fn branch(
        &mut self,
        cond: Operand,
        [then, otherwise]: [&Steps; 2],
        results: &[[Operand; 3]],
        active: MaskValue,
    ) -> Option<()> {
        let yes = self.condition(cond)?;
        let no = self.writer.block.not(yes);
        let of = |at: usize| results.iter().map(move |all| (all[at], all[0]));
        let some = self.side(then, yes, of(1), active)?;
        let others = self.side(otherwise, no, of(2), active)?;
        let block = &mut self.writer.block;
        let chosen: Vec<Value> = some.iter().zip(&others).map(|(a, b)| block.choose(yes, *a, *b)).collect();
        let mut rest = &chosen[..];
        for [result, ..] in results {
            let (values, after) = rest.split_at_checked(result.words as usize)?;
            self.define(*result, values)?;
            rest = after;
        }
        Some(())
    }

    /// The values that a side of a branch yields, each with as many components as its result. In lanes that
    /// do not take it they are unspecified.
    fn side(
        &mut self,
        steps: &Steps,
        mask: MaskValue,
        yields: impl Iterator<Item = (Operand, Operand)>,
        active: MaskValue,
    ) -> Option<Vec<Value>> {
        let active = self.writer.block.both(active, mask);
        let small = is_small(steps);
        let yields: Vec<(Operand, Operand)> = yields.collect();
        if !small {
            let count = yields.iter().map(|(_, result)| result.words as usize).sum();
            let zero = self.writer.block.bits(0);
            self.writer.block.begin_skip(active, &vec![zero; count], cost(weight(steps))?);
        }
        self.steps(steps, active)?;
        let mut values = Vec::new();
        for (operand, result) in yields {
            values.extend(self.values(operand, result)?);
        }
        Some(if small { values } else { self.writer.block.end_skip(&values) })
    }

    fn repeat(&mut self, params: &[LoopParam], body: &Steps, cond: Operand, active: MaskValue) -> Option<()> {
        let varies = matches!(cond.location, Location::Lanes { .. });
        // Where lanes leave at different times, a uniform parameter goes on with the others, and its result
        // is carried apart.
        let apart = |p: &&LoopParam| varies && p.is_read && matches!(p.param.location, Location::Words(_));
        let mut inits = Vec::new();
        for p in params.iter().chain(params.iter().filter(apart)) {
            inits.extend(self.values(p.init, p.param)?);
        }
        let rounds = weight(body) + 4 + params.len() as u64;
        let begun = self.writer.block.begin_loop(active, &inits, cost(rounds)?);
        let mut rest = &begun.values[..];
        for p in params {
            let (values, after) = rest.split_at_checked(p.param.words as usize)?;
            self.define(p.param, values)?;
            rest = after;
        }
        self.steps(body, begun.active)?;
        let mut next = Vec::new();
        for p in params {
            let kept = varies && !matches!(p.param.location, Location::Words(_));
            next.extend(self.values(p.next, p.param)?.into_iter().map(|value| Next { value, kept }));
        }
        for p in params.iter().filter(apart) {
            next.extend(self.values(p.next, p.param)?.into_iter().map(|value| Next { value, kept: true }));
        }
        let again = self.condition(cond)?;
        let results = self.writer.block.end_loop(&begun, &next, again);
        let words: usize = params.iter().map(|p| p.param.words as usize).sum();
        let (mut own, mut others) = results.split_at_checked(words)?;
        for p in params {
            let (values, after) = own.split_at_checked(p.param.words as usize)?;
            own = after;
            if apart(&p) {
                let (values, after) = others.split_at_checked(p.param.words as usize)?;
                others = after;
                self.define(p.result, values)?;
            } else {
                self.define(p.result, values)?;
            }
        }
        Some(())
    }

    /// Stores the results of the whole region. Returns the words of the uniform file among them.
    fn keep(&mut self, step: &Step) -> Option<Vec<u32>> {
        let results: Vec<Operand> = match step {
            Step::If { results, .. } => results.iter().map(|[result, ..]| *result).collect(),
            Step::Loop { params, .. } => params.iter().filter(|p| p.is_read).map(|p| p.result).collect(),
            _ => Vec::new(),
        };
        let mut uniform = Vec::new();
        for result in results {
            for component in 0..result.words {
                let value = self.value(result, component)?;
                let (source, word) = match result.location {
                    Location::Lanes { reg, component: base, .. } => {
                        (ArraySource::Register(reg), base + component)
                    }
                    Location::Words(at) => {
                        uniform.push(at + component);
                        (ArraySource::Results, uniform.len() as u32 - 1)
                    }
                };
                let array = self.writer.array(source)?;
                self.writer.block.store(array, word * self.writer.width, value, true);
            }
        }
        Some(uniform)
    }
}
