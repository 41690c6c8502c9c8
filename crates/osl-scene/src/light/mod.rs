//! Light sources: spherical lamps and the sky.
//!
//! Each kind of light can be sampled from a point, and returns the density of a direction that was chosen
//! otherwise, as multiple importance sampling requires.

mod sky;

pub use sky::Sky;

use crate::bsdf::Frame;
use crate::math;
use glam::Vec3;
use std::f32::consts::{PI, TAU};

/// Light that arrives at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// The direction that it comes from, of length 1.
    pub wi: Vec3,
    /// Distance to the light.
    pub distance: f32,
    /// Radiance divided by the density of the choice.
    pub weight: Vec3,
    /// The density of the direction by solid angle; infinite if it is the only one.
    pub pdf: f32,
}

/// A light that does not fall off with distance: a white diffuse surface that faces it has the radiance
/// `color`.
///
/// A sphere of radius `r` at distance `d` covers the share `r²/d²` of the cosine-weighted sky, so its
/// radiance is `color · d²/r²`. It casts no shadow, and cameras do not see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// Its center.
    pub position: Vec3,
    /// Its radius; 0 means a point light.
    pub radius: f32,
    /// Color times intensity.
    pub color: Vec3,
}

impl SphereLight {
    /// The cosine of its angular radius minus 1 (negative), and its radiance.
    fn cone(&self, p: Vec3) -> Option<(f32, Vec3)> {
        let d2 = (self.position - p).length_squared();
        let sin2 = self.radius * self.radius / d2;
        // There is no light from inside.
        (sin2 < 1.0 && sin2 > 0.0).then(|| (sin2 / (1.0 + (1.0 - sin2).sqrt()), self.color / sin2))
    }

    /// Samples light that arrives at a point.
    pub fn sample(&self, p: Vec3, u: [f32; 2]) -> Option<Arriving> {
        let to = self.position - p;
        let distance = to.length();
        let axis = to.try_normalize()?;
        if self.radius == 0.0 {
            return Some(Arriving { wi: axis, distance, weight: self.color * PI, pdf: f32::INFINITY });
        }
        let (open, radiance) = self.cone(p)?;
        let below = u[0] * open;
        let r = (below * (2.0 - below)).max(0.0).sqrt();
        let (sin, cos) = math::sin_cos(TAU * u[1]);
        let wi = Frame::around(axis).world(Vec3::new(r * cos, r * sin, 1.0 - below)).normalize();
        let pdf = 1.0 / (TAU * open);
        let along = to.dot(wi);
        let across = (distance * distance - along * along).max(0.0);
        let distance = along - (self.radius * self.radius - across).max(0.0).sqrt();
        Some(Arriving { wi, distance, weight: radiance / pdf, pdf })
    }

    /// Its radiance along a ray that is unobstructed up to `reach`, and the density with which sampling
    /// chooses that direction.
    pub fn seen(&self, p: Vec3, wi: Vec3, reach: f32) -> Option<(Vec3, f32)> {
        let (open, radiance) = self.cone(p)?;
        let to = self.position - p;
        let along = to.dot(wi);
        let across = (to - wi * along).length_squared();
        let inside = self.radius * self.radius - across;
        let hit = along > 0.0 && inside > 0.0 && along - inside.sqrt() < reach;
        hit.then(|| (radiance, 1.0 / (TAU * open)))
    }
}

#[cfg(test)]
mod tests;
