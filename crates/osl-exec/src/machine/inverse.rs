//! Inverse splines: the search for the positions of many points in one curve.
//!
//! If all points share the basis and the knots, the polynomials are prepared once, and sixteen searches
//! advance together: each takes exactly the steps that it would take alone. This module must not know the
//! steps, see [`osl_numeric::spline`].

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::program::{KernelStep, Operand};
use osl_lanes::Arg;
use osl_lanes::Element;
use osl_numeric::basis;
use osl_numeric::spline::{Bracket, Curve, Start};
use osl_numeric::{Number, Scalar};
use osl_simd::Kernel;

/// Steps for a knot that an inverse spline searches.
const KNOT: u64 = 4;
/// Number of searches that advance together.
const TOGETHER: usize = 16;

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn spline_inverse(&mut self, knots: u32, step: &KernelStep, mask: &Mask) {
        let Some((out, derivs)) = step.outs.split_first() else { return };
        let Some(plan) = self.program.arrays.get(knots as usize).copied() else { return };
        let len = plan.len as usize;
        let [name, y, count, changes @ ..] = &step.args[..] else { return };
        let is_single = |operand: &Operand| matches!(self.arg(*operand), Arg::Same(_));
        let is_shared = !plan.varying && is_single(name) && is_single(count);
        let mut list = vec![A::Real::lit(0.0); len];
        let (mut curve, mut is_ready) = (Curve::<A::Real>::default(), false);
        let mut group = Group::new();
        for lane in self.lanes(&step.outs, mask) {
            let searched = KNOT * (len * (1 + derivs.len())) as u64;
            self.work.pay(searched);
            if !self.work.affords(0) {
                return;
            }
            if !(is_ready && is_shared) {
                for (index, knot) in list.iter_mut().enumerate() {
                    *knot = A::Real::load(self.element(knots, index, 0, lane));
                }
                let count = usize::try_from(self.bits(*count, lane) as i32).unwrap_or(0).min(len);
                curve.prepare(basis::basis(&self.text(self.bits(*name, lane))), &list, count);
                is_ready = true;
            }
            let y = A::Real::load(self.word(*y, lane));
            match curve.start(y) {
                Start::Found(x) => self.set_words(*out, lane, &[x.store()]),
                Start::Between(bracket) if is_shared => {
                    if group.push(lane, y, bracket) {
                        self.search(&curve, &mut group, *out);
                    }
                }
                Start::Between(bracket) => self.set_words(*out, lane, &[curve.search(y, bracket).store()]),
            }
            for (out, change) in derivs.iter().zip(changes) {
                let change = A::Real::load(self.word(*change, lane));
                self.set_words(*out, lane, &[curve.inverse_derivative(y, change).store()]);
            }
            if !self.work.close() {
                return;
            }
        }
        self.search(&curve, &mut group, *out);
    }

    /// Ends the searches of a group, and empties it.
    fn search(&mut self, curve: &Curve<A::Real>, group: &mut Group<A::Real>, out: Operand) {
        if group.count == 0 {
            return;
        }
        let found = self.isa.dispatch(Search { curve, group: &mut *group });
        for (lane, x) in group.lanes.iter().zip(found).take(group.count) {
            self.set_words(out, *lane, &[x.store()]);
        }
        group.count = 0;
    }
}

/// Searches that advance together, field by field.
struct Group<R> {
    count: usize,
    lanes: [usize; TOGETHER],
    y: [R; TOGETHER],
    x0: [R; TOGETHER],
    x1: [R; TOGETHER],
    v0: [R; TOGETHER],
    v1: [R; TOGETHER],
    /// Not 0 where the curve rises.
    rises: [u32; TOGETHER],
}

impl<R: Scalar> Group<R> {
    fn new() -> Self {
        let zeros = [R::lit(0.0); TOGETHER];
        Group {
            count: 0,
            lanes: [0; TOGETHER],
            y: zeros,
            x0: zeros,
            x1: zeros,
            v0: zeros,
            v1: zeros,
            rises: [0; TOGETHER],
        }
    }

    /// Adds a search. Returns whether the group is full.
    fn push(&mut self, lane: usize, y: R, bracket: Bracket<R>) -> bool {
        let at = self.count.min(TOGETHER - 1);
        (self.lanes[at], self.y[at]) = (lane, y);
        self.set(at, &bracket);
        self.count = at + 1;
        self.count == TOGETHER
    }

    #[inline(always)]
    fn set(&mut self, at: usize, bracket: &Bracket<R>) {
        (self.x0[at], self.x1[at]) = (bracket.x0, bracket.x1);
        (self.v0[at], self.v1[at]) = (bracket.v0, bracket.v1);
        self.rises[at] = bracket.is_rising.into();
    }

    #[inline(always)]
    fn bracket(&self, at: usize) -> Bracket<R> {
        let (x0, x1, v0, v1) = (self.x0[at], self.x1[at], self.v0[at], self.v1[at]);
        Bracket { x0, x1, v0, v1, is_rising: self.rises[at] != 0 }
    }
}

/// The searches of a group, to their ends.
struct Search<'a, R> {
    curve: &'a Curve<R>,
    group: &'a mut Group<R>,
}

impl<R: Scalar> Kernel for Search<'_, R> {
    type Output = [R; TOGETHER];

    // Each loop over the group is a loop of vectors; only the loads of the coefficients are not.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "several arrays advance together")]
    fn run(self) -> [R; TOGETHER] {
        let Search { curve, group } = self;
        let zeros = [R::lit(0.0); TOGETHER];
        let (mut x, mut t, mut found, mut pieces) = (zeros, zeros, zeros, [zeros; 4]);
        let mut segments = [0; TOGETHER];
        let mut open: [u32; TOGETHER] = std::array::from_fn(|at| (at < group.count).into());
        for step in 0..Curve::<R>::steps() {
            for at in 0..TOGETHER {
                x[at] = group.bracket(at).guess(group.y[at], step);
            }
            for at in 0..TOGETHER {
                (segments[at], t[at]) = curve.locate(x[at]);
            }
            for at in 0..TOGETHER {
                let piece = curve.pieces().get(segments[at] as usize).copied().unwrap_or([R::lit(0.0); 4]);
                for (of_power, coefficient) in pieces.iter_mut().zip(piece) {
                    of_power[at] = coefficient;
                }
            }
            let mut any = 0;
            for at in 0..TOGETHER {
                let piece = [pieces[0][at], pieces[1][at], pieces[2][at], pieces[3][at]];
                let v = curve.value(piece, t[at]);
                let (bracket, is_done) = group.bracket(at).narrowed::<R>(group.y[at], (x[at], v));
                group.set(at, &bracket);
                found[at] = R::select(open[at] != 0, x[at], found[at]);
                open[at] &= u32::from(!is_done);
                any |= open[at];
            }
            if any == 0 {
                break;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osl_numeric::basis::BASES;
    use osl_simd::Isa;

    /// Searches that advance together have the bits of searches alone, in every basis, also in curves that
    /// turn, stay level or have knots that are no numbers.
    #[test]
    fn searches_together_are_those_alone() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut searched = 0;
        let mut curve = Curve::<f32>::default();
        for round in 0..300 {
            let len = 4 + round % 19;
            let mut knots: Vec<f32> = (0..len).map(|_| next() * 2.0 - 0.5).collect();
            match round % 4 {
                0 => knots.sort_by(f32::total_cmp),
                1 => knots.sort_by(|a, b| b.total_cmp(a)),
                2 if round % 8 == 2 => knots[len / 2] = f32::INFINITY,
                _ => {}
            }
            let basis = &BASES[round % BASES.len()];
            curve.prepare(basis, &knots, len);
            let mut group = Group::new();
            let mut alone = Vec::new();
            for lane in 0..1 + round % TOGETHER {
                let y = next();
                if let Start::Between(bracket) = curve.start(y) {
                    group.push(lane, y, bracket);
                    alone.push(curve.search(y, bracket).to_bits());
                    assert_eq!(alone.last().copied(), Some(curve.inverse(y).to_bits()));
                }
            }
            searched += alone.len();
            for isa in Isa::all() {
                let mut own = copy(&group);
                let found = isa.dispatch(Search { curve: &curve, group: &mut own });
                let found: Vec<u32> = found.iter().take(alone.len()).map(|x| x.to_bits()).collect();
                assert_eq!(found, alone, "{} {isa:?} {knots:?}", basis.name);
            }
        }
        assert!(searched > 1000, "{searched}");
    }

    fn copy(group: &Group<f32>) -> Group<f32> {
        let Group { count, lanes, y, x0, x1, v0, v1, rises } = *group;
        Group { count, lanes, y, x0, x1, v0, v1, rises }
    }
}
