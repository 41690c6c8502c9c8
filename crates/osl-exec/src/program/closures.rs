//! The kinds of closure components that a body makes, and the names that each output may have.
//!
//! The names are found backwards from an output, through branches, loops, arrays and messages.

use crate::closures::ClosureKind;
use osl_ir::ir::{Body, Inst, Kernel, Kind, Op, Source, ValueId};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// The kinds of components that a body makes, each once, in the order of its instructions.
pub(super) fn kinds(body: &Body) -> Vec<ClosureKind> {
    let mut kinds: Vec<ClosureKind> = Vec::new();
    let mut known = FxHashSet::default();
    for inst in body.insts() {
        let Op::Kernel(Kernel::Component { name, shapes }, _) = &inst.op else { continue };
        if known.insert((name, shapes)) {
            kinds.push(ClosureKind { name: name.clone(), shapes: shapes.clone() });
        }
    }
    kinds
}

/// A place where closures are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Place {
    Value(ValueId),
    Slot(u32),
    /// The messages of a point.
    Messages,
}

/// Where closures come from.
pub(super) struct Flow<'a> {
    /// The places from which the closures of a place come.
    from: FxHashMap<Place, Vec<Place>>,
    /// The values that are components, with their names.
    components: FxHashMap<Place, &'a Arc<str>>,
}

impl<'a> Flow<'a> {
    pub(super) fn of(body: &'a Body) -> Flow<'a> {
        let mut flow = Flow { from: FxHashMap::default(), components: FxHashMap::default() };
        for inst in body.insts() {
            flow.inst(body, inst);
        }
        flow
    }

    fn add(&mut self, to: Place, from: Place) {
        self.from.entry(to).or_default().push(from);
    }

    fn inst(&mut self, body: &Body, inst: &'a Inst) {
        let is_closure = |value: &&ValueId| body.kind(**value) == Kind::Closure;
        let results = || inst.results.iter().filter(is_closure).map(|value| Place::Value(*value));
        match &inst.op {
            Op::Kernel(Kernel::Component { name, .. }, _) => {
                self.components.extend(results().map(|result| (result, name)));
            }
            Op::Kernel(Kernel::SetMessage(form), args) => {
                let array = form.array.map(|slot| Place::Slot(slot.0));
                let values = args.iter().filter(is_closure).map(|value| Place::Value(*value));
                values.chain(array).for_each(|from| self.add(Place::Messages, from));
            }
            Op::Kernel(Kernel::GetMessage(form), _) => {
                let array = form.array.map(|slot| Place::Slot(slot.0));
                results().chain(array).for_each(|to| self.add(to, Place::Messages));
            }
            Op::Load(slot) | Op::LoadElement(slot, _) => {
                results().for_each(|to| self.add(to, Place::Slot(slot.0)));
            }
            Op::Store(slot, value) | Op::StoreElement(slot, _, value) => {
                let values = [value].into_iter().filter(is_closure);
                values.for_each(|value| self.add(Place::Slot(slot.0), Place::Value(*value)));
            }
            Op::If { then_yields, else_yields, .. } => {
                for yields in [then_yields, else_yields] {
                    self.link(body, &inst.results, yields);
                }
            }
            Op::Loop { init, params, next, .. } => {
                self.link(body, params, init);
                self.link(body, params, next);
                self.link(body, &inst.results, next);
            }
            op => op.for_each_use(|value| {
                if is_closure(&&value) {
                    results().for_each(|to| self.add(to, Place::Value(value)));
                }
            }),
        }
    }

    /// Notes that values come from others.
    fn link(&mut self, body: &Body, to: &[ValueId], from: &[ValueId]) {
        let pairs = to.iter().zip(from).filter(|(to, _)| body.kind(**to) == Kind::Closure);
        pairs.for_each(|(to, from)| self.add(Place::Value(*to), Place::Value(*from)));
    }

    /// The names of the components that an output may have, in the order of `kinds`.
    pub(super) fn names(&self, source: &Source, kinds: &[ClosureKind]) -> Vec<Arc<str>> {
        let mut open = vec![match source {
            Source::Value(value) => Place::Value(*value),
            Source::Slot(slot) => Place::Slot(slot.0),
        }];
        let mut seen: FxHashSet<Place> = open.iter().copied().collect();
        let mut found = FxHashSet::default();
        while let Some(place) = open.pop() {
            found.extend(self.components.get(&place).copied());
            let from = self.from.get(&place).into_iter().flatten();
            open.extend(from.filter(|from| seen.insert(**from)));
        }
        let mut names = Vec::new();
        for kind in kinds {
            if found.remove(&kind.name) {
                names.push(kind.name.clone());
            }
        }
        names
    }
}
