//! Places the layers of a group in its body: the entries one after another, each other layer before its first
//! use, and layers that run at every point before the body of the first entry.

use super::Lowerer;
use super::first_use::{self, Spot};
use super::layers::{Lowered, leaves};
use super::wiring::Wiring;
use osl_ir::ir::{BlockId, Body, Inst, Kernel, Op, Sink, SlotId, Source};
use osl_ir::passes::dce;

impl Lowerer<'_> {
    /// Joins the layers to one body that begins with the block of the first entry. `globals` are the slots of
    /// the shader globals.
    pub(super) fn place_layers(&mut self, wiring: &Wiring<'_>, done: &[Option<Lowered>], globals: &[SlotId]) {
        if done.len() > 1 {
            self.drop_unneeded(wiring, done, globals);
        }
        let lowered = |index: &usize| done.get(*index).and_then(Option::as_ref);
        // The order of execution: the parameters of the first entry, layers that run at every point, its
        // body, the other entries.
        let front = self.b.block();
        let mut blocks: Vec<BlockId> = Vec::new();
        for entry in wiring.entries.iter().filter_map(lowered) {
            let first = blocks.is_empty();
            blocks.push(entry.block);
            blocks.extend(first.then_some(front));
            blocks.push(entry.body);
        }
        for (index, layer) in done.iter().enumerate().rev() {
            let Some(layer) = layer else { continue };
            let slots: Vec<SlotId> = layer.params.iter().flat_map(leaves).collect();
            if wiring.entries.contains(&index) {
                self.place_entry(layer, &slots, &mut blocks);
                continue;
            }
            let found = first_use::across(&self.b.body, &blocks, &slots);
            let spot = if self.runs_anyway(index, layer, wiring, globals) {
                let parameters = blocks.first().copied();
                let needed_there = found.map(|f| f.outer).filter(|spot| Some(spot.block) == parameters);
                Some(needed_there.unwrap_or(Spot { block: front, index: 0 }))
            } else {
                found.map(|f| f.inner)
            };
            self.splice(layer.block, spot);
        }
        let Some((first, rest)) = blocks.split_first() else { return };
        for block in rest {
            self.append(*block, *first);
        }
    }

    /// Moves the code that sets the variable of a global to its first use, and drops it if there is none.
    /// This code is before `start`, two instructions for each. A global that is an output stays there.
    pub(super) fn place_globals(&mut self, start: Spot, globals: &[SlotId]) {
        let Some(entry) = self.b.body.blocks.get_mut(start.block.index()) else { return };
        let written: Vec<Inst> = entry.insts.drain(..start.index.min(entry.insts.len())).collect();
        let is_output = |slot: &SlotId| self.b.body.outputs.iter().any(|o| o.source == Source::Slot(*slot));
        let (outputs, others): (Vec<usize>, Vec<usize>) =
            (0..globals.len()).partition(|index| is_output(&globals[*index]));
        let owners = others.iter().map(|index| (globals[*index], *index)).collect();
        let found = first_use::of(&self.b.body, start.block, &owners);
        let mut places: Vec<(BlockId, usize, usize)> =
            found.into_iter().map(|(global, spot)| (spot.block, spot.index, global)).collect();
        places.extend(outputs.into_iter().map(|global| (start.block, 0, global)));
        // The last first, so that the other places stay valid.
        places.sort_unstable();
        for (block, index, global) in places.into_iter().rev() {
            let code = written.get(2 * global..2 * global + 2).unwrap_or_default();
            if let Some(block) = self.b.body.blocks.get_mut(block.index()) {
                block.insts.splice(index..index, code.iter().cloned());
            }
        }
    }

    /// Removes code that only leads to unused outputs, so that layers do not run for these.
    fn drop_unneeded(&mut self, wiring: &Wiring<'_>, done: &[Option<Lowered>], globals: &[SlotId]) {
        let mut layers = Vec::new();
        for (index, layer) in done.iter().enumerate() {
            let Some(layer) = layer else { continue };
            let of = |param: usize| layer.params.get(param).into_iter().flat_map(leaves);
            let asked = wiring.asked.iter().filter(|asked| asked.layer == index);
            let mut outputs: Vec<SlotId> = asked.flat_map(|asked| of(asked.param)).collect();
            if index + 1 == done.len() {
                let delivered = wiring.delivered.iter().enumerate().filter(|(_, delivered)| **delivered);
                outputs.extend(delivered.flat_map(|(param, _)| of(param)));
            }
            layers.push(dce::Lazy {
                blocks: [layer.block, layer.body],
                slots: layer.params.iter().flat_map(leaves).collect(),
                outputs,
                runs: wiring.entries.contains(&index) || self.runs_anyway(index, layer, wiring, globals),
            });
        }
        // Globals and messages are shared between layers.
        let messages = self.b.messages.iter().flat_map(|m| m.slots());
        let shared: Vec<SlotId> = globals.iter().copied().chain(messages).collect();
        dce::lazy(&mut self.b.body, &layers, &shared);
    }

    /// Moves an entry before the code that needs it in an earlier one. It always runs, so it is not placed in
    /// a branch.
    fn place_entry(&mut self, entry: &Lowered, slots: &[SlotId], blocks: &mut Vec<BlockId>) {
        let own = blocks.iter().position(|block| *block == entry.block).unwrap_or(0);
        let earlier = blocks.get(..own).unwrap_or(&[]);
        if let Some(found) = first_use::across(&self.b.body, earlier, slots) {
            self.append(entry.body, entry.block);
            self.splice(entry.block, Some(found.outer));
            blocks.retain(|block| ![entry.block, entry.body].contains(block));
        }
    }

    /// Whether a layer runs at every point, needed or not.
    fn runs_anyway(&self, index: usize, layer: &Lowered, wiring: &Wiring<'_>, globals: &[SlotId]) -> bool {
        let (body, rules) = (&self.b.body, wiring.rules);
        let writes_globals = || globals.iter().any(|g| first_use::is_stored(body, layer.block, 0, *g));
        let eager = || {
            rules.eager_globals && writes_globals()
                || rules.eager_errors && runs(body, layer.block, &reports)
                || rules.eager_traces && runs(body, layer.block, &|kernel| matches!(kernel, Kernel::Trace))
                || rules.eager_unconnected && !wiring.leaves(index)
        };
        wiring.asks(index) || rules.is_eager() && eager()
    }

    /// Appends the instructions of a block to another.
    pub(super) fn append(&mut self, block: BlockId, to: BlockId) {
        let index = self.b.body.block(to).insts.len();
        self.splice(block, Some(Spot { block: to, index }));
    }

    /// Inserts the instructions of a block at a place in another; does nothing without a place.
    pub(super) fn splice(&mut self, block: BlockId, spot: Option<Spot>) {
        let insts = std::mem::take(&mut self.b.body.blocks[block.index()].insts);
        if let Some(spot) = spot {
            self.b.body.blocks[spot.block.index()].insts.splice(spot.index..spot.index, insts);
        }
    }
}

/// Whether an operation reports a shader error.
fn reports(kernel: &Kernel) -> bool {
    matches!(kernel, Kernel::Print { sink: Sink::Error, .. })
}

/// Whether a block may run such an operation.
fn runs(body: &Body, block: BlockId, wanted: &dyn Fn(&Kernel) -> bool) -> bool {
    body.insts_from(block).any(|inst| matches!(&inst.op, Op::Kernel(kernel, _) if wanted(kernel)))
}
