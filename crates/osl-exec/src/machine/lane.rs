//! Lane operations: those that follow each other wait in a queue and run together.
//!
//! What all lanes share needs none of them and is computed at once, as are values of cells; the others find their
//! arguments once for a batch.

use super::{Machine, Mask, Stop};
use crate::arithmetic::{Arithmetic, Word};
use crate::lanes::{From, LaneRun, Ready, ReadyArg, ReadyLane, Spread};
use crate::program::{LaneStep, MAX_ARGS, Operand, Place, Step};
use crate::register::{LINE, Lanes};

/// Lanes of a piece: what a few registers of as many hold fits the first cache (measured, docs/performance.md).
const PIECE: usize = 256;

/// Registers of so many components each, whose pieces have places of their own in the first cache.
pub(super) fn registers<W: Word>(components: &[u32], width: usize) -> Vec<Lanes<W>> {
    // A few cache lines more, so that a store and the load of another register differ within a page, too.
    let apart = PIECE * size_of::<W>() + 5 * LINE * size_of::<u32>();
    // Where there are many, what lies between them would take more than they do.
    let few = width >= PIECE && components.len() <= 256;
    let register = |(at, words): (usize, &u32)| {
        let words = *words as usize * width;
        if few { Lanes::behind_page(words, at * apart) } else { Lanes::new(words) }
    };
    components.iter().enumerate().map(register).collect()
}

impl<A: Arithmetic> Machine<'_, A> {
    /// Runs steps, but for lane operations behind the last other step, which wait in the queue.
    pub(super) fn follow(&mut self, steps: &[Step], mask: &Mask) -> Result<(), Stop> {
        for step in steps {
            match step {
                Step::Lane(step) => self.queue(step),
                // With the profile on, each step runs by itself.
                Step::Shared { group, steps, exports } if self.profile.is_none() => {
                    self.shared(*group, steps, exports, mask)?;
                }
                _ => {
                    self.run_queue();
                    self.step(step, mask)?;
                }
            }
        }
        Ok(())
    }

    /// Has a lane operation wait for those behind it. What all lanes share is computed at once: it waits for no lane.
    pub(super) fn queue(&mut self, step: &LaneStep) {
        match step.out.place {
            Place::Words(at) => self.once(step, at),
            Place::Lanes { reg, component, cells } => {
                let reg = self.shared.register(reg, cells) as u32;
                let ready = self.ready(step, (reg, component * self.width as u32), self.width);
                self.ready.push(Ready::Lane(ready));
            }
        }
    }

    /// Has lanes take the value of their cells behind what waits.
    pub(super) fn queue_spread(&mut self, value: Operand) {
        if let Place::Lanes { reg, component, cells: Some(cells) } = value.place {
            self.ready.push(Ready::Spread(Spread {
                group: cells.group,
                from: (cells.reg, component),
                words: value.words as u8,
                out: (reg, component * self.width as u32),
            }));
        }
    }

    /// Runs what waits.
    pub(super) fn run_queue(&mut self) {
        if self.ready.is_empty() {
            return;
        }
        let isa = self.isa;
        let (cells, indices) = self.shared.tables();
        let run = LaneRun {
            isa,
            steps: &self.ready,
            registers: &mut self.registers,
            words: &self.words,
            cells,
            indices,
            spread: &mut self.spread,
            width: self.width,
            piece: PIECE,
        };
        A::lanes(isa, run);
        self.ready.clear();
    }

    /// Runs a lane operation whose result all lanes share, to words from `at` on.
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
            spread: &mut self.spread,
            width: 1,
            piece: 1,
        };
        A::lanes(isa, run);
        let words = step.out.words as usize;
        self.words[at as usize..][..words].copy_from_slice(&self.single.words()[..words]);
    }

    /// An operation with its arguments found.
    fn ready(&self, step: &LaneStep, out: (u32, u32), width: usize) -> ReadyLane {
        let args = step.args();
        let mut list = [ReadyArg { from: From::Words(0), words: 0, apart: 0 }; MAX_ARGS];
        let (mut parts, mut through) = (step.parts, 1);
        // Components lie one behind the other: where all lanes of all arguments do, or single words, one part does for all.
        let mut flat = parts > 1 && width <= PIECE;
        for (slot, arg) in list.iter_mut().zip(args) {
            let parted = arg.words > 1 && parts > 1;
            let from = self.from(*arg);
            let lanes = matches!(from, From::Lanes(..));
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
        if flat {
            (parts, through) = (1, parts);
        }
        ReadyLane { op: step.op, parts, through, count: args.len() as u8, out, args: list }
    }

    fn from(&self, operand: Operand) -> From {
        match operand.place {
            Place::Words(at) => From::Words(at),
            Place::Lanes { component, cells: Some(cells), .. } if self.shared.is_one(cells.group) => {
                From::Cell(cells.reg, component)
            }
            Place::Lanes { reg, component, cells } => {
                From::Lanes(self.shared.register(reg, cells) as u32, component * self.width as u32)
            }
        }
    }
}
