//! Values that the points of a cell share: finding the cells of a batch, and running steps once for each cell.
//!
//! Shared values have lane registers like others, and besides a word for each cell in a file of narrow registers of the same
//! numbers. Where a batch has a single cell, all lanes read that; where it has a few, what single points read is
//! spread over the lanes; where it has many, the steps run on lanes as ever.

use super::mask::Mask;
use super::{Machine, Stop};
use crate::arithmetic::{Arithmetic, Word};
use crate::lanes::Arg;
use crate::program::{Operand, Place, Program, Steps};
use crate::register::Lanes;
use osl_noise::cells::{self, Cells, MAX_CELLS};

/// Words that tell cells apart at most.
const MAX_KEYS: usize = 16;

/// What a machine knows of cells.
pub(super) struct Shared<W> {
    /// A word for each cell; component by component, with room for [`MAX_CELLS`] of them or for one.
    narrow: Vec<Lanes<W>>,
    groups: Vec<Group>,
    /// Whether the steps of a group are running on its cells: the narrow registers are then the machine's.
    running: bool,
    scratch: Lanes,
}

/// The cells of a group in the current batch.
struct Group {
    /// How many, 0 where there are too many.
    count: usize,
    /// The cell of each lane.
    index: Lanes,
}

impl<W: Word> Shared<W> {
    pub(super) fn new(program: &Program, width: usize) -> Shared<W> {
        let any = program.groups > 0;
        let narrow = |words: &u32| Lanes::new(if any { *words as usize * MAX_CELLS } else { 0 });
        let group = |_| Group { count: 0, index: Lanes::new(width) };
        Shared {
            narrow: program.registers.iter().map(narrow).collect(),
            groups: (0..program.groups).map(group).collect(),
            running: false,
            scratch: Lanes::new(if any { width } else { 0 }),
        }
    }

    /// The words of a shared register where all lanes of the batch are in one cell.
    pub(super) fn by_all(&self, group: u16, reg: u32) -> Option<&[W]> {
        let one = !self.running && self.groups.get(usize::from(group)).is_some_and(|g| g.count == 1);
        if one { self.narrow.get(reg as usize).map(Lanes::words) } else { None }
    }
}

/// Room for each component of a narrow register.
fn room(count: usize) -> usize {
    if count == 1 { 1 } else { MAX_CELLS }
}

impl<A: Arithmetic> Machine<'_, A> {
    /// Finds the cells of a group and gives them their roots.
    pub(super) fn find_cells(&mut self, group: u16, roots: &[Operand], outs: &[Operand], mask: &Mask) {
        let mut index = std::mem::take(&mut self.shared.groups[usize::from(group)].index);
        let mut scratch = std::mem::take(&mut self.shared.scratch);
        let cells = self.cells(roots, index.words_mut(), scratch.words_mut(), mask);
        self.shared.scratch = scratch;
        self.shared.groups[usize::from(group)].index = index;
        self.shared.groups[usize::from(group)].count = 0;
        let Some(cells) = cells else {
            let all = Mask::all(self.width);
            roots.iter().zip(outs).for_each(|(root, out)| self.copy(*root, *out, &all));
            return;
        };
        let room = room(cells.count);
        for (root, out) in roots.iter().zip(outs) {
            let Place::Lanes { reg, .. } = out.place else { continue };
            let mut narrow = std::mem::take(&mut self.shared.narrow[reg as usize]);
            for (component, words) in
                narrow.words_mut().chunks_mut(room).enumerate().take(root.words as usize)
            {
                let part = self.part(*root, component);
                for (word, lane) in words.iter_mut().zip(cells.lanes) {
                    *word = self.word(part, lane);
                }
            }
            self.shared.narrow[reg as usize] = narrow;
        }
        self.shared.groups[usize::from(group)].count = cells.count;
    }

    /// Gives each lane the roots that single points read, where the batch has a few cells.
    pub(super) fn export_roots(
        &mut self,
        group: u16,
        roots: &[Operand],
        outs: &[Operand],
        exports: &[usize],
    ) {
        if self.shared.groups[usize::from(group)].count > 1 {
            let all = Mask::all(self.width);
            for (root, out) in exports.iter().filter_map(|at| Some((roots.get(*at)?, outs.get(*at)?))) {
                self.copy(*root, *out, &all);
            }
        }
    }

    fn cells(&self, roots: &[Operand], index: &mut [u32], scratch: &mut [u32], mask: &Mask) -> Option<Cells> {
        let mut keys: [&[u32]; MAX_KEYS] = [&[]; MAX_KEYS];
        let mut count = 0;
        for root in roots {
            for component in 0..root.words as usize {
                if let Arg::Each(lanes) = self.component(*root, component) {
                    *keys.get_mut(count)? = A::Word::narrow(lanes)?;
                    count += 1;
                }
            }
        }
        index.fill(0);
        mask.fill(index, u32::MAX);
        cells::find(self.isa, &keys[..count], index, scratch)
    }

    /// Runs the steps of a group: once for each cell, or on all lanes where there are many cells.
    pub(super) fn shared(
        &mut self,
        group: u16,
        steps: &Steps,
        exports: &[Operand],
        mask: &Mask,
    ) -> Result<(), Stop> {
        let count = self.shared.groups[usize::from(group)].count;
        if count == 0 || self.shared.running {
            return self.steps(steps, mask);
        }
        let (width, room) = (self.width, room(count));
        std::mem::swap(&mut self.registers, &mut self.shared.narrow);
        (self.width, self.shared.running) = (room, true);
        let result = self.steps(steps, &Mask::all(room));
        (self.width, self.shared.running) = (width, false);
        std::mem::swap(&mut self.registers, &mut self.shared.narrow);
        if count > 1 {
            exports.iter().for_each(|export| self.spread_cells(group, *export));
        }
        result
    }

    /// Gives each lane the value of its cell.
    fn spread_cells(&mut self, group: u16, value: Operand) {
        let Place::Lanes { reg, component, .. } = value.place else { return };
        let index = self.shared.groups[usize::from(group)].index.words();
        let lanes = self.registers[reg as usize].words_mut().chunks_mut(self.width);
        let words = self.shared.narrow[reg as usize].words().as_chunks::<MAX_CELLS>().0;
        let parts = component as usize..(component + value.words) as usize;
        for (to, table) in lanes.zip(words).skip(parts.start).take(parts.len()) {
            A::Word::look_up(self.isa, table, index, to);
        }
    }
}
