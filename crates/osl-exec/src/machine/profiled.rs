//! Runs steps and measures their times. [`profile`](crate::profile) combines the times.

use super::{Machine, Mask};
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::step::Steps;
use std::time::Instant;

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// Runs steps and records the time of each.
    pub(super) fn profiled(&mut self, steps: &'a Steps, mask: &Mask) -> Result<(), RunError> {
        let lanes = self.lanes_in(mask);
        for (step, mark) in steps.list.iter().zip(&steps.marks) {
            let outer = self.profile.as_mut().map(|profile| profile.begin()).unwrap_or_default();
            #[allow(
                clippy::disallowed_methods,
                reason = "only a profile, which a user requests, measures time"
            )]
            let start = Instant::now();
            let result = self.step(step, mask);
            let time = start.elapsed();
            if let Some(profile) = &mut self.profile {
                profile.end(*mark, lanes, time, outer);
            }
            result?;
        }
        Ok(())
    }
}
