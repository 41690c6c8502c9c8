//! Values that the points of a cell share: finds the cells of a batch, and runs steps once for each cell.
//!
//! Values per cell have lane registers like others, and in addition a word for each cell in a file of narrow
//! registers with the same numbers. If a batch has a single cell, all lanes read that. If it has a few, the
//! values that single points read are copied to the lanes. If it has many, the steps run on lanes as usual.
//!
//! Neighbouring batches are mostly in the same cells, whose values are then still in their narrow registers.

use super::Machine;
use super::lane::Queue;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::program::Program;
use crate::register::Lanes;
use crate::step::{CellInputs, CellLocation, Export, Location, Operand, Steps};
use osl_lanes::{Arg, Word};
use osl_noise::cells::{self, Cells, MAX_CELLS};

/// Maximum number of words that identify a cell.
const MAX_KEYS: usize = 16;

/// The state of a machine for cells.
pub(super) struct PerCell<'a, W> {
    /// A word for each cell, component by component, with room for [`MAX_CELLS`] cells or for one.
    narrow: Vec<Lanes<W>>,
    /// For each group, the number of its cells in the batch, 0 if there are too many; and the cell of each
    /// lane.
    counts: Vec<usize>,
    indices: Vec<Lanes>,
    /// Whether the steps of a group are running on its cells: the machine then uses the narrow registers.
    running: bool,
    /// Queued lane operations on cells while none are running; on lanes while some are.
    queue: Queue<'a>,
    scratch: Lanes,
    /// For each group, the cells whose values the narrow registers have.
    present: Vec<Present<W>>,
    /// The words of the roots of the batch.
    found: Vec<W>,
    /// For each step on cells, when it ran last.
    ran: Vec<Ran<W>>,
}

/// The cells of a group whose values are in narrow registers.
#[derive(Clone, Debug, Default)]
struct Present<W> {
    /// Number of cells, and the words of their roots.
    count: usize,
    roots: Vec<W>,
    /// Increased by any change of what the values of cells depend on.
    version: u64,
}

/// The version of its group for which a step on cells ran last, and the words of its inputs.
#[derive(Clone, Debug, Default)]
struct Ran<W> {
    version: u64,
    words: Vec<W>,
}

impl<W: Word> PerCell<'_, W> {
    pub(super) fn new(program: &Program, width: usize) -> Self {
        PerCell {
            narrow: program.cells.iter().map(|words| Lanes::new(*words as usize * MAX_CELLS)).collect(),
            counts: vec![0; program.groups],
            indices: (0..program.groups).map(|_| Lanes::new(width)).collect(),
            running: false,
            queue: Queue::default(),
            scratch: Lanes::new(if program.groups > 0 { width } else { 0 }),
            present: vec![Present::default(); program.groups],
            found: Vec::new(),
            ran: Vec::new(),
        }
    }

    /// Whether the values of a step on cells are still there; `words` is the uniform file. If not, the step
    /// counts as run.
    fn is_present(&mut self, group: u16, inputs: &CellInputs, words: &[W]) -> bool {
        let number = inputs.number as usize;
        if self.ran.len() <= number {
            self.ran.resize(number + 1, Ran::default());
        }
        let (Some(present), Some(ran)) = (self.present.get_mut(usize::from(group)), self.ran.get_mut(number))
        else {
            return false;
        };
        let now = || inputs.words.iter().map(|at| words.get(*at as usize).copied().unwrap_or_default());
        let is_same = ran.words.len() == inputs.words.len() && ran.words.iter().copied().eq(now());
        if is_same && ran.version == present.version {
            return true;
        }
        if ran.version == present.version {
            // What read the former values has to run again.
            present.version += 1;
        }
        ran.version = present.version;
        ran.words.clear();
        ran.words.extend(now());
        false
    }

    /// Clears the queue, since a batch may have ended early.
    pub(super) fn clear(&mut self) {
        self.queue.clear();
    }

    /// The words of a value per cell, if all lanes of the batch are in one cell.
    pub(super) fn by_all(&self, cells: CellLocation) -> Option<&[W]> {
        if self.is_one(cells.group) { self.narrow.get(cells.reg as usize).map(Lanes::words) } else { None }
    }

    /// Whether all lanes of the batch are in one cell of a group, whose words the steps read.
    pub(super) fn is_one(&self, group: u16) -> bool {
        !self.running && self.counts.get(usize::from(group)) == Some(&1)
    }

    /// The current register of a value: of lanes, or of cells while these are running.
    pub(super) fn register(&self, reg: u32, cells: Option<CellLocation>) -> usize {
        match cells {
            Some(cells) if self.running => cells.reg as usize,
            _ => reg as usize,
        }
    }

    /// Whether steps are running on cells.
    pub(super) fn is_running(&self) -> bool {
        self.running
    }

    /// The registers with a word for each cell, and the cell of each lane by group.
    pub(super) fn tables(&self) -> (&[Lanes<W>], &[Lanes]) {
        (&self.narrow, &self.indices)
    }
}

/// Room for each component of a narrow register.
fn room(count: usize) -> usize {
    if count == 1 { 1 } else { MAX_CELLS }
}

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// Finds the cells of a group and computes their roots.
    pub(super) fn find_cells(&mut self, group: u16, roots: &[Operand], outs: &[Operand], mask: &Mask) {
        let at = usize::from(group);
        let mut index = std::mem::take(&mut self.per_cell.indices[at]);
        let mut scratch = std::mem::take(&mut self.per_cell.scratch);
        let cells = self.cells(roots, index.words_mut(), scratch.words_mut(), mask);
        self.per_cell.scratch = scratch;
        self.per_cell.indices[at] = index;
        self.per_cell.counts[at] = 0;
        let Some(cells) = cells else {
            let all = Mask::all(self.width);
            roots.iter().zip(outs).for_each(|(root, out)| self.copy(*root, *out, &all));
            return;
        };
        let room = room(cells.count);
        let mut found = std::mem::take(&mut self.per_cell.found);
        found.clear();
        for (root, out) in roots.iter().zip(outs) {
            let Location::Lanes { cells: Some(location), .. } = out.location else { continue };
            let mut narrow = std::mem::take(&mut self.per_cell.narrow[location.reg as usize]);
            for (component, words) in
                narrow.words_mut().chunks_mut(room).enumerate().take(root.words as usize)
            {
                let part = self.part(*root, component);
                for (word, lane) in words.iter_mut().zip(cells.lanes) {
                    *word = self.word(part, lane);
                }
                found.extend_from_slice(words);
            }
            self.per_cell.narrow[location.reg as usize] = narrow;
        }
        self.per_cell.counts[at] = cells.count;
        let present = &mut self.per_cell.present[at];
        if (present.count, &present.roots) != (cells.count, &found) {
            present.count = cells.count;
            present.version += 1;
            std::mem::swap(&mut present.roots, &mut found);
        }
        self.per_cell.found = found;
    }

    /// Gives each lane the roots that single points read, if the batch has a few cells.
    pub(super) fn export_roots(
        &mut self,
        group: u16,
        roots: &[Operand],
        outs: &[Operand],
        exports: &[usize],
    ) {
        if self.per_cell.counts[usize::from(group)] > 1 {
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
        mask.fill(self.isa, index, u32::MAX);
        cells::find(self.isa, &keys[..count], index, scratch)
    }

    /// Runs the steps of a group: once for each cell, unless their values are still there, and queues the
    /// copying of cell values to lanes; or on all lanes if there are many cells. Queued lane operations are
    /// not affected: they read values of cells that are not written again.
    pub(super) fn per_cell(
        &mut self,
        group: u16,
        steps: &'a Steps,
        (exports, inputs): (&'a [Export], Option<&CellInputs>),
        mask: &Mask,
    ) -> Result<(), RunError> {
        let count = self.per_cell.counts[usize::from(group)];
        if count == 0 || self.per_cell.running {
            if self.profile.is_some() {
                return self.steps(steps, mask);
            }
            self.spend(steps.weight, mask);
            return self.follow(&steps.list, mask);
        }
        let (all, room) = ((self.width, self.lanes), room(count));
        // A profile shows what the steps take.
        let is_present = self.profile.is_none()
            && inputs.is_some_and(|inputs| self.per_cell.is_present(group, inputs, &self.words));
        self.turn((room, room));
        let result = if is_present {
            self.spend(steps.weight, &Mask::all(room));
            Ok(())
        } else {
            self.steps(steps, &Mask::all(room))
        };
        self.turn(all);
        if result.is_err() {
            // Some values are missing, also if the same points are run again.
            self.per_cell.present[usize::from(group)].version += 1;
        }
        if count > 1 {
            exports.iter().for_each(|export| self.queue_gather(export));
        }
        result
    }

    /// Switches from lanes to cells, and back.
    fn turn(&mut self, widths: (usize, usize)) {
        std::mem::swap(&mut self.registers, &mut self.per_cell.narrow);
        std::mem::swap(&mut self.queue, &mut self.per_cell.queue);
        (self.width, self.lanes) = widths;
        self.per_cell.running = !self.per_cell.running;
    }
}
