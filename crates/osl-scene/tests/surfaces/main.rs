//! Surfaces against what geometry says about them.

mod common;
mod displaced;
mod shapes;
mod subdivided;
