//! Machine code for sequences of lane operations: the sequences that occur, and the code compiled for them.
//!
//! The same sequences of lane operations recur from batch to batch. A sequence that has been executed for
//! some thousands of lanes is compiled to one loop whose intermediate values stay in registers; values that
//! are not read later are not even stored. Operations without machine code still run in the interpreter,
//! between compiled runs. The results have the same bits either way. The program keeps the plans, so that all
//! threads and all runs share them.
//!
//! Branches and loops are compiled as a whole, with everything in them.
//!
//! `plan` makes and executes plans, and `cut` divides long ones. `record` turns the body of an operation into
//! vector operations; `region` does so for the steps of a branch or a loop. Except for `region`, this module
//! must not know masks, or steps other than lane operations.

mod cut;
mod plan;
mod record;
mod region;

use crate::arithmetic::Style;
use crate::lanes::Ready;
use osl_native::{Scratch, Target};
use osl_simd::Isa;
pub(crate) use plan::{Files, Plan};
pub(crate) use region::{Form, RegionPlan, each_operand};
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

/// Which sequences of lane operations become machine code. The results have the same bits either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Native {
    /// None: everything is interpreted.
    Never,
    /// Those that occur often enough to be worth it, if the machine can run such code.
    #[default]
    Recurring,
    /// All, if the machine can run such code; for tests.
    Always,
}

/// A sequence is compiled after it was executed for this many lanes, an estimate of the time for compiling
/// it.
const WORTH: usize = 4096;
/// A branch or a loop is compiled after it took this many steps of work, summed over lanes.
const STEPS_WORTH: u64 = 1 << 18;
/// Fewer lanes count as this many, since a call takes as long as they do.
const FEW: usize = 256;
/// Maximum size of a program's code: the source is bounded, but code is longer.
const MAX_BYTES: usize = 4 << 20;
/// Maximum number of operations in a sequence.
pub(crate) const MAX_RUN: usize = 4096;
/// Maximum number of sequences that start with the same operation: each may occur with several states of its
/// cells.
const MAX_FORMS: usize = 64;

/// The key of a queued lane operation, which identifies it in the program and includes the state of its
/// cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Key(pub(crate) u64);

/// The plans of a program, by the operations and by the number of lanes in a batch.
#[derive(Debug, Default)]
pub(crate) struct Plans(Mutex<PlanStore>);

/// For what a plan is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Shape {
    /// Number of lanes in a batch: whole vectors of the target.
    width: usize,
    style: Style,
    target: Target,
}

/// The key of a plan: the shape of the batches, and the operations.
type Name = (Shape, Box<[Key]>);

#[derive(Debug, Default)]
struct PlanStore {
    plans: FxHashMap<Name, Option<Arc<Plan>>>,
    regions: FxHashMap<(Shape, Form), Option<Arc<RegionPlan>>>,
    bytes: usize,
}

impl Plans {
    /// The plans, unless another machine has them, perhaps to make one: then it is better to interpret for a
    /// while than to wait. With `waits`, waits all the same.
    fn open(&self, waits: bool) -> Option<MutexGuard<'_, PlanStore>> {
        match self.0.try_lock() {
            Ok(made) => Some(made),
            Err(TryLockError::Poisoned(made)) => Some(made.into_inner()),
            Err(TryLockError::WouldBlock) => {
                waits.then(|| self.0.lock().unwrap_or_else(PoisonError::into_inner))
            }
        }
    }

    /// The plan of a sequence, if it was made.
    fn find(&self, shape: Shape, keys: &[Key], waits: bool) -> Option<Arc<Plan>> {
        self.open(waits)?.plans.get(&(shape, keys.into()))?.clone()
    }

    /// The plan of a sequence, made if necessary: `None` if another machine has the plans, the inner `None`
    /// if it cannot have one.
    fn plan<'a>(
        &self,
        shape: Shape,
        keys: &[Key],
        sequence: impl FnOnce() -> Sequence<'a>,
        waits: bool,
    ) -> Option<Option<Arc<Plan>>> {
        let mut made = self.open(waits)?;
        let key = (shape, keys.into());
        if let Some(plan) = made.plans.get(&key) {
            return Some(plan.clone());
        }
        let plan = if made.bytes < MAX_BYTES { Plan::new(&sequence(), shape).map(Arc::new) } else { None };
        made.bytes += plan.as_ref().map_or(0, |plan| plan.bytes());
        made.plans.insert(key, plan.clone());
        Some(plan)
    }

    /// The plan of a region in a form, made if it is known how: `None` also if another machine has the plans,
    /// the inner `None` if it cannot have one.
    fn region(
        &self,
        key: (Shape, Form),
        make: Option<impl FnOnce(Shape) -> Option<RegionPlan>>,
        waits: bool,
    ) -> Option<Option<Arc<RegionPlan>>> {
        let mut made = self.open(waits)?;
        if let Some(plan) = made.regions.get(&key) {
            return Some(plan.clone());
        }
        let make = make?;
        let plan = if made.bytes < MAX_BYTES { make(key.0).map(Arc::new) } else { None };
        made.bytes += plan.as_ref().map_or(0, |plan| plan.bytes());
        made.regions.insert(key, plan.clone());
        Some(plan)
    }
}

/// A queued operation with resolved arguments, and the position at which its result is read for the last
/// time; positions count the instructions of the program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QueuedOp {
    pub(crate) ready: Ready,
    pub(crate) at: u32,
    pub(crate) last: u32,
}

/// Queued operations.
pub(crate) struct Sequence<'a> {
    pub(crate) items: Vec<QueuedOp>,
    /// A word of the uniform file, if it is a constant of the program.
    pub(crate) constant: &'a dyn Fn(u32) -> Option<u32>,
}

/// The sequences that a machine has executed.
#[derive(Debug)]
pub(crate) struct PlanCache {
    target: Target,
    /// Number of lanes after which a sequence is compiled.
    worth: usize,
    /// The sequences, by their first operation.
    runs: FxHashMap<(Shape, Key), Vec<Run>>,
    pub(crate) scratch: Scratch,
}

#[derive(Debug)]
struct Run {
    keys: Box<[Key]>,
    /// Number of lanes for which it was executed, until compilation was tried.
    times: Option<usize>,
    plan: Option<Arc<Plan>>,
}

impl PlanCache {
    /// An empty state, if there is to be machine code and the machine can run that of an instruction set.
    pub(crate) fn new(native: Native, isa: Isa) -> Option<PlanCache> {
        let target = Target::supported(isa.name())?;
        let worth = match native {
            Native::Never => return None,
            Native::Recurring => WORTH,
            Native::Always => 0,
        };
        Some(PlanCache { target, worth, runs: FxHashMap::default(), scratch: Scratch::default() })
    }

    /// The shape of batches with a number of lanes; `None` if they do not fill vectors.
    pub(crate) fn shape(&self, style: Style, width: usize) -> Option<Shape> {
        let target = self.target;
        width.is_multiple_of(target.lanes()).then_some(Shape { width, style, target })
    }

    /// Whether work has been done often enough, at some steps for some lanes, to compile it.
    pub(crate) fn is_worth(&self, steps: u64, lanes: usize) -> bool {
        self.worth == 0 || steps.saturating_mul(lanes as u64) > STEPS_WORTH
    }

    /// The plan of a region in a form for batches of a shape: `None` if there is none yet and it is not to be
    /// made, the inner `None` if it cannot have one.
    pub(crate) fn region(
        &self,
        plans: &Plans,
        key: (Shape, Form),
        make: Option<impl FnOnce(Shape) -> Option<RegionPlan>>,
    ) -> Option<Option<Arc<RegionPlan>>> {
        plans.region(key, make, self.worth == 0)
    }

    /// The plan of a sequence for batches of a shape, if it has occurred often enough.
    pub(crate) fn plan<'a>(
        &mut self,
        plans: &Plans,
        shape: Shape,
        keys: &[Key],
        sequence: impl FnOnce() -> Sequence<'a>,
    ) -> Option<Arc<Plan>> {
        let runs = self.runs.entry((shape, *keys.first()?)).or_default();
        let at = match runs.iter().position(|run| *run.keys == *keys) {
            Some(at) => at,
            None if runs.len() < MAX_FORMS => {
                let plan = plans.find(shape, keys, self.worth == 0);
                runs.push(Run { keys: keys.into(), times: plan.is_none().then_some(0), plan });
                runs.len() - 1
            }
            None => return None,
        };
        let run = runs.get_mut(at)?;
        if let Some(times) = &mut run.times {
            *times += 1;
            if *times * shape.width.max(FEW) <= self.worth {
                return None;
            }
            run.plan = plans.plan(shape, keys, sequence, self.worth == 0)?;
            run.times = None;
        }
        run.plan.clone()
    }
}

#[cfg(test)]
mod tests;
