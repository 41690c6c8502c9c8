//! Following a run step by step: for tools that explain what happened at a point, or look for where digits are lost.
//!
//! An [`Observer`] is called behind each step, while its arguments and results are still at hand, and where branches and
//! rounds of loops begin and end. Nothing of it costs a run that nobody follows. This module must not know what is
//! made of it.

use crate::arithmetic::{Arithmetic, Double};
use crate::arithmetic::{Element, Word};
use crate::lanes::{Arg, LaneCall};
use crate::machine::{Machine, Mask, Stop};
use crate::program::{self, LoopParam, MAX_ARGS, Operand, Place, Program, Steps};
use osl_ir::Span;
use osl_ir::ir::{Const, Kernel, Kind, LaneOp};
use osl_ir::numeric::Real;

/// Who follows a run.
pub trait Observer {
    /// Called behind each step. A branch or a loop is a step too, behind what runs within.
    fn step(&mut self, step: &Step<'_>);
    /// A side of a branch, or a round of a loop, begins.
    fn enter(&mut self, scope: &Scope<'_>) {
        let _ = scope;
    }
    /// It ends.
    fn leave(&mut self) {}
}

/// A place for values, and what they are. Places are used again for other values once theirs are no longer needed: the
/// step before that wrote to a place is what a value in it comes of.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    operand: Operand,
    place: u64,
    kind: Kind,
}

impl Slot {
    fn of(operand: Operand) -> Slot {
        let place = match operand.place {
            Place::Words(at) => u64::from(at),
            Place::Lanes { reg, component, .. } => 1 << 62 | u64::from(reg) << 8 | u64::from(component),
        };
        Slot { operand, place, kind: operand.kind }
    }

    /// An array as a whole: it has a place, but no value.
    fn array(array: u32, kind: Kind) -> Slot {
        let operand = Operand { place: Place::Words(0), words: 0, kind };
        Slot { operand, place: 1 << 63 | u64::from(array), kind }
    }

    /// What tells the place from others. Components of a triple or matrix have places that follow each other.
    pub fn place(&self) -> u64 {
        self.place
    }

    /// Whether it is an array as a whole, whose place no value can be read at.
    pub fn is_array(&self) -> bool {
        self.operand.words == 0
    }

    /// What the value is.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Floats or ints that make up the value: 1, 3 or 16; 0 for an array.
    pub fn components(&self) -> usize {
        self.operand.words as usize
    }
}

/// What a step does.
#[derive(Clone, Copy, Debug)]
pub enum Work<'a> {
    /// A lane operation.
    Lane(LaneOp),
    /// A kernel.
    Kernel(&'a Kernel),
    /// Reads an element of an array. Arguments: the index and the array.
    Load,
    /// Writes an element of an array. Arguments: the index and the value; the result is the array.
    Store,
    /// A branch. Arguments: the condition, what the first side yields for each result, then what the second does.
    Branch,
    /// A loop. Arguments: what each result starts with, what the last round yields for each, then the condition.
    Loop,
    /// Work that points share.
    Shared,
}

/// A step that has run.
pub struct Step<'a> {
    at: u32,
    program: &'a Program,
    work: Work<'a>,
    args: &'a [Slot],
    results: &'a [Slot],
    lanes: &'a [usize],
    flips: u64,
    first: usize,
    values: &'a dyn Values,
}

/// A part of the program that begins.
pub struct Scope<'a> {
    /// The branch or loop that it belongs to: its number as a step.
    pub at: u32,
    /// Which part.
    pub kind: ScopeKind,
    /// The lanes that run it.
    pub lanes: &'a [usize],
    /// For a round of a loop, what its values come of: from where, and where to.
    pub copies: &'a [(Slot, Slot)],
}

/// A part of a branch or loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScopeKind {
    /// Where the condition holds.
    Then,
    /// Where it does not.
    Otherwise,
    /// A round of a loop, from 0 on.
    Round(u32),
}

impl Step<'_> {
    /// The number of the instruction that the step comes of: the same each time that it runs, below
    /// [`Program::instructions`].
    pub fn at(&self) -> u32 {
        self.at
    }

    /// What it does, as `oslrun ir` names it.
    pub fn name(&self) -> &str {
        self.program.marks.get(self.at as usize).map_or("", |mark| &mark.name)
    }

    /// The source that it comes from.
    pub fn span(&self) -> Span {
        self.program.marks.get(self.at as usize).map(|mark| mark.span).unwrap_or_default()
    }

    /// The number of the branch, loop or shared work around it.
    pub fn around(&self) -> Option<u32> {
        self.program.marks.get(self.at as usize).and_then(|mark| mark.around)
    }

    /// What it does.
    pub fn work(&self) -> Work<'_> {
        self.work
    }

    /// Where its arguments are.
    pub fn args(&self) -> &[Slot] {
        self.args
    }

    /// Where its results are.
    pub fn results(&self) -> &[Slot] {
        self.results
    }

    /// The lanes that it ran for. A value that all share it has at each.
    pub fn lanes(&self) -> &[usize] {
        self.lanes
    }

    /// The point of a lane, by the order of the source of points.
    pub fn point(&self, lane: usize) -> usize {
        self.first + lane
    }

    /// A value at a lane; floats in single precision.
    pub fn value(&self, slot: Slot, lane: usize) -> Const {
        if slot.is_array() { Const::Null } else { self.values.value(slot.operand, slot.kind, lane) }
    }

    /// A component of a float value, or an int, at a lane, as well as it is known.
    pub fn number(&self, slot: Slot, component: usize, lane: usize) -> f64 {
        match slot.kind {
            _ if component >= slot.components() => f64::NAN,
            Kind::Float | Kind::Triple | Kind::Matrix => self.values.number(slot.operand, component, lane).1,
            _ => f64::from(self.values.bits(slot.operand, lane) as i32),
        }
    }

    /// The same in single precision. In a run of both arithmetics side by side it is the strict number.
    pub fn single(&self, slot: Slot, component: usize, lane: usize) -> f32 {
        match slot.kind {
            _ if component >= slot.components() => f32::NAN,
            Kind::Float | Kind::Triple | Kind::Matrix => self.values.number(slot.operand, component, lane).0,
            _ => self.values.bits(slot.operand, lane) as i32 as f32,
        }
    }

    /// What a lane operation yields in double precision for its arguments in single: a component of the result. What
    /// that differs by from the strict result is the error that the step itself adds. `None` for what is no lane operation.
    pub fn alone(&self, component: usize, lane: usize) -> Option<f64> {
        let Work::Lane(op) = self.work else { return None };
        let result = self.results.first()?;
        let parts = if op.shape().per_component { result.components() } else { 1 };
        let mut words = [[0_u64; 16]; MAX_ARGS];
        let mut list = [(Arg::Same(&[][..]), 0); MAX_ARGS];
        for (room, slot) in words.iter_mut().zip(self.args) {
            for (c, word) in room.iter_mut().enumerate().take(slot.components()) {
                *word = match slot.kind {
                    Kind::Float | Kind::Triple | Kind::Matrix => {
                        f64::from(self.single(*slot, c, lane)).store()
                    }
                    _ => u64::of(self.values.bits(slot.operand, lane)),
                };
            }
        }
        for ((arg, room), slot) in list.iter_mut().zip(&words).zip(self.args) {
            *arg = (Arg::Each(&room[..]), usize::from(parts > 1 && slot.components() > 1));
        }
        let mut out = [0; 16];
        let args = &list[..self.args.len().min(MAX_ARGS)];
        Double::lanes(
            osl_noise::Isa::baseline(),
            LaneCall { op, args, out: &mut out, n: 1, stride: 1, parts },
        );
        let word = out.get(component)?;
        Some(match result.kind {
            Kind::Float | Kind::Triple | Kind::Matrix => f64::load(*word),
            _ => f64::from(word.bits() as i32),
        })
    }

    /// In a run of both arithmetics side by side, how many comparisons within the step came out differently in them,
    /// all lanes together.
    pub fn flips(&self) -> u64 {
        self.flips
    }
}

/// What a machine of any arithmetic tells of its values.
trait Values {
    fn value(&self, operand: Operand, kind: Kind, lane: usize) -> Const;
    /// In single precision, and as well as it is known.
    fn number(&self, operand: Operand, component: usize, lane: usize) -> (f32, f64);
    fn bits(&self, operand: Operand, lane: usize) -> u32;
}

impl<A: Arithmetic> Values for Machine<'_, A> {
    fn value(&self, operand: Operand, kind: Kind, lane: usize) -> Const {
        Machine::value(self, operand, kind, lane)
    }
    fn number(&self, operand: Operand, component: usize, lane: usize) -> (f32, f64) {
        let word = self.word(self.part(operand, component), lane);
        let x = A::Real::load(word);
        (x.to_f32(), x.to_f64())
    }
    fn bits(&self, operand: Operand, lane: usize) -> u32 {
        self.word(operand, lane).bits()
    }
}

impl<A: Arithmetic> Machine<'_, A> {
    /// Runs steps and tells who follows of each.
    pub(crate) fn observed(&mut self, steps: &Steps, mask: &Mask) -> Result<(), Stop> {
        for (step, mark) in steps.list.iter().zip(&steps.marks) {
            self.at = *mark;
            A::take_flips();
            self.step(step, mask)?;
            self.tell(step, *mark, mask);
        }
        Ok(())
    }

    fn tell(&mut self, step: &program::Step, at: u32, mask: &Mask) {
        let flips = A::take_flips();
        let Some(observer) = self.observer.take() else { return };
        let (work, args, results) = self.parts(step);
        let lanes = self.active(mask);
        observer.step(&Step {
            at,
            program: self.program(),
            work,
            args: &args,
            results: &results,
            lanes: &lanes,
            flips,
            first: self.first(),
            values: self,
        });
        self.observer = Some(observer);
    }

    fn parts<'s>(&self, step: &'s program::Step) -> (Work<'s>, Vec<Slot>, Vec<Slot>) {
        let slots = |list: &[Operand]| list.iter().copied().map(Slot::of).collect::<Vec<_>>();
        let array = |at: &u32| {
            let kind = self.program().arrays.get(*at as usize).map_or(Kind::Float, |a| a.kind);
            Slot::array(*at, kind)
        };
        match step {
            program::Step::Lane(step) => (Work::Lane(step.op), slots(step.args()), slots(&[step.out])),
            program::Step::Kernel(step) => (Work::Kernel(&step.kernel), slots(&step.args), slots(&step.outs)),
            program::Step::Load { array: from, index, out } => {
                (Work::Load, vec![Slot::of(*index), array(from)], slots(&[*out]))
            }
            program::Step::Store { array: to, index, value } => {
                (Work::Store, slots(&[*index, *value]), vec![array(to)])
            }
            program::Step::If { cond, results, .. } => {
                let column = |at: usize| results.iter().map(move |r| Slot::of(r[at]));
                let args = std::iter::once(Slot::of(*cond)).chain(column(1)).chain(column(2));
                (Work::Branch, args.collect(), column(0).collect())
            }
            program::Step::Loop { params, cond, .. } => {
                let column = |of: fn(&LoopParam) -> Operand| params.iter().map(move |p| Slot::of(of(p)));
                let args = column(|p| p.init).chain(column(|p| p.next)).chain([Slot::of(*cond)]);
                (Work::Loop, args.collect(), column(|p| p.result).collect())
            }
            program::Step::FindCells { roots, outs, .. } => (Work::Shared, slots(roots), slots(outs)),
            program::Step::Shared { exports, .. } => (Work::Shared, Vec::new(), slots(exports)),
        }
    }

    /// Runs a part of a branch or loop, and tells who follows.
    #[inline]
    pub(crate) fn within(
        &mut self,
        kind: ScopeKind,
        mask: &Mask,
        params: &[LoopParam],
        run: impl FnOnce(&mut Self) -> Result<(), Stop>,
    ) -> Result<(), Stop> {
        let Some(observer) = self.observer.take() else { return run(self) };
        let at = self.at;
        let from = |p: &LoopParam| if kind == ScopeKind::Round(0) { p.init } else { p.next };
        let copies: Vec<_> = params.iter().map(|p| (Slot::of(from(p)), Slot::of(p.param))).collect();
        let lanes = self.active(mask);
        observer.enter(&Scope { at, kind, lanes: &lanes, copies: &copies });
        self.observer = Some(observer);
        let result = run(self);
        if let Some(observer) = &mut self.observer {
            observer.leave();
        }
        self.at = at;
        result
    }
}
