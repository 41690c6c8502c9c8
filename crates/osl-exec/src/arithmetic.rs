//! The arithmetics of a machine: the word of a lane, and how floats are stored in it.
//!
//! A machine is generic code for all of them. Ints and the numbers of strings and closures are the low 32
//! bits of a word in each arithmetic. This module must not know programs or machines.

use crate::fields::{self, FieldCall};
use crate::lanes::{LaneCall, LaneRun, Ready, Stamped, StampedFast, StampedRun};
use crate::native::Style;
use bytemuck::Pod;
use osl_ir::ir::Precision;
use osl_numeric::fast::FastFloat;
use osl_numeric::{Number, Scalar};
use osl_simd::{FusedKernel, Isa, Kernel};
use std::fmt::Debug;

/// The contents of a lane.
pub(crate) trait Word: Pod + Default + Debug + PartialEq + Send + Sync {
    /// Whether cheap operations have separate loops for single arguments. If not, single values are broadcast
    /// first, which leaves a third of the code to compile.
    const FORMS: bool;
    /// The word for an int, or for the number of a string or closure.
    fn of(bits: u32) -> Self;
    /// The int.
    fn bits(self) -> u32;
    /// `yes` if `mask` is all ones, `no` if it is 0.
    fn pick(mask: u32, yes: Self, no: Self) -> Self;
    /// The words as they are, if they have 32 bits.
    fn narrow(lanes: &[Self]) -> Option<&[u32]>;
    /// The same, mutable.
    fn narrow_mut(lanes: &mut [Self]) -> Option<&mut [u32]>;
    /// `out[i] = table[index[i]]`; an index beyond the table selects its last word.
    fn look_up(isa: Isa, table: &[Self; 16], index: &[u32], out: &mut [Self]);
}

impl Word for u32 {
    const FORMS: bool = true;
    #[inline(always)]
    fn of(bits: u32) -> u32 {
        bits
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self
    }
    #[inline(always)]
    fn pick(mask: u32, yes: u32, no: u32) -> u32 {
        (yes & mask) | (no & !mask)
    }
    fn narrow(lanes: &[u32]) -> Option<&[u32]> {
        Some(lanes)
    }
    fn narrow_mut(lanes: &mut [u32]) -> Option<&mut [u32]> {
        Some(lanes)
    }
    fn look_up(isa: Isa, table: &[u32; 16], index: &[u32], out: &mut [u32]) {
        isa.look_up(table, index, out);
    }
}

impl Word for u64 {
    const FORMS: bool = false;
    #[inline(always)]
    fn of(bits: u32) -> u64 {
        u64::from(bits)
    }
    #[inline(always)]
    fn bits(self) -> u32 {
        self as u32
    }
    #[inline(always)]
    fn pick(mask: u32, yes: u64, no: u64) -> u64 {
        if mask != 0 { yes } else { no }
    }
    fn narrow(_: &[u64]) -> Option<&[u32]> {
        None
    }
    fn narrow_mut(_: &mut [u64]) -> Option<&mut [u32]> {
        None
    }
    fn look_up(_: Isa, table: &[u64; 16], index: &[u32], out: &mut [u64]) {
        for (o, i) in out.iter_mut().zip(index) {
            *o = table[(*i).min(15) as usize];
        }
    }
}

/// A float stored in words.
pub(crate) trait Element<W>: Scalar {
    fn load(word: W) -> Self;
    fn store(self) -> W;
}

impl Element<u32> for f32 {
    #[inline(always)]
    fn load(word: u32) -> f32 {
        f32::from_bits(word)
    }
    #[inline(always)]
    fn store(self) -> u32 {
        self.to_bits()
    }
}

impl<const FUSED: bool> Element<u32> for FastFloat<FUSED> {
    #[inline(always)]
    fn load(word: u32) -> Self {
        FastFloat(f32::from_bits(word))
    }
    #[inline(always)]
    fn store(self) -> u32 {
        self.0.to_bits()
    }
}

impl Element<u64> for f64 {
    #[inline(always)]
    fn load(word: u64) -> f64 {
        f64::from_bits(word)
    }
    #[inline(always)]
    fn store(self) -> u64 {
        self.to_bits()
    }
}

/// An arithmetic.
pub(crate) trait ArithmeticImpl: Copy + Send + Sync + 'static {
    /// The contents of a lane.
    type Word: Word;
    /// The floats.
    type Real: Element<Self::Word>;
    /// Its style in [`native`](crate::native), if that implements its lane operations.
    const NATIVE: Option<Style> = None;
    /// Runs lane operations.
    fn lanes(isa: Isa, run: LaneRun<'_, Self::Word>);
    /// Runs a noise field. `inputs` and `outs` are lanes.
    fn field(isa: Isa, call: &FieldCall<'_>, inputs: &[&[Self::Word]], outs: &mut [&mut [Self::Word]]);
    /// Fills lanes with single-precision floats.
    fn fill(lanes: &mut [Self::Word], fill: impl FnOnce(&mut [f32]));

    /// The word of a float.
    #[inline(always)]
    fn of(x: f32) -> Self::Word {
        Self::Real::lit(x).store()
    }
    /// A float in single precision.
    #[inline(always)]
    fn single(word: Self::Word) -> f32 {
        Self::Real::load(word).to_f32()
    }
    /// A float in double precision.
    #[inline(always)]
    fn double(word: Self::Word) -> f64 {
        Self::Real::load(word).to_f64()
    }
}

/// Single precision, bit for bit.
#[derive(Clone, Copy)]
pub(crate) struct Strict;

impl ArithmeticImpl for Strict {
    type Word = u32;
    type Real = f32;
    const NATIVE: Option<Style> = Some(Style::Strict);

    fn lanes(isa: Isa, run: LaneRun<'_, u32>) {
        isa.dispatch(StampedRun::<u32, f32>::of(run));
    }

    fn field(isa: Isa, call: &FieldCall<'_>, inputs: &[&[u32]], outs: &mut [&mut [u32]]) {
        fields::cast(inputs, outs, |inputs, outs| fields::single(isa, call, inputs, outs));
    }

    fn fill(lanes: &mut [u32], fill: impl FnOnce(&mut [f32])) {
        fill(bytemuck::cast_slice_mut(lanes));
    }
}

/// Single precision with cheaper approximations; noise is the same as in the strict arithmetic.
#[derive(Clone, Copy)]
pub(crate) struct Fast;

impl ArithmeticImpl for Fast {
    type Word = u32;
    type Real = FastFloat<false>;
    const NATIVE: Option<Style> = Some(Style::Fast);

    fn lanes(isa: Isa, mut run: LaneRun<'_, u32>) {
        let is_strict = |step: &Ready| match step {
            Ready::Lane(step) => step.op.precision() == Precision::Strict,
            Ready::Gather(_) => true,
        };
        run.each_alike(is_strict, |strict, part| {
            if strict {
                Strict::lanes(isa, part);
            } else {
                part.each(|call| isa.dispatch_fused(FastCall(call)));
            }
        });
    }

    fn field(isa: Isa, call: &FieldCall<'_>, inputs: &[&[u32]], outs: &mut [&mut [u32]]) {
        Strict::field(isa, call, inputs, outs);
    }

    fn fill(lanes: &mut [u32], fill: impl FnOnce(&mut [f32])) {
        Strict::fill(lanes, fill);
    }
}

struct FastCall<'a>(LaneCall<'a, u32>);

impl FusedKernel for FastCall<'_> {
    #[inline(always)]
    fn fused(self) {
        StampedFast::<FastFloat<true>>::of(self.0).run();
    }
    #[inline(always)]
    fn plain(self) {
        StampedFast::<FastFloat<false>>::of(self.0).run();
    }
}

/// Double precision.
#[derive(Clone, Copy)]
pub(crate) struct Double;

impl ArithmeticImpl for Double {
    type Word = u64;
    type Real = f64;

    fn lanes(isa: Isa, run: LaneRun<'_, u64>) {
        run.each(|call| isa.dispatch_widest(Stamped::<u64, f64>::of(call)));
    }

    fn field(isa: Isa, call: &FieldCall<'_>, inputs: &[&[u64]], outs: &mut [&mut [u64]]) {
        fields::cast(inputs, outs, |inputs, outs| fields::double(isa, call, inputs, outs));
    }

    fn fill(lanes: &mut [u64], fill: impl FnOnce(&mut [f32])) {
        let mut singles = vec![0.0; lanes.len()];
        fill(&mut singles);
        for (lane, x) in lanes.iter_mut().zip(singles) {
            *lane = f64::from(x).to_bits();
        }
    }
}
