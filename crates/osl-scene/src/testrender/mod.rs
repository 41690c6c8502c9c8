//! The scenes of the reference's `testrender`, and its path tracer.
//!
//! Scenes are XML ([`scene`]) with a [`camera`], spheres and quads ([`shapes`]), shader groups and a [`background`]. Its test
//! pictures have few paths a pixel and are compared as they are, so the noise is part of the format: random numbers
//! ([`sampler`]), their order ([`integrator`]) and every formula of the [`closures`] follow it. `oslrun render` ([`crate::render`]) has
//! a path tracer of its own, whose pictures are to be right rather than the same. This module must not know files, command lines
//! or how shaders are compiled.

pub mod background;
pub mod camera;
pub mod closures;
pub mod dual;
pub mod integrator;
mod mis;
mod points;
pub mod sampler;
pub mod scene;
pub mod shapes;
mod world;
pub mod xml;

pub use integrator::{Options, Picture, render};
pub use points::{SLOPES, VARYING};
pub use scene::{GroupText, Scene, SceneError};
pub use world::{Notes, RayServices, World};

/// Whether a number is above 0; NaN is not.
fn positive(x: f32) -> bool {
    x > 0.0
}
