//! Forward-mode derivatives, written as ordinary IR only for the values that need them.
//!
//! `Dx`, `Dy` and functions that use them need derivatives, and so do texture lookups: the footprint of a
//! point is the change of its coordinates from pixel to pixel. The need is propagated backward from there to
//! the globals. Then derivatives (tangents) are written forward, next to their values; arrays get arrays of
//! derivatives. The rules of lane operations are in `rules`, `elementary` and `vectors`, in terms of the
//! arithmetic of `dual`; those of kernels are here. Source: OSL language specification, chapter on
//! derivatives.

mod dual;
mod elementary;
mod flat;
mod rules;
mod vectors;

use super::rewrite::{Code, Rewrite};
use crate::global::Global;
use crate::ir::{Axis, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, Slot, SlotId, ValueId, Values};
use dual::Dual;
pub(super) use flat::Flat;

/// Runs the pass. Returns whether anything changed.
pub(super) fn run(body: &mut Body, flat: Flat) -> bool {
    let mut demand = Demand {
        wanted: vec![false; body.values.len()],
        slots: vec![false; body.slots.len()],
        changed: true,
        any: false,
    };
    while demand.changed {
        demand.changed = false;
        demand.block(body, body.entry);
    }
    if demand.any {
        let tangents = vec![[None; 2]; body.values.len()];
        let shadows =
            demand.slots.iter().enumerate().map(|(i, wanted)| wanted.then(|| shadow(body, i))).collect();
        let mut writer = Writer { code: Code::new(body), wanted: demand.wanted, tangents, shadows, flat };
        writer.block(writer.code.body.entry);
        writer.code.finish();
    }
    demand.any
}

/// Whether anything needs derivatives.
pub(super) fn asks(body: &Body) -> bool {
    body.insts().any(|inst| match &inst.op {
        Op::Derivative(..) => true,
        Op::Kernel(kernel, _) => kernel.is_filtered() || kernel.unseen().is_some(),
        _ => false,
    })
}

/// Arrays for the derivatives of an array's elements.
fn shadow(body: &mut Body, index: usize) -> [SlotId; 2] {
    Axis::BOTH.map(|axis| {
        let slot = body.slots[index].clone();
        let name = format!("d{} of {}", ["x", "y"][axis as usize], slot.name).into();
        body.slots.push(Slot { name, ..slot });
        SlotId(body.slots.len() as u32 - 1)
    })
}

/// Which values need derivatives.
struct Demand {
    wanted: Vec<bool>,
    /// Which arrays need derivatives.
    slots: Vec<bool>,
    changed: bool,
    /// Whether anything needs derivatives.
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
                Op::Kernel(kernel, args) if kernel.unseen().is_some() => {
                    self.any = true;
                    let coordinates = kernel.unseen().and_then(|range| args.get(range));
                    coordinates.unwrap_or(&[]).iter().for_each(|a| self.want(*a));
                }
                Op::Derivative(of, _) => {
                    self.any = true;
                    self.want(*of);
                }
                Op::Lane(op, args) if rules::asks(*op) && inst.results.iter().any(|r| self.has(*r)) => {
                    args.iter().for_each(|a| self.want(*a));
                }
                Op::Kernel(kernel, args) if kernel.is_smooth() => {
                    self.any |= kernel.is_filtered();
                    if kernel.is_filtered() || inst.results.iter().any(|r| self.has(*r)) {
                        args.iter().for_each(|a| self.want(*a));
                    }
                }
                Op::LoadElement(slot, _) if inst.results.iter().any(|r| self.has(*r)) => {
                    if let Some(wanted) = self.slots.get_mut(slot.index()).filter(|w| !**w) {
                        *wanted = true;
                        self.changed = true;
                    }
                }
                Op::StoreElement(slot, _, value) if self.slots.get(slot.index()).is_some_and(|w| *w) => {
                    self.want(*value);
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

/// Writes derivatives. `None` is zero.
pub(super) struct Writer<'a> {
    code: Code<'a>,
    wanted: Vec<bool>,
    tangents: Vec<[Option<ValueId>; 2]>,
    /// The arrays of derivatives of an array.
    shadows: Vec<Option<[SlotId; 2]>>,
    flat: Flat,
}

impl<'a> Rewrite<'a> for Writer<'a> {
    fn code(&mut self) -> &mut Code<'a> {
        &mut self.code
    }

    fn inst(&mut self, mut inst: Inst) {
        inst.op.replace_uses(|v| self.code.renaming.get(v));
        match inst.op {
            Op::If { .. } => self.branch(inst),
            Op::Loop { .. } => self.round(inst),
            Op::Derivative(of, axis) => {
                let tangent = self.tangent_or_zero(of, axis);
                inst.results.iter().for_each(|r| self.code.renaming.set(*r, tangent));
            }
            Op::Kernel(Kernel::Texture { .. } | Kernel::Environment { .. }, _) => self.texture(inst),
            Op::Kernel(ref kernel, ref args) if kernel.is_smooth() => {
                let wanted = inst.results.first().is_some_and(|r| self.wants(*r));
                let moving =
                    kernel.is_varying() || args.iter().any(|a| self.dual(*a).d.iter().any(Option::is_some));
                if kernel.is_filtered() || (wanted && moving) {
                    self.with_tangents(inst);
                } else {
                    self.keep(inst);
                }
            }
            Op::StoreElement(slot, index, value) => {
                if let Some(shadows) = self.shadows.get(slot.index()).copied().flatten() {
                    for axis in Axis::BOTH {
                        let tangent = self.tangent_or_zero(value, axis);
                        let op = Op::StoreElement(shadows[axis as usize], index, tangent);
                        self.keep(Inst { op, results: Values::new(), span: inst.span });
                    }
                }
                self.keep(inst);
            }
            op => {
                let Some(result) = inst.results.first().copied().filter(|r| self.wants(*r)) else {
                    return self.keep(Inst { op, ..inst });
                };
                self.keep(Inst { op: op.clone(), ..inst });
                self.simple(&op, result);
            }
        }
    }
}

impl Writer<'_> {
    fn dual(&self, v: ValueId) -> Dual {
        Dual { v, d: self.tangents.get(v.index()).copied().unwrap_or_default() }
    }

    /// A derivative of a value like `v`, as explicit zeros if it is zero.
    fn or_zero(&mut self, tangent: Option<ValueId>, v: ValueId) -> ValueId {
        let kind = self.code.body.kind(v);
        tangent.unwrap_or_else(|| self.constant(Const::zero(kind)))
    }

    fn tangent_or_zero(&mut self, v: ValueId, axis: Axis) -> ValueId {
        let tangent = self.dual(v).d[axis as usize];
        self.or_zero(tangent, v)
    }

    fn set(&mut self, v: ValueId, axis: Axis, tangent: Option<ValueId>) {
        if self.tangents.len() <= v.index() {
            self.tangents.resize(v.index() + 1, [None; 2]);
        }
        self.tangents[v.index()][axis as usize] = tangent;
    }

    fn wants(&self, v: ValueId) -> bool {
        let smooth = matches!(self.code.body.kind(v), Kind::Float | Kind::Triple);
        smooth && self.wanted.get(v.index()).copied().unwrap_or(false)
    }

    /// Adds the derivatives of some values to the end of a block that was already written.
    fn yields(&mut self, block: BlockId, values: &[ValueId], into: &mut Values) {
        let outer = std::mem::take(&mut self.code.out);
        for v in values {
            for axis in Axis::BOTH {
                let tangent = self.tangent_or_zero(*v, axis);
                into.push(tangent);
            }
        }
        let mut added = std::mem::replace(&mut self.code.out, outer);
        self.code.body.blocks[block.index()].insts.append(&mut added);
    }

    /// Writes the derivatives of an operation without blocks.
    fn simple(&mut self, op: &Op, result: ValueId) {
        let kind = self.code.body.kind(result);
        match op {
            Op::Global(global @ (Global::P | Global::U | Global::V | Global::I | Global::Ps)) => {
                for axis in Axis::BOTH {
                    let deriv = self.push(Op::GlobalDeriv(*global, axis), kind);
                    self.set(result, axis, Some(deriv));
                }
            }
            Op::LoadElement(slot, index) => {
                if let Some(shadows) = self.shadows.get(slot.index()).copied().flatten() {
                    for axis in Axis::BOTH {
                        let tangent = self.push(Op::LoadElement(shadows[axis as usize], *index), kind);
                        self.set(result, axis, Some(tangent));
                    }
                }
            }
            Op::Lane(op, args) if rules::asks(*op) => {
                let op = if self.flat.covers(*op, args) { LaneOp::TransformVector } else { *op };
                let args: Vec<Dual> = args.iter().map(|a| self.dual(*a)).collect();
                if args.iter().all(|a| a.d.iter().all(Option::is_none)) {
                    return;
                }
                let Some(Dual { v, d }) = rules::derivative_of(self, op, &args, result) else { return };
                if v != result {
                    self.code.renaming.set(result, v);
                }
                for axis in Axis::BOTH {
                    // The derivative of a float next to a triple is broadcast like the float itself.
                    let tangent = d[axis as usize].map(|d| {
                        let is_broadcast = kind == Kind::Triple && self.code.body.kind(d) == Kind::Float;
                        if is_broadcast { self.lane(LaneOp::Splat, &[d]) } else { d }
                    });
                    self.set(v, axis, tangent);
                }
            }
            _ => {}
        }
    }

    /// Makes a smooth kernel compute its derivatives too: the derivatives of its arguments follow the
    /// arguments.
    fn with_tangents(&mut self, mut inst: Inst) {
        let Op::Kernel(kernel, args) = &mut inst.op else { return };
        *kernel = kernel.clone().with_derivs();
        let coordinates = args.get(kernel.coordinates()).unwrap_or(&[]).to_vec();
        for axis in Axis::BOTH {
            for coordinate in &coordinates {
                let tangent = self.tangent_or_zero(*coordinate, axis);
                args.push(tangent);
            }
        }
        self.results(&mut inst.results);
        self.keep(inst);
    }

    /// Gives a texture lookup its footprint, and makes it compute derivatives of the channels if needed.
    fn texture(&mut self, mut inst: Inst) {
        let Op::Kernel(kernel, args) = &mut inst.op else { return };
        if let Some(range) = kernel.unseen() {
            *kernel = kernel.clone().with_footprint();
            let coordinates: Values = args.get(range).unwrap_or(&[]).iter().copied().collect();
            for axis in Axis::BOTH {
                for coordinate in &coordinates {
                    let tangent = self.tangent_or_zero(*coordinate, axis);
                    args.push(tangent);
                }
            }
        }
        let channels: Values = inst.results.iter().take(2).copied().collect();
        if let Kernel::Texture { has_derivs, .. } = kernel
            && channels.iter().any(|r| self.wants(*r))
        {
            *has_derivs = true;
            for channel in channels {
                self.result_tangents(channel, &mut inst.results);
            }
        }
        self.keep(inst);
    }

    fn branch(&mut self, mut inst: Inst) {
        let Op::If { then, otherwise, then_yields, else_yields, .. } = &mut inst.op else { return };
        self.block(*then);
        self.block(*otherwise);
        then_yields.iter_mut().chain(else_yields.iter_mut()).for_each(|v| *v = self.code.renaming.get(*v));
        let pick = |list: &[ValueId], w: &Self| -> Values {
            inst.results.iter().zip(list).filter(|(r, _)| w.wants(**r)).map(|(_, v)| *v).collect()
        };
        let (a, b) = (pick(then_yields, self), pick(else_yields, self));
        self.yields(*then, &a, then_yields);
        self.yields(*otherwise, &b, else_yields);
        self.results(&mut inst.results);
        self.keep(inst);
    }

    /// Adds results for the needed derivatives, in the order of [`Writer::yields`].
    fn results(&mut self, results: &mut Values) {
        for index in 0..results.len() {
            let result = results[index];
            if self.wants(result) {
                self.result_tangents(result, results);
            }
        }
    }

    fn result_tangents(&mut self, result: ValueId, results: &mut Values) {
        for axis in Axis::BOTH {
            let kind = self.code.body.kind(result);
            let tangent = self.fresh(kind);
            self.set(result, axis, Some(tangent));
            results.push(tangent);
        }
    }

    fn round(&mut self, mut inst: Inst) {
        let Op::Loop { init, params, body, cond, next } = &mut inst.op else { return };
        let wanted: Vec<usize> = (0..params.len()).filter(|i| self.wants(params[*i])).collect();
        for index in &wanted {
            for axis in Axis::BOTH {
                let first = self.tangent_or_zero(init[*index], axis);
                init.push(first);
                let kind = self.code.body.kind(params[*index]);
                let param = self.fresh(kind);
                self.set(params[*index], axis, Some(param));
                params.push(param);
            }
        }
        self.block(*body);
        next.iter_mut().chain([cond]).for_each(|v| *v = self.code.renaming.get(*v));
        let again: Values = wanted.iter().map(|i| next[*i]).collect();
        self.yields(*body, &again, next);
        self.results(&mut inst.results);
        self.keep(inst);
    }
}
