//! Paths from the camera, many at once: all advance to their next surface, then all hits with the same shader
//! group are shaded together.
//!
//! A path has its own random numbers and is computed as if it were alone, so results do not depend on threads
//! or on the grouping of paths.

use super::background::Direction;
use super::camera::Ray;
use super::sampler::{Sampler, tent};
use super::shapes::{Form, Point, nearest};
use super::world::{self, Notes, Stage, World};
use crate::bsdf::{self, Next, Rules, Scatter, Side};
use crate::mesh::MeshHit;
use crate::mis;
use glam::Vec3;
use osl_exec::RunError;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Options of the renderer.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// The square root of the number of paths per pixel.
    pub samples: usize,
    /// Maximum number of surfaces on a path.
    pub max_bounces: usize,
    /// The bounce from which paths may be absorbed.
    pub absorbed_from: usize,
    /// Renders the albedo of visible surfaces, times this factor, instead of light.
    pub albedo: Option<f32>,
}

impl Default for Options {
    fn default() -> Self {
        Options { samples: 1, max_bounces: 1_000_000, absorbed_from: 5, albedo: None }
    }
}

/// A picture.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Red, green and blue of each pixel, row by row.
    pub planes: [Vec<f32>; 3],
    /// Messages of shaders.
    pub notes: Notes,
}

/// Paths that are traced together.
const WAVE: usize = 1 << 13;
/// Pixels per task.
const PIXELS: usize = 1 << 8;

/// Renders a picture on the threads of the current pool. `progress` is called with the completed share, from
/// 0 to 1.
///
/// # Errors
/// A shader exceeds its budget, or the command has to stop.
pub fn render(
    world: &World,
    options: &Options,
    progress: &(dyn Fn(f32) + Sync),
) -> Result<Picture, RunError> {
    let limits = &world.limits.scenes;
    let most = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
    let options = Options {
        samples: options.samples.clamp(1, most(limits.samples.isqrt()).max(1)),
        // Light between two mirrors never ends.
        max_bounces: options.max_bounces.min(most(limits.bounces)),
        ..*options
    };
    let mut notes = Notes::default();
    let stage = Stage::new(world, &mut notes)?;
    let count = world.size[0] * world.size[1];
    let tasks = count.div_ceil(PIXELS);
    let done = AtomicUsize::new(0);
    let parts: Vec<(Vec<Vec3>, Notes)> = (0..tasks)
        .into_par_iter()
        .with_max_len(1)
        .map(|task| {
            let mut tracer = Tracer { stage: &stage, options, notes: Notes::default() };
            let first = task * PIXELS;
            let light = tracer.pixels(first, PIXELS.min(count - first))?;
            progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / tasks as f32);
            Ok((light, tracer.notes))
        })
        .collect::<Result<_, RunError>>()?;
    let mut picture = Picture::default();
    for (light, more) in parts {
        notes.add(more, &world.limits);
        for (channel, plane) in picture.planes.iter_mut().enumerate() {
            plane.extend(light.iter().map(|x| x[channel]));
        }
    }
    picture.notes = notes;
    Ok(picture)
}

/// A path in progress.
struct Path {
    /// The sample that receives its light.
    slot: usize,
    sampler: Sampler,
    ray: Ray,
    /// The share of light at its end that reaches the camera.
    throughput: Vec3,
    /// The density of its direction.
    pdf: f32,
    /// The shape at which it starts, and the triangle.
    from: Option<(usize, usize)>,
}

/// A path at a surface.
struct SurfaceHit {
    path: Path,
    shape: usize,
    triangle: usize,
    group: usize,
    point: Point,
    /// Width of the ray there.
    radius: f32,
}

/// A light that may be visible from a point.
struct Seen {
    slot: usize,
    group: usize,
    point: Point,
    /// The factor of the light.
    share: Vec3,
}

/// The direction of a ray, with its changes.
fn around(ray: &Ray) -> Direction {
    Direction { value: ray.direction, derivs: ray.footprint(0.0).i }
}

/// Traces the paths of one task.
struct Tracer<'w> {
    stage: &'w Stage<'w>,
    options: Options,
    notes: Notes,
}

impl Tracer<'_> {
    /// The mean light of some pixels.
    fn pixels(&mut self, first: usize, count: usize) -> Result<Vec<Vec3>, RunError> {
        let paths = self.options.samples * self.options.samples;
        let mut means = vec![Vec3::ZERO; count];
        let round = (WAVE / count.max(1)).max(1);
        for start in (0..paths).step_by(round) {
            let end = (start + round).min(paths);
            let each = end - start;
            let wave =
                (0..count * each).map(|slot| self.start(slot, first + slot / each, start + slot % each));
            let light = self.trace(wave.collect(), count * each)?;
            for (mean, light) in means.iter_mut().zip(light.chunks(each)) {
                for (at, light) in light.iter().enumerate() {
                    *mean += (*light - *mean) / (start + at + 1) as f32;
                }
            }
        }
        Ok(means)
    }

    fn start(&self, slot: usize, pixel: usize, index: usize) -> Path {
        let width = self.stage.world.size[0].max(1);
        let (x, y) = (pixel % width, pixel / width);
        let mut sampler = Sampler::new(x, y, index);
        let [jx, jy, _] = sampler.three();
        let place = [x as f32 + 0.5 + tent(jx), y as f32 + 0.5 + tent(jy)];
        let ray = self.stage.view.ray(place);
        Path { slot, sampler, ray, throughput: Vec3::ONE, pdf: f32::INFINITY, from: None }
    }

    /// The light of each path.
    fn trace(&mut self, mut paths: Vec<Path>, count: usize) -> Result<Vec<Vec3>, RunError> {
        let mut light = vec![Vec3::ZERO; count];
        for bounce in 0..=self.options.max_bounces {
            if paths.is_empty() {
                break;
            }
            let mut met = Vec::with_capacity(paths.len());
            let mut missed = Vec::new();
            for path in paths {
                self.stage.goes_on()?;
                match nearest(&self.stage.world.shapes, &path.ray, path.from) {
                    Some((shape, hit)) => met.extend(self.meet(path, shape, &hit)),
                    None => missed.push(path),
                }
            }
            self.around(&missed, bounce, &mut light)?;
            met.sort_by_key(|m: &SurfaceHit| m.group);
            let (mut next, mut seen) = (Vec::with_capacity(met.len()), Vec::new());
            let kind = if bounce == 0 { world::Ray::Camera } else { world::Ray::Bounce };
            let mut rest = met.into_iter().peekable();
            while let Some(first) = rest.next() {
                let group = first.group;
                let mut hits = vec![first];
                while let Some(hit) = rest.next_if(|m| m.group == group) {
                    hits.push(hit);
                }
                let points: Vec<Point> = hits.iter().map(|m| m.point).collect();
                let closures = self.stage.shade(group, &points, kind, &mut self.notes)?;
                for (hit, components) in hits.into_iter().zip(closures) {
                    self.stage.goes_on()?;
                    let side = Side::new(hit.point.on.ng, -hit.point.incident);
                    let surface = Scatter::new(&components, side, Rules::Testrender);
                    self.notes.unknown.extend(surface.unknown.iter().map(|(name, _)| name.clone()));
                    if let Some(light) = light.get_mut(hit.path.slot) {
                        next.extend(self.scatter(hit, surface, bounce, light, &mut seen));
                    }
                }
            }
            self.lights(seen, &mut light)?;
            next.sort_by_key(|p: &Path| p.slot);
            paths = next;
        }
        Ok(light)
    }

    /// A path at the surface that it hits; `None` if that has no shader.
    fn meet(&self, path: Path, shape: usize, hit: &MeshHit) -> Option<SurfaceHit> {
        let of = self.stage.world.shapes.get(shape)?;
        let point = of.form.point(&path.ray, hit);
        let radius = path.ray.radius_at(hit.t);
        Some(SurfaceHit { group: of.group?, shape, triangle: hit.triangle, point, radius, path })
    }

    /// Adds the light of the background to paths that hit nothing.
    fn around(&mut self, missed: &[Path], bounce: usize, light: &mut [Vec3]) -> Result<(), RunError> {
        if missed.is_empty() || !self.stage.has_background() {
            return Ok(());
        }
        let found: Vec<Vec3> = match &self.stage.table {
            Some(table) if bounce > 0 => {
                let found = missed.iter().map(|path| {
                    let (weight, pdf) = table.light(path.ray.direction);
                    weight * mis::of_weights(path.pdf, pdf)
                });
                found.collect()
            }
            _ => {
                let directions: Vec<_> = missed.iter().map(|path| around(&path.ray)).collect();
                let kind = if bounce == 0 { world::Ray::Camera } else { world::Ray::Bounce };
                self.stage.background(&directions, kind, &mut self.notes)?
            }
        };
        for (path, found) in missed.iter().zip(found) {
            if let Some(light) = light.get_mut(path.slot) {
                *light += path.throughput * found;
            }
        }
        Ok(())
    }

    /// Adds the light that a surface sends back along a path, records the lights visible from it, and returns
    /// the continuation of the path.
    fn scatter(
        &self,
        hit: SurfaceHit,
        mut surface: Scatter,
        bounce: usize,
        light: &mut Vec3,
        seen: &mut Vec<Seen>,
    ) -> Option<Path> {
        let SurfaceHit { mut path, shape: index, triangle, point, radius, .. } = hit;
        let here = Some((index, triangle));
        let shapes = &self.stage.world.shapes;
        let shape = shapes.get(index)?;
        let p = point.on.p;
        // A mesh may see itself, but lights other shapes only.
        let alone = matches!(shape.form, Form::Mesh(_)) && path.from.is_some_and(|(from, _)| from == index);
        let share = match shape.is_light && !alone {
            true => mis::power(path.pdf, shape.form.pdf(path.ray.origin, &point.on)),
            false => 1.0,
        };
        *light += path.throughput * surface.emitted * share;
        if bounce == self.options.max_bounces {
            return None;
        }
        surface.prepare(path.throughput, bounce >= self.options.absorbed_from);
        if let Some(scale) = self.options.albedo {
            *light += path.throughput * surface.albedo(true) * scale;
            return None;
        }
        let [xi, yi, zi] = path.sampler.three();
        if let Some(table) = &self.stage.table {
            let chosen = table.sample([xi, yi]);
            let direction = chosen.direction.value;
            let value = surface.eval(direction);
            let factor = mis::of_weights(chosen.pdf, value.pdf);
            let found = path.throughput * value.weight * chosen.weight * factor;
            if found.element_sum() > 0.0 {
                let ray = Ray { origin: p, direction, radius, spread: 0.0 };
                if nearest(shapes, &ray, here).is_none() {
                    *light += found;
                }
            }
        }
        let lights = shapes.iter().enumerate().filter(|(at, s)| s.is_light && *at != index);
        for (at, shape) in lights {
            let Some(group) = shape.group else { continue };
            // The caller returns the error.
            if self.stage.goes_on().is_err() {
                return None;
            }
            let chosen = shape.form.sample(p, [xi, yi]);
            let value = surface.eval(chosen.direction);
            let found = path.throughput * value.weight * mis::of_value(chosen.pdf, value.pdf);
            if found.element_sum() > 0.0 {
                let ray = Ray { origin: p, direction: chosen.direction, radius, spread: 0.0 };
                let hit = nearest(shapes, &ray, here);
                if let Some((_, hit)) = hit.filter(|(s, hit)| *s == at && hit.triangle == chosen.triangle) {
                    let point = shape.form.point(&ray, &hit);
                    seen.push(Seen { slot: path.slot, group, point, share: found });
                }
            }
        }
        let Some(Next::Direction(chosen, _)) = surface.next([xi, yi, zi]) else { return None };
        path.throughput *= chosen.weight;
        if !(path.throughput.cmpgt(Vec3::ZERO).any()) {
            return None;
        }
        path.pdf = chosen.pdf;
        path.from = here;
        let spread = path.ray.spread.max(chosen.roughness);
        path.ray = Ray { origin: p, direction: chosen.wi, radius, spread };
        Some(path)
    }

    /// Adds the light of visible lamps.
    fn lights(&mut self, mut seen: Vec<Seen>, light: &mut [Vec3]) -> Result<(), RunError> {
        seen.sort_by_key(|s| s.group);
        for seen in seen.chunk_by(|a, b| a.group == b.group) {
            for seen in seen.chunks(WAVE) {
                let Some(group) = seen.first().map(|s| s.group) else { continue };
                let points: Vec<Point> = seen.iter().map(|s| s.point).collect();
                let closures = self.stage.shade(group, &points, world::Ray::Light, &mut self.notes)?;
                for (seen, components) in seen.iter().zip(closures) {
                    if let Some(light) = light.get_mut(seen.slot) {
                        *light += seen.share * bsdf::emitted(&components);
                    }
                }
            }
        }
        Ok(())
    }
}
