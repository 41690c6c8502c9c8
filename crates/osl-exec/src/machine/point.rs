//! Values of a point or of the run: attributes, messages of the source, and reports of invalid indices.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::source::{DatumColumn, Ray};
use crate::step::{KernelStep, Location, Operand};
use osl_ir::ir::{Axis, Const, Kind, USER_DATA};
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

/// What a note says about an attribute of a point.
#[derive(Clone, PartialEq)]
enum Answered {
    /// There is no value.
    Not,
    /// There is a value of another type only.
    OtherType,
    /// Something answers in place of the scene.
    Instead(Arc<str>),
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn attribute(&mut self, kind: Kind, count: u8, step: &KernelStep, mask: &Mask) {
        let values = usize::from(count).max(1);
        let (outs, rest) = step.outs.split_at(values.min(step.outs.len()));
        let Some((found, derivs)) = rest.split_first() else { return };
        let is_single = step.args.iter().all(|arg| matches!(self.arg(*arg), Arg::Same(_)));
        let (mut asked, mut missing) = (None, Vec::new());
        let lanes = self.active(mask);
        if is_single && let Some(lane) = lanes.first() {
            asked = self.asked(step, *lane);
            if asked.as_ref().is_some_and(|asked| self.fill_attribute(asked, (kind, count), step)) {
                return;
            }
        }
        for lane in lanes {
            if !is_single || asked.is_none() {
                self.note_missing(asked.as_ref(), &mut missing);
                asked = self.asked(step, lane);
            }
            let Some(Asked { object, name, element, .. }) = &asked else { return };
            let answer = self.source.attribute(object, name, *element, self.first + lane);
            let datum = answer.as_ref().and_then(|datum| datum.of_type(kind, count.into()));
            match (datum, &answer) {
                (None, None) => missing.push((lane, Answered::Not)),
                (None, Some(_)) => missing.push((lane, Answered::OtherType)),
                (Some(datum), _) => {
                    missing.extend(datum.instead.clone().map(|by| (lane, Answered::Instead(by))));
                }
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
                if let Some((_, answered)) = missing.pop() {
                    self.note_answer(asked.as_ref(), &answered, self.active(mask));
                }
                break;
            }
        }
        self.note_missing(asked.as_ref(), &mut missing);
    }

    /// Writes an attribute of all lanes, if the source has a column of it.
    fn fill_attribute(&mut self, asked: &Asked, (kind, count): (Kind, u8), step: &KernelStep) -> bool {
        let Asked { object, name, element, .. } = asked;
        let (width, first, source) = (self.width, self.first, self.source);
        let (outs, rest) = step.outs.split_at(usize::from(count).max(1).min(step.outs.len()));
        let Some((found, derivs)) = rest.split_first() else { return false };
        if source.attribute_is_shared(object, name, *element) || kind == Kind::Str {
            return false;
        }
        let values = outs.iter().map(|out| out.words as usize).sum::<usize>();
        let mut column = std::mem::take(&mut self.column);
        column.clear();
        column.resize((values + derivs.len()) * width, 0);
        let (words, changes) = column.split_at_mut(values * width);
        let changes: &mut [f32] = bytemuck::cast_slice_mut(changes);
        let done = match source.attribute_global(object, name, *element) {
            Some(global) if (kind, count) == (Kind::Float, 0) => {
                source.fill(global, first, width, bytemuck::cast_slice_mut(words));
                for (axis, lanes) in Axis::BOTH.into_iter().zip(changes.chunks_mut(width)) {
                    if source.varying_derivs().contains(&global) {
                        source.fill_deriv(global, axis, first, width, lanes);
                    } else {
                        lanes.fill(source.deriv(global, axis)[0]);
                    }
                }
                true
            }
            _ => {
                let mut lanes = DatumColumn { kind, count: count.into(), width, words, derivs: changes };
                source.fill_attribute((object, name, *element), first, &mut lanes)
            }
        };
        if done {
            let mut parts = column.chunks_exact(width);
            for out in outs.iter().chain(derivs) {
                for component in 0..out.words as usize {
                    self.set_lanes(self.part(*out, component), parts.next().unwrap_or_default());
                }
            }
            self.set_run(*found, 0..width, A::Word::of(1));
        }
        self.column = column;
        done
    }

    /// Gives all lanes of an operand with one word their words, which are those of single precision.
    fn set_lanes(&mut self, out: Operand, words: &[u32]) {
        let word = |word: &u32| match out.kind {
            Kind::Float => A::of(f32::from_bits(*word)),
            _ => A::Word::of(*word),
        };
        match out.location {
            Location::Words(at) => self.words[at as usize] = words.first().map_or(A::Word::of(0), word),
            Location::Lanes { reg, component, cells } => {
                let own = self.registers[self.per_cell.register(reg, cells)].words_mut();
                let own = own[component as usize * self.width..].iter_mut();
                own.zip(words).for_each(|(to, from)| *to = word(from));
            }
        }
    }

    /// The attribute that a lane wants.
    fn asked(&self, step: &KernelStep, lane: usize) -> Option<Asked> {
        let [object, name, element] = step.args[..] else { return None };
        let text = |operand| self.text(self.bits(operand, lane));
        let element = self.bits(element, lane) as i32;
        let (is_parameter, element) = (element == USER_DATA, usize::try_from(element).ok());
        Some(Asked { object: text(object), name: text(name), element, is_parameter })
    }

    /// Notes the lanes at which an attribute has no answer of the scene.
    fn note_missing(&mut self, asked: Option<&Asked>, missing: &mut Vec<(usize, Answered)>) {
        while let Some((_, first)) = missing.first() {
            let first = first.clone();
            let lanes = missing.extract_if(.., |(_, answered)| *answered == first).map(|(lane, _)| lane);
            let lanes: Vec<usize> = lanes.collect();
            self.note_answer(asked, &first, lanes);
        }
    }

    /// Notes what is special about the answer at some lanes.
    fn note_answer(
        &mut self,
        asked: Option<&Asked>,
        answered: &Answered,
        lanes: impl IntoIterator<Item = usize>,
    ) {
        let Some(Asked { object, name, .. }) = asked.filter(|asked| !asked.is_parameter) else { return };
        let of = if object.is_empty() { String::new() } else { format!("\"{object}\", ") };
        let what = match answered {
            Answered::Not => "not answered".to_string(),
            Answered::OtherType => "not answered: its value has another type".to_string(),
            Answered::Instead(by) => format!("answered by {by}"),
        };
        let first = self.first;
        let text = format!("getattribute {of}\"{name}\" is {what}");
        self.messages.add(lanes.into_iter().map(|lane| first + lane), Message::note(text));
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
        let lanes = self.active(mask);
        let ray = |lane: &usize| Ray {
            point: self.first + lane,
            origin: self.singles(*origin, *lane),
            direction: self.singles(*direction, *lane),
        };
        let rays: Vec<Ray> = lanes.iter().map(ray).collect();
        let mut hits = vec![false; rays.len()];
        self.source.trace_all(&rays, &mut hits);
        for (lane, hit) in lanes.into_iter().zip(hits) {
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
        if self.fill_messages((kind, count), (outs, [*given, *found]), step, mask) {
            return;
        }
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

    /// Writes a message of all active lanes, if the source has a column of it.
    fn fill_messages(
        &mut self,
        (kind, count): (Kind, u8),
        (outs, found): (&[Operand], [Operand; 2]),
        step: &KernelStep,
        mask: &Mask,
    ) -> bool {
        let is_single = step.args.iter().all(|arg| matches!(self.arg(*arg), Arg::Same(_)));
        let lanes = self.active(mask);
        let Some(first) = lanes.first().filter(|_| is_single && kind != Kind::Str) else { return false };
        let [Const::Str(source), Const::Str(name)] = &self.values(&step.args, &step.kinds, *first)[..] else {
            return false;
        };
        let points: Vec<usize> = lanes.iter().map(|lane| self.first + lane).collect();
        let width = lanes.len();
        let values = outs.iter().map(|out| out.words as usize).sum::<usize>();
        let mut words = vec![0; values * width];
        let mut column = DatumColumn { kind, count: count.into(), width, words: &mut words, derivs: &mut [] };
        if !self.source.fill_messages((source, name), &points, &mut column) {
            return false;
        }
        let parts = |out: &Operand| (0..out.words as usize).map(|c| (*out, c)).collect::<Vec<_>>();
        for ((out, component), words) in outs.iter().flat_map(parts).zip(words.chunks_exact(width)) {
            let part = self.part(out, component);
            for (lane, word) in lanes.iter().zip(words) {
                match part.kind {
                    Kind::Float => self.set_floats(part, *lane, &[f32::from_bits(*word)]),
                    _ => self.set_bits(part, *lane, *word),
                }
            }
        }
        found.into_iter().for_each(|found| lanes.iter().for_each(|lane| self.set_bits(found, *lane, 1)));
        true
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
        let wrong = |lane: usize| {
            let (i, n) = (self.bits(*index, lane) as i32, self.bits(*len, lane) as i32);
            (i < 0 || i >= n).then_some(((i, n), lane))
        };
        let mut lanes: Vec<_> = self.active(mask).into_iter().filter_map(wrong).collect();
        // Points with the same index have the same message, which takes longer to write than to count.
        lanes.sort_by_key(|(wrong, _)| *wrong);
        for alike in lanes.chunk_by(|(one, _), (other, _)| one == other) {
            let Some(((i, n), _)) = alike.first() else { continue };
            let text = format!("Index [{i}] out of range {name}[0..{}]: {{0}}", n - 1);
            self.pay_report(text.len());
            let message = Message { at: Some(step.span), ..Message::error_at(text, vec![step.span]) };
            let first = self.first;
            self.messages.add(alike.iter().map(|(_, lane)| first + lane), message);
            if !self.work.close_all(alike.len() as u64) {
                return;
            }
        }
    }
}
