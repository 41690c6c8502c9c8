//! Which uniform values are the same in every batch of a run, so that a machine computes them once.
//!
//! These are constants, parameters and uniform globals, and what lane operations make of them; values that a
//! loop carries are not.

use super::uses::Uses;
use crate::step::NEVER;
use osl_ir::ir::{Body, Const, Inst, Kernel, Op, Rate, ValueId};

/// The number of steps with results that last, and the values that do.
#[derive(Debug)]
pub(super) struct Lasting<'a> {
    body: &'a Body,
    values: Vec<bool>,
    /// Number of steps.
    pub(super) steps: u32,
}

impl<'a> Lasting<'a> {
    pub(super) fn new(body: &'a Body) -> Lasting<'a> {
        Lasting { body, values: vec![false; body.values.len()], steps: 0 }
    }

    /// Notes the results of an instruction, all of whose arguments and inner instructions were noted. Returns
    /// the number of its step, or [`NEVER`].
    pub(super) fn note(&mut self, inst: &Inst, uses: &Uses<'_>) -> u32 {
        let is_uniform = |v: &ValueId| self.body.value(*v).rate == Rate::Uniform;
        if !inst.results.iter().all(is_uniform) {
            return NEVER;
        }
        match &inst.op {
            Op::Const(_) | Op::Global(_) | Op::GlobalDeriv(..) | Op::Input(_) => self.mark(&inst.results),
            Op::Lane(_, args) if args.iter().all(|arg| self.has(*arg)) => return self.step(inst),
            Op::Kernel(Kernel::SpaceMatrix { .. }, names)
                if names.iter().all(|name| self.is_affine(*name, uses)) =>
            {
                return self.step(inst);
            }
            Op::If { cond, then_yields, else_yields, .. } if self.has(*cond) => {
                for ((result, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
                    self.values[result.index()] = self.has(*a) && self.has(*b);
                }
                if self.lasts(inst) {
                    return self.step(inst);
                }
            }
            _ => {}
        }
        NEVER
    }

    /// Whether an instruction only computes values that last.
    fn lasts(&self, inst: &Inst) -> bool {
        match &inst.op {
            Op::Const(_) | Op::Global(_) | Op::GlobalDeriv(..) | Op::Input(_) => true,
            Op::Lane(..) => inst.results.iter().all(|result| self.has(*result)),
            Op::If { cond, then, otherwise, .. } => {
                let block = |id| self.body.block(id).insts.iter().all(|inst| self.lasts(inst));
                self.has(*cond)
                    && inst.results.iter().all(|result| self.has(*result))
                    && block(*then)
                    && block(*otherwise)
            }
            _ => false,
        }
    }

    fn has(&self, v: ValueId) -> bool {
        self.values.get(v.index()).copied().unwrap_or(false)
    }

    fn mark(&mut self, results: &[ValueId]) {
        results.iter().for_each(|result| self.values[result.index()] = true);
    }

    fn step(&mut self, inst: &Inst) -> u32 {
        self.mark(&inst.results);
        self.steps += 1;
        self.steps - 1
    }

    /// Whether a value is the name of a space with a known matrix.
    fn is_affine(&self, name: ValueId, uses: &Uses<'_>) -> bool {
        match uses.definer(name).map(|inst| &inst.op) {
            Some(Op::Const(Const::Str(name))) => self.body.assumptions.affine.contains(name),
            _ => false,
        }
    }
}
