//! Plans: which operations of a sequence become code, and which are interpreted in between.

use super::{Sequence, Shape, Style, Waiting, record};
use crate::arithmetic::ArithmeticImpl;
use crate::lanes::{Gather, LaneInput, LaneRun, PIECE, Ready, ReadyLane};
use crate::register::Lanes;
use osl_ir::ir::MAX_ARGS;
use osl_lanes::Word;
use osl_native::{Array, Block, Code, Scratch, TABLE, Value, Words};
use osl_noise::cells::MAX_CELLS;
use osl_simd::Isa;
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
    Code { code: Code, arrays: Vec<ArraySource> },
    Lanes(Vec<Ready>),
}

/// An array used by the code. Registers come first, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum ArraySource {
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
    pub(crate) broadcasts: &'a mut [Vec<W>; MAX_ARGS],
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
        let Files { registers, cells, indices, words, broadcasts } = self;
        LaneRun { isa, steps, registers, words, cells, indices, broadcasts, width, lanes }
    }
}

impl Plan {
    /// The plan of a sequence for batches of a shape; `None` if no part of it can be code.
    pub(super) fn new(sequence: &Sequence<'_>, shape: Shape) -> Option<Plan> {
        let is_known = |waiting: &Waiting| match waiting.ready {
            Ready::Lane(step) => record::is_known(step.op, shape.style),
            Ready::Gather(_) => true,
        };
        let mut parts = Vec::new();
        for part in sequence.items.chunk_by(|a, b| is_known(a) == is_known(b)) {
            if is_known(part.first()?) {
                parts.push(compile(part, sequence.constant, shape)?);
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
    pub(crate) fn run<A: ArithmeticImpl>(
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
    arrays: &[ArraySource],
    files: &mut Files<'_, W>,
    lanes: Range<usize>,
    scratch: &mut Scratch,
) {
    let suited = code.run(lend(arrays, files), lanes, scratch);
    debug_assert!(suited, "the arrays of a run are those that it was compiled for");
}

/// The arrays, as code takes them.
pub(super) fn lend<'f, W: Word>(
    arrays: &'f [ArraySource],
    files: &'f mut Files<'_, W>,
) -> impl Iterator<Item = Words<'f>> {
    let Files { registers, cells, indices, words, .. } = files;
    let (mut rest, mut passed) = (&mut **registers, 0);
    arrays.iter().map_while(move |source| match source {
        ArraySource::Register(reg) => {
            let (_, found) = std::mem::take(&mut rest).split_at_mut_checked(*reg as usize - passed)?;
            let (register, behind) = found.split_first_mut()?;
            (rest, passed) = (behind, *reg as usize + 1);
            W::narrow_mut(register.words_mut()).map(Words::Write)
        }
        ArraySource::Cells(reg) => W::narrow(cells.get(*reg as usize)?.words()).map(Words::Read),
        ArraySource::Index(group) => Some(Words::Read(indices.get(usize::from(*group))?.words())),
        ArraySource::Words => W::narrow(words).map(Words::Read),
    })
}

/// Compiles operations that can all become code.
fn compile(run: &[Waiting], constant: Constants<'_>, shape: Shape) -> Option<Part> {
    let (block, arrays) = block(run, constant, shape)?;
    Some(Part::Code { code: Code::new(&block, shape.target)?, arrays })
}

/// The block of operations that can all become code, and its arrays.
pub(super) fn block(
    run: &[Waiting],
    constant: Constants<'_>,
    shape: Shape,
) -> Option<(Block, Vec<ArraySource>)> {
    let mut sources = BTreeSet::new();
    for waiting in run {
        match waiting.ready {
            Ready::Lane(step) => {
                sources.insert(ArraySource::Register(step.out.0));
                sources.extend(step.args().iter().map(|arg| match arg.from {
                    LaneInput::Lanes(reg, _) => ArraySource::Register(reg),
                    LaneInput::Words(_) => ArraySource::Words,
                    LaneInput::Cell(reg, _) => ArraySource::Cells(reg),
                }));
            }
            Ready::Gather(step) => {
                sources.extend([
                    ArraySource::Register(step.out.0),
                    ArraySource::Cells(step.from.0),
                    ArraySource::Index(step.group),
                ]);
            }
        }
    }
    let mut block = Block::new();
    let arrays: FxHashMap<ArraySource, Array> =
        sources.iter().map(|source| (*source, block.array())).collect();
    let end = run.iter().map(|waiting| waiting.at).max()?;
    let mut writer = Writer { constant, block, arrays, width: shape.width as u32, style: shape.style };
    for waiting in run {
        let kept = waiting.last > end;
        match &waiting.ready {
            Ready::Lane(step) => writer.lane(step, kept)?,
            Ready::Gather(step) => writer.gather(step, kept)?,
        }
    }
    Some((writer.block, sources.into_iter().collect()))
}

/// The constants of the uniform file.
type Constants<'a> = &'a dyn Fn(u32) -> Option<u32>;

// The values of the cells are a table.
const _: () = assert!(MAX_CELLS == TABLE);

struct Writer<'a> {
    constant: Constants<'a>,
    block: Block,
    arrays: FxHashMap<ArraySource, Array>,
    width: u32,
    style: Style,
}

impl Writer<'_> {
    fn lane(&mut self, step: &ReadyLane, kept: bool) -> Option<()> {
        let shape = step.op.shape();
        let out = *self.arrays.get(&ArraySource::Register(step.out.0))?;
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
            let result = record::operation(&mut self.block, step.op, &args, self.style)?;
            for (component, value) in result.iter().enumerate() {
                let word = step.out.1 + (part + component as u32) * self.width;
                self.block.store(out, word, *value, kept);
            }
        }
        Some(())
    }

    fn gather(&mut self, step: &Gather, kept: bool) -> Option<()> {
        let index = self.block.lanes(*self.arrays.get(&ArraySource::Index(step.group))?, 0);
        let table = *self.arrays.get(&ArraySource::Cells(step.from.0))?;
        let out = *self.arrays.get(&ArraySource::Register(step.out.0))?;
        for component in 0..u32::from(step.words) {
            let value = self.block.look_up(table, (step.from.1 + component) * TABLE as u32, index);
            self.block.store(out, step.out.1 + component * self.width, value, kept);
        }
        Some(())
    }

    /// A component of an argument.
    fn value(&mut self, from: LaneInput, component: u32) -> Option<Value> {
        Some(match from {
            LaneInput::Lanes(reg, word) => {
                let array = *self.arrays.get(&ArraySource::Register(reg))?;
                self.block.lanes(array, word + component * self.width)
            }
            LaneInput::Words(at) => match (self.constant)(at + component) {
                Some(bits) => self.block.bits(bits),
                None => self.block.word(*self.arrays.get(&ArraySource::Words)?, at + component),
            },
            LaneInput::Cell(reg, word) => {
                self.block.word(*self.arrays.get(&ArraySource::Cells(reg))?, word + component)
            }
        })
    }
}
