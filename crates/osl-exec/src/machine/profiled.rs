//! Runs steps and measures their times. [`profile`](crate::profile) combines the times.

use super::{Machine, Mask};
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::step::Steps;

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// Runs steps and records the time of each.
    pub(super) fn profiled(&mut self, steps: &'a Steps, mask: &Mask) -> Result<(), RunError> {
        let lanes = self.lanes_in(mask);
        for (step, mark) in steps.list.iter().zip(&steps.marks) {
            let begun = self.profile.as_mut().map(|profile| profile.begin()).unwrap_or_default();
            let result = self.step(step, mask);
            if let Some(profile) = &mut self.profile {
                profile.end(*mark, lanes, begun);
            }
            result?;
        }
        Ok(())
    }
}
