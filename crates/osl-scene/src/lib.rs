//! Where shading points come from: the unit patch as a grid, surfaces seen by a camera, vertices that are displaced,
//! data by name that go with the points, and the renderer of the reference's grid tool.
//!
//! A source gives the shader's globals at its points, in common space. It must not know the terminal, files
//! or what a shader computes.

pub mod bsdf;
pub mod camera;
mod data;
pub mod displace;
mod grid;
pub mod light;
mod math;
pub mod mesh;
mod reference;
pub mod render;
pub mod scene;
pub mod shape;
pub mod subdivide;
pub mod surface_points;
pub mod testrender;
pub mod view;

// Its types are part of this interface.
pub use glam;

pub use data::{Data, WithData};
pub use grid::{Grid, reference_spaces, set_screen_spaces};
pub use reference::ReferenceRenderer;
