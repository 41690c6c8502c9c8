//! The lattice noises of Open Shading Language: cell, hash, Perlin and simplex, in one to four dimensions,
//! and Gabor noise.
//!
//! Every field is written once, as an inlined body for one point (`cell`, `perlin`, `simplex` over
//! `hash`); the scalar functions of `field` call it, and `batch` stamps it into loops that the compiler
//! vectorises for the instruction set in use (`simd`). Products and sums are rounded one by one, so that all
//! forms give the same bits on every machine. Gabor noise has a variable number of terms and options of its own; `gabor` holds
//! all of it, with functions from `math`. This crate must not know that a shading language exists.
//!
//! Sources: the hash is Bob Jenkins' lookup3; gradient noise follows K. Perlin, *Improving Noise*, 2002; simplex
//! noise S. Gustavson, *Simplex noise demystified*, 2005; constants and orders of evaluation are those that OSL
//! renderers agree on.

pub mod batch;
mod cell;
pub mod cells;
#[cfg(target_arch = "x86_64")]
mod coherent;
pub mod field;
mod float;
pub mod gabor;
pub mod hash;
mod math;
mod number;
mod perlin;
pub mod simd;
mod simplex;
mod unroll;

pub use batch::{eval, eval_dual, eval_periodic, eval3, eval3_dual, eval3_periodic};
pub use field::Kind;
pub use float::Float;
pub use simd::{FusedKernel, Isa, Kernel};
