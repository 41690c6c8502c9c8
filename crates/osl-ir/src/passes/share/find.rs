//! Finds the instructions that form groups, and their roots.

use crate::ir::{
    BlockId, Body, Continuity, Inst, Kernel, Kind, LaneOp, NoiseField, Op, Rate, ValueId, Values,
};
use smallvec::smallvec;

/// Sets of groups are words with this many bits; no further groups are made.
const MAX_GROUPS: usize = 128;
/// More roots than this hardly ever have few combinations.
const MAX_ROOTS: usize = 8;
/// Loads of elements that are worth sharing: those of the four knots of a spline.
const LOADS: u32 = 4;

/// A group of instructions over the same roots.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// The block that its roots are defined in.
    pub(super) block: BlockId,
    /// Its roots, in the order of the program.
    pub(super) roots: Values,
    /// Whether it contains work that is worth sharing.
    pub(super) heavy: bool,
    /// Number of loads of elements.
    loads: u32,
    /// Position in the block before which its roots must be computed.
    start: u32,
    /// The group into which it was merged.
    merged: Option<usize>,
}

/// The facts about a value.
#[derive(Clone, Copy, Debug, Default)]
struct ValueFacts {
    /// It takes few different values among neighbours.
    stepped: bool,
    /// The group that computes it.
    member: Option<usize>,
    /// The group that it is a root of.
    root: Option<usize>,
    /// Groups that it depends on through values of single points.
    made_from: u128,
    /// The block that defines it, and the position before which it cannot be computed in that block.
    block: u32,
    earliest: u32,
}

/// The groups of a body.
#[derive(Debug)]
pub(super) struct Groups {
    known: Vec<ValueFacts>,
    groups: Vec<Group>,
}

/// Finds the groups.
pub(super) fn find(body: &Body) -> Groups {
    let groups = Groups { known: vec![ValueFacts::default(); body.values.len()], groups: Vec::new() };
    let mut find = Find { body, groups, around: Vec::new() };
    find.block(body.entry);
    find.groups
}

impl Groups {
    /// Whether any group contains work that is worth sharing.
    pub(super) fn is_worth_it(&self) -> bool {
        self.groups.iter().any(|g| g.merged.is_none() && g.heavy)
    }

    /// The group into which a group was merged, finally.
    fn now(&self, mut group: usize) -> usize {
        while let Some(next) = self.groups.get(group).and_then(|g| g.merged) {
            group = next;
        }
        group
    }

    fn known(&self, v: ValueId) -> ValueFacts {
        self.known.get(v.index()).copied().unwrap_or_default()
    }

    /// The group worth computing to which a value belongs.
    pub(super) fn of(&self, v: ValueId) -> Option<usize> {
        let group = self.now(self.known(v).member?);
        self.get(group).heavy.then_some(group)
    }

    /// A group by its number.
    pub(super) fn get(&self, group: usize) -> &Group {
        &self.groups[group]
    }

    /// How many numbers of groups there are.
    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    /// A set with merged groups under their current number.
    fn current(&self, set: u128) -> u128 {
        (0..self.groups.len()).filter(|g| set >> g & 1 != 0).fold(0, |all, g| all | 1 << self.now(g))
    }

    /// Merges two groups, unless there is a reason against it. Roots of neither may depend on the other,
    /// because all roots come first; and two groups that are each worth sharing have fewer combinations
    /// separately.
    fn merge(&mut self, a: usize, b: usize) -> Option<usize> {
        let (a, b) = (self.now(a), self.now(b));
        if a == b {
            return Some(a);
        }
        let (x, y) = (&self.groups[a], &self.groups[b]);
        let start = x.start.min(y.start);
        let fits = |roots: &[ValueId], other: usize| {
            roots.iter().all(|r| {
                let known = self.known(*r);
                known.earliest <= start && self.current(known.made_from) >> other & 1 == 0
            })
        };
        if x.roots.len() + y.roots.len() > MAX_ROOTS
            || x.block != y.block
            || (x.heavy && y.heavy)
            || !fits(&x.roots, b)
            || !fits(&y.roots, a)
        {
            return None;
        }
        let Group { roots, heavy, loads, .. } = self.groups[b].clone();
        self.groups[b].merged = Some(a);
        let group = &mut self.groups[a];
        group.roots.extend(roots);
        group.roots.sort();
        group.loads += loads;
        group.heavy |= heavy || group.loads >= LOADS;
        group.start = start;
        Some(a)
    }
}

struct Find<'a> {
    body: &'a Body,
    groups: Groups,
    /// The blocks around the current instruction, and its position in each.
    around: Vec<(BlockId, u32)>,
}

impl Find<'_> {
    fn block(&mut self, id: BlockId) {
        let body = self.body;
        self.around.push((id, 0));
        for (place, inst) in body.block(id).insts.iter().enumerate() {
            if let Some(last) = self.around.last_mut() {
                last.1 = place as u32;
            }
            self.inst(inst);
        }
        self.around.pop();
    }

    /// Position of the current instruction in a surrounding block.
    fn place_in(&self, block: BlockId) -> Option<u32> {
        self.around.iter().find(|(b, _)| *b == block).map(|(_, place)| *place)
    }

    fn inst(&mut self, inst: &Inst) {
        if self.grouped(inst) {
            return;
        }
        if let Op::Loop { params, .. } = &inst.op {
            self.define(params, 0, u32::MAX);
        }
        inst.op.blocks().for_each(|id| self.block(id));
        let mut made_from = 0;
        let mut earliest = 0;
        self.for_each_input(&inst.op, &mut |known, groups| {
            made_from |= known.made_from | known.member.map_or(0, |g| 1 << groups.now(g));
            earliest = earliest.max(known.earliest);
        });
        let here = self.around.last().map_or(0, |(_, place)| *place);
        let earliest = if is_pure(&inst.op) { earliest } else { here + 1 };
        self.define(&inst.results, made_from, earliest);
        for r in &inst.results {
            let stepped = self.body.kind(*r) == Kind::Int || self.steps(&inst.op);
            self.groups.known[r.index()].stepped = stepped;
        }
    }

    fn define(&mut self, values: &[ValueId], made_from: u128, earliest: u32) {
        let (block, here) = self.around.last().copied().unwrap_or((self.body.entry, 0));
        let earliest = if earliest == u32::MAX { here + 1 } else { earliest };
        for v in values {
            self.groups.known[v.index()] =
                ValueFacts { made_from, block: block.0, earliest, ..ValueFacts::default() };
        }
    }

    /// Visits the facts about each value that an operation reads; for a value from a surrounding block, its
    /// position there is irrelevant.
    fn for_each_input(&self, op: &Op, visit: &mut dyn FnMut(ValueFacts, &Groups)) {
        let here = self.around.last().map_or(self.body.entry, |(block, _)| *block);
        let mut all = |v: ValueId| {
            let mut known = self.groups.known(v);
            if known.block != here.0 {
                known.earliest = 0;
            }
            visit(known, &self.groups);
        };
        op.for_each_use(&mut all);
        for inst in op.blocks().flat_map(|block| &self.body.block(block).insts) {
            self.for_each_input(&inst.op, visit);
        }
    }

    /// Whether an operation returns few different values for any arguments, or for arguments with few
    /// different values.
    fn steps(&self, op: &Op) -> bool {
        match op {
            Op::Lane(op, args) => is_step(*op) || self.all_stepped(args),
            Op::Kernel(Kernel::Noise { field: NoiseField::Cell, has_derivs: false, .. }, _) => true,
            Op::Kernel(Kernel::Noise { .. }, args) => self.all_stepped(args),
            _ => false,
        }
    }

    fn all_stepped(&self, args: &[ValueId]) -> bool {
        args.iter().all(|a| self.body.value(*a).rate == Rate::Uniform || self.groups.known(*a).stepped)
    }

    /// Puts an instruction into a group, if there is one group for all of its operands.
    fn grouped(&mut self, inst: &Inst) -> bool {
        let results = inst.results.clone();
        let mut members = Members { inputs: Vec::new(), heavy: false, loads: 0, results };
        if !self.collect(inst, &mut members) || members.inputs.is_empty() {
            return false;
        }
        let mut group: Option<usize> = None;
        for v in std::mem::take(&mut members.inputs) {
            let Some(next) = self.group_of_input(v) else { return false };
            group = match group {
                None => Some(next),
                Some(so_far) => match self.groups.merge(so_far, next) {
                    Some(merged) => Some(merged),
                    None => return false,
                },
            };
        }
        let Some(group) = group else { return false };
        let now = self.groups.now(group);
        let Some(place) = self.place_in(self.groups.get(now).block) else { return false };
        let starts = self.groups.get(now).start.min(place);
        if self.groups.get(now).roots.iter().any(|r| self.groups.known(*r).earliest > starts) {
            return false;
        }
        let made_from = {
            let roots = &self.groups.get(now).roots;
            roots.iter().fold(0, |all, r| all | self.groups.known(*r).made_from)
        };
        let entry = &mut self.groups.groups[now];
        entry.start = starts;
        entry.loads += members.loads;
        entry.heavy |= members.heavy || entry.loads >= LOADS;
        self.define(&members.results, made_from, place);
        for r in members.results {
            let known = &mut self.groups.known[r.index()];
            (known.stepped, known.member) = (true, Some(now));
        }
        true
    }

    /// The group of a value that a member reads: its own, or the one that has it as a root.
    fn group_of_input(&mut self, v: ValueId) -> Option<usize> {
        let known = self.groups.known(v);
        if let Some(group) = known.member.or(known.root) {
            return Some(self.groups.now(group));
        }
        let block = BlockId(known.block);
        if self.groups.groups.len() == MAX_GROUPS || self.place_in(block).is_none() {
            return None;
        }
        let group = self.groups.groups.len();
        self.groups.groups.push(Group {
            block,
            roots: smallvec![v],
            heavy: false,
            loads: 0,
            start: self.place_in(block)?,
            merged: None,
        });
        self.groups.known[v.index()].root = Some(group);
        Some(group)
    }

    /// Collects the values that an instruction reads and defines, including nested blocks, if it can be a
    /// member: it must have no effect and read only stepped or uniform values.
    fn collect(&self, inst: &Inst, members: &mut Members) -> bool {
        if inst.results.iter().any(|r| self.body.value(*r).rate == Rate::Uniform) {
            return matches!(inst.op, Op::Const(_) | Op::Lane(..)) && !members.inputs.is_empty();
        }
        match &inst.op {
            Op::Lane(op, args) => {
                // Choices made by single points have fewer results than their conditions have combinations.
                let chosen = crate::ir::is_choice(*op)
                    && args.first().is_some_and(|c| {
                        self.is_varying(*c) && self.groups.known(*c).member.is_none() && !members.defines(*c)
                    });
                !chosen && args.iter().all(|a| self.input(*a, members))
            }
            Op::Kernel(Kernel::Noise { .. }, args) => {
                members.heavy = true;
                args.iter().all(|a| self.input(*a, members))
            }
            // A member stays at its place, after the stores to the array.
            Op::LoadElement(slot, index) => {
                members.loads += 1;
                self.body.slot(*slot).rate == Rate::Uniform && self.input(*index, members)
            }
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                let member = self.groups.known(*cond).member.is_some() || members.defines(*cond);
                member
                    && self.input(*cond, members)
                    && [then, otherwise].into_iter().all(|block| {
                        self.body.block(*block).insts.iter().all(|inst| {
                            members.results.extend(
                                inst.results
                                    .iter()
                                    .copied()
                                    .filter(|r| self.body.value(*r).rate == Rate::Varying),
                            );
                            self.collect(inst, members)
                        })
                    })
                    && then_yields.iter().chain(else_yields).all(|v| self.input(*v, members))
            }
            _ => false,
        }
    }

    fn is_varying(&self, v: ValueId) -> bool {
        self.body.value(v).rate != Rate::Uniform
    }

    /// Records a value that a member reads. Returns false if it prevents membership.
    fn input(&self, v: ValueId, members: &mut Members) -> bool {
        if !self.is_varying(v) || members.defines(v) {
            return true;
        }
        members.inputs.push(v);
        self.groups.known(v).stepped
    }
}

/// An instruction that may become a member.
struct Members {
    /// Values that it reads from outside itself, except uniform ones.
    inputs: Vec<ValueId>,
    heavy: bool,
    /// Number of loads of elements.
    loads: u32,
    /// The values that it defines.
    results: Values,
}

impl Members {
    fn defines(&self, v: ValueId) -> bool {
        self.results.contains(&v)
    }
}

/// Whether a result is a float with steps.
fn is_step(op: LaneOp) -> bool {
    op.continuity() == Continuity::Step && op.shape().result == Kind::Float
}

/// Whether an instruction can be computed as soon as its operands are known.
pub(super) fn is_pure(op: &Op) -> bool {
    match op {
        Op::Const(_) | Op::Global(_) | Op::Input(_) | Op::GlobalDeriv(..) | Op::Lane(..) => true,
        Op::Kernel(kernel, _) => matches!(kernel, Kernel::Noise { .. } | Kernel::SpaceMatrix { .. }),
        _ => false,
    }
}
