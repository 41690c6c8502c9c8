//! The table of closures, and the lobes and the light of a shader's components.

use super::diffuse::{Diffuse, Kind as Matt};
use super::facets::{Distribution, FacetLobe, Kind as Facets};
use super::fresnel::Fresnel;
use super::gloss::{Phong, Ward};
use super::lobe::{Inside, Lobe};
use super::{Frame, Rules, Scatter, Side};
use glam::{Vec2, Vec3};
use osl_exec::Component;
use osl_ir::ir::Const;
use std::sync::Arc;

/// A closure: its name, and what a component of this name does to light. The names of its parameters and
/// their order are those of the built-in function.
pub struct Closure {
    /// The name.
    pub name: &'static str,
    /// What the picture shows, for the documentation.
    pub shows: &'static str,
    part: Part,
}

/// What a component does.
#[derive(Clone, Copy)]
enum Part {
    /// Emits light: the factor of its weight.
    Emits(fn(&Args<'_>) -> Vec3),
    /// Scatters light: the lobe, and a factor of its weight.
    Scatters(fn(&Args<'_>) -> (Lobe, Vec3)),
    /// Like `Scatters`, but testrender passes over it.
    Ours(fn(&Args<'_>) -> (Lobe, Vec3)),
    /// Has a closure over another one.
    Layers,
    /// Describes what is behind the surface: the index of refraction.
    Fills(fn(&Args<'_>) -> f32),
    /// Marks a layer of the picture.
    Marks,
}

const fn row(name: &'static str, part: Part, shows: &'static str) -> Closure {
    Closure { name, shows, part }
}

const fn white(lobe: Lobe) -> (Lobe, Vec3) {
    (lobe, Vec3::ONE)
}

fn matt(n: Vec3, albedo: Vec3, kind: Matt) -> Lobe {
    Lobe::Diffuse(Diffuse { n, albedo, kind })
}

/// The roughness below which facets are as good as a mirror; it keeps their density finite.
const SMOOTH: f32 = 1e-3;
/// The roughness in place of 0 in testrender: that of shaders which MaterialX generates.
const SMOOTHEST: f32 = 1e-8;

/// All closures.
pub static CLOSURES: &[Closure] = &[
    row("emission", Part::Emits(|_| Vec3::ONE), "light"),
    row(
        "background",
        Part::Emits(|a| Vec3::splat(a.ours())),
        "light, also on a surface; testrender: of the background only",
    ),
    row("uniform_edf", Part::Emits(|a| a.triple(0)), "light"),
    row("debug", Part::Marks, "nothing; its color is a layer of the picture"),
    row("holdout", Part::Ours(|_| white(Lobe::Transparent)), "what is behind the surface"),
    row("diffuse", Part::Scatters(|a| white(matt(a.normal(0), Vec3::ONE, Matt::Lambert))), "Lambert's law"),
    row(
        "translucent",
        Part::Scatters(|a| white(matt(-a.normal(0), Vec3::ONE, Matt::Lambert))),
        "Lambert's law, for light from behind",
    ),
    row(
        "oren_nayar",
        Part::Scatters(|a| white(matt(a.normal(0), Vec3::ONE, Matt::oren_nayar(a.roughness(1))))),
        "Oren and Nayar's qualitative model",
    ),
    row(
        "phong",
        Part::Scatters(|a| white(Lobe::Phong(Phong { n: a.normal(0), exponent: a.bounded(1, 0.0, 1e6) }))),
        "Phong's model, scaled to conserve energy",
    ),
    row(
        "ward",
        Part::Scatters(|a| white(Lobe::Ward(Ward { axes: a.axes(a.normal(0), 1), alpha: a.alpha(2, 3) }))),
        "Ward's anisotropic model",
    ),
    row("microfacet", Part::Scatters(microfacet), "GGX or Beckmann facets that reflect, refract, or both"),
    row(
        "reflection",
        Part::Scatters(|a| white(Lobe::Reflection(a.normal(0), a.index(a.float(1))))),
        "a mirror",
    ),
    row(
        "refraction",
        Part::Scatters(|a| white(Lobe::Refraction(a.normal(0), a.index(a.float(1))))),
        "a smooth interface",
    ),
    row("transparent", Part::Scatters(|_| white(Lobe::Transparent)), "what is behind the surface"),
    row(
        "subsurface",
        Part::Ours(|a| white(a.inside(a.triple(2), a.triple(3), a.float(1)))),
        "a random walk below the surface",
    ),
    row("oren_nayar_diffuse_bsdf", Part::Scatters(oren_nayar_diffuse), "Oren and Nayar's model, or EON"),
    row(
        "burley_diffuse_bsdf",
        Part::Scatters(|a| white(matt(a.normal(0), a.tint(1), Matt::Burley(a.roughness(2))))),
        "Burley's model",
    ),
    row("dielectric_bsdf", Part::Scatters(dielectric), "facets with the Fresnel term of a dielectric"),
    row("conductor_bsdf", Part::Scatters(conductor), "facets with the Fresnel term of a conductor"),
    row("generalized_schlick_bsdf", Part::Scatters(schlick), "facets with Schlick's term"),
    row(
        "translucent_bsdf",
        Part::Scatters(|a| (matt(-a.normal(0), Vec3::ONE, Matt::Lambert), a.tint(1))),
        "Lambert's law, for light from behind",
    ),
    row("transparent_bsdf", Part::Scatters(|_| white(Lobe::Transparent)), "what is behind the surface"),
    row(
        "subsurface_bssrdf",
        Part::Scatters(subsurface),
        "a random walk below the surface; testrender: Lambert's law",
    ),
    row(
        "sheen_bsdf",
        Part::Scatters(|a| white(matt(a.normal(0), a.tint(1), Matt::Sheen(a.roughness(2))))),
        "Estevez and Kulla's sheen",
    ),
    row("anisotropic_vdf", Part::Fills(|_| 1.0), "a clear surface, if nothing else is there"),
    row("medium_vdf", Part::Fills(|a| a.index(a.float(4))), "a clear surface, if nothing else is there"),
    row("outputvariable", Part::Layers, "the closure that it names"),
    row("layer", Part::Layers, "both closures; the base has the light that the top leaves"),
];

impl Closure {
    /// The closure with a name.
    pub fn named(name: &str) -> Option<&'static Closure> {
        CLOSURES.iter().find(|c| c.name == name)
    }
}

/// The arguments of a component, as seen from one side of a surface.
struct Args<'a> {
    c: &'a Component,
    side: Side,
    rules: Rules,
    /// The index of refraction of the medium that the whole closure describes; testrender only.
    medium: f32,
}

impl Args<'_> {
    fn value(&self, at: usize) -> Option<&Const> {
        self.c.params.get(at).and_then(|p| p.values.first())
    }

    fn float(&self, at: usize) -> f32 {
        match self.value(at) {
            Some(Const::Float(x)) if x.is_finite() => *x,
            Some(Const::Int(n)) => *n as f32,
            _ => 0.0,
        }
    }

    fn triple(&self, at: usize) -> Vec3 {
        match self.value(at) {
            Some(Const::Triple(t)) if t.iter().all(|x| x.is_finite()) => Vec3::from_array(*t),
            _ => Vec3::ZERO,
        }
    }

    fn text(&self, at: usize) -> &str {
        if let Some(Const::Str(text)) = self.value(at) { text } else { "" }
    }

    /// Whether a keyword is given with a nonzero number.
    fn key(&self, name: &str) -> bool {
        let given = self.c.params.iter().rev().find(|p| p.key.as_deref() == Some(name));
        matches!(given.and_then(|p| p.values.first()), Some(Const::Int(n)) if *n != 0)
    }

    fn is_correct(&self) -> bool {
        self.rules == Rules::Correct
    }

    /// 1, or 0 in testrender.
    fn ours(&self) -> f32 {
        if self.is_correct() { 1.0 } else { 0.0 }
    }

    /// A number within bounds, which testrender does not know.
    fn bounded(&self, at: usize, low: f32, high: f32) -> f32 {
        let x = self.float(at);
        if self.is_correct() { x.clamp(low, high) } else { x }
    }

    /// A roughness from 0 to 1.
    fn roughness(&self, at: usize) -> f32 {
        self.bounded(at, 0.0, 1.0)
    }

    /// A color, with components from 0 to 1 unless testrender sees it.
    fn tint(&self, at: usize) -> Vec3 {
        let x = self.triple(at);
        if self.is_correct() { x.clamp(Vec3::ZERO, Vec3::ONE) } else { x }
    }

    /// A normal; it has length 1 and is on the viewer's side, unless testrender sees it.
    fn normal(&self, at: usize) -> Vec3 {
        let n = self.triple(at);
        if !self.is_correct() {
            return n;
        }
        let n = n.normalize_or(self.side.ng);
        if n.dot(self.side.ng) < 0.0 { -n } else { n }
    }

    /// Axes around a normal, along the tangent that is a parameter.
    fn axes(&self, n: Vec3, at: usize) -> Frame {
        let tangent = self.triple(at);
        if self.is_correct() {
            Frame::along(n, (tangent - n * n.dot(tangent)).normalize_or_zero())
        } else {
            Frame::along(n, tangent)
        }
    }

    /// The roughness along both tangents.
    fn alpha(&self, x: usize, y: usize) -> Vec2 {
        let alpha = Vec2::new(self.bounded(x, SMOOTH, 1.0), self.bounded(y, SMOOTH, 1.0));
        // Testrender has no density of such facets, and would show nothing.
        Vec2::select(alpha.cmpeq(Vec2::ZERO), Vec2::splat(SMOOTHEST), alpha)
    }

    /// The index of refraction as seen from the viewer's side.
    fn index(&self, eta: f32) -> f32 {
        match (self.rules, self.side.inside) {
            (Rules::Testrender, _) => eta,
            (Rules::Correct, _) if eta <= 0.0 => 0.0,
            // Facets between equal media do not bend light: a half vector would have no direction.
            (Rules::Correct, _) if (eta - 1.0).abs() < SMOOTH => 1.0 + SMOOTH,
            (Rules::Correct, true) => 1.0 / eta,
            (Rules::Correct, false) => eta,
        }
    }

    /// The index of refraction of transmitted light in a MaterialX lobe with this index, if there is any.
    fn through(&self, eta: f32) -> Option<f32> {
        transmits(self).then(|| if self.is_correct() { self.index(eta) } else { self.medium })
    }

    fn inside(&self, radius: Vec3, albedo: Vec3, g: f32) -> Lobe {
        Lobe::Subsurface(Inside {
            radius: radius.max(Vec3::ZERO),
            albedo: albedo.clamp(Vec3::ZERO, Vec3::ONE),
            g: g.clamp(-0.95, 0.95),
        })
    }

    /// Facets around the normal and the tangent that are parameters.
    fn facets(&self, [n, tangent, x, y]: [usize; 4], distribution: &str, kind: Facets) -> (Lobe, Vec3) {
        let (n, alpha) = (self.normal(n), self.alpha(x, y));
        let round = self.triple(tangent) == Vec3::ZERO || alpha.x == alpha.y;
        let axes = if round { Frame::around(n) } else { self.axes(n, tangent) };
        let distribution = if distribution == "ggx" { Distribution::Ggx } else { Distribution::Beckmann };
        white(Lobe::Facets(FacetLobe { axes, distribution, alpha, kind, rules: self.rules }))
    }
}

fn microfacet(a: &Args<'_>) -> (Lobe, Vec3) {
    let how = a.float(6) as i32;
    let kind = Facets::Plain { eta: a.index(a.float(5)), reflects: how != 1, refracts: how != 0 };
    a.facets([1, 2, 3, 4], a.text(0), kind)
}

fn oren_nayar_diffuse(a: &Args<'_>) -> (Lobe, Vec3) {
    let roughness = a.roughness(2);
    let kind =
        if a.key("energy_compensation") { Matt::Preserving(roughness) } else { Matt::oren_nayar(roughness) };
    white(matt(a.normal(0), a.tint(1), kind))
}

fn dielectric(a: &Args<'_>) -> (Lobe, Vec3) {
    let eta = a.through(a.float(6));
    // In testrender, the share of reflected light is that from outside, on both sides.
    let fresnel = Fresnel::Dielectric { eta: a.index(a.float(6)), tints: [a.tint(2), a.tint(3)] };
    a.facets([0, 1, 4, 5], a.text(7), Facets::Tinted { fresnel, eta })
}

fn conductor(a: &Args<'_>) -> (Lobe, Vec3) {
    let fresnel = Fresnel::Conductor { n: a.triple(4), k: a.triple(5) };
    a.facets([0, 1, 2, 3], a.text(6), Facets::Tinted { fresnel, eta: None })
}

fn schlick(a: &Args<'_>) -> (Lobe, Vec3) {
    let fresnel = Fresnel::Schlick {
        f0: a.tint(6),
        f90: a.tint(7),
        exponent: a.bounded(8, 0.0, 1e3),
        tints: [a.tint(2), a.tint(3)],
    };
    let kind = Facets::Tinted { fresnel, eta: a.through(schlick_index(a)) };
    // In testrender, the name of the distribution is ignored.
    let beckmann = a.is_correct() && a.text(9) == "beckmann";
    a.facets([0, 1, 4, 5], if beckmann { "beckmann" } else { "ggx" }, kind)
}

/// Light below the surface: by a mean free path, or by the color of light after a depth.
fn subsurface(a: &Args<'_>) -> (Lobe, Vec3) {
    if !a.is_correct() {
        return (matt(a.normal(0), Vec3::ONE, Matt::Lambert), a.tint(1));
    }
    match a.value(2) {
        Some(Const::Triple(_)) => white(a.inside(a.triple(2), a.triple(1), a.float(3))),
        _ => white(a.inside(a.triple(3) * a.float(2), a.triple(1), a.float(4))),
    }
}

/// Whether a dielectric or Schlick lobe transmits light.
fn transmits(a: &Args<'_>) -> bool {
    a.triple(3) != Vec3::ZERO
}

/// The index of refraction that has the mean reflection of a Schlick lobe at normal incidence.
fn schlick_index(a: &Args<'_>) -> f32 {
    let root = (a.triple(6).element_sum() / 3.0).clamp(0.0, 0.99).sqrt();
    (1.0 + root) / (1.0 - root)
}

/// Maximum nesting depth of layers, which bounds the recursion. This is a property of the renderer: further
/// layers have no effect.
const MAX_DEPTH: usize = 32;

/// The top and the base of a layer.
fn parts(component: &Component) -> [&[Component]; 2] {
    [0, 1].map(|at| component.params.get(at).map_or(&[][..], |p| &p.closure[..]))
}

/// Only the emitted light of a closure, as testrender sees it: no layer hides the light of its base.
pub fn emitted(components: &[Component]) -> Vec3 {
    let side = Side { wo: Vec3::Z, ng: Vec3::Z, inside: false };
    let mut builder = Builder::new(side, Rules::Testrender);
    builder.only_light = true;
    builder.add(components, Vec3::ONE, 0);
    builder.scatter.emitted
}

/// The light of a background shader's closure.
pub fn background(components: &[Component]) -> Vec3 {
    let shines = |c: &&Component| &*c.name == "background";
    components.iter().filter(shines).map(|c| Vec3::from_array(c.weight)).sum()
}

/// The surface of a closure.
pub(super) fn scatter(components: &[Component], side: Side, rules: Rules) -> Scatter {
    let mut builder = Builder::new(side, rules);
    if rules == Rules::Testrender {
        builder.media(components, 0);
    }
    builder.add(components, Vec3::ONE, 0);
    if builder.clear && builder.scatter.lobes.is_empty() && rules == Rules::Correct {
        builder.scatter.add(Lobe::Transparent, Vec3::ONE);
    }
    builder.scatter
}

struct Builder {
    medium: f32,
    /// Whether lobes are left out.
    only_light: bool,
    /// Whether there is a component that describes only what is behind the surface.
    clear: bool,
    scatter: Scatter,
}

impl Builder {
    fn new(side: Side, rules: Rules) -> Builder {
        Builder { medium: 1.0, only_light: false, clear: false, scatter: Scatter::empty(side, rules) }
    }

    fn args<'a>(&self, c: &'a Component) -> Args<'a> {
        Args { c, side: self.scatter.side, rules: self.scatter.rules, medium: self.medium }
    }

    /// Finds testrender's index of refraction of the medium: the last component that has one counts.
    fn media(&mut self, components: &[Component], depth: usize) {
        for component in components {
            let Some(closure) = Closure::named(&component.name) else { continue };
            let args = self.args(component);
            let index = match closure.part {
                Part::Layers if depth < MAX_DEPTH => {
                    parts(component).into_iter().for_each(|part| self.media(part, depth + 1));
                    continue;
                }
                Part::Fills(_) if closure.name == "anisotropic_vdf" => {
                    self.medium = 1.0;
                    continue;
                }
                Part::Fills(index) => index(&args),
                Part::Scatters(_) if closure.name == "dielectric_bsdf" && transmits(&args) => args.float(6),
                Part::Scatters(_) if closure.name == "generalized_schlick_bsdf" && transmits(&args) => {
                    schlick_index(&args)
                }
                _ => continue,
            };
            self.medium = if self.scatter.side.inside { 1.0 / index } else { index };
        }
    }

    /// The weight of a component below a weight.
    fn weight(&self, component: &Component, around: Vec3) -> Vec3 {
        let weight = Vec3::from_array(component.weight);
        match self.scatter.rules {
            Rules::Correct if weight.is_finite() => around * weight.max(Vec3::ZERO),
            Rules::Correct => Vec3::ZERO,
            Rules::Testrender => around * weight,
        }
    }

    /// Adds the components of a closure, multiplied by a weight.
    fn add(&mut self, components: &[Component], around: Vec3, depth: usize) {
        for component in components {
            let weight = self.weight(component, around);
            let args = self.args(component);
            match Closure::named(&component.name).map(|closure| closure.part) {
                Some(Part::Layers) if depth < MAX_DEPTH => {
                    let [top, base] = parts(component);
                    // In testrender, a layer itself has no weight.
                    let weight = if args.is_correct() { weight } else { around };
                    let covered = match self.only_light {
                        true => Vec3::ZERO,
                        false => self.opacity(top, depth + 1).clamp(Vec3::ZERO, Vec3::ONE),
                    };
                    self.add(top, weight, depth + 1);
                    self.add(base, weight * (Vec3::ONE - covered), depth + 1);
                }
                Some(Part::Emits(light)) => self.scatter.emitted += weight * light(&args),
                Some(Part::Scatters(_) | Part::Ours(_)) if self.only_light => {}
                Some(Part::Scatters(lobe)) => self.lobe(lobe(&args), weight),
                Some(Part::Ours(lobe)) if args.is_correct() => self.lobe(lobe(&args), weight),
                Some(Part::Fills(_)) => self.clear = true,
                Some(Part::Marks) => {
                    self.scatter.marks.push((args.text(0).into(), Vec3::from_array(component.weight)));
                }
                Some(Part::Layers | Part::Ours(_)) => {}
                None => {
                    let share = weight.max_element().clamp(0.0, 1.0);
                    self.scatter.unknown.push((Arc::clone(&component.name), share));
                }
            }
        }
    }

    fn lobe(&mut self, (lobe, tint): (Lobe, Vec3), weight: Vec3) {
        self.scatter.add(lobe, weight * tint);
    }

    /// The share of light that a closure keeps from the layers below it.
    fn opacity(&self, components: &[Component], depth: usize) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for component in components {
            let weight = self.weight(component, Vec3::ONE);
            let args = self.args(component);
            let Some(closure) = Closure::named(&component.name) else {
                sum += Vec3::ONE;
                continue;
            };
            let partly = match closure.name {
                "reflection" | "sheen_bsdf" => true,
                "dielectric_bsdf" | "generalized_schlick_bsdf" => !transmits(&args),
                _ => false,
            };
            sum += match closure.part {
                Part::Layers if depth < MAX_DEPTH => {
                    weight * parts(component).into_iter().map(|p| self.opacity(p, depth + 1)).sum::<Vec3>()
                }
                Part::Layers => Vec3::ZERO,
                Part::Scatters(lobe) if partly => weight * lobe(&args).0.albedo(self.scatter.side.wo),
                // What does not scatter light covers nothing, except in testrender.
                Part::Scatters(lobe) if args.is_correct() && matches!(lobe(&args).0, Lobe::Transparent) => {
                    Vec3::ZERO
                }
                Part::Emits(_) | Part::Fills(_) | Part::Marks if args.is_correct() => Vec3::ZERO,
                _ => Vec3::ONE,
            };
        }
        sum
    }
}
