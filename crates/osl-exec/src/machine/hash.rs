//! Hashes of numbers, for all lanes at once.

use super::Machine;
use crate::arithmetic::ArithmeticImpl;
use crate::step::{KernelStep, Location};
use osl_ir::ir::Kind;
use osl_lanes::{Arg, Word};
use osl_noise::hash::{NAN_WORD, hash};
use osl_simd::Kernel;
use std::marker::PhantomData;

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The hash of the numbers of a step, in all lanes.
    pub(super) fn hash(&mut self, step: &KernelStep) {
        let Some(out) = step.outs.first() else { return };
        let n = if matches!(out.location, Location::Words(_)) { 1 } else { self.lanes };
        let mut words = Vec::new();
        for (arg, kind) in step.args.iter().zip(&step.kinds) {
            let is_float = matches!(kind, Kind::Float | Kind::Triple);
            for component in 0..arg.words as usize {
                let start = words.len();
                words.resize(start + n, 0);
                let to = &mut words[start..];
                match self.arg(self.part(*arg, component)) {
                    Arg::Each(from) => {
                        self.isa.dispatch(Convert { from, is_float, to, arithmetic: PhantomData::<A> });
                    }
                    Arg::Same(word) => to.fill(convert::<A>(word[0], is_float)),
                }
            }
        }
        let mut target = self.take(*out);
        if let Some(out) = target.chunks_mut(n).next() {
            self.isa.dispatch(Hash { words: &words, out });
        }
        self.put(*out, target);
    }
}

/// The word that is hashed for a number: a float counts by its single-precision word, and every NaN is the
/// same, because its payload depends on the instruction set.
#[inline(always)]
fn convert<A: ArithmeticImpl>(word: A::Word, is_float: bool) -> u32 {
    if !is_float {
        return word.bits();
    }
    let x = A::single(word);
    if x.is_nan() { NAN_WORD } else { x.to_bits() }
}

struct Convert<'a, A: ArithmeticImpl> {
    from: &'a [A::Word],
    is_float: bool,
    to: &'a mut [u32],
    arithmetic: PhantomData<A>,
}

impl<A: ArithmeticImpl> Kernel for Convert<'_, A> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Convert { from, is_float, to, .. } = self;
        let from = &from[..to.len()];
        osl_simd::fill(
            to,
            #[inline(always)]
            |i| convert::<A>(from[i], is_float),
        );
    }
}

/// Hashes the words of each lane, which are as far apart as there are lanes.
struct Hash<'a, W> {
    words: &'a [u32],
    out: &'a mut [W],
}

impl<W: Word> Hash<'_, W> {
    #[inline(always)]
    fn of<const N: usize>(self) {
        let Hash { words, out } = self;
        let n = out.len();
        let each: [&[u32]; N] = std::array::from_fn(|k| &words[k * n..][..n]);
        osl_simd::fill(
            out,
            #[inline(always)]
            |i| {
                let mut words = [0; N];
                let mut k = 0;
                while k < N {
                    words[k] = each[k][i];
                    k += 1;
                }
                W::of(hash(words))
            },
        );
    }
}

impl<W: Word> Kernel for Hash<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        match self.words.len() / self.out.len().max(1) {
            1 => self.of::<1>(),
            2 => self.of::<2>(),
            3 => self.of::<3>(),
            4 => self.of::<4>(),
            _ => self.out.fill(W::of(0)),
        }
    }
}
