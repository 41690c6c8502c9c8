//! Messages between layers, as variables of a body. This module must not know how they are set and queried.

use super::SlotId;
use crate::types::Type;
use osl_syntax::span::Span;
use std::sync::Arc;

/// A message that the body may hold.
#[derive(Clone, Debug)]
pub(crate) struct Message {
    /// Its name.
    pub(crate) name: Arc<str>,
    /// 0 for unset, −n for queried without success and n for set, with the type of `values[n - 1]`.
    pub(crate) state: SlotId,
    /// The types with which it is set or queried, the length of an array, and the variable of each.
    pub(crate) values: Vec<(Type, Option<u32>, SlotId)>,
    /// The first call that sets it.
    pub(crate) set: First,
    /// The first call that queries it.
    pub(crate) asked: First,
}

impl Message {
    /// The variables that hold it.
    pub(crate) fn slots(&self) -> impl Iterator<Item = SlotId> {
        std::iter::once(self.state).chain(self.values.iter().map(|(_, _, slot)| *slot))
    }
}

/// The first call in the text that sets or queries a message.
#[derive(Clone, Debug, Default)]
pub(crate) struct First {
    pub(crate) at: Span,
    /// The type, as text; empty if there is no such call.
    pub(crate) ty: String,
}

impl First {
    /// Notes a call, unless there is one already.
    pub(crate) fn note(&mut self, at: Span, ty: &str) {
        if self.ty.is_empty() {
            *self = First { at, ty: ty.to_string() };
        }
    }
}
