//! Passes over the IR, each small, each with its own tests, each able to be switched off (but for `ssa`, on
//! which the others and the interpreter build, and `derive`, without which lookups would mean something else).
//!
//! A pass keeps the bits of every value that remains, but for `prefilter`, which is no pass that runs by itself. It must not know lanes, registers or instruction sets.

mod algebra;
mod cse;
pub(crate) mod dce;
mod derive;
mod flatten;
mod fold;
mod fuse;
mod prefilter;
mod primaries;
mod rate;
mod rays;
mod share;
mod ssa;
mod unroll;

pub use primaries::set_primaries;

use crate::hir::Global;
use crate::ir::Body;
use crate::ir::validate;
use crate::numeric::Arithmetic;
use osl_limits::Limits;
use std::sync::Arc;

/// The passes, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pass {
    /// Scalar slots become values. Always runs.
    Ssa,
    /// Drops outputs that nobody asked for.
    Slice,
    /// Computes constants with the run's own arithmetic, resolves names, takes known branches; and settles what depends
    /// on that: which divisors are constants, what `isconstant` says, what wants derivatives. Switched off it still
    /// runs where derivatives are asked for.
    Fold,
    /// Writes the derivatives that are asked for, and folds what it wrote. Always runs: nothing else knows them.
    Derive,
    /// Writes loops of a few known rounds as their rounds, and folds them. Behind what settles the meaning: the
    /// reference keeps loops, so that what is constant in a round is not constant to it.
    Unroll,
    /// Computes each value once.
    Cse,
    /// Removes what no output needs.
    Dce,
    /// Finds what the points of a batch share. Always runs: without it all is varying.
    Rate,
    /// Turns small branches into selections.
    Flatten,
    /// Compares distances by their squares, and the like.
    Algebra,
    /// Finds work that neighbouring points share.
    Share,
    /// Makes products and their sums one operation.
    Fuse,
}

impl Pass {
    /// All passes in order.
    pub const ALL: [Pass; 12] = [
        Pass::Ssa,
        Pass::Slice,
        Pass::Fold,
        Pass::Derive,
        Pass::Unroll,
        Pass::Cse,
        Pass::Dce,
        Pass::Rate,
        Pass::Flatten,
        Pass::Algebra,
        Pass::Share,
        Pass::Fuse,
    ];

    /// The name that reports and `--without-pass` use.
    pub fn name(self) -> &'static str {
        match self {
            Pass::Ssa => "ssa",
            Pass::Slice => "slice",
            Pass::Unroll => "unroll",
            Pass::Derive => "derive",
            Pass::Fold => "fold",
            Pass::Cse => "cse",
            Pass::Dce => "dce",
            Pass::Rate => "rate",
            Pass::Flatten => "flatten",
            Pass::Algebra => "algebra",
            Pass::Share => "share",
            Pass::Fuse => "fuse",
        }
    }

    /// The pass of a name.
    pub fn from_name(name: &str) -> Option<Pass> {
        Pass::ALL.into_iter().find(|pass| pass.name() == name)
    }
}

/// What the passes are to do.
#[derive(Clone, Debug)]
pub struct Options {
    /// Names of the outputs that are wanted; `None` is all. A struct's name stands for its fields.
    pub outputs: Option<Vec<Arc<str>>>,
    /// Globals that differ from point to point.
    pub varying: Vec<Global>,
    /// Globals whose change from pixel to pixel differs from point to point.
    pub slopes: Vec<Global>,
    /// Passes that do not run.
    pub without: Vec<Pass>,
    /// The numbers that the program is to be run with. For double precision nothing is rounded to single while
    /// compiling, and passes that build on its rounding do not run.
    pub arithmetic: Arithmetic,
    /// Whether the renderer traces rays. Otherwise none hits anything, and nothing is known of the last one.
    pub traces: bool,
    /// Widen steps by so many times the footprint of a pixel, which changes values: see `prefilter`.
    pub prefilter: Option<f32>,
    /// What compiling may cost.
    pub limits: Limits,
}

impl Default for Options {
    fn default() -> Self {
        let varying = Global::ALL.to_vec();
        Options {
            outputs: None,
            slopes: varying.clone(),
            varying,
            without: Vec::new(),
            arithmetic: Arithmetic::Strict,
            traces: false,
            prefilter: None,
            limits: Limits::default(),
        }
    }
}

/// What a pass did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// Which pass.
    pub pass: Pass,
    /// Instructions before it.
    pub before: usize,
    /// Instructions after it.
    pub after: usize,
}

/// Runs the passes and reports what each did.
pub fn run(body: &mut Body, options: &Options) -> Vec<Report> {
    let mut reports = Vec::new();
    let exact = options.arithmetic.is_double();
    // The roots' rewrites hold for rounded roots; cells are shared by words of 32 bits.
    let without =
        |pass| options.without.contains(&pass) || exact && matches!(pass, Pass::Algebra | Pass::Share);
    body.assumptions.arithmetic = options.arithmetic;
    if !options.traces {
        body.assumptions.traces = false;
        rays::run(body);
    }
    let mut count = body.count();
    let limits = &options.limits;
    let (left, string) = (limits.compiling.folded_bytes, limits.running.string_bytes);
    let mut text = fold::Strings { left, string };
    for pass in Pass::ALL {
        match pass {
            Pass::Ssa | Pass::Derive => {}
            Pass::Fold if without(pass) && !derive::asks(body) => {
                fold::only_meaning(body, &mut text);
                fold::settle(body);
                count = body.count();
                continue;
            }
            Pass::Fold => {}
            pass if without(pass) => continue,
            // Nobody waits for a fast program any more.
            Pass::Unroll | Pass::Cse | Pass::Flatten | Pass::Algebra | Pass::Share | Pass::Fuse
                if options.limits.halted().is_some() =>
            {
                continue;
            }
            _ => {}
        }
        match pass {
            Pass::Ssa => ssa::run(body),
            Pass::Slice => slice(body, options.outputs.as_deref()),
            Pass::Unroll => {
                if unroll::run(body, exact) && !without(Pass::Fold) {
                    fold::again(body, exact, &mut text);
                }
            }
            Pass::Derive => {
                if let Some(scale) = options.prefilter {
                    prefilter::run(body, scale);
                }
                // What nothing needs, such as most layers of a large group, is not to be differentiated, nor to use up what
                // unrolled loops may grow by. It asks for no derivatives either, which decides about bits.
                if !without(Pass::Dce) || derive::asks(body) {
                    dce::run(body);
                }
                if derive::run(body) && !without(Pass::Fold) {
                    fold::again(body, exact, &mut text);
                }
            }
            Pass::Fold => {
                if exact {
                    // What the strict program finds constant decides what it means.
                    fold::only_meaning(body, &mut text);
                    fold::again(body, true, &mut text);
                } else {
                    fold::run(body, &mut text);
                }
                fold::settle(body);
            }
            Pass::Cse => cse::run(body),
            Pass::Dce => dce::run(body),
            Pass::Rate => {
                rate::run(body, &options.varying, &options.slopes);
                body.assumptions.varying.clone_from(&options.varying);
                body.assumptions.slopes.clone_from(&options.slopes);
            }
            Pass::Flatten => flatten::run(body),
            Pass::Algebra => algebra::run(body),
            Pass::Share => share::run(body),
            Pass::Fuse => fuse::run(body),
        }
        if cfg!(debug_assertions) {
            let found = validate::validate(body);
            debug_assert!(found.is_ok(), "after {}: {found:?}", pass.name());
        }
        let before = std::mem::replace(&mut count, body.count());
        reports.push(Report { pass, before, after: count });
    }
    reports
}

/// Drops outputs that are not wanted. What computed them goes with `dce`.
fn slice(body: &mut Body, wanted: Option<&[Arc<str>]>) {
    let Some(wanted) = wanted else { return };
    body.outputs.retain(|output| {
        wanted.iter().any(|w| {
            output.name.strip_prefix(&**w).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    });
}

/// A table from values to the values that replace them.
#[derive(Debug, Default)]
struct Renaming {
    to: Vec<Option<crate::ir::ValueId>>,
}

impl Renaming {
    fn set(&mut self, from: crate::ir::ValueId, to: crate::ir::ValueId) {
        if self.to.len() <= from.index() {
            self.to.resize(from.index() + 1, None);
        }
        self.to[from.index()] = Some(to);
    }

    /// What stands for a value. Replacements are final when they are set, so one step is enough.
    fn get(&self, value: crate::ir::ValueId) -> crate::ir::ValueId {
        self.to.get(value.index()).copied().flatten().unwrap_or(value)
    }
}
