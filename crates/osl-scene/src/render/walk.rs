//! Light below a surface: a random walk from collision to collision until it leaves.
//!
//! Albedo and mean free path follow M. Chiang, P. Kutz and B. Burley, "Practical and Controllable Subsurface
//! Scattering for Production Path Tracing", 2016: with their fit, the share of light that leaves is the
//! requested color.

use super::sampler::Stream;
use super::world::{Body, leave};
use crate::bsdf::{Frame, Inside};
use crate::math;
use crate::mesh::SurfacePoint;
use glam::Vec3;
use std::f32::consts::TAU;

/// Maximum number of collisions.
const MAX_STEPS: usize = 256;
/// After this many collisions, weak walks are terminated at random.
const SURE_STEPS: usize = 8;

/// A medium, with values for each channel.
pub(super) struct Medium {
    /// Collisions per unit of length.
    density: Vec3,
    /// The scattered share of light at a collision.
    scattered: Vec3,
    /// Mean cosine of the scattering angle.
    g: f32,
}

impl Medium {
    /// The medium whose surface has the color `albedo` and whose light scatters over about `radius`.
    pub(super) fn new(&Inside { radius, albedo, g }: &Inside) -> Medium {
        let scattered =
            albedo.map(|a| 1.0 - math::exp(-5.094_06 * a + 2.611_88 * a * a - 4.318_05 * a * a * a));
        let scale = albedo.map(|a| 1.9 - a + 3.5 * (a - 0.8) * (a - 0.8));
        let density = 1.0 / (radius * scale).max(Vec3::splat(1e-6));
        // A medium that scatters forward needs more collisions to turn light around.
        Medium { density: density / (1.0 - g.max(0.0)), scattered, g }
    }
}

/// The point at which a walk leaves, and the factor on the light there.
pub(super) struct Exit {
    pub(super) point: SurfacePoint,
    pub(super) weight: Vec3,
}

/// Walks through an object from a point on its surface; `None` if the light is absorbed.
pub(super) fn walk(body: &Body, from: &SurfacePoint, medium: &Medium, random: &mut Stream) -> Option<Exit> {
    let below = crate::bsdf::cosine([random.next(), random.next()]);
    let mut direction = Frame::around(-from.ng).world(below);
    let mut p = leave(from.p, from.ng, direction);
    let mut weight = Vec3::ONE;
    for step in 0..MAX_STEPS {
        // A channel is chosen in proportion to its remaining light; all channels then count for the chosen
        // path.
        let chances = weight / weight.element_sum();
        let u = random.next();
        let channel = if u < chances.x {
            0
        } else if u < chances.x + chances.y {
            1
        } else {
            2
        };
        let way = -math::ln(1.0 - random.next()) / medium.density[channel];
        let hit = body.nearest(p, direction, way);
        let passed = |t: f32| (medium.density * -t).map(math::exp);
        if let Some((t, point)) = hit {
            let left = passed(t);
            weight *= left / left.dot(chances);
            // From inside, the surface faces away; otherwise the walk has left the object.
            return (direction.dot(point.ng) > 0.0 && weight.is_finite()).then_some(Exit { point, weight });
        }
        let met = passed(way) * medium.density;
        weight *= met * medium.scattered / met.dot(chances);
        if !(weight.is_finite() && weight.max_element() > 0.0) {
            return None;
        }
        if step >= SURE_STEPS {
            let stay = weight.max_element().min(1.0);
            if random.next() >= stay {
                return None;
            }
            weight /= stay;
        }
        p += direction * way;
        direction = turn(direction, medium.g, [random.next(), random.next()]);
    }
    None
}

/// A direction after a collision. L. Henyey and J. Greenstein, 1941.
fn turn(direction: Vec3, g: f32, u: [f32; 2]) -> Vec3 {
    let cosine = if g.abs() < 1e-3 {
        1.0 - 2.0 * u[0]
    } else {
        let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u[0]);
        (1.0 + g * g - s * s) / (2.0 * g)
    };
    let r = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (sin, cos) = math::sin_cos(TAU * u[1]);
    Frame::around(direction).world(Vec3::new(r * cos, r * sin, cosine)).normalize_or(direction)
}
