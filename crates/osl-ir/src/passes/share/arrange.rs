//! Moves roots before their groups, and writes the groups.

use super::find::Groups;
use crate::ir::{BlockId, Body, Inst, Op, Rate, Value, ValueId};
use rustc_hash::FxHashMap;

/// Writes the groups that are worth sharing.
pub(super) fn arrange(body: &mut Body, groups: &Groups) {
    let before = (body.blocks.clone(), body.values.len());
    let mut arrange = Arrange {
        body,
        groups,
        state: vec![State::Open; groups.len()],
        numbers: vec![0; groups.len()],
        per_cell: FxHashMap::default(),
        count: 0,
        knotted: false,
    };
    arrange.block(arrange.body.entry);
    if arrange.knotted {
        body.blocks = before.0;
        body.values.truncate(before.1);
        return;
    }
    let numbers = arrange.numbers;
    for (index, value) in body.values.iter_mut().enumerate().take(before.1) {
        if value.rate == Rate::Varying
            && let Some(group) = groups.of(ValueId(index as u32))
        {
            value.rate = Rate::PerCell(numbers[group]);
        }
    }
}

/// Whether a group has been written.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Open,
    /// Its roots are being computed.
    Busy,
    Written,
}

struct Arrange<'a> {
    body: &'a mut Body,
    groups: &'a Groups,
    state: Vec<State>,
    /// Numbers of the groups, in the order in which they are written.
    numbers: Vec<u16>,
    /// The value per cell of a root in its group.
    per_cell: FxHashMap<(usize, ValueId), ValueId>,
    count: u16,
    /// Groups need each other's roots: all of this must be discarded.
    knotted: bool,
}

/// A block that is being arranged.
struct Block {
    insts: Vec<Option<Inst>>,
    /// The instruction of the block that defines a value.
    defined: FxHashMap<ValueId, usize>,
    out: Vec<Inst>,
    id: BlockId,
}

impl Arrange<'_> {
    fn block(&mut self, id: BlockId) {
        let insts = std::mem::take(&mut self.body.blocks[id.index()].insts);
        let mut defined = FxHashMap::default();
        for (at, inst) in insts.iter().enumerate() {
            defined.extend(inst.results.iter().map(|r| (*r, at)));
        }
        let out = Vec::with_capacity(insts.len() + 4);
        let mut block = Block { insts: insts.into_iter().map(Some).collect(), defined, out, id };
        for at in 0..block.insts.len() {
            self.emit(at, &mut block);
        }
        self.body.blocks[id.index()].insts = block.out;
    }

    /// Writes an instruction, unless it was written already, after the groups that it belongs to.
    fn emit(&mut self, at: usize, block: &mut Block) {
        let Some(mut inst) = block.insts.get_mut(at).and_then(Option::take) else { return };
        let mut needed = Vec::new();
        self.groups_in(&inst, &mut needed);
        for group in needed {
            if self.groups.get(group).block == block.id {
                self.write(group, block);
            }
        }
        let own = inst.results.first().and_then(|r| self.groups.of(*r));
        if let Some(group) = own {
            self.rename(&mut inst, group);
        } else {
            inst.op.blocks().for_each(|id| self.block(id));
        }
        block.out.push(inst);
    }

    /// The groups of an instruction, or of one nested in it.
    fn groups_in(&self, inst: &Inst, found: &mut Vec<usize>) {
        for group in inst.results.iter().filter_map(|r| self.groups.of(*r)) {
            if !found.contains(&group) {
                found.push(group);
            }
        }
        for block in inst.op.blocks() {
            self.body.block(block).insts.iter().for_each(|inst| self.groups_in(inst, found));
        }
    }

    /// Writes the sharing of a group after its roots.
    fn write(&mut self, group: usize, block: &mut Block) {
        match self.state[group] {
            State::Written => return,
            State::Busy => {
                self.knotted = true;
                return;
            }
            State::Open => self.state[group] = State::Busy,
        }
        let roots = self.groups.get(group).roots.clone();
        for root in &roots {
            self.compute(*root, block);
        }
        let (number, span) = (self.count, self.body.value(roots[0]).span);
        self.count += 1;
        self.numbers[group] = number;
        let mut results = crate::ir::Values::new();
        for root in &roots {
            let Value { kind, span, .. } = *self.body.value(*root);
            self.body.values.push(Value { kind, rate: Rate::PerCell(number), span });
            let result = ValueId(self.body.values.len() as u32 - 1);
            self.per_cell.insert((group, *root), result);
            results.push(result);
        }
        block.out.push(Inst { op: Op::Share(number, roots), results, span });
        self.state[group] = State::Written;
    }

    /// Writes the instructions that compute a value, unless they were written already; their operands first.
    /// Uses its own stack, since chains may be as long as programs.
    fn compute(&mut self, value: ValueId, block: &mut Block) {
        let mut work: Vec<(usize, bool)> =
            block.defined.get(&value).map(|at| (*at, false)).into_iter().collect();
        while let Some((at, ready)) = work.pop() {
            if ready {
                self.emit(at, block);
                continue;
            }
            let Some(Some(inst)) = block.insts.get(at) else { continue };
            work.push((at, true));
            inst.op.for_each_use(|v| {
                if let Some(at) = block.defined.get(&v) {
                    work.push((*at, false));
                }
            });
        }
    }

    /// Makes a member of a group read the values per cell of its roots.
    fn rename(&mut self, inst: &mut Inst, group: usize) {
        inst.op.replace_uses(|v| self.per_cell.get(&(group, v)).copied().unwrap_or(v));
        if let Op::If { then, otherwise, .. } = inst.op {
            for id in [then, otherwise] {
                let mut insts = std::mem::take(&mut self.body.blocks[id.index()].insts);
                insts.iter_mut().for_each(|inst| self.rename(inst, group));
                self.body.blocks[id.index()].insts = insts;
            }
        }
    }
}
