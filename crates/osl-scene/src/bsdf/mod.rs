//! How a surface scatters light: a shader's closures as densities that can be evaluated and sampled.
//!
//! Directions point away from the surface and have length 1, in common space. This module must not know rays
//! or lights.

mod frame;
mod fresnel;
mod lobe;
mod microfacet;

pub use frame::{Frame, cosine, disk, sphere};
pub use lobe::{Kind, Lobe, Side};
pub(crate) use lobe::{float, triple};
pub(crate) use microfacet::{Distribution, Facets};

use glam::Vec3;
use osl_exec::Component;
use osl_ir::ir::Const;
use std::sync::Arc;

/// A point of a surface that is ready to scatter light.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// The viewing situation.
    pub side: Side,
    /// Light that it emits towards the viewer.
    pub emitted: Vec3,
    /// The marks (debug closures) of its shader: name and color.
    pub marks: Vec<(Arc<str>, Vec3)>,
    /// Names of unknown closures.
    pub unknown: Vec<Arc<str>>,
    lobes: Vec<Lobe>,
    /// The probability of choosing each lobe.
    chances: Vec<f32>,
}

/// A direction of incoming light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chosen {
    /// The direction.
    pub wi: Vec3,
    /// The share of light from there that reaches the viewer, times the cosine, divided by the density of the
    /// choice.
    pub weight: Vec3,
    /// The density of the direction by solid angle; 0 if it is the only one.
    pub pdf: f32,
    /// Whether the direction is the only one, as for a mirror.
    pub delta: bool,
    /// Whether light passes straight through.
    pub straight: bool,
    /// Whether the chosen lobe is diffuse.
    pub diffuse: bool,
}

/// How a path continues.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// In a direction.
    Direction(Chosen),
    /// Below the surface.
    Below {
        /// The factor on the light that comes out.
        weight: Vec3,
        /// Mean free path between two collisions.
        radius: Vec3,
        /// The share of light that comes back out.
        albedo: Vec3,
        /// The mean cosine of the scattering angle.
        g: f32,
    },
}

fn brightness(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

impl Scatter {
    /// A surface with the components of a closure. `ng` is the geometric normal outside; `wo` points to the
    /// viewer.
    pub fn new(components: &[Component], ng: Vec3, wo: Vec3) -> Scatter {
        let inside = ng.dot(wo) < 0.0;
        let side = Side { wo, ng: if inside { -ng } else { ng }, inside };
        let mut scatter = Scatter::of(side, Vec::new());
        for component in components {
            let weight = Vec3::from_array(component.weight);
            match &*component.name {
                "emission" if weight.is_finite() => scatter.emitted += weight,
                "debug" => {
                    if let Some(Const::Str(tag)) = component.params.first().and_then(|p| p.values.first()) {
                        scatter.marks.push((tag.clone(), weight));
                    }
                }
                name => match Lobe::new(component, &side) {
                    Some(lobe) => scatter.lobes.push(lobe),
                    None if name == "emission" => {}
                    None => scatter.unknown.push(component.name.clone()),
                },
            }
        }
        scatter.weigh();
        scatter
    }

    /// A surface with these lobes.
    pub fn of(side: Side, lobes: Vec<Lobe>) -> Scatter {
        let mut scatter = Scatter {
            side,
            emitted: Vec3::ZERO,
            marks: Vec::new(),
            unknown: Vec::new(),
            chances: Vec::new(),
            lobes,
        };
        scatter.weigh();
        scatter
    }

    /// A white or colored surface after Lambert's law.
    pub fn diffuse(ng: Vec3, n: Vec3, wo: Vec3, color: Vec3) -> Scatter {
        let inside = ng.dot(wo) < 0.0;
        let ng = if inside { -ng } else { ng };
        let n = if n.dot(ng) < 0.0 { -n } else { n };
        let lobe = Lobe { weight: color, kind: Kind::Diffuse(Frame::around(n)) };
        Scatter::of(Side { wo, ng, inside }, vec![lobe])
    }

    fn weigh(&mut self) {
        let wo = self.side.wo;
        let share = |l: &Lobe| match &l.kind {
            Kind::Subsurface { albedo, .. } => brightness(l.weight * *albedo),
            _ => brightness(l.weight) * l.albedo(wo),
        };
        self.chances = self.lobes.iter().map(share).collect();
        let sum: f32 = self.chances.iter().sum();
        if sum > 0.0 {
            self.chances.iter_mut().for_each(|c| *c /= sum);
        }
    }

    /// Whether it scatters no light.
    pub fn is_black(&self) -> bool {
        self.chances.iter().all(|c| *c == 0.0)
    }

    /// Whether light from lamps can reach the viewer, which is not the case if all lobes are mirrors.
    pub fn is_rough(&self) -> bool {
        self.lobes.iter().any(|l| !l.is_delta())
    }

    /// The approximate share of light that it sends to the viewer, without transmitted light.
    pub fn albedo(&self) -> Vec3 {
        let seen = self.lobes.iter().filter(|l| !matches!(l.kind, Kind::Transparent));
        seen.map(|l| match &l.kind {
            Kind::Subsurface { albedo, .. } => l.weight * *albedo,
            _ => l.weight * l.albedo(self.side.wo),
        })
        .sum()
    }

    /// The share of light from `wi` that reaches the viewer, times the cosine, and the density with which
    /// sampling chooses `wi`.
    pub fn value(&self, wi: Vec3) -> (Vec3, f32) {
        let (mut sum, mut density) = (Vec3::ZERO, 0.0);
        for (lobe, chance) in self.lobes.iter().zip(&self.chances) {
            let value = lobe.value(&self.side, wi);
            sum += lobe.weight * value.value;
            density += chance * value.pdf;
        }
        (sum, density)
    }

    /// Chooses the direction of incoming light; `None` if there is none.
    pub fn next(&self, choice: f32, u: [f32; 3]) -> Option<Next> {
        let mut rest = choice;
        let mut found = None;
        for (at, chance) in self.chances.iter().enumerate().filter(|(_, c)| **c > 0.0) {
            found = Some((at, *chance));
            if rest < *chance {
                break;
            }
            rest -= chance;
        }
        let (at, chance) = found?;
        let lobe = self.lobes.get(at)?;
        if let Kind::Subsurface { radius, albedo, g } = lobe.kind {
            return Some(Next::Below { weight: lobe.weight / chance, radius, albedo, g });
        }
        let (wi, share) = lobe.direction(&self.side, u)?;
        if lobe.is_delta() {
            let straight = matches!(lobe.kind, Kind::Transparent);
            let same = wi.dot(self.side.ng) > 0.0;
            // A normal that is bent too far would send a mirror's light to the wrong side.
            let right = match lobe.kind {
                Kind::Mirror { reflects, .. } => reflects == same,
                _ => true,
            };
            let weight = if right { lobe.weight * (share / chance) } else { Vec3::ZERO };
            return Some(Next::Direction(Chosen {
                wi,
                weight,
                pdf: 0.0,
                delta: true,
                straight,
                diffuse: false,
            }));
        }
        let (value, pdf) = self.value(wi);
        if !(pdf > 0.0 && pdf.is_finite()) {
            return None;
        }
        let diffuse = matches!(lobe.kind, Kind::Diffuse(_) | Kind::OrenNayar(..));
        Some(Next::Direction(Chosen { wi, weight: value / pdf, pdf, delta: false, straight: false, diffuse }))
    }
}

#[cfg(test)]
mod tests;
