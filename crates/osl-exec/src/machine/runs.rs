//! Runs: neighbouring lanes whose arguments have the same words, for steps that compute a result only once
//! for all of them.
//!
//! Neighbouring points mostly have the same texts, because a shader chooses between a few. The words of
//! arguments are compared for whole vectors of lanes.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::step::{Location, Operand};
use osl_ir::ir::Kind;
use osl_lanes::{Arg, Word};
use osl_simd::Kernel;
use std::ops::Range;

/// Lanes that are looked at together for the end of a run.
const TOGETHER: usize = 16;

/// Neighbouring lanes with the same arguments. At least one of them is active.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Run {
    /// All of its lanes, active or not.
    pub(super) lanes: Range<usize>,
    /// The first active lane.
    pub(super) first: usize,
    /// Number of active lanes.
    pub(super) active: u64,
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The runs of a step with these arguments. If the results are uniform, there is only one run, with one
    /// active lane. Closures have numbers of their own in each lane, so each lane is a run.
    pub(super) fn runs(&self, args: &[Operand], outs: &[Operand], mask: &Mask) -> Vec<Run> {
        if super::report::are_uniform(outs) {
            let first = mask.first().filter(|first| *first < self.points);
            return first
                .map(|first| Run { lanes: first..first + 1, first, active: 1 })
                .into_iter()
                .collect();
        }
        let mut changes = vec![0; self.points.min(self.width)];
        if args.iter().any(|arg| arg.kind == Kind::Closure) {
            changes.fill(1);
        }
        for (arg, component) in args.iter().flat_map(|arg| (0..arg.words as usize).map(move |c| (arg, c))) {
            if let Arg::Each(words) = self.arg(self.part(*arg, component)) {
                self.isa.dispatch(Changes { words, changes: &mut changes });
            }
        }
        split(&changes, mask)
    }

    /// Gives the lanes of a run one result, of one word.
    pub(super) fn set_run(&mut self, out: Operand, lanes: Range<usize>, word: A::Word) {
        match out.location {
            Location::Words(at) => self.words[at as usize] = word,
            Location::Lanes { reg, component, cells } => {
                let start = component as usize * self.width;
                let words = self.registers[self.per_cell.register(reg, cells)].words_mut();
                words[start + lanes.start..start + lanes.end].fill(word);
            }
        }
    }
}

/// The runs between lanes with changes.
fn split(changes: &[u32], mask: &Mask) -> Vec<Run> {
    let bits = match mask {
        Mask::None => return Vec::new(),
        Mask::All(_) => None,
        Mask::Some(bits) => Some(&bits[..]),
    };
    let mut runs = Vec::new();
    let mut start = 0;
    while start < changes.len() {
        let end = start + 1 + unchanged(&changes[start + 1..]);
        let (first, active) = match bits {
            None => (Some(start), end - start),
            Some(bits) => {
                let bits = bits.get(start..end).unwrap_or_default();
                let first = bits.iter().position(|b| *b != 0).map(|at| start + at);
                (first, bits.iter().filter(|b| **b != 0).count())
            }
        };
        if let Some(first) = first {
            runs.push(Run { lanes: start..end, first, active: active as u64 });
        }
        start = end;
    }
    runs
}

/// Number of lanes before the first change.
fn unchanged(changes: &[u32]) -> usize {
    let whole = changes.as_chunks::<TOGETHER>().0;
    let same = whole.iter().take_while(|chunk| chunk.iter().fold(0, |any, c| any | c) == 0).count();
    let start = same * TOGETHER;
    start + changes[start..].iter().take_while(|change| **change == 0).count()
}

/// Marks the lanes whose word differs from that of the lane before.
struct Changes<'a, W> {
    words: &'a [W],
    changes: &'a mut [u32],
}

impl<W: Word> Kernel for Changes<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Changes { words, changes } = self;
        let Some((_, changes)) = changes.split_first_mut() else { return };
        let (before, here) = (&words[..changes.len()], &words[1..][..changes.len()]);
        for i in 0..changes.len() {
            changes[i] |= u32::from(before[i] != here[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(lanes: Range<usize>, first: usize, active: u64) -> Run {
        Run { lanes, first, active }
    }

    #[test]
    fn runs_end_where_a_word_changes() {
        let words: Vec<u32> = (0..70).map(|lane| u32::from(lane >= 3) + u32::from(lane >= 40)).collect();
        let mut changes = vec![0; 70];
        for isa in osl_simd::Isa::all() {
            isa.dispatch(Changes { words: &words, changes: &mut changes });
        }
        assert_eq!(
            split(&changes, &Mask::all(70)),
            [run(0..3, 0, 3), run(3..40, 3, 37), run(40..70, 40, 30)]
        );
        assert_eq!(split(&changes, &Mask::none()), []);
        let some = Mask::Some((0..70).map(|lane| if lane % 32 == 31 { u32::MAX } else { 0 }).collect());
        assert_eq!(split(&changes, &some), [run(3..40, 31, 1), run(40..70, 63, 1)]);
        assert_eq!(split(&[], &Mask::all(0)), []);
    }

    #[test]
    fn lanes_that_all_differ_are_runs_of_one() {
        let words: Vec<u64> = (0..33).collect();
        let mut changes = vec![0; 33];
        osl_simd::Isa::detect().dispatch(Changes { words: &words, changes: &mut changes });
        let runs = split(&changes, &Mask::all(33));
        assert_eq!(runs.len(), 33);
        assert!(runs.iter().enumerate().all(|(at, found)| *found == run(at..at + 1, at, 1)));
    }
}
