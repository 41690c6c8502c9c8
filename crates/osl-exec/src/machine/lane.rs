//! Lane operations: over all lanes, or, where several follow each other, over one piece of the lanes after the other.
//!
//! What an operation writes is still next to the processor when the next one reads it, though a batch's registers
//! together are far from it. Which lanes are done when makes no difference to any.

use super::{Machine, Mask, Stop};
use crate::arithmetic::{Arithmetic, Word};
use crate::lanes::{Arg, LaneCall};
use crate::program::{LaneStep, MAX_ARGS, Place, Step};
use std::ops::Range;

/// Lanes of a piece: fewer cost more calls than they save (measured, docs/performance.md).
const PIECE: usize = 512;

impl<A: Arithmetic> Machine<'_, A> {
    /// Runs steps, lane operations that follow each other piece by piece.
    pub(super) fn in_pieces(&mut self, steps: &[Step], mask: &Mask) -> Result<(), Stop> {
        if self.width <= PIECE {
            return steps.iter().try_for_each(|step| self.step(step, mask));
        }
        let mut rest = steps;
        while let [step, behind @ ..] = rest {
            let count = rest.iter().take_while(|step| matches!(step, Step::Lane(_))).count();
            if count < 2 {
                self.step(step, mask)?;
                rest = behind;
                continue;
            }
            let (here, behind) = rest.split_at(count);
            for start in (0..self.width).step_by(PIECE) {
                let piece = start..self.width.min(start + PIECE);
                for step in here {
                    if let Step::Lane(step) = step {
                        self.lane(step, piece.clone());
                    }
                }
            }
            rest = behind;
        }
        Ok(())
    }

    /// Runs a lane operation over some lanes; where its result is shared, with the first of them.
    pub(super) fn lane(&mut self, step: &LaneStep, piece: Range<usize>) {
        let (out, width) = (step.out, self.width);
        let words = out.words as usize;
        let mut spread = std::mem::take(&mut self.spread);
        match out.place {
            Place::Words(_) if piece.start > 0 => {}
            Place::Words(at) => {
                let mut few = [A::Word::default(); 16];
                self.lane_into(step, &mut few[..words], 0..1, 1, &mut spread);
                self.words[at as usize..][..words].copy_from_slice(&few[..words]);
            }
            Place::Lanes { reg, component, .. } => {
                let mut lanes = std::mem::take(&mut self.registers[reg as usize]);
                let to = &mut lanes.words_mut()[component as usize * width..][..words * width];
                self.lane_into(step, &mut to[piece.start..], piece, width, &mut spread);
                self.registers[reg as usize] = lanes;
            }
        }
        self.spread = spread;
    }

    /// Runs a lane operation over some lanes of each component; those of `out` lie `stride` words apart.
    #[inline(always)]
    fn lane_into(
        &self,
        step: &LaneStep,
        out: &mut [A::Word],
        piece: Range<usize>,
        stride: usize,
        spread: &mut [Vec<A::Word>; MAX_ARGS],
    ) {
        let args = step.args();
        let mut list: [(Arg<'_, A::Word>, usize); MAX_ARGS] = [(Arg::Same(&[]), 0); MAX_ARGS];
        let mut parts = usize::from(step.parts);
        let mut n = piece.len();
        // Components lie one behind the other: where all lanes of all arguments do, or single words, one part does for all.
        let mut flat = parts > 1 && n == stride;
        for (slot, arg) in list.iter_mut().zip(args) {
            let apart = if arg.words > 1 && parts > 1 { stride } else { 0 };
            *slot = match self.arg(*arg) {
                Arg::Each(lanes) => (Arg::Each(&lanes[piece.start..]), apart),
                Arg::Same(words) if n == 1 && apart > 0 => (Arg::Each(words), 1),
                Arg::Same(words) => (Arg::Same(words), apart.min(1)),
            };
            flat &= matches!((&slot.0, arg.words), (Arg::Same(_), 1) | (Arg::Each(_), 3));
        }
        if flat {
            (n, parts) = (n * parts, 1);
        }
        if !A::Word::FORMS {
            for (slot, room) in list.iter_mut().zip(spread) {
                *slot = spread_over(*slot, room, (n, stride, parts));
            }
        }
        let call = LaneCall { op: step.op, args: &list[..args.len()], out, n, stride, parts };
        A::lanes(self.isa, call);
    }
}

/// An argument as lane arrays: what is single is written for each of `n` lanes, its components `stride` apart.
fn spread_over<'a, W: Word>(
    (arg, apart): (Arg<'a, W>, usize),
    room: &'a mut Vec<W>,
    (n, stride, parts): (usize, usize, usize),
) -> (Arg<'a, W>, usize) {
    let Arg::Same(words) = arg else { return (arg, apart) };
    if n == 1 && stride == 1 {
        return (Arg::Each(words), apart);
    }
    let count = words.len();
    room.resize(((count.max(1) - 1) * stride + n).max(room.len()), W::default());
    for (component, word) in words.iter().enumerate() {
        room[component * stride..][..n].fill(*word);
    }
    (Arg::Each(room), if parts > 1 && apart > 0 { stride } else { 0 })
}
