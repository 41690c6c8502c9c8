//! Removes what no output needs: values, results of branches, loop parameters, stores to arrays that nobody
//! reads.

use crate::ir::{BlockId, Body, Inst, Op, SlotId, Source, ValueId};

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut live =
        Live { values: vec![false; body.values.len()], slots: vec![false; body.slots.len()], changed: false };
    for output in &body.outputs {
        match output.source {
            Source::Value(v) => live.value(v),
            Source::Slot(s) => live.slot(s),
        }
    }
    // Loops and arrays carry demand backward past where it was seen, so until nothing changes.
    loop {
        live.changed = false;
        live.block(body, body.entry);
        if !live.changed {
            break;
        }
    }
    sweep(body, body.entry, &live);
}

struct Live {
    values: Vec<bool>,
    slots: Vec<bool>,
    changed: bool,
}

impl Live {
    fn value(&mut self, v: ValueId) {
        if let Some(live) = self.values.get_mut(v.index()) {
            self.changed |= !*live;
            *live = true;
        }
    }

    fn slot(&mut self, s: SlotId) {
        if let Some(live) = self.slots.get_mut(s.index()) {
            self.changed |= !*live;
            *live = true;
        }
    }

    fn is_live(&self, v: ValueId) -> bool {
        self.values.get(v.index()).copied().unwrap_or(false)
    }

    fn slot_is_live(&self, s: SlotId) -> bool {
        self.slots.get(s.index()).copied().unwrap_or(false)
    }

    /// Marks what the live instructions of a block need, last first. Tells whether any is live.
    fn block(&mut self, body: &Body, id: BlockId) -> bool {
        let mut any = false;
        for inst in body.block(id).insts.iter().rev() {
            any |= self.inst(body, inst);
        }
        any
    }

    fn inst(&mut self, body: &Body, inst: &Inst) -> bool {
        let wanted: Vec<bool> = inst.results.iter().map(|r| self.is_live(*r)).collect();
        let any_result = wanted.contains(&true);
        match &inst.op {
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                for ((want, a), b) in wanted.iter().zip(then_yields).zip(else_yields) {
                    if *want {
                        self.value(*a);
                        self.value(*b);
                    }
                }
                // Both sides are visited whatever the first says.
                let inside = self.block(body, *then) | self.block(body, *otherwise);
                if any_result || inside {
                    self.value(*cond);
                }
                any_result || inside
            }
            Op::Loop { init, params, body: inner, cond, next } => {
                for (index, want) in wanted.iter().enumerate() {
                    let param = params.get(index).is_some_and(|p| self.is_live(*p));
                    if *want || param {
                        next.get(index).into_iter().chain(init.get(index)).for_each(|v| self.value(*v));
                    }
                }
                let inside = self.effect_inside(body, *inner);
                if any_result || inside {
                    self.value(*cond);
                    self.block(body, *inner);
                }
                any_result || inside
            }
            Op::Store(slot, _) | Op::StoreElement(slot, ..) => {
                let live = self.slot_is_live(*slot);
                if live {
                    inst.op.for_each_use(|v| self.value(v));
                }
                live
            }
            op => {
                if !any_result && !self.has_effect(op) {
                    return false;
                }
                match op {
                    Op::Load(slot) | Op::LoadElement(slot, _) => self.slot(*slot),
                    Op::Kernel(kernel, _) => kernel.reads().into_iter().for_each(|s| self.slot(s)),
                    _ => {}
                }
                op.for_each_use(|v| self.value(v));
                true
            }
        }
    }

    /// Whether somebody needs what an operation does beside its results.
    fn has_effect(&self, op: &Op) -> bool {
        match op {
            Op::Store(slot, _) | Op::StoreElement(slot, ..) => self.slot_is_live(*slot),
            Op::Kernel(kernel, _) => {
                kernel.has_effect() || kernel.writes().is_some_and(|s| self.slot_is_live(s))
            }
            _ => false,
        }
    }

    /// Whether a block has an effect that somebody needs.
    fn effect_inside(&self, body: &Body, id: BlockId) -> bool {
        body.block(id).insts.iter().any(|inst| match &inst.op {
            Op::If { then, otherwise, .. } => {
                self.effect_inside(body, *then) || self.effect_inside(body, *otherwise)
            }
            Op::Loop { body: inner, .. } => self.effect_inside(body, *inner),
            op => self.has_effect(op),
        })
    }
}

fn sweep(body: &mut Body, id: BlockId, live: &Live) {
    let insts = std::mem::take(&mut body.blocks[id.index()].insts);
    let mut kept = Vec::with_capacity(insts.len());
    for mut inst in insts {
        let keep = match &mut inst.op {
            Op::If { then, otherwise, then_yields, else_yields, .. } => {
                sweep(body, *then, live);
                sweep(body, *otherwise, live);
                let wanted: Vec<bool> = inst.results.iter().map(|r| live.is_live(*r)).collect();
                for list in [then_yields, else_yields, &mut inst.results] {
                    retain(list, &wanted);
                }
                !inst.results.is_empty()
                    || !body.block(*then).insts.is_empty()
                    || !body.block(*otherwise).insts.is_empty()
            }
            Op::Loop { init, params, body: inner, next, .. } => {
                let stays = inst.results.iter().any(|r| live.is_live(*r)) || live.effect_inside(body, *inner);
                if stays {
                    sweep(body, *inner, live);
                }
                let wanted: Vec<bool> = inst
                    .results
                    .iter()
                    .zip(params.iter())
                    .map(|(r, p)| live.is_live(*r) || live.is_live(*p))
                    .collect();
                for list in [init, params, next, &mut inst.results] {
                    retain(list, &wanted);
                }
                stays
            }
            op => live.has_effect(op) || inst.results.iter().any(|r| live.is_live(*r)),
        };
        if keep {
            kept.push(inst);
        }
    }
    body.blocks[id.index()].insts = kept;
}

fn retain(list: &mut Vec<ValueId>, wanted: &[bool]) {
    let mut flags = wanted.iter();
    list.retain(|_| flags.next().copied().unwrap_or(false));
}
