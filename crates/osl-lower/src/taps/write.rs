//! Writes taps into the body: storage for each, copies after the statements, and the outputs.

use super::{Site, Tap, Tapped};
use crate::flow::{self, Flow};
use crate::{Lowerer, Storage};
use osl_hir::hir::Stmt;
use osl_ir::ir::{Kind, LaneOp, Output, SlotId, Source, ValueId};
use osl_ir::types::Type;
use osl_syntax::span::Span;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// The taps of a body, while it is lowered.
#[derive(Debug, Default)]
pub(crate) struct Tapping {
    taps: Rc<[Tap]>,
    /// The storage of each tap.
    kept: Vec<Kept>,
    /// The taps of each site, by layer.
    sites: FxHashMap<(usize, Site), Vec<usize>>,
    /// The layer that is being lowered.
    pub(crate) layer: usize,
    /// Where the calls are that are being inlined.
    pub(crate) calls: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Kept {
    value: Storage,
    mask: SlotId,
    /// Whether some points may not get there.
    conditional: bool,
    /// The number of visits, if one of them counts.
    visits: Option<SlotId>,
}

impl Tapping {
    pub(crate) fn new(taps: &[Tap]) -> Tapping {
        let mut sites: FxHashMap<(usize, Site), Vec<usize>> = FxHashMap::default();
        for (at, tap) in taps.iter().enumerate() {
            sites.entry((tap.layer, tap.site)).or_default().push(at);
        }
        Tapping { taps: taps.into(), sites, ..Tapping::default() }
    }

    fn at(&self, site: Site) -> Vec<usize> {
        self.sites.get(&(self.layer, site)).cloned().unwrap_or_default()
    }

    /// Whether a tap follows a statement.
    pub(crate) fn follows(&self, stmt: &Stmt) -> bool {
        !self.sites.is_empty() && !self.at(after(stmt)).is_empty()
    }

    /// Whether the calls that are being inlined are those that a tap names.
    fn is_called_by(&self, tap: &Tap) -> bool {
        let mut wanted = tap.calls.iter();
        let mut next = wanted.next();
        for call in &self.calls {
            if next.is_some_and(|(start, end)| (*start..*end).contains(call)) {
                next = wanted.next();
            }
        }
        next.is_none()
    }
}

fn after(stmt: &Stmt) -> Site {
    Site::After(stmt.span.start, stmt.span.end)
}

impl Lowerer<'_> {
    /// Makes the storage of all taps, at the start of the body.
    pub(crate) fn begin_taps(&mut self) {
        let taps = self.tapping.taps.clone();
        for tap in taps.iter() {
            if !self.has_room() {
                return;
            }
            let program = self.program;
            self.program = self.program_of(tap.layer);
            let value = self.allocate(tap.ty, &tap.name);
            self.program = program;
            self.silence(&value);
            self.store_zero(&value);
            let mask = self.flag(&tap.mask);
            let visits = tap.round.map(|_| self.flag("visits"));
            self.tapping.kept.push(Kept { value, mask, conditional: tap.conditional, visits });
        }
    }

    /// Makes outputs of all taps.
    pub(crate) fn end_taps(&mut self) {
        let taps = self.tapping.taps.clone();
        for (tap, kept) in taps.iter().zip(self.tapping.kept.clone()) {
            self.program = self.program_of(tap.layer);
            self.output(&kept.value, tap.ty, tap.name.to_string());
            if kept.conditional {
                let source = Source::Slot(kept.mask);
                self.b.body.outputs.push(Output { name: tap.mask.clone(), ty: Type::INT, source });
            }
        }
    }

    /// Writes the taps after a statement that does not jump. `exits` is the number of exits before it.
    pub(crate) fn tap_after(&mut self, stmt: &Stmt, exits: u32) {
        if !self.tapping.follows(stmt) {
            return;
        }
        let flow = flow::of(stmt);
        let flow = Flow { always: false, returns: flow.returns || self.exits > exits, ..flow };
        if flow.may_leave() {
            self.guarded(flow, |l| l.tap(after(stmt)));
        } else {
            self.tap(after(stmt));
        }
    }

    /// Writes the taps after a statement that is about to jump.
    pub(crate) fn tap_before_jump(&mut self, stmt: &Stmt) {
        if self.tapping.follows(stmt) {
            self.tap(after(stmt));
        }
    }

    /// Writes the taps at the end of a round of a loop.
    pub(crate) fn tap_round(&mut self, span: Span) {
        if !self.tapping.sites.is_empty() {
            self.tap(Site::Round(span.start, span.end));
        }
    }

    /// Writes the taps at the start of a round of a loop.
    pub(crate) fn tap_start(&mut self, span: Span) {
        if !self.tapping.sites.is_empty() {
            self.tap(Site::Start(span.start, span.end));
        }
    }

    /// Writes the taps where a condition is true or false.
    pub(crate) fn tap_branch(&mut self, cond: Span, is_true: bool) {
        if !self.tapping.sites.is_empty() {
            let site = if is_true { Site::True } else { Site::False };
            self.tap(site(cond.start, cond.end));
        }
    }

    fn tap(&mut self, site: Site) {
        let taps = self.tapping.taps.clone();
        for at in self.tapping.at(site) {
            let (Some(tap), Some(kept)) = (taps.get(at), self.tapping.kept.get(at).cloned()) else {
                continue;
            };
            if !self.tapping.is_called_by(tap) || !self.has_room() {
                continue;
            }
            if tap.var == Tapped::Visits {
                if let Storage::Leaf(count) = kept.value {
                    self.where_live(|l| {
                        l.count(count);
                    });
                }
                continue;
            }
            let Some(from) = self.tapped(tap) else { continue };
            if self.exits > 0
                && let Some(kept) = self.tapping.kept.get_mut(at)
            {
                kept.conditional = true;
            }
            self.where_live(|l| match (kept.visits, tap.round) {
                (Some(visits), Some(round)) => {
                    let now = l.count(visits);
                    let wanted = l.b.int(i32::try_from(round).unwrap_or(i32::MAX));
                    let is_it = l.b.lane(LaneOp::IEq, &[now, wanted]);
                    l.if_else(is_it, |l| l.keep(tap, &from, &kept), |_| ());
                }
                _ => l.keep(tap, &from, &kept),
            });
        }
    }

    /// Adds 1, and returns the sum.
    fn count(&mut self, visits: SlotId) -> ValueId {
        let (before, one) = (self.b.load(visits), self.b.int(1));
        let now = self.b.lane(LaneOp::IAdd, &[before, one]);
        self.b.store(visits, now);
        now
    }

    /// The storage of what a tap copies.
    fn tapped(&mut self, tap: &Tap) -> Option<Storage> {
        let mut storage = match tap.var {
            Tapped::Var(var) => self.storage(var)?,
            Tapped::Returned => self.frames.last()?.ret.clone()?.0,
            Tapped::Visits => return None,
        };
        for field in &tap.fields {
            let Storage::Struct(parts) = &storage else { return None };
            let part = parts.get(*field)?.clone();
            storage = part;
        }
        Some(storage)
    }

    fn keep(&mut self, tap: &Tap, from: &Storage, kept: &Kept) {
        let mut element = None;
        for index in &tap.elements {
            let index = self.b.int(i32::try_from(*index).unwrap_or(i32::MAX));
            element = Some(self.deeper(from, element, index));
        }
        match (tap.component, from, &kept.value) {
            (Some(component), Storage::Leaf(from), Storage::Leaf(to)) => {
                let value = self.read_leaf(*from, element);
                if self.b.body.kind(value) == Kind::Triple {
                    let index = self.b.int(i32::try_from(component).unwrap_or(0));
                    let value = self.b.lane(LaneOp::Get, &[value, index]);
                    self.b.store(*to, value);
                }
            }
            _ => self.copy(&kept.value, None, from, element),
        }
        self.set_flag(kept.mask, 1);
    }
}
