//! Machine code for straight runs of vector operations: what a block says, computed for 16 lanes at a time with its
//! intermediate values in registers.
//!
//! An interpreter of vector operations fetches every argument from memory and puts every result back, which takes longer
//! than most operations. Here a [`Block`] of them becomes one loop. Operations are assembled
//! one after the other, registers given on the way.
//!
//! The way of the data: `block` (what is to be computed) → `allocate` (registers and order; `rare` for what seldom happens) → `encode` (bytes) → `code`
//! (memory that runs, and the call). This crate must not know shaders, their operations or their arithmetic; what a shader's
//! operation is in these terms is the client's to say. x86-64 with AVX-512 only: elsewhere there is no [`Code`].

mod allocate;
mod block;
mod code;
mod encode;
mod rare;

pub use allocate::{Assembled, assemble};
pub use block::{Array, Binary, Block, Compare, IntCompare, Truth, Unary, Value};
pub use code::{Code, Scratch, Words, is_supported};
