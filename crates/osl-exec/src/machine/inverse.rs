//! Inverse splines: the search for the positions of many points in one curve.
//!
//! If all points share the basis and the knots, the polynomials are prepared once, and sixteen searches
//! advance together, from the choice of the segment on: each takes exactly the steps that it would take
//! alone. The coefficients of a segment are loaded only when a search comes into it. This module must not
//! know the steps, see [`osl_numeric::spline`].

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::step::{KernelStep, Location, Operand};
use osl_lanes::{Arg, Element};
use osl_numeric::Scalar;
use osl_numeric::basis;
use osl_numeric::spline::{Bracket, Curve};
use osl_simd::Kernel;
use std::marker::PhantomData;

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
        let has_lanes = matches!(out.location, Location::Lanes { .. }) && self.width >= TOGETHER;
        let together = is_shared && has_lanes && !is_single(y);
        let mut list = Vec::new();
        let (mut curve, mut is_ready) = (Curve::<A::Real>::default(), false);
        let searched = KNOT * (len * (1 + derivs.len())) as u64;
        for lane in self.lanes(&step.outs, mask) {
            self.work.pay(searched);
            if !self.work.affords(0) {
                return;
            }
            if !(is_ready && is_shared) {
                list.clear();
                list.extend((0..len).map(|index| A::Real::load(self.element(knots, index, 0, lane))));
                let count = usize::try_from(self.bits(*count, lane) as i32).unwrap_or(0).min(len);
                curve.prepare(basis::basis(&self.text(self.bits(*name, lane))), &list, count);
                is_ready = true;
                if together {
                    self.search_lanes(&curve, *y, *out, mask);
                }
            }
            let y = A::Real::load(self.word(*y, lane));
            if !together {
                self.set_words(*out, lane, &[curve.inverse(y).store()]);
            }
            for (out, change) in derivs.iter().zip(changes) {
                let change = A::Real::load(self.word(*change, lane));
                self.set_words(*out, lane, &[curve.inverse_derivative(y, change).store()]);
            }
            if !self.work.close() {
                return;
            }
        }
    }

    /// Searches for the positions of all lanes in one curve.
    fn search_lanes(&mut self, curve: &Curve<A::Real>, y: Operand, out: Operand, mask: &Mask) {
        let mut target = self.take(out);
        if let (Arg::Each(y), Some(out)) = (self.arg(y), target.chunks_mut(self.width).next()) {
            let (y, out) = (y.as_chunks().0, out.as_chunks_mut().0);
            let active = if let Mask::Some(bits) = mask { Some(bits.as_chunks().0) } else { None };
            self.isa.dispatch(Search { curve, y, active, out, arithmetic: PhantomData::<A> });
        }
        self.put(out, target);
    }
}

/// Searches that advance together, field by field.
struct Group<R> {
    y: [R; TOGETHER],
    /// The positions that were found, if the search is over.
    found: [R; TOGETHER],
    /// All ones where the search goes on.
    open: [u32; TOGETHER],
    x0: [R; TOGETHER],
    x1: [R; TOGETHER],
    v0: [R; TOGETHER],
    v1: [R; TOGETHER],
    /// Not 0 where the curve rises.
    rises: [u32; TOGETHER],
    /// The segments of the positions, and their coefficients by power.
    segments: [i32; TOGETHER],
    pieces: [[R; TOGETHER]; 4],
}

impl<R: Scalar> Group<R> {
    #[inline(always)]
    fn bracket(&self, at: usize) -> Bracket<R> {
        let (x0, x1, v0, v1) = (self.x0[at], self.x1[at], self.v0[at], self.v1[at]);
        Bracket { x0, x1, v0, v1, is_rising: self.rises[at] != 0 }
    }

    /// The bracket `yes` where `is` holds.
    #[inline(always)]
    fn choose(&mut self, at: usize, is: bool, yes: &Bracket<R>) {
        self.x0[at] = R::select(is, yes.x0, self.x0[at]);
        self.x1[at] = R::select(is, yes.x1, self.x1[at]);
        self.v0[at] = R::select(is, yes.v0, self.v0[at]);
        self.v1[at] = R::select(is, yes.v1, self.v1[at]);
        self.rises[at] = if is { yes.is_rising.into() } else { self.rises[at] };
    }

    // Each loop over the group is a loop of vectors.
    /// Finds the segments in which to search; see [`Curve::start`].
    #[inline(always)]
    fn start(curve: &Curve<R>, y: [R; TOGETHER], active: &[u32; TOGETHER]) -> Self {
        let zeros = [R::lit(0.0); TOGETHER];
        let mut group = Group {
            y,
            found: zeros,
            open: [0; TOGETHER],
            x0: zeros,
            x1: zeros,
            v0: zeros,
            v1: zeros,
            rises: [0; TOGETHER],
            segments: [-1; TOGETHER],
            pieces: [zeros; 4],
        };
        let mut waiting = [0_u32; TOGETHER];
        for at in 0..TOGETHER {
            let (is_before, is_behind) = curve.is_outside(y[at]);
            group.found[at] = R::select(!is_before & is_behind, R::lit(1.0), R::lit(0.0));
            waiting[at] = if is_before | is_behind { 0 } else { active[at] };
        }
        for bracket in curve.brackets::<R>() {
            let is_level = bracket.is_level::<R>();
            let mut any = 0;
            for at in 0..TOGETHER {
                let (is_waiting, is_here) = (waiting[at] != 0, bracket.holds(y[at]));
                let x = R::select(is_here, bracket.x0, bracket.end_toward(y[at]));
                group.found[at] = R::select(is_waiting, x, group.found[at]);
                let begins = is_waiting & is_here;
                group.choose(at, begins, &bracket);
                group.open[at] = if begins & !is_level { u32::MAX } else { group.open[at] };
                waiting[at] = if is_here { 0 } else { waiting[at] };
                any |= waiting[at];
            }
            if any == 0 {
                break;
            }
        }
        group
    }

    /// Loads the coefficients of the segments where they are not those loaded before.
    #[inline(always)]
    fn load(&mut self, curve: &Curve<R>, segments: &[i32; TOGETHER]) {
        let mut moved = 0;
        for ((new, old), open) in segments.iter().zip(&self.segments).zip(&self.open) {
            moved |= (new ^ old) as u32 & open;
        }
        if moved == 0 {
            return;
        }
        self.segments = *segments;
        for (at, segment) in segments.iter().enumerate() {
            let piece = curve.pieces().get(*segment as usize).copied().unwrap_or([R::lit(0.0); 4]);
            for (of_power, coefficient) in self.pieces.iter_mut().zip(piece) {
                of_power[at] = coefficient;
            }
        }
    }

    /// Takes all searches to their ends; see [`Curve::search`].
    #[inline(always)]
    fn search(mut self, curve: &Curve<R>) -> [R; TOGETHER] {
        let (mut x, mut t) = ([R::lit(0.0); TOGETHER], [R::lit(0.0); TOGETHER]);
        let mut segments = [0; TOGETHER];
        let mut any = self.open.iter().fold(0, |any, open| any | open);
        let mut steps = 0..Curve::<R>::steps();
        while let (true, Some(step)) = (any != 0, steps.next()) {
            for (at, (x, y)) in x.iter_mut().zip(self.y).enumerate() {
                *x = self.bracket(at).guess(y, step);
            }
            for at in 0..TOGETHER {
                (segments[at], t[at]) = curve.locate(x[at]);
            }
            self.load(curve, &segments);
            any = 0;
            for at in 0..TOGETHER {
                let piece = [self.pieces[0][at], self.pieces[1][at], self.pieces[2][at], self.pieces[3][at]];
                let v = curve.value(piece, t[at]);
                let (bracket, is_done) = self.bracket(at).narrowed::<R>(self.y[at], (x[at], v));
                self.choose(at, true, &bracket);
                self.found[at] = R::select(self.open[at] != 0, x[at], self.found[at]);
                self.open[at] = if is_done { 0 } else { self.open[at] };
                any |= self.open[at];
            }
        }
        self.found
    }
}

/// The searches of all lanes in one curve.
struct Search<'a, A: ArithmeticImpl> {
    curve: &'a Curve<A::Real>,
    y: &'a [[A::Word; TOGETHER]],
    /// The lanes that count, unless all do.
    active: Option<&'a [[u32; TOGETHER]]>,
    out: &'a mut [[A::Word; TOGETHER]],
    arithmetic: PhantomData<A>,
}

impl<A: ArithmeticImpl> Kernel for Search<'_, A> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Search { curve, y, active, out, .. } = self;
        for (at, (out, y)) in out.iter_mut().zip(y).enumerate() {
            let active = active.map_or(&[u32::MAX; TOGETHER], |active| &active[at]);
            let mut values = [A::of(0.0); TOGETHER].map(A::Real::load);
            for lane in 0..TOGETHER {
                values[lane] = A::Real::load(y[lane]);
            }
            let found = Group::start(curve, values, active).search(curve);
            for lane in 0..TOGETHER {
                out[lane] = found[lane].store();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arithmetic::{Double, Strict};
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
        let (mut curve, mut wide) = (Curve::<f32>::default(), Curve::<f64>::default());
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
            wide.prepare(basis, &knots.iter().map(|knot| f64::from(*knot)).collect::<Vec<_>>(), len);
            let mut y: Vec<f32> = (0..3 * TOGETHER).map(|_| next() * 1.5 - 0.25).collect();
            y[5] = f32::NAN;
            let active: Vec<u32> =
                (0..y.len()).map(|lane| if lane % 7 == round % 7 { 0 } else { u32::MAX }).collect();
            let active = (round % 2 == 0).then_some(active.as_chunks().0);
            let is_active =
                |lane: usize| active.is_none_or(|active| active[lane / TOGETHER][lane % TOGETHER] != 0);
            let y_wide: Vec<f64> = y.iter().map(|y| f64::from(*y)).collect();
            for isa in Isa::all() {
                let words: Vec<u32> = y.iter().map(|y| y.to_bits()).collect();
                let mut out = vec![[0; TOGETHER]; 3];
                let (curve, arithmetic) = (&curve, PhantomData::<Strict>);
                isa.dispatch(Search { curve, y: words.as_chunks().0, active, out: &mut out, arithmetic });
                for (lane, found) in
                    out.as_flattened().iter().enumerate().filter(|(lane, _)| is_active(*lane))
                {
                    let alone = curve.inverse(y[lane]).to_bits();
                    assert_eq!(*found, alone, "{} {isa:?} {} in {knots:?}", basis.name, y[lane]);
                }
                let words: Vec<u64> = y_wide.iter().map(|y| y.to_bits()).collect();
                let mut out = vec![[0; TOGETHER]; 3];
                let (curve, arithmetic) = (&wide, PhantomData::<Double>);
                isa.dispatch(Search { curve, y: words.as_chunks().0, active, out: &mut out, arithmetic });
                for (lane, found) in
                    out.as_flattened().iter().enumerate().filter(|(lane, _)| is_active(*lane))
                {
                    let alone = curve.inverse(y_wide[lane]).to_bits();
                    assert_eq!(*found, alone, "{} {isa:?} {} in {knots:?}", basis.name, y[lane]);
                }
            }
        }
    }
}
