//! Where shading points come from. For now: the unit patch as a grid, and data by name that go with the points.
//!
//! A source gives the shader's globals at its points, in common space. It must not know the terminal, files
//! or what a shader computes.

mod data;
mod grid;

pub use data::{Data, WithData};
pub use grid::{Grid, reference_spaces};
