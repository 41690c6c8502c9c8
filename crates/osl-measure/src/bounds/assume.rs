//! What a condition says of the values that it compares. In a branch, these values are narrowed, so that a
//! guarded operation is seen as guarded. This module must not know how a body is walked.

use super::walk::Walk;
use osl_ir::ir::{BlockId, Body, Const, LaneOp, Op, ValueId};
use osl_numeric::interval::{Enclosure, Interval, Whole};

/// The instruction that defines a value.
#[derive(Clone, Debug)]
enum Def {
    Const(Const),
    Lane(LaneOp, [Option<ValueId>; 2]),
    /// A result of a branch: the condition, the value from each side, and the number of the branch.
    If(ValueId, [ValueId; 2], usize),
}

/// The definitions of the values of a body.
#[derive(Debug, Default)]
pub(super) struct Defs {
    values: Vec<Option<Def>>,
    /// The results of each branch, with the value from each side.
    branches: Vec<Vec<(ValueId, [ValueId; 2])>>,
}

impl Defs {
    pub(super) fn of(body: &Body) -> Defs {
        let mut defs = Defs { values: vec![None; body.values.len()], branches: Vec::new() };
        for block in 0..body.blocks.len() {
            for inst in &body.block(BlockId(block as u32)).insts {
                match &inst.op {
                    Op::Const(value) => defs.put(inst.results.first(), Def::Const(value.clone())),
                    Op::Lane(op, args) => {
                        let args = [args.first().copied(), args.get(1).copied()];
                        defs.put(inst.results.first(), Def::Lane(*op, args));
                    }
                    Op::If { cond, then_yields, else_yields, .. } => {
                        let mut branch = Vec::new();
                        for (result, sides) in inst.results.iter().zip(then_yields.iter().zip(else_yields)) {
                            let sides = [*sides.0, *sides.1];
                            defs.put(Some(result), Def::If(*cond, sides, defs.branches.len()));
                            branch.push((*result, sides));
                        }
                        defs.branches.push(branch);
                    }
                    _ => {}
                }
            }
        }
        defs
    }

    fn put(&mut self, value: Option<&ValueId>, def: Def) {
        if let Some(place) = value.and_then(|value| self.values.get_mut(value.index())) {
            *place = Some(def);
        }
    }

    fn get(&self, value: ValueId) -> Option<&Def> {
        self.values.get(value.index())?.as_ref()
    }

    /// The constant of the program that a value is.
    pub(super) fn constant(&self, value: ValueId) -> Option<&Const> {
        match self.get(value) {
            Some(Def::Const(constant)) => Some(constant),
            _ => None,
        }
    }

    /// Whether a value is the floor of another one.
    pub(super) fn is_floor_of(&self, whole: ValueId, x: ValueId) -> bool {
        matches!(self.get(whole), Some(Def::Lane(LaneOp::Floor, [Some(of), _])) if *of == x)
    }
}

/// The values before they were narrowed, the last one first to be restored.
#[derive(Default)]
pub(super) struct Undo(Vec<(ValueId, Option<Enclosure>)>);

/// Conditions within conditions that are followed.
const DEPTH: usize = 12;

/// A comparison that holds.
#[derive(Clone, Copy, PartialEq)]
enum Relation {
    Less,
    LessOrEqual,
    Equal,
    NotEqual,
}

/// The relation that a comparison of floats or ints states if it has this truth, and whether the operands
/// change places.
fn relation(op: LaneOp, truth: bool) -> Option<(Relation, bool)> {
    use Relation::{Equal, Less, LessOrEqual, NotEqual};
    Some(match (op, truth) {
        (LaneOp::FLt | LaneOp::ILt, true) | (LaneOp::FGe | LaneOp::IGe, false) => (Less, false),
        (LaneOp::FGt | LaneOp::IGt, true) | (LaneOp::FLe | LaneOp::ILe, false) => (Less, true),
        (LaneOp::FLe | LaneOp::ILe, true) | (LaneOp::FGt | LaneOp::IGt, false) => (LessOrEqual, false),
        (LaneOp::FGe | LaneOp::IGe, true) | (LaneOp::FLt | LaneOp::ILt, false) => (LessOrEqual, true),
        (LaneOp::FEq | LaneOp::IEq, true) | (LaneOp::FNe | LaneOp::INe, false) => (Equal, false),
        (LaneOp::FEq | LaneOp::IEq, false) | (LaneOp::FNe | LaneOp::INe, true) => (NotEqual, false),
        _ => return None,
    })
}

impl Walk<'_> {
    /// Narrows values by a condition; false if it cannot have this truth.
    pub(super) fn assume(&mut self, cond: ValueId, truth: bool, undo: &mut Undo) -> bool {
        self.assume_within(cond, truth, undo, DEPTH)
    }

    /// Takes back what was assumed.
    pub(super) fn restore(&mut self, undo: Undo) {
        for (value, before) in undo.0.into_iter().rev() {
            if let Some(place) = self.values.get_mut(value.index()) {
                *place = before;
            }
        }
    }

    fn assume_within(&mut self, cond: ValueId, truth: bool, undo: &mut Undo, depth: usize) -> bool {
        let known = self.of(cond).truth();
        if !(if truth { known.yes } else { known.no }) {
            return false;
        }
        let Some(depth) = depth.checked_sub(1) else { return true };
        let program = self.program;
        match program.defs.get(cond) {
            Some(Def::Lane(op, [Some(a), Some(b)])) => {
                let (op, a, b) = (*op, *a, *b);
                let is_zero = |defs: &Defs, value| matches!(defs.get(value), Some(Def::Const(Const::Int(0))));
                match op {
                    // A truth value compared with 0.
                    LaneOp::INe | LaneOp::IEq if is_zero(program.defs, b) => {
                        let inner = truth == (op == LaneOp::INe);
                        self.compare(op, a, b, truth, undo) && self.assume_within(a, inner, undo, depth)
                    }
                    LaneOp::IAnd if truth => {
                        self.assume_within(a, true, undo, depth) && self.assume_within(b, true, undo, depth)
                    }
                    LaneOp::IOr if !truth => {
                        self.assume_within(a, false, undo, depth) && self.assume_within(b, false, undo, depth)
                    }
                    _ => self.compare(op, a, b, truth, undo),
                }
            }
            Some(Def::If(test, sides, branch)) => {
                let (test, sides, branch) = (*test, *sides, *branch);
                let may = |walk: &Walk<'_>, side: usize| {
                    let taken = walk.of(test).truth();
                    let truth_there = walk.of(sides[side]).truth();
                    (if side == 0 { taken.yes } else { taken.no })
                        && (if truth { truth_there.yes } else { truth_there.no })
                };
                match (may(self, 0), may(self, 1)) {
                    (false, false) => false,
                    (true, true) => true,
                    (first, _) => {
                        let side = usize::from(!first);
                        let is_possible = self.assume_within(test, first, undo, depth)
                            && self.assume_within(sides[side], truth, undo, depth);
                        // All results of the branch come from this side.
                        for (result, from) in program.defs.branches.get(branch).into_iter().flatten() {
                            let value = self.of(from[side]);
                            self.narrow(*result, value, undo);
                        }
                        is_possible
                    }
                }
            }
            _ => true,
        }
    }

    pub(super) fn narrow(&mut self, value: ValueId, to: Enclosure, undo: &mut Undo) {
        if let Some(place) = self.values.get_mut(value.index()) {
            undo.0.push((value, place.replace(to)));
        }
    }

    /// Narrows the operands of a comparison.
    fn compare(&mut self, op: LaneOp, a: ValueId, b: ValueId, truth: bool, undo: &mut Undo) -> bool {
        let Some((relation, swapped)) = relation(op, truth) else { return true };
        let (a, b) = if swapped { (b, a) } else { (a, b) };
        match (self.of(a), self.of(b)) {
            (Enclosure::Float(x), Enclosure::Float(y)) => {
                let [mut left, mut right] = floats(relation, x, y);
                // All comparisons of the language are true if an operand is NaN. Then the other operand may
                // be anything.
                if truth {
                    left = left.or_nan(x.may_be_nan());
                    right = right.or_nan(y.may_be_nan());
                    if y.may_be_nan() {
                        left = x;
                    }
                    if x.may_be_nan() {
                        right = y;
                    }
                }
                let is_possible = |x: Interval| !x.is_empty() || x.may_be_nan();
                self.narrow(a, Enclosure::Float(left), undo);
                self.narrow(b, Enclosure::Float(right), undo);
                is_possible(left) && is_possible(right)
            }
            (Enclosure::Int(x), Enclosure::Int(y)) => {
                let [left, right] = ints(relation, x, y);
                self.narrow(a, Enclosure::Int(left), undo);
                self.narrow(b, Enclosure::Int(right), undo);
                !left.is_empty() && !right.is_empty()
            }
            _ => true,
        }
    }
}

/// The numbers of two intervals for which a relation can hold.
fn floats(relation: Relation, x: Interval, y: Interval) -> [Interval; 2] {
    let (least, most) = (f32::NEG_INFINITY, f32::INFINITY);
    if x.is_empty() || y.is_empty() {
        return [Interval::NONE; 2];
    }
    match relation {
        Relation::Less => [x.clip(least, y.hi().next_down()), y.clip(x.lo().next_up(), most)],
        Relation::LessOrEqual => [x.clip(least, y.hi()), y.clip(x.lo(), most)],
        Relation::Equal => [x.clip(y.lo(), y.hi()), y.clip(x.lo(), x.hi())],
        Relation::NotEqual => [without(x, y), without(y, x)],
    }
}

/// An interval without the only number of another one, if it is at an end.
fn without(x: Interval, y: Interval) -> Interval {
    if y.lo() != y.hi() {
        return x.numbers();
    }
    let lo = if x.lo() == y.lo() { x.lo().next_up() } else { x.lo() };
    let hi = if x.hi() == y.lo() { x.hi().next_down() } else { x.hi() };
    if lo > hi { Interval::NONE } else { x.numbers().meet(Interval::new(lo, hi)) }
}

fn ints(relation: Relation, x: Whole, y: Whole) -> [Whole; 2] {
    let below = |hi: i32| Whole { lo: i32::MIN, hi };
    let above = |lo: i32| Whole { lo, hi: i32::MAX };
    match relation {
        Relation::Less => match (y.hi.checked_sub(1), x.lo.checked_add(1)) {
            (Some(hi), Some(lo)) => [x.meet(below(hi)), y.meet(above(lo))],
            _ => [Whole::NONE; 2],
        },
        Relation::LessOrEqual => [x.meet(below(y.hi)), y.meet(above(x.lo))],
        Relation::Equal => [x.meet(y); 2],
        Relation::NotEqual => {
            let without = |x: Whole, y: Whole| match y.value() {
                Some(one) if x.value() == Some(one) => Whole::NONE,
                Some(one) if x.lo == one => Whole { lo: one + 1, ..x },
                Some(one) if x.hi == one => Whole { hi: one - 1, ..x },
                _ => x,
            };
            [without(x, y), without(y, x)]
        }
    }
}
