//! Dictionary lookups over lanes.

use super::Machine;
use super::mask::Mask;
use super::text::BYTES_A_STEP;
use crate::arithmetic::ArithmeticImpl;
use crate::dictionary::{Cost, Start};
use crate::message::Message;
use crate::step::{KernelStep, Location};
use osl_ir::ir::{Const, Kind};

impl<A: ArithmeticImpl> Machine<'_, A> {
    /// The first node that a path finds in a text or below a node.
    pub(super) fn dict_find(&mut self, step: &KernelStep, mask: &Mask) {
        let Some(out) = step.outs.first() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let args = self.values(&step.args, &step.kinds, lane);
            let textures = &self.services.textures;
            let mut is_file = None;
            let (start, path) = match &args[..] {
                [Const::Str(name), Const::Str(path)] if name.ends_with(".xml") => {
                    is_file = Some(name.clone());
                    (Start::File(name, &|most| textures.read_text(name, most)), path)
                }
                [Const::Str(text), Const::Str(path)] => (Start::Document(text), path),
                [Const::Int(node), Const::Str(path)] => (Start::Node(*node), path),
                _ => return,
            };
            let of = self.own(step, lane);
            let work = &mut self.work;
            let mut affords = |cost: Cost| {
                work.pay(cost.steps);
                work.affords(0) && work.keep(cost.bytes)
            };
            let found = self.dictionaries.find(of, &start, path, &mut affords);
            let node = found.unwrap_or_else(|why| {
                let message = Message::error(format!("dict_find: {why}"));
                self.report(step, lane, mask, Message { file: is_file, ..message });
                -1
            });
            self.set_bits(*out, lane, node as u32);
            if !self.work.close() {
                return;
            }
        }
    }

    /// The owner of the node that a step finds: a lane, or all lanes.
    fn own(&self, step: &KernelStep, lane: usize) -> Option<usize> {
        let uniform =
            !step.outs.is_empty() && step.outs.iter().all(|o| matches!(o.location, Location::Words(_)));
        (!uniform).then_some(lane)
    }

    pub(super) fn dict_next(&mut self, step: &KernelStep, mask: &Mask) {
        let ([node], [out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let (node, of) = (self.bits(*node, lane) as i32, self.own(step, lane));
            let work = &mut self.work;
            let mut affords = |cost: Cost| {
                work.pay(cost.steps);
                work.keep(cost.bytes)
            };
            let next = self.dictionaries.next(of, node, &mut affords);
            self.set_bits(*out, lane, next as u32);
            if !self.work.close() {
                return;
            }
        }
    }

    /// An attribute or the text of a node, as values of a kind.
    pub(super) fn dict_value(&mut self, kind: Kind, count: usize, step: &KernelStep, mask: &Mask) {
        let Some((found, outs)) = step.outs.split_last() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let [Const::Int(node), Const::Str(name)] = &self.values(&step.args, &step.kinds, lane)[..] else {
                return;
            };
            let of = self.own(step, lane);
            let text = self.dictionaries.value(of, *node, name);
            self.work.pay(text.map_or(0, str::len) as u64 / BYTES_A_STEP * 4);
            if !self.work.affords(0) {
                return;
            }
            let values = text.and_then(|text| values(text, kind, count.max(1)));
            self.set_bits(*found, lane, values.is_some().into());
            for (out, value) in outs.iter().zip(values.into_iter().flatten()) {
                self.set_value(*out, lane, &value);
            }
            if !self.work.close() {
                return;
            }
        }
    }
}

/// Exactly `count` values of a kind; numbers are separated by commas or blanks.
fn values(text: &str, kind: Kind, count: usize) -> Option<Vec<Const>> {
    if kind == Kind::Str {
        return (count == 1).then(|| vec![Const::Str(text.into())]);
    }
    let each = match kind {
        Kind::Triple => 3,
        Kind::Matrix => 16,
        _ => 1,
    };
    let words: Vec<&str> = text.split([',', ' ', '\t', '\n']).filter(|w| !w.is_empty()).collect();
    if words.len() != count * each {
        return None;
    }
    let numbers = |words: &[&str]| words.iter().map(|w| w.parse::<f32>().ok()).collect::<Option<Vec<f32>>>();
    words
        .chunks(each)
        .map(|words| {
            Some(match kind {
                Kind::Int => Const::Int(words.first()?.parse().ok()?),
                Kind::Float => Const::Float(*numbers(words)?.first()?),
                Kind::Triple => Const::Triple(numbers(words)?.try_into().ok()?),
                Kind::Matrix => Const::Matrix(Box::new(numbers(words)?.try_into().ok()?)),
                Kind::Str | Kind::Closure => return None,
            })
        })
        .collect()
}
