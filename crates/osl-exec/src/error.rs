//! Why a run ends without results.

use osl_ir::Span;
use osl_ir::global::Global;
use osl_limits::Halt;
use std::sync::Arc;

/// Why a run stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// A global that differs from point to point, and the program was compiled for points that share it.
    #[error(
        "`{}` differs from point to point, and the program was compiled for points that share it", .0.name()
    )]
    VariesMore(Global),
    /// The same for how a global changes from pixel to pixel.
    #[error(
        "the change of `{}` from pixel to pixel differs from point to point, and the program was compiled for points \
         that share it", .0.name()
    )]
    DerivsVaryMore(Global),
    /// The points trace rays, and the program was compiled for points that do not.
    #[error("the points trace rays, and the program was compiled for points that do not")]
    Traces,
    /// The matrix of a space is not affine, and the program was compiled for one that is.
    #[error("the matrix of space \"{0}\" is not affine, and the program was compiled for one that is")]
    NotAffine(Arc<str>),
    /// A point exceeds its limit of steps.
    #[error("point {point} takes more than {steps} steps")]
    TooManySteps {
        /// The first such point, by its pixel.
        point: usize,
        /// The limit.
        steps: u64,
        /// The loop or call where it was detected, if any.
        span: Option<Span>,
    },
    /// A point exceeds its limit of memory.
    #[error("the strings, messages and closures of point {point} take more than {bytes} bytes")]
    TooMuchMemory {
        /// The first such point, by its pixel.
        point: usize,
        /// The limit.
        bytes: u64,
        /// The call that exceeded it, if it was a call.
        span: Option<Span>,
    },
    /// The points of a run together exceed a limit.
    #[error("{what}")]
    TooMuch {
        /// The limit, as text.
        what: String,
        /// The name of the limit.
        limit: &'static str,
    },
    /// The command has used up its time or its memory.
    #[error("{0}")]
    Halted(Halt),
}
