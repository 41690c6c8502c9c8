//! The compiler of one body: assigns locations to values, and turns instructions into steps.

use super::closures::Flow;
use super::file::File;
use super::homes::{Home, Homes, occupant};
use super::lasting::Lasting;
use super::uses::Uses;
use super::{per_cell, weigh};
use crate::closures::ClosureKind;
use crate::step::{
    CellInputs, CellLocation, Export, KernelStep, LaneStep, LoadStep, Location, LoopParam, Mark, Operand,
    OutputPlan, OutputSource, Seed, Step, Steps, StoreStep,
};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, BlockId, Body, Const, Inst, Kind, LaneOp, Op, Rate, SlotId, Source, ValueId};
use rustc_hash::FxHashMap;
use std::sync::Arc;

#[derive(Default)]
pub(super) struct Strings {
    pub(super) list: Vec<Arc<str>>,
    pub(super) numbers: FxHashMap<Arc<str>, u32>,
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

pub(super) struct Compiler<'a> {
    body: &'a Body,
    locations: Vec<Option<Location>>,
    uses: Uses<'a>,
    homes: Homes,
    /// Values per cell that single points read.
    exported: Vec<bool>,
    position: u32,
    /// The position of the last of neighbouring instructions of a group.
    members_end: u32,
    /// Number of steps on cells.
    cell_steps: u32,
    /// Number of loops around the current position.
    loops: u32,
    /// Number of branches around the current position that some lanes take.
    parted: u32,
    pub(super) registers: File,
    /// Registers with a word for each cell.
    pub(super) cells: File,
    pub(super) words: Vec<Seed>,
    pub(super) globals: Vec<(Global, Operand)>,
    pub(super) derivs: Vec<(Global, Axis, Operand)>,
    /// Where the uniform file has the inputs of the body, by index.
    pub(super) inputs: Vec<(u32, u32)>,
    pub(super) strings: Strings,
    pub(super) marks: Vec<Mark>,
    /// Number of branches and loops.
    pub(super) regions: u32,
    pub(super) lasting: Lasting<'a>,
    /// The mark of the step around the current position.
    around: Option<u32>,
}

impl<'a> Compiler<'a> {
    pub(super) fn new(body: &'a Body) -> Self {
        let values = body.values.len();
        let uses = Uses::of(body);
        let exported = per_cell::exported(body, &uses.views);
        let mut strings = Strings::default();
        strings.number(&"".into());
        Compiler {
            body,
            locations: vec![None; values],
            uses,
            homes: Homes::default(),
            exported,
            position: 0,
            members_end: 0,
            cell_steps: 0,
            loops: 0,
            parted: 0,
            registers: File::default(),
            cells: File::default(),
            words: Vec::new(),
            globals: Vec::new(),
            derivs: Vec::new(),
            inputs: Vec::new(),
            strings,
            marks: Vec::new(),
            regions: 0,
            lasting: Lasting::new(body),
            around: None,
        }
    }

    fn operand(&mut self, v: ValueId) -> Operand {
        let kind = self.body.kind(v);
        let location = match self.locations.get(v.index()).copied().flatten() {
            Some(location) => location,
            None => self.define(v),
        };
        Operand { location, words: kind.words(), kind }
    }

    /// Assigns a location to a value. Values of a valid body are defined before they are used.
    fn define(&mut self, v: ValueId) -> Location {
        let words = self.body.kind(v).words();
        let location = if let Some(home) = self.homes.take(v) {
            Location::Lanes { reg: home.reg, component: 0, cells: None }
        } else if self.body.value(v).rate == Rate::Uniform {
            self.words.resize(self.words.len() + words as usize, Seed::Computed);
            Location::Words((self.words.len() - words as usize) as u32)
        } else {
            let last = self.uses.last_use[v.index()].max(self.position);
            let reg = self.registers.take(words, Some(last));
            let cells = per_cell::group(self.body, v).map(|group| {
                // A value that points or other steps on cells read has a register of its own. So it is kept
                // until the batch gets there, and for the next batch.
                let kept = self.exported[v.index()] || last > self.members_end;
                let reg = if kept { self.cells.add(words, None) } else { self.cells.take(words, Some(last)) };
                CellLocation { group, reg }
            });
            Location::Lanes { reg, component: 0, cells }
        };
        self.locations[v.index()] = Some(location);
        location
    }

    /// Advances to the next position, freeing the registers of values that ended at this one.
    fn advance(&mut self) {
        self.registers.end(self.position);
        self.cells.end(self.position);
        self.position += 1;
    }

    pub(super) fn block(&mut self, id: BlockId) -> Steps {
        let body = self.body;
        let mut steps = Steps::default();
        for members in
            body.block(id).insts.chunk_by(|a, b| per_cell::group_of(body, a) == per_cell::group_of(body, b))
        {
            let Some(group) = members.first().and_then(|inst| per_cell::group_of(body, inst)) else {
                members.iter().for_each(|inst| self.marked(inst, &mut steps));
                continue;
            };
            // Each takes one position.
            self.members_end = self.position + members.len() as u32 - 1;
            members.iter().for_each(|inst| self.member(inst, group, &mut steps));
            self.members_end = 0;
            if let Some(Step::PerCell { group, steps, inputs, .. }) = steps.list.last_mut() {
                let number = self.cell_steps;
                *inputs = per_cell::inputs(*group, &steps.list, &self.words)
                    .map(|words| CellInputs { number, words });
                self.cell_steps += 1;
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

    /// An instruction of a group, added to those of the group before it.
    fn member(&mut self, inst: &'a Inst, group: u16, steps: &mut Steps) {
        if !matches!(steps.list.last(), Some(Step::PerCell { group: last, .. }) if *last == group) {
            let mark = self.mark(inst, format!("shared{group}"));
            steps.list.push(Step::PerCell {
                group,
                steps: Steps::default(),
                exports: Vec::new(),
                inputs: None,
            });
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
            .filter(|r| self.exported[r.index()] && self.uses.views[r.index()].is_none())
            .collect();
        let export = |r: ValueId| Export { last: self.uses.last_use[r.index()], value: self.operand(r) };
        let found: Vec<Export> = exported.into_iter().map(export).collect();
        if let Some(Step::PerCell { steps, exports, .. }) = steps.list.last_mut() {
            steps.list.extend(inner.list);
            steps.marks.extend(inner.marks);
            exports.extend(found);
        }
    }

    /// The location of a value that exists before the first step: its register is new, and is not reused in a
    /// loop.
    fn given(&mut self, inst: &Inst) -> Option<Operand> {
        let result = *inst.results.first()?;
        let words = self.body.kind(result).words();
        if self.body.value(result).rate == Rate::Varying {
            let last = self.uses.last_use[result.index()].max(self.position);
            let reg = self.registers.add(words, (self.loops == 0).then_some(last));
            self.locations[result.index()] = Some(Location::Lanes { reg, component: 0, cells: None });
        }
        Some(self.operand(result))
    }

    /// The last position at which the result of an instruction is read.
    fn last(&self, inst: &Inst) -> u32 {
        inst.results.first().map_or(u32::MAX, |r| self.uses.last_use[r.index()])
    }

    /// Gives the results of an instruction their locations.
    fn results(&mut self, inst: &Inst) -> Vec<Operand> {
        inst.results
            .iter()
            .map(|r| {
                self.define(*r);
                self.operand(*r)
            })
            .collect()
    }

    /// Gives the results of a branch their locations, and the values that its sides yield the same ones where
    /// they can have them.
    fn branch_results(&mut self, inst: &Inst, parts: bool) -> Vec<Operand> {
        let mut homes = Vec::new();
        let mut results = Vec::new();
        for (at, result) in inst.results.iter().enumerate() {
            let taken = self.homes.take(*result);
            let home = taken.or_else(|| if parts { None } else { self.taken_over(inst, at) });
            if let Some(home) = home {
                let location = Location::Lanes { reg: home.reg, component: 0, cells: None };
                self.locations[result.index()] = Some(location);
            } else {
                self.define(*result);
            }
            let operand = self.operand(*result);
            homes.push(home.or(match operand.location {
                Location::Lanes { reg, cells: None, .. } => Some(Home { reg, occupant: None }),
                _ => None,
            }));
            results.push(operand);
        }
        self.homes.pass(inst, &homes, (self.body, &self.uses));
        results
    }

    /// The register of a value from before a branch, which one of its results takes over. Code for a region
    /// must not change what it reads, and in a loop the value may be read again.
    fn taken_over(&mut self, inst: &Inst, at: usize) -> Option<Home> {
        let result = *inst.results.get(at).filter(|_| self.loops == 0 && self.parted == 0)?;
        let v = occupant(inst, at, self.body, &self.uses)?;
        let Some(Location::Lanes { reg, component: 0, cells: None }) = self.locations[v.index()] else {
            return None;
        };
        let register = (self.body.kind(v).words(), reg);
        let until = self.uses.last_use(result).max(self.uses.end(result));
        let is_free = self.registers.keep(register, self.uses.last_use(v), until);
        is_free.then_some(Home { reg, occupant: Some(v) })
    }

    fn result(&mut self, inst: &Inst) -> Option<Operand> {
        self.results(inst).into_iter().next()
    }

    fn inst(&mut self, inst: &Inst, steps: &mut Vec<Step>) {
        match &inst.op {
            Op::Const(value) => {
                self.lasting.note(inst, &self.uses);
                if let Some(out) = self.result(inst) {
                    self.constant(value, out, steps);
                }
                self.advance();
            }
            Op::Global(global) => {
                self.lasting.note(inst, &self.uses);
                if let Some(out) = self.given(inst) {
                    self.globals.push((*global, out));
                }
                self.advance();
            }
            Op::Input(index) => {
                self.lasting.note(inst, &self.uses);
                let body = self.body;
                if let (Some(input), Some(out)) = (body.inputs.get(*index as usize), self.result(inst)) {
                    let at = match out.location {
                        Location::Words(at) => at,
                        Location::Lanes { .. } => self.words.len() as u32,
                    };
                    self.inputs.push((*index, at));
                    self.constant(&input.value, out, steps);
                }
                self.advance();
            }
            Op::GlobalDeriv(global, axis) => {
                self.lasting.note(inst, &self.uses);
                if let Some(out) = self.given(inst) {
                    self.derivs.push((*global, *axis, out));
                }
                self.advance();
            }
            Op::Lane(op, args) => {
                let lasting = self.lasting.note(inst, &self.uses);
                if !self.view(inst) {
                    let args: Vec<Operand> = args.iter().map(|a| self.operand(*a)).collect();
                    if let Some(out) = self.result(inst) {
                        let life = (self.position, self.last(inst));
                        steps.push(Step::Lane(LaneStep::new(*op, &args, out, life).lasting(lasting)));
                    }
                }
                self.advance();
            }
            Op::Kernel(kernel, args) => {
                let kinds = args.iter().map(|a| self.body.kind(*a)).collect();
                let args = args.iter().map(|a| self.operand(*a)).collect();
                let outs = self.results(inst);
                let lasting = self.lasting.note(inst, &self.uses);
                let kernel = kernel.clone();
                let step = KernelStep { kernel, args, kinds, outs, span: inst.span, lasting };
                steps.push(Step::Kernel(Box::new(step)));
                self.advance();
            }
            Op::Share(group, roots) => {
                let roots = roots.iter().map(|v| self.operand(*v)).collect();
                let outs = self.results(inst);
                let exports = inst.results.iter().enumerate().filter(|(_, r)| self.exported[r.index()]);
                let exports = exports.map(|(at, _)| at).collect();
                steps.push(Step::FindCells { group: *group, roots, outs, exports });
                self.advance();
            }
            Op::LoadElement(slot, index) => {
                let index = self.operand(*index);
                if let Some(out) = self.result(inst) {
                    let life = (self.position, self.last(inst));
                    steps.push(Step::Load(LoadStep { array: slot.0, index, out, life }));
                }
                self.advance();
            }
            Op::StoreElement(slot, index, value) => {
                let (index, value) = (self.operand(*index), self.operand(*value));
                steps.push(Step::Store(StoreStep { array: slot.0, index, value, at: self.position }));
                self.advance();
            }
            // The `ssa` and `derive` passes have removed these.
            Op::Load(SlotId(_)) | Op::Store(..) | Op::Derivative(..) => self.advance(),
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                let cond = self.operand(*cond);
                let parts = matches!(cond.location, Location::Lanes { .. });
                let results = self.branch_results(inst, parts);
                self.advance();
                self.parted += u32::from(parts);
                let then = self.block(*then);
                let a: Vec<Operand> = then_yields.iter().map(|v| self.operand(*v)).collect();
                self.advance();
                let otherwise = self.block(*otherwise);
                let b: Vec<Operand> = else_yields.iter().map(|v| self.operand(*v)).collect();
                self.parted -= u32::from(parts);
                let lasting = self.lasting.note(inst, &self.uses);
                self.advance();
                let results = results.into_iter().zip(a).zip(b).map(|((r, a), b)| [r, a, b]).collect();
                steps.push(Step::If { region: self.region(), cond, then, otherwise, results, lasting });
            }
            Op::Loop { init, params, body, cond, next } => {
                let first: Vec<Operand> = init.iter().map(|v| self.operand(*v)).collect();
                let mut carried = Vec::new();
                for ((param, result), init) in params.iter().zip(&inst.results).zip(first) {
                    self.define(*param);
                    self.define(*result);
                    let (param, result) = (self.operand(*param), self.operand(*result));
                    carried.push(LoopParam { init, param, next: init, result, is_read: true });
                }
                self.advance();
                self.loops += 1;
                let inner = self.block(*body);
                self.loops -= 1;
                for ((carried, next), result) in carried.iter_mut().zip(next).zip(&inst.results) {
                    carried.next = self.operand(*next);
                    carried.is_read = self.uses.last_use[result.index()] > self.position;
                }
                let cond = self.operand(*cond);
                self.advance();
                let region = self.region();
                steps.push(Step::Loop { region, params: carried, body: inner, cond, span: inst.span });
            }
        }
    }

    /// The number of a branch or a loop.
    fn region(&mut self) -> u32 {
        self.regions += 1;
        self.regions - 1
    }

    /// Makes the result a view of the argument if possible. Returns whether it did.
    fn view(&mut self, inst: &Inst) -> bool {
        let Some(result) = inst.results.first().copied() else { return false };
        let Some((root, component)) = self.uses.views.get(result.index()).copied().flatten() else {
            return false;
        };
        let location = match self.operand(root).location {
            Location::Lanes { reg, component: base, cells } => {
                Location::Lanes { reg, component: base + component, cells }
            }
            Location::Words(at) => Location::Words(at + component),
        };
        self.locations[result.index()] = Some(location);
        true
    }

    fn constant(&mut self, value: &Const, out: Operand, steps: &mut Vec<Step>) {
        let words = Seed::of(value, |text| self.strings.number(text));
        match out.location {
            Location::Words(at) => {
                let at = at as usize;
                if let Some(target) = self.words.get_mut(at..at + words.len()) {
                    target.copy_from_slice(&words);
                }
            }
            Location::Lanes { .. } => {
                // Only if the rate pass is off: broadcasts a hidden uniform constant.
                let life = (self.position, u32::MAX);
                let at = self.words.len() as u32;
                for (component, word) in words.iter().enumerate() {
                    self.words.push(*word);
                    let kind = if matches!(word, Seed::Float(_)) { Kind::Float } else { Kind::Int };
                    let from = Operand { location: Location::Words(at + component as u32), words: 1, kind };
                    let Location::Lanes { reg, component: base, cells } = out.location else { continue };
                    let location = Location::Lanes { reg, component: base + component as u32, cells };
                    let to = Operand { location, words: 1, kind };
                    let step = match word {
                        Seed::Bits(_) | Seed::Computed => LaneStep::new(LaneOp::IOr, &[from, from], to, life),
                        Seed::Float(_) => LaneStep::new(LaneOp::Still, &[from], to, life),
                    };
                    steps.push(Step::Lane(step));
                }
            }
        }
    }

    pub(super) fn outputs(&mut self, closures: &[ClosureKind]) -> Vec<OutputPlan> {
        let body = self.body;
        let flow = (!closures.is_empty()).then(|| Flow::of(body));
        let mut plans = Vec::new();
        for output in &body.outputs {
            let (kind, source) = match output.source {
                Source::Value(v) => (body.kind(v), OutputSource::Value(self.operand(v))),
                Source::Slot(s) => (body.slot(s).kind, OutputSource::Array(s.0)),
            };
            let flow = flow.as_ref().filter(|_| kind == Kind::Closure);
            let names = flow.map_or_else(Vec::new, |flow| flow.names(&output.source, closures));
            let index: FxHashMap<&Arc<str>, u32> = names.iter().zip(0..).collect();
            let of_kind = |kind: &ClosureKind| index.get(&kind.name).copied().unwrap_or(u32::MAX);
            let name_of = closures.iter().filter(|_| !names.is_empty()).map(of_kind).collect();
            plans.push(OutputPlan { name: output.name.clone(), ty: output.ty, kind, source, names, name_of });
        }
        plans
    }
}
