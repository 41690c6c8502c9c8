//! The surface of `--on` as a camera sees it: its shape or mesh, its displacement, the points in each pixel,
//! and the values of a shader there.

use super::setup;
use crate::event::{Event, Meters};
use crate::report::messages;
use crate::request::values::Gained;
use crate::request::{Image, Reading};
use crate::source::data;
use crate::source::input;
use crate::source::load::LoadedShader;
use crate::{Failure, Sink};
use osl::stages::{self, Compiled};
use osl_exec::{Frame, Plane, PointSource, Run, RunOptions, Said, Services, Spaces};
use osl_ir::ir::{Body, Kind, Output};
use osl_ir::passes;
use osl_ir::types::{Base, Type};
use osl_limits::Limits;
use osl_scene::answers::Place;
use osl_scene::camera::View;
use osl_scene::displace::{Displacement, displace};
use osl_scene::glam::{Mat4, Vec2, Vec3};
use osl_scene::mesh::{Bounds, Mesh, Triangles, read_obj_within};
use osl_scene::render;
use osl_scene::shape::{Placed, Shape, Solid, Surface};
use osl_scene::subdivide::{Detail, Scheme, tessellate_within};
use osl_scene::surface_points::SurfacePoints;
use osl_scene::view::{Seen, camera_for, clip, look};
use osl_scene::{Data, WithData};
use osl_syntax::spelling::closest;
use std::path::Path;
use std::sync::Arc;

/// The programs of the displacement and of the outputs.
pub type Programs<'a> = (Option<&'a Compiled>, Option<&'a Compiled>);

/// Maximum length in pixels of an edge.
const EDGE: f64 = 1.0;
/// Name of the layer that shows a displaced surface without its shader.
const LIGHT: &str = "light";

/// The points that the picture shows, the pixel of each, numbered row by row from the top, and the services
/// that know the view.
pub fn points(
    image: &Image,
    loaded: &LoadedShader,
    sink: &dyn Sink,
) -> Result<(WithData<SurfacePoints>, Vec<u32>, Services), Failure> {
    let mut job = Job::new(image, loaded, image.points.surface.displace.clone(), sink.meters())?;
    let displace = job.displacement()?;
    let (seen, services) = job.seen(displace.as_ref())?;
    let mut points = seen.points;
    points.stretch(Vec2::from(image.points.uv_scale), Vec2::from(image.points.uv_offset));
    Ok((WithData { points, data: job.data }, seen.pixels, services))
}

/// What to shade, and the surface.
pub struct Job<'a> {
    /// The picture.
    pub image: &'a Image,
    loaded: &'a LoadedShader,
    data: Data,
    shape: Source,
    /// The transformation of the surface to common space.
    to_common: Mat4,
    /// The output that displaces the surface.
    by: Option<Gained>,
    /// Maximum length of an edge in pixels.
    edge: f64,
    /// Warnings about the surface.
    pub warnings: Vec<String>,
    /// What the surface consists of, for the statistics.
    pub facts: Option<String>,
    meters: Meters,
    /// The messages of the displacement, and the number of vertices that have them.
    pub displaced: Vec<Said>,
    /// The number of vertices that have these messages.
    pub vertices: usize,
}

/// The origin of a surface.
enum Source {
    Shape(Shape),
    Mesh(Arc<Mesh>),
}

impl<'a> Job<'a> {
    /// A surface that an output displaces; without `--on`, a sphere.
    pub fn new(
        image: &'a Image,
        loaded: &'a LoadedShader,
        by: Option<Gained>,
        meters: Meters,
    ) -> Result<Job<'a>, Failure> {
        let name = image.points.surface.on.as_deref().unwrap_or("sphere");
        let shape = match Shape::named(name) {
            Some(shape) => Source::Shape(shape),
            None => Source::Mesh(mesh(name, &image.shader.read)?),
        };
        let edge = image.points.surface.edge_pixels.unwrap_or(EDGE);
        if edge.is_nan() || edge <= 0.0 {
            return Err(Failure::usage("--edge-pixels is to be above 0"));
        }
        if image.points.uv_scale.contains(&0.0) {
            return Err(Failure::usage("--uv-scale is not to be 0 on a surface"));
        }
        image.provided.globals.check(SurfacePoints::default().varying())?;
        let data = data::read(image, loaded.spoken.as_ref())?;
        // The rows for row vectors are the columns for column vectors.
        let to_common = image.provided.object_space.as_deref().map_or(Mat4::IDENTITY, Mat4::from_cols_array);
        Ok(Job {
            image,
            loaded,
            data,
            shape,
            to_common,
            by,
            edge,
            warnings: Vec::new(),
            facts: None,
            meters,
            displaced: Vec::new(),
            vertices: 0,
        })
    }

    /// The same with edges of this length in pixels, unless the command line has another one.
    #[must_use]
    pub fn with_edges(self, pixels: f64) -> Job<'a> {
        Job { edge: self.image.points.surface.edge_pixels.unwrap_or(pixels), ..self }
    }

    /// Sends what is special about the surface.
    pub fn send_facts(&self, sink: &mut dyn Sink) {
        self.warnings.iter().for_each(|warning| sink.warn(warning));
        self.facts.iter().for_each(|facts| sink.event(Event::Text(facts)));
    }

    fn limits(&self) -> &Limits {
        self.image.limits()
    }

    /// The outputs to show: the requested ones, or all except the displacement.
    pub fn shown(&self) -> Vec<Arc<str>> {
        match self.loaded.outputs(self.image) {
            Some(list) => list,
            None => {
                let by = self.by.as_ref().map(|output| output.name.as_str());
                // Closures are not shown, so they are not computed either.
                let pixels = |output: &&Output| output.ty.base != Base::Closure;
                let all = self.loaded.body.outputs.iter().filter(pixels).map(|output| output.name.clone());
                all.filter(|name| Some(&**name) != by).collect()
            }
        }
    }

    /// The program of the displacement.
    pub fn displacement(&self) -> Result<Option<Compiled>, Failure> {
        self.by.as_ref().map(|output| self.compile(&[output.name.as_str().into()])).transpose()
    }

    /// The program of some outputs.
    pub fn compile(&self, outputs: &[Arc<str>]) -> Result<Compiled, Failure> {
        let body: &Body = &self.loaded.body;
        if let Some(unknown) = outputs.iter().find(|o| !body.outputs.iter().any(|known| known.name == **o)) {
            let names: Vec<&str> = body.outputs.iter().map(|o| &*o.name).collect();
            let all = names.join(", ");
            let close = closest(unknown, names.iter().copied());
            let close = close.map_or_else(String::new, |name| format!("; did you mean `{name}`?"));
            return Err(Failure::new(format!("the shader has no output `{unknown}`; it has {all}{close}")));
        }
        let points = SurfacePoints::default();
        let options = passes::Options {
            outputs: Some(outputs.to_vec()),
            varying: points.varying().to_vec(),
            derivs: points.varying_derivs().to_vec(),
            without: self.image.running.without_pass.clone(),
            arithmetic: self.image.running.arithmetic.unwrap_or_default(),
            limits: self.limits().clone(),
            ..passes::Options::default()
        };
        Ok(stages::finish(body.clone(), &options))
    }

    /// Runs a program on points.
    fn shade(
        &self,
        compiled: &Compiled,
        points: SurfacePoints,
        services: &Services,
    ) -> Result<Frame, Failure> {
        let mut points = points;
        points.stretch(Vec2::from(self.image.points.uv_scale), Vec2::from(self.image.points.uv_offset));
        let points = WithData { points, data: self.data.clone() };
        let keeping = messages::keeping(&self.loaded.sources);
        let options = RunOptions { keeping, ..setup::options(self.image) };
        let run = Run::new(&compiled.program, services, &points, &options);
        let meter = (self.meters)(points.count() as u64, "points");
        let result = run.points(0..points.count(), &|done| meter.at(done as u64));
        result.map_err(|stop| setup::stopped(&stop, &self.loaded.sources))
    }

    /// The services for a surface of this reach.
    pub fn services(&self, view: &View, reach: f32) -> Services {
        let mut spaces = Spaces::default();
        let [near, far] = clip(reach);
        view.set_spaces(&mut spaces, near, far);
        for space in ["object", "shader"] {
            spaces.set(space, self.to_common.to_cols_array());
        }
        setup::services(self.image, self.loaded.folder.clone(), spaces)
    }

    /// The points of the picture, and the values that the shader computes there.
    pub fn picture(&mut self, (displacement, program): Programs<'_>) -> Result<(Seen, Frame), Failure> {
        let (width, height) = self.image.points.grid;
        let (seen, services) = self.seen(displacement)?;
        let mut frame = self.values(program, &seen, &services)?;
        for plane in &mut frame.planes {
            plane.words = scattered(&plane.words, &seen.pixels, width * height).into();
            plane.wide = Vec::new();
        }
        Ok((seen, frame))
    }

    /// The values of a program at points; without a program, light from the camera.
    pub fn values(
        &self,
        program: Option<&Compiled>,
        seen: &Seen,
        services: &Services,
    ) -> Result<Frame, Failure> {
        match program {
            Some(program) => self.shade(program, seen.points.clone(), services),
            None => Ok(Frame { planes: vec![head_light(&seen.points)], ..Frame::default() }),
        }
    }

    /// The points of the picture, and the services that know its view.
    fn seen(&mut self, displacement: Option<&Compiled>) -> Result<(Seen, Services), Failure> {
        let (view, surface, services) = self.view(displacement)?;
        Ok((look(&view, &surface), services))
    }

    /// The view, the surface, and the services that know both.
    pub fn view(
        &mut self,
        displacement: Option<&Compiled>,
    ) -> Result<(View, render::Body, Services), Failure> {
        let (width, height) = self.image.points.grid;
        let (bounds, reach) = self.whole()?;
        self.place();
        let camera = camera_for(&bounds, reach, self.image.points.surface.eye, [width, height]);
        let mut view = camera.view().map_err(Failure::new)?;
        let services = self.services(&view, reach);
        let surface = self.surface(displacement, &view, &services)?;
        // A larger surface is seen from farther away, where its edges are shorter.
        if displacement.is_some() && surface.reach() > reach {
            let camera = camera_for(
                &surface.bounds(),
                surface.reach(),
                self.image.points.surface.eye,
                [width, height],
            );
            view = camera.view().map_err(Failure::new)?;
        }
        let services = self.services(&view, surface.reach());
        self.see(&services);
        Ok((view, surface, services))
    }

    /// The box around the surface before displacement, and its radius.
    pub fn whole(&self) -> Result<(Bounds, f32), Failure> {
        match &self.shape {
            Source::Shape(shape) => {
                let placed = self.placed(*shape)?;
                Ok((placed.bounds(), placed.reach()))
            }
            Source::Mesh(mesh) => {
                let mut mesh = Mesh::clone(mesh);
                mesh.transform(&self.to_common);
                // A smooth surface is smaller than its control mesh; two levels show by how much.
                let positions = match self.image.points.surface.catmull_clark {
                    true => {
                        let found =
                            tessellate_within(&mesh, Scheme::CatmullClark, &Detail::Level(2), self.limits());
                        found.map_err(Failure::new)?.triangles.positions
                    }
                    false => mesh.positions,
                };
                let bounds = Bounds::of(positions.iter().copied());
                let far = positions.iter().map(|p| p.distance(bounds.center())).fold(0.0, f32::max);
                Ok((bounds, far))
            }
        }
    }

    fn placed(&self, shape: Shape) -> Result<Placed, Failure> {
        Placed::new(shape, self.to_common)
            .ok_or_else(|| Failure::usage("--object-space is to be a matrix that can be inverted"))
    }

    /// Notes where the surface is, for its data.
    pub fn place(&mut self) {
        let bounds = match &self.shape {
            Source::Shape(shape) => Placed::new(*shape, Mat4::IDENTITY).map(|placed| placed.bounds()),
            Source::Mesh(mesh) => Some(Bounds::of(mesh.positions.iter().copied())),
        };
        let place = Place { to_common: self.to_common, ..Place::default() };
        self.data.place = Place { bounds: bounds.unwrap_or(place.bounds), ..place };
    }

    /// Notes how the surface is seen, and returns its data.
    pub fn see(&mut self, services: &Services) -> &Data {
        let window = services.spaces.matrix("common", "NDC").ok();
        self.data.place.to_window = window.map(|matrix| Mat4::from_cols_array(&matrix));
        &self.data
    }

    /// The visible surface, displaced if requested.
    pub fn surface(
        &mut self,
        displacement: Option<&Compiled>,
        view: &View,
        services: &Services,
    ) -> Result<render::Body, Failure> {
        if let (Source::Shape(shape), None) = (&self.shape, displacement) {
            return Ok(render::Body::Shape(self.placed(*shape)?));
        }
        let gain = self.by.as_ref().map_or(1.0, |output| output.gain);
        let mut triangles = self.triangles(view, displacement.is_some())?;
        if let Some(compiled) = displacement {
            let moved = displace(&mut triangles, |points| {
                self.shade(compiled, points.clone(), services).and_then(|frame| {
                    self.vertices += points.count();
                    self.displaced.extend(frame.messages.iter().cloned());
                    by(&frame, points, gain)
                })
            })?;
            if moved.stayed > 0 {
                let (stayed, all) = (moved.stayed, moved.points);
                self.warnings.push(format!(
                    "{stayed} of {all} points stay in place, since their displacement is not finite"
                ));
            }
        }
        Ok(render::Body::Solid(Solid::new(triangles)))
    }

    /// The surface as triangles that are small enough.
    fn triangles(&mut self, view: &View, displaced: bool) -> Result<Triangles, Failure> {
        let on = &self.image.points.surface;
        let scheme = if on.catmull_clark { Scheme::CatmullClark } else { Scheme::Linear };
        let adaptive = Detail::Pixels { view, edge: self.edge };
        let detail = match on.level {
            Some(level) => Detail::Level(level),
            // A mesh that does not change needs no more triangles.
            None if !displaced && !on.catmull_clark => Detail::Level(0),
            None => adaptive,
        };
        let (triangles, level, fine) = match &self.shape {
            Source::Shape(shape) => {
                shape.triangles_within(&self.to_common, &detail, self.limits()).map_err(Failure::new)?
            }
            Source::Mesh(mesh) => {
                let mut mesh = Mesh::clone(mesh);
                mesh.transform(&self.to_common);
                let found = tessellate_within(&mesh, scheme, &detail, self.limits()).map_err(Failure::new)?;
                if !found.oddities.is_empty() {
                    self.warnings.push(format!("the mesh has {}", found.oddities));
                }
                (found.triangles, found.level, found.fine)
            }
        };
        if !fine {
            self.warnings.push(format!("level {level} is the finest, and edges are longer than asked"));
        }
        if self.image.wanted.stats {
            self.facts = Some(format!("level {level}, {} triangles", triangles.indices.len()));
        }
        Ok(triangles)
    }
}

/// The mesh of a file.
fn mesh(name: &str, read: &Reading) -> Result<Arc<Mesh>, Failure> {
    let path = Path::new(name);
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) {
        let names: Vec<&str> = Shape::NAMED.iter().map(|(name, _)| *name).collect();
        let names = names.join(", ");
        return Err(Failure::new(format!("`{name}` is no surface; there are {names}, and files *.obj")));
    }
    let mesh = || {
        let text =
            input::read_text(path, read).map_err(|e| Failure::new(format!("cannot read {name}: {e}")))?;
        let mesh = read_obj_within(&text, &read.limits).map_err(|e| Failure::new(format!("{name}: {e}")))?;
        Ok((Arc::new(mesh), Some(vec![path.to_owned()])))
    };
    read.snapshot.keep(|kept| &mut kept.mesh, || name.to_string(), mesh)
}

/// The meaning of the displacement's output, whose movement a gain multiplies.
fn by(frame: &Frame, points: &SurfacePoints, gain: f32) -> Result<Displacement, Failure> {
    let values: Vec<Vec<f32>> = frame.planes.iter().map(Plane::floats).collect();
    match (values.as_slice(), frame.planes.first().map(|plane| plane.ty)) {
        ([along], _) => Ok(Displacement::Along(along.iter().map(|x| x * gain).collect())),
        ([x, y, z], Some(ty)) => {
            let list: Vec<Vec3> = x.iter().zip(y).zip(z).map(|((x, y), z)| Vec3::new(*x, *y, *z)).collect();
            Ok(match ty == Type::POINT {
                true if gain == 1.0 => Displacement::To(list),
                true => Displacement::By(
                    list.iter().zip(points.points()).map(|(to, from)| (*to - from.p) * gain).collect(),
                ),
                false => Displacement::By(list.iter().map(|by| *by * gain).collect()),
            })
        }
        _ => Err(Failure::new("a displacement is a float, a vector or a point")),
    }
}

/// The surface lit by a light at the camera.
fn head_light(points: &SurfacePoints) -> Plane {
    let facing = points.lit_from_eye();
    Plane {
        output: LIGHT.into(),
        ty: Type::FLOAT,
        component: 0,
        kind: Kind::Float,
        words: facing.into_iter().map(f32::to_bits).collect(),
        wide: Vec::new(),
    }
}

/// The values of points at their pixels; other pixels are 0.
pub fn scattered<T: Copy + Default>(values: &[T], pixels: &[u32], count: usize) -> Vec<T> {
    let mut all = vec![T::default(); count];
    for (value, pixel) in values.iter().zip(pixels) {
        if let Some(to) = all.get_mut(*pixel as usize) {
            *to = *value;
        }
    }
    all
}
