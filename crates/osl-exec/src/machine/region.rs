//! Branches and loops that run as machine code.
//!
//! A region is compiled once it has taken enough work. Its code runs for all lanes of the batch and counts
//! the work of each vector; the batch is charged the largest count. If a vector exceeds what a point may
//! still spend, or an index is out of range, the arrays are restored and the interpreter runs the region
//! instead, with the same verdict as ever. It also runs the region if lanes are counted one by one, and for
//! profiles, which show the steps within.

use super::{Machine, Mask};
use crate::arithmetic::ArithmeticImpl;
use crate::error::RunError;
use crate::native::{Files, Form, RegionPlan, each_operand};
use crate::program::Program;
use crate::register::Lanes;
use crate::step::{Location, Step};
use osl_lanes::Word;
use osl_native::Outcome;
use std::sync::Arc;

/// Maximum work of a vector in one call, some tens of milliseconds: a region that takes more is interpreted.
const MOST: u64 = 1 << 26;
/// Work after which a machine checks whether the command has to end.
const CHECK: u32 = 1 << 20;
/// Maximum number of groups of cells that a region reads.
const MAX_GROUPS: usize = 16;

/// What a machine knows about a region.
#[derive(Debug, Default)]
pub(super) struct State {
    /// The groups of cells that it reads, once it is compiled.
    groups: Option<Vec<u16>>,
    plans: Vec<(Form, Option<Arc<RegionPlan>>)>,
}

/// The states of the regions of a program.
pub(super) fn states(program: &Program) -> Vec<State> {
    (0..program.regions).map(|_| State::default()).collect()
}

impl State {
    /// The form of the region for a mask, given which groups have one cell.
    fn form(&mut self, region: u32, step: &Step, mask: &Mask, is_one: impl Fn(u16) -> bool) -> Option<Form> {
        let groups = self.groups.get_or_insert_with(|| {
            let mut groups = Vec::new();
            each_operand(step, &mut |operand| {
                if let Location::Lanes { cells: Some(cells), .. } = operand.location
                    && !groups.contains(&cells.group)
                {
                    groups.push(cells.group);
                }
            });
            groups
        });
        if groups.len() > MAX_GROUPS {
            return None;
        }
        let ones = groups.iter().fold(0, |all, group| all << 1 | u32::from(is_one(*group)));
        Some(Form { region, all: matches!(mask, Mask::All(_)), ones })
    }
}

impl<'a, A: ArithmeticImpl> Machine<'a, A> {
    /// Counts work that the interpretation of a region took.
    pub(super) fn note_region(&self, region: u32, steps: u64) {
        self.program.native.note_region(region, steps, self.lanes);
    }

    /// Runs a region as machine code. Returns whether it did; if not, nothing was changed that it reads.
    ///
    /// # Errors
    /// The command has to end.
    pub(super) fn region(&mut self, region: u32, step: &'a Step, mask: &Mask) -> Result<bool, RunError> {
        let Some(plan) = self.region_plan(region, step, mask) else { return Ok(false) };
        let left = self.work.left().min(MOST) as u32;
        let (limits, width) = (self.limits, self.width);
        let Some(native) = &mut self.native else { return Ok(false) };
        let (mut results, mut before) = std::mem::take(&mut self.region_memory);
        results.resize(plan.uniform.len() * width, 0);
        before.clear();
        for array in &plan.written {
            before.extend_from_slice(self.arrays.get(*array as usize).map_or(&[], Lanes::words));
        }
        let numbers = self.region_numbers.len() as u32..width as u32;
        self.region_numbers.extend(numbers);
        let tables = self.per_cell.tables();
        let mut files = Files {
            mask: mask.bits(),
            numbers: &self.region_numbers,
            results: &mut results,
            ..Files::new((&mut self.registers, &mut self.arrays), tables, &self.words, &mut self.broadcasts)
        };
        let mut since = 0;
        let outcome = plan.run(&mut files, self.lanes, &mut native.scratch, left, |spent| {
            since += spent;
            if since < CHECK {
                return true;
            }
            since = 0;
            limits.halted().is_none()
        });
        if let (Outcome::Spent(most), Some(lane)) = (outcome, mask.first()) {
            for (at, lanes) in plan.uniform.iter().zip(results.chunks(width)) {
                if let (Some(word), Some(bits)) = (self.words.get_mut(*at as usize), lanes.get(lane)) {
                    *word = A::Word::of(*bits);
                }
            }
            self.work.add_all(most.into());
            plan.written.iter().for_each(|array| self.touch_array(*array));
        } else {
            let mut rest = &before[..];
            for array in &plan.written {
                let Some(array) = self.arrays.get_mut(*array as usize) else { continue };
                let words = array.words_mut();
                let Some((own, after)) = rest.split_at_checked(words.len()) else { continue };
                words.copy_from_slice(own);
                rest = after;
            }
        }
        self.region_memory = (results, before);
        debug_assert!(outcome != Outcome::Refused, "the arrays of a region are those of its code");
        match (outcome, limits.halted()) {
            (Outcome::Spent(_), _) => Ok(true),
            (_, Some(why)) => Err(RunError::Halted(why)),
            (_, None) => Ok(false),
        }
    }

    /// The machine code of a region, if it runs as such now.
    fn region_plan(&mut self, region: u32, step: &'a Step, mask: &Mask) -> Option<Arc<RegionPlan>> {
        let (style, native) = (A::NATIVE?, self.native.as_ref()?);
        if self.work.counts_lanes() || self.per_cell.is_running() || self.profile.is_some() {
            return None;
        }
        let plans = &self.program.native;
        if !native.is_worth(plans, region) {
            if let Step::If { then, otherwise, .. } = step {
                self.note_region(region, then.weight + otherwise.weight);
            }
            return None;
        }
        let state = self.regions.get_mut(region as usize)?;
        let shape = native.shape(style, self.width)?;
        let per_cell = &self.per_cell;
        let is_one = |group: u16| per_cell.is_one(group);
        let form = state.form(region, step, mask, is_one)?;
        if let Some((_, plan)) = state.plans.iter().find(|(have, _)| *have == form) {
            return plan.clone();
        }
        let program = self.program;
        let constant = |at| program.constant(at);
        let make = |shape| RegionPlan::new(step, form, shape, (&constant, &program.arrays), &is_one);
        let plan = native.region(plans, (shape, form), make)?;
        state.plans.push((form, plan.clone()));
        plan
    }
}
