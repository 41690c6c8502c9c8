//! A lobe: one way to scatter light, made from a closure component.

use super::fresnel::{self, reflect, refract};
use super::microfacet::{Distribution, Facets};
use super::{Frame, cosine};
use crate::math::square;
use glam::{Vec2, Vec3};
use osl_exec::Component;
use osl_ir::ir::Const;
use std::f32::consts::PI;

/// A surface with less roughness is a mirror.
const SMOOTH: f32 = 1e-3;

/// A way to scatter light.
#[derive(Clone, Debug)]
pub struct Lobe {
    /// Red, green and blue factors, not negative.
    pub weight: Vec3,
    /// The kind of scattering.
    pub kind: Kind,
}

/// Kinds of scattering.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Lambert's law.
    Diffuse(Frame),
    /// M. Oren and S. Nayar, "Generalization of Lambert's Reflectance Model", 1994: its two coefficients.
    OrenNayar(Frame, f32, f32),
    /// Microfacets.
    Facets {
        /// Axes of the surface.
        frame: Frame,
        /// The facets.
        facets: Facets,
        /// Index of refraction after the surface divided by that before it; 0 reflects everything.
        eta: f32,
        /// Whether light is reflected.
        reflects: bool,
        /// Whether light is transmitted.
        refracts: bool,
    },
    /// A mirror, or glass.
    Mirror {
        /// The normal, on the side of the viewer.
        n: Vec3,
        /// As for facets.
        eta: f32,
        /// Whether light is reflected.
        reflects: bool,
        /// Whether light is transmitted.
        refracts: bool,
    },
    /// Light that passes straight through.
    Transparent,
    /// Light that enters, scatters below the surface, and leaves elsewhere.
    Subsurface {
        /// Mean free path between two collisions, for each channel.
        radius: Vec3,
        /// The share of light that comes back out.
        albedo: Vec3,
        /// The mean cosine of the scattering angle.
        g: f32,
    },
}

/// The value of a lobe for light from one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// The share that reaches the viewer, times the cosine of the light's direction; without the weight.
    pub value: f32,
    /// The probability density with which sampling chooses the direction, by solid angle.
    pub pdf: f32,
}

impl Value {
    pub(super) const NONE: Value = Value { value: 0.0, pdf: 0.0 };
}

/// The viewing situation at a surface point.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// Direction to the viewer.
    pub wo: Vec3,
    /// The geometric normal on the side of the viewer.
    pub ng: Vec3,
    /// Whether the viewer is inside.
    pub inside: bool,
}

impl Lobe {
    /// The lobe of a component; `None` if the component does not scatter light or is unknown.
    pub fn new(component: &Component, side: &Side) -> Option<Lobe> {
        let weight = Vec3::from_array(component.weight);
        let weight = if weight.is_finite() { weight.max(Vec3::ZERO) } else { Vec3::ZERO };
        let kind = match &*component.name {
            "diffuse" => Kind::Diffuse(Frame::around(normal(component, 0, side))),
            "oren_nayar" => {
                let sigma2 = square(float(component, 1).clamp(0.0, 1.0));
                let (a, b) = (1.0 - 0.5 * sigma2 / (sigma2 + 0.33), 0.45 * sigma2 / (sigma2 + 0.09));
                Kind::OrenNayar(Frame::around(normal(component, 0, side)), a, b)
            }
            "microfacet" => microfacet(component, side),
            "reflection" => {
                let (n, eta) = (normal(component, 0, side), index(float(component, 1), side));
                Kind::Mirror { n, eta, reflects: true, refracts: false }
            }
            "refraction" => {
                let (n, eta) = (normal(component, 0, side), index(float(component, 1), side));
                Kind::Mirror { n, eta, reflects: false, refracts: true }
            }
            "transparent" => Kind::Transparent,
            "subsurface" => Kind::Subsurface {
                g: float(component, 1).clamp(-0.95, 0.95),
                radius: triple(component, 2).max(Vec3::ZERO),
                albedo: triple(component, 3).clamp(Vec3::ZERO, Vec3::ONE),
            },
            _ => return None,
        };
        Some(Lobe { weight, kind })
    }

    /// Whether light comes from a single direction, or from elsewhere on the surface.
    pub fn is_delta(&self) -> bool {
        matches!(self.kind, Kind::Mirror { .. } | Kind::Transparent | Kind::Subsurface { .. })
    }

    /// The approximate share of light that reaches the viewer.
    pub fn albedo(&self, wo: Vec3) -> f32 {
        let share = |cosine: f32, eta: f32, reflects: bool, refracts: bool| {
            let f = fresnel::dielectric(cosine, eta);
            f32::from(u8::from(reflects)) * f + f32::from(u8::from(refracts)) * (1.0 - f)
        };
        match &self.kind {
            Kind::Facets { frame, eta, reflects, refracts, .. } => {
                share(frame.n.dot(wo), *eta, *reflects, *refracts)
            }
            Kind::Mirror { n, eta, reflects, refracts } => share(n.dot(wo), *eta, *reflects, *refracts),
            _ => 1.0,
        }
    }

    /// The value for light from `wi`; zero for a delta lobe.
    pub fn value(&self, side: &Side, wi: Vec3) -> Value {
        let above = side.ng.dot(wi) > 0.0;
        match &self.kind {
            Kind::Diffuse(frame) if above => {
                let value = frame.n.dot(wi).max(0.0) / PI;
                Value { value, pdf: value }
            }
            Kind::OrenNayar(frame, a, b) if above => {
                let (i, o) = (frame.n.dot(wi).max(0.0), frame.n.dot(side.wo).max(0.0));
                let s = wi.dot(side.wo) - i * o;
                let t = if s > 0.0 { i.max(o).max(1e-6) } else { 1.0 };
                Value { value: i / PI * (a + b * s / t).max(0.0), pdf: i / PI }
            }
            Kind::Facets { frame, facets, eta, reflects, refracts } => {
                let (wo, wi) = (frame.local(side.wo), frame.local(wi));
                let both = *reflects && *refracts;
                if above && *reflects {
                    let Some((value, pdf, h)) = facets.reflected(wo, wi) else { return Value::NONE };
                    let f = fresnel::dielectric(wo.dot(h), *eta);
                    return Value { value: value * f, pdf: pdf * if both { f } else { 1.0 } };
                }
                if !above && *refracts {
                    let Some((value, pdf, h)) = facets.refracted(wo, wi, *eta) else { return Value::NONE };
                    let f = 1.0 - fresnel::dielectric(wo.dot(h), *eta);
                    return Value { value: value * f, pdf: pdf * if both { f } else { 1.0 } };
                }
                Value::NONE
            }
            _ => Value::NONE,
        }
    }

    /// Chooses the direction of incoming light. Also returns the reflected share if that direction is the
    /// only one (see [`Lobe::is_delta`]), else 1. Not for subsurface scattering.
    pub fn direction(&self, side: &Side, u: [f32; 3]) -> Option<(Vec3, f32)> {
        let wo = side.wo;
        match &self.kind {
            Kind::Diffuse(frame) | Kind::OrenNayar(frame, ..) => {
                Some((frame.world(cosine([u[0], u[1]])), 1.0))
            }
            Kind::Facets { frame, facets, eta, reflects, refracts } => {
                let local = frame.local(wo);
                if local.z <= 0.0 {
                    return None;
                }
                let h = facets.normal(local, [u[0], u[1]]);
                let f = fresnel::dielectric(local.dot(h), *eta);
                let back = *reflects && (!*refracts || u[2] < f);
                let wi = if back { reflect(local, h) } else { refract(local, h, *eta)? };
                // A facet that faces away, or that sends light below the surface, contributes nothing to the
                // viewer.
                let right = local.dot(h) > 0.0 && (wi.z > 0.0) == back;
                right.then(|| (frame.world(wi), 1.0))
            }
            Kind::Mirror { n, eta, reflects, refracts } => {
                let f = fresnel::dielectric(n.dot(wo), *eta);
                match (reflects, refracts) {
                    (true, _) => Some((reflect(wo, *n), f)),
                    _ => Some((refract(wo, *n, *eta)?, 1.0 - f)),
                }
            }
            Kind::Transparent => Some((-wo, 1.0)),
            Kind::Subsurface { .. } => None,
        }
    }
}

fn microfacet(component: &Component, side: &Side) -> Kind {
    let n = normal(component, 1, side);
    let alpha = Vec2::new(float(component, 3), float(component, 4)).clamp(Vec2::ZERO, Vec2::splat(1.0));
    let eta = index(float(component, 5), side);
    let how = match component.params.get(6).and_then(|p| p.values.first()) {
        Some(Const::Int(n)) => *n,
        _ => 0,
    };
    let (reflects, refracts) = (how != 1, how == 1 || how == 2);
    if alpha.max_element() < SMOOTH && !(reflects && refracts) {
        return Kind::Mirror { n, eta, reflects, refracts };
    }
    let distribution = match component.params.first().and_then(|p| p.values.first()) {
        Some(Const::Str(name)) if &**name == "beckmann" => Distribution::Beckmann,
        _ => Distribution::Ggx,
    };
    let facets = Facets { distribution, alpha: alpha.max(Vec2::splat(SMOOTH)) };
    Kind::Facets { frame: Frame::along(n, triple(component, 2)), facets, eta, reflects, refracts }
}

/// A parameter that is a normal, with length 1 and on the viewer's side.
fn normal(component: &Component, at: usize, side: &Side) -> Vec3 {
    let n = triple(component, at).normalize_or(side.ng);
    if n.dot(side.ng) < 0.0 { -n } else { n }
}

/// The index of refraction as seen from the viewer's side.
fn index(eta: f32, side: &Side) -> f32 {
    if side.inside && eta > 0.0 { 1.0 / eta } else { eta.max(0.0) }
}

pub(crate) fn float(component: &Component, at: usize) -> f32 {
    match component.params.get(at).and_then(|p| p.values.first()) {
        Some(Const::Float(x)) if x.is_finite() => *x,
        Some(Const::Int(n)) => *n as f32,
        _ => 0.0,
    }
}

pub(crate) fn triple(component: &Component, at: usize) -> Vec3 {
    match component.params.get(at).and_then(|p| p.values.first()) {
        Some(Const::Triple(t)) if t.iter().all(|x| x.is_finite()) => Vec3::from_array(*t),
        _ => Vec3::ZERO,
    }
}
