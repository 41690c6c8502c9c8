//! Branches and loops: which lanes take which path, and how results are merged.

use super::{Machine, Mask};
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::step::{LoopParam, Operand, Step, Steps};
use osl_ir::Span;
use osl_lanes::{Arg, Word};

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    pub(super) fn branch(
        &mut self,
        cond: Operand,
        then: &'a Steps,
        otherwise: &'a Steps,
        results: &[[Operand; 3]],
        mask: &Mask,
    ) -> Result<(), RunError> {
        let (yes, no) = match self.arg(cond) {
            Arg::Same(word) if word[0].bits() != 0 => (None, Mask::none()),
            Arg::Same(_) => (Some(Mask::none()), Mask::none()),
            Arg::Each(lanes) => {
                let (yes, no) = mask.split(self.isa, lanes);
                (Some(yes), no)
            }
        };
        let same = matches!(self.arg(cond), Arg::Same(_));
        let yes_mask = yes.as_ref().unwrap_or(mask);
        if yes_mask.any() {
            self.steps(then, yes_mask)?;
            results.iter().for_each(|[r, a, _]| self.copy(*a, *r, yes_mask));
        }
        let no_mask = if same && yes.is_some() { mask } else { &no };
        if no_mask.any() {
            self.steps(otherwise, no_mask)?;
            results.iter().for_each(|[r, _, b]| self.copy(*b, *r, no_mask));
        }
        Ok(())
    }

    /// Charges for a branch that does not run, since its results are those of an earlier batch.
    pub(super) fn spend_again(&mut self, step: &Step, mask: &Mask) {
        let Step::If { cond, then, otherwise, .. } = step else { return };
        let side = if self.bits(*cond, 0) != 0 { then } else { otherwise };
        self.spend(side.weight, mask);
        side.list.iter().for_each(|step| self.spend_again(step, mask));
    }

    pub(super) fn round(
        &mut self,
        params: &[LoopParam],
        body: &'a Steps,
        cond: Operand,
        span: Span,
        mask: &Mask,
    ) -> Result<(), RunError> {
        let all = Mask::all(self.width);
        for p in params {
            self.copy(p.init, p.param, &all);
        }
        let mut active = mask.clone();
        loop {
            // Masks and the values that the loop carries.
            self.spend(4 + params.len() as u64, &active);
            self.next_round(span)?;
            self.steps(body, &active)?;
            // All results first: a next value may itself be a parameter.
            for p in params {
                self.copy(p.next, p.result, &active);
            }
            match self.arg(cond) {
                Arg::Same(word) if word[0].bits() == 0 => return Ok(()),
                Arg::Same(_) => {}
                Arg::Each(lanes) => {
                    active = active.split(self.isa, lanes).0;
                    if !active.any() {
                        return Ok(());
                    }
                }
            }
            for p in params {
                self.copy(p.result, p.param, &all);
            }
        }
    }
}
