//! The notes of a body by their sites: where each stands, what surrounds it, and what the passes make of it.

use osl_ir::Span;
use osl_ir::ir::{BlockId, Body, Const, Inst, Kernel, Note, Op, Test, ValueId};
use osl_ir::passes::{self, Pass};
use osl_syntax::source::SourceMap;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;

/// A note of the source.
#[derive(Debug)]
pub(super) struct Site {
    /// Its location.
    pub(super) span: Span,
    /// What it tells.
    pub(super) note: Note,
    /// Its values.
    pub(super) args: Vec<ValueId>,
    /// The innermost branch that decides whether it runs: an index into [`Sites::around`].
    pub(super) inside: Option<usize>,
    /// The sites that tell that a round of a loop around it begins, from the outermost loop.
    pub(super) rounds: Vec<u32>,
}

/// Code that may not run.
#[derive(Debug)]
pub(super) struct Around {
    /// Why it may not run.
    pub(super) gate: Gate,
    /// The next branch outwards.
    pub(super) outer: Option<usize>,
}

/// What decides whether code runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gate {
    /// The condition at a site, if it has this truth.
    Branch(u32, bool),
    /// The test of a loop; the code is an iteration.
    Loop {
        /// The site that tells that the loop is reached.
        entered: u32,
        /// The site that tells that an iteration begins.
        round: u32,
    },
    /// No statement before it has left the loop, the function or the shader.
    Left,
}

/// The notes of a body.
#[derive(Debug, Default)]
pub(super) struct Sites {
    pub(super) by_number: FxHashMap<u32, Site>,
    pub(super) around: Vec<Around>,
    /// The numbers, in the order of the program.
    pub(super) order: Vec<u32>,
    /// For the site that tells that a loop is reached, the one that tells that a round begins.
    pub(super) round_of: BTreeMap<u32, u32>,
}

impl Sites {
    /// The notes of a lowered body, before any pass.
    pub(super) fn of(body: &Body) -> Sites {
        let mut sites = Sites::default();
        sites.block((body, body.entry), None, None, &[]);
        sites
    }

    /// The left operand that decides whether this right one is evaluated.
    pub(super) fn left_of(&self, site: &Site) -> Option<u32> {
        match self.around.get(site.inside?)?.gate {
            Gate::Branch(left, _) => {
                let note = &self.by_number.get(&left)?.note;
                (*note == Note::Branch(Test::Operand)).then_some(left)
            }
            _ => None,
        }
    }

    fn block(
        &mut self,
        (body, id): (&Body, BlockId),
        inside: Option<usize>,
        entered: Option<u32>,
        rounds: &[u32],
    ) {
        let mut rounds = rounds.to_vec();
        // The last condition that was noted.
        let mut tested: Option<(u32, ValueId)> = None;
        // The last loop that was noted.
        let mut reached = None;
        for inst in &body.block(id).insts {
            match &inst.op {
                Op::Kernel(Kernel::Note { site, note }, args) => {
                    if let (Note::Branch(_), [cond]) = (note, &args[..]) {
                        tested = Some((*site, *cond));
                    }
                    if *note == Note::Loop {
                        reached = Some(*site);
                    }
                    if let (Note::Round, Some(entered)) = (note, entered) {
                        self.round_of.insert(entered, *site);
                        rounds.push(*site);
                    }
                    let (note, args) = (note.clone(), args.to_vec());
                    let known = Site { span: inst.span, note, args, inside, rounds: rounds.clone() };
                    if self.by_number.insert(*site, known).is_none() {
                        self.order.push(*site);
                    }
                }
                Op::If { cond, then, otherwise, .. } => {
                    let test = tested.filter(|(_, value)| value == cond).map(|(site, _)| site);
                    for (side, truth) in [(*then, true), (*otherwise, false)] {
                        let gate = match test {
                            Some(site) => Gate::Branch(site, truth),
                            None => match (entered, round_in(body, side)) {
                                (Some(entered), Some(round)) => Gate::Loop { entered, round },
                                _ => Gate::Left,
                            },
                        };
                        self.around.push(Around { gate, outer: inside });
                        let here = self.around.len() - 1;
                        self.block((body, side), Some(here), entered, &rounds);
                    }
                }
                Op::Loop { body: inner, .. } => self.block((body, *inner), inside, reached, &rounds),
                _ => {}
            }
        }
    }
}

/// The site of the iteration that a block begins.
fn round_in(body: &Body, id: BlockId) -> Option<u32> {
    body.block(id).insts.iter().find_map(|inst| match inst.op {
        Op::Kernel(Kernel::Note { site, note: Note::Round }, _) => Some(site),
        _ => None,
    })
}

/// What the compiler makes of an assignment or a condition.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum FoldedResult {
    /// The value is known when the shader is compiled.
    Constant(Const),
    /// The value is computed on another line, which has the same computation.
    Same(Span),
}

/// What the passes make of the notes of a body.
pub(super) struct Passed {
    /// Values that are not computed where they are set, and conditions that are known.
    pub(super) made: FxHashMap<u32, FoldedResult>,
    /// Sites that the passes removed.
    pub(super) gone: Vec<u32>,
    /// Sites of values that are constants of the source.
    pub(super) literals: FxHashSet<u32>,
}

impl Passed {
    /// The conditions that are known when the shader is compiled.
    pub(super) fn known(&self, sites: &Sites) -> FxHashMap<ValueId, bool> {
        let truth = |(number, site): (&u32, &Site)| match (&site.note, self.made.get(number), &site.args[..])
        {
            (Note::Branch(Test::If), Some(FoldedResult::Constant(Const::Int(n))), [cond]) => {
                Some((*cond, *n != 0))
            }
            _ => None,
        };
        sites.by_number.iter().filter_map(truth).collect()
    }
}

/// Runs the passes that find constants and equal computations.
pub(super) fn passed(noted: &Body, sites: &Sites, options: &passes::Options, sources: &SourceMap) -> Passed {
    let keep = [Pass::Ssa, Pass::Fold, Pass::Derive, Pass::Cse, Pass::Rate];
    let without = Pass::ALL.into_iter().filter(|pass| !keep.contains(pass)).collect();
    let mut after = noted.clone();
    passes::run(&mut after, &passes::Options { without, outputs: None, ..options.clone() });
    let (before, after) = (values_at(noted), values_at(&after));
    let line = |span: Span| sources.line(span).map(|(file, line)| (file.base, line));
    let mut made = FxHashMap::default();
    let (mut gone, mut literals) = (Vec::new(), FxHashSet::default());
    for site in &sites.order {
        let Some(now) = after.get(site) else {
            gone.push(*site);
            continue;
        };
        let is_test = matches!(sites.by_number.get(site).map(|s| &s.note), Some(Note::Branch(_)));
        match (before.get(site), now) {
            (Some(Source::Const(_)), Source::Const(value)) if is_test => {
                made.insert(*site, FoldedResult::Constant(value.clone()));
            }
            (Some(Source::Const(_)), _) => drop(literals.insert(*site)),
            (_, Source::Const(value)) => {
                made.insert(*site, FoldedResult::Constant(value.clone()));
            }
            (Some(Source::Computed(was)), Source::Computed(is)) => {
                let here = sites.by_number.get(site).and_then(|s| line(s.span));
                if here.is_some() && line(*was) == here && line(*is).is_some() && line(*is) != here {
                    made.insert(*site, FoldedResult::Same(*is));
                }
            }
            _ => {}
        }
    }
    Passed { made, gone, literals }
}

/// Where a value of a note comes from.
enum Source {
    Const(Const),
    Computed(Span),
    Other,
}

/// The sources of the values of all assignments and conditions.
fn values_at(body: &Body) -> FxHashMap<u32, Source> {
    let mut defined: FxHashMap<ValueId, &Inst> = FxHashMap::default();
    let mut found = FxHashMap::default();
    let mut notes = Vec::new();
    for inst in body.insts_from(body.entry) {
        defined.extend(inst.results.iter().map(|result| (*result, inst)));
        if let Op::Kernel(Kernel::Note { site, note }, args) = &inst.op {
            notes.push((*site, note, args));
        }
    }
    for (site, note, args) in notes {
        let value = match note {
            Note::Set(_) | Note::Branch(_) => args.last(),
            _ => None,
        };
        let source = match value.and_then(|value| defined.get(value)).map(|inst| (&inst.op, inst.span)) {
            Some((Op::Const(value), _)) => Source::Const(value.clone()),
            Some((Op::Lane(..) | Op::Kernel(..), span)) => Source::Computed(span),
            _ => Source::Other,
        };
        found.insert(site, source);
    }
    found
}
