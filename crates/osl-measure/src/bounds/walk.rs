//! Walks a body once for a whole tile of points: each value is an [`Enclosure`] of its values at all of them.
//!
//! A branch that the tile does not decide is walked on both sides, each under the assumption that its
//! condition holds (`assume`), and the results are joined; or the tile is walked once for each side
//! (`cases`). A loop is walked round by round; from a number of rounds on, its variables are widened until
//! they no longer grow. A walk has a number of instructions; once it has used them up, each further loop is
//! walked only once, for any values of its variables. So nested loops cost no more than their depth times
//! their length. Every instruction reports what it was given to `sites`.

use super::domain::{Tile, shaped};
use super::paths::Paths;
use super::sites::{Sites, Watched};
use super::state::{Arrays, Program, Undo, Walk};
use osl_ir::ir::{BlockId, Body, Inst, Kernel, Kind, LaneOp, Op, SlotId, Source, ValueId};
use osl_numeric::interval::{Enclosure, Interval, eval};
use std::sync::Arc;

/// Rounds of a loop after the first one that may be its last, before its variables are widened.
const OPEN_ROUNDS: usize = 40;
/// Instructions of a walk; a loop that needs more is widened.
const STEPS: usize = 400_000;
/// Further instructions, for loops that are widened.
const WIDENING_STEPS: usize = 100_000;
/// Rounds in which only what grows is widened; then everything that the loop changes may have any value.
const WIDENED_ROUNDS: usize = 4;

/// Walks a tile path by path. The result is the hull of the outputs, and what was seen; `None` if no place
/// has cases, or if the walks have to stop.
pub(super) fn apart(
    program: Program<'_>,
    tile: &Tile,
    watched: &Arc<Watched>,
) -> Option<(Vec<Vec<Enclosure>>, Sites)> {
    let mut paths = Paths::apart();
    let mut all: Option<(Vec<Vec<Enclosure>>, Sites)> = None;
    loop {
        let mut sites = Sites::new(watched.clone());
        let outputs = Walk::run(program, tile, &mut sites, &mut paths);
        if paths.is_single() || program.calls.limits.halted().is_some() {
            return None;
        }
        if let Some(outputs) = outputs {
            all = Some(match all {
                None => (outputs, sites),
                Some((others, mut seen)) => {
                    seen.add(sites);
                    let hulls = |(a, b): (&Vec<Enclosure>, &Vec<Enclosure>)| {
                        a.iter().zip(b).map(|(a, b)| a.hull(b)).collect()
                    };
                    (others.iter().zip(&outputs).map(hulls).collect(), seen)
                }
            });
        }
        if !paths.next() {
            return all;
        }
    }
}

impl<'a> Walk<'a> {
    /// Walks the whole body on a path; the result is the enclosures of each output, `None` if no point takes
    /// this path, or if the limits stop the walk.
    pub(super) fn run(
        program: Program<'a>,
        tile: &'a Tile,
        sites: &'a mut Sites,
        paths: &'a mut Paths,
    ) -> Option<Vec<Vec<Enclosure>>> {
        let body = program.body;
        // Arrays begin with zeros.
        let zeros = |slot: &osl_ir::ir::Slot| {
            let zero = Enclosure::point(&osl_ir::ir::Const::zero(slot.kind));
            vec![zero; slot.len.unwrap_or(0) as usize]
        };
        let arrays = body.slots.iter().map(zeros).collect();
        let mut walk = Walk {
            program,
            tile,
            values: vec![None; body.values.len()],
            arrays,
            sites,
            paths,
            joined: 0,
            is_dead: false,
            steps: STEPS + WIDENING_STEPS,
        };
        walk.block(body.entry);
        if walk.is_dead {
            return None;
        }
        let of = |output: &osl_ir::ir::Output| match output.source {
            Source::Value(value) => vec![walk.of(value)],
            Source::Slot(slot) => walk.arrays.get(slot.index()).cloned().unwrap_or_default(),
        };
        Some(body.outputs.iter().map(of).collect())
    }

    /// The enclosures of each output, if nothing is known.
    pub(super) fn unknown(body: &Body) -> Vec<Vec<Enclosure>> {
        let any = |output: &osl_ir::ir::Output| match output.source {
            Source::Value(value) => vec![Enclosure::any(body.kind(value))],
            Source::Slot(slot) => {
                let slot = body.slot(slot);
                vec![Enclosure::any(slot.kind); slot.len.unwrap_or(0) as usize]
            }
        };
        body.outputs.iter().map(any).collect()
    }

    fn block(&mut self, id: BlockId) {
        let body = self.program.body;
        for inst in &body.block(id).insts {
            self.is_dead |= self.program.calls.limits.halted().is_some();
            self.inst(inst);
            if self.is_dead {
                return;
            }
        }
    }

    fn inst(&mut self, inst: &Inst) {
        self.steps = self.steps.saturating_sub(1);
        let kind = inst.results.first().map(|result| self.program.body.kind(*result));
        let value = match &inst.op {
            Op::Const(value) => Enclosure::point(value),
            Op::Global(global) => self.tile.global(self.program.points, *global, kind),
            Op::GlobalDeriv(global, axis) => {
                if self.program.points.varying_derivs().contains(global) {
                    Enclosure::any(kind.unwrap_or(Kind::Float))
                } else {
                    shaped(self.program.points.deriv(*global, *axis), kind)
                }
            }
            Op::Input(index) => self.tile.input(self.program.body, *index),
            Op::Lane(op, args) => self.lane(*op, args, inst),
            Op::Kernel(kernel, args) => return self.kernel(kernel, args, inst),
            Op::LoadElement(slot, index) => {
                self.element(*index);
                self.load(*slot, *index)
            }
            Op::StoreElement(slot, index, value) => return self.store(*slot, *index, *value),
            Op::If { cond, then, otherwise, then_yields, else_yields } => {
                return self.branch(inst, *cond, [*then, *otherwise], [then_yields, else_yields]);
            }
            Op::Loop { init, params, body, cond, next } => {
                return self.repeat(inst, &Repeat { init, params, body: *body, cond: *cond, next });
            }
            Op::Derivative(..) | Op::Share(..) | Op::Load(_) | Op::Store(..) => return,
        };
        if let Some(result) = inst.results.first() {
            self.set(*result, value);
        }
    }

    fn lane(&mut self, op: LaneOp, args: &[ValueId], inst: &Inst) -> Enclosure {
        let given = self.all(args);
        self.sites.lane(op, &given, inst);
        let body = self.program.body;
        let kind = inst.results.first().map_or(Kind::Float, |result| body.kind(*result));
        let is_same = matches!(args, [a, b] if a == b);
        // A product with itself is not negative.
        let given = match op {
            LaneOp::FMul | LaneOp::Dot if is_same => given.iter().map(magnitudes).collect(),
            _ => given,
        };
        let value = eval(op, &given).unwrap_or_else(|| Enclosure::any(kind));
        let is_fraction = match (op, args) {
            (LaneOp::FSub, [x, whole]) => self.program.defs.is_floor_of(*whole, *x),
            _ => false,
        };
        if is_fraction { fractions(&value) } else { self.wholes(op, args, value) }
    }

    fn kernel(&mut self, kernel: &Kernel, args: &[ValueId], inst: &Inst) {
        let given = self.all(args);
        if let Kernel::CheckIndex { .. } = kernel {
            self.sites.index(kernel, &given, inst);
            return;
        }
        let body = self.program.body;
        let kinds: Vec<Kind> = inst.results.iter().map(|result| body.kind(*result)).collect();
        let read = kernel.reads().and_then(|slot| self.arrays.get(slot.index()));
        let results =
            self.program.calls.results(kernel, &given, &kinds, read.map(Vec::as_slice), self.tile, inst);
        if let Some(slot) = kernel.writes()
            && let Some(array) = self.arrays.get_mut(slot.index())
        {
            array.fill(Enclosure::any(body.slot(slot).kind));
        }
        self.set_all(&inst.results, &results);
    }

    /// The elements that an index may select: lowering clamps indices into the array.
    fn elements(&self, slot: SlotId, index: ValueId) -> std::ops::RangeInclusive<usize> {
        let last = self.program.body.slot(slot).len.unwrap_or(1).saturating_sub(1) as i32;
        let Enclosure::Int(index) = self.of(index) else { return 0..=last as usize };
        index.lo.clamp(0, last) as usize..=index.hi.clamp(0, last) as usize
    }

    fn load(&self, slot: SlotId, index: ValueId) -> Enclosure {
        let kind = self.program.body.slot(slot).kind;
        let range = self.elements(slot, index);
        let found = self.arrays.get(slot.index()).and_then(|array| array.get(range)).unwrap_or_default();
        let hull = found.iter().cloned().reduce(|a, b| a.hull(&b));
        hull.unwrap_or_else(|| Enclosure::any(kind))
    }

    fn store(&mut self, slot: SlotId, index: ValueId, value: ValueId) {
        let (range, value) = (self.elements(slot, index), self.of(value));
        let is_one = range.start() == range.end();
        let places = self.arrays.get_mut(slot.index()).and_then(|array| array.get_mut(range));
        for place in places.into_iter().flatten() {
            *place = if is_one { value.clone() } else { place.hull(&value) };
        }
    }

    fn branch(&mut self, inst: &Inst, cond: ValueId, sides: [BlockId; 2], yields: [&[ValueId]; 2]) {
        if let Some(truth) = self.of(cond).truth().value() {
            let side = usize::from(!truth);
            self.block(sides[side]);
            let results = self.all(yields[side]);
            self.set_all(&inst.results, &results);
            return;
        }
        if let Some(side) = self.case(2) {
            self.is_dead |= !self.assume(cond, side == 0, &mut Undo::default());
            if !self.is_dead {
                self.block(sides[side]);
            }
            let results = self.all(yields[side]);
            self.set_all(&inst.results, &results);
            return;
        }
        let before = self.arrays.clone();
        self.sites.open += 1;
        self.joined += 1;
        let mut joined: Option<(Vec<Enclosure>, Arrays)> = None;
        for (side, truth) in [(0, true), (1, false)] {
            self.arrays.clone_from(&before);
            let mut undo = Undo::default();
            if self.assume(cond, truth, &mut undo) {
                self.block(sides[side]);
                let results = self.all(yields[side]);
                let arrays = std::mem::take(&mut self.arrays);
                joined = Some(match joined {
                    None => (results, arrays),
                    Some((others, other)) => (hulls(&others, &results), hull_arrays(&other, &arrays)),
                });
            }
            self.restore(undo);
        }
        self.sites.open -= 1;
        self.joined -= 1;
        // If no side can be reached, then neither can this branch, and any result is right.
        let any = || inst.results.iter().map(|r| Enclosure::any(self.program.body.kind(*r))).collect();
        let (results, arrays) = joined.unwrap_or_else(|| (any(), before));
        self.arrays = arrays;
        self.set_all(&inst.results, &results);
    }

    /// Whether loops are widened because the walk is long.
    fn is_long(&self) -> bool {
        self.steps <= WIDENING_STEPS
    }

    fn repeat(&mut self, inst: &Inst, repeat: &Repeat<'_>) {
        let mut carried = self.all(repeat.init);
        let mut ends = Ends::default();
        let (mut open, before) = (0, self.sites.open);
        self.joined += 1;
        loop {
            if open > OPEN_ROUNDS || self.steps == 0 || (self.is_long() && open > 0) {
                self.widened(repeat, carried, &mut ends);
                break;
            }
            match self.once(repeat, &carried, &mut ends) {
                None => break,
                Some(next) => carried = next,
            }
            if ends.results.is_some() {
                // Some points have ended, so that nothing is sure of the others.
                open += 1;
                self.sites.open = before + 1;
            }
            if self.is_dead {
                break;
            }
            if self.is_long() {
                // Too long, and perhaps endless.
                open = OPEN_ROUNDS + 1;
            }
        }
        self.sites.open = before;
        self.joined -= 1;
        let any = || inst.results.iter().map(|r| Enclosure::any(self.program.body.kind(*r))).collect();
        let results = ends.results.unwrap_or_else(any);
        if let Some(arrays) = ends.arrays {
            self.arrays = arrays;
        }
        self.set_all(&inst.results, &results);
    }

    /// One round: the points that end here are added to `ends`; the result is the variables of the others,
    /// `None` if there are none.
    fn once(
        &mut self,
        repeat: &Repeat<'_>,
        carried: &[Enclosure],
        ends: &mut Ends,
    ) -> Option<Vec<Enclosure>> {
        // A loop within many others carries the variables of all.
        self.steps = self.steps.saturating_sub(carried.len());
        self.set_all(repeat.params, carried);
        self.block(repeat.body);
        match self.of(repeat.cond).truth().value() {
            Some(true) => return Some(self.all(repeat.next)),
            Some(false) => {
                ends.add(self.all(repeat.next), &self.arrays);
                return None;
            }
            None => {}
        }
        let mut undo = Undo::default();
        if self.assume(repeat.cond, false, &mut undo) {
            ends.add(self.all(repeat.next), &self.arrays);
        }
        self.restore(undo);
        let mut undo = Undo::default();
        let goes_on = self.assume(repeat.cond, true, &mut undo).then(|| self.all(repeat.next));
        self.restore(undo);
        goes_on
    }

    /// All further rounds at once: the variables are widened until a round adds nothing.
    fn widened(&mut self, repeat: &Repeat<'_>, mut carried: Vec<Enclosure>, ends: &mut Ends) {
        self.sites.open += 1;
        for round in 0.. {
            let is_last = round == WIDENED_ROUNDS || self.steps == 0;
            if is_last {
                carried = carried.iter().map(|value| Enclosure::any(value.kind())).collect();
                for (array, slot) in self.arrays.iter_mut().zip(&self.program.body.slots) {
                    array.fill(Enclosure::any(slot.kind));
                }
            }
            let arrays = self.arrays.clone();
            let Some(next) = self.once(repeat, &carried, ends) else { return };
            if is_last || self.is_dead {
                // Nothing is left out.
                return;
            }
            let more = hulls(&carried, &next);
            let more_arrays = hull_arrays(&arrays, &self.arrays);
            if more == carried && more_arrays == arrays {
                return;
            }
            carried = carried.iter().zip(&more).map(|(a, b)| a.widen(b)).collect();
            let widen = |(a, b): (&Vec<Enclosure>, &Vec<Enclosure>)| {
                a.iter().zip(b).map(|(a, b)| a.widen(b)).collect::<Vec<_>>()
            };
            self.arrays = arrays.iter().zip(&more_arrays).map(widen).collect();
        }
    }
}

/// A loop.
struct Repeat<'a> {
    init: &'a [ValueId],
    params: &'a [ValueId],
    body: BlockId,
    cond: ValueId,
    next: &'a [ValueId],
}

/// What the points have that ended.
#[derive(Default)]
struct Ends {
    results: Option<Vec<Enclosure>>,
    arrays: Option<Arrays>,
}

impl Ends {
    fn add(&mut self, results: Vec<Enclosure>, arrays: &Arrays) {
        self.results = Some(match self.results.take() {
            None => results,
            Some(others) => hulls(&others, &results),
        });
        self.arrays = Some(match self.arrays.take() {
            None => arrays.clone(),
            Some(others) => hull_arrays(&others, arrays),
        });
    }
}

fn hulls(a: &[Enclosure], b: &[Enclosure]) -> Vec<Enclosure> {
    a.iter().zip(b).map(|(a, b)| a.hull(b)).collect()
}

fn hull_arrays(a: &Arrays, b: &Arrays) -> Arrays {
    a.iter().zip(b).map(|(a, b)| hulls(a, b)).collect()
}

/// Each number without its sign.
fn magnitudes(value: &Enclosure) -> Enclosure {
    use osl_numeric::Real;
    match value {
        Enclosure::Float(x) => Enclosure::Float(x.abs()),
        Enclosure::Triple(t) => Enclosure::Triple(t.map(Interval::abs)),
        other => other.clone(),
    }
}

/// A number without its whole part is from 0 to 1, which it may reach by rounding.
fn fractions(value: &Enclosure) -> Enclosure {
    let part = |x: Interval| x.clip(0.0, 1.0).or_nan(x.may_be_nan());
    match value {
        Enclosure::Float(x) => Enclosure::Float(part(*x)),
        Enclosure::Triple(t) => Enclosure::Triple(t.map(part)),
        other => other.clone(),
    }
}
