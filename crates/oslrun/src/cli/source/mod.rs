//! Commands about sources: what is wrong with them, how they look, and what they compile to.

pub(super) mod check;
pub(super) mod compile;
pub(super) mod deps;
pub(super) mod dialects;
pub(super) mod fix;
pub(super) mod fmt;
pub(super) mod group_text;
pub(super) mod info;
pub(super) mod ir;
mod many;
pub(super) mod portability;
