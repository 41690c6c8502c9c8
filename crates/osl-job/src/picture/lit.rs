//! A surface with the shader, on a floor, under a lamp and a sky.
//!
//! The surface is that of the request, or a sphere. A shader that yields a closure is shown as it is; from
//! the outputs of other shaders, the material `preview_material` makes a closure. The picture comes from the
//! path tracer of scenes.

use super::camera::CameraShader;
use super::layer::{followed, own};
use super::roles::{Asked, Roles};
use super::sight::Job;
use super::{Done, setup};
use crate::Failure;
use crate::event::{Meters, Sink};
use crate::file::light::Stored;
use crate::report::messages::Report;
use crate::report::rays;
use crate::request::bounds::displayed;
use crate::request::values::STDOUT;
use crate::request::{Image, Light};
use crate::source::dialect::{self, Role};
use crate::source::load::LoadedShader;
use osl::stages;
use osl_exec::{PointSource, Program, Services};
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_lower::Requests;
use osl_scene::Data;
use osl_scene::glam::{Vec2, Vec3};
use osl_scene::render::{self, Ground, Material, Object, Picture, RenderOptions, World};
use osl_scene::shape::Surface;
use osl_scene::stage::Stage;
use osl_scene::surface_points::SurfacePoints;
use osl_syntax::source::SourceMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum length in pixels of an edge of a displaced surface.
const EDGE: f64 = 5.0;
/// Paths per pixel.
const SAMPLES: u32 = 4;
/// Maximum number of paths per pixel with `--max-error`.
const MOST: u32 = 1024;
/// The largest contribution of light that a surface gets from another one.
const CLAMP: f32 = 2.0;
/// Squares of the floor per reach of the surface.
const SQUARES: f32 = 1.0;
/// Diffuse reflections from surface to surface.
const DEPTH: u32 = 1;
/// Mirrors and interfaces on a path: glass has two at least, and light may be reflected inside.
const GLOSSY_DEPTH: u32 = 6;

/// Renders the picture and writes it.
pub(super) fn run(
    image: &Image,
    light: &Light,
    mut loaded: LoadedShader,
    started: Instant,
    sink: &mut dyn Sink,
) -> Result<Done, Failure> {
    let camera = CameraShader::recognised(image, light, &mut loaded, sink)?;
    let roles = if camera.is_some() { Roles::default() } else { roles(image, light, &loaded)? };
    let body = match (&camera, &roles.closure) {
        (Some(_), _) => alone("preview_material", Vec::new())?,
        (None, Some(_)) => loaded.body.clone(),
        (None, None) => material(&mut loaded, &roles, image)?,
    };
    let closure: Arc<str> = roles.closure.as_deref().unwrap_or("Ci").into();
    let job = Job::new(image, &loaded, roles.displace.clone(), sink.meters())?.with_edges(EDGE);
    let through = dialect::output_for(Role::Transparency, loaded.spoken.as_ref(), &loaded.program);
    let through = through.filter(|_| roles.closure.is_some()).map(Arc::from);
    let mut staged = Staged { image, job, camera, closure, through };
    let threads = image.running.threads;
    let world = setup::on_threads(threads, || staged.world(&body))??;
    let prepared = started.elapsed();
    let drawing = match (&light.rays, &world.lens) {
        (Some(path), Some(lens)) => Some(rays::file(&world.view, lens, &loaded.name, path)?),
        (Some(_), None) => return Err(Failure::new(CameraShader::missing(&loaded.name))),
        (None, _) => None,
    };
    let meters = sink.meters();
    let picture = setup::on_threads(threads, || picture(image, light, &world, &loaded.sources, &meters))??;
    let rendered = started.elapsed() - prepared;

    staged.job.send_facts(sink);
    let textures = setup::services(image, loaded.folder.clone(), osl_exec::Spaces::default()).textures;
    let report = Report {
        sources: &loaded.sources,
        points: (staged.job.vertices as u64, "vertices"),
        width: None,
        textures: &textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    let mut messages = report.send(&staged.job.displaced, sink);
    let hits = Report { points: (0, "hits"), width: Some(image.points.grid.0), ..report };
    messages.add(hits.send(&picture.messages, sink));
    messages.add(Report { points: (picture.samples, "rays"), ..hits }.send(&picture.camera, sink));
    note_unknown(&picture.unknown, sink);
    messages.judge(image.shader.lints.denies_errors())?;
    let shown = if staged.camera.is_some() { "what the camera sees".into() } else { roles.words() };
    sink.note(&format!("the preview shows {shown}"));
    note_clamped(&picture, sink);
    let stored = Stored {
        curve: light.view.unwrap_or_default(),
        exposure: image.output.display.stops(),
        half: image.output.half,
        compression: image.output.compression,
        part: image.part(),
        command: image.output.command.as_deref(),
    };
    let mut done = Done { messages, times: [prepared, rendered], ..Done::default() };
    done.cost = image.wanted.stats.then(|| stats(&picture, &world, [prepared, rendered]));
    if image.wanted.values {
        done.light = Some(stored.samples(&picture)?);
    }
    if let Some(path) = &image.output.path {
        sink.settle()?;
        let named = image.output.display.named(path)?;
        let mut files = Vec::new();
        if path.as_os_str() == STDOUT {
            done.piped = stored.file(&picture, &named, None)?.into_bytes();
        } else {
            files.push(stored.file(&picture, &named, Some(path))?);
            done.files.push(path.clone());
        }
        files.extend(drawing);
        done.files.extend(light.rays.clone());
        osl_files::save_all(files).map_err(Failure::new)?;
    }
    (done.sources, done.name) = (loaded.sources.clone(), loaded.name.clone());
    Ok(done)
}

/// Sends a note if light was reduced to the maximum.
fn note_clamped(picture: &Picture, sink: &mut dyn Sink) {
    if picture.clamped > 0 {
        let share = 100.0 * picture.clamped as f64 / picture.samples.max(1) as f64;
        let share = if share < 0.1 { "less than 0.1 %".to_string() } else { format!("{share:.1} %") };
        sink.note(&format!(
            "{share} of the paths carried so much reflected light that it was reduced to {CLAMP}; --raw keeps it"
        ));
    }
}

/// Sends a note for each closure that the renderer does not know.
pub fn note_unknown<Name: AsRef<str>>(names: &[Name], sink: &mut dyn Sink) {
    for name in names {
        let name = name.as_ref();
        sink.note(&format!(
            "the closure `{name}` is not known here: its part of the light is squares of magenta and yellow"
        ));
    }
}

/// The times of a picture, the number of rays, and its mean error, as lines of text.
pub fn stats(picture: &Picture, world: &World, [prepared, rendered]: [Duration; 2]) -> String {
    let seconds = rendered.as_secs_f64().max(1e-9);
    let triangles: usize = world.objects.iter().map(|o| o.body.triangles()).sum();
    let pixels = (picture.width * picture.height).max(1);
    let error = picture.layers.iter().find(|l| &*l.name == "error").and_then(|l| l.planes.first());
    let mean = error.map_or(0.0, |plane| plane.iter().map(|x| f64::from(*x)).sum::<f64>() / pixels as f64);
    // A single path per pixel does not show how far pixels scatter.
    let error =
        if mean.is_finite() { format!("mean error {mean:.4}") } else { "mean error unknown".to_string() };
    format!(
        "prepare {:.0} ms ({triangles} triangles), render {:.0} ms\n{} paths ({:.1} a pixel), {} rays, {:.0} rays/s, \
         {error}\n",
        prepared.as_secs_f64() * 1e3,
        seconds * 1e3,
        picture.samples,
        picture.samples as f64 / pixels as f64,
        picture.rays,
        picture.rays as f64 / seconds
    )
}

/// The roles of the outputs.
fn roles(image: &Image, light: &Light, loaded: &LoadedShader) -> Result<Roles, Failure> {
    let asked = Asked {
        base: light.base.as_deref(),
        bump: light.bump.as_ref(),
        normal: light.normal.as_deref(),
        roughness: light.roughness.as_deref(),
        displace: image.points.surface.displace.as_ref(),
    };
    Roles::of(&loaded.program, &loaded.body, asked)
}

/// The body of the shader, followed by a material that its outputs feed.
fn material(loaded: &mut LoadedShader, roles: &Roles, image: &Image) -> Result<Body, Failure> {
    let values = roles.bump.as_ref().map(|bump| ("height_scale", bump.gain.to_string()));
    let links = [
        (roles.base.as_deref(), "base"),
        (roles.bump.as_ref().map(|bump| bump.name.as_str()), "height"),
        (roles.normal.as_deref(), "shading_normal"),
        (roles.roughness.as_deref(), "roughness"),
    ];
    let links: Vec<_> = links.into_iter().filter_map(|(from, to)| Some((from?, to))).collect();
    followed(loaded, "preview_material", values.as_slice(), &links, image)
}

/// The program that computes the closure of a body, and another output.
fn program(body: &Body, closure: &Arc<str>, other: Option<&Arc<str>>, image: &Image) -> Program {
    let points = SurfacePoints::default();
    let options = passes::Options {
        outputs: Some(other.into_iter().chain([closure]).cloned().collect()),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        without: image.running.without_pass.clone(),
        arithmetic: image.running.arithmetic.unwrap_or_default(),
        limits: image.limits().clone(),
        ..passes::Options::default()
    };
    stages::finish(body.clone(), &options).program
}

/// The body of a built-in shader.
fn alone(name: &str, values: Vec<(String, String)>) -> Result<Body, Failure> {
    let (program, _) = own(name)?;
    let body = stages::lower_for(&program, &values, &Requests::default());
    body.map_err(|_| Failure::new(format!("{name} cannot be compiled")))
}

/// The surface on its stage.
struct Staged<'a> {
    image: &'a Image,
    job: Job<'a>,
    camera: Option<CameraShader>,
    /// The output that is the closure of the surface.
    closure: Arc<str>,
    /// The output that lets light through.
    through: Option<Arc<str>>,
}

impl Staged<'_> {
    fn world(&mut self, body: &Body) -> Result<World, Failure> {
        let resolution: [usize; 2] = self.image.points.grid.into();
        let most = self.image.limits().scenes.pixels;
        if (resolution[0] as u64).saturating_mul(resolution[1] as u64) > most {
            let [width, height] = resolution;
            let text = format!("{width} x {height} pixels are more than {most} (--limit scenes.pixels=N)");
            return Err(Failure::new(text));
        }
        let displacement = self.job.displacement()?;
        let (bounds, reach) = self.job.whole()?;
        self.job.place();
        let mut stage = Stage { bounds, reach };
        let mut view =
            stage.camera(self.image.points.surface.eye, resolution).view().map_err(Failure::new)?;
        let services = self.job.services(&view, reach);
        let surface = self.job.surface(displacement.as_ref(), &view, &services)?;
        if displacement.is_some() {
            stage = Stage { bounds: surface.bounds(), reach: surface.reach() };
            view = stage.camera(self.image.points.surface.eye, resolution).view().map_err(Failure::new)?;
        }
        let stretch = [Vec2::from(self.image.points.uv_scale), Vec2::from(self.image.points.uv_offset)];
        let services = self.job.services(&view, stage.reach);
        let data = self.job.see(&services).clone();
        let [seen, lean] = [(); 2].map(|()| program(body, &self.closure, self.through.as_ref(), self.image));
        let material = Material {
            program: seen,
            lean,
            services,
            color: None,
            stretch: (stretch != [Vec2::ONE, Vec2::ZERO]).then_some(stretch),
            through: self.through.clone(),
            data,
        };
        let ground = Ground { point: stage.floor(), normal: Vec3::Y, material: 1 };
        Ok(World {
            view,
            lens: self.camera.as_ref().map(|camera| camera.lens(self.image, &view)),
            objects: vec![Object { body: surface, material: 0 }],
            grounds: vec![ground],
            materials: vec![material, self.floor(stage.reach)?],
            lights: vec![stage.lamp()],
            sky: Some(Stage::sky()),
            background: true,
            diffuse_depth: DEPTH,
            glossy_depth: GLOSSY_DEPTH,
            limits: self.image.limits().clone(),
        })
    }

    /// The material of the floor.
    fn floor(&self, reach: f32) -> Result<Material, Failure> {
        let scale = SQUARES / reach.max(f32::MIN_POSITIVE);
        let body = alone("preview_floor", vec![("scale".to_string(), scale.to_string())])?;
        let services = Services { ray: self.image.provided.ray.clone(), ..Services::default() };
        let [first, second] = [(); 2].map(|()| self::program(&body, &"Ci".into(), None, self.image));
        let data = Data::default();
        Ok(Material {
            program: first,
            lean: second,
            services,
            color: None,
            stretch: None,
            through: None,
            data,
        })
    }
}

fn picture(
    image: &Image,
    light: &Light,
    world: &World,
    sources: &SourceMap,
    meters: &Meters,
) -> Result<Picture, Failure> {
    let error = image.sampling.max_error.as_ref().map(displayed).transpose();
    let max_error = error.map_err(|why| Failure::usage(format!("--max-error of a preview: {why}")))?;
    let usual = if max_error.is_some() { MOST } else { SAMPLES };
    let options = RenderOptions {
        samples: image.sampling.samples.unwrap_or(usual),
        max_error,
        clamp: (!light.raw).then_some(CLAMP),
        crop: image
            .points
            .crop
            .as_ref()
            .map(|crop| crop.with_border(if light.raw { 0 } else { render::REACH })),
        ..RenderOptions::default()
    };
    let meter = meters(1000, "");
    let result = render::render(world, &options, &|done| meter.at((done * 1000.0) as u64));
    let mut picture = result.map_err(|stop| setup::stopped(&stop, sources))?;
    if !light.raw {
        render::denoise(&mut picture);
    }
    if let Some(crop) = &image.points.crop {
        picture.crop(crop.columns.clone(), crop.rows.clone());
    }
    Ok(picture)
}
