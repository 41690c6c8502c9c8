//! Supplies the points at which shaders run, and renders pictures of scenes.
//!
//! A shader is run at *shading points*. This crate generates them: the unit patch as a grid, the points of
//! surfaces that a camera sees, the vertices of a mesh to be displaced, and named data attached to them. It
//! also contains a path tracer, which lets a scene's shaders decide how surfaces scatter light, and the
//! renderer of the reference's tools.
//!
//! A source provides a shader's globals at its points, in common space. This crate must not know the
//! terminal, files or what a shader computes.

pub mod answers;
pub mod bsdf;
pub mod camera;
mod camera_facts;
mod crop;
mod data;
pub mod displace;
mod grid;
pub mod lens;
pub mod light;
mod math;
pub mod mesh;
mod mis;
mod reference;
pub mod render;
pub mod scene;
pub mod shape;
pub mod stage;
pub mod subdivide;
pub mod surface_points;
pub mod testrender;
pub mod view;

// Types of this crate are part of the interface.
pub use glam;

pub use camera_facts::CameraFacts;
pub use crop::Crop;
pub use data::{Data, WithData};
pub use grid::{Grid, reference_spaces, set_screen_spaces};
pub use reference::ReferenceRenderer;
