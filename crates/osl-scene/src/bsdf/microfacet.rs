//! Rough surfaces as tiny mirrors, after B. Walter et al., "Microfacet Models for Refraction through Rough
//! Surfaces", 2007. Directions are in the axes of the surface and point away from it.

use super::{disk, fresnel};
use crate::math;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// The distribution of facet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Long tails.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

/// Facets, with their roughness along both tangents.
#[derive(Clone, Copy, Debug)]
pub struct Facets {
    /// Their distribution.
    pub distribution: Distribution,
    /// Roughness along x and y.
    pub alpha: Vec2,
}

impl Facets {
    /// The density of facets with the normal `h`, by area of the surface and solid angle.
    pub fn density(&self, h: Vec3) -> f32 {
        if h.z <= 0.0 {
            return 0.0;
        }
        let slope = Vec2::new(h.x, h.y) / self.alpha;
        let (cos2, area) = (h.z * h.z, PI * self.alpha.x * self.alpha.y);
        match self.distribution {
            Distribution::Ggx => {
                let e = slope.length_squared() + cos2;
                1.0 / (area * e * e)
            }
            Distribution::Beckmann => math::exp(-slope.length_squared() / cos2) / (area * cos2 * cos2),
        }
    }

    /// Smith's function: hidden facets relative to those visible from `w`.
    pub(crate) fn hidden(&self, w: Vec3) -> f32 {
        let across = (Vec2::new(w.x, w.y) * self.alpha).length_squared();
        let tan2 = across / (w.z * w.z).max(1e-12);
        if tan2 <= 0.0 {
            return 0.0;
        }
        match self.distribution {
            Distribution::Ggx => 0.5 * ((1.0 + tan2).sqrt() - 1.0),
            Distribution::Beckmann => {
                // Walter's rational approximation, equation 24.
                let a = 1.0 / tan2.sqrt();
                if a >= 1.6 { 0.0 } else { (1.0 - 1.259 * a + 0.396 * a * a) / (3.535 * a + 2.181 * a * a) }
            }
        }
    }

    /// The share of the facets visible from `w`.
    fn seen(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(w))
    }

    /// The share of the facets visible from both directions.
    fn seen_by_both(&self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.hidden(wo) + self.hidden(wi))
    }

    /// Chooses a facet normal, with the density by solid angle of [`Facets::normal_density`].
    pub fn normal(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        match self.distribution {
            Distribution::Ggx => self.visible_normal(wo, u),
            Distribution::Beckmann => {
                let tan2 = -math::ln((1.0 - u[0]).max(f32::MIN_POSITIVE));
                let (sin, cos) = math::sin_cos(2.0 * PI * u[1]);
                let slope = Vec2::new(cos, sin) * tan2.sqrt() * self.alpha;
                Vec3::new(slope.x, slope.y, 1.0).normalize()
            }
        }
    }

    /// Chooses among the facets visible from `wo`. E. Heitz, "Sampling the GGX Distribution of Visible
    /// Normals", 2018.
    fn visible_normal(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(self.alpha.x * wo.x, self.alpha.y * wo.y, wo.z).normalize_or(Vec3::Z);
        let across = Vec3::Z.cross(stretched).try_normalize().unwrap_or(Vec3::X);
        let up = stretched.cross(across);
        let mut p = disk(u);
        let s = 0.5 * (1.0 + stretched.z);
        p.y = (1.0 - s) * (1.0 - p.x * p.x).max(0.0).sqrt() + s * p.y;
        let n = across * p.x + up * p.y + stretched * (1.0 - p.length_squared()).max(0.0).sqrt();
        Vec3::new(self.alpha.x * n.x, self.alpha.y * n.y, n.z.max(1e-6)).normalize()
    }

    /// The density with which [`Facets::normal`] chooses `h`, by solid angle.
    pub fn normal_density(&self, wo: Vec3, h: Vec3) -> f32 {
        match self.distribution {
            Distribution::Ggx => self.seen(wo) * self.density(h) * wo.dot(h).max(0.0) / wo.z.abs().max(1e-6),
            Distribution::Beckmann => self.density(h) * h.z.max(0.0),
        }
    }

    /// The light reflected from `wi` to `wo`, times the cosine of `wi`, divided by the Fresnel factor; the
    /// density with which `wi` is chosen; and the half vector. `wo` is above the surface.
    pub fn reflected(&self, wo: Vec3, wi: Vec3) -> Option<(f32, f32, Vec3)> {
        let h = (wo + wi).try_normalize()?;
        if wi.z <= 0.0 || wo.z <= 0.0 || h.z <= 0.0 {
            return None;
        }
        let cosine = wo.dot(h);
        let value = self.density(h) * self.seen_by_both(wo, wi) / (4.0 * wo.z);
        Some((value, self.normal_density(wo, h) / (4.0 * cosine.max(1e-6)), h))
    }

    /// The same for light from below: `eta` is the index of refraction there divided by that above. Radiance
    /// is not scaled by the square of `eta`, so light that enters and leaves again is unchanged.
    pub fn refracted(&self, wo: Vec3, wi: Vec3, eta: f32) -> Option<(f32, f32, Vec3)> {
        let h = (wo + wi * eta).try_normalize()?;
        let h = if h.z < 0.0 { -h } else { h };
        let (co, ci) = (wo.dot(h), wi.dot(h));
        if wi.z >= 0.0 || wo.z <= 0.0 || co <= 0.0 || ci >= 0.0 {
            return None;
        }
        let sum = co + eta * ci;
        let turn = eta * eta * -ci / (sum * sum).max(1e-12);
        let value = self.density(h) * self.seen_by_both(wo, wi) * co * turn / wo.z;
        Some((value, self.normal_density(wo, h) * turn, h))
    }

    /// The approximate mean Fresnel factor as seen from `wo`: that of the flat surface.
    pub fn reflectance(&self, wo: Vec3, eta: f32) -> f32 {
        fresnel::dielectric(wo.z, eta)
    }
}
