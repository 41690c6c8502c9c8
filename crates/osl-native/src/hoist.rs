//! Moves what does not change from round to round out of loops.
//!
//! An operation without effect whose operands all come from outside of a loop is computed once before it. The
//! values keep their bits.

use crate::block::Block;
use crate::inst::{Inst, Kind, Op};

impl Block {
    /// Moves operations out of the loops in which they do not change.
    pub(crate) fn hoist(&mut self) {
        if !self.regions.iter().any(|region| region.kind == Kind::Loop) {
            return;
        }
        // The loop before which each operation goes, if it moves; outer loops come first.
        let mut target: Vec<Option<u32>> = vec![None; self.insts.len()];
        let mut around: Vec<u32> = Vec::new();
        for (at, inst) in self.insts.iter().enumerate() {
            match inst.op {
                Op::Begin(region) => around.push(region),
                Op::End(_) => {
                    around.pop();
                }
                op if op.has_effect() || op.reads_stored() || op.is_source() => {}
                Op::Carried { .. } => {}
                _ => {
                    let is_outside = |v: u32, begin: u32| {
                        let moved = target.get(v as usize).copied().flatten();
                        let place = moved.and_then(|r| self.regions.get(r as usize)).map_or(v, |r| r.begin);
                        place < begin || moved.is_some() && place == begin || self.is_source(v)
                    };
                    let loops = around.iter().copied().filter(|region| self.is_loop(*region));
                    let mut outermost = loops.filter(|region| {
                        let begin = self.regions.get(*region as usize).map_or(0, |region| region.begin);
                        inst.args().iter().all(|v| is_outside(*v, begin))
                    });
                    let found = outermost.next();
                    if let Some(slot) = target.get_mut(at) {
                        *slot = found;
                    }
                }
            }
        }
        if target.iter().any(Option::is_some) {
            self.renumber(&target);
        }
    }

    fn is_loop(&self, region: u32) -> bool {
        self.regions.get(region as usize).is_some_and(|region| region.kind == Kind::Loop)
    }

    fn is_source(&self, v: u32) -> bool {
        self.insts.get(v as usize).is_some_and(|inst| inst.op.is_source())
    }

    /// Writes the operations in their new order: those that move, before the loop that they leave.
    fn renumber(&mut self, target: &[Option<u32>]) {
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.regions.len()];
        for (at, target) in target.iter().enumerate() {
            if let Some(list) = target.and_then(|region| before.get_mut(region as usize)) {
                list.push(at as u32);
            }
        }
        // Sources that a moved operation reads go with it: they are in memory at any time of a region.
        let mut order: Vec<u32> = Vec::with_capacity(self.insts.len());
        let mut placed = vec![false; self.insts.len()];
        let mut place = |v: u32, order: &mut Vec<u32>| {
            if !std::mem::replace(&mut placed[v as usize], true) {
                order.push(v);
            }
        };
        for (at, inst) in self.insts.iter().enumerate() {
            if let Op::Begin(region) = inst.op {
                for v in before.get(region as usize).into_iter().flatten() {
                    for arg in self.insts.get(*v as usize).map(Inst::args).unwrap_or_default() {
                        if self.is_source(*arg) {
                            place(*arg, &mut order);
                        }
                    }
                    place(*v, &mut order);
                }
            }
            if target.get(at).copied().flatten().is_none() {
                place(at as u32, &mut order);
            }
        }
        self.reorder(&order);
    }
}
