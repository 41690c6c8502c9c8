//! Removes what no output needs: values, results of branches, loop parameters, stores to arrays that nobody
//! reads.

use crate::ir::{BlockId, Body, Inst, Op, SlotId, Source, ValueId};

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut needs = Needs { of_values: Graph::default(), of_slots: Graph::default(), of_blocks: Vec::new() };
    needs.of_blocks.resize(body.blocks.len(), None);
    let mut work = Vec::new();
    needs.block(body, body.entry, &mut work);
    work.extend(body.outputs.iter().map(|output| match output.source {
        Source::Value(v) => Node::Value(v),
        Source::Slot(s) => Node::Slot(s),
    }));
    let mut live = Live {
        values: vec![false; body.values.len()],
        slots: vec![false; body.slots.len()],
        blocks: vec![false; body.blocks.len()],
    };
    // Each is taken up once, with what it needs, so that chains through loops and arrays cost no more than others.
    while let Some(node) = work.pop() {
        if live.mark(node) {
            needs.follow(node, &mut work);
        }
    }
    sweep(body, body.entry, &live);
}

/// What can be needed.
#[derive(Clone, Copy)]
enum Node {
    Value(ValueId),
    Slot(SlotId),
    /// A block in which something is live: whatever decides whether it runs is live too.
    Block(BlockId),
}

/// What each of some things needs.
#[derive(Default)]
struct Graph(Vec<Vec<Node>>);

impl Graph {
    fn add(&mut self, from: usize, needs: impl IntoIterator<Item = Node>) {
        if self.0.len() <= from {
            self.0.resize_with(from + 1, Vec::new);
        }
        self.0[from].extend(needs);
    }
}

/// What values, arrays and blocks need.
struct Needs {
    of_values: Graph,
    of_slots: Graph,
    /// The condition and the block around a nested block.
    of_blocks: Vec<Option<(ValueId, BlockId)>>,
}

impl Needs {
    fn follow(&self, node: Node, work: &mut Vec<Node>) {
        match node {
            Node::Value(v) => work.extend(self.of_values.0.get(v.index()).into_iter().flatten().copied()),
            Node::Slot(s) => work.extend(self.of_slots.0.get(s.index()).into_iter().flatten().copied()),
            Node::Block(b) => {
                if let Some((cond, around)) = self.of_blocks.get(b.index()).copied().flatten() {
                    work.extend([Node::Value(cond), Node::Block(around)]);
                }
            }
        }
    }

    fn values(&mut self, results: &[ValueId], needs: &[Node]) {
        results.iter().for_each(|r| self.of_values.add(r.index(), needs.iter().copied()));
    }

    /// Notes what the instructions of a block need; those that nobody has to ask for become work.
    fn block(&mut self, body: &Body, id: BlockId, work: &mut Vec<Node>) {
        for inst in &body.block(id).insts {
            self.inst(body, inst, id, work);
        }
    }

    fn inst(&mut self, body: &Body, inst: &Inst, here: BlockId, work: &mut Vec<Node>) {
        match &inst.op {
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                    self.values(&[*r], &[*a, *b, *cond].map(Node::Value));
                    self.values(&[*r], &[Node::Block(here)]);
                }
                for side in [*then, *otherwise] {
                    self.of_blocks[side.index()] = Some((*cond, here));
                    self.block(body, side, work);
                }
            }
            Op::Loop { init, params, body: inner, cond, next } => {
                for (((r, p), i), n) in inst.results.iter().zip(params).zip(init).zip(next) {
                    self.values(&[*r, *p], &[Node::Value(*i), Node::Value(*n), Node::Block(*inner)]);
                }
                self.of_blocks[inner.index()] = Some((*cond, here));
                self.block(body, *inner, work);
            }
            op => {
                let mut needs = vec![Node::Block(here)];
                op.for_each_use(|v| needs.push(Node::Value(v)));
                let mut written = None;
                match op {
                    Op::Load(slot) | Op::LoadElement(slot, _) => needs.push(Node::Slot(*slot)),
                    Op::Store(slot, _) | Op::StoreElement(slot, ..) => written = Some(*slot),
                    Op::Kernel(kernel, _) => {
                        needs.extend(kernel.reads().map(Node::Slot));
                        written = kernel.writes();
                        if kernel.has_effect() {
                            work.extend(needs.iter().copied());
                        }
                    }
                    _ => {}
                }
                self.values(&inst.results, &needs);
                if let Some(slot) = written {
                    self.of_slots.add(slot.index(), needs);
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
    /// Marks a node. Tells whether it was not yet marked.
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
