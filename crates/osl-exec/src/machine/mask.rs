//! Masks: which lanes of a batch run a step.

use crate::arithmetic::Word;

/// A set of lanes: all ones for a lane that is in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Mask {
    /// Every lane.
    All(usize),
    /// No lane.
    None,
    /// Some lanes, at least one in and one out.
    Some(Vec<u32>),
}

impl Mask {
    /// All of `width` lanes.
    pub(super) fn all(width: usize) -> Mask {
        Mask::All(width)
    }

    /// The first `points` of `width` lanes. The others hold what no point computed, so no branch may follow them.
    pub(super) fn start(points: usize, width: usize) -> Mask {
        if points >= width {
            return Mask::All(width);
        }
        Mask::normal((0..width).map(|lane| if lane < points { u32::MAX } else { 0 }).collect())
    }

    /// No lane.
    pub(super) fn none() -> Mask {
        Mask::None
    }

    /// Whether any lane is in the set.
    pub(super) fn any(&self) -> bool {
        !matches!(self, Mask::None)
    }

    /// The lanes of the set where `cond` is not 0, and those where it is.
    pub(super) fn split<W: Word>(&self, cond: &[W]) -> (Mask, Mask) {
        let yes = |c: &W| if c.bits() != 0 { u32::MAX } else { 0 };
        let (yes, no): (Vec<u32>, Vec<u32>) = match self {
            Mask::None => return (Mask::None, Mask::None),
            Mask::All(_) => (cond.iter().map(yes).collect(), cond.iter().map(|c| !yes(c)).collect()),
            Mask::Some(bits) => (
                bits.iter().zip(cond).map(|(b, c)| b & yes(c)).collect(),
                bits.iter().zip(cond).map(|(b, c)| b & !yes(c)).collect(),
            ),
        };
        (Mask::normal(yes), Mask::normal(no))
    }

    fn normal(bits: Vec<u32>) -> Mask {
        let (any, all) = bits.iter().fold((0, u32::MAX), |(any, all), b| (any | b, all & b));
        match (any, all) {
            (0, _) => Mask::None,
            (_, u32::MAX) => Mask::All(bits.len()),
            _ => Mask::Some(bits),
        }
    }

    /// Copies the lanes of the set.
    pub(super) fn copy<W: Word>(&self, to: &mut [W], from: &[W]) {
        match self {
            Mask::All(_) => to.copy_from_slice(from),
            Mask::None => {}
            Mask::Some(bits) => {
                for ((to, from), b) in to.iter_mut().zip(from).zip(bits) {
                    *to = W::pick(*b, *from, *to);
                }
            }
        }
    }

    /// Sets the lanes of the set to one word.
    pub(super) fn fill<W: Word>(&self, to: &mut [W], word: W) {
        match self {
            Mask::All(_) => to.fill(word),
            Mask::None => {}
            Mask::Some(bits) => {
                for (to, b) in to.iter_mut().zip(bits) {
                    *to = W::pick(*b, word, *to);
                }
            }
        }
    }

    /// Calls `visit` with each lane of the set.
    pub(super) fn for_each(&self, mut visit: impl FnMut(usize)) {
        match self {
            Mask::All(width) => (0..*width).for_each(visit),
            Mask::None => {}
            Mask::Some(bits) => {
                for (lane, b) in bits.iter().enumerate() {
                    if *b != 0 {
                        visit(lane);
                    }
                }
            }
        }
    }

    /// How many lanes the set has.
    pub(super) fn count(&self) -> usize {
        match self {
            Mask::All(width) => *width,
            Mask::None => 0,
            Mask::Some(bits) => bits.iter().map(|b| (*b & 1) as usize).sum(),
        }
    }

    /// The first lane of the set.
    pub(super) fn first(&self) -> Option<usize> {
        match self {
            Mask::All(_) => Some(0),
            Mask::None => None,
            Mask::Some(bits) => bits.iter().position(|b| *b != 0),
        }
    }
}
