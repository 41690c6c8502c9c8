//! The share of light that an interface reflects, and the direction of the rest.

use crate::math::positive;
use glam::Vec3;
use osl_numeric::strict::pow;

/// Reflection and transmission at an interface of a microfacet lobe.
#[derive(Clone, Copy, Debug)]
pub(super) enum Fresnel {
    /// A dielectric: its index of refraction, and the tints of reflected and transmitted light.
    Dielectric { eta: f32, tints: [Vec3; 2] },
    /// A conductor: the real and imaginary part of its index.
    Conductor { n: Vec3, k: Vec3 },
    /// C. Schlick, "An Inexpensive BRDF Model", 1994: reflection at normal and at grazing incidence, the
    /// exponent, and the same tints.
    Schlick { f0: Vec3, f90: Vec3, exponent: f32, tints: [Vec3; 2] },
}

impl Fresnel {
    /// The reflected share where nothing is transmitted.
    pub(super) fn whole(&self) -> Vec3 {
        match self {
            Fresnel::Dielectric { tints, .. } | Fresnel::Schlick { tints, .. } => tints[0],
            Fresnel::Conductor { .. } => Vec3::ONE,
        }
    }

    /// The reflected and the transmitted share at a cosine.
    pub(super) fn shares(&self, cosine: f32) -> [Vec3; 2] {
        match self {
            Fresnel::Dielectric { eta, tints } => {
                let f = Vec3::splat(dielectric(cosine, *eta));
                [tints[0] * f, tints[1] * (Vec3::ONE - f)]
            }
            Fresnel::Conductor { n, k } => {
                let channel = |c: usize| conductor(cosine, n[c], k[c]);
                [Vec3::new(channel(0), channel(1), channel(2)), Vec3::ZERO]
            }
            Fresnel::Schlick { f0, f90, exponent, tints } => {
                let rest = pow((1.0 - cosine).clamp(0.0, 1.0), *exponent);
                let f = *f0 + (*f90 - *f0) * rest;
                [tints[0] * f, tints[1] * (Vec3::ONE - f)]
            }
        }
    }
}

/// The share of unpolarised light that a dielectric reflects, in R. Cook and K. Torrance's form of the
/// Fresnel equations, 1982. `eta` is the index of refraction on the far side divided by that on the near
/// side; 0 reflects everything. From behind, where the cosine is negative, the index is inverted. Cosines
/// above 1 occur where a shader's normal or tangent is too long.
pub(super) fn dielectric(cosine: f32, eta: f32) -> f32 {
    if eta == 0.0 {
        return 1.0;
    }
    let eta = if cosine < 0.0 { 1.0 / eta } else { eta };
    let c = cosine.abs();
    let g2 = eta * eta - 1.0 + c * c;
    if !positive(g2) {
        return 1.0;
    }
    let g = g2.sqrt();
    let a = (g - c) / (g + c);
    let b = ((g + c) * c - 1.0) / ((g - c) * c + 1.0);
    0.5 * a * a * (1.0 + b * b)
}

/// The reflection of a mirror; zero from behind.
pub(super) fn mirror(cosine: f32, eta: f32) -> Vec3 {
    Vec3::splat(if cosine > 0.0 { dielectric(cosine, eta) } else { 0.0 })
}

/// The Fresnel equations for a conductor in air, unpolarised.
fn conductor(cosine: f32, n: f32, k: f32) -> f32 {
    let c2 = (cosine * cosine).clamp(0.0, 1.0);
    let s2 = 1.0 - c2;
    let (n2, k2) = (n * n, k * k);
    let difference = n2 - k2 - s2;
    let root = (difference * difference + 4.0 * n2 * k2).sqrt();
    let a = (0.5 * (root + difference)).max(0.0).sqrt();
    let (sum, twice) = (root + c2, 2.0 * a * cosine);
    let across = (sum - twice) / (sum + twice);
    let (sum, twice) = (c2 * root + s2 * s2, twice * s2);
    let along = across * (sum - twice) / (sum + twice);
    0.5 * (across + along)
}

/// The direction of light from `wo` after a smooth interface, and the transmitted share; `None` for total
/// reflection. From behind the normal, the index is inverted.
pub(super) fn refract(wo: Vec3, n: Vec3, eta: f32) -> Option<(Vec3, f32)> {
    let (cosine, n, ratio) = match n.dot(wo) {
        c if c > 0.0 => (c, n, 1.0 / eta),
        c => (-c, -n, eta),
    };
    let rest = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if rest < 0.0 || rest.is_nan() {
        return None;
    }
    let wi = n * (ratio * cosine - rest.sqrt()) - wo * ratio;
    Some((wi, 1.0 - dielectric(cosine, eta)))
}
