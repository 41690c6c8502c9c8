//! Plans: which operations of a sequence become code, and which are interpreted in between.

use super::{QueuedOp, Sequence, Shape, Style, cut, record};
use crate::arithmetic::ArithmeticImpl;
use crate::lanes::{Gather, LaneInput, LaneRun, Move, PIECE, Ready, ReadyLane};
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
    parts: Vec<Segment>,
}

#[derive(Debug)]
enum Segment {
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
    /// An array with elements for each lane, or of the same for all.
    Array(u32),
    /// The lanes that a region runs for.
    Mask,
    /// Uniform results of a region, each with a word for each lane.
    Results,
    /// The number of each lane.
    Numbers,
}

/// The data on which a plan works.
pub(crate) struct Files<'a, W> {
    pub(crate) registers: &'a mut [Lanes<W>],
    pub(crate) cells: &'a [Lanes<W>],
    pub(crate) indices: &'a [Lanes],
    pub(crate) words: &'a [W],
    pub(crate) arrays: &'a mut [Lanes<W>],
    pub(crate) broadcasts: &'a mut [Vec<W>; MAX_ARGS],
    /// Only for regions: the mask, the numbers of the lanes, and the uniform results.
    pub(crate) mask: &'a [u32],
    pub(crate) numbers: &'a [u32],
    pub(crate) results: &'a mut [u32],
}

impl<'f, W> Files<'f, W> {
    /// Those of a sequence of lane operations. `tables`: the registers of the cells, and the cell of each
    /// lane by group.
    pub(crate) fn new(
        (registers, arrays): (&'f mut [Lanes<W>], &'f mut [Lanes<W>]),
        (cells, indices): (&'f [Lanes<W>], &'f [Lanes]),
        words: &'f [W],
        broadcasts: &'f mut [Vec<W>; MAX_ARGS],
    ) -> Self {
        let (mask, numbers, results) = (&[][..], &[][..], &mut [][..]);
        Files { registers, arrays, cells, indices, words, broadcasts, mask, numbers, results }
    }

    /// Operations that are interpreted.
    pub(crate) fn run<'a>(
        &'a mut self,
        isa: Isa,
        steps: &'a [Ready],
        width: usize,
        lanes: Range<usize>,
    ) -> LaneRun<'a, W> {
        let Files { registers, arrays, cells, indices, words, broadcasts, .. } = self;
        LaneRun { isa, steps, registers, words, cells, indices, arrays, broadcasts, width, lanes }
    }
}

impl Plan {
    /// The plan of a sequence for batches of a shape; `None` if no part of it can be code.
    pub(super) fn new(sequence: &Sequence<'_>, shape: Shape) -> Option<Plan> {
        let is_known = |waiting: &QueuedOp| match waiting.ready {
            Ready::Lane(step) => record::is_known(step.op, shape.style),
            _ => true,
        };
        let mut parts = Vec::new();
        for part in sequence.items.chunk_by(|a, b| is_known(a) == is_known(b)) {
            if is_known(part.first()?) {
                compile(part, sequence.constant, shape, &mut parts)?;
            } else {
                parts.push(Segment::Lanes(part.iter().map(|waiting| waiting.ready).collect()));
            }
        }
        parts.iter().any(|part| matches!(part, Segment::Code { .. })).then_some(Plan { parts })
    }

    /// Bytes of its code.
    pub(super) fn bytes(&self) -> usize {
        self.parts
            .iter()
            .map(|part| match part {
                Segment::Code { code, .. } => code.size(),
                Segment::Lanes(_) => 0,
            })
            .sum()
    }

    /// Computes the first lanes of a batch, in whole pairs of vectors if the batch consists of such.
    pub(crate) fn run<A: ArithmeticImpl>(
        &self,
        isa: Isa,
        files: &mut Files<'_, A::Word>,
        (width, lanes): (usize, usize),
        scratch: &mut Scratch,
    ) {
        // A single loop processes all lanes; if several alternate, the results of one should stay in the
        // cache for the next.
        let piece = if self.parts.len() == 1 { lanes } else { PIECE };
        let (mut start, end) = (0, lanes);
        while start < end {
            let lanes = start..end.min(start + piece);
            for part in &self.parts {
                match part {
                    Segment::Code { code, arrays } => call(code, arrays, files, lanes.clone(), scratch),
                    Segment::Lanes(steps) => A::lanes(isa, files.run(isa, steps, width, lanes.clone())),
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
    let Files { registers, arrays: own, cells, indices, words, mask, numbers, results, .. } = files;
    let (mut rest, mut passed) = (&mut **registers, 0);
    let (mut own, mut own_passed) = (&mut **own, 0);
    let mut results = Some(&mut **results);
    arrays.iter().map_while(move |source| match source {
        ArraySource::Register(reg) => {
            let register = next(&mut rest, &mut passed, *reg)?;
            W::narrow_mut(register.words_mut()).map(Words::Write)
        }
        ArraySource::Array(array) => {
            let array = next(&mut own, &mut own_passed, *array)?;
            W::narrow_mut(array.words_mut()).map(Words::Write)
        }
        ArraySource::Cells(reg) => W::narrow(cells.get(*reg as usize)?.words()).map(Words::Read),
        ArraySource::Index(group) => Some(Words::Read(indices.get(usize::from(*group))?.words())),
        ArraySource::Words => W::narrow(words).map(Words::Read),
        ArraySource::Mask => Some(Words::Read(mask)),
        ArraySource::Results => results.take().map(Words::Write),
        ArraySource::Numbers => Some(Words::Read(numbers)),
    })
}

/// The register with a number, among those that are left: `passed` registers came before them.
fn next<'f, W>(rest: &mut &'f mut [Lanes<W>], passed: &mut usize, number: u32) -> Option<&'f mut Lanes<W>> {
    let (_, found) = std::mem::take(rest).split_at_mut_checked((number as usize).checked_sub(*passed)?)?;
    let (lanes, behind) = found.split_first_mut()?;
    (*rest, *passed) = (behind, number as usize + 1);
    Some(lanes)
}

/// Compiles operations that can all become code, as one loop or as several.
fn compile(run: &[QueuedOp], constant: Constants<'_>, shape: Shape, parts: &mut Vec<Segment>) -> Option<()> {
    let (whole, arrays, ends) = block(run, constant, shape)?;
    let part = |items| block(&run[items], constant, shape).map(|(block, arrays, _)| (block, arrays));
    let several = || cut::parts(run, &ends).into_iter().map(part).collect::<Option<Vec<_>>>();
    let several = if cut::is_slow(&whole) { several() } else { None };
    let several = several.filter(|parts| cut::is_faster(parts.iter().map(|part| &part.0), &whole));
    let loops = several.unwrap_or_else(|| vec![(whole, arrays)]);
    for (block, arrays) in loops {
        parts.push(Segment::Code { code: Code::for_batches(&block, shape.target, shape.width)?, arrays });
    }
    Some(())
}

/// The block of operations that can all become code, its arrays, and the number of operations up to the end
/// of each item.
pub(super) fn block(
    run: &[QueuedOp],
    constant: Constants<'_>,
    shape: Shape,
) -> Option<(Block, Vec<ArraySource>, Vec<usize>)> {
    let mut sources = BTreeSet::new();
    for waiting in run {
        let input = |from: LaneInput| match from {
            LaneInput::Lanes(reg, _) => ArraySource::Register(reg),
            LaneInput::Words(_) => ArraySource::Words,
            LaneInput::Cell(reg, _) => ArraySource::Cells(reg),
        };
        match waiting.ready {
            Ready::Lane(step) => {
                sources.insert(ArraySource::Register(step.out.0));
                sources.extend(step.args().iter().map(|arg| input(arg.from)));
            }
            Ready::Load(step) | Ready::Store(step) => {
                sources.extend([ArraySource::Array(step.array.0), input(step.value)]);
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
    let end = run.iter().map(|waiting| waiting.at).max()?;
    let mut writer = Writer::new(&sources, constant, shape);
    let mut ends = Vec::with_capacity(run.len());
    for waiting in run {
        let kept = waiting.last > end;
        match &waiting.ready {
            Ready::Lane(step) => writer.lane(step, kept)?,
            Ready::Gather(step) => writer.gather(step, kept)?,
            Ready::Load(step) => writer.load(step, kept)?,
            Ready::Store(step) => writer.store(step)?,
        }
        ends.push(writer.block.len());
    }
    Some((writer.block, sources.into_iter().collect(), ends))
}

/// The constants of the uniform file.
pub(super) type Constants<'a> = &'a dyn Fn(u32) -> Option<u32>;

// The values of the cells are a table.
const _: () = assert!(MAX_CELLS == TABLE);

/// Writes lane operations into a block over arrays.
pub(super) struct Writer<'a> {
    constant: Constants<'a>,
    pub(super) block: Block,
    arrays: FxHashMap<ArraySource, Array>,
    pub(super) width: u32,
    pub(super) style: Style,
}

impl<'a> Writer<'a> {
    pub(super) fn new(sources: &BTreeSet<ArraySource>, constant: Constants<'a>, shape: Shape) -> Self {
        let mut block = Block::new();
        let arrays = sources.iter().map(|source| (*source, block.array())).collect();
        Writer { constant, block, arrays, width: shape.width as u32, style: shape.style }
    }

    pub(super) fn array(&self, source: ArraySource) -> Option<Array> {
        self.arrays.get(&source).copied()
    }

    fn lane(&mut self, step: &ReadyLane, kept: bool) -> Option<()> {
        let shape = step.op.shape();
        let out = *self.arrays.get(&ArraySource::Register(step.out.0))?;
        let mut args = Vec::with_capacity(9);
        let parts = u32::from(step.parts);
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

    fn load(&mut self, step: &Move, kept: bool) -> Option<()> {
        let LaneInput::Lanes(reg, first) = step.value else { return None };
        let (from, to) =
            (self.array(ArraySource::Array(step.array.0))?, self.array(ArraySource::Register(reg))?);
        for component in 0..u32::from(step.words) {
            let value = self.block.lanes(from, step.array.1 + component * self.width);
            self.block.store(to, first + component * step.apart, value, kept);
        }
        Some(())
    }

    fn store(&mut self, step: &Move) -> Option<()> {
        let to = self.array(ArraySource::Array(step.array.0))?;
        for component in 0..u32::from(step.words) {
            let value = self.value(step.value.after(component * step.apart), 0)?;
            self.block.store(to, step.array.1 + component * self.width, value, true);
        }
        Some(())
    }

    /// A component of an argument.
    pub(super) fn value(&mut self, from: LaneInput, component: u32) -> Option<Value> {
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
