//! Lobes without a preferred direction: they are sampled by their cosine, or uniformly.

use super::{Frame, Sample, cosine};
use crate::math::{fifth_power, square};
use glam::Vec3;
use osl_numeric::strict::{pow, sincos};
use std::f32::consts::{PI, TAU};

/// A diffuse lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Diffuse {
    /// The normal on the side of the incoming light.
    pub(super) n: Vec3,
    /// A factor for each channel.
    pub(super) albedo: Vec3,
    pub(super) kind: Kind,
}

/// How the reflected light depends on the directions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Lambert's law.
    Lambert,
    /// M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model", 1994, the qualitative model:
    /// its two coefficients.
    OrenNayar(f32, f32),
    /// J. Portsmouth, P. Kutz and S. Hill, "EON: A Practical Energy-Preserving Rough Diffuse BRDF", 2025: the
    /// roughness.
    Preserving(f32),
    /// B. Burley, "Physically-Based Shading at Disney", 2012: the roughness.
    Burley(f32),
    /// A. C. Estevez and C. Kulla, "Production Friendly Microfacet Sheen BRDF", 2017: the roughness.
    Sheen(f32),
}

impl Kind {
    /// Oren and Nayar's coefficients for a roughness.
    pub(super) fn oren_nayar(sigma: f32) -> Kind {
        let s2 = sigma * sigma;
        Kind::OrenNayar(1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09))
    }
}

/// The factor of the second coefficient in Oren and Nayar's model, and the two cosines.
fn retro(n: Vec3, wo: Vec3, wi: Vec3) -> (f32, f32, f32) {
    let (i, o) = (n.dot(wi), n.dot(wo));
    (wi.dot(wo) - i * o, i, o)
}

/// Coefficients of the energy-preserving model.
const FON: [f32; 2] = [0.5 - 2.0 / (3.0 * PI), 2.0 / 3.0 - 28.0 / (15.0 * PI)];
/// Polynomial of (1 − cosine) in its directional albedo.
const FON_FIT: [f32; 4] = [0.057_108_53, 0.491_881_87, -0.332_181_44, 0.071_443];

/// The directional albedo of the energy-preserving model without its compensation.
fn single(cosine: f32, roughness: f32) -> f32 {
    let x = 1.0 - cosine;
    let g = FON_FIT.iter().rev().fold(0.0, |sum, c| (sum + c) * x);
    (1.0 + roughness * g) / (1.0 + FON[0] * roughness)
}

fn preserving(albedo: Vec3, roughness: f32, n: Vec3, wo: Vec3, wi: Vec3) -> Vec3 {
    let (s, i, o) = retro(n, wo, wi);
    let s = if s > 0.0 { s / i.max(o) } else { s };
    let a = 1.0 / (1.0 + FON[0] * roughness);
    let once = albedo * (a * (1.0 + roughness * s));
    let mean = a * (1.0 + FON[1] * roughness);
    let rest = |x: f32| (1.0 - x).max(1e-7);
    let more = albedo * albedo * (mean / (Vec3::ONE - albedo * rest(mean)));
    once + more * (rest(single(o, roughness)) * rest(single(i, roughness)) / rest(mean))
}

/// The share of light that sheen reflects: the rational fit of MaterialX.
fn sheen_albedo(cosine: f32, roughness: f32) -> f32 {
    let terms = [1.0, cosine, roughness, cosine * roughness, cosine * cosine, roughness * roughness];
    let sum = |factors: [f32; 6]| factors.iter().zip(terms).map(|(f, t)| f * t).sum::<f32>();
    let top = sum([13.673, -68.780_18, 799.088_25, -905.000_6, 60.289_56, 1_086.964_7]);
    top / sum([1.0, 61.577_46, 442.782_1, 2_597.493, 121.812_41, 3_045.550_8])
}

impl Diffuse {
    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        match self.kind {
            Kind::Sheen(roughness) => self.albedo * sheen_albedo(self.n.dot(wo), roughness).clamp(0.0, 1.0),
            _ => self.albedo,
        }
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        let (s, i, o) = retro(self.n, wo, wi);
        let by_cosine = |factor: Vec3| Sample { wi, weight: factor, pdf: i.max(0.0) / PI, roughness: 1.0 };
        if let Kind::Lambert = self.kind {
            return by_cosine(self.albedo);
        }
        if !(i > 0.0 && o > 0.0) {
            return Sample::nothing(wi);
        }
        match self.kind {
            Kind::Lambert => by_cosine(self.albedo),
            Kind::OrenNayar(a, b) => {
                let slope = if s > 0.0 { s / i.max(o) } else { 0.0 };
                by_cosine(self.albedo * (a + b * slope))
            }
            Kind::Preserving(roughness) => by_cosine(preserving(self.albedo, roughness, self.n, wo, wi)),
            Kind::Burley(roughness) => {
                let h = (wo + wi).normalize_or_zero();
                let grazing = 0.5 + 2.0 * roughness * square(wi.dot(h));
                let edge = |cosine: f32| 1.0 + (grazing - 1.0) * fifth_power((1.0 - cosine).clamp(0.0, 1.0));
                by_cosine(self.albedo * (edge(i) * edge(o)))
            }
            Kind::Sheen(roughness) => {
                let h = (wo + wi).normalize_or_zero();
                let inverse = 1.0 / roughness.max(0.005);
                let cos = self.n.dot(h).clamp(0.0, 1.0);
                let sin = (1.0 - cos * cos).sqrt();
                let density = (2.0 + inverse) * pow(sin, inverse) / TAU;
                let pdf = 1.0 / TAU;
                let value = i * density / (4.0 * (i + o - i * o));
                Sample { wi, weight: self.albedo * (value / pdf), pdf, roughness: 1.0 }
            }
        }
    }

    pub(super) fn sample(&self, wo: Vec3, [x, y, _]: [f32; 3]) -> Sample {
        let local = match self.kind {
            Kind::Sheen(_) => {
                let (sin, cos) = sincos(TAU * x);
                let radius = (1.0 - y * y).max(0.0).sqrt();
                Vec3::new(radius * cos, radius * sin, y)
            }
            // The map from square to disk takes its numbers in reverse order.
            _ => cosine([y, x]),
        };
        self.eval(wo, Frame::around(self.n).world(local))
    }
}
