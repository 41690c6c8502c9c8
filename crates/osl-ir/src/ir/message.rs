//! Messages between layers, as variables of a body, and the words of the errors about them. This module must
//! not know how they are set and queried.

use super::SlotId;
use crate::types::Type;
use osl_syntax::span::Span;
use std::sync::Arc;

/// A message that the body may hold.
#[derive(Clone, Debug)]
pub struct Message {
    /// Its name.
    pub name: Arc<str>,
    /// 0 for unset, −n for queried without success and n for set, with the type of `values[n - 1]`.
    pub state: SlotId,
    /// The types with which it is set or queried, the length of an array, and the variable of each.
    pub values: Vec<(Type, Option<u32>, SlotId)>,
    /// The first call that sets it.
    pub set: First,
    /// The first call that queries it.
    pub asked: First,
}

impl Message {
    /// The variables that hold it.
    pub fn slots(&self) -> impl Iterator<Item = SlotId> {
        std::iter::once(self.state).chain(self.values.iter().map(|(_, _, slot)| *slot))
    }
}

/// The first call in the text that sets or queries a message.
#[derive(Clone, Debug, Default)]
pub struct First {
    /// Where it is.
    pub at: Span,
    /// The type, as text; empty if there is no such call.
    pub ty: String,
}

impl First {
    /// Notes a call, unless there is one already.
    pub fn note(&mut self, at: Span, ty: &str) {
        if self.ty.is_empty() {
            *self = First { at, ty: ty.to_string() };
        }
    }
}

/// The error for a message that is set again; `{0}` is the first location, `{1}` this one.
pub fn set_twice(name: &str) -> String {
    format!("message \"{name}\" already exists (created here: {{0}}) cannot set again from {{1}}")
}

/// The error for a message that is set after it was queried in vain at `{0}`.
pub fn set_late(name: &str) -> String {
    format!(
        "message \"{name}\" was queried before being set (queried here: {{0}}) setting it now ({{1}}) would lead to \
         inconsistent results"
    )
}

/// The error for a message that is queried as another type.
pub fn other_type(name: &str, made: MessageMade, first: &str, wanted: &str) -> String {
    let made = match made {
        MessageMade::Set => "created",
        MessageMade::AskedFor => "queried",
    };
    format!(
        "type mismatch for message \"{name}\" ({made} as {first} here: {{0}}) cannot fetch as {wanted} from {{1}}"
    )
}

/// How a point learned of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageMade {
    /// It was set.
    Set,
    /// It was queried before it was set.
    AskedFor,
}
