//! Plans: which operations of a sequence become code, and which are interpreted in between.

use super::{Shape, Style, Waiting, operation};
use crate::arithmetic::{Arithmetic, Word};
use crate::lanes::{From, LaneRun, PIECE, Ready, ReadyLane, Spread};
use crate::register::Lanes;
use osl_ir::ir::MAX_ARGS;
use osl_native::{Array, Block, Code, Scratch, Value, Words};
use osl_noise::Isa;
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;
use std::ops::Range;

/// How a sequence is executed.
#[derive(Debug)]
pub(crate) struct Plan {
    parts: Vec<Part>,
}

#[derive(Debug)]
enum Part {
    Code { code: Code, arrays: Vec<Place> },
    Lanes(Vec<Ready>),
}

/// An array used by the code. Registers come first, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum Place {
    Register(u32),
    /// A register of the cells.
    Cells(u32),
    /// The cells of the lanes of a group.
    Index(u16),
    /// The uniform file.
    Words,
}

/// The data on which a plan works.
pub(crate) struct Files<'a, W> {
    pub(crate) registers: &'a mut [Lanes<W>],
    pub(crate) cells: &'a [Lanes<W>],
    pub(crate) indices: &'a [Lanes],
    pub(crate) words: &'a [W],
    pub(crate) spread: &'a mut [Vec<W>; MAX_ARGS],
}

impl<W> Files<'_, W> {
    /// Operations that are interpreted.
    pub(crate) fn run<'a>(
        &'a mut self,
        isa: Isa,
        steps: &'a [Ready],
        width: usize,
        lanes: Range<usize>,
    ) -> LaneRun<'a, W> {
        let Files { registers, cells, indices, words, spread } = self;
        LaneRun { isa, steps, registers, words, cells, indices, spread, width, lanes }
    }
}

impl Plan {
    /// The plan of a sequence for batches of a shape; `None` if no part of it can be code.
    pub(super) fn new(run: &[Waiting], shape: Shape) -> Option<Plan> {
        let is_known = |waiting: &Waiting| match waiting.ready {
            Ready::Lane(step) => operation::is_known(step.op, shape.1),
            Ready::Spread(_) => true,
        };
        let mut parts = Vec::new();
        for part in run.chunk_by(|a, b| is_known(a) == is_known(b)) {
            if is_known(part.first()?) {
                parts.push(compile(part, shape)?);
            } else {
                parts.push(Part::Lanes(part.iter().map(|waiting| waiting.ready).collect()));
            }
        }
        parts.iter().any(|part| matches!(part, Part::Code { .. })).then_some(Plan { parts })
    }

    /// Bytes of its code.
    pub(super) fn bytes(&self) -> usize {
        self.parts
            .iter()
            .map(|part| match part {
                Part::Code { code, .. } => code.size(),
                Part::Lanes(_) => 0,
            })
            .sum()
    }

    /// Computes a batch.
    pub(crate) fn run<A: Arithmetic>(
        &self,
        isa: Isa,
        files: &mut Files<'_, A::Word>,
        width: usize,
        scratch: &mut Scratch,
    ) {
        // A single loop processes all lanes; if several alternate, the results of one should stay in the
        // cache for the next.
        let piece = if self.parts.len() == 1 { width } else { PIECE };
        let mut start = 0;
        while start < width {
            let lanes = start..width.min(start + piece);
            for part in &self.parts {
                match part {
                    Part::Code { code, arrays } => call(code, arrays, files, lanes.clone(), scratch),
                    Part::Lanes(steps) => A::lanes(isa, files.run(isa, steps, width, lanes.clone())),
                }
            }
            start = lanes.end;
        }
    }
}

/// Calls code on its arrays.
fn call<W: Word>(
    code: &Code,
    arrays: &[Place],
    files: &mut Files<'_, W>,
    lanes: Range<usize>,
    scratch: &mut Scratch,
) {
    let Files { registers, cells, indices, words, .. } = files;
    let (mut rest, mut passed) = (&mut **registers, 0);
    let arrays = arrays.iter().map_while(|place| match place {
        Place::Register(reg) => {
            let (_, found) = std::mem::take(&mut rest).split_at_mut_checked(*reg as usize - passed)?;
            let (register, behind) = found.split_first_mut()?;
            (rest, passed) = (behind, *reg as usize + 1);
            W::narrow_mut(register.words_mut()).map(Words::Write)
        }
        Place::Cells(reg) => W::narrow(cells.get(*reg as usize)?.words()).map(Words::Read),
        Place::Index(group) => Some(Words::Read(indices.get(usize::from(*group))?.words())),
        Place::Words => W::narrow(words).map(Words::Read),
    });
    let suited = code.run(arrays, lanes, scratch);
    debug_assert!(suited, "the arrays of a run are those that it was compiled for");
}

/// Compiles operations that can all become code.
fn compile(run: &[Waiting], (width, style): Shape) -> Option<Part> {
    let mut places = BTreeSet::new();
    for waiting in run {
        match waiting.ready {
            Ready::Lane(step) => {
                places.insert(Place::Register(step.out.0));
                places.extend(step.args().iter().map(|arg| match arg.from {
                    From::Lanes(reg, _) => Place::Register(reg),
                    From::Words(_) => Place::Words,
                    From::Cell(reg, _) => Place::Cells(reg),
                }));
            }
            Ready::Spread(step) => {
                places.extend([
                    Place::Register(step.out.0),
                    Place::Cells(step.from.0),
                    Place::Index(step.group),
                ]);
            }
        }
    }
    let mut block = Block::new();
    let arrays: FxHashMap<Place, Array> = places.iter().map(|place| (*place, block.array())).collect();
    let end = run.iter().map(|waiting| waiting.at).max()?;
    let mut writer = Writer { block, arrays, width: width as u32, style };
    for waiting in run {
        let kept = waiting.last > end;
        match &waiting.ready {
            Ready::Lane(step) => writer.lane(step, kept)?,
            Ready::Spread(step) => writer.spread(step, kept)?,
        }
    }
    let code = Code::new(&writer.block)?;
    Some(Part::Code { code, arrays: places.into_iter().collect() })
}

struct Writer {
    block: Block,
    arrays: FxHashMap<Place, Array>,
    width: u32,
    style: Style,
}

impl Writer {
    fn lane(&mut self, step: &ReadyLane, kept: bool) -> Option<()> {
        let shape = step.op.shape();
        let out = *self.arrays.get(&Place::Register(step.out.0))?;
        let mut args = Vec::with_capacity(9);
        let parts = u32::from(step.parts) * u32::from(step.through);
        for part in 0..parts {
            args.clear();
            for (arg, kind) in step.args().iter().zip(shape.args) {
                let parted = parts > 1 && arg.words > 1;
                for component in 0..if parted { 1 } else { kind.words() } {
                    args.push(self.value(arg.from, component + if parted { part } else { 0 })?);
                }
            }
            let result = operation::operation(&mut self.block, step.op, &args, self.style)?;
            for (component, value) in result.list().iter().enumerate() {
                let word = step.out.1 + (part + component as u32) * self.width;
                self.block.store(out, word, *value, kept);
            }
        }
        Some(())
    }

    fn spread(&mut self, step: &Spread, kept: bool) -> Option<()> {
        let index = self.block.lanes(*self.arrays.get(&Place::Index(step.group))?, 0);
        let table = *self.arrays.get(&Place::Cells(step.from.0))?;
        let out = *self.arrays.get(&Place::Register(step.out.0))?;
        for component in 0..u32::from(step.words) {
            let value = self.block.look_up(table, (step.from.1 + component) * 16, index);
            self.block.store(out, step.out.1 + component * self.width, value, kept);
        }
        Some(())
    }

    /// A component of an argument.
    fn value(&mut self, from: From, component: u32) -> Option<Value> {
        Some(match from {
            From::Lanes(reg, word) => {
                let array = *self.arrays.get(&Place::Register(reg))?;
                self.block.lanes(array, word + component * self.width)
            }
            From::Words(at) => self.block.word(*self.arrays.get(&Place::Words)?, at + component),
            From::Cell(reg, word) => self.block.word(*self.arrays.get(&Place::Cells(reg))?, word + component),
        })
    }
}
