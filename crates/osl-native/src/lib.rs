//! Turns a straight run of vector operations into machine code that computes 16 lanes at a time and keeps
//! intermediate values in registers.
//!
//! An interpreter of vector operations loads every argument from memory and stores every result, which takes
//! longer than most operations themselves. Here a [`Block`] of operations becomes a single loop. Operations
//! are assembled one after the other, and registers are assigned on the way.
//!
//! Data flows from `block` (the operations) through `allocate` (registers and order; `rare` for operations
//! with a seldom taken path) and `encode` (bytes) to `code` (executable memory and the call). This crate must
//! not know shaders, their operations or their arithmetic; the client expresses a shader's operations in
//! these terms. It supports x86-64 with AVX-512 only: on other machines there is no [`Code`].

mod allocate;
mod block;
mod code;
mod encode;
mod rare;

pub use allocate::{Assembled, assemble};
pub use block::{Array, Binary, Block, Compare, IntCompare, Truth, Unary, Value};
pub use code::{Code, Scratch, Words, is_supported};
