//! The follower, which walks the IR for one point.

use super::kernel::{Closures, Kernels, NoiseCall};
use super::random::Random;
use super::{Exact, Node, NodeId, OnePoint, Trace, What, eval};
use osl_exec::Services;
use osl_ir::Span;
use osl_ir::ir::{BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, Op, SlotId, Source, ValueId};
use osl_limits::Limits;
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// Which arithmetics take a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Both,
    Strict,
    Exact,
}

/// The results of a call in single and in double precision.
type InEach = (Option<Vec<Const>>, Option<Vec<Exact>>);

impl Way {
    fn strict(self) -> bool {
        self != Way::Exact
    }

    fn exact(self) -> bool {
        self != Way::Strict
    }
}

/// The trace has reached its maximum number of nodes, or a call did not end.
struct Full;

/// No node: the value is undefined on the path taken.
const NONE: NodeId = NodeId::MAX;

/// Follows a point through a body from [`super::prepare`], for at most as many instructions as `limits`
/// allow.
pub fn follow(body: &Body, services: &Services, point: OnePoint<'_>, limits: &Limits) -> Trace {
    followed(body, services, point, limits, (Way::Both, None))
}

/// An arithmetic that is followed alone, where each result is rounded up or down by chance. Each run has
/// choices of its own.
#[derive(Clone, Copy, Debug)]
pub enum Alone {
    /// Single precision, in this run.
    Single(u32),
    /// Double precision, in this run.
    Double(u32),
}

/// The same in one arithmetic.
pub fn follow_alone(
    body: &Body,
    services: &Services,
    point: OnePoint<'_>,
    limits: &Limits,
    alone: Alone,
) -> Trace {
    let (way, run) = match alone {
        Alone::Single(run) => (Way::Strict, run),
        Alone::Double(run) => (Way::Exact, run),
    };
    followed(body, services, point, limits, (way, Some(Random::new(run, point.point))))
}

fn followed(
    body: &Body,
    services: &Services,
    point: OnePoint<'_>,
    limits: &Limits,
    (way, random): (Way, Option<Random>),
) -> Trace {
    let max_nodes = usize::try_from(limits.running.trace).unwrap_or(usize::MAX);
    let elements = |slot: &osl_ir::ir::Slot| vec![NONE; slot.len.unwrap_or(0) as usize];
    let mut follower = Follower {
        body,
        limits,
        kernels: Kernels::new(services, point, limits),
        values: vec![NONE; body.values.len()],
        arrays: [0, 1].map(|_| body.slots.iter().map(elements).collect()),
        nodes: Vec::new(),
        max_nodes: max_nodes.min(NONE as usize - 1),
        spent: 0,
        closures: 0,
        result: None,
        reporting: FxHashSet::default(),
        random,
    };
    let cut = follower.block(body.entry, way).is_err();
    let outputs = if cut { Vec::new() } else { follower.outputs(way) };
    Trace { nodes: follower.nodes, outputs, reporting: follower.reporting, cut }
}

struct Follower<'a> {
    body: &'a Body,
    limits: &'a Limits,
    kernels: Kernels<'a>,
    /// The node of each value.
    values: Vec<NodeId>,
    /// The nodes of the elements of each array: those of the strict and those of the exact arithmetic.
    arrays: [Vec<Vec<NodeId>>; 2],
    nodes: Vec<Node>,
    max_nodes: usize,
    /// Budget spent on loop iterations and kernels, besides their nodes.
    spent: usize,
    closures: i32,
    /// The first result of the instruction that makes nodes.
    result: Option<ValueId>,
    /// The results of calls that reported something.
    reporting: FxHashSet<NodeId>,
    /// How results are rounded, if not to the nearest.
    random: Option<Random>,
}

/// The arguments of a call.
struct Given {
    strict: Vec<Const>,
    exact: Vec<Exact>,
    /// The nodes of those that are closures.
    nodes: Vec<Option<NodeId>>,
}

/// Cost, in nodes, of running the interpreter for one call: about the time of that many nodes.
const KERNEL: usize = 100;

/// Cost, in nodes, of each array element that a kernel reads or writes: it becomes instructions in the
/// program for that one call.
const ELEMENT: usize = 8;

/// Bytes of strings that cost as much as a node.
const BYTES: usize = 64;

impl Follower<'_> {
    fn outputs(&mut self, way: Way) -> Vec<(Arc<str>, osl_ir::types::Type, Vec<NodeId>)> {
        let body = self.body;
        let mut outputs = Vec::new();
        for output in &body.outputs {
            let nodes = match output.source {
                Source::Value(v) => vec![self.of(v)],
                Source::Slot(slot) => {
                    let count = body.slot(slot).len.unwrap_or(0) as usize;
                    (0..count).filter_map(|i| self.element(slot, [i, i], &[], way).ok()).collect()
                }
            };
            outputs.push((output.name.clone(), output.ty, nodes));
        }
        outputs
    }

    /// The node of a value; a zero of its kind if the path taken did not define it.
    fn of(&mut self, value: ValueId) -> NodeId {
        match self.values.get(value.index()) {
            Some(id) if *id != NONE => *id,
            _ => self.zero(self.body.kind(value)),
        }
    }

    fn zero(&mut self, kind: Kind) -> NodeId {
        let value = Const::zero(kind);
        let exact = Exact::widen(&value);
        self.nodes.push(Node {
            what: What::Const,
            span: Span::default(),
            result: None,
            args: Vec::new(),
            strict: Some(value),
            exact: Some(exact),
        });
        self.nodes.len() as NodeId - 1
    }

    fn push(
        &mut self,
        what: What,
        span: Span,
        args: Vec<NodeId>,
        strict: Option<Const>,
        exact: Option<Exact>,
    ) -> Result<NodeId, Full> {
        self.spend(0)?;
        self.nodes.push(Node { what, span, result: self.result, args, strict, exact });
        Ok(self.nodes.len() as NodeId - 1)
    }

    /// Counts work that creates no nodes.
    fn spend(&mut self, work: usize) -> Result<(), Full> {
        self.spent = self.spent.saturating_add(work);
        if self.nodes.len().saturating_add(self.spent) >= self.max_nodes || self.limits.halted().is_some() {
            return Err(Full);
        }
        Ok(())
    }

    /// Counts strings that are read or made, since each is kept.
    fn spend_text(&mut self, values: &[Const]) -> Result<(), Full> {
        let text = |c: &Const| if let Const::Str(text) = c { text.len() } else { 0 };
        self.spend(values.iter().map(text).sum::<usize>() / BYTES)
    }

    fn set(&mut self, result: Option<&ValueId>, node: NodeId) {
        if let Some(place) = result.and_then(|r| self.values.get_mut(r.index())) {
            *place = node;
        }
    }

    fn strict(&self, id: NodeId, kind: Kind) -> Const {
        self.nodes.get(id as usize).and_then(|n| n.strict.clone()).unwrap_or_else(|| Const::zero(kind))
    }

    fn exact(&self, id: NodeId, kind: Kind) -> Exact {
        let found = self.nodes.get(id as usize).and_then(|n| n.exact.clone());
        found.unwrap_or_else(|| Exact::of_numbers(kind, &[]))
    }

    /// The truth of an int or closure in each arithmetic: strict, exact.
    fn truths(&self, id: NodeId) -> [bool; 2] {
        let node = self.nodes.get(id as usize);
        let strict =
            node.and_then(|n| n.strict.as_ref()).is_some_and(|v| matches!(v, Const::Int(n) if *n != 0));
        [strict, node.and_then(|n| n.exact.as_ref()).is_some_and(Exact::truth)]
    }

    fn block(&mut self, id: BlockId, way: Way) -> Result<(), Full> {
        let body = self.body;
        body.block(id).insts.iter().try_for_each(|inst| self.inst(inst, way))
    }

    fn inst(&mut self, inst: &Inst, way: Way) -> Result<(), Full> {
        let first = inst.results.first();
        self.result = first.copied();
        let node = match &inst.op {
            Op::Const(value) => {
                let exact = Exact::widen(value);
                self.push(What::Const, inst.span, Vec::new(), Some(value.clone()), Some(exact))?
            }
            Op::Global(global) => {
                let value = self.kernels.point.global(*global);
                self.datum(What::Global(*global), inst, value)?
            }
            Op::Input(index) => {
                let value = self.body.inputs.get(*index as usize).map(|input| &input.value);
                let exact = value.map(Exact::widen);
                self.push(What::Const, inst.span, Vec::new(), value.cloned(), exact)?
            }
            Op::GlobalDeriv(global, axis) => {
                let value = self.kernels.point.deriv_of(*global, *axis);
                self.datum(What::GlobalDeriv(*global, *axis), inst, value)?
            }
            Op::Lane(op, args) => self.lane(*op, args, inst, way)?,
            Op::Kernel(kernel, args) => return self.kernel(kernel, args, inst, way),
            Op::LoadElement(slot, index) => {
                let index = self.of(*index);
                let at = self.indices(index, *slot);
                self.element(*slot, at, &[index], way)?
            }
            Op::StoreElement(slot, index, value) => {
                let (index, value) = (self.of(*index), self.of(*value));
                let at = self.indices(index, *slot);
                for (half, goes) in [(0, way.strict()), (1, way.exact())] {
                    if goes && let Some(element) = self.arrays[half][slot.index()].get_mut(at[half]) {
                        *element = value;
                    }
                }
                return Ok(());
            }
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                return self.branch(inst, *cond, [*then, *otherwise], [then_yields, else_yields], way);
            }
            Op::Loop { init, params, body, cond, next } => {
                return self.round(inst, (init, params, next), *body, *cond, way);
            }
            Op::Derivative(..) | Op::Share(..) | Op::Load(_) | Op::Store(..) => return Ok(()),
        };
        self.set(first, node);
        Ok(())
    }

    fn datum(&mut self, what: What, inst: &Inst, value: [f32; 3]) -> Result<NodeId, Full> {
        let kind = inst.results.first().map_or(Kind::Float, |r| self.body.kind(*r));
        let value = match kind {
            Kind::Triple => Const::Triple(value),
            Kind::Int => Const::Int(value[0] as i32),
            _ => Const::Float(value[0]),
        };
        let exact = Exact::widen(&value);
        self.push(what, inst.span, Vec::new(), Some(value), Some(exact))
    }

    fn lane(&mut self, op: LaneOp, args: &[ValueId], inst: &Inst, way: Way) -> Result<NodeId, Full> {
        let body = self.body;
        let nodes: Vec<NodeId> = args.iter().map(|a| self.of(*a)).collect();
        let kinds = args.iter().map(|a| body.kind(*a));
        let result = inst.results.first().map_or(Kind::Float, |r| body.kind(*r));
        let strict = way.strict().then(|| {
            let values: Vec<Const> =
                nodes.iter().zip(kinds.clone()).map(|(n, k)| self.strict(*n, k)).collect();
            let closures = match (op, &values[..]) {
                (LaneOp::KChoose, [Const::Int(c), a, b]) => Some(if *c != 0 { a } else { b }.clone()),
                (LaneOp::KSome, [a]) => Some(Const::Int((*a != Const::Null).into())),
                _ => None,
            };
            let value = closures.or_else(|| op.eval(&values)).unwrap_or_else(|| Const::zero(result));
            match self.random {
                Some(random) => random.lane(op, &values, value, self.nodes.len()),
                None => value,
            }
        });
        let exact = way.exact().then(|| {
            let values: Vec<Exact> = nodes.iter().zip(kinds).map(|(n, k)| self.exact(*n, k)).collect();
            let value = eval(op, &values).unwrap_or_else(|| Exact::of_numbers(result, &[]));
            match self.random {
                Some(random) => random.double(value, &values),
                None => value,
            }
        });
        self.push(What::Lane(op), inst.span, nodes, strict, exact)
    }

    fn kernel(&mut self, kernel: &Kernel, args: &[ValueId], inst: &Inst, way: Way) -> Result<(), Full> {
        let body = self.body;
        let nodes: Vec<NodeId> = args.iter().map(|a| self.of(*a)).collect();
        let shared = Arc::new(kernel.clone());
        if matches!(kernel, Kernel::Note { .. } | Kernel::CheckIndex { .. }) {
            // Notes and checks have no value; their marks tell which arithmetics come by.
            let strict = way.strict().then_some(Const::Int(1));
            let exact = way.exact().then_some(Exact::Int(1));
            self.push(What::Note(shared), inst.span, nodes, strict, exact)?;
            return Ok(());
        }
        let kinds: Vec<Kind> = inst.results.iter().map(|r| body.kind(*r)).collect();
        if matches!(kernel, Kernel::Component { .. } | Kernel::ClosureSum | Kernel::ClosureScale) {
            let (strict, exact) = self.closure(kernel, &nodes, way);
            let node = self.push(What::Kernel(shared, 0), inst.span, nodes, strict, exact)?;
            self.set(inst.results.first(), node);
            return Ok(());
        }
        let given = Given {
            strict: nodes.iter().zip(args).map(|(n, a)| self.strict(*n, body.kind(*a))).collect(),
            exact: nodes.iter().zip(args).map(|(n, a)| self.exact(*n, body.kind(*a))).collect(),
            nodes: nodes
                .iter()
                .zip(args)
                .map(|(n, a)| (body.kind(*a) == Kind::Closure).then_some(*n))
                .collect(),
        };
        let mut reports = false;
        let (strict, exact) = match NoiseCall::of(kernel, &given.strict) {
            Some(call) => (
                way.strict().then(|| self.noise(&call, &given.strict, &kinds)),
                way.exact().then(|| {
                    let results = call.exact(&given.exact, &kinds);
                    let Some(random) = self.random else { return results };
                    results.into_iter().map(|result| random.double(result, &given.exact)).collect()
                }),
            ),
            None => {
                let results = self.interpreted(kernel, &given, &kinds, (inst.span, way))?;
                reports = self.kernels.reported.take();
                results
            }
        };
        for (index, result) in inst.results.iter().enumerate() {
            let half = |v: &Option<Vec<Const>>| v.as_ref().and_then(|v| v.get(index)).cloned();
            let exact = exact.as_ref().and_then(|v| v.get(index)).cloned();
            let what = What::Kernel(shared.clone(), index);
            let node = self.push(what, inst.span, nodes.clone(), half(&strict), exact)?;
            if reports {
                self.reporting.insert(node);
            }
            self.set(Some(result), node);
        }
        Ok(())
    }

    /// The results of a call that runs in the interpreter, in each arithmetic.
    fn interpreted(
        &mut self,
        kernel: &Kernel,
        given: &Given,
        kinds: &[Kind],
        (span, way): (Span, Way),
    ) -> Result<InEach, Full> {
        let body = self.body;
        let length = |slot: Option<SlotId>| slot.and_then(|slot| body.slot(slot).len).unwrap_or(0) as usize;
        let elements = length(kernel.reads()).saturating_add(length(kernel.writes()));
        self.spend(elements.saturating_mul(ELEMENT).saturating_add(KERNEL))?;
        self.spend_text(&given.strict)?;
        let arrays = [0, 1].map(|half| self.array_of(kernel, half));
        let closures = Closures { nodes: &self.nodes, args: &given.nodes };
        let run =
            |args: &[Const], array: &[Const]| self.kernels.run(kernel, (args, closures), kinds, array, body);
        let strict = way.strict().then(|| run(&given.strict, &arrays[0]));
        // What the strict run reports counts.
        let reported = self.kernels.reported.take();
        let rounded: Vec<Const> = given.exact.iter().map(Exact::round).collect();
        let exact = way.exact().then(|| match &strict {
            // Both arithmetics have the same arguments, so the call runs once.
            Some(done) if rounded == given.strict && arrays[0] == arrays[1] => done.clone(),
            _ => run(&rounded, &arrays[1]),
        });
        self.kernels.reported.set(reported);
        if self.kernels.stopped.get() {
            return Err(Full);
        }
        for (half, result) in [&strict, &exact].into_iter().enumerate() {
            if let (Some(slot), Some((_, elements))) = (kernel.writes(), result) {
                self.refill(slot, half, (&arrays[half], elements), span)?;
            }
        }
        for (values, _) in [&strict, &exact].into_iter().flatten() {
            self.spend_text(values)?;
        }
        let widen = |(values, _): (Vec<Const>, _)| {
            let exact = self.kernels.exact_matrix(kernel, &rounded);
            exact.unwrap_or_else(|| values.iter().map(Exact::widen).collect())
        };
        Ok((strict.map(|(values, _)| values), exact.map(widen)))
    }

    /// The results of a noise in single precision.
    fn noise(&self, call: &NoiseCall, args: &[Const], kinds: &[Kind]) -> Vec<Const> {
        let results = call.strict(args, kinds);
        let Some(random) = self.random else { return results };
        let wide: Vec<Exact> = args.iter().map(Exact::widen).collect();
        let exact = call.exact(&wide, kinds);
        let one = |((result, exact), at)| random.noise(result, exact, self.nodes.len() + at);
        results.into_iter().zip(&exact).zip(0..).map(one).collect()
    }

    /// A closure in each arithmetic. Scaled by zero, and as a sum of nothing, it is null, as in a run.
    fn closure(&mut self, kernel: &Kernel, nodes: &[NodeId], way: Way) -> (Option<Const>, Option<Exact>) {
        self.closures += 1;
        let new = Const::Int(self.closures);
        let kinds = match kernel {
            Kernel::ClosureSum => [Kind::Closure; 2],
            _ => [Kind::Closure, Kind::Float],
        };
        let values: Vec<(Const, Exact)> =
            nodes.iter().zip(kinds).map(|(n, k)| (self.strict(*n, k), self.exact(*n, k))).collect();
        let is_zero = |value: &Exact| value.numbers().iter().all(|x| *x == 0.0);
        let (strict, exact) = match (kernel, &values[..]) {
            (Kernel::ClosureSum, [(a, a_exact), (b, b_exact)]) => {
                let sum = match (a, b) {
                    (Const::Null, other) | (other, Const::Null) => other.clone(),
                    _ => new,
                };
                (sum, a_exact.truth() || b_exact.truth())
            }
            (Kernel::ClosureScale, [(of, of_exact), (by, by_exact)]) => {
                let is_null = *of == Const::Null || is_zero(&Exact::widen(by));
                (if is_null { Const::Null } else { new }, of_exact.truth() && !is_zero(by_exact))
            }
            _ => (new, true),
        };
        (way.strict().then_some(strict), way.exact().then_some(Exact::Closure(exact)))
    }

    /// The elements of the array that a kernel reads, or else of the one that it writes.
    fn array_of(&self, kernel: &Kernel, half: usize) -> Vec<Const> {
        let Some(slot) = kernel.reads().or(kernel.writes()) else { return Vec::new() };
        let kind = self.body.slot(slot).kind;
        let value = |id: &NodeId| {
            if half == 0 { self.strict(*id, kind) } else { self.exact(*id, kind).round() }
        };
        self.arrays[half][slot.index()].iter().map(value).collect()
    }

    /// Stores what a kernel wrote into an array; elements that it left as they were keep their values.
    fn refill(
        &mut self,
        slot: SlotId,
        half: usize,
        (before, after): (&[Const], &[Const]),
        span: Span,
    ) -> Result<(), Full> {
        for (index, element) in after.iter().enumerate().filter(|(at, new)| before.get(*at) != Some(new)) {
            let exact = Exact::widen(element);
            let node = self.push(What::Const, span, Vec::new(), Some(element.clone()), Some(exact))?;
            if let Some(place) = self.arrays[half][slot.index()].get_mut(index) {
                *place = node;
            }
        }
        Ok(())
    }

    /// The element index in each arithmetic.
    fn indices(&self, index: NodeId, slot: SlotId) -> [usize; 2] {
        let last = self.body.slot(slot).len.unwrap_or(1).saturating_sub(1) as i32;
        let clamped = |n: i32| n.clamp(0, last) as usize;
        let node = self.nodes.get(index as usize);
        let strict = match node.and_then(|n| n.strict.as_ref()) {
            Some(Const::Int(n)) => clamped(*n),
            _ => 0,
        };
        let exact = match node.and_then(|n| n.exact.as_ref()) {
            Some(Exact::Int(n)) => clamped(*n),
            _ => strict,
        };
        [strict, exact]
    }

    fn element(&mut self, slot: SlotId, at: [usize; 2], index: &[NodeId], way: Way) -> Result<NodeId, Full> {
        let kind = self.body.slot(slot).kind;
        let found = [0, 1].map(|half| self.arrays[half][slot.index()].get(at[half]).copied().unwrap_or(NONE));
        let found = found.map(|id| if id == NONE { self.zero(kind) } else { id });
        let strict = way.strict().then(|| self.strict(found[0], kind));
        let exact = way.exact().then(|| self.exact(found[1], kind));
        let mut args = index.to_vec();
        args.extend(if found[0] == found[1] { &found[..1] } else { &found[..] });
        let what = if found[0] == found[1] { What::Element } else { What::Meet };
        self.push(what, Span::default(), args, strict, exact)
    }

    fn branch(
        &mut self,
        inst: &Inst,
        cond: ValueId,
        sides: [BlockId; 2],
        yields: [&[ValueId]; 2],
        way: Way,
    ) -> Result<(), Full> {
        let cond = self.of(cond);
        let [strict, exact] = self.truths(cond);
        let side = |truth: bool| usize::from(!truth);
        if way != Way::Both || strict == exact {
            let taken = side(if way.strict() { strict } else { exact });
            self.block(sides[taken], way)?;
            for (result, value) in inst.results.iter().zip(yields[taken]) {
                let node = self.of(*value);
                self.set(Some(result), node);
            }
            return Ok(());
        }
        let mut halves = Vec::new();
        for (way, truth) in [(Way::Strict, strict), (Way::Exact, exact)] {
            self.block(sides[side(truth)], way)?;
            let values: Vec<NodeId> = yields[side(truth)].iter().map(|v| self.of(*v)).collect();
            halves.push(values);
        }
        self.meet(inst, Some(cond), &halves[0], &halves[1])
    }

    /// Joins the results of two paths.
    fn meet(
        &mut self,
        inst: &Inst,
        cond: Option<NodeId>,
        strict: &[NodeId],
        exact: &[NodeId],
    ) -> Result<(), Full> {
        for ((result, strict), exact) in inst.results.iter().zip(strict).zip(exact) {
            // The blocks have set other results in between.
            self.result = Some(*result);
            let node = if strict == exact {
                *strict
            } else {
                let kind = self.body.kind(*result);
                let values = (Some(self.strict(*strict, kind)), Some(self.exact(*exact, kind)));
                let args = cond.into_iter().chain([*strict, *exact]).collect();
                self.push(What::Meet, inst.span, args, values.0, values.1)?
            };
            self.set(Some(result), node);
        }
        Ok(())
    }

    fn round(
        &mut self,
        inst: &Inst,
        (init, params, next): (&[ValueId], &[ValueId], &[ValueId]),
        body: BlockId,
        cond: ValueId,
        way: Way,
    ) -> Result<(), Full> {
        let mut carried: Vec<NodeId> = init.iter().map(|v| self.of(*v)).collect();
        let (mut way_now, mut ended) = (way, None);
        loop {
            for (param, node) in params.iter().zip(&carried) {
                self.set(Some(param), *node);
            }
            self.spend(1)?;
            self.block(body, way_now)?;
            carried = next.iter().map(|v| self.of(*v)).collect();
            let again = self.of(cond);
            let [strict, exact] = self.truths(again);
            match way_now {
                Way::Both if strict != exact => {
                    // One arithmetic ends here; the other continues alone.
                    ended = Some((strict, again, carried.clone()));
                    way_now = if strict { Way::Strict } else { Way::Exact };
                }
                Way::Exact if !exact => break,
                Way::Both | Way::Strict if !strict => break,
                _ => {}
            }
        }
        match ended {
            None => {
                for (result, node) in inst.results.iter().zip(&carried) {
                    self.set(Some(result), *node);
                }
                Ok(())
            }
            Some((true, cond, exact)) => self.meet(inst, Some(cond), &carried, &exact),
            Some((false, cond, strict)) => self.meet(inst, Some(cond), &strict, &carried),
        }
    }
}
