//! A greedy search for a repair at one setting: the rewrites of the blamed lines are tried, the best one is
//! kept, and the lines that are blamed after it are next, up to four times.

use super::super::lines::{Culprit, culprits};
use super::super::subject::Subject;
use super::super::sweep::{self, NOTABLE};
use super::super::trial::Setting;
use super::candidates::{Candidate, candidates};
use super::judge::{Bad, Good, Judge};
use super::reference::Errors;
use super::source::{Source, words};
use super::term::{computes, is_pure};
use super::variants::Variants;
use super::{Build, Built, Changed, Repair, Step, nothing, sums};
use osl_hir::hir::{Arg, Expr, ExprKind, Init, Program, StmtKind};
use osl_hir::lint::{bodies, each_stmt};
use osl_scene::Grid;
use osl_syntax::diagnostic::Edit;
use osl_syntax::span::Span;

/// How many times smaller the error has to be.
const ENOUGH: f64 = 10.0;
/// How many times smaller each rewrite must make it while that is not enough, and after that.
const FURTHER: [f64; 2] = [1.05, 2.0];
/// Maximum number of rewrites in a repair.
const STEPS: usize = 4;
/// Maximum number of rewrites that are tried for one step.
const TRIES: usize = 80;
/// Maximum number of rewrites that are tested with other values of the parameters, the best ones first.
const TESTS: usize = 12;

/// The search for a repair at one setting.
pub(super) struct Search<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) grid: &'a Grid,
    pub(super) judge: Judge<'a>,
    pub(super) variants: &'a Variants<'a>,
    pub(super) setting: Setting,
    pub(super) build: &'a Build<'a>,
}

/// The outcome of trying all rewrites for one step.
#[derive(Default)]
struct RewriteOutcome {
    best: Option<(Candidate, Good)>,
    dear: Option<(Candidate, Good)>,
    harmful: Option<(Candidate, Good, String)>,
    nearly: Option<(Candidate, f64)>,
    tried: usize,
    not_tried: usize,
}

impl Search<'_> {
    /// Looks for a repair of the blamed lines of a source.
    pub(super) fn run(&self, text: &str, program: &Program, mut blamed: Vec<u32>) -> Repair {
        let before = self.judge.before();
        let mut repair = Repair { before: Some(before), ..nothing(&self.setting.text()) };
        let mut now = before;
        // The lines that are touched, by their numbers in the original.
        let mut touched: Option<Vec<u32>> = None;
        let original = Source::new(program, text);
        let (mut text, mut program) = (text.to_string(), program.clone());
        while repair.steps.len() < STEPS && !blamed.is_empty() && !self.subject.is_over() {
            let tried = self.step(&text, &program, (&blamed, touched.as_deref()), &now);
            repair.tried += tried.tried;
            repair.not_tried += tried.not_tried;
            if repair.steps.is_empty() {
                repair.dear = tried.dear.map(|(candidate, good)| step(&candidate, &good));
                repair.harmful = tried.harmful.map(|(candidate, good, at)| (step(&candidate, &good), at));
                repair.nearly = tried.nearly.map(|(candidate, gain)| {
                    let good = Good { errors: before, cost: 1.0, doubt: 0.0 };
                    (step(&candidate, &good), gain)
                });
            }
            let least = FURTHER[usize::from(before.gain(&now) >= ENOUGH)];
            let best = tried.best.filter(|(_, good)| now.gain(&good.errors) >= least);
            let Some((candidate, good)) = best else { break };
            touched.get_or_insert_with(|| candidate.lines.iter().copied().collect());
            now = good.errors;
            repair.doubt = good.doubt;
            repair.steps.push(step(&candidate, &good));
            text = candidate.text;
            let changed = Changed { text: &text, notes: true, param: None };
            let Some(built) = (self.build)(&changed) else { break };
            blamed = self.blamed(&built);
            program = built.program;
        }
        let gain = before.gain(&now);
        if gain >= ENOUGH {
            let text = self.tidied(&original, text, &now);
            let lines = touched.unwrap_or_default();
            repair.refused = check(&self.judge, self.variants, (&text, &lines), self.build).err();
            if repair.refused.is_some() {
                repair.steps.clear();
            } else {
                repair.text = Some(text);
            }
            repair.dear = None;
            repair.harmful = None;
            repair.nearly = None;
        } else if !repair.steps.is_empty() {
            // The best combination does not help enough.
            repair.nearly = repair.steps.first().cloned().map(|first| (first, gain));
            repair.steps.clear();
        }
        repair
    }

    /// Tries the rewrites of the blamed lines. `touched` are the lines of earlier rewrites, if there are any.
    fn step(
        &self,
        text: &str,
        program: &Program,
        (blamed, touched): (&[u32], Option<&[u32]>),
        now: &Errors,
    ) -> RewriteOutcome {
        let source = Source::new(program, text);
        let mut list: Vec<(usize, Candidate)> = sums::candidates(&source)
            .into_iter()
            .chain(candidates(&source, blamed))
            .filter_map(|candidate| {
                let rank = blamed.iter().position(|line| candidate.lines.contains(line))?;
                Some((rank, candidate))
            })
            .collect();
        list.sort_by_key(|(rank, _)| *rank);
        let mut out = RewriteOutcome::default();
        let mut passed: Vec<(Candidate, Good)> = Vec::new();
        for (_, candidate) in list {
            if out.tried >= TRIES || self.subject.is_over() {
                out.not_tried += 1;
                continue;
            }
            out.tried += 1;
            let Some(built) = (self.build)(&Changed::plain(&candidate.text)) else { continue };
            let programs = self.judge.programs_of(built.plain);
            let own: Vec<u32> = candidate.lines.iter().copied().collect();
            match self.judge.judge(&programs, touched.unwrap_or(&own), now) {
                Ok(good) if good.is_worth_it(&self.judge.before()) => passed.push((candidate, good)),
                Ok(good) => {
                    let is_enough = now.gain(&good.errors) >= ENOUGH;
                    let is_best = out.dear.as_ref().is_none_or(|(_, other)| good.cost < other.cost);
                    if is_enough && is_best {
                        out.dear = Some((candidate, good));
                    }
                }
                Err(Bad::Little(gain)) => {
                    if gain > 1.0 && out.nearly.as_ref().is_none_or(|(_, other)| gain > *other) {
                        out.nearly = Some((candidate, gain));
                    }
                }
                Err(Bad::Stops | Bad::Harms | Bad::Differs) => {}
            }
        }
        // What costs more is the choice only if nothing else is enough.
        let (dear, cheap): (Vec<_>, Vec<_>) = passed.into_iter().partition(|(_, good)| good.is_dear());
        for list in [cheap, dear] {
            let is_enough = |(_, good): &(Candidate, Good)| now.gain(&good.errors) >= ENOUGH;
            if !out.best.as_ref().is_some_and(is_enough) {
                self.tested(list, now, &mut out);
            }
        }
        out
    }

    /// Chooses the best of the rewrites that also pass the tests on other points and with other values. If
    /// none does, the best one may be the first of several, which are tested together.
    fn tested(&self, mut passed: Vec<(Candidate, Good)>, now: &Errors, out: &mut RewriteOutcome) {
        let mut first = None;
        for _ in 0..TESTS {
            let best = (0..passed.len()).reduce(|a, b| {
                let (best, other) = (&passed[a], &passed[b]);
                if better((&other.0, &other.1), (&best.0, &best.1)) { b } else { a }
            });
            let Some((candidate, good)) = best.map(|best| passed.remove(best)) else { break };
            match self.variants.harmed_by(&candidate.text, self.build) {
                None => {
                    out.best = Some((candidate, good));
                    return;
                }
                Some(_) if self.subject.is_over() => return,
                Some(_) if self.judge.before().gain(&good.errors) < ENOUGH => {
                    first.get_or_insert((candidate, good));
                }
                Some(at) if now.gain(&good.errors) >= ENOUGH && out.harmful.is_none() => {
                    out.harmful = Some((candidate, good, at));
                }
                Some(_) => {}
            }
        }
        out.best = out.best.take().or(first);
    }

    /// A repaired text without the declarations that the repair leaves without use.
    fn tidied(&self, original: &Source<'_>, mut text: String, now: &Errors) -> String {
        // A declaration may have been the only reader of another one.
        for _ in 0..STEPS {
            let Some(built) = (self.build)(&Changed::plain(&text)) else { break };
            let Some(shorter) = removed(original, &Source::new(&built.program, &text)) else {
                break;
            };
            let Some(built) = (self.build)(&Changed::plain(&shorter)) else { break };
            let programs = self.judge.programs_of(built.plain);
            if !self.judge.has_errors(&programs, now) {
                break;
            }
            text = shorter;
        }
        text
    }

    /// The lines to blame in a changed source.
    fn blamed(&self, built: &Built) -> Vec<u32> {
        let Some(noted) = &built.noted else { return Vec::new() };
        let limits = self.subject.limits;
        let base = self.subject.base.again(built.plain.clone(), noted.clone(), limits);
        let subject = Subject::new(self.subject.services, base, limits);
        let points = self.setting.points(self.grid);
        let Ok(planes) = subject.run(&subject.base, &points, self.setting != Setting::AsGiven) else {
            return Vec::new();
        };
        let is_notable = (0..planes.names.len())
            .any(|plane| sweep::errors(&planes, plane).into_iter().any(|error| error >= NOTABLE));
        let found = culprits(&subject, self.grid, &self.setting, &planes, &built.sources, is_notable);
        worst_lines(found.blamed.iter())
    }
}

/// Tests a changed text as a whole, by the lines that it changes: the test that fails, in words.
pub(super) fn check(
    judge: &Judge<'_>,
    variants: &Variants<'_>,
    (text, lines): (&str, &[u32]),
    build: &Build<'_>,
) -> Result<(), String> {
    let built = build(&Changed::plain(text)).ok_or("it does not compile")?;
    let (before, programs) = (judge.before(), judge.programs_of(built.plain));
    let good = judge.judge(&programs, lines, &before).map_err(|bad| bad.text().to_string())?;
    if before.gain(&good.errors) < ENOUGH {
        return Err("it helps too little".to_string());
    }
    if !good.is_worth_it(&before) {
        return Err("it costs too much".to_string());
    }
    match variants.harmed_by(text, build) {
        Some(at) => Err(format!("with `{at}`, points become worse or are not known")),
        None => Ok(()),
    }
}

/// Whether a change is better than another: a third of the error, or else fewer lines, or else cheaper, or
/// else shorter.
fn better(a: (&Candidate, &Good), b: (&Candidate, &Good)) -> bool {
    let size = |good: &Good| (good.errors.rms.max(1e-8) * good.errors.largest.max(1e-7)).sqrt();
    let (x, y) = (size(a.1), size(b.1));
    if x * 3.0 < y || y * 3.0 < x {
        return x < y;
    }
    if a.0.lines.len() != b.0.lines.len() {
        return a.0.lines.len() < b.0.lines.len();
    }
    if (a.1.cost - b.1.cost).abs() > 0.01 {
        return a.1.cost < b.1.cost;
    }
    a.0.text.len() < b.0.text.len()
}

fn step(candidate: &Candidate, good: &Good) -> Step {
    Step {
        name: candidate.name.to_string(),
        line: candidate.line,
        old: candidate.old.clone(),
        new: candidate.new.clone(),
        why: candidate.why.to_string(),
        errors: good.errors,
        cost: good.cost,
    }
}

/// Lines below this share of the worst line's score are not worth a rewrite.
const NEXT_TO_NOTHING: f64 = 1e-3;

/// The lines of culprits, the worst first, without those that hardly matter.
pub(super) fn worst_lines<'a>(culprits: impl Iterator<Item = &'a Culprit>) -> Vec<u32> {
    let mut worst = 0.0_f64;
    let mut lines = Vec::new();
    for culprit in culprits {
        worst = worst.max(culprit.score);
        if culprit.score >= worst * NEXT_TO_NOTHING {
            lines.push(culprit.line);
        }
    }
    lines
}

/// The text of `after` without the declarations of variables that only `before` reads; `None` if there are
/// none.
fn removed(before: &Source<'_>, after: &Source<'_>) -> Option<String> {
    let mut edits: Vec<Edit> = Vec::new();
    for body in bodies(after.program) {
        each_stmt(body, &mut |stmt| {
            let StmtKind::Declare(var, Some(Init::Value(value))) = &stmt.kind else { return };
            let Some(name) = after.program.vars.get(var.0 as usize).map(|var| &*var.name) else { return };
            let is_left = does_nothing(after, value)
                && count(after.bare(), name) == 1
                && count(before.bare(), name) != 1;
            if let Some(span) = after.start(stmt).filter(|_| is_left).and_then(|at| declaration(after, at)) {
                edits.push(Edit { span, text: String::new() });
            }
        });
    }
    if edits.is_empty() { None } else { osl_syntax::repair::apply(after.reader.text, &edits) }
}

/// Whether an expression does nothing but compute its value: its calls are of functions that only return an
/// expression.
fn does_nothing(source: &Source<'_>, e: &Expr) -> bool {
    match &e.kind {
        ExprKind::Call(_, args) => {
            let args = args.iter().all(|arg| match arg {
                Arg::Copy { value: Init::Value(value), back: None } => does_nothing(source, value),
                Arg::Copy { .. } => false,
                Arg::Alias(_) => true,
            });
            args && source.inlined(e).is_some_and(|value| value.is_pure)
        }
        _ => is_pure(e) || (computes(e) && e.parts().into_iter().all(|part| does_nothing(source, part))),
    }
}

/// How often a word occurs.
fn count(text: &str, word: &str) -> usize {
    words(text).filter(|own| *own == word).count()
}

/// The span of the declaration of a single variable that begins at a position, with its line if nothing else
/// is in it.
fn declaration(source: &Source<'_>, start: usize) -> Option<Span> {
    let bare = source.bare();
    let length = bare.get(start..)?.find(';')? + 1;
    let mut depth = 0_i32;
    let is_single = bare.get(start..start + length)?.chars().all(|c| {
        depth += i32::from(c == '(' || c == '{') - i32::from(c == ')' || c == '}');
        c != ',' || depth > 0
    });
    let text = source.reader.text;
    let (mut from, mut to) = (start, start + length);
    let line = text.get(..from)?.rfind('\n').map_or(0, |at| at + 1);
    let next = text.get(to..)?.find('\n').map(|at| to + at + 1)?;
    let is_blank = |part: Option<&str>| part.is_some_and(|part| part.trim().is_empty());
    if is_blank(text.get(line..from)) && is_blank(text.get(to..next)) {
        (from, to) = (line, next);
    }
    is_single.then(|| Span::new(from as u32, to as u32))
}
