//! Regions of a block: loops, and parts that are skipped where no lane needs them.
//!
//! A region carries values: those with which it begins, those of each round, and those that it leaves. A lane
//! that has left a loop stays in its vector until all others have left, and keeps its values. Values of a
//! region are not known after it, except those that it carries and those that are in memory anyway.

use crate::block::{Block, Open};
use crate::inst::{Array, Carry, Inst, Kind, MaskValue, Op, Region, Value};
use rustc_hash::FxHashSet;

/// A loop that has begun.
#[derive(Clone, Debug)]
pub struct Begun {
    /// The lanes that are in the current round.
    pub active: MaskValue,
    /// The carried values in the current round.
    pub values: Vec<Value>,
}

/// A carried value at the end of a round.
#[derive(Clone, Copy, Debug)]
pub struct Next {
    /// Its value in the next round.
    pub value: Value,
    /// Whether a lane that has left the loop keeps its value. If not, such lanes are unspecified.
    pub kept: bool,
}

impl Block {
    /// Begins a loop for the lanes of a mask, whose first round always runs; each round takes `cost` from the
    /// budget of the call. [`Block::end_loop`] ends it.
    pub fn begin_loop(&mut self, active: MaskValue, inits: &[Value], cost: u32) -> Begun {
        let inits: Vec<u32> = std::iter::once(active.0).chain(inits.iter().map(|v| v.0)).collect();
        let mut params = self.begin(Kind::Loop, cost, &inits).into_iter();
        let active = MaskValue(params.next().unwrap_or(0));
        Begun { active, values: params.map(Value).collect() }
    }

    /// Ends the round of the innermost loop. Lanes with `again` go on. Returns the carried values, each as it
    /// was at the end of the last round of its lane.
    pub fn end_loop(&mut self, begun: &Begun, next: &[Next], again: MaskValue) -> Vec<Value> {
        let again = self.both(begun.active, again);
        let chosen = next.iter().zip(&begun.values).map(|(next, param)| {
            if next.kept { self.choose(begun.active, next.value, *param) } else { next.value }
        });
        let list: Vec<u32> = std::iter::once(again.0).chain(chosen.map(|v| v.0)).collect();
        self.end(&list, again.0).into_iter().skip(1).map(Value).collect()
    }

    /// Begins a part that is skipped unless a lane of the mask is set, and then takes `cost` from the budget.
    /// [`Block::end_skip`] ends it.
    pub fn begin_skip(&mut self, mask: MaskValue, inits: &[Value], cost: u32) {
        let inits: Vec<u32> = inits.iter().map(|v| v.0).collect();
        self.begin(Kind::Skip { mask: mask.0 }, cost, &inits);
    }

    /// Ends the innermost part that may be skipped. Returns what it carries: the values given here if it ran,
    /// and those from its beginning if it was skipped. So lanes outside of its mask may have either.
    pub fn end_skip(&mut self, next: &[Value]) -> Vec<Value> {
        let list: Vec<u32> = next.iter().map(|v| v.0).collect();
        self.end(&list, 0).into_iter().map(Value).collect()
    }

    /// Stops the code if a lane of the mask is set. What comes later is not done for this vector, nor for
    /// later ones.
    pub fn stop_if(&mut self, mask: MaskValue) {
        self.push(Op::Stop, &[mask.0]);
    }

    /// Whether it writes lanes of an array that it also reads: after it has stopped, it cannot run again.
    pub fn overwrites_inputs(&self) -> bool {
        let written = |inst: &Inst| match inst.op {
            Op::Store(array, word) => Some((array, word)),
            _ => None,
        };
        let written: FxHashSet<(Array, u32)> = self.insts.iter().filter_map(written).collect();
        self.insts.iter().any(|inst| matches!(inst.op, Op::Lanes(a, word) if written.contains(&(a, word))))
    }

    /// The arrays that it writes at offsets.
    pub fn written_at(&self) -> Vec<Array> {
        let mut list: Vec<Array> = Vec::new();
        for inst in &self.insts {
            if let Op::StoreAt(array, _) = inst.op
                && !list.contains(&array)
            {
                list.push(array);
            }
        }
        list
    }

    /// Whether code for it needs jumps, or addresses that depend on values.
    pub(crate) fn is_plain(&self) -> bool {
        let plain = |op: Op| !op.reads_stored() && !matches!(op, Op::StoreAt(..) | Op::Stop);
        self.regions.is_empty() && self.insts.iter().all(|inst| plain(inst.op))
    }

    /// Whether it has regions, or may stop.
    pub fn may_stop(&self) -> bool {
        !self.regions.is_empty() || self.insts.iter().any(|inst| inst.op == Op::Stop)
    }

    fn begin(&mut self, kind: Kind, cost: u32, inits: &[u32]) -> Vec<u32> {
        let region = self.regions.len() as u32;
        let begin = self.push(Op::Begin(region), &[]);
        let carried = inits.iter().map(|init| {
            let mask = self.insts.get(*init as usize).is_some_and(|inst| inst.op.is_mask());
            let param = self.push(Op::Carried { mask }, &[]);
            Carry { init: *init, param, next: 0, result: 0 }
        });
        let carried: Vec<Carry> = carried.collect();
        let params = carried.iter().map(|carry| carry.param).collect();
        self.regions.push(Region { kind, cost, begin, end: begin, carried, again: 0 });
        self.open.push(Open { region, ..Open::default() });
        params
    }

    fn end(&mut self, next: &[u32], again: u32) -> Vec<u32> {
        let Some(open) = self.open.pop() else { return Vec::new() };
        for inst in open.known {
            self.known.remove(&inst);
        }
        for (place, before) in open.held.into_iter().rev() {
            match before {
                Some(value) => self.held.insert(place, value),
                None => self.held.remove(&place),
            };
        }
        let end = self.push(Op::End(open.region), &[]);
        let masks: Vec<bool> =
            next.iter().map(|v| self.insts.get(*v as usize).is_some_and(|inst| inst.op.is_mask())).collect();
        let results: Vec<u32> = masks.into_iter().map(|mask| self.push(Op::Carried { mask }, &[])).collect();
        if let Some(region) = self.regions.get_mut(open.region as usize) {
            (region.end, region.again) = (end, again);
            for ((carry, next), result) in region.carried.iter_mut().zip(next).zip(&results) {
                (carry.next, carry.result) = (*next, *result);
            }
        }
        results
    }

    /// For each operation, whether anything needs it.
    pub(crate) fn needed(&self) -> Vec<bool> {
        let mut needed: Vec<bool> = self.insts.iter().map(|inst| inst.op.has_effect()).collect();
        loop {
            let mut grown = false;
            for (at, inst) in self.insts.iter().enumerate().rev() {
                if !needed[at] {
                    continue;
                }
                let list = match inst.op {
                    Op::Begin(region) => self.region_args(region, false, &needed),
                    Op::End(region) => self.region_args(region, true, &needed),
                    _ => inst.args().into(),
                };
                for v in list {
                    grown |= !std::mem::replace(&mut needed[v as usize], true);
                }
            }
            // A value of the next round may be needed only by an earlier operation.
            if !grown || self.regions.is_empty() {
                return needed;
            }
        }
    }

    /// What the start or the end of a region reads, given what is needed: carried values in order, and the
    /// mask that decides.
    pub(crate) fn region_args(&self, region: u32, at_end: bool, needed: &[bool]) -> Vec<u32> {
        let Some(region) = self.regions.get(region as usize) else { return Vec::new() };
        let carried = region.carried.iter().filter(|carry| carry.is_needed(needed));
        let read = |carry: &Carry| if at_end { carry.next } else { carry.init };
        let mut list: Vec<u32> = carried.map(read).collect();
        match region.kind {
            Kind::Loop if at_end => list.push(region.again),
            Kind::Skip { mask } if !at_end => list.push(mask),
            _ => {}
        }
        list
    }
}
