//! Finds what the points of a batch share.
//!
//! A value is uniform if all that it is made from is, and no varying condition chooses it. All is taken for
//! uniform at first and demoted until nothing changes, so that loop counters stay uniform.

use crate::hir::Global;
use crate::ir::{BlockId, Body, Op, Rate, SlotId, ValueId};

/// Runs the pass. `varying` and `slopes`: the globals that differ from point to point, and those whose change from pixel to pixel does.
pub(super) fn run(body: &mut Body, varying: &[Global], slopes: &[Global]) {
    let mut rates = Rates {
        varying: vec![false; body.values.len()],
        slots: vec![false; body.slots.len()],
        globals: varying,
        slopes,
        changed: false,
    };
    loop {
        rates.changed = false;
        rates.block(body, body.entry, false);
        if !rates.changed {
            break;
        }
    }
    let rate = |varying: &bool| if *varying { Rate::Varying } else { Rate::Uniform };
    for (value, varying) in body.values.iter_mut().zip(&rates.varying) {
        value.rate = rate(varying);
    }
    for (slot, varying) in body.slots.iter_mut().zip(&rates.slots) {
        slot.rate = rate(varying);
    }
}

struct Rates<'a> {
    varying: Vec<bool>,
    slots: Vec<bool>,
    globals: &'a [Global],
    slopes: &'a [Global],
    changed: bool,
}

impl Rates<'_> {
    fn get(&self, v: ValueId) -> bool {
        self.varying.get(v.index()).copied().unwrap_or(true)
    }

    fn demote(&mut self, v: ValueId, to: bool) {
        if to
            && let Some(varying) = self.varying.get_mut(v.index())
            && !*varying
        {
            *varying = true;
            self.changed = true;
        }
    }

    fn demote_slot(&mut self, slot: SlotId) {
        if let Some(varying) = self.slots.get_mut(slot.index())
            && !*varying
        {
            *varying = true;
            self.changed = true;
        }
    }

    /// `diverged`: whether some points of the batch may not run the block.
    fn block(&mut self, body: &Body, id: BlockId, diverged: bool) {
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::Const(_) => {}
                Op::Slope(global, _) => {
                    let varying = self.slopes.contains(global);
                    inst.results.iter().for_each(|r| self.demote(*r, varying));
                }
                Op::Global(global) => {
                    let varying = self.globals.contains(global);
                    inst.results.iter().for_each(|r| self.demote(*r, varying));
                }
                Op::Lane(_, args) => {
                    let varying = args.iter().any(|a| self.get(*a));
                    inst.results.iter().for_each(|r| self.demote(*r, varying));
                }
                Op::Kernel(kernel, args) => {
                    let reads = kernel.reads().is_some_and(|s| self.slots[s.index()]);
                    let varying = kernel.is_varying() || reads || args.iter().any(|a| self.get(*a));
                    inst.results.iter().for_each(|r| self.demote(*r, varying));
                    if let Some(slot) = kernel.writes().filter(|_| varying || diverged) {
                        self.demote_slot(slot);
                    }
                }
                // The `derive` pass has replaced it.
                Op::Derivative(..) => inst.results.iter().for_each(|r| self.demote(*r, true)),
                // Scalar slots are gone; where they are not, nothing is known.
                Op::Load(_) => inst.results.iter().for_each(|r| self.demote(*r, true)),
                Op::Store(..) => {}
                Op::LoadElement(slot, index) => {
                    let varying = self.get(*index) || self.slots[slot.index()];
                    inst.results.iter().for_each(|r| self.demote(*r, varying));
                }
                Op::StoreElement(slot, index, value) => {
                    if diverged || self.get(*index) || self.get(*value) {
                        self.demote_slot(*slot);
                    }
                }
                Op::If { cond, then, otherwise, then_yields, else_yields } => {
                    let split = self.get(*cond);
                    self.block(body, *then, diverged || split);
                    self.block(body, *otherwise, diverged || split);
                    for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                        let varying = split || self.get(*a) || self.get(*b);
                        self.demote(*r, varying);
                    }
                }
                Op::Loop { init, params, body: inner, cond, next } => {
                    let split = self.get(*cond);
                    for ((p, i), n) in params.iter().zip(init).zip(next) {
                        // Points that leave in different rounds keep different values.
                        let varying = self.get(*i) || self.get(*n) || split;
                        self.demote(*p, varying);
                    }
                    self.block(body, *inner, diverged || split);
                    for (r, p) in inst.results.iter().zip(params) {
                        let varying = self.get(*p);
                        self.demote(*r, varying);
                    }
                    for (r, n) in inst.results.iter().zip(next) {
                        let varying = self.get(*n) || self.get(*cond);
                        self.demote(*r, varying);
                    }
                }
            }
        }
    }
}
