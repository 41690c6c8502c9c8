//! Sequences of lane operations with resolved arguments: their data, and the loop over them.
//!
//! The fast arithmetic uses the loops of the strict one for all operations that have the same bits in both.

use crate::register::Lanes;
use osl_ir::ir::{LaneOp, MAX_ARGS};
use osl_lanes::{Arg, FORMS, LaneCall, Word};
use osl_noise::cells::MAX_CELLS;
use osl_simd::Isa;
use std::ops::Range;

/// Lanes per piece: a few registers of this size fit the L1 cache (measured).
pub(crate) const PIECE: usize = 256;

/// Lane operations over all lanes of a batch, one piece of lanes after the other.
///
/// The result of an operation is still in the cache when the next one reads it, although all registers of a
/// batch together are too large for it. The order in which lanes are processed does not affect results.
pub(crate) struct LaneRun<'a, W> {
    pub(crate) isa: Isa,
    pub(crate) steps: &'a [Ready],
    pub(crate) registers: &'a mut [Lanes<W>],
    /// The uniform file.
    pub(crate) words: &'a [W],
    /// Registers with a word for each cell.
    pub(crate) cells: &'a [Lanes<W>],
    /// For each group of cells, the cell of each lane.
    pub(crate) indices: &'a [Lanes],
    /// Arrays with elements for each lane.
    pub(crate) arrays: &'a mut [Lanes<W>],
    /// Buffers to broadcast single arguments to lanes.
    pub(crate) broadcasts: &'a mut [Vec<W>; MAX_ARGS],
    /// Lanes of each component of a register.
    pub(crate) width: usize,
    /// The lanes to compute: whole pieces, except the last.
    pub(crate) lanes: Range<usize>,
}

/// An item of a sequence.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ready {
    Lane(ReadyLane),
    Gather(Gather),
    Load(Move),
    Store(Move),
}

/// Copies a value from or to an element of an array, the same for all lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Move {
    /// The array, and the first word of the element.
    pub(crate) array: (u32, u32),
    /// Number of words of the element for each lane.
    pub(crate) words: u8,
    /// Where the value is, and the distance between its components. A loaded one goes to a register.
    pub(crate) value: LaneInput,
    pub(crate) apart: u32,
}

/// Copies the values of cells to their lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gather {
    /// The group of cells.
    pub(crate) group: u16,
    /// Number of words for each lane.
    pub(crate) words: u8,
    /// The register of the cells, and the first component.
    pub(crate) from: (u32, u32),
    /// The register of the lanes, and the first word.
    pub(crate) out: (u32, u32),
}

/// A lane operation with resolved arguments.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReadyLane {
    pub(crate) op: LaneOp,
    /// Number of executions: one, or one for each component of a triple.
    pub(crate) parts: u8,
    /// Whether the components of each argument follow each other, or it is a single word: then one execution
    /// on all lanes of the batch can process the components as if they were lanes.
    pub(crate) flat: bool,
    pub(crate) count: u8,
    /// The register of its result, and the first word.
    pub(crate) out: (u32, u32),
    /// Its arguments: the first `count` of these.
    pub(crate) args: [ReadyArg; MAX_ARGS],
}

impl ReadyLane {
    /// Its arguments.
    pub(crate) fn args(&self) -> &[ReadyArg] {
        &self.args[..usize::from(self.count)]
    }
}

/// An argument, its words (per lane), and the distance in words between its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReadyArg {
    pub(crate) from: LaneInput,
    pub(crate) words: u8,
    pub(crate) apart: u32,
}

/// The location of words.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LaneInput {
    /// Lanes of a register, starting at a word.
    Lanes(u32, u32),
    /// One value for all lanes, in the uniform file.
    Words(u32),
    /// One value for all lanes, in a register of the cells.
    Cell(u32, u32),
}

impl LaneInput {
    /// The location a number of words later.
    pub(crate) fn after(self, words: u32) -> LaneInput {
        match self {
            LaneInput::Lanes(reg, word) => LaneInput::Lanes(reg, word + words),
            LaneInput::Words(at) => LaneInput::Words(at + words),
            LaneInput::Cell(reg, word) => LaneInput::Cell(reg, word + words),
        }
    }
}

impl<W: Word> LaneRun<'_, W> {
    /// Calls `run` with each piece of the lanes and, within it, with each longest part of the steps that
    /// `kind` judges alike.
    pub(crate) fn each_alike<K: PartialEq>(
        &mut self,
        kind: impl Fn(&Ready) -> K,
        mut run: impl FnMut(K, LaneRun<'_, W>),
    ) {
        let mut start = self.lanes.start;
        while start < self.lanes.end {
            let end = self.lanes.end.min(start + PIECE);
            for steps in self.steps.chunk_by(|a, b| kind(a) == kind(b)) {
                let Some(first) = steps.first() else { continue };
                let LaneRun { isa, words, cells, indices, width, .. } = *self;
                let (registers, broadcasts) = (&mut *self.registers, &mut *self.broadcasts);
                let arrays = &mut *self.arrays;
                let part = LaneRun {
                    isa,
                    steps,
                    registers,
                    words,
                    cells,
                    indices,
                    arrays,
                    broadcasts,
                    width,
                    lanes: start..end,
                };
                run(kind(first), part);
            }
            start = end;
        }
    }

    /// Calls `run` with each operation on each piece.
    #[inline(always)]
    pub(crate) fn each(self, run: impl Fn(LaneCall<'_, W>)) {
        let LaneRun { isa, steps, registers, words, cells, indices, arrays, broadcasts, width, lanes } = self;
        let (mut start, end) = (lanes.start, lanes.end);
        while start < end {
            let lanes = PIECE.min(end - start);
            for step in steps {
                let step = match step {
                    Ready::Lane(step) => step,
                    Ready::Gather(step) => {
                        step.run(isa, registers, (cells, indices), (start, lanes, width));
                        continue;
                    }
                    Ready::Load(step) => {
                        step.load(registers, arrays, (start, lanes, width));
                        continue;
                    }
                    Ready::Store(step) => {
                        let files = Files { before: registers, behind: &[], words, cells };
                        step.store(&files, arrays, (start, lanes, width));
                        continue;
                    }
                };
                let (before, rest) = registers.split_at_mut(step.out.0 as usize);
                let Some((out, behind)) = rest.split_first_mut() else { continue };
                let out = &mut out.words_mut()[step.out.1 as usize + start..];
                let files = Files { before, behind, words, cells };
                let list = step.args();
                let mut args = [Arg::Same(&[][..]); MAX_ARGS];
                let mut apart = [0; MAX_ARGS];
                for ((slot, apart), arg) in args.iter_mut().zip(&mut apart).zip(list) {
                    (*slot, *apart) = (files.find(arg.from, start), arg.apart as usize);
                }
                let parts = usize::from(step.parts);
                let (parts, n) =
                    if step.flat && lanes == width { (1, lanes * parts) } else { (parts, lanes) };
                // Without a loop for single arguments, and where all are single, they are broadcast.
                let is_single = |arg: &Arg<'_, W>| matches!(arg, Arg::Same(_));
                if !FORMS[step.op as usize] || args[..list.len()].iter().all(is_single) {
                    for (((slot, apart), room), arg) in
                        args.iter_mut().zip(&mut apart).zip(broadcasts.iter_mut()).zip(list)
                    {
                        if let Arg::Same(words) = *slot {
                            let words = &words[..usize::from(arg.words)];
                            *apart = if *apart > 0 { width } else { 0 };
                            *slot = Arg::Each(broadcast(words, room, (n, width)));
                        }
                    }
                }
                run(LaneCall { op: step.op, args, apart, out, n, stride: width, parts });
            }
            start += PIECE;
        }
    }
}

/// The data that an operation may read while its result is written: all registers except one, and everything
/// else.
struct Files<'a, W> {
    before: &'a [Lanes<W>],
    behind: &'a [Lanes<W>],
    words: &'a [W],
    cells: &'a [Lanes<W>],
}

impl<'a, W: Word> Files<'a, W> {
    /// The words of an argument, for lanes from `start` on.
    #[inline(always)]
    fn find(&self, from: LaneInput, start: usize) -> Arg<'a, W> {
        match from {
            LaneInput::Lanes(reg, first) => {
                let reg = reg as usize;
                let found = match self.before.get(reg) {
                    Some(found) => found,
                    None => &self.behind[reg - self.before.len() - 1],
                };
                Arg::Each(&found.words()[first as usize + start..])
            }
            LaneInput::Words(at) => Arg::Same(&self.words[at as usize..]),
            LaneInput::Cell(reg, first) => Arg::Same(&self.cells[reg as usize].words()[first as usize..]),
        }
    }
}

impl Gather {
    #[inline(always)]
    fn run<W: Word>(
        &self,
        isa: Isa,
        registers: &mut [Lanes<W>],
        (cells, indices): (&[Lanes<W>], &[Lanes]),
        (start, lanes, width): (usize, usize, usize),
    ) {
        let index = &indices[usize::from(self.group)].words()[start..start + lanes];
        let tables = cells[self.from.0 as usize].words().as_chunks::<MAX_CELLS>().0;
        let out = &mut registers[self.out.0 as usize].words_mut()[self.out.1 as usize..];
        let count = usize::from(self.words);
        for (table, out) in tables.iter().skip(self.from.1 as usize).take(count).zip(out.chunks_mut(width)) {
            W::look_up(isa, table, index, &mut out[start..start + lanes]);
        }
    }
}

impl Move {
    /// The lanes of the element's components.
    fn element<'a, W: Word>(
        &self,
        arrays: &'a mut [Lanes<W>],
        width: usize,
    ) -> impl Iterator<Item = &'a mut [W]> {
        let (array, first) = (self.array.0 as usize, self.array.1 as usize);
        let words = arrays.get_mut(array).map_or(&mut [][..], |array| array.words_mut());
        let words = words.get_mut(first..).unwrap_or_default();
        words.chunks_mut(width).take(usize::from(self.words))
    }

    #[inline(always)]
    fn load<W: Word>(
        &self,
        registers: &mut [Lanes<W>],
        arrays: &mut [Lanes<W>],
        (start, lanes, width): (usize, usize, usize),
    ) {
        let LaneInput::Lanes(reg, mut first) = self.value else { return };
        let out = registers[reg as usize].words_mut();
        for element in self.element(arrays, width) {
            out[first as usize + start..][..lanes].copy_from_slice(&element[start..start + lanes]);
            first += self.apart;
        }
    }

    #[inline(always)]
    fn store<W: Word>(
        &self,
        files: &Files<'_, W>,
        arrays: &mut [Lanes<W>],
        (start, lanes, width): (usize, usize, usize),
    ) {
        let mut from = self.value;
        for element in self.element(arrays, width) {
            let element = &mut element[start..start + lanes];
            match files.find(from, start) {
                Arg::Same(word) => element.fill(word[0]),
                Arg::Each(words) => element.copy_from_slice(&words[..lanes]),
            }
            from = from.after(self.apart);
        }
    }
}

/// Broadcasts single words to lane arrays: each is written for `n` lanes, `stride` words apart.
fn broadcast<'a, W: Word>(words: &[W], room: &'a mut Vec<W>, (n, stride): (usize, usize)) -> &'a [W] {
    room.resize((words.len().saturating_sub(1) * stride + n).max(room.len()), W::default());
    for (component, word) in words.iter().enumerate() {
        room[component * stride..][..n].fill(*word);
    }
    room
}
