//! Paths from the camera, many at once: all take one step, then all surface hits are shaded, material by
//! material.

use super::layers::Layers;
use super::sampler::Sampler;
use super::shade::{self, PathHit, Shaded};
use super::walk::{self, Medium};
use super::world::{Hit, World, leave};
use crate::bsdf::{Next, Sample as Chosen, Scatter, Way};
use crate::camera::Ray;
use crate::lens::{self, Aim, LensRay};
use crate::light::Arriving;
use crate::mesh::SurfacePoint;
use crate::mis;
use crate::surface_points::Footprint;
use glam::Vec3;
use osl_exec::{RunError, Said, unite};
use osl_limits::Limits;
use std::sync::Arc;

/// Maximum number of surfaces on a path, including those that it passes straight through. This is a property
/// of the renderer, not a limit to set: Russian roulette ends most paths earlier.
const MAX_VERTICES: u32 = 64;
/// After this many surfaces, weak paths are terminated at random (Russian roulette).
const SURE_VERTICES: u32 = 3;
/// How fast a ray widens that a rough surface reflects; textures seen by such rays need little detail.
const ROUGH_SPREAD: f32 = 0.2;

/// How directions to lights are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// By surfaces and by lights, combined by multiple importance sampling.
    #[default]
    Both,
    /// By surfaces only.
    Surfaces,
}

/// Results of a tile's paths besides light.
#[derive(Debug, Default)]
pub(super) struct Notes {
    /// Rays traced.
    pub(super) rays: u64,
    /// Messages of shaders.
    pub(super) messages: Vec<Said>,
    /// Messages of the camera.
    pub(super) camera: Vec<Said>,
    /// Names of unknown closures.
    pub(super) unknown: Vec<Arc<str>>,
    /// Contributions of light that were reduced to the maximum.
    pub(super) clamped: u64,
}

impl Notes {
    /// Adds the notes of other paths. `limits` bound the messages.
    pub(super) fn add(&mut self, more: Notes, limits: &Limits) {
        self.rays += more.rays;
        self.clamped += more.clamped;
        unite(&mut self.messages, more.messages, &limits.running);
        unite(&mut self.camera, more.camera, &limits.running);
        for name in more.unknown {
            if !self.unknown.contains(&name) {
                self.unknown.push(name);
            }
        }
    }
}

/// A path in progress.
struct Path {
    /// The sample that receives its light.
    slot: usize,
    pixel: usize,
    sampler: Sampler,
    origin: Vec3,
    direction: Vec3,
    /// The share of light at its end that reaches the camera.
    throughput: Vec3,
    /// The density of its direction; infinite if it was the only one.
    pdf: f32,
    /// The camera ray with its derivatives, until a surface changes its direction.
    lens: Option<Ray>,
    /// How far it sees surfaces.
    reach: f32,
    /// Width of the ray, and its growth per unit of length.
    width: f32,
    spread: f32,
    diffuse: u32,
    glossy: u32,
    vertex: u32,
    /// Whether the surface that the camera sees is recorded in the layers.
    recorded: bool,
    /// Whether the path only looks for lights because it has reached the maximum number of surfaces.
    last: bool,
}

impl Path {
    fn new(slot: usize, sample: &Sample, LensRay { ray, throughput, range: [near, far] }: LensRay) -> Path {
        Path {
            slot,
            pixel: sample.pixel,
            sampler: sample.sampler,
            origin: if near > 0.0 { ray.origin + ray.direction * near } else { ray.origin },
            direction: ray.direction,
            throughput,
            pdf: f32::INFINITY,
            lens: Some(ray),
            reach: far - near,
            width: ray.origin_derivs[0].length(),
            spread: ray.direction_derivs[0].length(),
            diffuse: 0,
            glossy: 0,
            vertex: 0,
            recorded: false,
            last: false,
        }
    }
}

/// Traces the paths through the pixels of a tile.
pub(super) struct Tracer<'w> {
    pub(super) world: &'w World,
    pub(super) strategy: Strategy,
    /// The largest contribution of light that reaches the visible surface from another one.
    pub(super) clamp: Option<f32>,
    pub(super) layers: &'w mut Layers,
    pub(super) notes: &'w mut Notes,
}

/// A sample to take: a pixel of the tile, its position on the image, its random numbers.
pub(super) struct Sample {
    pub(super) pixel: usize,
    pub(super) corner: [f32; 2],
    pub(super) sampler: Sampler,
}

impl Tracer<'_> {
    /// Returns the light of each sample.
    pub(super) fn trace(&mut self, samples: &[Sample]) -> Result<Vec<Vec3>, RunError> {
        let mut light = vec![Vec3::ZERO; samples.len()];
        let mut paths = self.starts(samples)?;
        while !paths.is_empty() {
            let mut met: Vec<PathHit> = Vec::new();
            for (index, path) in paths.iter().enumerate() {
                self.world.goes_on()?;
                let hit = self.world.hit(path.origin, path.direction, path.reach);
                self.notes.rays += 1;
                let gathered = self.gathered(path, hit.as_ref());
                // At the first reflection, this is direct light.
                let gathered = self.kept(gathered, path.vertex > 1);
                if let Some(light) = light.get_mut(path.slot) {
                    *light += gathered;
                }
                if let Some(hit) = hit.filter(|_| !path.last) {
                    met.push(Self::meet(index, path, hit));
                }
            }
            // A stable sort, so that points stay in the order of their pixels.
            met.sort_by_key(|m| (m.hit.material, paths.get(m.path).is_some_and(|p| p.lens.is_none())));
            let mut next = Vec::with_capacity(met.len());
            let camera = |m: &PathHit| paths.get(m.path).is_some_and(|p| p.lens.is_some());
            for hits in met.chunk_by(|a, b| a.hit.material == b.hit.material && camera(a) == camera(b)) {
                let Some(first) = hits.first() else { continue };
                let seen = camera(first);
                let shaded = shade::shade(self.world, first.hit.material, hits, seen)?;
                for (at, hit) in hits.iter().enumerate() {
                    self.world.goes_on()?;
                    let (Some(path), Some(scatter)) = (paths.get(hit.path), shaded.scatter.get(at)) else {
                        continue;
                    };
                    let first = seen && !path.recorded && !scatter.is_clear();
                    if first {
                        let depth = self.world.view.depth(hit.hit.point.p) as f32;
                        shade::record(self.layers, path.pixel, hit, &shaded, at, depth);
                    }
                    let (here, on) = self.scatter(path, hit, scatter);
                    let here = self.kept(here, path.vertex > 0);
                    if let Some(light) = light.get_mut(path.slot).filter(|_| here.is_finite()) {
                        *light += here;
                    }
                    next.extend(on.map(|on| Path { recorded: path.recorded || first, ..on }));
                }
                self.note(shaded, |at| {
                    hits.get(at).and_then(|hit| paths.get(hit.path)).map_or(0, |p| p.pixel)
                });
            }
            next.sort_by_key(|p| p.slot);
            paths = next;
        }
        Ok(light)
    }

    /// A contribution of light, reduced to the maximum if the visible surface gets it from another one.
    fn kept(&mut self, light: Vec3, indirect: bool) -> Vec3 {
        let largest = light.max_element();
        match self.clamp {
            Some(most) if indirect && largest > most => {
                self.notes.clamped += 1;
                light * (most / largest)
            }
            _ => light,
        }
    }

    /// Records the messages of shaders at the pixels of the hits.
    fn note(&mut self, mut shaded: Shaded, pixel: impl Fn(usize) -> usize) {
        for said in &mut shaded.messages {
            said.first = pixel(said.first);
        }
        let mut unknown: Vec<Arc<str>> = Vec::new();
        for (name, _) in shaded.scatter.iter().flat_map(|s| &s.unknown) {
            if !unknown.contains(name) {
                unknown.push(name.clone());
            }
        }
        let notes = Notes { messages: shaded.messages, unknown, ..Notes::default() };
        self.notes.add(notes, &self.world.limits);
    }

    /// The paths of the samples that have a ray.
    fn starts(&mut self, samples: &[Sample]) -> Result<Vec<Path>, RunError> {
        let aim = |sample: &Sample| {
            let [x, y, a, b] = sample.sampler.four(0);
            Aim { place: [sample.corner[0] + x, sample.corner[1] + y], sample: [a, b] }
        };
        let aims: Vec<Aim> = samples.iter().map(aim).collect();
        let mut rays = lens::rays(&self.world.view, self.world.lens.as_ref(), &aims)?;
        for said in &mut rays.messages {
            said.first = samples.get(said.first).map_or(0, |sample| sample.pixel);
        }
        self.notes.add(Notes { camera: rays.messages, ..Notes::default() }, &self.world.limits);
        let starts = samples.iter().zip(rays.rays).enumerate();
        Ok(starts.filter_map(|(slot, (sample, ray))| Some(Path::new(slot, sample, ray?))).collect())
    }

    /// Light of the sky and of lamps along a path.
    fn gathered(&self, path: &Path, hit: Option<&Hit>) -> Vec3 {
        let share = |pdf: f32| match self.strategy {
            Strategy::Both => mis::power(path.pdf, pdf),
            Strategy::Surfaces => 1.0,
        };
        let mut light = Vec3::ZERO;
        let sees_sky = self.world.background || path.lens.is_none();
        if let Some(sky) = self.world.sky.as_ref().filter(|_| hit.is_none() && sees_sky) {
            light += sky.radiance(path.direction) * share(sky.pdf(path.direction));
        }
        if path.lens.is_none() {
            let reach = hit.map_or(f32::INFINITY, |h| h.t);
            for lamp in &self.world.lights {
                if let Some((radiance, pdf)) = lamp.seen(path.origin, path.direction, reach) {
                    light += radiance * share(pdf);
                }
            }
        }
        light * path.throughput
    }

    /// The shading data of a hit.
    fn meet(index: usize, path: &Path, hit: Hit) -> PathHit {
        let footprint = match &path.lens {
            Some(ray) => Footprint::of(&hit.point, ray),
            None => Footprint::square(&hit.point, path.width + path.spread * hit.t),
        };
        PathHit { path: index, hit, incident: path.direction, footprint }
    }

    /// The light that a surface sends back along a path, and the continuation of the path.
    fn scatter(&mut self, path: &Path, met: &PathHit, scatter: &Scatter) -> (Vec3, Option<Path>) {
        let mut light = scatter.emitted * path.throughput;
        let vertex = path.vertex + 1;
        if scatter.is_black() || vertex > MAX_VERTICES {
            return (light, None);
        }
        light += self.lamps(path, &met.hit.point, scatter, 3 * vertex);
        let [u @ .., _] = path.sampler.four(self.set(3 * vertex));
        match scatter.next(u) {
            None => (light, None),
            Some(Next::Direction(chosen, way)) => (light, self.go_on(path, met, (chosen, way), vertex)),
            Some(Next::Below { weight, inside }) => {
                let mut random = path.sampler.stream(vertex);
                let object = met.hit.object.and_then(|object| self.world.objects.get(object));
                let exit = match object {
                    Some(object) if inside.radius.max_element() > 0.0 => {
                        let medium = Medium::new(&inside);
                        walk::walk(&object.body, &met.hit.point, &medium, &mut random)
                    }
                    // A plane has no interior: light leaves where it entered.
                    _ => Some(walk::Exit { point: met.hit.point, weight: inside.albedo }),
                };
                let Some(exit) = exit else { return (light, None) };
                let out = exit.point;
                let scatter = Scatter::diffuse(out.ng, out.n, out.ng, exit.weight * weight);
                light += self.lamps(path, &out, &scatter, 3 * vertex + 1);
                let [u @ .., _] = path.sampler.four(self.set(3 * vertex + 1));
                let Some(Next::Direction(chosen, way)) = scatter.next(u) else { return (light, None) };
                let met = PathHit { hit: Hit { point: out, ..met.hit }, ..*met };
                (light, self.go_on(path, &met, (chosen, way), vertex))
            }
        }
    }

    /// The number of a random set for a step: each step has sets for itself and for every light.
    fn set(&self, step: u32) -> u32 {
        1 + step * (2 + self.world.lights.len() as u32)
    }

    /// Direct light from lamps and from the sky, by sampling directions to them.
    fn lamps(&mut self, path: &Path, point: &SurfacePoint, scatter: &Scatter, step: u32) -> Vec3 {
        if !scatter.is_rough() {
            return Vec3::ZERO;
        }
        let set = self.set(step) + 1;
        let mut light = Vec3::ZERO;
        let mut add = |tracer: &mut Self, arriving: Arriving| {
            // A point light cannot be hit by chance.
            if tracer.strategy == Strategy::Surfaces && arriving.pdf.is_finite() {
                return;
            }
            let value = scatter.eval(arriving.wi);
            let here = value.weight * arriving.weight * mis::of_weights(arriving.pdf, value.pdf);
            if here.max_element() > 0.0 && here.is_finite() {
                let origin = leave(point.p, point.ng, arriving.wi);
                tracer.notes.rays += 1;
                if !tracer.world.blocked(origin, arriving.wi, arriving.distance) {
                    light += here;
                }
            }
        };
        let [a, b, ..] = path.sampler.four(set);
        let world = self.world;
        if let Some(arriving) = world.sky.as_ref().and_then(|sky| sky.sample([a, b])) {
            add(self, arriving);
        }
        for (index, lamp) in world.lights.iter().enumerate() {
            // The caller returns the error.
            if world.limits.halted().is_some() {
                break;
            }
            let [a, b, ..] = path.sampler.four(set + 1 + index as u32);
            if let Some(arriving) = lamp.sample(point.p, [a, b]) {
                add(self, arriving);
            }
        }
        light * path.throughput
    }

    /// The path in its new direction; `None` if it ends here.
    fn go_on(&self, path: &Path, met: &PathHit, (chosen, way): (Chosen, Way), vertex: u32) -> Option<Path> {
        let mut throughput = path.throughput * chosen.weight;
        if !(throughput.is_finite() && throughput.max_element() > 0.0) {
            return None;
        }
        if vertex > SURE_VERTICES && way != Way::Straight {
            let stay = throughput.max_element().min(1.0);
            if path.sampler.stream(vertex ^ 0x5bd1).next() >= stay {
                return None;
            }
            throughput /= stay;
        }
        let straight = way == Way::Straight;
        let mut next = Path {
            origin: leave(met.hit.point.p, met.hit.point.ng, chosen.wi),
            direction: chosen.wi,
            throughput,
            pdf: chosen.pdf,
            width: path.width + path.spread * met.hit.t,
            vertex,
            lens: path.lens.filter(|_| straight),
            reach: if straight { path.reach - met.hit.t } else { f32::INFINITY },
            ..*path
        };
        match way {
            // As if there were no surface.
            Way::Straight => return Some(next),
            Way::Diffuse => next.diffuse += 1,
            Way::Glossy => next.glossy += 1,
        }
        next.spread = next.spread.max(ROUGH_SPREAD * chosen.roughness);
        next.last = next.diffuse > self.world.diffuse_depth || next.glossy > self.world.glossy_depth;
        Some(next)
    }
}
