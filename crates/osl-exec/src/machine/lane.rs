//! Lane operations: consecutive ones wait in a queue and run together.
//!
//! Uniform operations are not queued but computed at once, and so are values of cells; the others resolve
//! their arguments once per batch.

use super::{Machine, Mask};
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::lanes::{Gather, LaneInput, LaneRun, Move, PIECE, Ready, ReadyArg, ReadyLane};
use crate::native::{Files, Key, MAX_RUN, QueuedOp, Sequence};
use crate::register::{LINE, Lanes};
use crate::step::{CellLocation, Export, LaneStep, LoadStep, Location, Operand, Step, StoreStep};
use osl_ir::ir::MAX_ARGS;
use osl_lanes::Word;

/// Registers with these numbers of components, whose pieces are at different offsets in the L1 cache.
pub(super) fn registers<W: Word>(components: &[u32], width: usize) -> Vec<Lanes<W>> {
    // A few cache lines more, so that a store and the load of another register also differ within a page.
    let apart = PIECE * size_of::<W>() + 5 * LINE * size_of::<u32>();
    // If there are many registers, the gaps between them would take more room than the registers.
    let few = width >= PIECE && components.len() <= 256;
    let register = |(at, words): (usize, &u32)| {
        let words = *words as usize * width;
        if few { Lanes::behind_page(words, at * apart) } else { Lanes::new(words) }
    };
    components.iter().enumerate().map(register).collect()
}

/// Queued lane operations, and their keys.
#[derive(Debug, Default)]
pub(super) struct Queue<'a> {
    items: Vec<Item<'a>>,
    keys: Vec<Key>,
}

#[derive(Clone, Copy, Debug)]
enum Item<'a> {
    Lane(&'a LaneStep),
    /// Gives lanes the values of their cells.
    Gather(&'a Export, CellLocation),
    /// Reads or writes an element of an array, which starts at a word.
    Load(&'a LoadStep, u32),
    Store(&'a StoreStep, u32),
}

impl<'a> Queue<'a> {
    pub(super) fn clear(&mut self) {
        self.items.clear();
        self.keys.clear();
    }

    fn push(&mut self, item: Item<'a>, number: u32, state: u32) {
        self.items.push(item);
        self.keys.push(Key(u64::from(number) | u64::from(state) << 32));
    }
}

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// Runs steps, except the trailing lane operations, which stay in the queue.
    pub(super) fn follow(&mut self, steps: &'a [Step], mask: &Mask) -> Result<(), RunError> {
        for step in steps {
            match step {
                Step::Lane(step) => self.queue(step),
                // What is uniform depends on no lane.
                Step::Load(step) if self.is_uniform(step.array, step.out) => {
                    self.load(step.array, step.index, step.out);
                }
                Step::Store(step) if self.is_uniform(step.array, step.value) => {
                    self.store(step.array, step.index, step.value, mask);
                }
                Step::Load(step) if self.queue_load(step) => {}
                Step::Store(step) if self.queue_store(step, mask) => {}
                Step::PerCell { group, steps, exports, inputs } => {
                    self.per_cell(*group, steps, (exports, inputs.as_ref()), mask)?;
                }
                _ => {
                    self.run_queue();
                    self.step(step, mask)?;
                }
            }
        }
        Ok(())
    }

    /// Queues a lane operation. A uniform operation is computed at once, since it depends on no lane.
    pub(super) fn queue(&mut self, step: &'a LaneStep) {
        match step.out.location {
            Location::Words(at) => {
                if !self.has_lasted(step.lasting) {
                    self.once(step, at);
                }
            }
            Location::Lanes { component, .. } => {
                let ones = step.args().iter().map(|arg| match arg.location {
                    Location::Lanes { cells: Some(cells), .. } => self.per_cell.is_one(cells.group).into(),
                    _ => 0,
                });
                let ones = ones.fold(0u32, |all, one| all << 1 | one);
                let running = u32::from(self.per_cell.is_running());
                self.queue.push(Item::Lane(step), step.life.0, component << 8 | running << 7 | ones);
                self.bound_queue();
            }
        }
    }

    fn bound_queue(&mut self) {
        if self.queue.items.len() >= MAX_RUN {
            self.run_queue();
        }
    }

    /// Whether an array and a value are the same for all lanes.
    fn is_uniform(&self, array: u32, value: Operand) -> bool {
        let uniform = self.program.arrays.get(array as usize).is_some_and(|plan| !plan.varying);
        uniform && matches!(value.location, Location::Words(_))
    }

    /// The first word of an element whose index is a constant, in an array that differs between lanes.
    fn constant_place(&self, array: u32, index: Operand) -> Option<u32> {
        let Location::Words(at) = index.location else { return None };
        let plan = self.program.arrays.get(array as usize).filter(|plan| plan.varying)?;
        let index = self.program.constant(at)?.min(plan.len.saturating_sub(1));
        u32::try_from(u64::from(index * plan.words) * self.width as u64).ok()
    }

    /// Whether it queued reading an element.
    fn queue_load(&mut self, step: &'a LoadStep) -> bool {
        if self.per_cell.is_running() || !matches!(step.out.location, Location::Lanes { cells: None, .. }) {
            return false;
        }
        let Some(word) = self.constant_place(step.array, step.index) else { return false };
        self.queue.push(Item::Load(step, word), step.life.0, 1 << 5);
        self.bound_queue();
        true
    }

    /// Whether it queued writing an element, which it does for all lanes together.
    fn queue_store(&mut self, step: &'a StoreStep, mask: &Mask) -> bool {
        let cells = matches!(step.value.location, Location::Lanes { cells: Some(_), .. });
        if self.per_cell.is_running() || cells || !matches!(mask, Mask::All(_)) {
            return false;
        }
        let Some(word) = self.constant_place(step.array, step.index) else { return false };
        self.touch_all(step.array, step.index, mask);
        self.queue.push(Item::Store(step, word), step.at, 1 << 4);
        self.bound_queue();
        true
    }

    /// Queues the copying of cell values to lanes.
    pub(super) fn queue_gather(&mut self, export: &'a Export) {
        if let Location::Lanes { cells: Some(cells), .. } = export.value.location {
            // Its register never holds another value.
            self.queue.push(Item::Gather(export, cells), cells.reg, 1 << 6);
        }
    }

    /// Runs the queue.
    pub(super) fn run_queue(&mut self) {
        if self.queue.items.is_empty() {
            return;
        }
        if !self.run_planned() {
            self.note_queue();
            if !self.run_planned() {
                self.interpret_queue();
            }
        }
        self.queue.clear();
    }

    /// Runs the queue as machine code, if it has a plan.
    fn run_planned(&mut self) -> bool {
        let Some((native, style)) = self.native.as_mut().zip(A::NATIVE) else { return false };
        // A single cell does not fill a vector.
        let Some(shape) = native.shape(style, self.width) else { return false };
        let Some((plan, scratch)) = native.find(shape, &self.queue.keys) else { return false };
        let lanes = (&mut self.registers[..], &mut self.arrays[..]);
        let mut files = Files::new(lanes, self.per_cell.tables(), &self.words, &mut self.broadcasts);
        plan.run::<A>(self.isa, &mut files, (self.width, self.lanes), scratch);
        true
    }

    /// Counts that the queue is executed, which may give it a plan.
    fn note_queue(&mut self) {
        let Some((mut native, style)) = self.native.take().zip(A::NATIVE) else { return };
        if let Some(shape) = native.shape(style, self.width) {
            let constant = |at| self.program.constant(at);
            let all = || Sequence {
                items: self.queue.items.iter().map(|item| self.waiting(item)).collect(),
                constant: &constant,
            };
            native.note(&self.program.native, (shape, self.lanes), &self.queue.keys, all);
        }
        self.native = Some(native);
    }

    fn interpret_queue(&mut self) {
        let mut ready = std::mem::take(&mut self.ready);
        ready.extend(self.queue.items.iter().map(|item| self.waiting(item).ready));
        let lanes = (&mut self.registers[..], &mut self.arrays[..]);
        let mut files = Files::new(lanes, self.per_cell.tables(), &self.words, &mut self.broadcasts);
        A::lanes(self.isa, files.run(self.isa, &ready, self.width, 0..self.lanes));
        ready.clear();
        self.ready = ready;
    }

    /// A queued item with resolved arguments.
    fn waiting(&self, item: &Item<'_>) -> QueuedOp {
        match item {
            Item::Lane(step) => {
                let (at, last) = step.life;
                let out = match step.out.location {
                    Location::Words(at) => (at, 0),
                    Location::Lanes { reg, component, cells } => {
                        (self.per_cell.register(reg, cells) as u32, component * self.width as u32)
                    }
                };
                QueuedOp { ready: Ready::Lane(self.ready(step, out, self.width)), at, last }
            }
            Item::Gather(export, cells) => {
                let out = match export.value.location {
                    Location::Lanes { reg, component, .. } => (reg, component * self.width as u32),
                    Location::Words(at) => (at, 0),
                };
                let component =
                    if let Location::Lanes { component, .. } = export.value.location { component } else { 0 };
                let words = export.value.words as u8;
                let gather = Gather { group: cells.group, from: (cells.reg, component), words, out };
                QueuedOp { ready: Ready::Gather(gather), at: 0, last: export.last }
            }
            Item::Load(step, word) => {
                let (at, last) = step.life;
                QueuedOp { ready: Ready::Load(self.moved((step.array, *word), step.out)), at, last }
            }
            Item::Store(step, word) => {
                let ready = Ready::Store(self.moved((step.array, *word), step.value));
                QueuedOp { ready, at: step.at, last: step.at }
            }
        }
    }

    /// A queued access to an array.
    fn moved(&self, array: (u32, u32), value: Operand) -> Move {
        let from = self.from(value);
        let apart = match from {
            _ if value.words == 1 => 0,
            LaneInput::Lanes(..) => self.width as u32,
            LaneInput::Words(_) | LaneInput::Cell(..) => 1,
        };
        let words = self.program.arrays.get(array.0 as usize).map_or(0, |plan| plan.words);
        Move { array, words: words as u8, value: from, apart }
    }

    /// Runs a lane operation with a uniform result, which is stored from word `at` on.
    fn once(&mut self, step: &LaneStep, at: u32) {
        let isa = self.isa;
        let ready = Ready::Lane(self.ready(step, (0, 0), 1));
        let run = LaneRun {
            isa,
            steps: &[ready],
            registers: std::slice::from_mut(&mut self.single),
            words: &self.words,
            cells: &[],
            indices: &[],
            arrays: &mut [],
            broadcasts: &mut self.broadcasts,
            width: 1,
            lanes: 0..1,
        };
        A::lanes(isa, run);
        let words = step.out.words as usize;
        self.words[at as usize..][..words].copy_from_slice(&self.single.words()[..words]);
    }

    /// An operation with resolved arguments.
    fn ready(&self, step: &LaneStep, out: (u32, u32), width: usize) -> ReadyLane {
        let args = step.args();
        let mut list = [ReadyArg { from: LaneInput::Words(0), words: 0, apart: 0 }; MAX_ARGS];
        let parts = step.parts;
        let mut flat = parts > 1;
        for (slot, arg) in list.iter_mut().zip(args) {
            let parted = arg.words > 1 && parts > 1;
            let from = self.from(*arg);
            let lanes = matches!(from, LaneInput::Lanes(..));
            let apart = if !parted {
                0
            } else if lanes {
                width as u32
            } else {
                1
            };
            *slot = ReadyArg { from, words: arg.words as u8, apart };
            flat &= lanes == parted;
        }
        ReadyLane { op: step.op, parts, flat, count: args.len() as u8, out, args: list }
    }

    fn from(&self, operand: Operand) -> LaneInput {
        match operand.location {
            Location::Words(at) => LaneInput::Words(at),
            Location::Lanes { component, cells: Some(cells), .. } if self.per_cell.is_one(cells.group) => {
                LaneInput::Cell(cells.reg, component)
            }
            Location::Lanes { reg, component, cells } => {
                LaneInput::Lanes(self.per_cell.register(reg, cells) as u32, component * self.width as u32)
            }
        }
    }
}
