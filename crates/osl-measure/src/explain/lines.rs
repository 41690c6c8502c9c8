//! From a trace to facts about each line.

use super::{Explanation, Fact, Line, Shown, State};
use crate::trace::{Node, Trace, What};
use osl_ir::Span;
use osl_ir::global::GLOBALS;
use osl_ir::ir::{Body, Const, Kernel, Note, Op};
use osl_syntax::source::SourceMap;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// A line: the start of its file and its number.
type At = (u32, u32);

/// Explains a point line by line. `noted` is the body that was followed. `needed` is the same program without
/// notes, reduced to what the outputs need: lines without instructions in it are not needed.
pub fn explain(trace: &Trace, noted: &Body, needed: &Body, sources: &SourceMap) -> Explanation {
    let known = lines_of(noted, sources);
    let kept = lines_of(needed, sources);
    let mut ran: BTreeSet<At> = BTreeSet::new();
    let mut facts: BTreeMap<At, Facts> = BTreeMap::new();
    let mut globals = Vec::new();
    for node in &trace.nodes {
        let Some(at) = line_at(node.span, sources) else { continue };
        ran.insert(at);
        match &node.what {
            What::Note(kernel) => {
                if let Kernel::Note(note) = &**kernel {
                    facts.entry(at).or_default().add(note, node, trace);
                }
            }
            _ => continue,
        }
    }
    let read = globals_read(needed);
    for node in &trace.nodes {
        if let What::Global(global) = node.what
            && read.contains(&global)
            && let Some((_, name, ..)) = GLOBALS.iter().find(|(g, ..)| *g == global)
            && !globals.iter().any(|(known, _)| known == name)
        {
            globals.push(((*name).to_string(), Shown::of(node)));
        }
    }
    let lines = known
        .iter()
        .filter_map(|at| {
            let (file, text) = text_of(*at, sources)?;
            let state = match (ran.contains(at), kept.contains(at)) {
                (_, false) => State::NotNeeded,
                (true, true) => State::Runs,
                (false, true) => State::Skipped,
            };
            let facts = facts.remove(at).map(|f| f.list).unwrap_or_default();
            Some(Line { file, number: at.1, text, state, facts })
        })
        .collect();
    let mut outputs = Vec::new();
    for (name, ty, nodes) in &trace.outputs {
        for (index, id) in nodes.iter().enumerate() {
            let name = if ty.is_array() { format!("{name}[{index}]") } else { name.to_string() };
            outputs.push((name, Shown::of(trace.node(*id))));
        }
    }
    Explanation { shader: noted.name.to_string(), globals, lines, outputs, cut: trace.cut }
}

/// The globals that a body reads.
fn globals_read(body: &Body) -> BTreeSet<osl_ir::global::Global> {
    let insts = body.blocks.iter().flat_map(|b| &b.insts);
    insts.filter_map(|i| if let Op::Global(g) = i.op { Some(g) } else { None }).collect()
}

/// The lines that have instructions. Constants and globals by themselves do not count.
fn lines_of(body: &Body, sources: &SourceMap) -> BTreeSet<At> {
    let mut lines = BTreeSet::new();
    let mut blocks = vec![body.entry];
    while let Some(block) = blocks.pop() {
        for inst in &body.block(block).insts {
            match &inst.op {
                Op::Global(_) | Op::GlobalDeriv(..) => continue,
                Op::If { then, otherwise, .. } => blocks.extend([*then, *otherwise]),
                Op::Loop { body, .. } => blocks.push(*body),
                _ => {}
            }
            lines.extend(line_at(inst.span, sources));
        }
    }
    lines
}

fn line_at(span: Span, sources: &SourceMap) -> Option<At> {
    if span == Span::default() {
        return None;
    }
    sources.line(span).map(|(file, line)| (file.base, line))
}

fn text_of((base, number): At, sources: &SourceMap) -> Option<(String, String)> {
    let file = sources.file_at(base)?;
    let text = file.line(number)?;
    Some((file.name.clone(), text.trim().chars().take(200).collect()))
}

/// The facts of a line, each thing once.
#[derive(Default)]
struct Facts {
    list: Vec<Fact>,
    /// The position of each thing in the list, as a line may set every element of a long array.
    places: FxHashMap<Thing, usize>,
}

/// What a fact is about.
#[derive(PartialEq, Eq, Hash)]
enum Thing {
    Set(String),
    Branch,
    Rounds,
    Call(String),
}

/// Values kept for each thing: the first ones and the last one are shown. This is a choice of presentation:
/// `running.trace` bounds the values.
const MAX_VALUES: usize = 10_000;

impl Facts {
    /// The fact about a thing. If there is none yet, records that the caller will append it, and returns
    /// `None`.
    fn known(&mut self, thing: Thing) -> Option<&mut Fact> {
        let next = self.list.len();
        let at = *self.places.entry(thing).or_insert(next);
        self.list.get_mut(at)
    }

    fn add(&mut self, note: &Note, node: &Node, trace: &Trace) {
        let args: Vec<&Node> = node.args.iter().map(|id| trace.node(*id)).collect();
        match note {
            Note::Set(name) => {
                let (name, value) = match args[..] {
                    [index, value] => (element(name, index), value),
                    [value] => (name.to_string(), value),
                    _ => return,
                };
                let value = Shown::of(value);
                match self.known(Thing::Set(name.clone())) {
                    Some(Fact::Set { values, .. }) if values.len() < MAX_VALUES => values.push(value),
                    Some(_) => {}
                    None => self.list.push(Fact::Set { name, values: vec![value] }),
                }
            }
            Note::Branch => {
                let Some(cond) = args.first() else { return };
                let truth = matches!(cond.strict, Some(Const::Int(n)) if n != 0);
                let flip = cond.exact.as_ref().is_some_and(|e| cond.strict.is_some() && e.truth() != truth);
                match self.known(Thing::Branch) {
                    Some(Fact::Branch { taken, flips }) => {
                        taken.push(truth);
                        *flips += usize::from(flip);
                    }
                    Some(_) => {}
                    None => self.list.push(Fact::Branch { taken: vec![truth], flips: flip.into() }),
                }
            }
            Note::Round => match self.known(Thing::Rounds) {
                Some(Fact::Rounds { count }) => *count += 1,
                Some(_) => {}
                None => self.list.push(Fact::Rounds { count: 1 }),
            },
            Note::Call { form, why, args: count } => {
                let (given, result) = args.split_at(usize::from(*count).min(args.len()));
                let call =
                    (given.iter().map(|n| Shown::of(n)).collect(), result.first().map(|n| Shown::of(n)));
                match self.known(Thing::Call(form.to_string())) {
                    Some(Fact::Call { calls, .. }) if calls.len() < MAX_VALUES => calls.push(call),
                    Some(_) => {}
                    None => {
                        let (form, why) = (form.to_string(), why.to_string());
                        self.list.push(Fact::Call { form, why, calls: vec![call] });
                    }
                }
            }
        }
    }
}

fn element(name: &str, index: &Node) -> String {
    match index.strict {
        Some(Const::Int(n)) => format!("{name}[{n}]"),
        _ => format!("{name}[?]"),
    }
}
