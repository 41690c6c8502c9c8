//! Closures as numbers: adds the weights of the components of closures to a program as colors, and their
//! parameters, so that whatever examines numbers examines closures too.
//!
//! For each closure output `Ci` and each name of a component there is an output `Ci.diffuse`, the sum of the
//! weights of these components; for each parameter that is computed there is an output
//! `Ci.diffuse.argument1`, its value where the shader made such a component last.

use crate::ir::{
    Block, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, Output, Slot, SlotId, Source, Values,
};
use crate::ir::{Rate, ValueId};
use crate::types::{Base, Type};
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Replaces the closure outputs of a lowered program, before the passes, by outputs with their numbers.
/// `asked` are the names of the requested outputs, if not all are: a requested closure becomes a request for
/// its numbers.
pub fn closures_as_numbers(body: &mut Body, asked: Option<&mut Vec<Arc<str>>>) {
    let is_closure = |output: &Output| output.ty.base == Base::Closure;
    let closures: Vec<Output> = body.outputs.iter().filter(|output| is_closure(output)).cloned().collect();
    let wanted = |name: &Arc<str>| asked.as_ref().is_none_or(|asked| asked.contains(name));
    let Some(first) = closures.iter().find(|output| wanted(&output.name)) else {
        body.outputs.retain(|output| !is_closure(output));
        return;
    };
    let mut shadow = Shadow::new(body, first.name.clone());
    shadow.block(shadow.body.entry);
    let mut added = Vec::new();
    for output in &closures {
        for at in 0..shadow.names.len() {
            let source = match &output.source {
                Source::Value(value) => {
                    shadow.of(*value).and_then(|all| all.get(at).copied()).map(Source::Value)
                }
                Source::Slot(slot) => {
                    shadow.slot(*slot).and_then(|all| all.get(at).copied()).map(Source::Slot)
                }
            };
            let ty = Type { base: Base::Color, ..output.ty };
            let name = format!("{}.{}", output.name, shadow.names[at]).into();
            added.extend(source.map(|source| (output.name.clone(), Output { name, ty, source })));
        }
    }
    added.extend(std::mem::take(&mut shadow.params).into_iter().map(|param| (first.name.clone(), param)));
    if let Some(asked) = asked {
        let new: Vec<Arc<str>> = added
            .iter()
            .filter(|(of, _)| asked.contains(of))
            .map(|(_, output)| output.name.clone())
            .collect();
        asked.extend(new);
    }
    body.outputs.retain(|output| !is_closure(output));
    body.outputs.extend(added.into_iter().map(|(_, output)| output));
}

/// What stands beside the closures of a body.
struct Shadow<'a> {
    body: &'a mut Body,
    /// The names of the components.
    names: Vec<Arc<str>>,
    /// For each closure value and slot, a color for each name.
    values: FxHashMap<ValueId, Values>,
    slots: FxHashMap<SlotId, Vec<SlotId>>,
    /// The outputs with parameters, and the closure output whose name they have.
    params: Vec<Output>,
    of: Arc<str>,
    /// The values that are constants or globals: parameters that are not computed.
    plain: Vec<ValueId>,
}

impl<'a> Shadow<'a> {
    fn new(body: &'a mut Body, of: Arc<str>) -> Shadow<'a> {
        let (mut names, mut plain) = (Vec::<Arc<str>>::new(), Vec::new());
        for inst in body.insts() {
            match &inst.op {
                Op::Kernel(Kernel::Component { name, .. }, _) if !names.contains(name) => {
                    names.push(name.clone())
                }
                Op::Const(_) | Op::Global(_) => plain.extend(&inst.results),
                _ => {}
            }
        }
        let kept = only_kept(body, &plain);
        let loads = body.insts();
        plain.extend(loads.filter_map(|inst| match &inst.op {
            Op::Load(slot) if kept.contains(slot) => inst.results.first().copied(),
            _ => None,
        }));
        let mut slots = FxHashMap::default();
        for at in 0..body.slots.len() {
            if body.slots[at].kind == Kind::Closure {
                let Slot { len, name, .. } = body.slots[at].clone();
                let add = |_: &Arc<str>| {
                    body.slots.push(Slot {
                        kind: Kind::Triple,
                        len,
                        name: name.clone(),
                        rate: Rate::Varying,
                    });
                    SlotId(body.slots.len() as u32 - 1)
                };
                let own: Vec<SlotId> = names.iter().map(add).collect();
                slots.insert(SlotId(at as u32), own);
            }
        }
        Shadow { body, names, values: FxHashMap::default(), slots, params: Vec::new(), of, plain }
    }

    fn of(&self, value: ValueId) -> Option<&Values> {
        self.values.get(&value)
    }

    fn slot(&self, slot: SlotId) -> Option<&Vec<SlotId>> {
        self.slots.get(&slot)
    }

    /// Adds an instruction with a color as its result.
    fn color(&mut self, op: Op, span: Span, out: &mut Vec<Inst>) -> ValueId {
        let result = self.body.fresh(Kind::Triple, span);
        out.push(Inst { op, results: [result].into_iter().collect(), span });
        result
    }

    /// Writes what stands beside each instruction of a block, and of those within, after it.
    fn block(&mut self, id: BlockId) {
        let Block { insts } = std::mem::take(&mut self.body.blocks[id.0 as usize]);
        let mut out = Vec::with_capacity(insts.len());
        for inst in insts {
            inst.op.blocks().for_each(|id| self.block(id));
            out.push(inst.clone());
            self.beside(&inst, &mut out);
        }
        self.body.blocks[id.0 as usize].insts = out;
    }

    fn beside(&mut self, inst: &Inst, out: &mut Vec<Inst>) {
        let span = inst.span;
        match &inst.op {
            Op::Store(slot, value) | Op::StoreElement(slot, _, value) => {
                let (Some(slots), Some(values)) = (self.slots.get(slot), self.values.get(value)) else {
                    return;
                };
                for (slot, value) in slots.iter().zip(values) {
                    let op = match &inst.op {
                        Op::StoreElement(_, index, _) => Op::StoreElement(*slot, *index, *value),
                        _ => Op::Store(*slot, *value),
                    };
                    out.push(Inst { op, results: Values::new(), span });
                }
                return;
            }
            Op::Kernel(Kernel::Component { name, .. }, args) => self.parameters(name, args, span, out),
            _ => {}
        }
        let result = inst.results.first().copied();
        let Some(result) = result.filter(|result| self.body.kind(*result) == Kind::Closure) else { return };
        let all = (0..self.names.len()).map(|at| self.weight(&inst.op, at, span, out)).collect();
        self.values.insert(result, all);
    }

    /// The weight of the components with a name in the result of an operation.
    fn weight(&mut self, op: &Op, at: usize, span: Span, out: &mut Vec<Inst>) -> ValueId {
        let of =
            |shadow: &Self, value: &ValueId| shadow.values.get(value).and_then(|all| all.get(at).copied());
        let op = match op {
            Op::Kernel(Kernel::Component { name, .. }, _) => {
                Some(Op::Const(Const::Triple([f32::from(u8::from(self.names[at] == *name)); 3])))
            }
            Op::Kernel(Kernel::ClosureSum, args) => match &args[..] {
                [a, b] => of(self, a).zip(of(self, b)).map(|(a, b)| lane(LaneOp::FAdd, &[a, b])),
                _ => None,
            },
            Op::Kernel(Kernel::ClosureScale, args) => match &args[..] {
                [closure, by] => of(self, closure).map(|weight| {
                    let by = match self.body.kind(*by) {
                        Kind::Float => self.color(lane(LaneOp::Splat, &[*by]), span, out),
                        _ => *by,
                    };
                    lane(LaneOp::FMul, &[weight, by])
                }),
                _ => None,
            },
            Op::Lane(LaneOp::KChoose, args) => match &args[..] {
                [cond, a, b] => {
                    of(self, a).zip(of(self, b)).map(|(a, b)| lane(LaneOp::Choose, &[*cond, a, b]))
                }
                _ => None,
            },
            Op::Load(slot) => self.slots.get(slot).and_then(|all| all.get(at).copied()).map(Op::Load),
            Op::LoadElement(slot, index) => self
                .slots
                .get(slot)
                .and_then(|all| all.get(at).copied())
                .map(|slot| Op::LoadElement(slot, *index)),
            _ => None,
        };
        self.color(op.unwrap_or(Op::Const(Const::Triple([0.0; 3]))), span, out)
    }

    /// Keeps the parameters of a component that are computed numbers.
    fn parameters(&mut self, name: &Arc<str>, args: &[ValueId], span: Span, out: &mut Vec<Inst>) {
        for (at, arg) in args.iter().enumerate() {
            let stem = format!("{}.{name}.argument{}", self.of, at + 1);
            match self.body.kind(*arg) {
                Kind::Float | Kind::Triple if self.plain.contains(arg) => {}
                Kind::Float => self.keep(&stem, (*arg, Base::Float), span, out),
                Kind::Triple => self.keep(&stem, (*arg, Base::Vector), span, out),
                // The weights within: those of the base of a layer, for instance.
                Kind::Closure => {
                    let weights = self.values.get(arg).cloned().unwrap_or_default();
                    for (at, weight) in weights.into_iter().enumerate() {
                        self.keep(&format!("{stem}.{}", self.names[at]), (weight, Base::Color), span, out);
                    }
                }
                Kind::Int | Kind::Matrix | Kind::Str => {}
            }
        }
    }

    /// Adds an output with the value that something has here.
    fn keep(&mut self, stem: &str, (value, base): (ValueId, Base), span: Span, out: &mut Vec<Inst>) {
        let same = self.params.iter().filter(|param| param.name.starts_with(stem)).count();
        let name: Arc<str> = if same == 0 { stem.into() } else { format!("{stem}.{}", same + 1).into() };
        let kind = self.body.kind(value);
        self.body.slots.push(Slot { kind, len: None, name: name.clone(), rate: Rate::Varying });
        let slot = SlotId(self.body.slots.len() as u32 - 1);
        out.push(Inst { op: Op::Store(slot, value), results: Values::new(), span });
        self.params.push(Output { name, ty: Type { base, ..Type::FLOAT }, source: Source::Slot(slot) });
    }
}

/// The slots that only ever hold one of these values.
fn only_kept(body: &Body, plain: &[ValueId]) -> Vec<SlotId> {
    let mut stores: FxHashMap<SlotId, (u32, bool)> = FxHashMap::default();
    for inst in body.insts() {
        if let Op::Store(slot, value) = &inst.op {
            let (count, is_plain) = stores.entry(*slot).or_insert((0, true));
            *count += 1;
            *is_plain &= plain.contains(value);
        }
    }
    let mut slots: Vec<SlotId> =
        stores.into_iter().filter(|(_, found)| *found == (1, true)).map(|(slot, _)| slot).collect();
    slots.sort_unstable();
    slots
}

fn lane(op: LaneOp, args: &[ValueId]) -> Op {
    Op::Lane(op, args.iter().copied().collect())
}
