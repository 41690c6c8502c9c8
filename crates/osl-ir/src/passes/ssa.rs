//! Turns scalar slots into values: a load takes the last value stored on its path, and where paths join, the
//! `If` or `Loop` returns the value.

use super::Renaming;
use crate::ir::{BlockId, Body, Const, Inst, Op, SlotId, Source, ValueId};
use osl_syntax::span::Span;
use smallvec::smallvec;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let slots = body.slots.len();
    let mut ssa = Ssa {
        body,
        current: vec![None; slots],
        log: Vec::new(),
        renaming: Renaming::default(),
        zeros: Vec::new(),
    };
    let entry = ssa.body.entry;
    ssa.block(entry);
    for index in 0..ssa.body.outputs.len() {
        if let Source::Slot(slot) = ssa.body.outputs[index].source
            && ssa.is_scalar(slot)
        {
            let value = ssa.read(slot);
            ssa.body.outputs[index].source = Source::Value(value);
        }
    }
    let Ssa { body, zeros, .. } = ssa;
    if let Some(entry) = body.blocks.get_mut(body.entry.index()) {
        entry.insts.splice(0..0, zeros);
    }
}

struct Ssa<'a> {
    body: &'a mut Body,
    /// The value of each scalar slot on the current path.
    current: Vec<Option<ValueId>>,
    /// Slots written, with their previous values, to restore them where paths separate.
    log: Vec<(SlotId, Option<ValueId>)>,
    renaming: Renaming,
    /// Constants for slots that are read before they are written.
    zeros: Vec<Inst>,
}

impl Ssa<'_> {
    fn is_scalar(&self, slot: SlotId) -> bool {
        self.body.slot(slot).len.is_none()
    }

    fn write(&mut self, slot: SlotId, value: ValueId) {
        self.log.push((slot, self.current[slot.index()]));
        self.current[slot.index()] = Some(value);
    }

    fn read(&mut self, slot: SlotId) -> ValueId {
        if let Some(value) = self.current[slot.index()] {
            return value;
        }
        let kind = self.body.slot(slot).kind;
        let zero = self.body.fresh(kind, Span::default());
        self.zeros.push(Inst {
            op: Op::Const(Const::zero(kind)),
            results: smallvec![zero],
            span: Span::default(),
        });
        // Not logged, since it holds on every path.
        self.current[slot.index()] = Some(zero);
        zero
    }

    fn block(&mut self, id: BlockId) {
        let insts = std::mem::take(&mut self.body.blocks[id.index()].insts);
        let mut kept = Vec::with_capacity(insts.len());
        for mut inst in insts {
            // The yields of nested blocks do not exist yet, so only direct arguments are renamed here.
            inst.op.replace_uses(|v| self.renaming.get(v));
            match &inst.op {
                Op::Load(slot) => {
                    let value = self.read(*slot);
                    inst.results.iter().for_each(|r| self.renaming.set(*r, value));
                }
                Op::Store(slot, value) if self.is_scalar(*slot) => self.write(*slot, *value),
                Op::If { .. } => kept.push(self.branch(inst)),
                Op::Loop { .. } => kept.push(self.round(inst)),
                _ => kept.push(inst),
            }
        }
        self.body.blocks[id.index()].insts = kept;
    }

    /// Restores the values at `mark` and returns the slots written since, each once, with its last value.
    fn undo(&mut self, mark: usize) -> Vec<(SlotId, ValueId)> {
        let mut written: Vec<(SlotId, ValueId)> = Vec::new();
        for (slot, before) in self.log.split_off(mark).into_iter().rev() {
            if let Some(value) = self.current[slot.index()] {
                written.push((slot, value));
            }
            self.current[slot.index()] = before;
        }
        // In this reverse order, the first entry of a slot has its last value.
        let mut seen = rustc_hash::FxHashSet::default();
        written.retain(|(slot, _)| seen.insert(*slot));
        written.sort_unstable_by_key(|(slot, _)| *slot);
        written
    }

    fn branch(&mut self, mut inst: Inst) -> Inst {
        let Op::If { then, otherwise, then_yields, else_yields, .. } = &mut inst.op else { return inst };
        let mark = self.log.len();
        self.block(*then);
        let first = self.undo(mark);
        self.block(*otherwise);
        let second = self.undo(mark);
        let mut slots: Vec<SlotId> = first.iter().chain(&second).map(|(slot, _)| *slot).collect();
        slots.sort_unstable();
        slots.dedup();
        let of = |list: &[(SlotId, ValueId)], slot: SlotId| {
            list.binary_search_by_key(&slot, |(s, _)| *s).ok().and_then(|at| list.get(at)).map(|(_, v)| *v)
        };
        for slot in slots {
            let (a, b) = (of(&first, slot), of(&second, slot));
            let a = a.unwrap_or_else(|| self.read(slot));
            let b = b.unwrap_or_else(|| self.read(slot));
            if a == b {
                self.write(slot, a);
                continue;
            }
            let kind = self.body.slot(slot).kind;
            let result = self.body.fresh(kind, inst.span);
            then_yields.push(a);
            else_yields.push(b);
            inst.results.push(result);
            self.write(slot, result);
        }
        inst
    }

    fn round(&mut self, mut inst: Inst) -> Inst {
        let Op::Loop { init, params, body: block, cond, next } = &mut inst.op else { return inst };
        let mut slots = Vec::new();
        self.written(*block, &mut slots);
        slots.sort_unstable();
        slots.dedup();
        for slot in &slots {
            let before = self.read(*slot);
            init.push(before);
            let kind = self.body.slot(*slot).kind;
            let param = self.body.fresh(kind, inst.span);
            params.push(param);
            self.write(*slot, param);
        }
        self.block(*block);
        *cond = self.renaming.get(*cond);
        for slot in &slots {
            next.push(self.read(*slot));
        }
        for slot in slots {
            let kind = self.body.slot(slot).kind;
            let result = self.body.fresh(kind, inst.span);
            inst.results.push(result);
            self.write(slot, result);
        }
        inst
    }

    /// Scalar slots that a block writes, nested blocks included.
    fn written(&self, id: BlockId, out: &mut Vec<SlotId>) {
        out.extend(self.body.insts_from(id).filter_map(|inst| match inst.op {
            Op::Store(slot, _) if self.is_scalar(slot) => Some(slot),
            _ => None,
        }));
    }
}
