//! Strings made at run time, and printing.

use super::Machine;
use super::mask::Mask;
use super::memo::MemoEntry;
use super::runs::Run;
use crate::arithmetic::ArithmeticImpl;
use crate::message::{Message, Printed};
use crate::program::SERIAL;
use crate::step::{KernelStep, Operand};
use osl_ir::ir::{Const, Kind, Shape, Sink};
use osl_ir::text::{self, Flavour, Value};
use osl_lanes::{Arg, Word};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// The strings of a batch besides those of the program. They are numbered after those, and dropped when the
/// batch ends.
#[derive(Debug, Default)]
pub(super) struct Texts {
    list: Vec<Arc<str>>,
    numbers: FxHashMap<Arc<str>, u32>,
}

/// Bytes of text that are made, compared or searched in one step.
pub(super) const BYTES_A_STEP: u64 = 16;
/// Bytes charged for a string besides its contents.
const STRING_BYTES: u64 = 64;
/// Steps for a value that is written as text, besides its bytes.
const VALUE: u64 = 16;
/// Steps for a piece of a string that was split, which becomes a separate string.
const PIECE: u64 = 8;
/// Steps for each group of a pattern whose position is looked up.
const PLACE: u64 = 1;

impl Texts {
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.numbers.clear();
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The string with a number.
    pub(super) fn text(&self, number: u32) -> Arc<str> {
        let known = &self.program.strings;
        let number = number as usize;
        let made = || self.texts.list.get(number - known.len());
        known.get(number).or_else(made).cloned().unwrap_or_else(|| "".into())
    }

    /// Charges for text that is made, compared or searched.
    pub(super) fn pay_text(&mut self, bytes: usize) {
        self.work.pay(bytes as u64 / BYTES_A_STEP);
    }

    /// The number of a string; that of the empty string if there is no room for it.
    pub(super) fn intern(&mut self, text: &Arc<str>) -> u32 {
        self.pay_text(2 * text.len());
        if let Some(number) = self.program.numbers.get(text).or_else(|| self.texts.numbers.get(text)) {
            return *number;
        }
        if !self.work.keep(text.len() as u64 + STRING_BYTES) {
            return 0;
        }
        let number = (self.program.strings.len() + self.texts.list.len()) as u32;
        self.texts.list.push(text.clone());
        self.texts.numbers.insert(text.clone(), number);
        number
    }

    /// A string that all active lanes share, if they do; otherwise the string of the first active lane.
    pub(super) fn uniform_text(&self, operand: Operand, mask: &Mask) -> Option<Arc<str>> {
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

    /// The values after a format string, grouped by their shapes.
    fn shaped(&mut self, shapes: &[Shape], args: &[Operand], lane: usize) -> Vec<Value> {
        self.work.pay(args.len() as u64 * VALUE);
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

    /// The text of a format string and values; its cost is charged.
    fn formatted(&mut self, format: &str, values: &[Value], flavour: Flavour) -> String {
        let text = text::format(format, values, flavour, self.limits.running.string_bytes);
        self.pay_text(format.len() + 4 * text.len());
        text
    }

    pub(super) fn format(&mut self, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let Some((format, rest)) = step.args.split_first() else { return };
        self.once_each(step, mask, |machine, lane| {
            let format = machine.text(machine.bits(*format, lane));
            let values = machine.shaped(shapes, rest, lane);
            Const::Str(machine.formatted(&format, &values, Flavour::Format).into())
        });
    }

    pub(super) fn print(&mut self, sink: Sink, shapes: &[Shape], step: &KernelStep, mask: &Mask) {
        let heads = if sink == Sink::File { 2 } else { 1 };
        let (head, rest) = step.args.split_at(heads.min(step.args.len()));
        let Some(format) = head.last() else { return };
        let shader = self.program.shader(step.span);
        for lane in self.active(mask) {
            let format = self.text(self.bits(*format, lane));
            let values = self.shaped(shapes, rest, lane);
            let text = self.formatted(&format, &values, Flavour::Print);
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
            if !self.work.close() {
                return;
            }
        }
    }

    /// Keeps printed text until the batch ends, for which a point needs memory; the run counts it then.
    fn say(&mut self, printed: Printed) {
        let bytes = self.messages.print(printed);
        self.work.keep(bytes);
    }

    pub(super) fn split(&mut self, pieces: u32, step: &KernelStep, mask: &Mask) {
        let room = self.program.arrays.get(pieces as usize).map_or(0, |a| a.len as usize);
        let mut lanes = self.active(mask);
        // A uniform array is written once.
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
            self.pay_text(4 * s.len());
            let mut count = 0;
            for (index, piece) in text::split(s, separator, most).into_iter().enumerate() {
                self.work.pay(PIECE);
                let number = self.intern(&piece.into());
                self.set_element(pieces, index, 0, lane, A::Word::of(number));
                count = index + 1;
                if index % 1024 == 1023 && !self.work.affords(0) {
                    return;
                }
            }
            if let Some(out) = step.outs.first() {
                self.set_bits(*out, lane, count as u32);
            }
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn regex(&mut self, whole: bool, places: Option<u32>, step: &KernelStep, mask: &Mask) {
        let array = places.and_then(|p| self.program.arrays.get(p as usize).copied());
        let uniform = array.is_none_or(|a| !a.varying)
            && step.outs.iter().all(|o| matches!(o.location, crate::step::Location::Words(_)));
        // Lanes with the same text and pattern share the answer, unless they also want the places.
        let runs = match places {
            None => self.runs(&step.args, &step.outs, mask),
            Some(_) => {
                let lanes = self.active(mask).into_iter().take(if uniform { 1 } else { usize::MAX });
                lanes.map(|lane| Run { lanes: lane..lane + 1, first: lane, active: 1 }).collect()
            }
        };
        let [subject, pattern] = &step.args[..] else { return };
        let mut memo = std::mem::take(&mut self.memo);
        memo.begin();
        for run in runs {
            let lane = run.first;
            let (s, number) = (self.text(self.bits(*subject, lane)), self.bits(*pattern, lane));
            let pattern = self.text(number);
            let making = text::Pattern::making(&pattern);
            let Some(makers) = self.pay_pattern(making, number, &run, (!uniform).then_some(mask)) else {
                return;
            };
            let key = self.key(&step.args, lane).filter(|_| places.is_none());
            let MemoEntry { word, cost } = match key.and_then(|key| memo.find(&key)) {
                Some(known) => {
                    if !self.work.affords(known.cost) {
                        return;
                    }
                    self.work.pay(known.cost);
                    known
                }
                None => {
                    let Some((found, cost)) = self.search_text(whole, &s, &pattern) else { return };
                    let groups = found.as_ref().ok().and_then(Option::as_ref);
                    let known = MemoEntry { word: A::Word::of(groups.is_some().into()), cost };
                    if let (Some(array), Some(places)) = (array, places) {
                        self.work.pay(u64::from(array.len) * PLACE);
                        for index in 0..array.len as usize {
                            let group = groups.and_then(|g| *g.get(index / 2)?);
                            // Groups without a match have the length of the pattern, as in the reference.
                            let place =
                                group.map_or(pattern.len(), |(a, b)| if index % 2 == 0 { a } else { b });
                            self.set_element(places, index, 0, lane, A::Word::of(place as u32));
                        }
                    }
                    if found.is_err() {
                        if let Some(out) = step.outs.first() {
                            self.set_run(*out, run.lanes.clone(), known.word);
                        }
                        let text = format!("malformed regular expression \"{}\"", pattern.escape_debug());
                        if !self.report_run(step, (&run, mask), &text, (makers, making)) {
                            return;
                        }
                        continue;
                    }
                    if let Some(key) = key {
                        memo.keep(key, known);
                    }
                    known
                }
            };
            if let Some(out) = step.outs.first() {
                self.set_run(*out, run.lanes, word);
            }
            // Lanes that compile the pattern cost more than the others.
            let dear = if makers > 0 { makers } else { run.active };
            if !self.work.close_all(dear) {
                return;
            }
            self.work.pay(cost);
            if !self.work.close_all(run.active - dear) {
                return;
            }
        }
        self.memo = memo;
    }

    /// Searches a text for a pattern, and pays for it. Returns the groups that were found, or an error if the
    /// pattern is malformed, and the cost; `None` if the point cannot afford it.
    fn search_text(
        &mut self,
        whole: bool,
        s: &str,
        pattern: &str,
    ) -> Option<(Result<Option<text::Groups>, ()>, u64)> {
        let search = if whole { text::Pattern::whole } else { text::Pattern::find };
        let mut cost = 0;
        let found = text::Pattern::with(pattern, whole, &self.limits.running, |pattern| {
            // The cost of a search depends on both, and is charged in advance.
            cost = pattern.cost(s.len());
            self.work.affords(cost).then(|| {
                self.work.pay(cost);
                search(pattern, s)
            })
        });
        match found {
            Ok(found) => Some((Ok(found?), cost)),
            Err(()) => Some((Err(()), cost)),
        }
    }

    /// Reports a text for each active lane of a run, and ends the work on it. The first `makers` of them pay
    /// for a pattern; the first one has done so. Returns whether the kernel may continue.
    fn report_run(
        &mut self,
        step: &KernelStep,
        (run, mask): (&Run, &Mask),
        text: &str,
        (makers, making): (u64, u64),
    ) -> bool {
        for (at, lane) in (0..).zip(run.lanes.clone().filter(|lane| mask.has(*lane))) {
            if 0 < at && at < makers {
                self.work.pay(making);
            }
            self.report(step, lane, mask, Message::error(text.to_string()));
            if !self.work.close() {
                return false;
            }
        }
        true
    }

    /// Charges for the pattern of a run of lanes, or of all lanes: it is compiled again if it differs from
    /// the last one of a lane. Returns how many lanes compile it, if the point can afford it.
    fn pay_pattern(&mut self, making: u64, number: u32, run: &Run, mask: Option<&Mask>) -> Option<u64> {
        // The patterns of the lanes are followed by the last one of all lanes, and by that of the machine.
        let (all, machine) = (self.width, self.width + 1);
        self.patterns.resize(machine + 1, u32::MAX);
        let mut is_new = |at: usize| {
            let known = self.patterns.get_mut(at).map(|known| std::mem::replace(known, number));
            known != Some(number)
        };
        if is_new(machine) {
            self.work.delay(making);
        }
        let mut makers = 0;
        match mask {
            Some(mask) => {
                let lanes = run.lanes.clone().filter(|lane| mask.has(*lane));
                makers = lanes.map(|lane| u64::from(is_new(lane))).sum();
                if makers > 0 {
                    self.work.pay(making);
                }
            }
            // Which of the points came first depends on the batch.
            None if is_new(all) => self.work.add_all(making.saturating_mul(SERIAL)),
            None => {}
        }
        self.work.affords(0).then_some(makers)
    }
}
