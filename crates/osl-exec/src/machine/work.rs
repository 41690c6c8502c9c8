//! How much a batch may do: steps, counted by what they take, and the memory of what it makes.
//!
//! The count knows no clock, so that a program ends at the same place on every machine.

use super::{Machine, Stop};
use crate::arithmetic::Arithmetic;
use crate::program::KernelStep;
use osl_ir::Span;
use osl_ir::ir::Kernel;
use std::sync::atomic::AtomicUsize;

/// Bytes of text for each step that is counted for it.
const BYTES_A_STEP: usize = 128;
/// Steps that are counted for a report of a bad index.
const REPORT: u64 = 16;
/// Steps that are counted for a pattern that has to be compiled.
const PATTERN: u64 = 2000;
/// Steps that are counted for a match that may go back and try again, as often as matches may.
const RETRIES: u64 = 8000;

/// What the batches of a run have made together, in bytes.
#[derive(Debug, Default)]
pub(crate) struct Totals {
    /// Printed and reported.
    pub(super) said: AtomicUsize,
    /// Closures that are kept.
    pub(super) closures: AtomicUsize,
}

/// What a kernel counts for each lane, in sixteenths of a step.
fn of_kernel(kernel: &Kernel) -> u64 {
    match kernel {
        Kernel::Noise { triple, .. } => 4 << u32::from(*triple),
        Kernel::NamedNoise { .. } => 1600,
        Kernel::Texture { .. }
        | Kernel::Environment { .. }
        | Kernel::Volume { .. }
        | Kernel::TextureInfo { .. } => 160,
        Kernel::Regex { .. } => 200,
        Kernel::DictFind => 1600,
        Kernel::Print { .. } => 400,
        Kernel::Format(_) | Kernel::Split { .. } => 200,
        Kernel::Note(_) => 0,
        Kernel::Report { .. } | Kernel::CheckIndex { .. } | Kernel::Hash => 4,
        Kernel::ClosureSum | Kernel::ClosureScale => 16,
        _ => 100,
    }
}

impl<A: Arithmetic> Machine<'_, A> {
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

    /// Counts what a pattern takes beyond a plain match: it is `new`, or looks around or back.
    pub(super) fn spend_pattern(&mut self, pattern: &str, new: bool) {
        let refers = |pair: &[u8]| pair[0] == b'\\' && pair[1].is_ascii_digit();
        let retries = pattern.contains("(?") || pattern.as_bytes().windows(2).any(refers);
        self.spent += PATTERN * u64::from(new) + RETRIES * u64::from(retries);
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
