//! From a trace to facts about each line.

use super::reasons::Reasons;
use super::rounds::InRound;
use super::sites::{FoldedResult, Site};
use super::{Applied, Called, Compiled, Explanation, Fact, Line, Shown, State, Subject, Triple, What};
use crate::quote::{At, line_at, snippet, text_of};
use crate::trace::{Node, NodeId, Trace, What as Kind};
use osl_ir::Span;
use osl_ir::global::GLOBALS;
use osl_ir::ir::{Const, Kernel, LaneOp, Note, Test, note_names};
use osl_syntax::source::SourceMap;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// Explains a point line by line, from the trace of the subject's body.
pub fn explain(trace: &Trace, subject: &Subject, sources: &SourceMap) -> Explanation {
    let mut reader = Reader {
        trace,
        subject,
        sources,
        calls: Vec::new(),
        stack: Vec::new(),
        facts: BTreeMap::new(),
        ran: BTreeMap::new(),
        reached: FxHashMap::default(),
        truths: FxHashMap::default(),
        again: BTreeMap::new(),
        rounds: FxHashMap::default(),
    };
    for node in &trace.nodes {
        if let Kind::Note(kernel) = &node.what
            && let Kernel::Note { site, note } = &**kernel
            && node.strict.is_some()
        {
            reader.note(*site, note, node);
        }
    }
    reader.unevaluated();
    let mut globals: Vec<(String, Shown)> = Vec::new();
    for (id, node) in (0..).zip(&trace.nodes) {
        if let Kind::Global(global) = node.what
            && subject.globals.contains(&global)
            && let Some((_, name, ..)) = GLOBALS.iter().find(|(g, ..)| *g == global)
            && !globals.iter().any(|(known, _)| known == name)
        {
            globals.push(((*name).to_string(), Shown::of(id, trace)));
        }
    }
    let place = |name: &str| GLOBALS.iter().position(|(_, known, ..)| *known == name);
    globals.sort_by_key(|(name, _)| place(name));
    let mut outputs = Vec::new();
    for (name, ty, nodes) in &trace.outputs {
        for (index, id) in nodes.iter().enumerate() {
            let name = if ty.is_array() { format!("{name}[{index}]") } else { name.to_string() };
            outputs.push((name, Shown::of(*id, trace)));
        }
    }
    let lines = reader.lines();
    let calls = reader.calls;
    let (shader, reports) = (subject.body.name.to_string(), Vec::new());
    Explanation { shader, globals, calls, lines, outputs, reports, cut: trace.cut }
}

/// The facts of a line, each thing once.
#[derive(Default)]
struct Facts {
    list: Vec<Fact>,
    /// Whether the values of each fact are needed.
    needed: Vec<bool>,
    /// The number of values of each fact that are constants of the source.
    literals: Vec<usize>,
    /// The position of each thing in the list, as a line may set every element of a long array.
    places: FxHashMap<(usize, Thing), usize>,
}

/// The variables that a line assigns, each once.
#[derive(Default)]
struct Assigned {
    /// Each variable, and whether it is always assigned again before anything reads it.
    list: Vec<(String, bool)>,
    /// The position of each in the list.
    places: FxHashMap<String, usize>,
}

/// What a fact is about.
#[derive(PartialEq, Eq, Hash)]
enum Thing {
    Set(String),
    Branch(Span),
    Rounds(Span),
    Call(String),
    Enter(String),
}

/// Values kept for each thing: the first ones and the last one are shown. This is a choice of presentation:
/// `running.trace` bounds the values.
const MAX_VALUES: usize = 10_000;

impl Facts {
    /// The fact about a thing; if there is none yet, `new` is appended.
    fn fact(&mut self, call: usize, thing: Thing, needed: bool, new: impl FnOnce() -> What) -> &mut What {
        self.value_fact(call, thing, (needed, false), new)
    }

    /// The same for a value, which may be a constant of the source.
    fn value_fact(
        &mut self,
        call: usize,
        thing: Thing,
        (needed, is_literal): (bool, bool),
        new: impl FnOnce() -> What,
    ) -> &mut What {
        let next = self.list.len();
        let at = *self.places.entry((call, thing)).or_insert(next);
        if at == next {
            self.list.push(Fact { call, what: new() });
            self.needed.push(needed);
            self.literals.push(is_literal.into());
        } else if let (Some(flag), Some(count)) = (self.needed.get_mut(at), self.literals.get_mut(at)) {
            *flag |= needed;
            *count += usize::from(is_literal);
        }
        &mut self.list[at].what
    }
}

fn keep<T>(list: &mut Vec<T>, value: T) {
    if list.len() < MAX_VALUES {
        list.push(value);
    }
}

struct Reader<'a> {
    trace: &'a Trace,
    subject: &'a Subject,
    sources: &'a SourceMap,
    calls: Vec<Called>,
    /// The numbers of the calls that are not left yet.
    stack: Vec<usize>,
    facts: BTreeMap<At, Facts>,
    /// The lines that run, and in which calls.
    ran: BTreeMap<At, BTreeSet<usize>>,
    /// The sites that the point reaches, and in which call first.
    reached: FxHashMap<u32, usize>,
    /// The truths that a condition had: true, false.
    truths: FxHashMap<u32, [bool; 2]>,
    /// The variables that each line assigns.
    again: BTreeMap<At, Assigned>,
    /// The current round of each loop, by the site that tells that a round begins.
    rounds: FxHashMap<u32, i32>,
}

impl Reader<'_> {
    fn shown(&self, id: NodeId) -> Shown {
        Shown::of(id, self.trace)
    }

    fn named(&self, names: &str, ids: &[NodeId]) -> Vec<(String, Shown)> {
        note_names(names).zip(ids).map(|(name, id)| (name.to_string(), self.shown(*id))).collect()
    }

    fn note(&mut self, number: u32, note: &Note, node: &Node) {
        let call = self.stack.last().copied().unwrap_or(0);
        self.reached.entry(number).or_insert(call);
        match note {
            Note::Result { names } => {
                let results = self.named(names, &node.args);
                if let Some(called) = call.checked_sub(1).and_then(|at| self.calls.get_mut(at)) {
                    called.results = results;
                }
                return;
            }
            Note::Leave => {
                self.stack.pop();
                return;
            }
            Note::Branch(_) => {
                let truth = node.args.first().is_some_and(|id| is_true(self.trace.node(*id)));
                self.truths.entry(number).or_default()[usize::from(!truth)] = true;
            }
            Note::Loop => {
                let round = self.subject.sites.round_of.get(&number);
                round.map(|round| self.rounds.insert(*round, 0));
            }
            Note::Round => *self.rounds.entry(number).or_default() += 1,
            _ => {}
        }
        let entered = self.enter(note, node, call);
        let Some(at) = line_at(node.span, self.sources) else { return };
        self.ran.entry(at).or_default().insert(call);
        let in_round = self.in_round(number);
        let needed = self.is_needed(number, note) && in_round != Some(InRound::Unneeded);
        let what = match in_round {
            Some(InRound::Constant) if needed => Compiled::Constant,
            _ => self.compiled(number, needed),
        };
        let args = &node.args;
        match (note, set_args(args)) {
            (Note::Set(name), (rest, [value, ..])) => {
                let name = match rest {
                    Some(index) => element(name, self.trace.node(*index)),
                    None => name.to_string(),
                };
                let value = self.shown(*value);
                self.assigned_again(at, number, &name);
                let facts = self.facts.entry(at).or_default();
                let is_literal = what == Compiled::Kept && self.subject.passed.literals.contains(&number);
                let new = || What::Set {
                    name: name.clone(),
                    values: Vec::new(),
                    compiled: Compiled::Kept,
                    each: Vec::new(),
                    derivatives: Vec::new(),
                };
                let thing = Thing::Set(name.clone());
                if let What::Set { values, each, .. } =
                    facts.value_fact(call, thing, (needed, is_literal), new)
                {
                    keep(values, value);
                    keep(each, what);
                }
            }
            (Note::Branch(test), (_, [cond, ..])) => {
                let is_known = what == Compiled::Constant || self.is_constant(number);
                self.branch((*test, is_known), node.span, at, call, *cond, needed)
            }
            (Note::Loop, _) => {
                if let Some(counts) = self.counts(at, call, node.span) {
                    keep(counts, 0);
                }
            }
            (Note::Round, _) => {
                if let Some(last) = self.counts(at, call, node.span).and_then(|counts| counts.last_mut()) {
                    *last += 1;
                }
            }
            (Note::Call { .. } | Note::Enter { .. }, _) => self.call(note, node, (at, call), needed, entered),
            _ => {}
        }
    }

    /// A call of a built-in function, or of one of the source, which then has the number `entered`.
    fn call(&mut self, note: &Note, node: &Node, (at, call): (At, usize), needed: bool, entered: usize) {
        match note {
            Note::Call { form, why, args: count } => {
                let (given, result) = node.args.split_at(usize::from(*count).min(node.args.len()));
                let made = (self.given(form, given), result.first().map(|id| self.shown(*id)));
                let applied = result.first().and_then(|id| self.applied(*id));
                let (form, why) = (form.to_string(), why.to_string());
                let thing = Thing::Call(form.clone());
                let new = || What::Call { form, why, how: Vec::new(), calls: Vec::new() };
                let facts = self.facts.entry(at).or_default();
                if let What::Call { calls, how, .. } = facts.fact(call, thing, needed, new) {
                    keep(calls, made);
                    if let Some(applied) = applied.filter(|applied| !how.contains(applied)) {
                        keep(how, applied);
                    }
                }
            }
            Note::Enter { form, why, .. } => {
                let thing = Thing::Enter(form.to_string());
                let new = || What::Enter { form: form.to_string(), why: why.to_string(), calls: Vec::new() };
                let facts = self.facts.entry(at).or_default();
                if let What::Enter { calls, .. } = facts.fact(call, thing, needed, new) {
                    keep(calls, entered);
                }
            }
            _ => {}
        }
    }

    /// The arguments of a call of this form.
    fn given(&self, form: &str, ids: &[NodeId]) -> Vec<Shown> {
        let mut params = form.split_once('(').map_or("", |(_, params)| params).split(", ");
        let one = |id: &NodeId| match params.next() {
            Some(param) if param.contains('[') => self.shown(*id).of_array(),
            _ => self.shown(*id),
        };
        ids.iter().map(one).collect()
    }

    /// The matrix that made a value, and what it was applied to; none if a space of the matrix is unknown.
    fn applied(&self, id: NodeId) -> Option<Applied> {
        let node = self.trace.node(id);
        let to = match node.what {
            Kind::Lane(LaneOp::TransformPoint) => Triple::Point,
            Kind::Lane(LaneOp::TransformVector) => Triple::Vector,
            Kind::Lane(LaneOp::TransformNormal) => Triple::Normal,
            _ => return None,
        };
        let matrix = *node.args.first()?;
        (!self.trace.reporting.contains(&matrix)).then(|| Applied { to, matrix: self.shown(matrix) })
    }

    /// Begins a call, if the note says so, and returns its number.
    fn enter(&mut self, note: &Note, node: &Node, caller: usize) -> usize {
        let Note::Enter { form, names, .. } = note else { return 0 };
        let given = self.named(names, &node.args);
        let depth = self.stack.len() + 1;
        let called = Called { form: form.to_string(), caller, depth, given, results: Vec::new() };
        self.calls.push(called);
        self.stack.push(self.calls.len());
        self.calls.len()
    }

    fn branch(
        &mut self,
        (test, is_known): (Test, bool),
        span: Span,
        at: At,
        call: usize,
        cond: NodeId,
        needed: bool,
    ) {
        let node = self.trace.node(cond);
        let truth = is_true(node);
        let flip = node.exact.as_ref().is_some_and(|e| e.truth() != truth);
        let condition = snippet(span, self.sources);
        let new =
            || What::Branch { test: test.into(), condition, taken: Vec::new(), flips: 0, known: is_known };
        let facts = self.facts.entry(at).or_default();
        if let What::Branch { taken, flips, known, .. } = facts.fact(call, Thing::Branch(span), needed, new) {
            taken.push(truth);
            *flips += usize::from(flip);
            *known &= is_known;
        }
    }

    /// Notes whether the value of a variable is replaced before anything reads it.
    fn assigned_again(&mut self, at: At, number: u32, name: &str) {
        let is_again = self.subject.needs.again.contains(&number);
        let Assigned { list, places } = self.again.entry(at).or_default();
        let next = list.len();
        match places.get(name).and_then(|at| list.get_mut(*at)) {
            Some((_, again)) => *again &= is_again,
            None => {
                places.insert(name.to_string(), next);
                list.push((name.to_string(), is_again));
            }
        }
    }

    /// What the compiler makes of a site in the current rounds of its loops.
    fn in_round(&self, number: u32) -> Option<InRound> {
        let rounds = &self.subject.sites.by_number.get(&number)?.rounds;
        let round = |site: &u32| self.rounds.get(site).copied().unwrap_or(0);
        self.subject.rounds.get(&(number, rounds.iter().map(round).collect())).copied()
    }

    fn is_constant(&self, number: u32) -> bool {
        matches!(self.subject.passed.made.get(&number), Some(FoldedResult::Constant(_)))
    }

    fn counts(&mut self, at: At, call: usize, span: Span) -> Option<&mut Vec<usize>> {
        let facts = self.facts.entry(at).or_default();
        match facts.fact(call, Thing::Rounds(span), false, || What::Rounds { counts: Vec::new() }) {
            What::Rounds { counts } => Some(counts),
            _ => None,
        }
    }

    /// Whether an output needs what a note tells.
    fn is_needed(&self, number: u32, note: &Note) -> bool {
        let needs = &self.subject.needs;
        let args = self.subject.sites.by_number.get(&number).map_or(&[][..], |site| &site.args);
        match note {
            Note::Set(_) => !needs.unused.contains(&number),
            Note::Branch(_) => args.first().is_none_or(|cond| needs.value(*cond)),
            Note::Call { args: count, .. } => args.get(usize::from(*count)).is_none_or(|v| needs.value(*v)),
            Note::Enter { .. } => self.subject.acts,
            _ => false,
        }
    }

    fn compiled(&self, number: u32, needed: bool) -> Compiled {
        match self.subject.passed.made.get(&number) {
            _ if !needed => Compiled::NotNeeded,
            Some(FoldedResult::Constant(_)) => Compiled::Constant,
            Some(FoldedResult::Same(span)) => {
                line_at(*span, self.sources).map_or(Compiled::Kept, |(_, line)| Compiled::SameAsLine(line))
            }
            None => Compiled::Kept,
        }
    }

    /// Adds the operands of `&&` and `||` that were not evaluated where the other one was.
    fn unevaluated(&mut self) {
        let subject = self.subject;
        for number in &subject.sites.order {
            let Some(site) = subject.sites.by_number.get(number) else { continue };
            if site.note != Note::Branch(Test::Operand) || self.reached.contains_key(number) {
                continue;
            }
            if let Some(left) = subject.sites.left_of(site)
                && let Some(call) = self.reached.get(&left)
                && let Some(at) = line_at(site.span, self.sources)
            {
                let condition = snippet(site.span, self.sources);
                let facts = self.facts.entry(at).or_default();
                facts.fact(*call, Thing::Branch(site.span), false, || What::Unevaluated { condition });
            }
        }
    }

    /// All lines that may run, with their facts.
    fn lines(&mut self) -> Vec<Line> {
        let mut first: BTreeMap<At, &Site> = BTreeMap::new();
        let mut gone: BTreeMap<At, bool> = BTreeMap::new();
        let removed: BTreeSet<u32> = self.subject.passed.gone.iter().copied().collect();
        for number in &self.subject.sites.order {
            if let Some(site) = self.subject.sites.by_number.get(number)
                && let Some(at) = line_at(site.span, self.sources)
            {
                first.entry(at).or_insert(site);
                *gone.entry(at).or_insert(true) &= removed.contains(number);
            }
        }
        let reasons = Reasons {
            subject: self.subject,
            sources: self.sources,
            reached: &self.reached,
            truths: &self.truths,
        };
        let line = |(at, site): (At, &Site)| {
            let (file, text) = text_of(at, self.sources)?;
            let calls = self.ran.remove(&at).unwrap_or_default();
            let Facts { mut list, needed, literals, .. } = self.facts.remove(&at).unwrap_or_default();
            let again = self.again.remove(&at).unwrap_or_default().list;
            for (fact, literals) in list.iter_mut().zip(literals) {
                if let What::Set { compiled, each, .. } = &mut fact.what {
                    settle(compiled, each, literals);
                }
            }
            let branches = list.iter().any(|fact| matches!(fact.what, What::Branch { .. }));
            let is_idle = (branches || !again.is_empty()) && !needed.contains(&true);
            let (state, why) = if calls.is_empty() {
                (State::Skipped, reasons.skipped(site, gone.get(&at) == Some(&true)))
            } else if !is_idle {
                (State::Runs, reasons.partly_needed(&list, &again))
            } else if !branches && again.iter().all(|(_, again)| *again) {
                let names: Vec<String> = again.into_iter().map(|(name, _)| name).collect();
                (State::NotNeeded, Some(Reasons::again(&names)))
            } else {
                (State::NotNeeded, Some(reasons.not_needed("it")))
            };
            Some(Line { file, number: at.1, text, state, why, calls, facts: list, reports: Vec::new() })
        };
        first.into_iter().filter_map(line).collect()
    }
}

/// Joins what the compiler made of each value, if it is the same. Constants of the source are only told as
/// known if all other values are known.
fn settle(compiled: &mut Compiled, each: &mut Vec<Compiled>, literals: usize) {
    let count = |wanted: Compiled| each.iter().filter(|one| **one == wanted).count();
    let known = count(Compiled::Constant);
    if known > 0 && known + literals == each.len() && count(Compiled::Kept) == literals {
        each.fill(Compiled::Constant);
    }
    if let Some(first) = each.first().copied().filter(|first| each.iter().all(|one| one == first)) {
        *compiled = first;
        each.clear();
    }
}

/// The arguments of a note of a variable: the index of an element, and the value with its derivatives.
pub(super) fn set_args(args: &[NodeId]) -> (Option<&NodeId>, &[NodeId]) {
    match args {
        [index, rest @ ..] if args.len().is_multiple_of(2) => (Some(index), rest),
        _ => (None, args),
    }
}

fn is_true(node: &Node) -> bool {
    matches!(node.strict, Some(Const::Int(n)) if n != 0)
}

/// The name of an element. In the name of an array, `[]` stands for the index of the outermost array, and
/// each length for the index of an inner one; without `[]`, that index comes first.
pub(super) fn element(name: &str, index: &Node) -> String {
    let Some(Const::Int(mut n)) = index.strict else { return format!("{name}[?]") };
    let name = match name.split_once('[') {
        _ if name.contains("[]") => name.to_string(),
        Some((name, inner)) => format!("{name}[][{inner}"),
        None => format!("{name}[]"),
    };
    let (mut rest, mut indexed) = (&*name, String::new());
    while let Some((before, (len, after))) =
        rest.rsplit_once('[').and_then(|(before, after)| Some((before, after.split_once(']')?)))
    {
        let index = match len.parse::<i32>() {
            Ok(len) => {
                let index = n % len.max(1);
                n /= len.max(1);
                index
            }
            Err(_) => n,
        };
        indexed = format!("[{index}]{after}{indexed}");
        rest = before;
    }
    format!("{rest}{indexed}")
}
