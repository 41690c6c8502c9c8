//! Forward-mode derivatives, written as ordinary IR for just the values that are asked for.
//!
//! Texture lookups ask: the area that a point covers is how its coordinates change from pixel to pixel. Demand runs
//! backward from them to the globals; tangents are then written forward, beside the values that they belong to.
//! Rules: OSL language specification, chapter on derivatives. What has no rule here yet (noise, array elements,
//! the less common functions) counts as constant, so that its lookups are sharper than they should be.

use super::rules;
use crate::hir::Global;
use crate::ir::{Axis, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, Rate, Value, ValueId};
use osl_syntax::span::Span;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut demand = Demand { wanted: vec![false; body.values.len()], changed: true, any: false };
    while demand.changed {
        demand.changed = false;
        demand.block(body, body.entry);
    }
    if demand.any {
        let tangents = vec![[None; 2]; body.values.len()];
        let mut writer =
            Writer { body, wanted: demand.wanted, tangents, out: Vec::new(), span: Span::default() };
        writer.block(writer.body.entry);
    }
}

/// Which values need tangents.
struct Demand {
    wanted: Vec<bool>,
    changed: bool,
    /// Whether anything asks for tangents at all.
    any: bool,
}

impl Demand {
    fn has(&self, v: ValueId) -> bool {
        self.wanted.get(v.index()).copied().unwrap_or(false)
    }

    fn want(&mut self, v: ValueId) {
        if let Some(wanted) = self.wanted.get_mut(v.index())
            && !*wanted
        {
            *wanted = true;
            self.changed = true;
        }
    }

    fn block(&mut self, body: &Body, id: BlockId) {
        for inst in body.block(id).insts.iter().rev() {
            match &inst.op {
                Op::Kernel(Kernel::Texture { footprint: false, .. }, args) => {
                    self.any = true;
                    args.iter().skip(1).take(2).for_each(|a| self.want(*a));
                }
                Op::Lane(op, args) if rules::has_rule(*op) && inst.results.iter().any(|r| self.has(*r)) => {
                    args.iter().for_each(|a| self.want(*a));
                }
                Op::If { then, otherwise, then_yields, else_yields, .. } => {
                    for ((r, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                        if self.has(*r) {
                            self.want(*a);
                            self.want(*b);
                        }
                    }
                    self.block(body, *then);
                    self.block(body, *otherwise);
                }
                Op::Loop { init, params, body: inner, next, .. } => {
                    for (((r, p), i), n) in inst.results.iter().zip(params).zip(init).zip(next) {
                        if self.has(*r) || self.has(*p) {
                            [*r, *p, *i, *n].into_iter().for_each(|v| self.want(v));
                        }
                    }
                    self.block(body, *inner);
                }
                _ => {}
            }
        }
    }
}

/// Writes tangents. `None` is a tangent of zero.
pub(super) struct Writer<'a> {
    body: &'a mut Body,
    wanted: Vec<bool>,
    tangents: Vec<[Option<ValueId>; 2]>,
    out: Vec<Inst>,
    span: Span,
}

impl Writer<'_> {
    fn fresh(&mut self, kind: Kind) -> ValueId {
        self.body.values.push(Value { kind, rate: Rate::Varying, span: self.span });
        ValueId(self.body.values.len() as u32 - 1)
    }

    fn push(&mut self, op: Op, kind: Kind) -> ValueId {
        let result = self.fresh(kind);
        self.out.push(Inst { op, results: vec![result], span: self.span });
        result
    }

    /// Writes a lane operation.
    pub(super) fn lane(&mut self, op: LaneOp, args: &[ValueId]) -> ValueId {
        let kind = op.result_kind(args.iter().map(|a| self.body.kind(*a)));
        self.push(Op::Lane(op, args.to_vec()), kind)
    }

    /// Writes a float constant.
    pub(super) fn float(&mut self, x: f32) -> ValueId {
        self.push(Op::Const(Const::Float(x)), Kind::Float)
    }

    /// The tangent of a value along an axis.
    pub(super) fn tangent(&self, v: ValueId, axis: Axis) -> Option<ValueId> {
        self.tangents.get(v.index()).and_then(|t| t[axis as usize])
    }

    /// The tangent, written out as zeros where it is zero.
    pub(super) fn tangent_or_zero(&mut self, v: ValueId, axis: Axis) -> ValueId {
        let tangent = self.tangent(v, axis);
        let kind = self.body.kind(v);
        tangent.unwrap_or_else(|| self.push(Op::Const(Const::zero(kind)), kind))
    }

    fn set(&mut self, v: ValueId, axis: Axis, tangent: Option<ValueId>) {
        if self.tangents.len() <= v.index() {
            self.tangents.resize(v.index() + 1, [None; 2]);
        }
        self.tangents[v.index()][axis as usize] = tangent;
    }

    fn wants(&self, v: ValueId) -> bool {
        let smooth = matches!(self.body.kind(v), Kind::Float | Kind::Triple);
        smooth && self.wanted.get(v.index()).copied().unwrap_or(false)
    }

    fn block(&mut self, id: BlockId) {
        let insts = std::mem::take(&mut self.body.blocks[id.index()].insts);
        let outer = std::mem::take(&mut self.out);
        for inst in insts {
            self.inst(inst);
        }
        self.body.blocks[id.index()].insts = std::mem::replace(&mut self.out, outer);
    }

    /// Adds the tangents of some values to the end of a block that is written already.
    fn yields(&mut self, block: BlockId, values: &[ValueId], into: &mut Vec<ValueId>) {
        let outer = std::mem::take(&mut self.out);
        for v in values {
            for axis in Axis::BOTH {
                let tangent = self.tangent_or_zero(*v, axis);
                into.push(tangent);
            }
        }
        let mut added = std::mem::replace(&mut self.out, outer);
        self.body.blocks[block.index()].insts.append(&mut added);
    }

    fn inst(&mut self, inst: Inst) {
        self.span = inst.span;
        match inst.op {
            Op::If { .. } => self.branch(inst),
            Op::Loop { .. } => self.round(inst),
            Op::Kernel(Kernel::Texture { triple, options, footprint: false }, mut args) => {
                let (s, t) = (args.get(1).copied(), args.get(2).copied());
                for axis in Axis::BOTH {
                    for coordinate in s.into_iter().chain(t) {
                        let tangent = self.tangent_or_zero(coordinate, axis);
                        args.push(tangent);
                    }
                }
                let op = Op::Kernel(Kernel::Texture { triple, options, footprint: true }, args);
                self.out.push(Inst { op, ..inst });
            }
            op => {
                let result = inst.results.first().copied();
                self.out.push(Inst { op: op.clone(), ..inst });
                if let Some(result) = result.filter(|r| self.wants(*r)) {
                    for axis in Axis::BOTH {
                        let tangent = self.of(&op, result, axis);
                        self.set(result, axis, tangent);
                    }
                }
            }
        }
    }

    fn of(&mut self, op: &Op, result: ValueId, axis: Axis) -> Option<ValueId> {
        match op {
            Op::Global(global @ (Global::P | Global::U | Global::V | Global::I | Global::Ps)) => {
                let kind = self.body.kind(result);
                Some(self.push(Op::Slope(*global, axis), kind))
            }
            Op::Lane(op, args) => {
                let tangent = rules::tangent(self, *op, args, result, axis)?;
                // A float's tangent beside a triple's is spread like the float itself.
                let spread = self.body.kind(result) == Kind::Triple && self.body.kind(tangent) == Kind::Float;
                Some(if spread { self.lane(LaneOp::Splat, &[tangent]) } else { tangent })
            }
            _ => None,
        }
    }

    fn branch(&mut self, mut inst: Inst) {
        let Op::If { then, otherwise, then_yields, else_yields, .. } = &mut inst.op else { return };
        self.block(*then);
        self.block(*otherwise);
        let pick = |list: &[ValueId], w: &Self| -> Vec<ValueId> {
            inst.results.iter().zip(list).filter(|(r, _)| w.wants(**r)).map(|(_, v)| *v).collect()
        };
        let (a, b) = (pick(then_yields, self), pick(else_yields, self));
        self.yields(*then, &a, then_yields);
        self.yields(*otherwise, &b, else_yields);
        self.results(&mut inst.results);
        self.out.push(inst);
    }

    /// Adds results for the tangents of those that want them, in the order of [`Writer::yields`].
    fn results(&mut self, results: &mut Vec<ValueId>) {
        for index in 0..results.len() {
            let result = results[index];
            if self.wants(result) {
                for axis in Axis::BOTH {
                    let kind = self.body.kind(result);
                    let tangent = self.fresh(kind);
                    self.set(result, axis, Some(tangent));
                    results.push(tangent);
                }
            }
        }
    }

    fn round(&mut self, mut inst: Inst) {
        let Op::Loop { init, params, body, next, .. } = &mut inst.op else { return };
        let wanted: Vec<usize> = (0..params.len()).filter(|i| self.wants(params[*i])).collect();
        for index in &wanted {
            for axis in Axis::BOTH {
                let first = self.tangent_or_zero(init[*index], axis);
                init.push(first);
                let kind = self.body.kind(params[*index]);
                let param = self.fresh(kind);
                self.set(params[*index], axis, Some(param));
                params.push(param);
            }
        }
        self.block(*body);
        let again: Vec<ValueId> = wanted.iter().map(|i| next[*i]).collect();
        self.yields(*body, &again, next);
        self.results(&mut inst.results);
        self.out.push(inst);
    }
}
