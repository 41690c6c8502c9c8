//! Widens steps by the footprint of a point, so that one sample shows the mean over the footprint instead of
//! either side.
//!
//! `step`, `smoothstep` and `linearstep`, choices by comparison, and comparisons used as numbers become means
//! over an interval. Its width is the change of their argument over the footprint: a box with the variance
//! that the argument has over a pixel, which is the root of the sum of its squared derivatives. Noise fades
//! to its mean as the footprint approaches the size of its features. This is the only pass that changes
//! values, so it runs only on request.
//!
//! The mean of a sum is the sum of the means, but this does not hold for values that go through another step
//! or select a cell. So only values that reach the outputs through smooth functions, sums and choices are
//! widened: the cells of a pattern stay in place. The mean of a straight edge is exact. It is wrong where the
//! footprint contains a fold, a second edge, or more waves than the derivatives at its centre show. The
//! caller scales the footprint to the area of a sample.
//!
//! Sources: Norton, Rockwood and Skolmoski 1982 (clamping); Apodaca and Gritz, Advanced RenderMan, 1999,
//! chapter 11.

mod gentle;

use super::rewrite::{Code, Rewrite};
use crate::ir::{Axis, BlockId, Body, Const, Inst, Kernel, Kind, LaneOp, NoiseField, Op, ValueId};
use rustc_hash::FxHashMap;
use smallvec::smallvec;

/// What the pass needs to know.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Prefilter {
    /// The factor on the footprint of a pixel: one over the root of the number of samples of a pixel.
    pub scale: f32,
}

/// Runs the pass before derivatives are written. Returns the number of operations that it widened.
pub(super) fn run(body: &mut Body, wanted: Prefilter) -> usize {
    let gentle = gentle::find(body);
    let mut writer = Writer {
        code: Code::new(body),
        gentle,
        scale: wanted.scale,
        widened: 0,
        shares: FxHashMap::default(),
        zeros: FxHashMap::default(),
    };
    writer.block(writer.code.body.entry);
    let widened = writer.widened;
    writer.code.finish();
    widened
}

/// Maximum number of operations of both sides of a branch that is always computed.
const MAX_OPERATIONS: usize = 64;
/// The footprint, in units of the coordinates, at which a noise has faded completely; it fades from 0 on.
/// Measured: with these values, the faded noise is closest to its mean over squares of 0.1 to 1.7 units, to
/// within a few hundredths of its size.
const PERLIN_GONE: f32 = 2.0;
/// The same for simplex noise.
const SIMPLEX_GONE: f32 = 1.35;

struct Writer<'a> {
    code: Code<'a>,
    /// Values that reach the outputs through smooth functions only.
    gentle: Vec<bool>,
    scale: f32,
    /// The number of operations that were widened.
    widened: usize,
    /// For truth values, the share of the footprint in which they are true.
    shares: FxHashMap<ValueId, ValueId>,
    /// Int constants that are 0 or 1.
    zeros: FxHashMap<ValueId, bool>,
}

impl<'a> Rewrite<'a> for Writer<'a> {
    fn code(&mut self) -> &mut Code<'a> {
        &mut self.code
    }

    fn inst(&mut self, mut inst: Inst) {
        inst.op.replace_uses(|v| self.code.renaming.get(v));
        match &inst.op {
            Op::Const(Const::Int(n @ (0 | 1))) => {
                inst.results.iter().for_each(|r| {
                    self.zeros.insert(*r, *n == 0);
                });
                self.keep(inst);
            }
            Op::If { .. } => self.branch(inst),
            Op::Loop { body, .. } => {
                self.block(*body);
                // Values of the iteration may have been replaced.
                inst.op.replace_uses(|v| self.code.renaming.get(v));
                self.keep(inst);
            }
            Op::Lane(op, args) => {
                let (op, args, results) = (*op, args.clone(), inst.results.clone());
                self.keep(inst);
                if let [result] = results[..] {
                    self.widen(op, &args, result);
                }
            }
            Op::Kernel(Kernel::Noise { field, has_derivs: false, .. }, _) if self.worth(&inst.results) => {
                let field = *field;
                self.noise(inst, field);
            }
            _ => self.keep(inst),
        }
    }
}

impl Writer<'_> {
    fn is_gentle(&self, v: ValueId) -> bool {
        self.gentle.get(v.index()).copied().unwrap_or(false)
    }

    /// Whether all results are numbers that reach the outputs smoothly.
    fn worth(&self, results: &[ValueId]) -> bool {
        let smooth =
            |v: &ValueId| matches!(self.code.body.kind(*v), Kind::Float | Kind::Triple) && self.is_gentle(*v);
        !results.is_empty() && results.iter().all(smooth)
    }

    /// Writes the widened form of an operation after it.
    fn widen(&mut self, op: LaneOp, args: &[ValueId], result: ValueId) {
        use LaneOp as L;
        let worth = self.worth(&[result]);
        let new = match (op, args) {
            (L::FLt | L::FLe, [a, b]) => return self.compare(*b, *a, result),
            (L::FGt | L::FGe, [a, b]) => return self.compare(*a, *b, result),
            (L::INe | L::IEq | L::IAnd | L::IOr | L::IChoose, _) => return self.logic(op, args, result),
            (L::ToFloat, [truth]) if worth => self.shares.get(truth).copied(),
            (L::Choose, [truth, a, b]) if worth => {
                self.shares.get(truth).copied().map(|share| self.blend(share, *a, *b))
            }
            (L::Step, [edge, x]) if worth => {
                let above = self.lane(L::FSub, &[*x, *edge]);
                let width = self.footprint(above);
                Some(self.ramp(above, width, result))
            }
            (L::Smoothstep | L::Linearstep, [low, high, x]) if worth => {
                Some(self.soft(op == L::Smoothstep, [*low, *high, *x], result))
            }
            _ => None,
        };
        if let Some(new) = new {
            self.widened += 1;
            self.code.renaming.set(result, new);
        }
    }

    /// The change of a value over the footprint, per component.
    fn footprint(&mut self, of: ValueId) -> ValueId {
        let kind = self.code.body.kind(of);
        let [dx, dy] = Axis::BOTH.map(|axis| {
            let d = self.push(Op::Derivative(of, axis), kind);
            self.lane(LaneOp::FMul, &[d, d])
        });
        let sum = self.lane(LaneOp::FAdd, &[dx, dy]);
        let width = self.lane(LaneOp::Sqrt, &[sum]);
        let scale = self.float(self.scale);
        self.lane(LaneOp::FMul, &[width, scale])
    }

    /// The share of an interval around `above` that is positive; `hard` if the interval has no width.
    fn ramp(&mut self, above: ValueId, width: ValueId, hard: ValueId) -> ValueId {
        use LaneOp as L;
        let [zero, half, one] = [0.0, 0.5, 1.0].map(|x| self.float(x));
        let share = self.lane(L::FDiv, &[above, width]);
        let share = self.lane(L::FAdd, &[share, half]);
        let share = self.lane(L::Clamp, &[share, zero, one]);
        self.lane(L::Select, &[hard, share, width])
    }

    /// Records the share of the footprint in which `a` is above `b`.
    fn compare(&mut self, a: ValueId, b: ValueId, result: ValueId) {
        let above = self.lane(LaneOp::FSub, &[a, b]);
        let width = self.footprint(above);
        let hard = self.lane(LaneOp::ToFloat, &[result]);
        let share = self.ramp(above, width, hard);
        self.shares.insert(result, share);
    }

    /// Shares of truth values that are computed from others, as if these were independent.
    fn logic(&mut self, op: LaneOp, args: &[ValueId], result: ValueId) {
        use LaneOp as L;
        let share = match (op, args) {
            (L::INe | L::IEq, [a, b]) => {
                let (of, zero) = if self.zeros.contains_key(b) { (a, b) } else { (b, a) };
                let (Some(share), Some(is_zero)) =
                    (self.shares.get(of).copied(), self.zeros.get(zero).copied())
                else {
                    return;
                };
                if is_zero == (op == L::INe) { share } else { self.rest(share) }
            }
            (L::IAnd, [a, b]) => match (self.share(*a), self.share(*b)) {
                (Some(a), Some(b)) => self.lane(L::FMul, &[a, b]),
                _ => return,
            },
            (L::IOr, [a, b]) => match (self.share(*a), self.share(*b)) {
                (Some(a), Some(b)) => {
                    let (a, b) = (self.rest(a), self.rest(b));
                    let neither = self.lane(L::FMul, &[a, b]);
                    self.rest(neither)
                }
                _ => return,
            },
            (L::IChoose, [truth, a, b]) => {
                // If the condition itself is a choice, as in && and ||, its value is known on that side.
                let (a, b) = (self.side(*truth, *a, 1.0), self.side(*truth, *b, 0.0));
                match (self.shares.get(truth).copied(), a, b) {
                    (Some(t), Some(a), Some(b)) => self.lane(L::Mix, &[b, a, t]),
                    _ => return,
                }
            }
            _ => return,
        };
        self.shares.insert(result, share);
    }

    /// The share of a truth value, which may be a constant.
    fn share(&mut self, v: ValueId) -> Option<ValueId> {
        if let Some(is_zero) = self.zeros.get(&v).copied() {
            return Some(self.float(if is_zero { 0.0 } else { 1.0 }));
        }
        self.shares.get(&v).copied()
    }

    /// The share of a truth value if another is known.
    fn side(&mut self, known: ValueId, v: ValueId, share: f32) -> Option<ValueId> {
        if known == v { Some(self.float(share)) } else { self.share(v) }
    }

    fn rest(&mut self, share: ValueId) -> ValueId {
        let one = self.float(1.0);
        self.lane(LaneOp::FSub, &[one, share])
    }

    /// `a` and `b` blended by the share of `a`. If that is 0 or 1, the unused value does not count, even if
    /// it is NaN.
    fn blend(&mut self, share: ValueId, a: ValueId, b: ValueId) -> ValueId {
        use LaneOp as L;
        let [zero, one] = [0.0, 1.0].map(|x| self.float(x));
        let mixed = self.lane(L::Mix, &[b, a, share]);
        let (all, some) = (self.lane(L::FGe, &[share, one]), self.lane(L::FGt, &[share, zero]));
        let not_all = self.lane(L::Choose, &[some, mixed, b]);
        self.lane(L::Choose, &[all, a, not_all])
    }

    /// The mean of a smooth step over the footprint: the difference of its integral at both ends, divided by
    /// the width. `hard` if the footprint is so small that the difference would be mostly rounding error, or
    /// if the edges are reversed.
    fn soft(&mut self, cubic: bool, [low, high, x]: [ValueId; 3], hard: ValueId) -> ValueId {
        use LaneOp as L;
        let above = self.lane(L::FSub, &[x, low]);
        let wide = self.lane(L::FSub, &[high, low]);
        let t = self.lane(L::FDiv, &[above, wide]);
        let width = self.footprint(above);
        let width = self.lane(L::FDiv, &[width, wide]);
        let half = self.float(0.5);
        let reach = self.lane(L::FMul, &[width, half]);
        let (from, to) = (self.lane(L::FSub, &[t, reach]), self.lane(L::FAdd, &[t, reach]));
        let (from, to) = (self.integral(cubic, from), self.integral(cubic, to));
        let gained = self.lane(L::FSub, &[to, from]);
        let mean = self.lane(L::FDiv, &[gained, width]);
        let narrow = self.float(NARROW);
        let large = self.lane(L::Step, &[narrow, width]);
        let soft = self.lane(L::Select, &[hard, mean, large]);
        // Equal edges make a step.
        let ramp_width = self.footprint(above);
        let ramp = self.ramp(above, ramp_width, hard);
        self.lane(L::Select, &[ramp, soft, wide])
    }

    /// The integral up to `t` of a step from 0 at 0 to 1 at 1: `t³ - t⁴/2` for the cubic one, `t²/2` for the
    /// linear one, and `t - 1/2` beyond 1.
    fn integral(&mut self, cubic: bool, t: ValueId) -> ValueId {
        use LaneOp as L;
        let [zero, half, one] = [0.0, 0.5, 1.0].map(|x| self.float(x));
        let inside = self.lane(L::Clamp, &[t, zero, one]);
        let square = self.lane(L::FMul, &[inside, inside]);
        let curve = if cubic {
            let halved = self.lane(L::FMul, &[inside, half]);
            let rest = self.lane(L::FSub, &[one, halved]);
            let cube = self.lane(L::FMul, &[square, inside]);
            self.lane(L::FMul, &[cube, rest])
        } else {
            self.lane(L::FMul, &[square, half])
        };
        let beyond = self.lane(L::FSub, &[t, one]);
        let beyond = self.lane(L::Max, &[beyond, zero]);
        self.lane(L::FAdd, &[curve, beyond])
    }

    /// Fades a noise to its mean.
    fn noise(&mut self, inst: Inst, field: NoiseField) {
        let Op::Kernel(kernel, args) = &inst.op else { return };
        let (mean, gone) = match field {
            NoiseField::Perlin => (0.0, PERLIN_GONE),
            NoiseField::UPerlin => (0.5, PERLIN_GONE),
            NoiseField::Simplex => (0.0, SIMPLEX_GONE),
            NoiseField::USimplex => (0.5, SIMPLEX_GONE),
            NoiseField::Cell | NoiseField::Hash => return self.keep(inst),
        };
        self.widened += 1;
        let coordinates: Vec<ValueId> = args.get(kernel.coordinates()).unwrap_or(&[]).to_vec();
        let results = inst.results.clone();
        self.keep(inst);
        let [dx, dy] = Axis::BOTH.map(|axis| self.change(&coordinates, axis));
        let width = self.lane(LaneOp::Max, &[dx, dy]);
        let scale = self.float(self.scale);
        let width = self.lane(LaneOp::FMul, &[width, scale]);
        let [from, to, mean] = [0.0, gone, mean].map(|x| self.float(x));
        let faded = self.lane(LaneOp::Smoothstep, &[from, to, width]);
        for result in results {
            let new = self.lane(LaneOp::Mix, &[result, mean, faded]);
            self.code.renaming.set(result, new);
        }
    }

    /// The change of coordinates along an axis.
    fn change(&mut self, coordinates: &[ValueId], axis: Axis) -> ValueId {
        let mut sum = None;
        for of in coordinates {
            let kind = self.code.body.kind(*of);
            let d = self.push(Op::Derivative(*of, axis), kind);
            let op = if kind == Kind::Triple { LaneOp::Dot } else { LaneOp::FMul };
            let square = self.lane(op, &[d, d]);
            sum = Some(match sum {
                None => square,
                Some(sum) => self.lane(LaneOp::FAdd, &[sum, square]),
            });
        }
        let sum = sum.unwrap_or_else(|| self.float(0.0));
        self.lane(LaneOp::Sqrt, &[sum])
    }

    /// A branch by comparison with short sides: both are computed and blended.
    fn branch(&mut self, mut inst: Inst) {
        let Op::If { cond, then, otherwise, .. } = inst.op else { return };
        self.block(then);
        self.block(otherwise);
        inst.op.replace_uses(|v| self.code.renaming.get(v));
        let short = self.operations(then).zip(self.operations(otherwise));
        let Op::If { then_yields, else_yields, .. } = &inst.op else { return };
        let wanted = self.shares.contains_key(&cond)
            && short.is_some_and(|(a, b)| a + b <= MAX_OPERATIONS)
            && inst.results.iter().any(|r| self.worth(&[*r]) || self.code.body.kind(*r) == Kind::Int);
        if !wanted {
            return self.keep(inst);
        }
        // However many results a branch has, it counts once.
        let widened = self.widened + 1;
        for side in [then, otherwise] {
            let mut insts = std::mem::take(&mut self.code.body.blocks[side.index()].insts);
            self.code.out.append(&mut insts);
        }
        for ((result, a), b) in inst.results.iter().zip(then_yields).zip(else_yields) {
            let op = crate::ir::choose_op(self.code.body.kind(*a));
            let args = smallvec![cond, *a, *b];
            self.keep(Inst { op: Op::Lane(op, args.clone()), results: smallvec![*result], span: inst.span });
            self.widen(op, &args, *result);
        }
        self.widened = widened;
    }

    /// Number of operations of a block without effects, jumps and arrays.
    fn operations(&self, id: BlockId) -> Option<usize> {
        let mut count = 0;
        for inst in &self.code.body.block(id).insts {
            count += match &inst.op {
                Op::Const(_) | Op::Global(_) | Op::Input(_) | Op::GlobalDeriv(..) => 0,
                Op::Lane(..) | Op::Derivative(..) => 1,
                Op::Kernel(Kernel::Noise { .. }, _) => 8,
                _ => return None,
            };
        }
        Some(count)
    }
}

/// Soft steps stay unchanged for footprints below this share of the distance of their edges. The error is
/// then at most an eighth of its square, less than the rounding error of the difference.
const NARROW: f32 = 0.02;
