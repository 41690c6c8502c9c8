//! Values of a point or of the run: hashes, attributes, inverse splines, and reports of invalid indices.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::lanes::Arg;
use crate::message::Message;
use crate::program::{KernelStep, Operand};
use crate::word::{Element, Word};
use osl_ir::ir::{Const, Kind};
use osl_ir::types::{Base, Extent, Type};
use osl_noise::hash::NAN_WORD;
use osl_numeric::{Number, spline};

/// Steps for a knot that an inverse spline searches.
const KNOT: u64 = 4;

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn hash(&mut self, step: &KernelStep, mask: &Mask) {
        let Some(out) = step.outs.first() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let mut words = Vec::with_capacity(4);
            for (arg, kind) in step.args.iter().zip(&step.kinds) {
                for component in 0..arg.words as usize {
                    let part = self.part(*arg, component);
                    // A float counts by its single-precision word, and every NaN is the same, because its
                    // payload depends on the instruction set.
                    words.push(match kind {
                        Kind::Float | Kind::Triple => match self.single(part, lane) {
                            x if x.is_nan() => NAN_WORD,
                            x => x.to_bits(),
                        },
                        _ => self.bits(part, lane),
                    });
                }
            }
            self.set_bits(*out, lane, hash(&words));
        }
    }

    pub(super) fn attribute(&mut self, kind: Kind, count: u8, step: &KernelStep, mask: &Mask) {
        let values = usize::from(count).max(1);
        let (outs, rest) = step.outs.split_at(values.min(step.outs.len()));
        let Some((found, derivs)) = rest.split_first() else { return };
        for lane in self.active(mask) {
            let [Const::Str(object), Const::Str(name), Const::Int(element)] =
                &self.values(&step.args, &step.kinds, lane)[..]
            else {
                return;
            };
            let element = usize::try_from(*element).ok();
            let datum = self.source.attribute(object, name, element, self.first + lane);
            let datum = datum.filter(|d| {
                d.array == (count > 0)
                    && d.values.len() == values
                    && d.values.iter().all(|v| v.kind() == kind)
            });
            self.set_bits(*found, lane, datum.is_some().into());
            for (index, out) in outs.iter().enumerate() {
                let value = datum.as_ref().and_then(|d| d.values.get(index).cloned());
                self.set_value(*out, lane, &value.unwrap_or_else(|| Const::zero(kind)));
            }
            for (axis, out) in derivs.iter().enumerate() {
                let deriv = datum.as_ref().map_or(0.0, |d| d.derivs[axis]);
                self.set_floats(*out, lane, &[deriv]);
            }
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn trace(&mut self, step: &KernelStep, mask: &Mask) {
        let ([origin, direction], Some(out)) = (&step.args[..], step.outs.first()) else { return };
        for lane in self.active(mask) {
            let triple = |arg: &Operand| std::array::from_fn(|c| self.single(self.part(*arg, c), lane));
            let hit = self.source.trace(triple(origin), triple(direction), self.first + lane);
            self.set_bits(*out, lane, hit.into());
        }
    }

    pub(super) fn source_message(
        &mut self,
        (base, kind): (Base, Kind),
        count: u8,
        step: &KernelStep,
        mask: &Mask,
    ) {
        let values = usize::from(count).max(1);
        let (outs, rest) = step.outs.split_at(values.min(step.outs.len()));
        let [given, found] = rest else { return };
        let extent = if count == 0 { Extent::One } else { Extent::Array(count.into()) };
        for lane in self.active(mask) {
            let [Const::Str(source), Const::Str(name)] = &self.values(&step.args, &step.kinds, lane)[..]
            else {
                return;
            };
            let answer = self.source.message(source, name, Type { base, extent }, self.first + lane);
            let fits = |list: &Vec<Const>| list.len() == values && list.iter().all(|v| v.kind() == kind);
            let list = answer.values.filter(fits);
            self.set_bits(*found, lane, answer.found.into());
            self.set_bits(*given, lane, list.is_some().into());
            for (index, out) in outs.iter().enumerate() {
                let value = list.as_ref().and_then(|list| list.get(index).cloned());
                self.set_value(*out, lane, &value.unwrap_or_else(|| Const::zero(kind)));
            }
        }
    }

    pub(super) fn spline_inverse(&mut self, knots: u32, step: &KernelStep, mask: &Mask) {
        let Some((out, derivs)) = step.outs.split_first() else { return };
        let len = self.program.arrays.get(knots as usize).map_or(0, |a| a.len as usize);
        let [basis, y, count, changes @ ..] = &step.args[..] else { return };
        let mut list = vec![A::Real::lit(0.0); len];
        for lane in self.lanes(&step.outs, mask) {
            let searched = KNOT * (len * (1 + derivs.len())) as u64;
            self.work.pay(searched);
            if !self.work.affords(0) {
                return;
            }
            for (index, knot) in list.iter_mut().enumerate() {
                *knot = A::Real::load(self.element(knots, index, 0, lane));
            }
            let count = usize::try_from(self.bits(*count, lane) as i32).unwrap_or(0).min(len);
            let basis = osl_numeric::basis::basis(&self.text(self.bits(*basis, lane)));
            let y = A::Real::load(self.word(*y, lane));
            let x = spline::inverse(basis, y, &list, count);
            self.set_words(*out, lane, &[x.store()]);
            for (out, change) in derivs.iter().zip(changes) {
                let change = A::Real::load(self.word(*change, lane));
                let deriv = spline::inverse_derivative(basis, y, change, &list, count);
                self.set_words(*out, lane, &[deriv.store()]);
            }
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn check_index(&mut self, name: &str, step: &KernelStep, mask: &Mask) {
        let [index, len] = &step.args[..] else { return };
        let limit = self.bits(*len, 0);
        // Without its sign, a negative index is a large number. Inactive lanes may contain anything.
        let fine = match self.arg(*index) {
            Arg::Same(index) => index[0].bits() < limit,
            Arg::Each(indices) => !mask.any_beyond(self.isa, indices, limit),
        };
        if fine {
            return;
        }
        for lane in self.active(mask) {
            let (i, n) = (self.bits(*index, lane) as i32, self.bits(*len, lane) as i32);
            if i < 0 || i >= n {
                let text = format!("Index [{i}] out of range {name}[0..{}]: {{0}}", n - 1);
                self.report(step, lane, mask, Message::error_at(text, vec![step.span]));
            }
            if !self.work.close() {
                return;
            }
        }
    }
}

/// The hash of one to four words.
fn hash(words: &[u32]) -> u32 {
    use osl_noise::hash::hash;
    match *words {
        [a] => hash([a]),
        [a, b] => hash([a, b]),
        [a, b, c] => hash([a, b, c]),
        [a, b, c, d] => hash([a, b, c, d]),
        _ => 0,
    }
}
