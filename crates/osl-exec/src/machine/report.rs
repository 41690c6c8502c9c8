//! Reports of lanes: errors and warnings, and their cost.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::{KernelStep, Location, Operand};

/// Steps for a report, besides its text.
const REPORT: u64 = 40;

/// Whether the results are uniform.
pub(super) fn are_uniform(outs: &[Operand]) -> bool {
    !outs.is_empty() && outs.iter().all(|o| matches!(o.location, Location::Words(_)))
}

/// Whether the result of a step is uniform.
pub(super) fn is_uniform(step: &KernelStep) -> bool {
    are_uniform(&step.outs)
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// Reports a message of a lane; of all active lanes if the result of the step is uniform.
    pub(super) fn report(&mut self, step: &KernelStep, lane: usize, mask: &Mask, message: Message) {
        let message = Message { at: Some(step.span), ..message };
        self.pay_report(message.text.len());
        if is_uniform(step) {
            self.report_all(mask, message);
        } else {
            self.messages.add([self.first + lane], message);
        }
    }

    /// Charges a lane for a report with a text of some bytes.
    pub(super) fn pay_report(&mut self, bytes: usize) {
        self.pay_text(8 * bytes);
        self.work.pay(REPORT);
    }

    /// Reports a message of all active lanes.
    pub(super) fn report_all(&mut self, mask: &Mask, message: Message) {
        let first = self.first;
        let lanes = self.active(mask);
        self.messages.add(lanes.into_iter().map(|lane| first + lane), message);
    }
}
