//! Strings made while running, and printing.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::{Arithmetic, Word};
use crate::lanes::Arg;
use crate::message::{Message, Printed};
use crate::program::{KernelStep, Operand};
use osl_ir::ir::{Const, Kind, Shape, Sink};
use osl_ir::text::{self, Flavour, Value};
use rustc_hash::FxHashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// The strings of a batch beside those of the program. They are numbered behind those, and forgotten when the batch ends.
#[derive(Debug, Default)]
pub(super) struct Texts {
    list: Vec<Arc<str>>,
    numbers: FxHashMap<Arc<str>, u32>,
    bytes: usize,
}

/// Bytes that a run may print, each text with what is kept beside it.
const MAX_PRINTED: usize = 3 << 25;
/// What is kept beside a printed text.
const PRINTED_BESIDE: usize = 128;
/// Bytes of strings that a batch may make.
const MAX_TEXTS: usize = 1 << 25;

impl Texts {
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.numbers.clear();
        self.bytes = 0;
    }
}

impl<A: Arithmetic> Machine<'_, A> {
    /// The string of a number.
    pub(super) fn text(&self, number: u32) -> Arc<str> {
        let known = &self.program.strings;
        let number = number as usize;
        let made = || self.texts.list.get(number - known.len());
        known.get(number).or_else(made).cloned().unwrap_or_else(|| "".into())
    }

    /// The number of a string; that of the empty string, and the end of the run, where the batch has made too much
    /// text.
    pub(super) fn intern(&mut self, text: &Arc<str>) -> u32 {
        self.spend_text(text.len());
        if let Some(number) = self.program.numbers.get(text).or_else(|| self.texts.numbers.get(text)) {
            return *number;
        }
        self.texts.bytes += text.len();
        if self.texts.bytes > MAX_TEXTS {
            self.exhaust(format!("the shader makes more than {} MiB of strings", MAX_TEXTS >> 20));
            return 0;
        }
        let number = (self.program.strings.len() + self.texts.list.len()) as u32;
        self.texts.list.push(text.clone());
        self.texts.numbers.insert(text.clone(), number);
        number
    }

    /// A string that all active lanes share, if they do; reading the first active lane otherwise says which.
    pub(super) fn shared_text(&self, operand: Operand, mask: &Mask) -> Option<Arc<str>> {
        match self.arg(operand) {
            Arg::Same(word) => Some(self.text(word[0].bits())),
            Arg::Each(lanes) => {
                let first = lanes.get(mask.first()?)?.bits();
                let mut same = true;
                mask.for_each(|lane| same &= lanes[lane].bits() == first);
                same.then(|| self.text(first))
            }
        }
    }

    /// The distinct strings among the active lanes, each with the lanes that have it.
    pub(super) fn groups(&self, operand: Operand, mask: &Mask) -> Vec<(Arc<str>, Vec<u32>)> {
        let Arg::Each(lanes) = self.arg(operand) else { return Vec::new() };
        let mut numbers: Vec<u32> = Vec::new();
        mask.for_each(|lane| {
            let number = lanes[lane].bits();
            if !numbers.contains(&number) {
                numbers.push(number);
            }
        });
        numbers
            .into_iter()
            .map(|n| (self.text(n), lanes.iter().map(|l| u32::from(l.bits() == n)).collect()))
            .collect()
    }

    /// The values behind a format string, grouped by their shapes.
    fn shaped(&self, shapes: &[Shape], args: &[Operand], lane: usize) -> Vec<Value> {
        let mut args = args.iter();
        let mut values = Vec::new();
        for shape in shapes {
            let own = args.by_ref().take(shape.count as usize);
            values.push(if shape.kind == Kind::Closure {
                Value::Ready(own.map(|a| self.closure_text(self.bits(*a, lane))).collect())
            } else {
                Value::Consts(own.map(|a| self.value(*a, shape.kind, lane)).collect())
            });
        }
        values
    }

    pub(super) fn format(&mut self, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let (Some((format, rest)), [out]) = (step.args.split_first(), &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let format = self.text(self.bits(*format, lane));
            let text = text::format(&format, &self.shaped(shapes, rest, lane), Flavour::Format);
            self.set_value(*out, lane, &Const::Str(text.into()));
        }
    }

    pub(super) fn print(&mut self, sink: Sink, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let heads = if sink == Sink::File { 2 } else { 1 };
        let (head, rest) = step.args.split_at(heads.min(step.args.len()));
        let Some(format) = head.last() else { return };
        let shader = self.program.shader(step.span);
        for lane in self.active(mask) {
            let format = self.text(self.bits(*format, lane));
            let text = text::format(&format, &self.shaped(shapes, rest, lane), Flavour::Print);
            self.spend_text(text.len());
            let point = self.first + lane;
            match sink {
                Sink::Print => self.say(Printed { point, file: None, text }),
                Sink::File => {
                    let file = Some(self.text(self.bits(head[0], lane)));
                    self.say(Printed { point, file, text });
                }
                Sink::Error => {
                    let text = format!("Shader error [{shader}]: {text}");
                    self.report(step, lane, mask, Message::error(text));
                }
                Sink::Warning => {
                    let text = format!("Shader warning [{shader}]: {text}");
                    self.report(step, lane, mask, Message::warning(text));
                }
            }
        }
    }

    /// Keeps printed text; the end of the run where there is too much.
    fn say(&mut self, printed: Printed) {
        let bytes = printed.text.len() + PRINTED_BESIDE;
        if self.totals.said.fetch_add(bytes, Ordering::Relaxed) + bytes > MAX_PRINTED {
            self.exhaust(format!("the shader prints more than {} MiB", MAX_PRINTED >> 20));
        } else {
            self.messages.print(printed);
        }
    }

    pub(super) fn split(&mut self, pieces: u32, step: &KernelStep, mask: &Mask) {
        let room = self.program.arrays.get(pieces as usize).map_or(0, |a| a.len as usize);
        let mut lanes = self.active(mask);
        // An array that all share is written once.
        if self.program.arrays.get(pieces as usize).is_some_and(|a| !a.varying) {
            lanes.truncate(1);
        }
        for lane in lanes {
            let [Const::Str(s), Const::Str(separator), Const::Int(most)] =
                &self.values(&step.args, &step.kinds, lane)[..]
            else {
                return;
            };
            let most = usize::try_from(*most).unwrap_or(0).min(room);
            let found: Vec<Arc<str>> = text::split(s, separator, most).into_iter().map(Into::into).collect();
            for (index, piece) in found.iter().enumerate() {
                let number = self.intern(piece);
                self.set_element(pieces, index, 0, lane, A::Word::of(number));
            }
            if let Some(out) = step.outs.first() {
                self.set_bits(*out, lane, found.len() as u32);
            }
        }
    }

    pub(super) fn regex(&mut self, whole: bool, places: Option<u32>, step: &KernelStep, mask: &Mask) {
        let array = places.and_then(|p| self.program.arrays.get(p as usize).copied());
        let mut lanes = self.active(mask);
        if array.is_none_or(|a| !a.varying)
            && step.outs.iter().all(|o| matches!(o.place, crate::program::Place::Words(_)))
        {
            lanes.truncate(1);
        }
        let mut last: Option<Arc<str>> = None;
        for lane in lanes {
            let [Const::Str(s), Const::Str(pattern)] = &self.values(&step.args, &step.kinds, lane)[..] else {
                return;
            };
            self.spend_pattern(pattern, last.as_ref() != Some(pattern));
            last = Some(pattern.clone());
            let search = if whole { text::whole } else { text::find };
            let found = search(s, pattern).unwrap_or_else(|()| {
                let text = format!("malformed regular expression \"{}\"", pattern.escape_debug());
                self.report(step, lane, mask, Message::error(text));
                None
            });
            if let (Some(array), Some(places)) = (array, places) {
                for index in 0..array.len as usize {
                    let group = found.as_ref().and_then(|g| *g.get(index / 2)?);
                    // Groups without a match have the length of the pattern, as in the reference.
                    let place = group.map_or(pattern.len(), |(a, b)| if index % 2 == 0 { a } else { b });
                    self.set_element(places, index, 0, lane, A::Word::of(place as u32));
                }
            }
            if let Some(out) = step.outs.first() {
                self.set_bits(*out, lane, found.is_some().into());
            }
        }
    }
}
