//! Dictionary lookups over lanes.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::Arithmetic;
use crate::dictionary::Start;
use crate::message::Message;
use crate::program::KernelStep;
use osl_ir::ir::{Const, Kind};

/// Bytes of a dictionary that is a file.
const MAX_FILE: u64 = 1 << 24;

impl<A: Arithmetic> Machine<'_, A> {
    /// The first node that a path finds in a text or below a node.
    pub(super) fn dict_find(&mut self, step: &KernelStep, mask: &Mask) {
        let Some(out) = step.outs.first() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let args = self.values(&step.args, &step.kinds, lane);
            let found = match &args[..] {
                [Const::Str(name), Const::Str(path)] if name.ends_with(".xml") => {
                    let text = self.services.textures.read_text(name, MAX_FILE);
                    text.and_then(|text| self.dictionaries.find(&Start::Document(&text), path))
                }
                [Const::Str(text), Const::Str(path)] => self.dictionaries.find(&Start::Document(text), path),
                [Const::Int(node), Const::Str(path)] => self.dictionaries.find(&Start::Node(*node), path),
                _ => Ok(0),
            };
            let node = found.unwrap_or_else(|why| {
                let message = Message::error(format!("dict_find: {why}"));
                let file = match args.first() {
                    Some(Const::Str(name)) if name.ends_with(".xml") => Some(name.clone()),
                    _ => None,
                };
                self.report(step, lane, mask, Message { file, ..message });
                -1
            });
            self.set_bits(*out, lane, node as u32);
        }
    }

    pub(super) fn dict_next(&mut self, step: &KernelStep, mask: &Mask) {
        let ([node], [out]) = (&step.args[..], &step.outs[..]) else { return };
        for lane in self.lanes(&step.outs, mask) {
            let next = self.dictionaries.next(self.bits(*node, lane) as i32);
            self.set_bits(*out, lane, next as u32);
        }
    }

    /// An attribute or the text of a node, as values of a kind.
    pub(super) fn dict_value(&mut self, kind: Kind, count: usize, step: &KernelStep, mask: &Mask) {
        let Some((found, outs)) = step.outs.split_last() else { return };
        for lane in self.lanes(&step.outs, mask) {
            let [Const::Int(node), Const::Str(name)] = &self.values(&step.args, &step.kinds, lane)[..] else {
                return;
            };
            let values =
                self.dictionaries.value(*node, name).and_then(|text| values(text, kind, count.max(1)));
            self.set_bits(*found, lane, values.is_some().into());
            for (out, value) in outs.iter().zip(values.into_iter().flatten()) {
                self.set_value(*out, lane, &value);
            }
        }
    }
}

/// Exactly `count` values of a kind, numbers separated by commas or blanks.
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
