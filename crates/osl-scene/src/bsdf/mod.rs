//! How a surface scatters light: the components of a shader's closure as weights and densities.
//!
//! [`CLOSURES`] is the one table of closures for previews, for `oslrun render` and for `testrender`. What
//! differs between them is where this module asks for the [`Rules`]. Directions point away from the surface
//! and have length 1, in common space.

mod closures;
mod diffuse;
mod facets;
mod frame;
mod fresnel;
mod gloss;
mod lobe;

pub use closures::{CLOSURES, Closure, background, emitted};
pub use frame::{Frame, cosine, disk, sphere};
pub use lobe::{Inside, Sample};

use crate::math::positive;
use crate::mis;
use diffuse::Diffuse;
use glam::Vec3;
use lobe::Lobe;
use osl_exec::Component;
use std::sync::Arc;

/// Whose pictures are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rules {
    /// Correct pictures: normals are turned to the viewer, values are bounded, light does not leak through
    /// bent normals, and light below a surface walks through the object.
    #[default]
    Correct,
    /// Those of the reference's test renderer with its approximations: test pictures have few paths per
    /// pixel, so the noise must be the same.
    Testrender,
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

impl Side {
    /// The situation for a geometric normal that points outside.
    pub fn new(ng: Vec3, wo: Vec3) -> Side {
        let inside = ng.dot(wo) < 0.0;
        Side { wo, ng: if inside { -ng } else { ng }, inside }
    }
}

/// A point of a surface that is ready to scatter light.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// The viewing situation.
    pub side: Side,
    /// Light that it emits towards the viewer.
    pub emitted: Vec3,
    /// The marks (debug closures) of its shader: name and color.
    pub marks: Vec<(Arc<str>, Vec3)>,
    /// Closures that are not in the table: their names, and their weights from 0 to 1.
    pub unknown: Vec<(Arc<str>, f32)>,
    /// Light that stands for unknown closures.
    signal: Vec3,
    rules: Rules,
    lobes: Vec<(Lobe, Vec3)>,
    /// The probability of each lobe; their sum may be less than 1.
    chances: Vec<f32>,
}

/// How a path continues.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Next {
    /// In a direction.
    Direction(Sample, Way),
    /// Below the surface.
    Below {
        /// The factor on the light that comes out.
        weight: Vec3,
        /// What is there.
        inside: Inside,
    },
}

/// The kind of a direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Of diffuse light.
    Diffuse,
    /// Of a reflection or refraction.
    Glossy,
    /// As if there were no surface.
    Straight,
}

/// Maximum number of lobes at a point in testrender; further ones have no effect.
const MAX_LOBES: usize = 8;
/// The largest number below 1.
const BELOW_ONE: f32 = 0.999_999_94;

impl Scatter {
    /// A surface with the components of a closure, whose lobes are chosen for a path without colors.
    pub fn new(components: &[Component], side: Side, rules: Rules) -> Scatter {
        let mut scatter = closures::scatter(components, side, rules);
        scatter.prepare(Vec3::ONE, false);
        scatter
    }

    fn empty(side: Side, rules: Rules) -> Scatter {
        Scatter {
            side,
            emitted: Vec3::ZERO,
            marks: Vec::new(),
            unknown: Vec::new(),
            signal: Vec3::ZERO,
            rules,
            lobes: Vec::new(),
            chances: Vec::new(),
        }
    }

    /// A white or colored surface after Lambert's law. `ng` is the geometric normal outside.
    pub fn diffuse(ng: Vec3, n: Vec3, wo: Vec3, color: Vec3) -> Scatter {
        let side = Side::new(ng, wo);
        let n = if n.dot(side.ng) < 0.0 { -n } else { n };
        let mut scatter = Scatter::empty(side, Rules::Correct);
        scatter.add(Lobe::Diffuse(Diffuse { n, albedo: Vec3::ONE, kind: diffuse::Kind::Lambert }), color);
        scatter.prepare(Vec3::ONE, false);
        scatter
    }

    /// Shows a color in place of the unknown closures, if there are any.
    pub fn paint_unknown(&mut self, color: impl Fn() -> Vec3) {
        let share: f32 = self.unknown.iter().map(|(_, share)| share).sum();
        if share > 0.0 {
            self.signal = color() * share.min(1.0);
            self.emitted += self.signal;
        }
    }

    fn add(&mut self, lobe: Lobe, weight: Vec3) {
        if self.lobes.len() < MAX_LOBES || self.rules == Rules::Correct {
            self.lobes.push((lobe, weight));
        }
    }

    /// Sets the probabilities of the lobes for a path with this throughput. Unless paths may be `absorbed`,
    /// they sum to 1.
    pub fn prepare(&mut self, throughput: Vec3, absorbed: bool) {
        let whole = 1.0 / throughput.element_sum();
        let chance =
            |(lobe, weight): &(Lobe, Vec3)| weight.dot(throughput * lobe.albedo(self.side.wo)) * whole;
        self.chances = self.lobes.iter().map(chance).collect();
        let total: f32 = self.chances.iter().sum();
        if total > 1.0 || (!absorbed && total > 0.0) {
            self.chances.iter_mut().for_each(|c| *c /= total);
        }
    }

    /// Whether it scatters no light.
    pub fn is_black(&self) -> bool {
        !self.chances.iter().any(|c| *c > 0.0)
    }

    /// Whether it can only be seen through.
    pub fn is_clear(&self) -> bool {
        let through = self.lobes.iter().all(|(lobe, _)| matches!(lobe, Lobe::Transparent));
        through && !self.is_black() && self.emitted == Vec3::ZERO && self.marks.is_empty()
    }

    /// Whether light from lamps can reach the viewer, which is not the case if all lobes are mirrors.
    pub fn is_rough(&self) -> bool {
        self.lobes.iter().any(|(lobe, _)| !lobe.is_single())
    }

    /// The approximate share of light that reaches the viewer, without light that passes straight through
    /// unless `through` says so.
    pub fn albedo(&self, through: bool) -> Vec3 {
        let seen = self.lobes.iter().filter(|(l, _)| through || !matches!(l, Lobe::Transparent));
        seen.map(|(lobe, weight)| *weight * lobe.albedo(self.side.wo)).sum::<Vec3>() + self.signal
    }

    /// The sum of all lobes for light from a direction.
    pub fn eval(&self, wi: Vec3) -> Sample {
        let mut all = Sample::nothing(wi);
        for at in 0..self.lobes.len() {
            self.mix(&mut all, at);
        }
        all
    }

    /// Mixes a lobe into a sample by the balance heuristic.
    fn mix(&self, sample: &mut Sample, at: usize) {
        let (Some((lobe, weight)), Some(chance)) = (self.lobes.get(at), self.chances.get(at)) else { return };
        if !self.is_on_its_side(lobe, sample.wi) {
            return;
        }
        let other = lobe.eval(self.side.wo, sample.wi);
        mis::mix((&mut sample.weight, &mut sample.pdf), other.weight * *weight, other.pdf, *chance);
        sample.roughness += other.roughness * chance;
    }

    /// Whether a direction is on the same side of the surface as of the lobe's normal. A bent normal would
    /// let light through the surface.
    fn is_on_its_side(&self, lobe: &Lobe, wi: Vec3) -> bool {
        match lobe.normal() {
            Some(n) if self.rules == Rules::Correct => {
                let above = (n.dot(wi) > 0.0) == (n.dot(self.side.ng) > 0.0);
                above == (self.side.ng.dot(wi) > 0.0)
            }
            _ => true,
        }
    }

    /// Chooses how a path goes on with three numbers from 0 to 1; `None` if its light is absorbed.
    pub fn next(&self, [xi, yi, zi]: [f32; 3]) -> Option<Next> {
        let mut before = 0.0;
        for (at, ((lobe, weight), chance)) in self.lobes.iter().zip(&self.chances).enumerate() {
            if !positive(before + chance - xi) {
                before += chance;
                continue;
            }
            if let Lobe::Subsurface(inside) = *lobe {
                return Some(Next::Below { weight: *weight / *chance, inside });
            }
            let inside = ((xi - before) / chance).min(BELOW_ONE);
            let mut sample = lobe.sample(self.side.wo, [inside, yi, zi]);
            sample.weight *= *weight / *chance;
            sample.pdf *= chance;
            if !positive(sample.pdf) || !self.is_on_its_side(lobe, sample.wi) {
                return None;
            }
            let roughness = sample.roughness;
            (0..self.lobes.len()).filter(|other| *other != at).for_each(|other| self.mix(&mut sample, other));
            let way = match lobe {
                Lobe::Diffuse(_) => Way::Diffuse,
                Lobe::Transparent => Way::Straight,
                _ => Way::Glossy,
            };
            return Some(Next::Direction(Sample { roughness, ..sample }, way));
        }
        None
    }
}

#[cfg(test)]
mod tests;
