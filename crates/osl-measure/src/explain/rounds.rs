//! What the compiler makes of single rounds of loops.
//!
//! The passes unroll a loop with a few known rounds, and each copy of an assignment has a result of its own.
//! To tell which round a copy belongs to, a copy of the body counts the rounds of each loop, and marks each
//! assignment with the counts: in unrolled code they are constants.

use super::sites::Sites;
use osl_ir::Span;
use osl_ir::global::Global;
use osl_ir::ir::{Body, Const, Inst, Kernel, Kind, LaneOp, Note, Op, Slot, SlotId, ValueId};
use osl_ir::passes::{self, Pass};
use rustc_hash::{FxHashMap, FxHashSet};

/// What the compiler makes of an assignment or a condition in one round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum InRound {
    /// The value is known when the shader is compiled.
    Constant,
    /// No requested output needs the value.
    Unneeded,
    /// Neither is known.
    Kept,
}

/// A site, and the rounds of the loops around it, from the outermost.
pub(super) type RoundKey = (u32, Vec<i32>);

/// The mark of a site has its number with this bit.
const MARK: u32 = 1 << 31;

/// The results of all rounds of loops that are unrolled.
pub(super) fn of(noted: &Body, sites: &Sites, options: &passes::Options) -> FxHashMap<RoundKey, InRound> {
    let mut found = FxHashMap::default();
    if sites.round_of.is_empty() || options.limits.halted().is_some() {
        return found;
    }
    // The derivative of a value may be needed without the value.
    let derives = noted.insts().any(|inst| {
        use Kernel::{Environment, NamedNoise, Texture};
        let is_filtered =
            |kernel: &Kernel| matches!(kernel, Texture { .. } | Environment { .. } | NamedNoise { .. });
        match &inst.op {
            Op::Derivative(..) => true,
            Op::Kernel(kernel, _) => is_filtered(kernel),
            _ => false,
        }
    });
    let mut body = noted.clone();
    count_rounds(&mut body, sites);
    let keep = [Pass::Ssa, Pass::Fold, Pass::Derive, Pass::Unroll, Pass::Rate];
    let without = Pass::ALL.into_iter().filter(|pass| !keep.contains(pass)).collect();
    passes::run(&mut body, &passes::Options { without, outputs: None, ..options.clone() });
    let marks = take_notes(&mut body);
    let constants: FxHashMap<ValueId, Const> =
        body.constants().map(|(value, known)| (value, known.clone())).collect();
    passes::apply(&mut body, Pass::Dce, options);
    let live = defined(&body);
    for (site, args) in marks {
        let [value, hidden, counts @ ..] = &args[..] else { continue };
        let count = |value: &ValueId| match constants.get(value) {
            Some(Const::Int(n)) => Some(*n),
            _ => None,
        };
        let Some(counts) = counts.iter().map(count).collect::<Option<Vec<i32>>>() else { continue };
        let state = if constants.contains_key(value) {
            InRound::Constant
        } else if hidden == value || derives || live.contains(hidden) {
            InRound::Kept
        } else {
            InRound::Unneeded
        };
        let known = found.entry((site, counts)).or_insert(state);
        if *known != state {
            *known = InRound::Kept;
        }
    }
    found
}

/// Counts the rounds of each loop, and marks the assignments and conditions in loops: the value, the hidden
/// one, and the counts.
fn count_rounds(body: &mut Body, sites: &Sites) {
    let mut slots: FxHashMap<u32, SlotId> = FxHashMap::default();
    for round in sites.round_of.values() {
        slots.insert(*round, SlotId(body.slots.len() as u32));
        let rate = osl_ir::ir::Rate::Varying;
        body.slots.push(Slot { kind: Kind::Int, len: None, name: "round".into(), rate });
    }
    for block in 0..body.blocks.len() {
        let insts = std::mem::take(&mut body.blocks[block].insts);
        let mut kept = Vec::with_capacity(insts.len());
        for inst in insts {
            let (span, note) = (inst.span, note_of(&inst));
            kept.push(inst);
            let Some((site, note, args)) = note else { continue };
            let mut w = Code { body, out: &mut kept, span };
            match note {
                Note::Loop => {
                    if let Some(slot) = sites.round_of.get(&site).and_then(|round| slots.get(round)) {
                        let zero = w.value(Op::Const(Const::Int(0)), Kind::Int);
                        w.effect(Op::Store(*slot, zero));
                    }
                }
                Note::Round => {
                    if let Some(slot) = slots.get(&site) {
                        let now = w.value(Op::Load(*slot), Kind::Int);
                        let one = w.value(Op::Const(Const::Int(1)), Kind::Int);
                        let next =
                            w.value(Op::Lane(LaneOp::IAdd, [now, one].into_iter().collect()), Kind::Int);
                        w.effect(Op::Store(*slot, next));
                    }
                }
                Note::Set(_) | Note::Branch(_) => {
                    let rounds = sites.by_number.get(&site).map_or(&[][..], |site| &site.rounds);
                    let Some(value) = args.last().filter(|_| !rounds.is_empty()) else { continue };
                    let hidden = w.hide(*value);
                    let mut marked = vec![*value, hidden];
                    for slot in rounds.iter().filter_map(|round| slots.get(round)) {
                        marked.push(w.value(Op::Load(*slot), Kind::Int));
                    }
                    let note = Note::Result { names: ",".repeat(marked.len()).into() };
                    let mark = Kernel::Note { site: site | MARK, note };
                    w.effect(Op::Kernel(mark, marked.into_iter().collect()));
                }
                _ => {}
            }
        }
        body.blocks[block].insts = kept;
    }
}

fn note_of(inst: &Inst) -> Option<(u32, Note, Vec<ValueId>)> {
    match &inst.op {
        Op::Kernel(Kernel::Note { site, note }, args) => Some((*site, note.clone(), args.to_vec())),
        _ => None,
    }
}

/// Writes instructions.
struct Code<'a> {
    body: &'a mut Body,
    out: &'a mut Vec<Inst>,
    span: Span,
}

impl Code<'_> {
    fn value(&mut self, op: Op, kind: Kind) -> ValueId {
        let result = self.body.fresh(kind, self.span);
        self.out.push(Inst { op, results: [result].into_iter().collect(), span: self.span });
        result
    }

    /// Adds an unknown number to a float or triple that has just been stored. Folding then cannot reach
    /// through the variable, so an output that depends on it needs this sum. Returns the value for others.
    fn hide(&mut self, value: ValueId) -> ValueId {
        let (kind, at) = (self.body.kind(value), self.out.len().checked_sub(2));
        let is_stored = |inst: &Inst| match &inst.op {
            Op::Store(_, stored) | Op::StoreElement(_, _, stored) => *stored == value,
            _ => false,
        };
        let stored = at.and_then(|at| self.out.get(at)).is_some_and(is_stored);
        let (true, Some(at), Kind::Float | Kind::Triple) = (stored, at, kind) else { return value };
        let rest = self.out.split_off(at);
        let unknown = self.value(Op::Global(Global::Time), Kind::Float);
        let hidden = self.value(Op::Lane(LaneOp::FAdd, [value, unknown].into_iter().collect()), kind);
        self.out.extend(rest);
        if let Some(Inst { op: Op::Store(_, stored) | Op::StoreElement(_, _, stored), .. }) =
            self.out.get_mut(at + 2)
        {
            *stored = hidden;
        }
        hidden
    }

    fn effect(&mut self, op: Op) {
        self.out.push(Inst { op, results: [].into_iter().collect(), span: self.span });
    }
}

/// Removes all notes; returns the marks.
fn take_notes(body: &mut Body) -> Vec<(u32, Vec<ValueId>)> {
    let notes = body.insts_from(body.entry).filter_map(note_of);
    let marks = notes.filter(|(site, ..)| site & MARK != 0).map(|(site, _, args)| (site & !MARK, args));
    let marks = marks.collect();
    body.blocks.iter_mut().for_each(|block| block.insts.retain(|inst| note_of(inst).is_none()));
    marks
}

/// The values that a body defines.
fn defined(body: &Body) -> FxHashSet<ValueId> {
    let mut found = FxHashSet::default();
    for inst in body.insts_from(body.entry) {
        found.extend(inst.results.iter().copied());
        if let Op::Loop { params, .. } = &inst.op {
            found.extend(params.iter().copied());
        }
    }
    found
}
