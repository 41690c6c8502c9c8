//! The arithmetics of a machine: the loops and fields that each of them runs.
//!
//! A machine is generic code for all of them.

use crate::fields::{self, FieldCall};
use crate::lanes::{LaneInput, LaneRun, Ready, ReadyArg, ReadyLane};
use crate::register::Lanes;
use osl_ir::ir::{LaneOp, MAX_ARGS, Precision};
use osl_lanes::{Element, Word};
use osl_numeric::fast::FastFloat;
use osl_numeric::{Number, Scalar};
use osl_simd::Isa;

/// The single-precision arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Style {
    /// Products and sums are rounded separately.
    Strict,
    /// Products and sums are fused where possible, and functions are approximated: `numeric::fast`.
    Fast,
}

/// An arithmetic.
pub(crate) trait ArithmeticImpl: Copy + Send + Sync + 'static {
    /// The contents of a lane.
    type Word: Word;
    /// The floats.
    type Real: Element<Self::Word>;
    /// Its style in machine code, if that implements its lane operations.
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
        run.each(|call| osl_lanes::run_strict(isa, call));
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
            _ => true,
        };
        run.each_alike(is_strict, |strict, part| {
            if strict {
                Strict::lanes(isa, part);
            } else {
                part.each(|call| osl_lanes::run_fast(isa, call));
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

/// Double precision.
#[derive(Clone, Copy)]
pub(crate) struct Double;

impl ArithmeticImpl for Double {
    type Word = u64;
    type Real = f64;

    fn lanes(isa: Isa, run: LaneRun<'_, u64>) {
        run.each(|call| osl_lanes::run_double(isa, call));
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

/// Runs an operation with one argument on `n` lanes; the words of both are component by component. Allocates,
/// so it is meant for rare cases.
pub(crate) fn one<A: ArithmeticImpl>(isa: Isa, op: LaneOp, arg: &[A::Word], out: &mut [A::Word], n: usize) {
    let mut registers = [Lanes::new(out.len()), Lanes::new(arg.len())];
    registers[1].words_mut().copy_from_slice(arg);
    let parts = if op.shape().per_component { (out.len() / n.max(1)) as u8 } else { 1 };
    let arg = ReadyArg {
        from: LaneInput::Lanes(1, 0),
        words: (arg.len() / n.max(1)) as u8,
        apart: if parts > 1 { n as u32 } else { 0 },
    };
    let step = ReadyLane { op, parts, flat: false, count: 1, out: (0, 0), args: [arg; MAX_ARGS] };
    let run = LaneRun {
        isa,
        steps: &[Ready::Lane(step)],
        registers: &mut registers,
        words: &[],
        cells: &[],
        indices: &[],
        arrays: &mut [],
        broadcasts: &mut Default::default(),
        width: n,
        lanes: 0..n,
    };
    A::lanes(isa, run);
    out.copy_from_slice(registers[0].words());
}
