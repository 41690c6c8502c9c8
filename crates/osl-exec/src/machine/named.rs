//! Messages with computed names: stored by lane and name, as long as the batch lasts.
//!
//! Values are stored as words: strings and closures are numbers that last as long.

use super::Machine;
use super::mask::Mask;
use crate::arithmetic::ArithmeticImpl;
use crate::message::Message;
use crate::step::KernelStep;
use osl_ir::Span;
use osl_ir::ir::MessageForm;
use osl_ir::ir::{MessageMade, other_type, set_late, set_twice};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Bytes charged for a message besides its value.
const MESSAGE_BYTES: u64 = 96;
/// Bytes charged for a word of a value: those of the widest arithmetic.
const WORD_BYTES: u64 = 8;
/// Words that are copied in one step.
const WORDS_A_STEP: usize = 4;

/// The messages of a batch, by lane and number of the name.
#[derive(Debug)]
pub(super) struct Named<W> {
    list: FxHashMap<(usize, u32), Entry<W>>,
}

/// A message that was set, or queried in vain.
#[derive(Debug)]
struct Entry<W> {
    ty: Arc<str>,
    place: Span,
    /// The components of the value, element by element; `None` if it was queried in vain.
    value: Option<Vec<W>>,
}

impl<W> Default for Named<W> {
    fn default() -> Self {
        Named { list: FxHashMap::default() }
    }
}

impl<W> Named<W> {
    pub(super) fn clear(&mut self) {
        self.list.clear();
    }
}

impl<A: ArithmeticImpl> Machine<'_, A> {
    pub(super) fn set_message(&mut self, form: &MessageForm, step: &KernelStep, mask: &Mask) {
        let Some(name) = step.args.first() else { return };
        for lane in self.active(mask) {
            let key = (lane, self.bits(*name, lane));
            match self.named.list.get(&key) {
                None => {
                    let value = self.message_words(form, step, lane);
                    self.keep(key, form, Some(value));
                }
                Some(Entry { place, value, .. }) => {
                    let say = if value.is_some() { set_twice } else { set_late };
                    let places = vec![*place, form.place];
                    let message = Message::error_at(say(&self.text(key.1)), places);
                    self.report(step, lane, mask, message);
                }
            }
            if !self.work.close() {
                return;
            }
        }
    }

    pub(super) fn get_message(&mut self, form: &MessageForm, step: &KernelStep, mask: &Mask) {
        let (Some(name), Some((found, rest))) = (step.args.first(), step.outs.split_first()) else { return };
        for lane in self.active(mask) {
            let key = (lane, self.bits(*name, lane));
            let mut value = None;
            match self.named.list.get(&key) {
                None => self.keep(key, form, None),
                Some(entry) if entry.ty == form.ty => value = entry.value.clone(),
                Some(Entry { ty, place, value }) => {
                    let made = if value.is_some() { MessageMade::Set } else { MessageMade::AskedFor };
                    let text = other_type(&self.text(key.1), made, ty, &form.ty);
                    let message = Message::error_at(text, vec![*place, form.place]);
                    self.report(step, lane, mask, message);
                }
            }
            self.set_bits(*found, lane, value.is_some().into());
            self.work.pay((value.as_ref().map_or(0, Vec::len) / WORDS_A_STEP) as u64);
            if !self.work.close() {
                return;
            }
            let Some(words) = value else { continue };
            match (rest.first(), form.array) {
                (Some(out), _) => self.set_words(*out, lane, &words),
                (None, Some(array)) => self.fill_array(array.0, lane, &words),
                (None, None) => {}
            }
        }
    }

    fn keep(&mut self, key: (usize, u32), form: &MessageForm, value: Option<Vec<A::Word>>) {
        let words = value.as_ref().map_or(0, Vec::len);
        self.work.pay((words / WORDS_A_STEP) as u64);
        if self.work.keep(MESSAGE_BYTES + WORD_BYTES * words as u64) {
            self.named.list.insert(key, Entry { ty: form.ty.clone(), place: form.place, value });
        }
    }

    /// The words of the value that a call sets.
    fn message_words(&self, form: &MessageForm, step: &KernelStep, lane: usize) -> Vec<A::Word> {
        if let Some(array) = form.array {
            let plan = self.program.arrays[array.index()];
            let (len, words) = (plan.len as usize, plan.words as usize);
            return (0..len * words).map(|at| self.element(array.0, at / words, at % words, lane)).collect();
        }
        let Some(value) = step.args.get(1) else { return Vec::new() };
        (0..value.words as usize).map(|c| self.word(self.part(*value, c), lane)).collect()
    }

    fn fill_array(&mut self, array: u32, lane: usize, words: &[A::Word]) {
        let each = self.program.arrays[array as usize].words.max(1) as usize;
        for (at, word) in words.iter().enumerate() {
            self.set_element(array, at / each, at % each, lane, *word);
        }
    }
}
