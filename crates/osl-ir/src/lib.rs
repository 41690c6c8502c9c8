//! Compiles the syntax tree of a shader to optimised IR, a list of typed instructions for one shading point.
//!
//! [`resolve`] binds names and types and makes the [`hir`]. [`lower`] inlines functions and flattens the tree
//! into the [`ir`], one body for a shader or a whole [`group`]. [`passes`] specialise and shrink the body:
//! they fold constants, add the derivatives that texture lookups need, and remove everything that the outputs
//! do not need. `osl-exec` then runs the body over batches of points.
//!
//! [`builtins`] is the one table of library functions, [`numeric`] the arithmetic of one lane that folding
//! and running share, [`text`] the functions on strings, [`components`] the closures of particular renderers,
//! and [`oso`] the text form of compiled shaders, read and written. This crate must not know lanes, masks,
//! instruction sets or the disk.

pub mod builtins;
pub mod components;
mod global;
pub mod group;
pub mod hir;
pub mod ir;
pub mod lint;
pub mod lower;
pub mod numeric;
pub mod oso;
pub mod params;
pub mod passes;
pub mod resolve;
pub mod text;
pub mod types;

pub use osl_syntax::span::Span;
