//! `oslrun FILE --preview -o PICTURE`: a surface with the shader, on a floor, under a lamp and a sky.
//!
//! The surface is that of `--on`, or a sphere. A shader that yields a closure is shown as it is; from the
//! outputs of other shaders, the material `preview_material` makes a closure. The picture comes from the path
//! tracer of scenes. This module must not know how paths are followed or how files are written.

use super::args::RunArgs;
use super::args::bounds::displayed;
use super::args::heading;
use super::args::values::{Gained, STDOUT, gained};
use super::load::LoadedShader;
use super::picture::{Stored, ViewArgs};
use super::render::stats;
use super::roles::{Asked, Roles};
use super::shading::Report;
use super::streams::Streams;
use super::summary::About;
use super::surface::Job;
use super::{Failure, session};
use crate::nodes;
use clap::Args;
use osl::stages::{self, NoFiles};
use osl_exec::{PointSource, Program, Services};
use osl_files::Unsaved;
use osl_hir::hir;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_lower::Requests;
use osl_lower::group::{Group, Layer};
use osl_lower::params::{self, ParamValues};
use osl_scene::glam::{Vec2, Vec3};
use osl_scene::render::{self, Ground, Material, Object, Picture, RenderOptions, World};
use osl_scene::shape::Surface;
use osl_scene::stage::Stage;
use osl_scene::surface_points::SurfacePoints;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use std::io::Write;
use std::sync::Arc;
use std::time::Instant;

/// The options of a preview.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct PreviewArgs {
    /// Show the shader on a sphere with light, or on the surface of --on. A shader that writes Ci is shown as
    /// it is; of others, outputs give the base color, bumps, the normal, the roughness and the displacement.
    #[arg(long, group = "seen", requires = "output", conflicts_with_all = ["center", "closures", "steps", "profile", "outputs", "filter", "shading_rate", "adaptive", "within", "prefilter", "range", "signed", "userdata", "attributes", "time", "global", "frames", "histogram"], help_heading = heading::PREVIEW)]
    pub(super) preview: bool,
    /// Output for the base color (default: the first color).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    pub(super) base: Option<String>,
    /// Output for the height of bumps, and a factor on it (default: a float named bump, height, displacement
    /// or disp).
    #[arg(long, value_name = "OUTPUT[,GAIN]", requires = "preview", value_parser = gained, help_heading = heading::PREVIEW)]
    pub(super) bump: Option<Gained>,
    /// Output for the normal (default: the first normal).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    pub(super) normal: Option<String>,
    /// Output for the roughness of highlights, from 0 to 1 (default: a float whose name says so).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    pub(super) roughness: Option<String>,
    /// Leave the noise in, and do not limit the light of single paths.
    #[arg(long, requires = "preview", help_heading = heading::PREVIEW)]
    pub(super) raw: bool,
    /// The curve of the picture.
    #[command(flatten)]
    pub(super) view: ViewArgs,
}

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
/// Reflections from surface to surface.
const DEPTH: u32 = 1;

/// Renders a preview and writes it.
pub(super) fn run(
    (args, lit): (&RunArgs, &PreviewArgs),
    mut loaded: LoadedShader,
    started: Instant,
    about: Option<&mut About>,
    streams: &mut Streams<'_>,
) -> Result<(), Failure> {
    let Streams { out, err, picture: piped, kept, .. } = streams;
    if args.output.is_none() && kept.is_none() {
        return Err(Failure::new("a preview is a picture: name one with -o"));
    }
    let roles = roles(args, lit, &loaded)?;
    let body = if roles.closure { loaded.body.clone() } else { material(&mut loaded, &roles, args)? };
    let job = Job::new(args, &loaded, roles.displace.clone())?.with_edges(EDGE);
    let mut staged = Staged { args, job };
    let world = session::on_threads(args.threads, || staged.world(&body))??;
    let prepared = started.elapsed();
    let picture = session::on_threads(args.threads, || picture(args, lit, &world, &loaded.sources))??;
    let rendered = started.elapsed() - prepared;

    for note in &staged.job.notes {
        let _ = writeln!(err, "{}", shown(note));
    }
    let textures = session::services(args, loaded.folder.clone(), osl_exec::Spaces::default()).textures;
    let report = Report {
        sources: &loaded.sources,
        format: args.read.message_format,
        points: (staged.job.vertices as u64, "vertices"),
        width: None,
        textures: &textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    let mut shading = report.print(&staged.job.displaced, err);
    shading.add(
        Report { points: (0, "hits"), width: Some(args.grid.0), ..report }.print(&picture.messages, err),
    );
    for name in &picture.unknown {
        let _ = writeln!(err, "warning: closure `{}` is not rendered", shown(name));
    }
    shading.judge(args.lints.denies_errors())?;
    let _ = writeln!(err, "note: the preview shows {}", shown(&roles.words()));
    if picture.clamped > 0 {
        let share = 100.0 * picture.clamped as f64 / picture.samples.max(1) as f64;
        let share = if share < 0.1 { "less than 0.1 %".to_string() } else { format!("{share:.1} %") };
        let _ = writeln!(
            err,
            "note: {share} of the paths carried so much reflected light that it was reduced to {CLAMP}; --raw keeps it"
        );
    }
    if args.stats {
        stats(&picture, &world, [prepared, rendered], err);
    }
    let stored = Stored {
        curve: lit.view.view.unwrap_or_default(),
        exposure: args.display.stops(),
        half: args.half,
        compression: args.compression,
        part: args.part(),
        command: args.command.as_deref(),
    };
    if let Some(kept) = kept {
        kept.lit = stored.samples(&picture)?;
    }
    let Some(path) = &args.output else { return Ok(()) };
    let named = args.display.named(path)?;
    let is_piped = path.as_os_str() == STDOUT;
    let file: Unsaved = stored.file(&picture, &named, (!is_piped).then_some(path))?;
    let written = match is_piped {
        true => {
            let _ = piped.write_all(&file.into_bytes());
            Vec::new()
        }
        false => {
            file.save().map_err(Failure::new)?;
            vec![path.clone()]
        }
    };
    match about {
        Some(about) => about.wrote(&written, shading),
        None => shading.wrote(&written, out),
    }
    Ok(())
}

/// The roles of the outputs.
fn roles(args: &RunArgs, lit: &PreviewArgs, loaded: &LoadedShader) -> Result<Roles, Failure> {
    let asked = Asked {
        base: lit.base.as_deref(),
        bump: lit.bump.as_ref(),
        normal: lit.normal.as_deref(),
        roughness: lit.roughness.as_deref(),
        displace: args.on.displace.as_ref(),
    };
    Roles::of(&loaded.program, &loaded.body, asked)
}

/// A shader of previews, with its source.
fn own(name: &str) -> Result<(Arc<hir::Program>, SourceMap), Failure> {
    let text = nodes::preview(name).unwrap_or_default();
    let file = format!("{name}.osl (built in)");
    let checked = stages::check(&file, text, &NoFiles, &osl_syntax::Options::default());
    let program = checked.program.ok_or_else(|| Failure::new(format!("{file} cannot be read")))?;
    Ok((Arc::new(program), checked.sources))
}

/// The body of the shader, followed by a material that its outputs feed.
fn material(loaded: &mut LoadedShader, roles: &Roles, args: &RunArgs) -> Result<Body, Failure> {
    let limits = args.read.limits.limits();
    let mut group = loaded.group(limits);
    let last = group.layers().last().map(|layer| layer.name.to_string());
    let Some(last) = last else {
        return Err(Failure::new("the limit reading.layers leaves no room for the shader"));
    };
    let (program, sources) = own("preview_material")?;
    let base =
        loaded.sources.append(&sources).ok_or_else(|| Failure::new("the sources have more than 4 GiB"))?;
    let mut values = ParamValues::default();
    if let Some(bump) = &roles.bump {
        params::set(&program, &mut values, "height_scale", &bump.gain.to_string()).map_err(Failure::new)?;
    }
    // The user's layers may have any name.
    let name =
        (0..).map(|n| format!("preview_{n}")).find(|name| group.find(name).is_none()).unwrap_or_default();
    let layer = Layer { name: name.as_str().into(), program, values, base };
    group.add(layer).map_err(|_| Failure::new("the limit reading.layers leaves no room for the preview"))?;
    let links = [
        (roles.base.as_deref(), "base"),
        (roles.bump.as_ref().map(|bump| bump.name.as_str()), "height"),
        (roles.normal.as_deref(), "shading_normal"),
        (roles.roughness.as_deref(), "roughness"),
    ];
    for (from, to) in links {
        if let Some(from) = from {
            group.connect((&last, from), (&name, to)).map_err(Failure::new)?;
        }
    }
    lowered(&group, args)
}

fn lowered(group: &Group, args: &RunArgs) -> Result<Body, Failure> {
    let requests = Requests { limits: args.read.limits.limits().clone(), ..Requests::default() };
    osl_lower::lower_group_for(group, &requests).map_err(|list| {
        let why = list.first().map_or_else(String::new, |d| d.message.clone());
        Failure::new(format!("the shader cannot be compiled together with the preview's material: {why}"))
    })
}

/// The program that computes the closure of a body.
fn program(body: &Body, args: &RunArgs) -> Program {
    let points = SurfacePoints::default();
    let options = passes::Options {
        outputs: Some(vec!["Ci".into()]),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        without: args.without_pass.clone(),
        arithmetic: args.arithmetic.unwrap_or_default(),
        limits: args.read.limits.limits().clone(),
        ..passes::Options::default()
    };
    stages::finish(body.clone(), &options).program
}

/// The surface on its stage.
struct Staged<'a> {
    args: &'a RunArgs,
    job: Job<'a>,
}

impl Staged<'_> {
    fn world(&mut self, body: &Body) -> Result<World, Failure> {
        let resolution: [usize; 2] = self.args.grid.into();
        let most = self.args.read.limits.limits().scenes.pixels;
        if (resolution[0] as u64).saturating_mul(resolution[1] as u64) > most {
            let [width, height] = resolution;
            let text = format!("{width} x {height} pixels are more than {most} (--limit scenes.pixels=N)");
            return Err(Failure::new(text));
        }
        let displacement = self.job.displacement()?;
        let (bounds, reach) = self.job.whole()?;
        let mut stage = Stage { bounds, reach };
        let mut view = stage.camera(self.args.on.eye, resolution).view().map_err(Failure::new)?;
        let services = self.job.services(&view, reach);
        let surface = self.job.surface(displacement.as_ref(), &view, &services)?;
        if displacement.is_some() {
            stage = Stage { bounds: surface.bounds(), reach: surface.reach() };
            view = stage.camera(self.args.on.eye, resolution).view().map_err(Failure::new)?;
        }
        let stretch = [Vec2::from(self.args.uv_scale.0), Vec2::from(self.args.uv_offset.0)];
        let material = Material {
            program: program(body, self.args),
            lean: program(body, self.args),
            services: self.job.services(&view, stage.reach),
            color: None,
            stretch: (stretch != [Vec2::ONE, Vec2::ZERO]).then_some(stretch),
        };
        let ground = Ground { point: stage.floor(), normal: Vec3::Y, material: 1 };
        Ok(World {
            view,
            objects: vec![Object { body: surface, material: 0 }],
            grounds: vec![ground],
            materials: vec![material, self.floor(stage.reach)?],
            lights: vec![stage.lamp()],
            sky: Some(Stage::sky()),
            background: true,
            diffuse_depth: DEPTH,
            glossy_depth: DEPTH,
            limits: self.args.read.limits.limits().clone(),
        })
    }

    /// The material of the floor.
    fn floor(&self, reach: f32) -> Result<Material, Failure> {
        let (program, _) = own("preview_floor")?;
        let scale = SQUARES / reach.max(f32::MIN_POSITIVE);
        let value = vec![("scale".to_string(), scale.to_string())];
        let body = stages::lower_for(&program, &value, &Requests::default());
        let body = body.map_err(|_| Failure::new("the floor of the preview cannot be compiled"))?;
        let services = Services { ray: self.args.raytype.clone(), ..Services::default() };
        let [first, second] = [(); 2].map(|()| self::program(&body, self.args));
        Ok(Material { program: first, lean: second, services, color: None, stretch: None })
    }
}

fn picture(
    args: &RunArgs,
    lit: &PreviewArgs,
    world: &World,
    sources: &SourceMap,
) -> Result<Picture, Failure> {
    let error = args.sampling.max_error.as_ref().map(displayed).transpose();
    let max_error = error.map_err(|why| Failure::usage(format!("--max-error of a preview: {why}")))?;
    let usual = if max_error.is_some() { MOST } else { SAMPLES };
    let options = RenderOptions {
        samples: args.sampling.samples.unwrap_or(usual),
        max_error,
        clamp: (!lit.raw).then_some(CLAMP),
        crop: args.crop.as_ref().map(|crop| crop.with_border(if lit.raw { 0 } else { render::REACH })),
        ..RenderOptions::default()
    };
    let bar = session::progress(1000, "");
    let result = render::render(world, &options, &|done| bar.at((done * 1000.0) as u64));
    bar.done();
    let mut picture = result.map_err(|stop| session::stopped(&stop, sources))?;
    if !lit.raw {
        render::denoise(&mut picture);
    }
    if let Some(crop) = &args.crop {
        picture.crop(crop.columns.clone(), crop.rows.clone());
    }
    Ok(picture)
}
