//! Runs shaders at surface hits: all hits of a material together.

use super::layers::Layers;
use super::world::{Hit, Material, World};
use crate::bsdf::{Rules, Scatter, Side};
use crate::camera::View;
use crate::data::WithData;
use crate::surface_points::{Footprint, SurfacePoints};
use glam::Vec3;
use osl_exec::{Component, Frame, Plane, PointSource, Run, RunError, RunOptions, Said};
use std::sync::Arc;

/// A hit to be shaded.
pub(super) struct PathHit {
    /// Index of the path.
    pub(super) path: usize,
    pub(super) hit: Hit,
    /// The direction of the ray.
    pub(super) incident: Vec3,
    pub(super) footprint: Footprint,
}

/// Hits of one material, shaded.
pub(super) struct Shaded {
    /// The scattering of each hit, in order.
    pub(super) scatter: Vec<Scatter>,
    /// The outputs.
    pub(super) planes: Vec<Plane>,
    /// Messages of the shader.
    pub(super) messages: Vec<Said>,
}

/// Shades hits of one material. `seen` means that the camera sees them, so all outputs are needed.
pub(super) fn shade(
    world: &World,
    material: usize,
    hits: &[PathHit],
    seen: bool,
) -> Result<Shaded, RunError> {
    let nothing = || Shaded { scatter: Vec::new(), planes: Vec::new(), messages: Vec::new() };
    let Some(Material { program, lean, services, color, stretch, through, data }) =
        world.materials.get(material)
    else {
        return Ok(nothing());
    };
    let mut points = SurfacePoints::with_capacity(hits.len());
    for hit in hits {
        points.push(hit.hit.point, hit.incident, hit.footprint, world.area(hit.hit.object));
    }
    if let Some([scale, offset]) = stretch {
        points.stretch(*scale, *offset);
    }
    let program = if seen { program } else { lean };
    // One tile, so that it runs on this thread only; the other threads have tiles of their own.
    let options = RunOptions {
        tile: hits.len().max(1),
        closures: color.is_none(),
        limits: world.limits.clone(),
        ..RunOptions::default()
    };
    let points = WithData { points, data: data.clone() };
    let run = Run::new(program, services, &points, &options);
    let Frame { planes, messages, closures, .. } = run.points(0..points.count(), &|_| ())?;
    let of = |at: usize, hit: &PathHit| match color {
        Some(name) => {
            Scatter::diffuse(hit.hit.point.ng, hit.hit.point.n, -hit.incident, matt(&planes, name, at))
        }
        None => {
            // Without a `Ci`, the closure is an output.
            let own = closures.iter().find(|c| &*c.output == "Ci").or(closures.first());
            let list = own.map(|c| c.point(at));
            let side = Side::new(hit.hit.point.ng, -hit.incident);
            let mut list = list.unwrap_or_default();
            if let Some(output) = through {
                let part = matt(&planes, output, at);
                list.iter_mut()
                    .for_each(|c| c.weight = (Vec3::from(c.weight) * (Vec3::ONE - part)).to_array());
                let params = Arc::new([]);
                list.push(Component { weight: part.to_array(), name: "transparent".into(), params });
            }
            let mut scatter = Scatter::new(&list, side, Rules::Correct);
            scatter.paint_unknown(|| signal(&world.view, hit.hit.point.p));
            scatter
        }
    };
    let scatter = hits.iter().enumerate().map(|(at, hit)| of(at, hit)).collect();
    Ok(Shaded { scatter, planes, messages })
}

/// The value of an output as a surface color, from 0 to 1.
fn matt(planes: &[Plane], name: &str, at: usize) -> Vec3 {
    let mut color = Vec3::ZERO;
    for plane in planes.iter().filter(|p| &*p.output == name) {
        let x = plane.words.get(at).map_or(0.0, |w| f32::from_bits(*w));
        match plane.component {
            // A single number gives grey.
            0 => color = Vec3::splat(x),
            1 => color.y = x,
            _ => color.z = x,
        }
    }
    if color.is_finite() { color.clamp(Vec3::ZERO, Vec3::ONE) } else { Vec3::ZERO }
}

/// Squares of the signal pattern along the height of a picture.
const SQUARES: f64 = 16.0;

/// The light of a closure that is not in the table: squares of the picture in two colors that shaders rarely
/// have.
fn signal(view: &View, p: Vec3) -> Vec3 {
    let side = (view.resolution()[1] as f64 / SQUARES).max(2.0);
    let odd = view.project(p).is_some_and(|place| {
        let square = (place / side).floor();
        (square.x + square.y).rem_euclid(2.0) > 0.0
    });
    if odd { Vec3::new(1.0, 0.0, 1.0) } else { Vec3::new(0.9, 0.8, 0.0) }
}

/// Records a visible hit in the layers.
pub(super) fn record(
    layers: &mut Layers,
    pixel: usize,
    hit: &PathHit,
    shaded: &Shaded,
    at: usize,
    depth: f32,
) {
    let Some(scatter) = shaded.scatter.get(at) else { return };
    layers.add_surface(pixel, scatter.albedo(false), hit.hit.point.n, depth);
    for (name, color) in &scatter.marks {
        layers.add_mark(pixel, name, *color);
    }
    layers.add_outputs(pixel, &shaded.planes, at);
}
