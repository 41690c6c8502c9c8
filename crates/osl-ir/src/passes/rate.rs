//! Finds the values that are uniform over a batch.
//!
//! A value is uniform if everything that it is computed from is uniform, and no varying condition selects it.
//! All values are assumed uniform at first, and varying ones demote those computed from them, so that loop
//! counters stay uniform.

use crate::global::Global;
use crate::ir::{BlockId, Body, Inst, Kernel, LaneOp, Op, Rate, SlotId, ValueId};
use smallvec::SmallVec;

/// Runs the pass. `varying` and `derivs` are the globals that differ from point to point, and those whose
/// derivatives do.
pub(super) fn run(body: &mut Body, varying: &[Global], derivs: &[Global]) {
    let (values, varies) = (body.values.len(), reached(body, Begin::Points { globals: varying, derivs }));
    let rate = |varying: &bool| if *varying { Rate::Varying } else { Rate::Uniform };
    for (value, varying) in body.values.iter_mut().zip(&varies) {
        value.rate = rate(varying);
    }
    for (slot, varying) in body.slots.iter_mut().zip(&varies[values..]) {
        slot.rate = rate(varying);
    }
}

/// Whether live parameters decide more than values: a branch, the rounds of a loop, or what counts as a
/// constant (see `fold::meaning`). With a constant in place of such a parameter, other code is compiled, and
/// some results may differ. The body is one before the passes.
pub fn inputs_decide(body: &Body) -> bool {
    let reached = reached(body, Begin::Inputs);
    let is = |value: Option<&ValueId>| value.is_some_and(|v| reached.get(v.index()).copied().unwrap_or(true));
    body.blocks.iter().flat_map(|block| &block.insts).any(|inst| match &inst.op {
        Op::If { cond, .. } | Op::Loop { cond, .. } => is(Some(cond)),
        Op::Lane(LaneOp::FDiv | LaneOp::Fmod | LaneOp::Mod, args) => is(args.get(1)),
        Op::Kernel(Kernel::IsConstant | Kernel::ColorBetween, args) => {
            args.iter().take(2).any(|a| is(Some(a)))
        }
        _ => false,
    })
}

/// What a search for values begins with.
#[derive(Clone, Copy)]
enum Begin<'a> {
    /// What differs from point to point.
    Points {
        /// Globals.
        globals: &'a [Global],
        /// Globals whose derivatives differ.
        derivs: &'a [Global],
    },
    /// The live parameters.
    Inputs,
}

/// The nodes of [`Flow`] that depend on its beginnings.
fn reached(body: &Body, from: Begin<'_>) -> Vec<bool> {
    let (values, slots) = (body.values.len(), body.slots.len());
    let demotes = vec![Edges::new(); values + slots + body.blocks.len()];
    let mut flow = Flow { from, values, slots, demotes, work: Vec::new() };
    flow.block(body, body.entry);
    let Flow { demotes, mut work, .. } = flow;
    let mut reached = vec![false; demotes.len()];
    while let Some(node) = work.pop() {
        if let Some(flag) = reached.get_mut(node)
            && !std::mem::replace(flag, true)
        {
            work.extend(demotes[node].iter().map(|to| *to as usize));
        }
    }
    reached
}

/// The nodes that a node demotes. Most demote few, which need no allocation.
type Edges = SmallVec<[u32; 4]>;

/// The graph of demotions. Nodes are the values, then the slots, then the blocks: a block is varying if some
/// points of the batch may not execute it.
struct Flow<'a> {
    from: Begin<'a>,
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

    fn slot(&self, slot: SlotId) -> usize {
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
        for inst in &body.block(id).insts {
            self.inst(body, id, inst);
        }
    }

    fn inst(&mut self, body: &Body, id: BlockId, inst: &Inst) {
        let here = self.of_block(id);
        let begins = |flow: &mut Self| flow.work.extend(inst.results.iter().map(|r| r.index()));
        match (&inst.op, self.from) {
            (Op::Input(_), Begin::Inputs) => begins(self),
            (Op::Global(global), Begin::Points { globals, .. }) if globals.contains(global) => begins(self),
            (Op::GlobalDeriv(global, _), Begin::Points { derivs, .. }) if derivs.contains(global) => {
                begins(self)
            }
            // The `derive` pass has replaced it, and scalar slots are gone. If not, nothing is known.
            (Op::Derivative(..) | Op::Load(_), Begin::Points { .. }) => begins(self),
            (Op::Const(_) | Op::Input(_) | Op::Global(_) | Op::GlobalDeriv(..), _) => {}
            // Written later, from varying values.
            (Op::Share(..), _) => {}
            (Op::Lane(_, args), _) => self.edges(args, &inst.results),
            (Op::Derivative(value, _), _) => self.edges(&[*value], &inst.results),
            (Op::Kernel(kernel, args), from) => {
                self.edges(args, &inst.results);
                let read = kernel.reads().map(|s| self.slot(s));
                let written = kernel.writes().map(|s| self.slot(s));
                if kernel.is_varying() && matches!(from, Begin::Points { .. }) {
                    begins(self);
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
            (Op::Load(slot), _) => self.load(*slot, inst),
            (Op::LoadElement(slot, index), _) => {
                self.edges(&[*index], &inst.results);
                self.load(*slot, inst);
            }
            (Op::Store(slot, value), _) => {
                let to = self.slot(*slot);
                [value.index(), here].into_iter().for_each(|from| self.edge(from, to));
            }
            (Op::StoreElement(slot, index, value), _) => {
                let to = self.slot(*slot);
                [index.index(), value.index(), here].into_iter().for_each(|from| self.edge(from, to));
            }
            (Op::If { cond, then, otherwise, then_yields, else_yields }, _) => {
                self.nested(body, *then, *cond, id);
                self.nested(body, *otherwise, *cond, id);
                for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                    self.edges(&[*cond, *a, *b], &[*r]);
                }
            }
            (Op::Loop { init, params, body: inner, cond, next }, _) => {
                self.nested(body, *inner, *cond, id);
                // Points that leave in different iterations keep different values.
                for (((r, p), i), n) in inst.results.iter().zip(params).zip(init).zip(next) {
                    self.edges(&[*i, *n, *cond], &[*p]);
                    self.edges(&[*p, *n, *cond], &[*r]);
                }
            }
        }
    }

    /// A value that is read from a slot.
    fn load(&mut self, slot: SlotId, inst: &Inst) {
        let from = self.slot(slot);
        inst.results.iter().for_each(|r| self.edge(from, r.index()));
    }
}
