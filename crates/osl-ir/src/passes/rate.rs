//! Finds the values that are uniform over a batch.
//!
//! A value is uniform if everything that it is computed from is uniform, and no varying condition selects it.
//! All values are assumed uniform at first, and varying ones demote those computed from them, so that loop
//! counters stay uniform.

use crate::global::Global;
use crate::ir::{BlockId, Body, Op, Rate, ValueId};
use smallvec::SmallVec;

/// Runs the pass. `varying` and `derivs` are the globals that differ from point to point, and those whose
/// derivatives do.
pub(super) fn run(body: &mut Body, varying: &[Global], derivs: &[Global]) {
    let (values, slots) = (body.values.len(), body.slots.len());
    let mut flow = Flow {
        globals: varying,
        derivs,
        values,
        slots,
        demotes: vec![Edges::new(); values + slots + body.blocks.len()],
        work: Vec::new(),
    };
    flow.block(body, body.entry);
    let Flow { demotes, mut work, .. } = flow;
    let mut varies = vec![false; demotes.len()];
    while let Some(node) = work.pop() {
        if let Some(flag) = varies.get_mut(node)
            && !std::mem::replace(flag, true)
        {
            work.extend(demotes[node].iter().map(|to| *to as usize));
        }
    }
    let rate = |varying: &bool| if *varying { Rate::Varying } else { Rate::Uniform };
    for (value, varying) in body.values.iter_mut().zip(&varies) {
        value.rate = rate(varying);
    }
    for (slot, varying) in body.slots.iter_mut().zip(&varies[values..]) {
        slot.rate = rate(varying);
    }
}

/// The nodes that a node demotes. Most demote few, which need no allocation.
type Edges = SmallVec<[u32; 4]>;

/// The graph of demotions. Nodes are the values, then the slots, then the blocks: a block is varying if some
/// points of the batch may not execute it.
struct Flow<'a> {
    globals: &'a [Global],
    derivs: &'a [Global],
    values: usize,
    slots: usize,
    demotes: Vec<Edges>,
    /// Nodes that are varying by themselves.
    work: Vec<usize>,
}

impl Flow<'_> {
    fn edge(&mut self, from: usize, to: usize) {
        if let Some(list) = self.demotes.get_mut(from) {
            list.push(to as u32);
        }
    }

    fn edges(&mut self, from: &[ValueId], to: &[ValueId]) {
        for from in from {
            to.iter().for_each(|to| self.edge(from.index(), to.index()));
        }
    }

    fn slot(&self, slot: crate::ir::SlotId) -> usize {
        self.values + slot.index()
    }

    fn of_block(&self, block: BlockId) -> usize {
        self.values + self.slots + block.index()
    }

    /// A nested block that is executed under a condition.
    fn nested(&mut self, body: &Body, id: BlockId, cond: ValueId, around: BlockId) {
        let block = self.of_block(id);
        self.edge(cond.index(), block);
        self.edge(self.of_block(around), block);
        self.block(body, id);
    }

    fn block(&mut self, body: &Body, id: BlockId) {
        let here = self.of_block(id);
        for inst in &body.block(id).insts {
            let varies = |flow: &mut Self, list: &[ValueId]| flow.work.extend(list.iter().map(|r| r.index()));
            match &inst.op {
                Op::Const(_) | Op::Input(_) | Op::Store(..) => {}
                Op::GlobalDeriv(global, _) if self.derivs.contains(global) => varies(self, &inst.results),
                Op::Global(global) if self.globals.contains(global) => varies(self, &inst.results),
                Op::GlobalDeriv(..) | Op::Global(_) => {}
                // Written later, from varying values.
                Op::Share(..) => {}
                Op::Lane(_, args) => self.edges(args, &inst.results),
                Op::Kernel(kernel, args) => {
                    self.edges(args, &inst.results);
                    let read = kernel.reads().map(|s| self.slot(s));
                    let written = kernel.writes().map(|s| self.slot(s));
                    if kernel.is_varying() {
                        varies(self, &inst.results);
                        self.work.extend(written);
                    }
                    if let Some(from) = read {
                        inst.results.iter().for_each(|r| self.edge(from, r.index()));
                    }
                    if let Some(to) = written {
                        args.iter().for_each(|a| self.edge(a.index(), to));
                        read.into_iter().for_each(|from| self.edge(from, to));
                        self.edge(here, to);
                    }
                }
                // The `derive` pass has replaced it, and scalar slots are gone. If not, nothing is known.
                Op::Derivative(..) | Op::Load(_) => varies(self, &inst.results),
                Op::LoadElement(slot, index) => {
                    self.edges(&[*index], &inst.results);
                    let from = self.slot(*slot);
                    inst.results.iter().for_each(|r| self.edge(from, r.index()));
                }
                Op::StoreElement(slot, index, value) => {
                    let to = self.slot(*slot);
                    [index.index(), value.index(), here].into_iter().for_each(|from| self.edge(from, to));
                }
                Op::If { cond, then, otherwise, then_yields, else_yields } => {
                    self.nested(body, *then, *cond, id);
                    self.nested(body, *otherwise, *cond, id);
                    for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                        self.edges(&[*cond, *a, *b], &[*r]);
                    }
                }
                Op::Loop { init, params, body: inner, cond, next } => {
                    self.nested(body, *inner, *cond, id);
                    // Points that leave in different iterations keep different values.
                    for (((r, p), i), n) in inst.results.iter().zip(params).zip(init).zip(next) {
                        self.edges(&[*i, *n, *cond], &[*p]);
                        self.edges(&[*p, *n, *cond], &[*r]);
                    }
                }
            }
        }
    }
}
