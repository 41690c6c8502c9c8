//! The places of a walk that have cases, and what holds in each case: a branch, a number that becomes whole,
//! an index. Places in loops and in branches whose sides are joined have none.

use super::state::{Undo, Walk};
use osl_ir::ir::{LaneOp, ValueId};
use osl_numeric::interval::{Enclosure, Interval, Whole};

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
