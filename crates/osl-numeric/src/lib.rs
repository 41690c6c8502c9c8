//! The arithmetic of OSL, one lane at a time.
//!
//! This module defines the value of every operator and of every built-in that works lane by lane, to the last
//! bit. The constant folder calls these bodies for one lane, the batch interpreter stamps them into loops
//! over slices, and machine code is recorded by running them on numbers without values. So all of these agree
//! by construction.
//!
//! It must not know batches and their active lanes, types of the language, or derivatives (a pass writes
//! these as ordinary instructions, which call the same bodies).
//!
//! Two rules ensure that a plain loop over slices vectorises once these bodies are inlined into it:
//!
//! - every function is `#[inline(always)]`, so that it is compiled for the instruction set of the loop's
//!   function;
//! - choices are [`Number::select`]s between values that are both computed; nothing returns early, reads a
//!   table, or calls a mathematical library, except within [`Real::by_value`]. Closures passed to `map` are
//!   avoided, because they are inlined too late; so are casts of floats to integers with `as`.
//!
//! A third rule makes the same bodies machine code: they use the methods of the traits and the operators of
//! numbers only, so that an implementation of the traits can record the operations instead of computing them.
//! A body that needs values, and so cannot be recorded, uses [`Real::by_value`].
//!
//! The modules, in reading order:
//!
//! | module | contents |
//! |---|---|
//! | [`real`] | the numbers of the arithmetic, as traits |
//! | [`int`] | masks and integers, as traits |
//! | `single` | the strict arithmetic: `f32`, `i32` and `bool` |
//! | [`rounding`] | floor, ceil, trunc, round and the conversion to integers, branch-free and exact |
//! | [`remainder`] | exact remainders without a call |
//! | [`arith`] | the operators: division, integer arithmetic, shifts, comparisons, conversions |
//! | [`common`] | abs, mix, clamp, smoothstep and the other small functions |
//! | [`geometry`] | dot, length, normalize, reflect, refract … on three numbers |
//! | [`matrix`] | products, inverse, determinant, transforms; row vectors |
//! | [`color`] | conversions between color systems |
//! | [`spectrum`] | colors of black bodies and single wavelengths |
//! | [`basis`] | the bases of splines |
//! | [`spline`] | the position at which a spline reaches a value |
//! | [`tangent`] | derivatives of conversions between color systems |
//! | [`library_constants`] | constants of the library that are not exactly floats |
//! | [`lane`] | the bodies of the lane operations: the above, with truth values as 0 and 1 |
//! | [`double`] | the same numbers in binary64, as a reference |
//! | [`fast`] | cheaper approximations in single precision, with their bounds |
//! | [`interval`] | ranges of numbers, which contain every result of the strict arithmetic |
//! | [`strict`] | the reference's own approximations of sin, exp, pow …, for `f32` |

pub mod arith;
pub mod basis;
pub mod color;
pub mod common;
pub mod double;
pub mod fast;
pub mod geometry;
pub mod int;
pub mod interval;
pub mod lane;
pub mod library_constants;
pub mod matrix;
pub mod named;
mod op;
pub mod real;
pub mod remainder;
pub mod rounding;
mod single;
pub mod spaces;
pub mod spectrum;
pub mod spline;
pub mod strict;
pub mod tangent;
mod value;

pub use int::{Int, Mask};
pub use op::{Continuity, Cost, Derivative, Domain, LaneOp, LaneShape, MAX_ARGS, Precision};
pub use real::{Number, Real, Scalar, Single};
pub use value::{Const, Kind};

/// The numbers with which a program runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// Single precision, the reference's order of operations and its approximations: the same bits
    /// everywhere.
    #[default]
    Strict,
    /// Single precision with cheaper approximations and fused products and sums.
    Fast,
    /// Double precision.
    Double,
}

impl Arithmetic {
    /// All arithmetics.
    pub const ALL: [Arithmetic; 3] = [Arithmetic::Strict, Arithmetic::Fast, Arithmetic::Double];

    /// `strict`, `fast` or `f64`.
    pub fn name(self) -> &'static str {
        match self {
            Arithmetic::Strict => "strict",
            Arithmetic::Fast => "fast",
            Arithmetic::Double => "f64",
        }
    }

    /// The arithmetic with a name.
    pub fn from_name(name: &str) -> Option<Arithmetic> {
        Arithmetic::ALL.into_iter().find(|arithmetic| arithmetic.name() == name)
    }

    /// Whether its numbers are in double precision, and programs for it contain no constants that were
    /// rounded to single precision.
    pub fn is_double(self) -> bool {
        self == Arithmetic::Double
    }
}
