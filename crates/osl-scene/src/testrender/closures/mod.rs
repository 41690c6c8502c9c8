//! How a surface of a scene scatters light: the components of its closure, as weights and densities.
//!
//! Directions point away from the surface and have length 1. Unlike [`crate::bsdf`], which aims for correct
//! pictures, this module follows the reference's integrator exactly, including its approximations: test
//! pictures have few paths per pixel, so the noise must be the same. This module must not know rays, lights
//! or how shaders run.

mod build;
mod diffuse;
mod facets;
mod fresnel;
mod gloss;

use crate::bsdf::Frame;
use crate::testrender::camera::orthogonal;
use crate::testrender::mis;
use crate::testrender::positive;
use diffuse::Diffuse;
use facets::FacetLobe;
use glam::Vec3;
use gloss::{Phong, Ward};

pub use build::{Surface, background, emitted};

/// The value of a lobe for a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The direction.
    pub wi: Vec3,
    /// The share that reaches the viewer, times the cosine, divided by the density.
    pub weight: Vec3,
    /// The density by solid angle; infinite if it is the only direction.
    pub pdf: f32,
    /// The roughness of the surface, from 0 to 1: reflected rays widen accordingly.
    pub roughness: f32,
}

/// A way to scatter light.
#[derive(Clone, Copy, Debug)]
enum Lobe {
    Diffuse(Diffuse),
    Phong(Phong),
    Ward(Ward),
    Facets(FacetLobe),
    /// A mirror: its normal and index of refraction.
    Reflection(Vec3, f32),
    /// A smooth interface: its normal and index of refraction.
    Refraction(Vec3, f32),
    Transparent,
}

/// Axes around a normal, for all lobes.
fn frame(n: Vec3) -> Frame {
    let [x, y] = orthogonal(n);
    Frame { x, y, n }
}

/// Axes around a normal, the first along a tangent if there is one. Measured: their length is that of the
/// tangent.
fn frame_along(n: Vec3, tangent: Vec3) -> Frame {
    let y = n.cross(tangent);
    if y.length_squared() > 0.0 { Frame { x: y.cross(n), y, n } } else { frame(n) }
}

impl Lobe {
    /// The approximate share of light that reaches the viewer.
    fn albedo(&self, wo: Vec3) -> Vec3 {
        match self {
            Lobe::Diffuse(lobe) => lobe.albedo(wo),
            Lobe::Facets(lobe) => lobe.albedo(wo),
            Lobe::Reflection(n, eta) => fresnel::mirror(n.dot(wo), *eta),
            Lobe::Refraction(n, eta) => Vec3::ONE - fresnel::mirror(n.dot(wo), *eta),
            Lobe::Phong(_) | Lobe::Ward(_) | Lobe::Transparent => Vec3::ONE,
        }
    }

    /// The value for light from a direction; zero if it has only one direction.
    fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        match self {
            Lobe::Diffuse(lobe) => lobe.eval(wo, wi),
            Lobe::Phong(lobe) => lobe.eval(wo, wi),
            Lobe::Ward(lobe) => lobe.eval(wo, wi),
            Lobe::Facets(lobe) => lobe.eval(wo, wi),
            Lobe::Reflection(..) | Lobe::Refraction(..) | Lobe::Transparent => Sample::default(),
        }
    }

    /// Samples a direction with three numbers from 0 to 1.
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Sample {
        let only = |wi: Vec3, weight: Vec3| Sample { wi, weight, pdf: f32::INFINITY, roughness: 0.0 };
        match self {
            Lobe::Diffuse(lobe) => lobe.sample(wo, u),
            Lobe::Phong(lobe) => lobe.sample(wo, u),
            Lobe::Ward(lobe) => lobe.sample(wo, u),
            Lobe::Facets(lobe) => lobe.sample(wo, u),
            Lobe::Reflection(n, eta) => {
                let cosine = n.dot(wo);
                if cosine > 0.0 {
                    only(*n * (2.0 * cosine) - wo, fresnel::mirror(cosine, *eta))
                } else {
                    Sample::default()
                }
            }
            Lobe::Refraction(n, eta) => match fresnel::refract(wo, *n, *eta) {
                Some((wi, share)) => only(wi, Vec3::splat(share)),
                None => Sample::default(),
            },
            Lobe::Transparent => only(-wo, Vec3::ONE),
        }
    }
}

/// Maximum number of lobes at a point, as in the reference; further ones have no effect.
const MAX_LOBES: usize = 8;
/// The largest number below 1.
const BELOW_ONE: f32 = 0.999_999_94;

/// The lobes of a point with their weights.
#[derive(Clone, Debug, Default)]
pub struct Lobes {
    lobes: Vec<(Lobe, Vec3)>,
    /// The probability of each lobe; their sum may be less than 1.
    chances: Vec<f32>,
}

impl Lobes {
    fn add(&mut self, lobe: Lobe, weight: Vec3) {
        if self.lobes.len() < MAX_LOBES {
            self.lobes.push((lobe, weight));
        }
    }

    /// Sets the probabilities of the lobes for a path with this throughput. Unless paths may be `absorbed`,
    /// they sum to 1.
    pub fn prepare(&mut self, wo: Vec3, throughput: Vec3, absorbed: bool) {
        let whole = 1.0 / throughput.element_sum();
        let chance = |(lobe, weight): &(Lobe, Vec3)| weight.dot(throughput * lobe.albedo(wo)) * whole;
        self.chances = self.lobes.iter().map(chance).collect();
        let total: f32 = self.chances.iter().sum();
        if total > 1.0 || (!absorbed && total > 0.0) {
            self.chances.iter_mut().for_each(|c| *c /= total);
        }
    }

    /// The approximate share of light that reaches the viewer.
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        self.lobes.iter().map(|(lobe, weight)| *weight * lobe.albedo(wo)).sum()
    }

    /// The sum of all lobes for light from a direction.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        let mut all = Sample { wi, ..Sample::default() };
        for at in 0..self.lobes.len() {
            self.mix(&mut all, at, wo);
        }
        all
    }

    /// Mixes a lobe into a sample by the balance heuristic.
    fn mix(&self, sample: &mut Sample, at: usize, wo: Vec3) {
        let (Some((lobe, weight)), Some(chance)) = (self.lobes.get(at), self.chances.get(at)) else { return };
        let other = lobe.eval(wo, sample.wi);
        mis::mix((&mut sample.weight, &mut sample.pdf), other.weight * *weight, other.pdf, *chance);
        sample.roughness += other.roughness * chance;
    }

    /// Samples a direction with three numbers from 0 to 1. The density is 0 if the light is absorbed.
    pub fn sample(&self, wo: Vec3, [xi, yi, zi]: [f32; 3]) -> Sample {
        let mut before = 0.0;
        for (at, (lobe, weight)) in self.lobes.iter().enumerate() {
            let Some(chance) = self.chances.get(at).copied() else { break };
            if xi < before + chance {
                let inside = ((xi - before) / chance).min(BELOW_ONE);
                let mut sample = lobe.sample(wo, [inside, yi, zi]);
                sample.weight *= *weight / chance;
                sample.pdf *= chance;
                if !positive(sample.pdf) {
                    return Sample::default();
                }
                let roughness = sample.roughness;
                for other in (0..self.lobes.len()).filter(|other| *other != at) {
                    self.mix(&mut sample, other, wo);
                }
                return Sample { roughness, ..sample };
            }
            before += chance;
        }
        Sample::default()
    }
}

#[cfg(test)]
mod tests;
