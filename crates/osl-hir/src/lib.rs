//! What a shader means, without an engine: names, types and overloads, from syntax or from a compiled shader.
//!
//! [`resolve`] binds names, checks types, chooses overloads and makes conversions explicit; the result is the
//! [`hir`]. [`lint`] warns about shaders that are accepted. [`builtins`] is the one table of library
//! functions: their parameters, meaning, documentation and facts. [`symbols`] lists the names of a source and
//! the types of its expressions, for editors. [`oso`] reads compiled shaders into the [`hir`] and
//! writes them from it. [`storage`] is what both that writer and lowering know of where values are held. This
//! crate must not know passes, batches or the disk.

pub mod builtins;
pub mod hir;
pub mod lint;
pub mod oso;
pub mod resolve;
pub mod storage;
pub mod symbols;
