//! Passes over the IR: each is small, has its own tests, and can be switched off, except `ssa`, on which the
//! others and the interpreter build, and `derive`, without which texture lookups would have another meaning.
//!
//! A pass keeps the bits of every remaining value, except `prefilter`, which runs only as part of `Derive`.

mod algebra;
mod cse;
pub mod dce;
mod derive;
mod flatten;
mod fold;
mod forward;
mod fuse;
mod prefilter;
mod primaries;
mod rate;
mod rays;
mod rewrite;
mod share;
mod ssa;
mod unroll;
mod weights;

pub use prefilter::Prefilter;
pub use primaries::set_primaries;
pub use rate::inputs_decide;
pub use weights::closures_as_numbers;

use crate::global::Global;
use crate::ir::Body;
use crate::ir::validate;
use osl_limits::Limits;
use osl_numeric::Arithmetic;
use std::sync::Arc;

/// The passes, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Pass {
    /// Turns scalar slots into values. Always runs.
    Ssa,
    /// Drops outputs that are not requested.
    Slice,
    /// Computes constants with the run's own arithmetic, resolves names, and takes known branches. Also
    /// settles the meaning that depends on constants: which divisors are constant, the result of
    /// `isconstant`, and which code needs derivatives. If it is switched off, it still runs where derivatives
    /// are needed.
    Fold,
    /// Writes the needed derivatives, and folds what it wrote. Always runs, since later stages have no
    /// derivatives.
    Derive,
    /// Unrolls loops with a few known iterations, reads elements of arrays from where they were stored, and
    /// folds both. Runs after the meaning is settled: the reference keeps loops, so a value that is constant
    /// in one iteration is not a constant there.
    Unroll,
    /// Computes each value only once.
    Cse,
    /// Removes what no output needs.
    Dce,
    /// Finds values that are uniform over a batch. Always runs: without it every value is varying.
    Rate,
    /// Turns small branches into selections.
    Flatten,
    /// Compares distances by their squares, and similar rewrites.
    Algebra,
    /// Finds work that neighbouring points share.
    Share,
    /// Fuses products with their sums, and computes one distance where a choice would discard the other.
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

    /// The name for reports and `--without-pass`.
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

    /// The pass with a name.
    pub fn from_name(name: &str) -> Option<Pass> {
        Pass::ALL.into_iter().find(|pass| pass.name() == name)
    }
}

/// Options of the passes.
#[derive(Clone, Debug)]
pub struct Options {
    /// Names of the requested outputs; `None` means all. A struct's name stands for its fields.
    pub outputs: Option<Vec<Arc<str>>>,
    /// Globals that differ from point to point.
    pub varying: Vec<Global>,
    /// Globals whose derivatives differ from point to point.
    pub derivs: Vec<Global>,
    /// Passes that do not run.
    pub without: Vec<Pass>,
    /// The arithmetic of the run. For double precision, nothing is rounded to single precision at compile
    /// time, and passes that rely on such rounding do not run.
    pub arithmetic: Arithmetic,
    /// Whether the renderer traces rays. Otherwise no ray hits anything, and nothing is known of the last
    /// ray.
    pub traces: bool,
    /// The spaces whose matrices to and from common space are affine: between them, points change like
    /// vectors.
    pub affine: Vec<Arc<str>>,
    /// Widens steps by a multiple of a pixel's footprint, which changes values: see `prefilter`.
    pub prefilter: Option<Prefilter>,
    /// Budgets for compiling.
    pub limits: Limits,
}

impl Default for Options {
    fn default() -> Self {
        let varying = Global::ALL.to_vec();
        Options {
            outputs: None,
            derivs: varying.clone(),
            varying,
            without: Vec::new(),
            arithmetic: Arithmetic::Strict,
            traces: false,
            affine: Vec::new(),
            prefilter: None,
            limits: Limits::default(),
        }
    }
}

/// The report of a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Report {
    /// The pass.
    pub pass: Pass,
    /// Instructions before it.
    pub before: usize,
    /// Instructions after it.
    pub after: usize,
}

/// Runs one pass by itself, for tests; a pass that is switched off runs too.
pub fn apply(body: &mut Body, pass: Pass, options: &Options) {
    let options = Options { without: Vec::new(), ..options.clone() };
    one(body, pass, &mut Run::new(&options));
}

/// Runs the passes and reports what each did.
pub fn run(body: &mut Body, options: &Options) -> Vec<Report> {
    let mut reports = Vec::new();
    body.assumptions.arithmetic = options.arithmetic;
    if !options.traces {
        body.assumptions.traces = false;
        rays::run(body);
    }
    let mut count = body.count();
    let mut run = Run::new(options);
    for pass in Pass::ALL {
        if !run.includes(pass) {
            continue;
        }
        let is_reported = one(body, pass, &mut run);
        if cfg!(debug_assertions) {
            let found = validate::validate(body);
            debug_assert!(found.is_ok(), "after {}: {found:?}", pass.name());
        }
        let before = std::mem::replace(&mut count, body.count());
        reports.extend(is_reported.then_some(Report { pass, before, after: count }));
    }
    reports
}

/// How many operations of a lowered program `prefilter` widens.
pub fn n_filtered(mut body: Body, options: &Options) -> usize {
    body.assumptions.arithmetic = options.arithmetic;
    if !options.traces {
        body.assumptions.traces = false;
        rays::run(&mut body);
    }
    let mut run = Run::new(options);
    let before = Pass::ALL.into_iter().take_while(|pass| *pass != Pass::Derive);
    for pass in before.filter(|pass| run.includes(*pass)).collect::<Vec<_>>() {
        one(&mut body, pass, &mut run);
    }
    widen(&mut body, Prefilter { scale: 1.0 }, &run)
}

/// One run of the passes.
struct Run<'a> {
    options: &'a Options,
    /// Whether nothing is rounded to single precision at compile time.
    exact: bool,
    text: fold::Strings,
}

impl Run<'_> {
    fn new(options: &Options) -> Run<'_> {
        let limits = &options.limits;
        let (left, string) = (limits.compiling.folded_bytes, limits.running.string_bytes);
        Run { options, exact: options.arithmetic.is_double(), text: fold::Strings { left, string } }
    }

    fn is_off(&self, pass: Pass) -> bool {
        // The rewrites of roots hold only for rounded roots, and cells are compared by 32-bit words.
        self.options.without.contains(&pass) || self.exact && matches!(pass, Pass::Algebra | Pass::Share)
    }

    /// Whether a pass runs.
    fn includes(&self, pass: Pass) -> bool {
        match pass {
            Pass::Ssa | Pass::Derive | Pass::Fold => true,
            // If the compilation was stopped, the speed of the program no longer matters.
            Pass::Unroll | Pass::Cse | Pass::Flatten | Pass::Algebra | Pass::Share | Pass::Fuse => {
                !self.is_off(pass) && self.options.limits.halted().is_none()
            }
            Pass::Slice | Pass::Dce | Pass::Rate => !self.is_off(pass),
        }
    }

    /// Folds what another pass wrote.
    fn fold_again(&mut self, body: &mut Body) {
        if !self.is_off(Pass::Fold) {
            let numbers = if self.exact { fold::Numbers::Double } else { fold::Numbers::Single };
            fold::again(body, numbers, &mut self.text);
        }
    }
}

/// Runs one pass. Returns whether it did more than settle what the program means.
fn one(body: &mut Body, pass: Pass, run: &mut Run<'_>) -> bool {
    let options = run.options;
    match pass {
        Pass::Ssa => ssa::run(body),
        Pass::Slice => slice(body, options.outputs.as_deref()),
        Pass::Fold => return settle(body, run),
        Pass::Derive => differentiate(body, run),
        Pass::Unroll => {
            if unroll::run(body, run.exact) {
                run.fold_again(body);
            }
            if forward::run(body) {
                run.fold_again(body);
            }
        }
        Pass::Cse => cse::run(body),
        Pass::Dce => dce::run(body),
        Pass::Rate => {
            rate::run(body, &options.varying, &options.derivs);
            body.assumptions.varying.clone_from(&options.varying);
            body.assumptions.derivs.clone_from(&options.derivs);
        }
        Pass::Flatten => flatten::run(body),
        Pass::Algebra => algebra::run(body),
        Pass::Share => share::run(body),
        Pass::Fuse => fuse::run(body),
    }
    true
}

/// Folds constants, and settles the meaning that depends on constants. If folding is switched off but
/// derivatives are needed, only what is the same in single and in double precision becomes a constant.
fn settle(body: &mut Body, run: &mut Run<'_>) -> bool {
    let folds = !run.is_off(Pass::Fold) || derive::asks(body);
    if !run.is_off(Pass::Fold) && !run.exact {
        fold::run(body, &mut run.text);
    } else {
        // The constants of the strict program determine its meaning.
        fold::only_meaning(body, &mut run.text);
        if folds {
            let numbers = if run.exact { fold::Numbers::Double } else { fold::Numbers::Both };
            fold::again(body, numbers, &mut run.text);
        }
    }
    fold::settle(body);
    folds
}

/// Writes derivatives, and the means of steps if they are requested.
fn differentiate(body: &mut Body, run: &mut Run<'_>) {
    if let Some(wanted) = run.options.prefilter {
        widen(body, wanted, run);
    }
    // Unneeded code, such as most layers of a large group, must not be differentiated, and must not use up
    // the budget for unrolling. It must not request derivatives either, since that affects bits.
    if !run.is_off(Pass::Dce) || derive::asks(body) {
        dce::run(body);
    }
    let flat = derive::Flat::new(body, run.options);
    body.assumptions.affine.clone_from(&run.options.affine);
    if derive::run(body, flat) {
        run.fold_again(body);
    }
}

/// Writes the means of the steps that outputs need. Returns their number.
fn widen(body: &mut Body, wanted: Prefilter, run: &Run<'_>) -> usize {
    if !run.is_off(Pass::Dce) {
        dce::run(body);
    }
    prefilter::run(body, wanted)
}

/// Drops outputs that are not requested. `dce` then removes the code that computed them.
fn slice(body: &mut Body, wanted: Option<&[Arc<str>]>) {
    let Some(wanted) = wanted else { return };
    body.outputs.retain(|output| {
        wanted.iter().any(|w| {
            output.name.strip_prefix(&**w).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        })
    });
}

/// Maps values to the values that replace them.
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

    /// The replacement of a value. Replacements are final when they are set, so one step is enough.
    fn get(&self, value: crate::ir::ValueId) -> crate::ir::ValueId {
        self.to.get(value.index()).copied().flatten().unwrap_or(value)
    }
}
