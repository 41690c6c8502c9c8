//! What narrows values. A condition says something of the values that it compares, so that in a branch a
//! guarded operation is seen as guarded. And a place with cases has one of them in a walk: a branch, a number
//! that becomes whole, an index. Places in loops and in branches whose sides are joined have none.

use super::defs::{Def, Defs};
use super::state::{Undo, Walk};
use osl_ir::ir::{Const, LaneOp, ValueId};
use osl_numeric::interval::{Enclosure, Interval, Whole};

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

/// The maximum number of elements of an array that are cases.
const ELEMENTS: i32 = 16;
/// Larger floats have no fractions that matter.
const LARGE: f32 = 4_194_304.0;

impl Walk<'_> {
    /// The case of this path at a place with some cases; `None` if the cases stay joined.
    pub(super) fn case(&mut self, count: usize) -> Option<usize> {
        if self.joined > 0 {
            return None;
        }
        let case = self.paths.case(count)?;
        // Perhaps no point has this case.
        self.sites.open += 1;
        Some(case)
    }

    /// The result of an operation that makes whole numbers: where a number has two values, one for each case.
    /// The argument is narrowed to what gives this value.
    pub(super) fn wholes(&mut self, op: LaneOp, args: &[ValueId], value: Enclosure) -> Enclosure {
        let [arg] = args else { return value };
        match (op, value, self.of(*arg)) {
            (LaneOp::Floor, Enclosure::Float(whole), Enclosure::Float(x)) => {
                let (whole, x) = self.floor(whole, x);
                self.narrow(*arg, Enclosure::Float(x), &mut Undo::default());
                Enclosure::Float(whole)
            }
            (LaneOp::Floor, Enclosure::Triple(wholes), Enclosure::Triple(t)) => {
                let parts: [_; 3] = std::array::from_fn(|i| self.floor(wholes[i], t[i]));
                self.narrow(*arg, Enclosure::Triple(parts.map(|part| part.1)), &mut Undo::default());
                Enclosure::Triple(parts.map(|part| part.0))
            }
            (LaneOp::ToInt, Enclosure::Int(whole), Enclosure::Float(x))
                if whole.hi.checked_sub(whole.lo) == Some(1) =>
            {
                let is_plain = x.is_within(-LARGE, LARGE);
                let Some(case) = is_plain.then(|| self.case(2)).flatten() else {
                    return Enclosure::Int(whole);
                };
                let n = if case == 0 { whole.lo } else { whole.hi };
                let one = n as f32;
                // Truncation moves numbers towards 0.
                let from = if n > 0 { one } else { (one - 1.0).next_up() };
                let to = if n < 0 { one } else { (one + 1.0).next_down() };
                let x = self.within(x, from, to);
                self.narrow(*arg, Enclosure::Float(x), &mut Undo::default());
                Enclosure::Int(Whole::point(n))
            }
            (_, value, _) => value,
        }
    }

    /// One of the two whole numbers below some floats, and the floats that it is below.
    fn floor(&mut self, whole: Interval, x: Interval) -> (Interval, Interval) {
        let has_two = x.is_within(-LARGE, LARGE) && whole.hi() - whole.lo() == 1.0;
        let Some(case) = has_two.then(|| self.case(2)).flatten() else { return (whole, x) };
        let n = if case == 0 { whole.lo() } else { whole.hi() };
        (whole.clip(n, n), self.within(x, n, (n + 1.0).next_down()))
    }

    /// The numbers from `from` to `to`. Without any, no point takes this path.
    fn within(&mut self, x: Interval, from: f32, to: f32) -> Interval {
        let part = x.clip(from, to);
        self.is_dead |= part.is_empty();
        part
    }

    /// Narrows an index to one element for each case.
    pub(super) fn element(&mut self, index: ValueId) {
        let Enclosure::Int(whole) = self.of(index) else { return };
        let Some(count) = whole.hi.checked_sub(whole.lo).filter(|more| (1..ELEMENTS).contains(more)) else {
            return;
        };
        if let Some(case) = self.case(count as usize + 1) {
            self.narrow(index, Enclosure::Int(Whole::point(whole.lo + case as i32)), &mut Undo::default());
        }
    }
}
