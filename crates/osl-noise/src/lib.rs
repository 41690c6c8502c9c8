//! Computes the noises of Open Shading Language for batches of points: cell, hash, Perlin and simplex noise
//! in one to four dimensions, and Gabor noise.
//!
//! Every field has one inlined body for one point (`cell`, `perlin`, `simplex` on top of
//! `hash`). The scalar functions of `field` call this body, and `batch` puts it into loops that the compiler
//! vectorises for each instruction set (crate `osl-simd`). Registers of points that share cells (`coherent`)
//! use the same formulas of gradient noise, but have the sum over a simplex's corners in a form of their own.
//! Products and sums are rounded one by one, so that all forms give the same bits on every machine. Gabor
//! noise has a variable number of terms and its own options; the module `gabor` contains all of it and uses
//! functions from `math`. This crate must not know that a shading language exists.
//!
//! Sources: the hash is Bob Jenkins' lookup3; gradient noise follows K. Perlin, *Improving Noise*, 2002;
//! simplex noise S. Gustavson, *Simplex noise demystified*, 2005; constants and orders of evaluation are
//! those that OSL renderers agree on.

pub mod batch;
pub mod bounds;
mod cell;
pub mod cells;
#[cfg(target_arch = "x86_64")]
mod coherent;
pub mod field;
mod float;
pub mod gabor;
pub mod hash;
mod lanes;
mod math;
mod number;
mod perlin;
mod range;
mod simplex;
mod unroll;

pub use batch::{BatchFloat, eval, eval_dual, eval_periodic, eval3, eval3_dual, eval3_periodic};
pub use field::Kind;
pub use float::Float;
