//! Open Shading Language, from syntax tree to optimised IR.
//!
//! The way of the data: [`resolve`] binds names and types and makes the [`hir`]; [`lower`] inlines and
//! flattens it into the [`ir`], one body for a shader or a whole [`group`]; [`passes`] specialise and shrink that. [`builtins`] is the one table of the
//! library's functions, [`numeric`] the arithmetic of one lane that folding and running share, [`text`] what works
//! on strings, [`components`] what single renderers know of closures, [`oso`] the text form of compiled shaders, read and written. This crate
//! must not know lanes, masks, instruction sets or the disk.

pub mod builtins;
pub mod components;
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
