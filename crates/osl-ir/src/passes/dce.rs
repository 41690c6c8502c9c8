//! Dead code elimination: removes what no output needs, namely values, results of branches, loop parameters,
//! and stores to arrays that are never read.

use crate::ir::{BlockId, Body, Inst, Op, SlotId, Source, ValueId, Values};

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut needs = Needs::new(body);
    let mut work = Vec::new();
    needs.block(body, body.entry, &mut work);
    work.extend(body.outputs.iter().map(|output| match output.source {
        Source::Value(v) => Node::Value(v),
        Source::Slot(s) => Node::Slot(s),
    }));
    let live = needs.live(body, work);
    sweep(body, body.entry, &live);
}

/// Blocks that run only where one of their slots is read.
pub struct Lazy {
    /// The blocks.
    pub blocks: [BlockId; 2],
    /// Slots that are read only after the blocks have run.
    pub slots: Vec<SlotId>,
    /// Those of them that hold outputs of the body.
    pub outputs: Vec<SlotId>,
    /// Whether they always run.
    pub runs: bool,
}

/// Removes unneeded code from blocks that are not placed yet: code that only leads to unused outputs and to
/// blocks that do not run. All blocks read and write the `shared` slots.
pub fn lazy(body: &mut Body, layers: &[Lazy], shared: &[SlotId]) {
    let mut needs = Needs::new(body);
    needs.shared = vec![false; body.slots.len()];
    for slot in shared {
        if let Some(flag) = needs.shared.get_mut(slot.index()) {
            *flag = true;
        }
    }
    let mut work: Vec<Node> = shared.iter().copied().map(Node::Slot).collect();
    for Lazy { blocks, slots, outputs, runs } in layers {
        // An effect counts only where the blocks run.
        let mut effects = Vec::new();
        for block in blocks {
            needs.block(body, *block, &mut effects);
        }
        let start = needs.nodes.len();
        needs.nodes.append(&mut effects);
        let range = (start, needs.nodes.len());
        for slot in slots {
            if let Some(of_slot) = needs.of_slots.get_mut(slot.index()) {
                of_slot.push(range);
            }
        }
        work.extend(outputs.iter().copied().map(Node::Slot));
        if *runs {
            work.extend_from_slice(needs.nodes(range));
        }
    }
    let live = needs.live(body, work);
    for block in layers.iter().flat_map(|layer| layer.blocks) {
        sweep(body, block, &live);
    }
}

/// A node of the graph of needs.
#[derive(Clone, Copy)]
enum Node {
    Value(ValueId),
    Slot(SlotId),
    /// A live block; the conditions that decide whether it runs are live too.
    Block(BlockId),
}

/// A range of the list of nodes.
type Range = (usize, usize);

/// The needs of values, arrays and blocks: ranges of one list, since a list for each value would be too
/// expensive.
struct Needs {
    nodes: Vec<Node>,
    of_values: Vec<Range>,
    of_slots: Vec<Vec<Range>>,
    /// The condition and the surrounding block of a nested block.
    of_blocks: Vec<Option<(ValueId, BlockId)>>,
    /// Slots for which each store is an effect.
    shared: Vec<bool>,
}

impl Needs {
    fn new(body: &Body) -> Needs {
        Needs {
            nodes: Vec::with_capacity(4 * body.values.len()),
            of_values: vec![Range::default(); body.values.len()],
            of_slots: vec![Vec::new(); body.slots.len()],
            of_blocks: vec![None; body.blocks.len()],
            shared: Vec::new(),
        }
    }

    /// Everything that the nodes of `work` need. Each node is visited once, with its needs, so that chains
    /// through loops and arrays cost no more than others.
    fn live(&self, body: &Body, mut work: Vec<Node>) -> Live {
        let mut live = Live {
            values: vec![false; body.values.len()],
            slots: vec![false; body.slots.len()],
            blocks: vec![false; body.blocks.len()],
        };
        while let Some(node) = work.pop() {
            if live.mark(node) {
                self.follow(node, &mut work);
            }
        }
        live
    }

    fn nodes(&self, range: Range) -> &[Node] {
        self.nodes.get(range.0..range.1).unwrap_or(&[])
    }

    fn follow(&self, node: Node, work: &mut Vec<Node>) {
        match node {
            Node::Value(v) => {
                let range = self.of_values.get(v.index()).copied().unwrap_or_default();
                work.extend_from_slice(self.nodes(range));
            }
            Node::Slot(s) => {
                let ranges = self.of_slots.get(s.index()).into_iter().flatten();
                ranges.for_each(|range| work.extend_from_slice(self.nodes(*range)));
            }
            Node::Block(b) => {
                if let Some((cond, around)) = self.of_blocks.get(b.index()).copied().flatten() {
                    work.extend([Node::Value(cond), Node::Block(around)]);
                }
            }
        }
    }

    /// Records the needs of values that are defined together: the nodes after `start`.
    fn values(&mut self, results: &[ValueId], start: usize) -> Range {
        let range = (start, self.nodes.len());
        for result in results {
            if let Some(of_value) = self.of_values.get_mut(result.index()) {
                *of_value = range;
            }
        }
        range
    }

    /// Records the needs of a block's instructions; instructions that are always live become work.
    fn block(&mut self, body: &Body, id: BlockId, work: &mut Vec<Node>) {
        for inst in &body.block(id).insts {
            self.inst(body, inst, id, work);
        }
    }

    fn inst(&mut self, body: &Body, inst: &Inst, here: BlockId, work: &mut Vec<Node>) {
        let start = self.nodes.len();
        match &inst.op {
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                    let start = self.nodes.len();
                    self.nodes.extend([*a, *b, *cond].map(Node::Value));
                    self.nodes.push(Node::Block(here));
                    self.values(&[*r], start);
                }
                for side in [*then, *otherwise] {
                    self.of_blocks[side.index()] = Some((*cond, here));
                    self.block(body, side, work);
                }
            }
            Op::Loop { init, params, body: inner, cond, next } => {
                for (((r, p), i), n) in inst.results.iter().zip(params).zip(init).zip(next) {
                    let start = self.nodes.len();
                    self.nodes.extend([Node::Value(*i), Node::Value(*n), Node::Block(*inner)]);
                    self.values(&[*r, *p], start);
                }
                self.of_blocks[inner.index()] = Some((*cond, here));
                self.block(body, *inner, work);
            }
            op => {
                self.nodes.push(Node::Block(here));
                op.for_each_use(|v| self.nodes.push(Node::Value(v)));
                let (mut written, mut effect) = (None, false);
                match op {
                    Op::Load(slot) | Op::LoadElement(slot, _) => self.nodes.push(Node::Slot(*slot)),
                    Op::Store(slot, _) | Op::StoreElement(slot, ..) => written = Some(*slot),
                    Op::Kernel(kernel, _) => {
                        self.nodes.extend(kernel.reads().map(Node::Slot));
                        written = kernel.writes();
                        effect = kernel.has_effect();
                    }
                    _ => {}
                }
                let range = self.values(&inst.results, start);
                if let Some(true) = written.and_then(|slot| self.shared.get(slot.index())) {
                    (written, effect) = (None, true);
                }
                if effect {
                    work.extend_from_slice(self.nodes(range));
                }
                if let Some(of_slot) = written.and_then(|slot| self.of_slots.get_mut(slot.index())) {
                    of_slot.push(range);
                }
            }
        }
    }
}

struct Live {
    values: Vec<bool>,
    slots: Vec<bool>,
    blocks: Vec<bool>,
}

impl Live {
    /// Marks a node. Returns whether it was unmarked before.
    fn mark(&mut self, node: Node) -> bool {
        let flag = match node {
            Node::Value(v) => self.values.get_mut(v.index()),
            Node::Slot(s) => self.slots.get_mut(s.index()),
            Node::Block(b) => self.blocks.get_mut(b.index()),
        };
        flag.is_some_and(|live| !std::mem::replace(live, true))
    }

    fn is_live(&self, v: ValueId) -> bool {
        self.values.get(v.index()).copied().unwrap_or(false)
    }

    fn slot_is_live(&self, s: SlotId) -> bool {
        self.slots.get(s.index()).copied().unwrap_or(false)
    }

    /// Whether an operation has a needed effect besides its results.
    fn has_effect(&self, op: &Op) -> bool {
        match op {
            Op::Store(slot, _) | Op::StoreElement(slot, ..) => self.slot_is_live(*slot),
            Op::Kernel(kernel, _) => {
                kernel.has_effect() || kernel.writes().is_some_and(|s| self.slot_is_live(s))
            }
            _ => false,
        }
    }

    /// Whether a block has a needed effect.
    fn effect_inside(&self, body: &Body, id: BlockId) -> bool {
        body.insts_from(id).any(|inst| self.has_effect(&inst.op))
    }
}

fn sweep(body: &mut Body, id: BlockId, live: &Live) {
    let mut insts = std::mem::take(&mut body.blocks[id.index()].insts);
    insts.retain_mut(|inst| match &mut inst.op {
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
    });
    body.blocks[id.index()].insts = insts;
}

fn retain(list: &mut Values, wanted: &[bool]) {
    let mut flags = wanted.iter();
    list.retain(|_| flags.next().copied().unwrap_or(false));
}
