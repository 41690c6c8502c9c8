//! Where shading points come from. For now: the unit patch as a grid, data by name that go with the points, and the
//! renderer of the reference's grid tool.
//!
//! A source gives the shader's globals at its points, in common space. It must not know the terminal, files
//! or what a shader computes.

mod data;
mod grid;
mod reference;

pub use data::{Data, WithData};
pub use grid::{Grid, reference_spaces};
pub use reference::ReferenceRenderer;
