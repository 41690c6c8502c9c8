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
//! vector operations; `region` does so for the steps of a branch or a loop. Only `region` knows masks.

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
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};

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
/// Maximum number of sequences of a program, in batches of all widths.
const MAX_NAMES: usize = 1 << 14;

/// The key of a queued lane operation, which identifies it in the program and includes the state of its
/// cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Key(pub(crate) u64);

/// The plans of a program, by the operations and by the number of lanes in a batch; and how often what has no
/// plan yet was executed by all machines together, so that many short runs count like a long one.
#[derive(Debug)]
pub(crate) struct Plans {
    store: Mutex<PlanStore>,
    /// For each region, the steps that its interpretation took, summed over lanes.
    spent: Box<[AtomicU64]>,
}

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

/// What all machines know of a sequence.
#[derive(Debug, Default)]
struct Known {
    /// Number of lanes for which it was executed before it had a plan.
    lanes: AtomicUsize,
    /// The plan, once compilation was tried.
    plan: OnceLock<Option<Plan>>,
}

#[derive(Debug, Default)]
struct PlanStore {
    plans: FxHashMap<Name, Arc<Known>>,
    regions: FxHashMap<(Shape, Form), Option<Arc<RegionPlan>>>,
    bytes: usize,
}

impl Plans {
    /// Those of a program with so many regions, none made yet.
    pub(crate) fn new(regions: u32) -> Plans {
        Plans { store: Mutex::default(), spent: (0..regions).map(|_| AtomicU64::new(0)).collect() }
    }

    /// The plans, unless another machine has them, perhaps to make one: then it is better to interpret for a
    /// while than to wait. With `waits`, waits all the same.
    fn open(&self, waits: bool) -> Option<MutexGuard<'_, PlanStore>> {
        match self.store.try_lock() {
            Ok(made) => Some(made),
            Err(TryLockError::Poisoned(made)) => Some(made.into_inner()),
            Err(TryLockError::WouldBlock) => {
                waits.then(|| self.store.lock().unwrap_or_else(PoisonError::into_inner))
            }
        }
    }

    /// What is known of a sequence; `None` if another machine has the plans, or if there are too many.
    fn known(&self, shape: Shape, keys: &[Key], waits: bool) -> Option<Arc<Known>> {
        let mut made = self.open(waits)?;
        let name = (shape, keys.into());
        if made.plans.len() >= MAX_NAMES {
            return made.plans.get(&name).cloned();
        }
        Some(made.plans.entry(name).or_default().clone())
    }

    /// Makes the plan of a sequence, unless another machine has the plans.
    fn make<'a>(&self, shape: Shape, known: &Known, sequence: impl FnOnce() -> Sequence<'a>, waits: bool) {
        let Some(mut made) = self.open(waits) else { return };
        known.plan.get_or_init(|| {
            let plan = if made.bytes < MAX_BYTES { Plan::new(&sequence(), shape) } else { None };
            made.bytes += plan.as_ref().map_or(0, Plan::bytes);
            plan
        });
    }

    /// Counts work that the interpretation of a region took: some steps for each of some lanes.
    pub(crate) fn note_region(&self, region: u32, steps: u64, lanes: usize) {
        if let Some(spent) = self.spent.get(region as usize) {
            spent.fetch_add(steps.saturating_mul(lanes as u64).min(STEPS_WORTH + 1), Ordering::Relaxed);
        }
    }

    /// The plan of a region in a form, made if there is none: `None` if another machine has the plans, the
    /// inner `None` if it cannot have one.
    fn region(
        &self,
        key: (Shape, Form),
        make: impl FnOnce(Shape) -> Option<RegionPlan>,
        waits: bool,
    ) -> Option<Option<Arc<RegionPlan>>> {
        let mut made = self.open(waits)?;
        if let Some(plan) = made.regions.get(&key) {
            return Some(plan.clone());
        }
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
    runs: Vec<Run>,
    /// The sequences that start with an operation.
    starts: FxHashMap<(Shape, Key), Vec<usize>>,
    /// The sequence that was executed last.
    last: usize,
    pub(crate) scratch: Scratch,
}

#[derive(Debug)]
struct Run {
    shape: Shape,
    keys: Box<[Key]>,
    known: Arc<Known>,
    /// The sequence that followed it the last time.
    next: usize,
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
        let (runs, starts, scratch) = Default::default();
        Some(PlanCache { target, worth, runs, starts, last: 0, scratch })
    }

    /// The shape of batches with a number of lanes; `None` if they do not fill vectors.
    pub(crate) fn shape(&self, style: Style, width: usize) -> Option<Shape> {
        let target = self.target;
        width.is_multiple_of(target.lanes()).then_some(Shape { width, style, target })
    }

    /// Whether a region has taken enough work to compile it.
    pub(crate) fn is_worth(&self, plans: &Plans, region: u32) -> bool {
        let spent = plans.spent.get(region as usize).map_or(0, |spent| spent.load(Ordering::Relaxed));
        self.worth == 0 || spent > STEPS_WORTH
    }

    /// The plan of a region in a form for batches of a shape, made if there is none: `None` if another
    /// machine has the plans, the inner `None` if it cannot have one.
    pub(crate) fn region(
        &self,
        plans: &Plans,
        key: (Shape, Form),
        make: impl FnOnce(Shape) -> Option<RegionPlan>,
    ) -> Option<Option<Arc<RegionPlan>>> {
        plans.region(key, make, self.worth == 0)
    }

    /// The plan of a sequence for batches of a shape, if it has one, and the working memory of its code.
    pub(crate) fn find(&mut self, shape: Shape, keys: &[Key]) -> Option<(&Plan, &mut Scratch)> {
        let at = self.seek(shape, keys)?;
        self.runs.get(at)?.known.plan.get()?.as_ref().zip(Some(&mut self.scratch))
    }

    /// The number of a sequence, if it was executed before.
    fn seek(&mut self, shape: Shape, keys: &[Key]) -> Option<usize> {
        let PlanCache { runs, starts, last, .. } = self;
        let is_it = |at: &usize| runs.get(*at).is_some_and(|run| run.shape == shape && *run.keys == *keys);
        // Most batches execute the same sequences one after the other.
        let expected = runs.get(*last).map(|run| run.next).filter(is_it);
        let at = match expected {
            Some(at) => at,
            None => starts.get(&(shape, *keys.first()?))?.iter().copied().find(is_it)?,
        };
        self.follow(at);
        Some(at)
    }

    /// Notes that a sequence follows the last one.
    fn follow(&mut self, at: usize) {
        if let Some(last) = self.runs.get_mut(self.last) {
            last.next = at;
        }
        self.last = at;
    }

    /// Counts that a sequence is executed for some lanes of batches of a shape, and makes its plan if that
    /// has occurred often enough.
    pub(crate) fn note<'a>(
        &mut self,
        plans: &Plans,
        (shape, lanes): (Shape, usize),
        keys: &[Key],
        sequence: impl FnOnce() -> Sequence<'a>,
    ) {
        let waits = self.worth == 0;
        let Some(at) = self.seek(shape, keys).or_else(|| self.add(plans, shape, keys)) else { return };
        let Some(known) = self.runs.get(at).map(|run| &*run.known) else { return };
        if known.plan.get().is_none() {
            let lanes = lanes.max(FEW);
            if known.lanes.fetch_add(lanes, Ordering::Relaxed).saturating_add(lanes) > self.worth {
                plans.make(shape, known, sequence, waits);
            }
        }
    }

    /// Adds a sequence, unless it has too many forms or another machine has the plans.
    fn add(&mut self, plans: &Plans, shape: Shape, keys: &[Key]) -> Option<usize> {
        let forms = self.starts.entry((shape, *keys.first()?)).or_default();
        if forms.len() >= MAX_FORMS {
            return None;
        }
        let at = self.runs.len();
        let known = plans.known(shape, keys, self.worth == 0)?;
        forms.push(at);
        self.runs.push(Run { shape, keys: keys.into(), known, next: 0 });
        self.follow(at);
        Some(at)
    }
}

#[cfg(test)]
mod tests;
