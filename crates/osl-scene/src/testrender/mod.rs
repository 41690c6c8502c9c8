//! The scenes of the reference's `testrender`, and its path tracer.
//!
//! Scenes are XML ([`scene`]) with a [`camera`], spheres, quads and meshes ([`shapes`]), shader groups and a
//! [`background`]. Its test pictures have few paths per pixel and are compared directly, so the noise is part
//! of the format: random numbers ([`sampler`]) and their order ([`integrator`]) follow it. Closures are those
//! of [`crate::bsdf`] with the rules of this tool.

pub mod background;
pub mod camera;
pub mod integrator;
pub mod sampler;
pub mod scene;
pub mod shapes;
mod world;
pub mod xml;

pub use integrator::{Options, Picture, render};
pub use scene::{GroupText, Scene, SceneError};
pub use world::{Notes, RayServices, World};
