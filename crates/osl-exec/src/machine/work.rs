//! How much a batch may do: steps, counted by what they take, and the memory of what it makes.
//!
//! The count knows no clock, so that a program ends at the same place on every machine.

use super::{Machine, Stop};
use crate::program::{KernelStep, Step};
use osl_ir::Span;
use osl_ir::ir::{Kernel, LaneOp};

/// Bytes of text for each step that is counted for it.
const BYTES_A_STEP: usize = 128;
/// Steps that are counted for a report of a bad index.
const REPORT: u64 = 16;

/// What a step counts: about one for 50 ns over a batch of 256 lanes.
pub(super) fn weight(step: &Step) -> u64 {
    match step {
        Step::Lane { op, out, .. } => of_op(*op) * u64::from(out.words.min(3)),
        Step::Load { .. } | Step::Store { .. } => 4,
        Step::Kernel(_) | Step::If { .. } => 2,
        // Counted round by round.
        Step::Loop { .. } => 0,
    }
}

fn of_op(op: LaneOp) -> u64 {
    use LaneOp as L;
    match op {
        L::Blackbody | L::Wavelength => 500,
        L::MInverse | L::MMul | L::MDet => 30,
        L::Sin | L::Cos | L::Tan | L::Asin | L::Acos | L::Atan | L::Atan2 => 10,
        L::Sinh | L::Cosh | L::Tanh | L::Cbrt | L::Erf | L::Erfc | L::Fmod | L::FmodExact => 10,
        L::Pow | L::Exp | L::Exp2 | L::Expm1 | L::Log | L::Log2 | L::Log10 => 10,
        _ => 1,
    }
}

/// What a kernel counts for each lane, in sixteenths of a step.
fn of_kernel(kernel: &Kernel) -> u64 {
    match kernel {
        Kernel::Noise { triple, .. } => 4 << u32::from(*triple),
        Kernel::NamedNoise { .. } => 1600,
        Kernel::Texture { .. } | Kernel::Environment { .. } | Kernel::TextureInfo { .. } => 160,
        Kernel::Regex { .. } => 16_000,
        Kernel::DictFind => 1600,
        Kernel::Print { .. } => 400,
        Kernel::Format(_) | Kernel::Split { .. } => 200,
        Kernel::Report { .. } | Kernel::CheckIndex { .. } | Kernel::Hash => 4,
        Kernel::ClosureSum | Kernel::ClosureScale => 16,
        _ => 100,
    }
}

impl Machine<'_> {
    /// Counts a kernel that runs at `lanes` lanes.
    pub(super) fn spend_kernel(&mut self, step: &KernelStep, lanes: usize) {
        self.spent += (of_kernel(&step.kernel) * lanes as u64).div_ceil(16);
    }

    /// Counts the making of a text.
    pub(super) fn spend_text(&mut self, bytes: usize) {
        self.spent += (bytes / BYTES_A_STEP) as u64;
    }

    /// Counts a report of a bad index.
    pub(super) fn spend_report(&mut self) {
        self.spent += REPORT;
    }

    /// An error once the batch has done too much.
    pub(super) fn within_budget(&self, span: Span) -> Result<(), Stop> {
        if self.spent > self.max_steps {
            return Err(Stop::TooManySteps { steps: self.max_steps, span });
        }
        Ok(())
    }

    /// Ends the run behind the kernel that is running.
    pub(super) fn exhaust(&mut self, what: impl Into<String>) {
        self.exhausted.get_or_insert_with(|| what.into());
    }
}
