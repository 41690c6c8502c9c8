//! Machine code for sequences of lane operations: the sequences that occur, and the code compiled for them.
//!
//! The same sequences of lane operations recur from batch to batch. A sequence that has been executed for
//! some thousands of lanes is compiled to one loop whose intermediate values stay in registers; values that
//! are not read later are not even stored. Operations without machine code still run in the interpreter,
//! between compiled runs. The results have the same bits either way. The program keeps the plans, so that all
//! threads and all runs share them.
//!
//! `plan` makes and executes plans. This module must not know masks, or steps other than lane operations.

mod fast;
mod operation;
mod plan;

use crate::lanes::Ready;
pub(crate) use operation::Style;
use osl_native::Scratch;
pub(crate) use plan::{Files, Plan};
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, PoisonError};

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
pub(crate) struct Plans(Mutex<Made>);

/// The number of lanes in a batch, and the arithmetic.
pub(crate) type Shape = (usize, Style);

/// The key of a plan: the shape of the batches, and the operations.
type Name = (Shape, Box<[Key]>);

#[derive(Debug, Default)]
struct Made {
    plans: FxHashMap<Name, Option<Arc<Plan>>>,
    bytes: usize,
}

impl Plans {
    /// The plan of a sequence, if it was made.
    fn find(&self, shape: Shape, keys: &[Key]) -> Option<Arc<Plan>> {
        let made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        made.plans.get(&(shape, keys.into()))?.clone()
    }

    /// The plan of a sequence, made if necessary; `None` if it cannot have one.
    fn plan(&self, shape: Shape, keys: &[Key], ready: impl FnOnce() -> Vec<Waiting>) -> Option<Arc<Plan>> {
        let mut made = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (shape, keys.into());
        if let Some(plan) = made.plans.get(&key) {
            return plan.clone();
        }
        let plan = if made.bytes < MAX_BYTES { Plan::new(&ready(), shape).map(Arc::new) } else { None };
        made.bytes += plan.as_ref().map_or(0, |plan| plan.bytes());
        made.plans.insert(key, plan.clone());
        plan
    }
}

/// A queued operation with resolved arguments, and the position at which its result is read for the last
/// time; positions count the instructions of the program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting {
    pub(crate) ready: Ready,
    pub(crate) at: u32,
    pub(crate) last: u32,
}

/// The sequences that a machine has executed.
#[derive(Debug, Default)]
pub(crate) struct Known {
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

impl Known {
    /// An empty state, if there is to be machine code.
    pub(crate) fn new(native: Native) -> Option<Known> {
        let worth = match native {
            Native::Never => return None,
            Native::Recurring => WORTH,
            Native::Always => 0,
        };
        Some(Known { worth, ..Known::default() })
    }

    /// The plan of a sequence for batches of a shape, if it has occurred often enough.
    pub(crate) fn plan(
        &mut self,
        plans: &Plans,
        shape: Shape,
        keys: &[Key],
        ready: impl FnOnce() -> Vec<Waiting>,
    ) -> Option<Arc<Plan>> {
        let runs = self.runs.entry((shape, *keys.first()?)).or_default();
        let at = match runs.iter().position(|run| *run.keys == *keys) {
            Some(at) => at,
            None if runs.len() < MAX_FORMS => {
                let plan = plans.find(shape, keys);
                runs.push(Run { keys: keys.into(), times: plan.is_none().then_some(0), plan });
                runs.len() - 1
            }
            None => return None,
        };
        let run = runs.get_mut(at)?;
        if let Some(times) = &mut run.times {
            *times += 1;
            if *times * shape.0.max(FEW) <= self.worth {
                return None;
            }
            run.times = None;
            run.plan = plans.plan(shape, keys, ready);
        }
        run.plan.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{Arithmetic, Fast, Strict};
    use crate::lanes::{From, ReadyArg, ReadyLane};
    use crate::register::Lanes;
    use osl_ir::ir::{Kind, LaneOp, MAX_ARGS};
    use osl_noise::Isa;

    /// Words that are difficult for operations, and words in between.
    fn word(state: &mut u32, kind: Kind) -> u32 {
        *state ^= *state << 13;
        *state ^= *state >> 17;
        *state ^= *state << 5;
        let floats = [
            0.0,
            -0.0,
            0.5,
            -0.5,
            1.0,
            -1.0,
            2.5,
            -2.5,
            0.49999997,
            1e-20,
            -1e-20,
            1e-40,
            1e20,
            -1e20,
            3e38,
            8388607.5,
            2147483648.0,
            f32::MIN_POSITIVE,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        let ints = [0, 1, 2, -1, 3, 31, 32, i32::MAX, i32::MIN];
        let pick = *state as usize >> 8;
        match (kind, *state % 3) {
            (Kind::Int | Kind::Str | Kind::Closure, 0) => *state,
            (Kind::Int | Kind::Str | Kind::Closure, _) => ints[pick % ints.len()] as u32,
            (_, 0) => floats[pick % floats.len()].to_bits(),
            (_, 1) => (*state as f32 / 4e8 - 5.0).to_bits(),
            _ => ((*state % 9) as f32 / 2.0 - 1.0).to_bits(),
        }
    }

    /// Every supported operation gives the bits of its body, for arguments that are lanes or a single value,
    /// and for triples if it works on each component.
    #[test]
    fn operations_have_the_bits_of_their_bodies() {
        if osl_native::is_supported() {
            operations::<Strict>(Isa::baseline(), Style::Strict);
            // Products and sums are fused if the instruction set supports it.
            operations::<Fast>(Isa::detect(), Style::Fast);
        }
    }

    fn operations<A: Arithmetic<Word = u32>>(isa: Isa, style: Style) {
        let (width, mut state) = (512, 0x1234_5678);
        let known: Vec<LaneOp> =
            LaneOp::ALL.iter().copied().filter(|op| operation::is_known(*op, style)).collect();
        assert!(known.len() > 60, "{}", known.len());
        for op in known {
            let shape = op.shape();
            for (forms, triples) in (0..1 << shape.args.len()).flat_map(|f| [(f, false), (f, true)]) {
                if triples && !shape.per_component {
                    continue;
                }
                let parts = if triples { 3 } else { 1 };
                let kinds = shape.args.iter().map(|kind| match kind {
                    Kind::Float if triples => Kind::Triple,
                    kind => *kind,
                });
                let mut registers = vec![Lanes::new(width * parts * shape.result.words() as usize)];
                let (mut words, mut args) = (Vec::new(), Vec::new());
                for (number, kind) in kinds.enumerate() {
                    let count = kind.words() as usize;
                    let (from, apart) = if forms >> number & 1 == 0 {
                        let mut lanes = Lanes::new(width * count);
                        lanes.words_mut().iter_mut().for_each(|to| *to = word(&mut state, kind));
                        registers.push(lanes);
                        (From::Lanes(registers.len() as u32 - 1, 0), width as u32)
                    } else {
                        words.extend((0..count).map(|_| word(&mut state, kind)));
                        (From::Words((words.len() - count) as u32), 1)
                    };
                    let apart = if parts > 1 && count > 1 { apart } else { 0 };
                    args.push(ReadyArg { from, words: count as u8, apart });
                }
                let count = args.len() as u8;
                args.resize(MAX_ARGS, ReadyArg { from: From::Words(0), words: 0, apart: 0 });
                let step = ReadyLane {
                    op,
                    parts: parts as u8,
                    through: 1,
                    count,
                    out: (0, 0),
                    args: args.try_into().expect("as many as an operation has"),
                };
                let mut run = |native: bool| {
                    let mut files = Files {
                        registers: &mut registers,
                        cells: &[],
                        indices: &[],
                        words: &words,
                        spread: &mut Default::default(),
                    };
                    if native {
                        let waiting = Waiting { ready: Ready::Lane(step), at: 0, last: 1 };
                        let plan = Plan::new(&[waiting], (width, style)).expect("a known operation has code");
                        plan.run::<A>(Isa::detect(), &mut files, width, &mut Scratch::default());
                    } else {
                        let run = files.run(isa, &[], width, 0..width);
                        let steps = [Ready::Lane(step)];
                        A::lanes(isa, crate::lanes::LaneRun { steps: &steps, ..run });
                    }
                    std::mem::replace(
                        &mut registers[0],
                        Lanes::new(width * parts * shape.result.words() as usize),
                    )
                };
                let (expected, found) = (run(false), run(true));
                for (lane, (a, b)) in expected.words().iter().zip(found.words()).enumerate() {
                    let nan = |x: u32| f32::from_bits(x).is_nan();
                    assert!(a == b || nan(*a) && nan(*b), "{op:?}, forms {forms}: {lane}: {a:x}, {b:x}");
                }
            }
        }
    }
}
