//! The scenes of the reference's `testrender`, and its path tracer.
//!
//! Scenes are XML ([`scene`]) with a [`camera`], spheres and quads ([`shapes`]), shader groups and a
//! [`background`]. Its test pictures have few paths per pixel and are compared directly, so the noise is part
//! of the format: random numbers ([`sampler`]), their order ([`integrator`]) and every formula follow it. `oslrun render` ([`crate::render`]) has its own path tracer, which aims for
//! correct pictures instead. This module must not know files, command lines or how shaders are compiled.

pub mod background;
pub mod camera;
pub mod dual;
pub mod integrator;
mod points;
pub mod sampler;
pub mod scene;
pub mod shapes;
mod world;
pub mod xml;

pub use integrator::{Options, Picture, render};
pub use points::{DERIVS, VARYING};
pub use scene::{GroupText, Scene, SceneError};
pub use world::{Notes, RayServices, World};
