//! `oslrun render SCENE.ass -o OUT`: renders a picture of a scene.

use super::args::RenderArgs;
use super::load::Folders;
use super::shading::{Report, Tally};
use super::{Failure, input, report};
use crate::pipeline::{self, ShaderFiles};
use indicatif::{ProgressBar, ProgressStyle};
use osl_exec::Services;
use osl_files::{FileError, Roots};
use osl_image::{BitDepth, ExrOptions, Layer, LayerKind, PngOptions, SampleType, TextureCache, Transfer};
use osl_ir::group::text::Shaders;
use osl_ir::hir;
use osl_ir::types::Type;
use osl_limits::Limits;
use osl_scene::render::{self, Picture, RenderOptions, World};
use osl_scene::scene::{self, Messages, Networks, SceneFiles, Surroundings};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::escape::shown;
use osl_syntax::source::SourceMap;
use std::collections::HashMap;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Renders a scene.
pub(super) fn render(args: &RenderArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let started = Instant::now();
    let png = match args.output.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("png") => true,
        Some("exr") => false,
        _ => {
            let text = format!("cannot write {}: the name must end in .exr or .png", args.output.display());
            return Err(Failure::new(text));
        }
    };
    let mut library = Library::new(args);
    let (world, samples) = world(args, &mut library, err)?;
    let prepared = started.elapsed();
    let picture = picture(args, &world, samples, &library.sources)?;
    let rendered = started.elapsed() - prepared;
    let shading = said(&picture, &library.sources, args, err);
    shading.judge(args.deny.is_some())?;
    if png {
        write_png(&picture, args)?
    } else {
        write_exr(&picture, args)?
    }
    if args.stats {
        stats(&picture, &world, [prepared, rendered], err);
    }
    shading.wrote(std::slice::from_ref(&args.output), out);
    Ok(())
}

/// Reads a scene and builds its world; returns the world and the number of samples.
fn world(args: &RenderArgs, library: &mut Library<'_>, err: &mut dyn Write) -> Result<(World, u32), Failure> {
    let text = input::read_text(&args.file, args.read.limits.limits())
        .map_err(|e| Failure::new(format!("cannot read {}: {e}", args.file.display())))?;
    let files = Includes::new(args);
    let mut messages = Messages::within(args.read.limits.limits());
    let name = args.file.display().to_string();
    let description = scene::read(&name, &text, &files, &mut messages);
    // All materials share the texture cache.
    let textures = textures(args);
    let services =
        || Services { ray: "camera".to_string(), textures: textures.clone(), ..Services::default() };
    let around = Surroundings { size: args.size.map(|(w, h)| [w, h]), services: &services };
    let world = (!messages.failed()).then(|| {
        let mut networks = Networks::new(&description, library, &mut messages);
        scene::build(&description, &mut networks, &around, &mut messages)
    });
    // Errors in a shader are reported; the scene is rendered without that shader.
    let _ = report::diagnostics(&library.diagnostics, &library.sources, &args.read, err);
    for message in messages.list() {
        let _ = writeln!(err, "{}", shown(&message.to_string()));
    }
    let world = world.flatten().ok_or_else(Failure::said)?;
    Ok((world, description.settings.samples))
}

/// The textures of a scene: in its folder, or in a search path.
fn textures(args: &RenderArgs) -> TextureCache {
    let mut folders = vec![args.file.parent().map(Path::to_path_buf).unwrap_or_default()];
    folders.extend(args.search_path.iter().cloned());
    TextureCache::within(folders, args.read.limits.limits()).allow_files(args.allow_files)
}

fn picture(args: &RenderArgs, world: &World, samples: u32, sources: &SourceMap) -> Result<Picture, Failure> {
    let options = RenderOptions {
        samples: args.samples.unwrap_or(samples),
        max_error: args.max_error,
        seed: args.seed,
        ..RenderOptions::default()
    };
    let bar = progress();
    let tick = |done: f32| bar.set_position((done * 1000.0) as u64);
    let work = || render::render(world, &options, &tick);
    let result = match args.threads {
        Some(threads) => rayon::ThreadPoolBuilder::new()
            .num_threads(usize::from(threads))
            .build()
            .map_err(|e| Failure::new(format!("cannot start {threads} threads: {e}")))?
            .install(work),
        None => work(),
    };
    bar.finish_and_clear();
    result.map_err(|stop| super::run::stopped(&stop, sources))
}

/// A progress bar on a terminal; nothing in logs.
fn progress() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3}% {elapsed} {eta}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Prints the messages of shaders.
fn said(picture: &Picture, sources: &SourceMap, args: &RenderArgs, err: &mut dyn Write) -> Tally {
    let report = Report {
        sources,
        format: args.read.message_format,
        points: (0, "hits"),
        width: Some(picture.width),
        textures: &textures(args),
        path_option: "--search-path",
        texts: &[],
    };
    let tally = report.print(&picture.messages, err);
    for name in &picture.unknown {
        let _ = writeln!(err, "warning: closure `{}` is not rendered", shown(name));
    }
    tally
}

fn kind(ty: Type) -> LayerKind {
    match ty {
        Type::COLOR => LayerKind::Color,
        Type::MATRIX => LayerKind::Matrix,
        ty if ty.is_triple() => LayerKind::Triple,
        _ => LayerKind::Scalar,
    }
}

fn write_exr(picture: &Picture, args: &RenderArgs) -> Result<(), Failure> {
    let layers: Vec<Layer<'_>> = picture
        .layers
        .iter()
        .map(|layer| Layer {
            name: &layer.name,
            kind: kind(layer.ty),
            planes: layer.planes.iter().map(Vec::as_slice).collect(),
        })
        .collect();
    let samples = if args.half { SampleType::Half } else { SampleType::Float };
    let options = ExrOptions { samples, ..ExrOptions::default() };
    osl_image::write_exr(&args.output, picture.width, picture.height, &layers, options).map_err(Failure::new)
}

fn write_png(picture: &Picture, args: &RenderArgs) -> Result<(), Failure> {
    let Some(light) = picture.layers.first() else { return Ok(()) };
    let toned: Vec<Vec<f32>> =
        light.planes.iter().map(|plane| plane.iter().map(|x| render::tone(*x)).collect()).collect();
    let planes: Vec<&[f32]> = toned.iter().map(Vec::as_slice).collect();
    let options = PngOptions { transfer: Transfer::Srgb, depth: BitDepth::Eight };
    osl_image::write_png(&args.output, picture.width, picture.height, &planes, options).map_err(Failure::new)
}

fn stats(picture: &Picture, world: &World, [prepared, rendered]: [Duration; 2], err: &mut dyn Write) {
    let seconds = rendered.as_secs_f64().max(1e-9);
    let triangles: usize = world.objects.iter().map(|o| o.body.triangles()).sum();
    let pixels = (picture.width * picture.height).max(1);
    let error = picture.layers.iter().find(|l| &*l.name == "error").and_then(|l| l.planes.first());
    let mean = error.map_or(0.0, |plane| plane.iter().map(|x| f64::from(*x)).sum::<f64>() / pixels as f64);
    let _ = writeln!(
        err,
        "prepare {:.0} ms ({triangles} triangles), render {:.0} ms",
        prepared.as_secs_f64() * 1e3,
        seconds * 1e3
    );
    let _ = writeln!(
        err,
        "{} paths ({:.1} a pixel), {} rays, {:.0} rays/s, mean error {mean:.4}",
        picture.samples,
        picture.samples as f64 / pixels as f64,
        picture.rays,
        picture.rays as f64 / seconds
    );
}

/// Finds included scenes: in the folder of the including scene, or in a search path.
struct Includes<'a> {
    folders: &'a [PathBuf],
    roots: Roots,
    limits: &'a Limits,
}

impl<'a> Includes<'a> {
    fn new(args: &'a RenderArgs) -> Includes<'a> {
        let main = args.file.parent().unwrap_or(Path::new(""));
        let folders = args.search_path.iter().map(PathBuf::as_path);
        let roots = Roots::new([main, Path::new("")].into_iter().chain(folders));
        let roots = roots.or_anywhere(args.allow_files);
        Includes { folders: &args.search_path, roots, limits: args.read.limits.limits() }
    }
}

impl SceneFiles for Includes<'_> {
    fn include(&self, name: &str, from: &str) -> Result<(String, String), String> {
        let beside = Path::new(from).parent().map(Path::to_path_buf).unwrap_or_default();
        let folders = std::iter::once(beside).chain(self.folders.iter().cloned());
        let found =
            self.roots.first(folders.map(|folder| folder.join(name))).map_err(|error| match error {
                FileError::Outside => {
                    "it lies outside of the search paths; --allow-files lets it".to_string()
                }
                error => error.to_string(),
            })?;
        let name = found.path().display().to_string();
        Ok((name, found.text(self.limits.reading.file_bytes).map_err(|error| error.to_string())?))
    }
}

/// The shaders of a scene: each file is read once, and has a part of the source map for each layer.
struct Library<'a> {
    files: Folders<'a>,
    options: osl_syntax::Options,
    sources: SourceMap,
    known: HashMap<String, Result<Known, String>>,
    diagnostics: Vec<Diagnostic>,
}

struct Known {
    program: Arc<hir::Program>,
    sources: SourceMap,
}

impl<'a> Library<'a> {
    fn new(args: &'a RenderArgs) -> Library<'a> {
        let folder = args.file.parent().map(Path::to_path_buf).unwrap_or_default();
        Library {
            files: Folders::of(&folder, &args.search_path, args.allow_files, args.repair, &args.read),
            options: input::options(&args.read),
            sources: SourceMap::default(),
            known: HashMap::new(),
            diagnostics: Vec::new(),
        }
    }

    fn read(&mut self, name: &str) -> Result<Known, String> {
        let (file, text) = self.files.find(name)?;
        let checked = pipeline::check(&file, &text, self.files.includes(), &self.options);
        let base = self.sources.append(&checked.sources).ok_or("the sources have more than 4 GiB")?;
        self.diagnostics.extend(checked.diagnostics.into_iter().map(|d| pipeline::moved(d, base)));
        let program = checked.program.ok_or_else(|| format!("{file} has errors"))?;
        Ok(Known { program: Arc::new(program), sources: checked.sources })
    }
}

impl Shaders for Library<'_> {
    fn load(&mut self, name: &str) -> Result<(Arc<hir::Program>, u32), String> {
        if !self.known.contains_key(name) {
            let known = self.read(name);
            self.known.insert(name.to_string(), known);
        }
        match self.known.get(name) {
            Some(Ok(known)) => {
                let base = self.sources.append(&known.sources).ok_or("the sources have more than 4 GiB")?;
                Ok((known.program.clone(), base))
            }
            Some(Err(why)) => Err(why.clone()),
            None => Err(String::new()),
        }
    }
}
