//! Compiled shaders as text (`.oso`, version 1.00): reading makes a [resolved tree](crate::hir) from the
//! text, and writing makes the text from a resolved tree.
//!
//! The format is a table of symbols and a list of operations on them. Structured operations (`if`, loops,
//! inlined functions) name the operations at which their parts end. Source: the format's version 1.00, as
//! compilers write it.

pub mod errors;
mod operations;
mod read;
mod text;
mod write;

pub use read::{Read, Rule, Violation, check, read};
pub use write::write;
