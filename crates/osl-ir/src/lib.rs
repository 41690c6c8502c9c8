//! The typed IR of shaders and its passes.
//!
//! A body is a list of typed instructions for one shading point ([`ir`]). [`passes`] specialise and shrink
//! it: they fold constants, add the derivatives that texture lookups need, and remove everything that the
//! outputs do not need. [`types`] are the types of the language, [`global`] the properties of the shading
//! point, and [`text`] the functions on strings, which folding and running share. `osl-lower` makes bodies
//! and `osl-exec` runs them. This crate must not know built-ins by name, the syntax of shaders, lanes, masks,
//! instruction sets or the disk.

pub mod global;
pub mod ir;
pub mod passes;
pub mod text;
pub mod types;

pub use osl_syntax::span::Span;
