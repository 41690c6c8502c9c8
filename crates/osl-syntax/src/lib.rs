//! Open Shading Language, from text to syntax tree.
//!
//! The way of the data: [`source`] holds the text, the preprocessor turns it into tokens, the grammar
//! turns those into an [`ast`], and whatever is wrong becomes a [`diagnostic`]. This crate must not know
//! types, lanes, or the disk.

pub mod ast;
pub mod diagnostic;
pub mod source;
pub mod span;
