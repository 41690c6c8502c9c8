//! Rewrites that save work and keep every bit: the minimum of two numbers without a condition, normals
//! transformed by a matrix that all points share, and comparisons of distances by their squares.
//!
//! The square root is correctly rounded, so it is monotonic. Hence the minimum of two roots is the root of
//! the minimum, and a root is below a number exactly if its argument is below a threshold. Only distances
//! without other uses are rewritten, such as those of a search for the nearest point. Needs the rates.

use super::rewrite::{Code, Rewrite};
use crate::ir::{BlockId, Body, Const, Inst, LaneOp, Op, Rate, Source, ValueId};
use rustc_hash::FxHashMap;
use smallvec::smallvec;

/// Runs the pass.
pub(super) fn run(body: &mut Body) {
    let mut changed = false;
    each_block(body, &mut |body, id| changed |= lowers(body, id));
    normals(body);
    let distances = body.insts().any(|inst| matches!(inst.op, Op::Lane(LaneOp::Distance, _)));
    if changed || distances {
        super::dce::run(body);
    }
    if !distances {
        return;
    }
    let found = RootFacts::of(body);
    let mut blocks = Vec::new();
    each_block(body, &mut |_, id| blocks.push(id));
    let mut roots = Roots { code: Code::with_rates(body), found, squares: FxHashMap::default() };
    blocks.into_iter().for_each(|id| roots.block(id));
    if !roots.squares.is_empty() {
        super::dce::run(body);
    }
}

/// Calls `rewrite` with each reachable block, outer ones first.
fn each_block(body: &mut Body, rewrite: &mut dyn FnMut(&mut Body, BlockId)) {
    let mut work = vec![body.entry];
    while let Some(id) = work.pop() {
        rewrite(body, id);
        work.extend(body.block(id).insts.iter().flat_map(|inst| inst.op.blocks()));
    }
}

/// Rewrites choices between the two numbers that their condition compares. Returns whether there were any.
fn lowers(body: &mut Body, id: BlockId) -> bool {
    let mut changed = false;
    let mut compared: FxHashMap<ValueId, (LaneOp, ValueId, ValueId)> = FxHashMap::default();
    for inst in &mut body.blocks[id.index()].insts {
        let Op::Lane(op, args) = &mut inst.op else { continue };
        match (*op, &args[..]) {
            (LaneOp::FLt | LaneOp::FGt, [a, b]) => {
                inst.results.iter().for_each(|r| {
                    compared.insert(*r, (*op, *a, *b));
                });
            }
            (LaneOp::Choose, [cond, a, b]) => {
                let rewritten = match compared.get(cond) {
                    Some((LaneOp::FLt, x, y)) if (x, y) == (a, b) => LaneOp::Lower,
                    Some((LaneOp::FGt, x, y)) if (x, y) == (a, b) => LaneOp::Max,
                    _ => continue,
                };
                *args = smallvec![*a, *b];
                *op = rewritten;
                changed = true;
            }
            _ => {}
        }
    }
    changed
}

/// Computes the matrix for normals once if all points share the matrix for points.
fn normals(body: &mut Body) {
    let is_shared = |body: &Body, inst: &Inst| match (&inst.op, &inst.results[..]) {
        (Op::Lane(LaneOp::TransformNormal, args), [result]) => {
            let is_uniform = |v: ValueId| body.value(v).rate == Rate::Uniform;
            args.first().is_some_and(|m| is_uniform(*m)) && !is_uniform(*result)
        }
        _ => false,
    };
    let mut blocks = Vec::new();
    each_block(body, &mut |body, id| {
        if body.block(id).insts.iter().any(|inst| is_shared(body, inst)) {
            blocks.push(id);
        }
    });
    let mut normals = Normals { code: Code::with_rates(body), is_shared };
    blocks.into_iter().for_each(|id| normals.block(id));
}

/// Writes the transformation by the matrix for normals in place of that of normals.
struct Normals<'a, F> {
    code: Code<'a>,
    is_shared: F,
}

impl<'a, F: Fn(&Body, &Inst) -> bool> Rewrite<'a> for Normals<'a, F> {
    fn code(&mut self) -> &mut Code<'a> {
        &mut self.code
    }

    fn inst(&mut self, mut inst: Inst) {
        if (self.is_shared)(self.code.body, &inst)
            && let Op::Lane(_, args) = &inst.op
            && let [m, n] = args[..]
        {
            let inverse = self.lane(LaneOp::MInverse, &[m]);
            let matrix = self.lane(LaneOp::MTranspose, &[inverse]);
            inst.op = Op::Lane(LaneOp::TransformVector, smallvec![matrix, n]);
        }
        self.keep(inst);
    }
}

/// What the rewriting of roots must know of the whole body.
struct RootFacts {
    constants: FxHashMap<ValueId, f32>,
    /// Roots that are only compared, or used in a minimum.
    ordered: Vec<bool>,
}

/// Writes squares in place of roots.
struct Roots<'a> {
    code: Code<'a>,
    found: RootFacts,
    /// Values that are roots, with their arguments.
    squares: FxHashMap<ValueId, ValueId>,
}

impl<'a> Rewrite<'a> for Roots<'a> {
    fn code(&mut self) -> &mut Code<'a> {
        &mut self.code
    }

    fn inst(&mut self, mut inst: Inst) {
        if let (Op::Lane(op, args), [result]) = (&inst.op, &inst.results[..]) {
            match (*op, &args[..]) {
                (LaneOp::Distance, args) if self.found.ordered.get(result.index()) == Some(&true) => {
                    let square = self.lane(LaneOp::SquareDistance, args);
                    self.squares.insert(*result, square);
                }
                (LaneOp::Lower, [a, b]) => {
                    if let Some((a, b)) = self.square(*a).zip(self.square(*b)) {
                        let square = self.lane(LaneOp::Lower, &[a, b]);
                        self.squares.insert(*result, square);
                        inst.op = Op::Lane(LaneOp::Root, smallvec![square]);
                    }
                }
                (LaneOp::FLt | LaneOp::FLe | LaneOp::FGt | LaneOp::FGe, [a, b]) => {
                    if let Some(op) = self.compare(*op, *a, *b) {
                        inst.op = op;
                    }
                }
                _ => {}
            }
        }
        self.keep(inst);
    }
}

impl RootFacts {
    fn of(body: &mut Body) -> RootFacts {
        let mut constants = FxHashMap::default();
        each_block(body, &mut |body, id| {
            for inst in &body.block(id).insts {
                if let (Op::Const(Const::Float(x)), [r]) = (&inst.op, &inst.results[..]) {
                    constants.insert(*r, *x);
                }
            }
        });
        let mut ordered = vec![true; body.values.len()];
        let mut other = |v: ValueId| ordered[v.index()] = false;
        each_block(body, &mut |body, id| {
            for inst in &body.block(id).insts {
                match &inst.op {
                    Op::Lane(LaneOp::Lower, _) => {}
                    Op::Lane(LaneOp::FLt | LaneOp::FLe | LaneOp::FGt | LaneOp::FGe, args)
                        if args.iter().any(|a| constants.get(a).is_some_and(|c| has_threshold(*c))) => {}
                    op => op.for_each_use(&mut other),
                }
            }
        });
        for output in &body.outputs {
            if let Source::Value(v) = output.source {
                other(v);
            }
        }
        RootFacts { constants, ordered }
    }
}

impl Roots<'_> {
    /// The argument of a root.
    fn square(&mut self, v: ValueId) -> Option<ValueId> {
        if let Some(square) = self.squares.get(&v) {
            return Some(*square);
        }
        let c = *self.found.constants.get(&v)?;
        (c > 0.0 && (c * c).sqrt() == c).then(|| self.float(c * c))
    }

    /// A comparison of a root with a constant, as a comparison of its square.
    fn compare(&mut self, op: LaneOp, a: ValueId, b: ValueId) -> Option<Op> {
        use LaneOp::{FGe, FGt, FLe, FLt};
        let (op, x, c) = match (self.squares.get(&a), self.squares.get(&b)) {
            (Some(x), None) => (op, *x, *self.found.constants.get(&b)?),
            (None, Some(x)) => {
                let turned = match op {
                    FLt => FGt,
                    FLe => FGe,
                    FGt => FLt,
                    _ => FLe,
                };
                (turned, *x, *self.found.constants.get(&a)?)
            }
            _ => return None,
        };
        if !has_threshold(c) {
            return None;
        }
        let limit = if matches!(op, FLt | FGe) {
            least_with_root_of(c)
        } else {
            least_with_root_of(c.next_up()).next_down()
        };
        let limit = self.float(limit);
        Some(Op::Lane(op, smallvec![x, limit]))
    }
}

/// Whether a number is the root of numbers that are neither tiny nor huge.
fn has_threshold(c: f32) -> bool {
    (1e-15..1e15).contains(&c)
}

/// The smallest number whose root is not below `c`.
fn least_with_root_of(c: f32) -> f32 {
    let mut x = c * c;
    while x.sqrt() >= c {
        x = x.next_down();
    }
    while x.sqrt() < c {
        x = x.next_up();
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_divide_roots_exactly() {
        let mut c = 1.1e-15_f32;
        while has_threshold(c) {
            let limit = least_with_root_of(c);
            assert!(limit.sqrt() >= c && limit.next_down().sqrt() < c, "{c:e}");
            c *= 1.000_37;
        }
    }
}
