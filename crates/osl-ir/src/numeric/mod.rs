//! The arithmetic of OSL, one lane at a time.
//!
//! This module owns what a number *becomes*: the value of every operator and of every built-in that works lane by
//! lane, to the last bit. The constant folder calls these bodies for one lane; the batch interpreter stamps them into
//! loops over slices. Folding and running therefore agree by construction.
//!
//! It must not know of lanes, masks, types of the language, or derivatives (those are written as ordinary
//! instructions by a pass, which call the same bodies).
//!
//! Two habits make a plain loop over slices vectorise once these bodies are inlined into it:
//!
//! - every function is `#[inline(always)]`, so that it takes on the instruction set of the loop's function;
//! - choices are [`Number::select`]s between values that are both computed; nothing returns early, looks into a
//!   table, or calls a mathematical library. Closures handed to `map` are avoided: they are calls until inlined,
//!   and inlined late; so are casts of floats to integers with `as`.
//!
//! The modules, in reading order:
//!
//! | module | holds |
//! |---|---|
//! | [`real`] | the element type of the arithmetic, as a trait |
//! | [`rounding`] | floor, ceil, trunc, round and the conversion to integers, branch-free and exact |
//! | [`arith`] | the operators: division, integer arithmetic, shifts, comparisons, conversions |
//! | [`common`] | abs, mix, clamp, smoothstep and the other small functions |
//! | [`geometry`] | dot, length, normalize, reflect, refract … on three numbers |
//! | [`matrix`] | products, inverse, determinant, transforms; row vectors |
//! | [`color`] | conversions between color systems |
//! | [`spectrum`] | colors of black bodies and single wavelengths |
//! | [`spline`] | where a spline reaches a value |
//! | [`tangent`] | how conversions between color systems change with their colors |
//! | [`known`] | constants of the library that are no floats |
//! | [`lane`] | what the lane operations call: the above with truth values as 0 and 1 |
//! | [`double`] | the same numbers in binary64, as an oracle |
//! | [`shadow`] | strict and double side by side, to see where they part |
//! | [`fast`] | cheaper approximations in single precision, with their bounds |
//! | [`strict`] | the reference's own approximations of sin, exp, pow …, for `f32` |

pub mod arith;
pub mod color;
pub mod common;
pub mod double;
pub mod fast;
pub mod geometry;
pub mod known;
pub mod lane;
pub mod matrix;
pub mod real;
pub mod rounding;
pub mod shadow;
pub mod spectrum;
pub mod spline;
pub mod strict;
pub mod tangent;

pub use real::{Number, Real};

/// Which numbers a program is run with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Arithmetic {
    /// Single precision, the reference's order of operations and its approximations: the same bits everywhere.
    #[default]
    Strict,
    /// Single precision with cheaper approximations and fused products and sums.
    Fast,
    /// Double precision.
    Double,
    /// Strict numbers with double precision beside them, which decides nothing: for who follows a run.
    Shadow,
}

impl Arithmetic {
    /// Those to choose from.
    pub const ALL: [Arithmetic; 3] = [Arithmetic::Strict, Arithmetic::Fast, Arithmetic::Double];

    /// `strict`, `fast` or `f64`; `shadow`.
    pub fn name(self) -> &'static str {
        match self {
            Arithmetic::Strict => "strict",
            Arithmetic::Fast => "fast",
            Arithmetic::Double => "f64",
            Arithmetic::Shadow => "shadow",
        }
    }

    /// The one of a name.
    pub fn from_name(name: &str) -> Option<Arithmetic> {
        Arithmetic::ALL.into_iter().find(|arithmetic| arithmetic.name() == name)
    }

    /// Whether its numbers are known in double precision, and programs for it have no constants that were rounded to
    /// single.
    pub fn is_double(self) -> bool {
        matches!(self, Arithmetic::Double | Arithmetic::Shadow)
    }
}
