//! Values of a point or of the run: attributes, messages of the source, and reports of invalid indices.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::{KernelStep, Location, Operand};
use osl_ir::ir::{Const, Kind, USER_DATA};
use osl_ir::types::{Base, Extent, Type};
use osl_lanes::{Arg, Word};
use std::sync::Arc;

/// An attribute that a point wants.
struct Asked {
    object: Arc<str>,
    name: Arc<str>,
    element: Option<usize>,
    /// Whether it is for a parameter, which has a value of its own.
    is_parameter: bool,
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn attribute(&mut self, kind: Kind, count: u8, step: &KernelStep, mask: &Mask) {
        let values = usize::from(count).max(1);
        let (outs, rest) = step.outs.split_at(values.min(step.outs.len()));
        let Some((found, derivs)) = rest.split_first() else { return };
        let is_single = step.args.iter().all(|arg| matches!(self.arg(*arg), Arg::Same(_)));
        let (mut asked, mut missing) = (None, Vec::new());
        for lane in self.active(mask) {
            if !is_single || asked.is_none() {
                self.note_missing(asked.as_ref(), &mut missing);
                asked = self.asked(step, lane);
            }
            let Some(Asked { object, name, element, .. }) = &asked else { return };
            let answer = self.source.attribute(object, name, *element, self.first + lane);
            let datum = answer.as_ref().and_then(|datum| datum.of_type(kind, count.into()));
            if datum.is_none() {
                missing.push((lane, answer.is_some()));
            }
            self.set_bits(*found, lane, datum.is_some().into());
            for (index, out) in outs.iter().enumerate() {
                let value = datum.and_then(|d| d.values.get(index).cloned());
                self.set_value(*out, lane, &value.unwrap_or_else(|| Const::zero(kind)));
            }
            for (axis, out) in derivs.iter().enumerate() {
                let deriv = datum.map_or(0.0, |d| d.derivs[axis]);
                self.set_floats(*out, lane, &[deriv]);
            }
            if !self.work.close() {
                return;
            }
            if is_single && self.source.attribute_is_shared(object, name, *element) {
                step.outs.iter().for_each(|out| self.broadcast_lane(*out, lane));
                if let Some((_, typed)) = missing.pop() {
                    missing.extend(self.active(mask).into_iter().map(|lane| (lane, typed)));
                }
                break;
            }
        }
        self.note_missing(asked.as_ref(), &mut missing);
    }

    /// The attribute that a lane wants.
    fn asked(&self, step: &KernelStep, lane: usize) -> Option<Asked> {
        let [object, name, element] = step.args[..] else { return None };
        let text = |operand| self.text(self.bits(operand, lane));
        let element = self.bits(element, lane) as i32;
        let (is_parameter, element) = (element == USER_DATA, usize::try_from(element).ok());
        Some(Asked { object: text(object), name: text(name), element, is_parameter })
    }

    /// Notes the lanes at which an attribute is not answered, each with whether there is a value of another
    /// type.
    fn note_missing(&mut self, asked: Option<&Asked>, missing: &mut Vec<(usize, bool)>) {
        if missing.is_empty() {
            return;
        }
        let found = std::mem::take(missing);
        let Some(Asked { object, name, .. }) = asked.filter(|asked| !asked.is_parameter) else { return };
        let of = if object.is_empty() { String::new() } else { format!("\"{object}\", ") };
        for (typed, why) in [(false, ""), (true, ": its value has another type")] {
            let first = self.first;
            let points = found.iter().filter(|(_, own)| *own == typed).map(|(lane, _)| first + lane);
            let text = format!("getattribute {of}\"{name}\" is not answered{why}");
            self.messages.add(points, Message::note(text));
        }
    }

    /// Gives all lanes the value of one of them.
    fn broadcast_lane(&mut self, out: Operand, lane: usize) {
        let width = self.width;
        if let Location::Lanes { reg, component, cells } = out.location {
            let words = self.registers[self.per_cell.register(reg, cells)].words_mut();
            for lanes in words.chunks_mut(width).skip(component as usize).take(out.words as usize) {
                if let Some(word) = lanes.get(lane).copied() {
                    lanes.fill(word);
                }
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
