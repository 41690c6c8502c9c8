//! A lobe: one way to scatter light. Each kind has an albedo, a value for a pair of directions, and a way to
//! choose directions.

use super::diffuse::Diffuse;
use super::facets::FacetLobe;
use super::fresnel;
use super::gloss::{Phong, Ward};
use glam::Vec3;

/// The value of a lobe, or of a whole surface, for a direction of incoming light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// The direction.
    pub wi: Vec3,
    /// The share of light that reaches the viewer, times the cosine, divided by the density.
    pub weight: Vec3,
    /// The density by solid angle with which sampling chooses the direction; infinite if it is the only one,
    /// and 0 if it has none.
    pub pdf: f32,
    /// The roughness of the surface, from 0 to 1: reflected rays widen accordingly.
    pub roughness: f32,
}

impl Sample {
    /// No light from a direction.
    pub(super) fn nothing(wi: Vec3) -> Sample {
        Sample { wi, ..Sample::default() }
    }
}

/// A way to scatter light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lobe {
    /// By the cosine, more or less.
    Diffuse(Diffuse),
    /// Around the mirror direction.
    Phong(Phong),
    /// Around the mirror direction, in another width along each tangent.
    Ward(Ward),
    /// By microfacets.
    Facets(FacetLobe),
    /// A mirror: its normal and index of refraction.
    Reflection(Vec3, f32),
    /// A smooth interface: its normal and index of refraction.
    Refraction(Vec3, f32),
    /// Straight through.
    Transparent,
    /// Below the surface, to leave it elsewhere.
    Subsurface(Inside),
}

/// What is below a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside {
    /// Mean free path between two collisions, for each channel.
    pub radius: Vec3,
    /// The share of light that comes back out.
    pub albedo: Vec3,
    /// The mean cosine of the scattering angle, from -1 to 1.
    pub g: f32,
}

impl Lobe {
    /// The approximate share of light that reaches the viewer.
    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        match self {
            Lobe::Diffuse(lobe) => lobe.albedo(wo),
            Lobe::Facets(lobe) => lobe.albedo(wo),
            Lobe::Reflection(n, eta) => fresnel::mirror(n.dot(wo), *eta),
            Lobe::Refraction(n, eta) => Vec3::ONE - fresnel::mirror(n.dot(wo), *eta),
            Lobe::Subsurface(inside) => inside.albedo,
            Lobe::Phong(_) | Lobe::Ward(_) | Lobe::Transparent => Vec3::ONE,
        }
    }

    /// The value for light from a direction; zero if it has only one direction.
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        match self {
            Lobe::Diffuse(lobe) => lobe.eval(wo, wi),
            Lobe::Phong(lobe) => lobe.eval(wo, wi),
            Lobe::Ward(lobe) => lobe.eval(wo, wi),
            Lobe::Facets(lobe) => lobe.eval(wo, wi),
            _ => Sample::default(),
        }
    }

    /// Samples a direction with three numbers from 0 to 1. Not for light below the surface.
    pub(super) fn sample(&self, wo: Vec3, u: [f32; 3]) -> Sample {
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
            Lobe::Subsurface(_) => Sample::default(),
        }
    }

    /// Whether light comes from a single direction, or from elsewhere on the surface.
    pub(super) fn is_single(&self) -> bool {
        use Lobe::{Reflection, Refraction, Subsurface, Transparent};
        matches!(self, Reflection(..) | Refraction(..) | Transparent | Subsurface(_))
    }

    /// The shading normal, if there is one.
    pub(super) fn normal(&self) -> Option<Vec3> {
        match self {
            Lobe::Diffuse(lobe) => Some(lobe.n),
            Lobe::Phong(lobe) => Some(lobe.n),
            Lobe::Ward(lobe) => Some(lobe.axes.n),
            Lobe::Facets(lobe) => Some(lobe.axes.n),
            Lobe::Reflection(n, _) | Lobe::Refraction(n, _) => Some(*n),
            Lobe::Transparent | Lobe::Subsurface(_) => None,
        }
    }
}
