//! Masks: which lanes of a batch execute a step.

use osl_lanes::Word;
use osl_simd::{Isa, Kernel};

/// A set of lanes; the word of a lane in it is all ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Mask {
    /// Every lane.
    All(usize),
    /// No lane.
    None,
    /// Some lanes: at least one inside and one outside.
    Some(Vec<u32>),
}

impl Mask {
    /// All of `width` lanes.
    pub(super) fn all(width: usize) -> Mask {
        Mask::All(width)
    }

    /// The first `points` of `width` lanes. The other lanes contain undefined values, so they must not affect
    /// branches.
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

    /// The word of each lane, unless all lanes or none are in the set.
    pub(super) fn bits(&self) -> &[u32] {
        if let Mask::Some(bits) = self { bits } else { &[] }
    }

    /// The lanes of the set where `cond` is nonzero, and those where it is zero.
    pub(super) fn split<W: Word>(&self, isa: Isa, cond: &[W]) -> (Mask, Mask) {
        let within = match self {
            Mask::None => return (Mask::None, Mask::None),
            Mask::All(_) => None,
            Mask::Some(bits) => Some(&bits[..]),
        };
        let (mut yes, mut no) = (vec![0; cond.len()], vec![0; cond.len()]);
        let [first, second] = isa.dispatch(Split { within, cond, yes: &mut yes, no: &mut no });
        (first.of(yes), second.of(no))
    }

    fn normal(bits: Vec<u32>) -> Mask {
        let (any, all) = bits.iter().fold((0, u32::MAX), |(any, all), b| (any | b, all & b));
        Extent { any, all }.of(bits)
    }

    /// Copies the lanes of the set.
    pub(super) fn copy<W: Word>(&self, isa: Isa, to: &mut [W], from: &[W]) {
        match self {
            Mask::All(_) => to.copy_from_slice(from),
            Mask::None => {}
            Mask::Some(bits) => isa.dispatch(Copy { bits, to, from }),
        }
    }

    /// Sets the lanes of the set to one word.
    pub(super) fn fill<W: Word>(&self, isa: Isa, to: &mut [W], word: W) {
        match self {
            Mask::All(_) => to.fill(word),
            Mask::None => {}
            Mask::Some(bits) => isa.dispatch(Fill { bits, to, word }),
        }
    }

    /// Whether a lane of the set has an unsigned number that is at least `limit`.
    pub(super) fn any_beyond<W: Word>(&self, isa: Isa, numbers: &[W], limit: u32) -> bool {
        match self {
            Mask::All(_) => isa.dispatch(Beyond { bits: None, numbers, limit }),
            Mask::None => false,
            Mask::Some(bits) => isa.dispatch(Beyond { bits: Some(bits), numbers, limit }),
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

    /// Whether a lane is in the set.
    #[inline]
    pub(super) fn has(&self, lane: usize) -> bool {
        match self {
            Mask::All(width) => lane < *width,
            Mask::None => false,
            Mask::Some(bits) => bits.get(lane).is_some_and(|b| *b != 0),
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

/// The bitwise or and the bitwise and of all lanes of a set.
struct Extent {
    any: u32,
    all: u32,
}

impl Extent {
    /// The set of these lanes, given their extent.
    fn of(&self, bits: Vec<u32>) -> Mask {
        match (self.any, self.all) {
            (0, _) => Mask::None,
            (_, u32::MAX) => Mask::All(bits.len()),
            _ => Mask::Some(bits),
        }
    }
}

struct Split<'a, W> {
    within: Option<&'a [u32]>,
    cond: &'a [W],
    yes: &'a mut [u32],
    no: &'a mut [u32],
}

impl<W: Word> Split<'_, W> {
    #[inline(always)]
    fn each(self, within: impl Fn(usize) -> u32) -> [Extent; 2] {
        let Split { cond, yes, no, .. } = self;
        let n = cond.len().min(yes.len()).min(no.len());
        let (cond, yes, no) = (&cond[..n], &mut yes[..n], &mut no[..n]);
        let [mut first, mut second] = [(0, u32::MAX); 2];
        for i in 0..n {
            let (within, holds) = (within(i), if cond[i].bits() != 0 { u32::MAX } else { 0 });
            let (a, b) = (within & holds, within & !holds);
            (yes[i], no[i]) = (a, b);
            first = (first.0 | a, first.1 & a);
            second = (second.0 | b, second.1 & b);
        }
        [first, second].map(|(any, all)| Extent { any, all })
    }
}

impl<W: Word> Kernel for Split<'_, W> {
    type Output = [Extent; 2];
    #[inline(always)]
    fn run(self) -> [Extent; 2] {
        match self.within {
            None => self.each(
                #[inline(always)]
                |_| u32::MAX,
            ),
            Some(bits) => {
                let bits = &bits[..self.cond.len()];
                self.each(
                    #[inline(always)]
                    |i| bits[i],
                )
            }
        }
    }
}

struct Copy<'a, W> {
    bits: &'a [u32],
    to: &'a mut [W],
    from: &'a [W],
}

impl<W: Word> Kernel for Copy<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for ((to, from), b) in self.to.iter_mut().zip(self.from).zip(self.bits) {
            *to = W::pick(*b, *from, *to);
        }
    }
}

struct Fill<'a, W> {
    bits: &'a [u32],
    to: &'a mut [W],
    word: W,
}

impl<W: Word> Kernel for Fill<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for (to, b) in self.to.iter_mut().zip(self.bits) {
            *to = W::pick(*b, self.word, *to);
        }
    }
}

struct Beyond<'a, W> {
    bits: Option<&'a [u32]>,
    numbers: &'a [W],
    limit: u32,
}

impl<W: Word> Kernel for Beyond<'_, W> {
    type Output = bool;
    #[inline(always)]
    fn run(self) -> bool {
        let Beyond { bits, numbers, limit } = self;
        match bits {
            None => numbers.iter().fold(false, |any, i| any | (i.bits() >= limit)),
            Some(bits) => {
                numbers.iter().zip(bits).fold(false, |any, (i, b)| any | (*b != 0 && i.bits() >= limit))
            }
        }
    }
}
