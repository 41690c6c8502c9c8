//! Where branches leave their results, so that few of them have to be copied.
//!
//! A side of a branch yields a value that it computes: the value can be computed in the register of the
//! result. Or it passes on a value from before the branch that nothing else reads afterwards: the result can
//! take over its register. This module decides which values share a register.

use super::per_cell;
use super::uses::Uses;
use osl_ir::ir::{Body, Inst, Op, Rate, ValueId};
use rustc_hash::FxHashMap;

/// The register in which a value is computed, since the result of a branch is there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Home {
    pub(super) reg: u32,
    /// The value that was there before the branch, and may still be read.
    pub(super) occupant: Option<ValueId>,
}

/// The homes of the values that are not computed yet.
#[derive(Debug, Default)]
pub(super) struct Homes {
    of: FxHashMap<ValueId, Home>,
}

impl Homes {
    /// The home of a value that is computed now.
    pub(super) fn take(&mut self, v: ValueId) -> Option<Home> {
        self.of.remove(&v)
    }

    /// Gives the values that a branch yields the homes of its results. `homes` has one for each result that
    /// is in a register.
    pub(super) fn pass(&mut self, inst: &Inst, homes: &[Option<Home>], (body, uses): (&Body, &Uses<'_>)) {
        let Op::If { cond, then, otherwise, then_yields, else_yields } = &inst.op else { return };
        let one_side = body.value(*cond).rate == Rate::Uniform;
        for (is_first, block, yields) in [(true, *then, then_yields), (false, *otherwise, else_yields)] {
            for ((y, result), home) in yields.iter().zip(&inst.results).zip(homes) {
                let (Some(home), Some(own)) = (home, uses.definer(*y)) else { continue };
                let is_inside = uses.defined_at(*y) > uses.defined_at(*result);
                if !is_inside || !is_alike(body, uses, *y, *result) {
                    continue;
                }
                let fits = match (&own.op, home.occupant) {
                    // Code for a branch whose lanes part must not change what it reads.
                    (Op::If { cond, .. }, Some(v)) => {
                        body.value(*cond).rate == Rate::Uniform && uses.ends_in(own, *y, (body, block), v)
                    }
                    (Op::If { .. } | Op::Lane(..) | Op::Kernel(..) | Op::LoadElement(..), None) => true,
                    _ => false,
                };
                // Otherwise other lanes hold results of the first side: a value is computed for all lanes.
                if fits && (is_first || one_side) {
                    self.of.entry(*y).or_insert(*home);
                }
            }
        }
    }
}

/// The value from before a branch whose register its result can take over: a side passes it on, and nothing
/// reads it after the branch.
pub(super) fn occupant(inst: &Inst, at: usize, body: &Body, uses: &Uses<'_>) -> Option<ValueId> {
    let (result, mut inner) = (*inst.results.get(at)?, inst);
    let mut path = Vec::new();
    let begin = uses.defined_at(result);
    let fits = |v: ValueId| {
        let computed = matches!(
            uses.definer(v).map(|own| &own.op),
            Some(Op::Lane(..) | Op::Kernel(..) | Op::LoadElement(..) | Op::If { .. })
        );
        computed && uses.last_use(v) <= uses.end(result) && is_alike(body, uses, v, result)
    };
    let mut index = at;
    // A side may pass it on through branches of its own.
    loop {
        let Op::If { then_yields, else_yields, .. } = &inner.op else { return None };
        let sides = [else_yields.get(index).copied()?, then_yields.get(index).copied()?];
        path.push((inner, index));
        if let Some(v) = sides.into_iter().find(|v| uses.defined_at(*v) < begin && fits(*v)) {
            let is_alone = path.iter().all(|(branch, at)| !is_yielded_elsewhere(branch, *at, v, uses));
            return is_alone.then_some(v);
        }
        let branch = |v: &ValueId| {
            let own = uses.definer(*v).filter(|own| matches!(own.op, Op::If { .. }))?;
            (uses.defined_at(*v) > begin).then_some((own, *v))
        };
        let (own, v) = sides.iter().find_map(branch)?;
        index = own.results.iter().position(|result| *result == v)?;
        inner = own;
    }
}

/// Whether a branch yields a value, or a part of it, as another result too.
fn is_yielded_elsewhere(inst: &Inst, at: usize, v: ValueId, uses: &Uses<'_>) -> bool {
    let Op::If { then_yields, else_yields, .. } = &inst.op else { return true };
    let is_other = |list: &[ValueId]| list.iter().enumerate().any(|(i, y)| i != at && uses.root(*y) == v);
    is_other(then_yields) || is_other(else_yields)
}

/// Whether two values can be in the same register.
fn is_alike(body: &Body, uses: &Uses<'_>, a: ValueId, b: ValueId) -> bool {
    let has_register = |v: ValueId| {
        body.value(v).rate == Rate::Varying && per_cell::group(body, v).is_none() && uses.root(v) == v
    };
    body.kind(a).words() == body.kind(b).words() && has_register(a) && has_register(b)
}

impl Uses<'_> {
    /// Whether a branch in a block is the last to read a value there, and yields it only in one place.
    fn ends_in(
        &self,
        branch: &Inst,
        result: ValueId,
        (body, block): (&Body, osl_ir::ir::BlockId),
        v: ValueId,
    ) -> bool {
        let Some(at) = branch.results.iter().position(|r| *r == result) else { return false };
        let after = body.block(block).insts.iter().rev().take_while(|inst| !std::ptr::eq(*inst, branch));
        let mut is_read = false;
        for inst in after {
            // What is in another branch or loop is not looked at.
            is_read |= matches!(inst.op, Op::If { .. } | Op::Loop { .. });
            inst.op.for_each_use(|used| is_read |= self.root(used) == v);
        }
        !is_read && !is_yielded_elsewhere(branch, at, v, self)
    }
}
