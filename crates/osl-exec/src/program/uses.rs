//! The last use of each value, and the values that are only views into others.

use osl_ir::ir::{BlockId, Body, Inst, LaneOp, Op, Source, ValueId};

/// Finds the views and the last use of every value, numbering positions exactly as the compiler does.
pub(super) struct Uses<'a> {
    body: &'a Body,
    /// For a view, the value into whose register it points, and the component.
    pub(super) views: Vec<Option<(ValueId, u32)>>,
    /// Position of the last use of each value.
    pub(super) last_use: Vec<u32>,
    defined: Vec<u32>,
    /// The instruction of each value, unless it is a parameter of a loop.
    definers: Vec<Option<&'a Inst>>,
    /// For the results of branches, the position at which the branch ends.
    ends: Vec<u32>,
    position: u32,
}

impl<'a> Uses<'a> {
    /// Those of a body, including its outputs.
    pub(super) fn of(body: &'a Body) -> Uses<'a> {
        let values = body.values.len();
        let mut uses = Uses {
            body,
            views: vec![None; values],
            last_use: vec![0; values],
            defined: vec![0; values],
            definers: vec![None; values],
            ends: vec![0; values],
            position: 0,
        };
        uses.block(body.entry, &mut Vec::new());
        let end = uses.position + 1;
        for output in &body.outputs {
            if let Source::Value(v) = output.source {
                uses.touch(v, end);
            }
        }
        uses
    }

    /// The value into whose register a view points; another value itself.
    pub(super) fn root(&self, v: ValueId) -> ValueId {
        self.views.get(v.index()).copied().flatten().map_or(v, |(root, _)| root)
    }

    /// The instruction of a value.
    pub(super) fn definer(&self, v: ValueId) -> Option<&'a Inst> {
        self.definers.get(v.index()).copied().flatten()
    }

    /// The position of the instruction of a value.
    pub(super) fn defined_at(&self, v: ValueId) -> u32 {
        self.defined.get(v.index()).copied().unwrap_or(0)
    }

    /// The position at which the branch ends that has this result.
    pub(super) fn end(&self, v: ValueId) -> u32 {
        self.ends.get(v.index()).copied().unwrap_or(0)
    }

    /// The position of the last use of a value.
    pub(super) fn last_use(&self, v: ValueId) -> u32 {
        self.last_use.get(v.index()).copied().unwrap_or(u32::MAX)
    }

    /// Records a use at a position.
    fn touch(&mut self, v: ValueId, at: u32) {
        let root = self.root(v);
        let Some(last) = self.last_use.get_mut(root.index()) else { return };
        *last = (*last).max(at);
    }

    fn used(&mut self, v: ValueId, loops: &mut [LoopScope]) {
        let root = self.root(v);
        self.touch(root, self.position);
        let defined = self.defined_at(root);
        for scope in loops.iter_mut().filter(|scope| defined <= scope.start) {
            scope.outside.push(root);
        }
    }

    fn define(&mut self, inst: &'a Inst) {
        for r in &inst.results {
            self.defined[r.index()] = self.position;
            self.definers[r.index()] = Some(inst);
            self.last_use[r.index()] = self.last_use[r.index()].max(self.position);
        }
    }

    fn block(&mut self, id: BlockId, loops: &mut Vec<LoopScope>) {
        let body = self.body;
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::If { cond, then, otherwise, then_yields, else_yields } => {
                    self.used(*cond, loops);
                    self.define(inst);
                    self.position += 1;
                    self.block(*then, loops);
                    then_yields.iter().for_each(|v| self.used(*v, loops));
                    self.position += 1;
                    self.block(*otherwise, loops);
                    else_yields.iter().for_each(|v| self.used(*v, loops));
                    // Either side writes the results, so they are live during both.
                    for r in &inst.results {
                        self.touch(*r, self.position);
                        self.ends[r.index()] = self.position;
                    }
                    self.position += 1;
                }
                Op::Loop { init, params, body: inner, cond, next } => {
                    init.iter().for_each(|v| self.used(*v, loops));
                    self.define(inst);
                    params.iter().for_each(|p| self.defined[p.index()] = self.position + 1);
                    loops.push(LoopScope { start: self.position, outside: Vec::new() });
                    self.position += 1;
                    self.block(*inner, loops);
                    next.iter().for_each(|v| self.used(*v, loops));
                    self.used(*cond, loops);
                    let outside = loops.pop().map(|scope| scope.outside).unwrap_or_default();
                    // Values from outside that an iteration reads are read again by the next one.
                    for v in
                        outside.into_iter().chain(params.iter().copied()).chain(inst.results.iter().copied())
                    {
                        self.touch(v, self.position);
                    }
                    self.position += 1;
                }
                op => {
                    op.for_each_use(|v| self.used(v, loops));
                    self.define(inst);
                    self.note_view(inst);
                    self.position += 1;
                }
            }
        }
    }

    fn note_view(&mut self, inst: &Inst) {
        let (Op::Lane(op, args), [result]) = (&inst.op, inst.results.as_slice()) else { return };
        let component = match op {
            LaneOp::X => 0,
            LaneOp::Y => 1,
            LaneOp::Z => 2,
            _ => return,
        };
        let Some(triple) = args.first() else { return };
        if self.body.value(*result).rate == self.body.value(*triple).rate {
            self.views[result.index()] = Some((*triple, component));
        }
    }
}

struct LoopScope {
    start: u32,
    outside: Vec<ValueId>,
}
