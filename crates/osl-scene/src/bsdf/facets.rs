//! Rough surfaces as tiny mirrors, after B. Walter et al., "Microfacet Models for Refraction through Rough
//! Surfaces", 2007. Visible normals are sampled by their slopes: E. Heitz and E. d'Eon, "Importance Sampling
//! Microfacet-Based BSDFs using the Distribution of Visible Normals", 2014.

use super::fresnel::{self, Fresnel, dielectric};
use super::{Frame, Rules, Sample};
use crate::math::{self, positive};
use glam::{Vec2, Vec3};
use osl_numeric::strict::{acos, erf, ierf};
use std::f32::consts::PI;

/// The distribution of facet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Distribution {
    /// Long tails.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

/// A microfacet lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetLobe {
    pub(super) axes: Frame,
    pub(super) distribution: Distribution,
    /// Roughness along the first and the second tangent.
    pub(super) alpha: Vec2,
    pub(super) kind: Kind,
    pub(super) rules: Rules,
}

/// How facets scatter light.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    /// Those of `microfacet`: a dielectric that reflects, refracts, or chooses between the two by the Fresnel
    /// term.
    Plain { eta: f32, reflects: bool, refracts: bool },
    /// Those of MaterialX: the Fresnel term, and the index of refraction if light is transmitted.
    Tinted { fresnel: Fresnel, eta: Option<f32> },
}

impl FacetLobe {
    pub(super) fn albedo(&self, wo: Vec3) -> Vec3 {
        let cosine = self.axes.n.dot(wo);
        match self.kind {
            Kind::Plain { reflects: true, refracts: true, .. } => Vec3::ONE,
            Kind::Plain { eta, refracts, .. } => {
                let f = dielectric(cosine, eta);
                Vec3::splat(if refracts { 1.0 - f } else { f })
            }
            Kind::Tinted { eta: Some(_), .. } if self.rules == Rules::Testrender => Vec3::ONE,
            Kind::Tinted { fresnel, eta } => {
                let [f, t] = fresnel.shares(cosine);
                if eta.is_some() { f + t } else { f }
            }
        }
    }

    /// The index of refraction if light is transmitted.
    fn transmits(&self) -> Option<f32> {
        match self.kind {
            Kind::Plain { eta, refracts, .. } => refracts.then_some(eta),
            Kind::Tinted { eta, .. } => eta,
        }
    }

    /// The density of facets with the normal `h`, by area of the surface and solid angle.
    fn density(&self, h: Vec3) -> f32 {
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
    fn hidden(&self, w: Vec3) -> f32 {
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

    /// Weight and probability of reflection and of transmission at a facet; `sampled` if the facet was chosen
    /// at random.
    fn choices(&self, cosine: f32, sampled: bool) -> [(Vec3, f32); 2] {
        match &self.kind {
            Kind::Plain { eta, reflects, refracts } => {
                let f = dielectric(cosine, *eta);
                if *reflects && *refracts {
                    [(Vec3::ONE, f), (Vec3::ONE, 1.0 - f)]
                } else {
                    [(Vec3::splat(f), 1.0), (Vec3::splat(1.0 - f), 1.0)]
                }
            }
            Kind::Tinted { fresnel, eta } => {
                let [f, t] = fresnel.shares(cosine);
                let total = |eta: f32| 1.0 - cosine * cosine >= eta * eta;
                match eta {
                    None => return [(f, 1.0), (Vec3::ZERO, 0.0)],
                    // Schlick's term does not know total reflection.
                    Some(eta) if self.rules == Rules::Correct && total(*eta) => {
                        return [(fresnel.whole(), 1.0), (Vec3::ZERO, 0.0)];
                    }
                    Some(_) => {}
                }
                let through = t.element_sum() / (f.element_sum() + t.element_sum()).max(f32::MIN_POSITIVE);
                let back = 1.0 - through;
                let by = |share: Vec3, chance: f32| if chance > 0.0 { share / chance } else { Vec3::ZERO };
                match (self.rules, sampled) {
                    (Rules::Correct, _) => [(by(f, back), back), (by(t, through), through)],
                    // Measured: reflection is sampled with the density of transmission; where a direction is
                    // given rather than sampled, transmission has the share of reflection.
                    (Rules::Testrender, true) => [(by(f, back), through), (by(t, through), through)],
                    (Rules::Testrender, false) => [(by(f, back), back), (by(f, 0.5), 0.5)],
                }
            }
        }
    }

    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Sample {
        let (o, i) = (self.axes.local(wo), self.axes.local(wi));
        let reflects = !matches!(self.kind, Kind::Plain { reflects: false, .. });
        if !positive(o.z) {
            return Sample::nothing(wi);
        }
        if i.z > 0.0 && reflects {
            let m = (i + o).normalize_or_zero();
            let choice = self.choices(m.dot(o), false)[0];
            return self.reflected([o, i, m], choice, wi);
        }
        match self.transmits() {
            Some(eta) if i.z < 0.0 => {
                let sum = i * eta + o;
                let m = if eta < 1.0 { sum } else { -sum }.normalize_or_zero();
                let choice = self.choices(m.dot(o), false)[1];
                let scale = match self.rules {
                    // A facet cannot be seen from behind.
                    Rules::Correct if !(m.dot(o) > 0.0 && m.dot(i) < 0.0) => return Sample::nothing(wi),
                    Rules::Correct => eta * eta / sum.length_squared(),
                    // Measured: here the length of the half vector is not included, unlike where the
                    // direction is sampled.
                    Rules::Testrender => eta * eta,
                };
                self.refracted([o, i, m], choice, scale, wi)
            }
            _ => Sample::nothing(wi),
        }
    }

    /// The sample at a facet: `scale` is the change of solid angle from the facet's normal to the direction,
    /// without the cosine to the viewer.
    fn at_facet(&self, [o, i, m]: [Vec3; 3], (weight, chance): (Vec3, f32), scale: f32, wi: Vec3) -> Sample {
        let (hidden_o, hidden_i) = (self.hidden(o), self.hidden(i));
        let seen = self.density(m) / (1.0 + hidden_o);
        Sample {
            wi,
            weight: weight * ((1.0 + hidden_o) / (1.0 + hidden_o + hidden_i)),
            pdf: chance * scale * seen / o.z,
            roughness: self.alpha.max_element(),
        }
    }

    fn reflected(&self, directions: [Vec3; 3], choice: (Vec3, f32), wi: Vec3) -> Sample {
        self.at_facet(directions, choice, 0.25, wi)
    }

    fn refracted(&self, [o, i, m]: [Vec3; 3], choice: (Vec3, f32), scale: f32, wi: Vec3) -> Sample {
        if !(choice.1 > 0.0 && choice.0.max_element() > 0.0) {
            return Sample::nothing(wi);
        }
        self.at_facet([o, i, m], choice, (m.dot(i) * m.dot(o)).abs() * scale, wi)
    }

    pub(super) fn sample(&self, wo: Vec3, [x, y, z]: [f32; 3]) -> Sample {
        let o = self.axes.local(wo);
        if !positive(o.z) {
            return Sample::default();
        }
        let m = self.visible_normal(o, [x, y]);
        let cosine = m.dot(o);
        if !positive(cosine) {
            return Sample::default();
        }
        let [reflection, transmission] = self.choices(cosine, true);
        let reflects = match (self.kind, self.transmits()) {
            (Kind::Plain { reflects, .. }, Some(_)) => reflects && z < reflection.1,
            (_, Some(_)) => z >= transmission.1,
            (_, None) => true,
        };
        let wrong = |i: Vec3| self.rules == Rules::Correct && (i.z > 0.0) != reflects;
        if reflects {
            let i = m * (2.0 * cosine) - o;
            // Light below the surface hits another facet, and is lost.
            return if wrong(i) {
                Sample::default()
            } else {
                self.reflected([o, i, m], reflection, self.axes.world(i))
            };
        }
        let eta = self.transmits().unwrap_or(1.0);
        match fresnel::refract(wo, self.axes.world(m), eta) {
            Some((wi, _)) => {
                let i = self.axes.local(wi);
                let scale = eta * eta / (i * eta + o).length_squared();
                if wrong(i) { Sample::default() } else { self.refracted([o, i, m], transmission, scale, wi) }
            }
            None => Sample::default(),
        }
    }

    /// Samples a facet normal among those that the viewer sees.
    fn visible_normal(&self, o: Vec3, u: [f32; 2]) -> Vec3 {
        let stretched = Vec3::new(o.x * self.alpha.x, o.y * self.alpha.y, o.z).normalize_or(Vec3::Z);
        let cosine = stretched.z.max(0.0);
        let azimuth = if cosine < 0.99999 {
            Vec2::new(stretched.x, stretched.y).normalize_or(Vec2::X)
        } else {
            Vec2::X
        };
        let slope = match self.distribution {
            Distribution::Ggx => ggx_slope(cosine, u),
            Distribution::Beckmann => beckmann_slope(cosine, u),
        };
        let slope = azimuth.rotate(slope) * self.alpha;
        Vec3::new(-slope.x, -slope.y, 1.0).normalize_or(Vec3::Z)
    }
}

/// A slope of GGX facets with roughness 1, seen under a cosine; the first component is along the view.
fn ggx_slope(cosine: f32, [x, y]: [f32; 2]) -> Vec2 {
    let c = cosine.max(1e-6);
    // Solves the projected area up to a slope for the slope's tangent.
    let q = (1.0 + c) * x - c;
    let top = c * ((1.0 - c) * (1.0 + c)).max(0.0).sqrt() - q * ((1.0 - q) * (1.0 + q)).max(0.0).sqrt();
    let bottom = (q - c) * (q + c);
    let least = 1.0 / 4_294_967_296.0;
    let bottom = if bottom.abs() < least { least.copysign(bottom) } else { bottom };
    let along = top / bottom;
    // Across the view: a rational fit of the inverse.
    let side = 1.0 - 2.0 * y;
    let v = side.abs();
    let fit = (v * (v * (v * 0.273_85 - 0.733_69) + 0.463_41))
        / (v * (v * (v * 0.093_073 + 0.309_420) - 1.0) + 0.597_999);
    Vec2::new(along, side.signum() * fit * (1.0 + along * along).sqrt())
}

/// The same for Beckmann facets. W. Jakob, "An Improved Visible Normal Sampling Routine for the Beckmann
/// Distribution", 2014.
fn beckmann_slope(cosine: f32, [x, y]: [f32; 2]) -> Vec2 {
    let c = cosine.max(1e-6);
    let tan = (1.0 - c * c).max(0.0).sqrt() / c;
    let cot = 1.0 / tan;
    let root_pi = PI.sqrt().recip();
    let largest = erf(cot);
    let x = x.max(1e-6);
    // The first guess is a fit; the solution is searched in terms of the slope's error function.
    let angle = acos(c);
    let fit = 1.0 + angle * (-0.876 + angle * (0.4265 - 0.0594 * angle));
    let mut b = largest - (1.0 + largest) * math::powf(1.0 - x, fit);
    let scale = 1.0 / (1.0 + largest + root_pi * tan * math::exp(-cot * cot));
    for _ in 0..2 {
        let slope = ierf(b);
        let error = scale * (1.0 + b + root_pi * tan * math::exp(-slope * slope)) - x;
        b -= error / (scale * (1.0 - slope * tan));
    }
    Vec2::new(ierf(b), ierf(2.0 * y.max(1e-6) - 1.0))
}
