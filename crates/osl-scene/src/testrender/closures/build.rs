//! Converts the components of a closure to lobes and emitted light.

use super::diffuse::{self, Diffuse};
use super::facets::{self, FacetLobe};
use super::fresnel::Fresnel;
use super::gloss::{Phong, Ward};
use super::{Lobe, Lobes};
use crate::bsdf::{float, triple};
use glam::{Vec2, Vec3};
use osl_exec::Component;
use osl_ir::ir::Const;

/// A surface point as described by its closure.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Light that it emits.
    pub emitted: Vec3,
    /// Ways to scatter light.
    pub lobes: Lobes,
}

/// Maximum nesting depth of closures, which bounds the recursion. This is a property of the renderer: further
/// layers have no effect.
const MAX_DEPTH: usize = 32;

/// The viewing situation of a point.
#[derive(Clone, Copy)]
struct Side {
    wo: Vec3,
    backfacing: bool,
}

impl Side {
    /// The index of refraction as seen from the viewer's side.
    fn index(self, eta: f32) -> f32 {
        if self.backfacing { 1.0 / eta } else { eta }
    }
}

impl Surface {
    /// The surface of a closure, as seen from `wo`.
    pub fn new(components: &[Component], wo: Vec3, backfacing: bool) -> Surface {
        let side = Side { wo, backfacing };
        let mut builder = Builder { side, index: 1.0, surface: Surface::default() };
        builder.media(components, 0);
        builder.add(components, Vec3::ONE, 0);
        builder.surface
    }
}

/// Only the emitted light of a closure.
pub fn emitted(components: &[Component]) -> Vec3 {
    let mut light = Vec3::ZERO;
    each(components, Vec3::ONE, 0, &mut |component, weight| match &*component.name {
        "emission" => light += weight,
        "uniform_edf" => light += weight * triple(component, 0),
        _ => {}
    });
    light
}

/// The light of a background shader's closure.
pub fn background(components: &[Component]) -> Vec3 {
    let shines = |c: &&Component| &*c.name == "background";
    components.iter().filter(shines).map(|c| Vec3::from_array(c.weight)).sum()
}

/// Calls a function with each component and its weight; layers are replaced by their components.
fn each(components: &[Component], around: Vec3, depth: usize, f: &mut dyn FnMut(&Component, Vec3)) {
    for component in components {
        match parts(component).filter(|_| depth < MAX_DEPTH) {
            Some([top, base]) => {
                each(top, around, depth + 1, f);
                each(base, around, depth + 1, f);
            }
            None => f(component, around * Vec3::from_array(component.weight)),
        }
    }
}

/// The top and the base of a layer.
fn parts(component: &Component) -> Option<[&[Component]; 2]> {
    if &*component.name != "layer" {
        return None;
    }
    let part = |at: usize| component.params.get(at).map_or(&[][..], |p| &p.closure[..]);
    Some([part(0), part(1)])
}

struct Builder {
    side: Side,
    /// The index of refraction of the medium that the closure describes.
    index: f32,
    surface: Surface,
}

impl Builder {
    /// Finds the index of refraction: the last component that has one counts.
    fn media(&mut self, components: &[Component], depth: usize) {
        for component in components {
            if let Some(parts) = parts(component) {
                if depth < MAX_DEPTH {
                    parts.into_iter().for_each(|part| self.media(part, depth + 1));
                }
                continue;
            }
            let index = match &*component.name {
                "medium_vdf" => Some(float(component, 4)),
                "dielectric_bsdf" if transmits(component) => Some(float(component, 6)),
                "generalized_schlick_bsdf" if transmits(component) => Some(schlick_index(component)),
                "anisotropic_vdf" => {
                    self.index = 1.0;
                    None
                }
                _ => None,
            };
            if let Some(index) = index {
                self.index = self.side.index(index);
            }
        }
    }

    /// Adds the components of a closure, multiplied by a weight.
    fn add(&mut self, components: &[Component], around: Vec3, depth: usize) {
        for component in components {
            if let Some([top, base]) = parts(component) {
                if depth < MAX_DEPTH {
                    let covered = self.opacity(top, depth + 1).clamp(Vec3::ZERO, Vec3::ONE);
                    self.add(top, around, depth + 1);
                    self.add(base, around * (Vec3::ONE - covered), depth + 1);
                }
                continue;
            }
            let weight = around * Vec3::from_array(component.weight);
            match &*component.name {
                "emission" => self.surface.emitted += weight,
                "uniform_edf" => self.surface.emitted += weight * triple(component, 0),
                _ => {
                    if let Some((lobe, tint)) = self.lobe(component) {
                        self.surface.lobes.add(lobe, weight * tint);
                    }
                }
            }
        }
    }

    /// The share of light that a closure keeps from the layers below it.
    fn opacity(&self, components: &[Component], depth: usize) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for component in components {
            let weight = Vec3::from_array(component.weight);
            if let Some(parts) = parts(component) {
                if depth < MAX_DEPTH {
                    sum += weight * parts.into_iter().map(|p| self.opacity(p, depth + 1)).sum::<Vec3>();
                }
                continue;
            }
            let partly = match &*component.name {
                "reflection" | "sheen_bsdf" => true,
                "dielectric_bsdf" | "generalized_schlick_bsdf" => !transmits(component),
                _ => false,
            };
            sum += match self.lobe(component).filter(|_| partly) {
                Some((lobe, _)) => weight * lobe.albedo(self.side.wo),
                None => Vec3::ONE,
            };
        }
        sum
    }

    /// The lobe of a component, and a factor of its weight.
    fn lobe(&self, c: &Component) -> Option<(Lobe, Vec3)> {
        let n = triple(c, 0);
        let diffuse = |n: Vec3, albedo: Vec3, kind| Lobe::Diffuse(Diffuse { n, albedo, kind });
        let white = |lobe| Some((lobe, Vec3::ONE));
        match &*c.name {
            "diffuse" => white(diffuse(n, Vec3::ONE, diffuse::Kind::Lambert)),
            "translucent" => white(diffuse(-n, Vec3::ONE, diffuse::Kind::Lambert)),
            "oren_nayar" => white(diffuse(n, Vec3::ONE, diffuse::Kind::oren_nayar(float(c, 1)))),
            "phong" => white(Lobe::Phong(Phong { n, exponent: float(c, 1) })),
            "ward" => white(Lobe::Ward(Ward::new(n, triple(c, 1), Vec2::new(float(c, 2), float(c, 3))))),
            "microfacet" => white(Lobe::Facets(microfacet(c))),
            "reflection" => white(Lobe::Reflection(n, float(c, 1))),
            "refraction" => white(Lobe::Refraction(n, float(c, 1))),
            "transparent" | "transparent_bsdf" => white(Lobe::Transparent),
            "oren_nayar_diffuse_bsdf" => {
                let roughness = float(c, 2);
                let preserving = key(c, "energy_compensation");
                let kind = match preserving {
                    true => diffuse::Kind::Preserving(roughness),
                    false => diffuse::Kind::oren_nayar(roughness),
                };
                white(diffuse(n, triple(c, 1), kind))
            }
            "burley_diffuse_bsdf" => white(diffuse(n, triple(c, 1), diffuse::Kind::Burley(float(c, 2)))),
            "sheen_bsdf" => white(diffuse(n, triple(c, 1), diffuse::Kind::Sheen(float(c, 2)))),
            "subsurface_bssrdf" => Some((diffuse(n, Vec3::ONE, diffuse::Kind::Lambert), triple(c, 1))),
            "translucent_bsdf" => Some((diffuse(-n, Vec3::ONE, diffuse::Kind::Lambert), triple(c, 1))),
            "dielectric_bsdf" => {
                let eta = transmits(c).then_some(self.index);
                let tints = [triple(c, 2), triple(c, 3)];
                // Its share of reflected light is that from outside, on both sides.
                let fresnel = Fresnel::Dielectric { eta: float(c, 6), tints };
                white(self.tinted(c, [4, 5], text(c, 7), fresnel, eta))
            }
            "conductor_bsdf" => {
                let fresnel = Fresnel::Conductor { n: triple(c, 4), k: triple(c, 5) };
                white(self.tinted(c, [2, 3], text(c, 6), fresnel, None))
            }
            "generalized_schlick_bsdf" => {
                let fresnel = Fresnel::Schlick {
                    f0: triple(c, 6),
                    f90: triple(c, 7),
                    exponent: float(c, 8),
                    tints: [triple(c, 2), triple(c, 3)],
                };
                // The name of its distribution is ignored.
                white(self.tinted(c, [4, 5], "ggx", fresnel, transmits(c).then_some(self.index)))
            }
            _ => None,
        }
    }

    fn tinted(
        &self,
        c: &Component,
        alpha: [usize; 2],
        distribution: &str,
        fresnel: Fresnel,
        eta: Option<f32>,
    ) -> Lobe {
        let alpha = Vec2::from_array(alpha.map(|at| float(c, at)));
        let kind = facets::Kind::Tinted { fresnel, eta };
        Lobe::Facets(FacetLobe::new(distribution, triple(c, 0), triple(c, 1), alpha, kind))
    }
}

/// Whether a dielectric or Schlick lobe transmits light.
fn transmits(c: &Component) -> bool {
    triple(c, 3) != Vec3::ZERO
}

/// The index of refraction that has the mean reflection of a Schlick lobe at normal incidence.
fn schlick_index(c: &Component) -> f32 {
    let root = (triple(c, 6).element_sum() / 3.0).clamp(0.0, 0.99).sqrt();
    (1.0 + root) / (1.0 - root)
}

fn microfacet(c: &Component) -> FacetLobe {
    let how = float(c, 6) as i32;
    let alpha = Vec2::new(float(c, 3), float(c, 4));
    let kind = facets::Kind::Plain { eta: float(c, 5), reflects: how != 1, refracts: how != 0 };
    FacetLobe::new(text(c, 0), triple(c, 1), triple(c, 2), alpha, kind)
}

fn text(c: &Component, at: usize) -> &str {
    match c.params.get(at).and_then(|p| p.values.first()) {
        Some(Const::Str(text)) => text,
        _ => "",
    }
}

/// Whether a keyword is given with a nonzero number.
fn key(c: &Component, name: &str) -> bool {
    let given = c.params.iter().rev().find(|p| p.key.as_deref() == Some(name));
    matches!(given.and_then(|p| p.values.first()), Some(Const::Int(n)) if *n != 0)
}
