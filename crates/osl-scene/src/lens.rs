//! Cameras that a shader describes. A program computes the ray of each sample: where it starts, its
//! direction, and the share of light that reaches the image.
//!
//! [`rays`] is the one source of a picture's rays: without a shader they are those of the perspective camera.
//! This module must not know what the rays hit, or how a shader's outputs were found.

use crate::Data;
use crate::bsdf::disk;
use crate::camera::{Ray, View};
use glam::{DVec3, Vec3};
use osl_exec::{
    Datum, Message, Plane, PointSource, Program, Run, RunError, RunOptions, Said, Services, unite,
};
use osl_ir::global::Global;
use osl_ir::ir::{Axis, Const};
use osl_limits::Limits;

/// What a camera shader reads, and the space of the ray that it returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// P is the place on the image, from 0 to 1 to the right and upwards, and N has two random numbers. The
    /// ray is in camera space: x to the right, y up, z ahead. A ray without a direction is an error.
    Raster,
    /// P is the position of the camera, I its direction, N its upward direction; u and v are the place on the
    /// image. The ray is in common space. A ray without a direction is not wanted, which is no error.
    Sight,
}

/// The names of a program's outputs, from which [`rays`] reads: start, direction, and their changes to the
/// next pixel; then throughput, and the range in units of the direction.
pub const OUTPUTS: [&str; 9] = [
    "ray_position",
    "ray_direction",
    "ray_dpdx",
    "ray_dpdy",
    "ray_dddx",
    "ray_dddy",
    "ray_throughput",
    "ray_near",
    "ray_far",
];

/// Globals that differ from ray to ray.
pub const VARYING: [Global; 4] = [Global::P, Global::N, Global::U, Global::V];

/// A camera shader that is ready to run.
#[derive(Debug)]
pub struct Lens {
    /// What it reads and returns.
    pub convention: Convention,
    /// Computes [`OUTPUTS`].
    pub program: Program,
    /// Its services.
    pub services: Services,
    /// Values of attributes in place of the usual ones.
    pub data: Data,
    /// What it may cost.
    pub limits: Limits,
}

/// What a ray is wanted for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aim {
    /// The place on the image, in pixels from its upper left corner.
    pub place: [f32; 2],
    /// Two random numbers from 0 to 1: the place on the aperture.
    pub sample: [f32; 2],
}

/// A ray that is to be traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    /// The ray, in common space.
    pub ray: Ray,
    /// The share of light that reaches the image; not all 0.
    pub throughput: Vec3,
    /// The distances between which it sees surfaces.
    pub range: [f32; 2],
}

/// The rays of some samples.
#[derive(Debug, Default)]
pub struct Rays {
    /// The ray of each sample; `None` is black.
    pub rays: Vec<Option<LensRay>>,
    /// Messages of the shader, and of rays that make no sense, with the numbers of their samples.
    pub messages: Vec<Said>,
}

/// The rays of some samples.
///
/// # Errors
/// The shader exceeds its budget.
pub fn rays(view: &View, lens: Option<&Lens>, aims: &[Aim]) -> Result<Rays, RunError> {
    let Some(lens) = lens else {
        let ray = |aim: &Aim| view.ray(aim.place[0], aim.place[1]);
        let whole = |ray| LensRay { ray, throughput: Vec3::ONE, range: [0.0, f32::INFINITY] };
        let rays = aims.iter().map(|aim| Some(whole(ray(aim)))).collect();
        return Ok(Rays { rays, messages: Vec::new() });
    };
    let points = Points { view, lens, aims };
    // One tile, so that it runs on this thread only: the caller has tiles of its own.
    let options =
        RunOptions { tile: aims.len().max(1), limits: lens.limits.clone(), ..RunOptions::default() };
    let run = Run::new(&lens.program, &lens.services, &points, &options);
    let frame = run.points(0..aims.len(), &|_| ()).map_err(without_place)?;
    let read = Columns::of(&frame.planes);
    let mut rays = Vec::with_capacity(aims.len());
    let mut messages = frame.messages;
    for at in 0..aims.len() {
        let ray = lens.convention.ray(view, |output| read.triple(output, at));
        let said = match &ray {
            Ok(_) => None,
            Err(Missing::Broken) => Some(Message::error("the camera gives no ray, so the sample is black")),
            Err(Missing::Empty) => Some(Message::note("the range of the ray is empty, so it sees nothing")),
        };
        messages.extend(said.map(|message| Said { message, points: Some(1), first: at }));
        rays.push(ray.ok().flatten());
    }
    let mut all = Vec::new();
    unite(&mut all, messages, &lens.limits.running);
    Ok(Rays { rays, messages: all })
}

/// The same without its place, which is in the sources of the camera: the caller has those of the scene.
fn without_place(mut stop: RunError) -> RunError {
    if let RunError::TooManySteps { span, .. } | RunError::TooMuchMemory { span, .. } = &mut stop {
        *span = None;
    }
    stop
}

/// Why a sample has no ray although light would reach it.
enum Missing {
    /// The values make no sense.
    Broken,
    /// It ends before it begins.
    Empty,
}

/// The components of [`OUTPUTS`].
struct Columns<'a>([[Option<&'a [u32]>; 3]; OUTPUTS.len()]);

impl<'a> Columns<'a> {
    fn of(planes: &'a [Plane]) -> Columns<'a> {
        let component = |name: &str, component: usize| {
            let is_it = |plane: &&Plane| &*plane.output == name && plane.component == component;
            planes.iter().find(is_it).map(|plane| &*plane.words)
        };
        Columns(OUTPUTS.map(|name| std::array::from_fn(|at| component(name, at))))
    }

    /// The value of an output for a sample; a single number is in x.
    fn triple(&self, output: usize, at: usize) -> DVec3 {
        let word = |column: Option<&[u32]>| column.and_then(|words| words.get(at)).copied().unwrap_or(0);
        let columns = self.0.get(output).copied().unwrap_or_default();
        Vec3::from_array(columns.map(|column| f32::from_bits(word(column)))).as_dvec3()
    }
}

impl Convention {
    /// The ray of a sample from the values of [`OUTPUTS`]; none if the shader wants none.
    fn ray(self, view: &View, value: impl Fn(usize) -> DVec3) -> Result<Option<LensRay>, Missing> {
        let throughput = value(6).as_vec3();
        if throughput.is_finite() && throughput.max_element() <= 0.0 {
            return Ok(None);
        }
        let (position, axes) = match self {
            Convention::Raster => (view.position().as_dvec3(), view.axes()),
            Convention::Sight => (DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z]),
        };
        let turned = |v: DVec3| axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
        let way = turned(value(1));
        let length = way.length();
        if length == 0.0 && self == Convention::Sight {
            return Ok(None);
        }
        let (direction, start) = (way / length, position + turned(value(0)));
        let (near, far) = ((value(7).x * length).max(0.0), value(8).x * length);
        if !(direction.is_finite() && start.as_vec3().is_finite() && throughput.is_finite()) {
            return Err(Missing::Broken);
        }
        if near.is_nan() || far.is_nan() || near >= far {
            return Err(Missing::Empty);
        }
        let finite = |v: DVec3| if v.is_finite() { v.as_vec3() } else { Vec3::ZERO };
        // The derivative of a normalised vector: what is across it, by its length.
        let turn = |d: DVec3| finite((d - direction * direction.dot(d)) / length);
        let ray = Ray {
            origin: start.as_vec3(),
            direction: direction.as_vec3(),
            origin_derivs: [2, 3].map(|output| finite(turned(value(output)))),
            direction_derivs: [4, 5].map(|output| turn(turned(value(output)))),
        };
        let range = [near as f32, far as f32];
        Ok(Some(LensRay { ray, throughput: throughput.max(Vec3::ZERO), range }))
    }
}

/// The rays to compute, as the points of a program.
struct Points<'a> {
    view: &'a View,
    lens: &'a Lens,
    aims: &'a [Aim],
}

impl Points<'_> {
    /// The place of a sample on the image, from 0 to 1 to the right and upwards.
    fn raster(&self, at: usize) -> [f32; 2] {
        let [width, height] = self.view.resolution().map(|n| n as f32);
        let [x, y] = self.aims.get(at).map_or([0.0; 2], |aim| aim.place);
        [x / width, 1.0 - y / height]
    }

    fn value(&self, global: Global, at: usize) -> [f32; 3] {
        let [x, y] = self.raster(at);
        match (self.lens.convention, global) {
            (Convention::Raster, Global::P) => [x, y, 0.0],
            (Convention::Raster, Global::N) => {
                let [a, b] = self.aims.get(at).map_or([0.0; 2], |aim| aim.sample);
                [a, b, 0.0]
            }
            (Convention::Sight, Global::U) => [x, 0.0, 0.0],
            (Convention::Sight, Global::V) => [y, 0.0, 0.0],
            (Convention::Sight, _) => self.uniform(global),
            _ => [0.0; 3],
        }
    }

    /// Attributes of the image and of the lens. Objects and elements are not told apart.
    fn known(&self, name: &str, at: usize) -> Option<Datum> {
        let floats = |list: [f32; 2]| Datum::array(list.map(Const::Float).to_vec());
        let time = self.uniform(Global::Time)[0];
        Some(match name {
            "cam:sensor_size" => number(&SENSOR_MM),
            "cam:image_resolution" => number(&self.view.resolution().map(|n| n as f32)),
            "cam:focal_distance" => number(&[self.view.sight()]),
            "cam:aperture_aspect_ratio" => number(&[1.0]),
            "cam:aperture_size" => number(&[0.0]),
            "cam:aperture_position" => {
                let given = self.lens.data.find("", "cam:aperture_size", None);
                let size = given.and_then(|datum| float(datum.values.first()?)).unwrap_or(0.0);
                let sample = self.aims.get(at).map_or([0.5; 2], |aim| aim.sample);
                number(&(disk(sample) * size).to_array())
            }
            "scene:time" => number(&[time]),
            "scene:frame" => number(&[time * FRAMES_PER_SECOND]),
            "hit:uv" => floats(self.raster(at)),
            _ => return self.view.facts([0.0, f32::INFINITY]).attribute(name),
        })
    }
}

/// Width and height of the sensor in millimetres, as most cameras of scenes have it.
const SENSOR_MM: [f32; 2] = [36.0, 24.0];
/// The rate that makes frames of seconds.
const FRAMES_PER_SECOND: f32 = 24.0;

/// One, two or three numbers as an attribute of the lens: two are a triple whose third number is 0, and their
/// mean as a float; a single one is also a triple of equal numbers.
fn number(list: &[f32]) -> Datum {
    let (triple, single) = match list {
        [x] => ([*x; 3], *x),
        [x, y] => ([*x, *y, 0.0], (x + y) / 2.0),
        _ => {
            let triple = std::array::from_fn(|at| list.get(at).copied().unwrap_or(0.0));
            (triple, triple.iter().sum::<f32>() / 3.0)
        }
    };
    let four = triple.into_iter().chain([1.0]).map(Const::Float).collect();
    Datum::one(Const::Float(single)).or(Datum::one(Const::Triple(triple))).or(Datum::array(four))
}

fn float(value: &Const) -> Option<f32> {
    match value {
        Const::Float(x) => Some(*x),
        Const::Int(n) => Some(*n as f32),
        _ => None,
    }
}

/// Attributes of the lens that a user gives as numbers, in all forms in which shaders ask for them.
#[must_use]
pub fn in_all_forms(mut data: Data) -> Data {
    for (name, datum) in data.attributes.iter_mut().chain(&mut data.user) {
        let numbers: Option<Vec<f32>> = datum.values.iter().map(float).collect();
        let is_own = name.starts_with("cam:") || name.starts_with("scene:");
        if let Some(numbers) = numbers.filter(|list| is_own && (1..=3).contains(&list.len())) {
            *datum = number(&numbers);
        }
    }
    data
}

impl PointSource for Points<'_> {
    fn count(&self) -> usize {
        self.aims.len()
    }

    fn varying(&self) -> &[Global] {
        &VARYING
    }

    fn uniform(&self, global: Global) -> [f32; 3] {
        let [_, up, forward] = self.view.axes();
        match (self.lens.data.globals.get(&global), self.lens.convention, global) {
            (Some(value), ..) => *value,
            (None, Convention::Sight, Global::P) => self.view.position().to_array(),
            (None, Convention::Sight, Global::I) => forward.as_vec3().to_array(),
            (None, Convention::Sight, Global::N) => up.as_vec3().to_array(),
            _ => [0.0; 3],
        }
    }

    fn deriv(&self, global: Global, axis: Axis) -> [f32; 3] {
        let [width, height] = self.view.resolution().map(|n| n as f32);
        match (self.lens.convention, global, axis) {
            (Convention::Raster, Global::P, Axis::X) | (Convention::Sight, Global::U, Axis::X) => {
                [1.0 / width, 0.0, 0.0]
            }
            (Convention::Raster, Global::P, Axis::Y) => [0.0, 1.0 / height, 0.0],
            (Convention::Sight, Global::V, Axis::Y) => [1.0 / height, 0.0, 0.0],
            _ => [0.0; 3],
        }
    }

    fn fill(&self, global: Global, first: usize, width: usize, lanes: &mut [f32]) {
        let width = width.max(1);
        let last = self.aims.len().saturating_sub(1);
        for lane in 0..width.min(lanes.len()) {
            let value = self.value(global, (first + lane).min(last));
            for (lanes, x) in lanes.chunks_mut(width).zip(value) {
                lanes[lane] = x;
            }
        }
    }

    fn attribute(&self, object: &str, name: &str, element: Option<usize>, point: usize) -> Option<Datum> {
        self.lens.data.find(object, name, element).or_else(|| self.known(name, point))
    }

    fn attribute_is_shared(&self, object: &str, name: &str, element: Option<usize>) -> bool {
        !matches!(name, "cam:aperture_position" | "hit:uv")
            || self.lens.data.find(object, name, element).is_some()
    }
}
