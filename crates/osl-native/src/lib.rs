//! Turns a straight run of vector operations into machine code that computes a vector of lanes at a time and
//! keeps intermediate values in registers.
//!
//! An interpreter of vector operations loads every argument from memory and stores every result, which takes
//! longer than most operations themselves. Here a [`Block`] of operations becomes a single loop. Operations
//! are assembled one after the other, and registers are assigned on the way.
//!
//! A block may contain regions: loops, whose lanes leave one after the other, and parts that are skipped
//! where no lane needs them. They run within the code, vector by vector, and a budget bounds the rounds of a
//! call.
//!
//! Data flows from `block` (a list of `inst`; `simplify` merges some, `region` adds control flow, `pair` lets
//! two vectors go in step, `count` takes masks for numbers, and `hoist` empties loops of what does not
//! change) through `allocate` (order and registers) and an `encoder` (the instructions of one kind of
//! machine) to `code` (executable memory and the call). [`Target`] names the kinds of machines: x86-64 with
//! AVX2 or with AVX-512, whose encoders are `avx2` and `avx512`, both on `x86`, and aarch64, whose encoder is
//! `neon`; it has no regions yet. On other machines there is no [`Code`]. [`mod@interpret`] computes a block
//! without code. This crate must not know shaders, their operations or their arithmetic; the client expresses
//! a shader's operations in these terms.

mod allocate;
mod avx2;
mod avx512;
mod block;
mod code;
mod count;
mod encoder;
mod estimate;
mod hoist;
mod inst;
pub mod interpret;
mod neon;
mod pair;
mod region;
mod simplify;
#[cfg(test)]
mod small;
mod target;
mod x86;

pub use allocate::Assembled;
pub use block::Block;
pub use code::{Code, Outcome, Scratch, Words};
pub use inst::{Array, Binary, Compare, IntCompare, MaskValue, TABLE, Unary, Value};
pub use region::{Begun, Next};
pub use target::Target;
