//! What the requested outputs need, assignment by assignment.
//!
//! It walks a lowered body with notes backwards, before variables become values, and finds the variables that
//! may still be read. An assignment is needed if its variable is. An outermost loop is walked until a walk
//! finds nothing new; the loops in it are walked once each time, so that the cost of nested loops does not
//! grow with a power of their depth.

use osl_ir::ir::{BlockId, Body, Inst, Kernel, Note, Op, SlotId, Source, ValueId};
use osl_limits::Limits;
use rustc_hash::{FxHashMap, FxHashSet};

/// What the outputs of a body need.
pub(super) struct Needs {
    /// Sites of the assignments that no output needs.
    pub(super) unused: FxHashSet<u32>,
    /// Sites of the assignments whose variable is assigned again before anything reads it.
    pub(super) again: FxHashSet<u32>,
    values: Vec<bool>,
}

impl Needs {
    /// Whether a value is needed.
    pub(super) fn value(&self, value: ValueId) -> bool {
        self.values.get(value.index()).copied().unwrap_or(true)
    }

    /// The needs of the outputs of a body; `known` has the conditions that are always true or always false.
    /// If the limits stop the walk, some needs are missing.
    pub(super) fn of(body: &Body, known: &FxHashMap<ValueId, bool>, limits: &Limits) -> Needs {
        let mut live = Live::new(body.slots.len());
        let mut walk = Walk::new(body, known, limits);
        for output in &body.outputs {
            match output.source {
                Source::Slot(slot) => live.add(slot),
                Source::Value(value) => walk.need(value),
            }
        }
        walk.block(body.entry, &mut live);
        let (values, unused) = (std::mem::take(&mut walk.values), walk.unused());
        // If all variables were read at the end, these would still be unused.
        let mut all = Live::all(body.slots.len());
        let mut walk = Walk::new(body, known, limits);
        walk.block(body.entry, &mut all);
        Needs { unused, again: walk.unused(), values }
    }
}

/// The slots that may be read later.
#[derive(Clone, PartialEq, Eq)]
struct Live(Vec<u64>);

impl Live {
    fn new(slots: usize) -> Live {
        Live(vec![0; slots.div_ceil(64)])
    }

    fn all(slots: usize) -> Live {
        Live(vec![u64::MAX; slots.div_ceil(64)])
    }

    fn add(&mut self, slot: SlotId) {
        if let Some(word) = self.0.get_mut(slot.index() / 64) {
            *word |= 1 << (slot.index() % 64);
        }
    }

    fn remove(&mut self, slot: SlotId) {
        if let Some(word) = self.0.get_mut(slot.index() / 64) {
            *word &= !(1 << (slot.index() % 64));
        }
    }

    fn has(&self, slot: SlotId) -> bool {
        self.0.get(slot.index() / 64).is_some_and(|word| word >> (slot.index() % 64) & 1 == 1)
    }

    fn join(&mut self, other: &Live) {
        self.0.iter_mut().zip(&other.0).for_each(|(a, b)| *a |= b);
    }
}

struct Walk<'a> {
    body: &'a Body,
    known: &'a FxHashMap<ValueId, bool>,
    limits: &'a Limits,
    values: Vec<bool>,
    /// Sites of needed assignments.
    used: FxHashSet<u32>,
    /// Sites of all assignments.
    sets: FxHashSet<u32>,
    /// What is known of each loop, by its block. It only grows from one visit to the next.
    loops: FxHashMap<BlockId, LoopState>,
    /// The number of loops around the instruction.
    depth: usize,
    /// Whether anything new was found since the last walk of the outermost loop began.
    is_new: bool,
}

/// What is known of a loop.
#[derive(Clone)]
struct LoopState {
    /// The slots that are live where it begins.
    head: Live,
    /// Whether it does something that is needed.
    does: bool,
}

impl Walk<'_> {
    fn new<'a>(body: &'a Body, known: &'a FxHashMap<ValueId, bool>, limits: &'a Limits) -> Walk<'a> {
        Walk {
            body,
            known,
            limits,
            values: vec![false; body.values.len()],
            used: FxHashSet::default(),
            sets: FxHashSet::default(),
            loops: FxHashMap::default(),
            depth: 0,
            is_new: false,
        }
    }

    /// Sites of the assignments that nothing needs.
    fn unused(self) -> FxHashSet<u32> {
        self.sets.into_iter().filter(|site| !self.used.contains(site)).collect()
    }

    fn need(&mut self, value: ValueId) {
        if let Some(flag) = self.values.get_mut(value.index()) {
            self.is_new |= !*flag;
            *flag = true;
        }
    }

    fn needed(&self, inst: &Inst) -> bool {
        inst.results.iter().any(|r| self.values.get(r.index()).copied().unwrap_or(false))
    }

    /// Walks a block backwards; `live` is what is live after it, then before it. Returns whether the block
    /// has something that is needed.
    fn block(&mut self, id: BlockId, live: &mut Live) -> bool {
        let mut does = false;
        // The note of the assignment whose store comes next.
        let mut pending: Option<u32> = None;
        for inst in self.body.block(id).insts.iter().rev() {
            let note = pending.take();
            does |= self.inst(inst, live, note, &mut pending);
        }
        does
    }

    fn inst(&mut self, inst: &Inst, live: &mut Live, note: Option<u32>, pending: &mut Option<u32>) -> bool {
        match &inst.op {
            Op::Kernel(Kernel::Note { site, note }, _) => {
                if let Note::Set(_) = note {
                    self.sets.insert(*site);
                    *pending = Some(*site);
                }
                false
            }
            Op::Store(slot, _) | Op::StoreElement(slot, ..) => {
                if !live.has(*slot) {
                    return false;
                }
                if let Op::Store(..) = inst.op {
                    live.remove(*slot);
                }
                inst.op.for_each_use(|value| self.need(value));
                self.used.extend(note);
                true
            }
            Op::Load(slot) | Op::LoadElement(slot, _) => {
                if self.needed(inst) {
                    live.add(*slot);
                    inst.op.for_each_use(|value| self.need(value));
                }
                false
            }
            Op::Kernel(kernel, args) => {
                let writes = kernel.writes().is_some_and(|slot| live.has(slot));
                let runs = kernel.has_effect() || writes;
                if runs || self.needed(inst) {
                    args.iter().for_each(|arg| self.need(*arg));
                    if let Some(slot) = kernel.reads() {
                        live.add(slot);
                    }
                }
                runs
            }
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                for (result, (a, b)) in inst.results.iter().zip(then_yields.iter().zip(else_yields)) {
                    if self.values.get(result.index()).copied().unwrap_or(false) {
                        self.need(*a);
                        self.need(*b);
                    }
                }
                let mut does = true;
                match self.known.get(cond) {
                    Some(true) => drop(self.block(*then, live)),
                    Some(false) => drop(self.block(*otherwise, live)),
                    None => {
                        let mut other = live.clone();
                        does = self.block(*then, live);
                        does |= self.block(*otherwise, &mut other);
                        live.join(&other);
                    }
                }
                if does || self.needed(inst) {
                    self.need(*cond);
                }
                does
            }
            Op::Loop { body, cond, init, next, .. } => {
                // Lowered loops carry no values.
                init.iter().chain(next).for_each(|value| self.need(*value));
                self.a_loop(*body, *cond, live)
            }
            op => {
                if self.needed(inst) {
                    op.for_each_use(|value| self.need(value));
                }
                false
            }
        }
    }

    /// Walks a loop. Its body runs at least once.
    fn a_loop(&mut self, body: BlockId, cond: ValueId, live: &mut Live) -> bool {
        loop {
            if self.depth == 0 {
                self.is_new = false;
            }
            let known = self.loops.get(&body).cloned();
            let mut does = known.as_ref().is_some_and(|known| known.does);
            if does {
                self.need(cond);
            }
            let mut head = live.clone();
            known.iter().for_each(|known| head.join(&known.head));
            self.depth += 1;
            does |= self.block(body, &mut head);
            self.depth -= 1;
            known.iter().for_each(|known| head.join(&known.head));
            let is_same = known.is_some_and(|known| known.does == does && known.head == head);
            self.is_new |= !is_same;
            let is_done = self.depth > 0 || !self.is_new || self.limits.halted().is_some();
            if is_done && does {
                // A loop that does nothing is dropped: then what is live after it is live before it.
                live.clone_from(&head);
            }
            self.loops.insert(body, LoopState { head, does });
            if is_done {
                return does;
            }
        }
    }
}
