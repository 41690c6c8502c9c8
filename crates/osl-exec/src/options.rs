//! The options of a run. The arithmetic is not among them: a program is compiled for one.

use crate::message::Keeping;
use crate::native::Native;
use osl_limits::Limits;
use osl_simd::Isa;
use std::time::Duration;

/// Options of a run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// Points per batch, rounded up to a multiple of 16; chosen for the program if not set. Fewer if the
    /// memory of the run or the work of a point requires it.
    pub batch: Option<usize>,
    /// Points per tile.
    pub tile: usize,
    /// Maximum number of threads; by default, all of the current thread pool. With one, everything runs on
    /// the calling thread.
    pub threads: Option<usize>,
    /// The instruction set.
    pub isa: Isa,
    /// The budgets of points, and of the run as a whole.
    pub limits: Limits,
    /// Whether the closures of outputs are kept.
    pub closures: bool,
    /// Whether the weights of the closures of outputs, summed by name, become planes: a color `Ci.diffuse`
    /// for each name that the program may use, or `Ci` if it uses none.
    pub weights: bool,
    /// The clock that measures the time of each instruction, if that is wanted: a time of the calling thread.
    pub profile: Option<fn() -> Duration>,
    /// Whether the steps of each point are counted: the frame has them as its last plane,
    /// [`STEPS`](crate::STEPS).
    pub steps: bool,
    /// Which sequences of operations become machine code.
    pub native: Native,
    /// How messages are kept.
    pub keeping: Keeping,
}

impl Default for RunOptions {
    fn default() -> Self {
        RunOptions {
            batch: None,
            tile: 4096,
            threads: None,
            isa: Isa::detect(),
            limits: Limits::default(),
            closures: false,
            weights: false,
            profile: None,
            steps: false,
            native: Native::Recurring,
            keeping: Keeping::default(),
        }
    }
}
