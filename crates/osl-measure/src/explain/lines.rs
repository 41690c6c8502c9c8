//! From a trace to facts about each line.

use super::reasons::Reasons;
use super::sites::{FoldedResult, Site};
use super::source::{At, line_at, snippet, text_of};
use super::{Applied, Called, Compiled, Explanation, Fact, Line, Shown, State, Subject, Triple, What};
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
    Explanation { shader: subject.body.name.to_string(), globals, calls, lines, outputs, cut: trace.cut }
}

/// The facts of a line, each thing once.
#[derive(Default)]
struct Facts {
    list: Vec<Fact>,
    /// Whether the values of each fact are needed.
    needed: Vec<bool>,
    /// The position of each thing in the list, as a line may set every element of a long array.
    places: FxHashMap<(usize, Thing), usize>,
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
        let next = self.list.len();
        let at = *self.places.entry((call, thing)).or_insert(next);
        if at == next {
            self.list.push(Fact { call, what: new() });
            self.needed.push(needed);
        } else if let Some(flag) = self.needed.get_mut(at) {
            *flag |= needed;
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
    /// The variables of each line that are assigned again before anything reads them; `None` if the line does
    /// something else too.
    again: BTreeMap<At, Option<Vec<String>>>,
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
            _ => {}
        }
        let entered = self.enter(note, node, call);
        let Some(at) = line_at(node.span, self.sources) else { return };
        self.ran.entry(at).or_default().insert(call);
        let needed = self.is_needed(number, note);
        let what = self.compiled(number, needed);
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
                let new = || What::Set {
                    name: name.clone(),
                    values: Vec::new(),
                    compiled: what,
                    derivatives: Vec::new(),
                };
                if let What::Set { values, compiled, .. } =
                    facts.fact(call, Thing::Set(name.clone()), needed, new)
                {
                    keep(values, value);
                    if *compiled != what {
                        *compiled = Compiled::Kept;
                    }
                }
            }
            (Note::Branch(test), (_, [cond, ..])) => {
                self.again.insert(at, None);
                self.branch((number, *test), node.span, at, call, *cond, needed)
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
            (Note::Call { form, why, args: count }, _) => {
                let (given, result) = args.split_at(usize::from(*count).min(args.len()));
                let made = (
                    given.iter().map(|id| self.shown(*id)).collect(),
                    result.first().map(|id| self.shown(*id)),
                );
                let applied = result.first().and_then(|id| self.applied(*id));
                let new = || What::Call {
                    form: form.to_string(),
                    why: why.to_string(),
                    how: Vec::new(),
                    calls: Vec::new(),
                };
                let facts = self.facts.entry(at).or_default();
                if let What::Call { calls, how, .. } =
                    facts.fact(call, Thing::Call(form.to_string()), needed, new)
                {
                    keep(calls, made);
                    if let Some(applied) = applied.filter(|applied| !how.contains(applied)) {
                        keep(how, applied);
                    }
                }
            }
            (Note::Enter { form, why, .. }, _) => {
                let new = || What::Enter { form: form.to_string(), why: why.to_string(), calls: Vec::new() };
                let facts = self.facts.entry(at).or_default();
                if let What::Enter { calls, .. } =
                    facts.fact(call, Thing::Enter(form.to_string()), needed, new)
                {
                    keep(calls, entered);
                }
            }
            _ => {}
        }
    }

    /// The matrix that made a value, and what it was applied to.
    fn applied(&self, id: NodeId) -> Option<Applied> {
        let node = self.trace.node(id);
        let to = match node.what {
            Kind::Lane(LaneOp::TransformPoint) => Triple::Point,
            Kind::Lane(LaneOp::TransformVector) => Triple::Vector,
            Kind::Lane(LaneOp::TransformNormal) => Triple::Normal,
            _ => return None,
        };
        Some(Applied { to, matrix: self.shown(*node.args.first()?) })
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
        (number, test): (u32, Test),
        span: Span,
        at: At,
        call: usize,
        cond: NodeId,
        needed: bool,
    ) {
        let node = self.trace.node(cond);
        let truth = is_true(node);
        let flip = node.exact.as_ref().is_some_and(|e| e.truth() != truth);
        let is_known = matches!(self.subject.passed.made.get(&number), Some(FoldedResult::Constant(_)));
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
        let names = self.again.entry(at).or_insert_with(|| Some(Vec::new()));
        match names {
            Some(names) if self.subject.needs.again.contains(&number) => {
                if !names.iter().any(|known| known == name) {
                    names.push(name.to_string());
                }
            }
            _ => *names = None,
        }
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
            let Facts { list, needed, .. } = self.facts.remove(&at).unwrap_or_default();
            let sets = list.iter().any(|fact| matches!(fact.what, What::Set { .. } | What::Branch { .. }));
            let (state, why) = if calls.is_empty() {
                (State::Skipped, reasons.skipped(site, gone.get(&at) == Some(&true)))
            } else if sets && !needed.contains(&true) {
                let again = self.again.remove(&at).flatten();
                (
                    State::NotNeeded,
                    Some(again.map_or_else(|| reasons.not_needed(), |names| Reasons::again(&names))),
                )
            } else {
                (State::Runs, None)
            };
            Some(Line { file, number: at.1, text, state, why, calls, facts: list })
        };
        first.into_iter().filter_map(line).collect()
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

/// The name of an element. After the name of arrays within arrays are the lengths of the inner ones.
pub(super) fn element(name: &str, index: &Node) -> String {
    let Some(Const::Int(mut n)) = index.strict else { return format!("{name}[?]") };
    let (name, lens) = name.split_once('[').unwrap_or((name, ""));
    let mut indices = String::new();
    for len in lens.rsplit('[').filter_map(|len| len.trim_end_matches(']').parse::<i32>().ok()) {
        indices = format!("[{}]{indices}", n % len.max(1));
        n /= len.max(1);
    }
    format!("{name}[{n}]{indices}")
}
