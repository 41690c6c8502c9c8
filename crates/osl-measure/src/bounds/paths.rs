//! Paths: where a tile does not decide a branch, or a whole number has few values, the points of the tile may
//! be walked apart, each case with what holds in it. So values stay together that belong together: the start
//! and the end of the cell that a point is in. A path is a case of each such place, in the order of the walk.
//!
//! Places in loops and in branches whose sides are joined have no cases. This module must not know how tiles
//! are chosen.

use super::assume::Undo;
use super::sites::{Sites, Watched};
use super::walk::{Program, Walk};
use crate::bounds::domain::Tile;
use osl_ir::ir::{LaneOp, ValueId};
use osl_numeric::interval::{Enclosure, Interval, Whole};
use std::sync::Arc;

/// The maximum number of paths of a tile.
const PATHS: usize = 100;
/// The maximum number of elements of an array that are cases.
const ELEMENTS: i32 = 16;
/// Larger floats have no fractions that matter.
const LARGE: f32 = 4_194_304.0;

/// The cases of a path, and those that follow.
#[derive(Debug)]
pub(super) struct Paths {
    /// The case of each place that this path has passed, and the number of its cases.
    cases: Vec<(usize, usize)>,
    /// The number of places that the current walk has passed.
    passed: usize,
    most: usize,
}

impl Paths {
    /// One path, in which no place has cases.
    pub(super) fn joined() -> Paths {
        Paths { cases: Vec::new(), passed: 0, most: 1 }
    }

    /// The case of the next place, which has some; `None` if there would be too many paths. The decision
    /// depends on the cases before, so that it is the same in each walk that has them.
    fn case(&mut self, count: usize) -> Option<usize> {
        if let Some((case, _)) = self.cases.get(self.passed) {
            self.passed += 1;
            return Some(*case);
        }
        // Each path counts as the share of all points that it would have if all cases had the same share.
        let ways: usize = self.cases.iter().map(|(_, count)| *count).product();
        if ways * count > self.most {
            return None;
        }
        self.cases.push((0, count));
        self.passed += 1;
        Some(0)
    }

    /// Goes to the next path; false if this was the last one.
    fn next(&mut self) -> bool {
        self.passed = 0;
        while let Some((case, count)) = self.cases.pop() {
            if case + 1 < count {
                self.cases.push((case + 1, count));
                return true;
            }
        }
        false
    }
}

/// Walks a tile path by path. The result is the hull of the outputs, and what was seen; `None` if no place
/// has cases, or if the walks have to stop.
pub(super) fn apart(
    program: Program<'_>,
    tile: &Tile,
    watched: &Arc<Watched>,
) -> Option<(Vec<Vec<Enclosure>>, Sites)> {
    let mut paths = Paths { most: PATHS, ..Paths::joined() };
    let mut all: Option<(Vec<Vec<Enclosure>>, Sites)> = None;
    loop {
        let mut sites = Sites::new(watched.clone());
        let outputs = Walk::run(program, tile, &mut sites, &mut paths);
        if paths.cases.is_empty() || program.calls.limits.halted().is_some() {
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
