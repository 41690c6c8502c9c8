//! `oslrun render SCENE.ass -o OUT`: renders a picture of a scene.

use super::words;
use crate::cli::options::heading;
use crate::cli::options::picture::ViewArgs;
use crate::cli::options::reading::{FormatArgs, ReadArgs};
use crate::cli::print::Console;
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use osl_files::Unsaved;
use osl_image::TextureCache;
use osl_job::file::light::Stored;
use osl_job::picture::camera::CameraShader;
use osl_job::picture::setup::{on_threads, stopped};
use osl_job::picture::{self, render_stats};
use osl_job::report::messages::{Report, Tally};
use osl_job::report::rays;
use osl_job::request::bounds::displayed_error;
use osl_job::request::values::{Crop, STDOUT, assignment, crop, grid, picture_file, stops};
use osl_job::source::load;
use osl_job::source::scene::{self, LoadedScene, Scene};
use osl_job::{Failure, Image, Sink};
use osl_scene::render::{self, Picture, RenderOptions};
use osl_syntax::source::SourceMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to render.
#[derive(Debug, Args)]
pub(in crate::cli) struct RenderArgs {
    /// The scene.
    #[arg(value_name = "SCENE.ass")]
    file: PathBuf,
    /// Image to write: .exr holds the light and all layers, .png the light as displayed on a screen; - is the
    /// standard output.
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(picture_file))]
    output: PathBuf,
    /// Format of the picture with `-o -`.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Pixels of the picture (default: the size in the scene).
    #[arg(short, long, visible_alias = "size", value_name = "WxH", value_parser = grid)]
    grid: Option<(usize, usize)>,
    /// Render only these columns and rows, from X0 up to but not including X1, and Y0 up to Y1. The pixels
    /// have the values that they have in the whole picture. An EXR file says where in the whole picture they
    /// are.
    #[arg(long, value_name = "X0,X1,Y0,Y1", value_parser = crop, allow_hyphen_values = true)]
    crop: Option<Crop>,
    /// Value of a parameter of a shader node, in place of the one in the scene; may be repeated: mat.Bands=4.
    #[arg(short, long = "param", value_name = "NODE.NAME=VALUE", value_parser = assignment)]
    params: Vec<(String, String)>,
    /// Shader of the camera: it computes the rays, at the place of the scene's camera.
    #[arg(long, value_name = "FILE.osl")]
    camera: Option<PathBuf>,
    /// Value of a parameter of the camera's shader; may be repeated: radius=0.1.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment, requires = "camera")]
    camera_param: Vec<(String, String)>,
    /// JSON file of attributes for the camera's shader: {"cam:focal_distance": 4.5}.
    #[arg(long, value_name = "FILE", requires = "camera")]
    attributes: Option<PathBuf>,
    /// Draw the rays of the camera's shader, from above and from the right, as an SVG image.
    #[arg(long, value_name = "FILE", requires = "camera")]
    rays: Option<PathBuf>,
    /// Paths per pixel (default: the number in the scene).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    samples: Option<u32>,
    /// Stop when the standard error of a pixel, as displayed (0 to 1), is at most this: 0.02, or 2%.
    #[arg(long, value_name = "E", value_parser = displayed_error, allow_hyphen_values = true)]
    max_error: Option<f32>,
    /// Seed of the random numbers; another seed gives different noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Threads (default: all cores); the picture does not depend on them.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder to search for shaders, textures and included scenes, after the scene's own folder; may be
    /// repeated.
    #[arg(long, visible_aliases = ["shader-path", "texture-path"], value_name = "DIR")]
    search_path: Vec<PathBuf>,
    /// Let the scene and its shaders open any file, not only those below the working directory and the search
    /// paths.
    #[arg(long)]
    allow_files: bool,
    /// Insert missing brackets into shaders.
    #[arg(long)]
    repair: bool,
    /// Remove noise by a filter that the layers of the picture guide.
    #[arg(long)]
    denoise: bool,
    /// Multiply the light of a PNG by two to this power: 1 is twice as bright.
    #[arg(long, value_name = "STOPS", value_parser = stops, allow_hyphen_values = true, help_heading = heading::PREVIEW)]
    exposure: Option<f32>,
    #[command(flatten)]
    view: ViewArgs,
    /// Write 16-bit floats (EXR).
    #[arg(long)]
    half: bool,
    /// Do not write the command line into EXR files.
    #[arg(long)]
    no_command: bool,
    /// Print times, rays per second, and the mean error.
    #[arg(long)]
    stats: bool,
    /// With `errors`: fail the run, and write no image, if a shader reports an error while it runs.
    #[arg(long, value_name = "errors", value_parser = ["errors"])]
    deny: Option<String>,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format_args: FormatArgs,
}

/// Formats of a picture on the standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Format {
    /// The light as displayed on a screen.
    #[default]
    Png,
    /// The light and all layers.
    Exr,
}

/// Renders a scene.
pub(in crate::cli) fn render(
    args: &RenderArgs,
    line: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let command = words::text(line, Some(&args.file));
    let reading = args.read.reading();
    let started = Instant::now();
    let ending = args.file.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if matches!(ending.as_str(), "osl" | "oso" | "oslgroup" | "group") {
        return Err(Failure::new(format!(
            "{0} is a shader, not a scene: `oslrun {0} -o FILE` shades a square of it, `--on sphere` a sphere, `--preview` a sphere with light; a \
             scene (.ass) names the shaders of its materials",
            args.file.display()
        )));
    }
    let wanted = Scene {
        file: &args.file,
        search_path: &args.search_path,
        allow_files: args.allow_files,
        repair: args.repair,
        params: &args.params,
        size: args.grid,
        read: &reading,
    };
    let mut loaded = scene::load(&wanted, console)?;
    let camera = args.camera.as_deref().map(|file| camera(args, file, &mut loaded, console)).transpose()?;
    let world = &loaded.world;
    let prepared = started.elapsed();
    let [width, height] = world.view.resolution();
    if let Some(crop) = &args.crop {
        crop.check((width, height)).map_err(Failure::usage)?;
    }
    let mut picture = picture(args, &loaded, console)?;
    if args.denoise {
        on_threads(args.threads, || render::denoise(&mut picture))?;
    }
    if let Some(crop) = &args.crop {
        picture.crop(crop.columns.clone(), crop.rows.clone());
    }
    let rendered = started.elapsed() - prepared;
    let mut shading = said(&picture, &loaded, console);
    if let Some(camera) = &camera {
        shading.add(camera.said(&picture, width, console));
    }
    shading.judge(args.deny.is_some())?;
    let piped = args.output.as_os_str() == STDOUT;
    let named = match (piped, args.format) {
        (true, Format::Exr) => Path::new("picture.exr"),
        (true, Format::Png) => Path::new("picture.png"),
        (false, _) => &args.output,
    };
    let stored = Stored {
        curve: args.view.curve().unwrap_or_default(),
        exposure: args.exposure.unwrap_or(0.0),
        half: args.half,
        part: args.crop.as_ref().and_then(|crop| crop.part((width, height))),
        command: command.as_deref(),
        ..Stored::default()
    };
    let file = stored.file(&picture, named, (!piped).then_some(&*args.output))?;
    if args.stats {
        console.text(&render_stats(&picture, world, [prepared, rendered]));
    }
    let mut files: Vec<Unsaved> = camera.into_iter().filter_map(|camera| camera.drawing).collect();
    let mut written: Vec<PathBuf> = args.rays.iter().cloned().collect();
    if piped {
        osl_files::save_all(files).map_err(Failure::new)?;
        let _ = console.out.write_all(&file.into_bytes());
        let mut told = Vec::new();
        shading.wrote(&written, &mut told);
        console.again(&told);
        return Ok(());
    }
    files.insert(0, file);
    written.insert(0, args.output.clone());
    osl_files::save_all(files).map_err(Failure::new)?;
    shading.wrote(&written, console.out);
    Ok(())
}

/// The files of a camera's shader, and the drawing of its rays.
struct CameraFiles {
    sources: SourceMap,
    textures: TextureCache,
    drawing: Option<Unsaved>,
}

impl CameraFiles {
    /// Prints the messages of the camera.
    fn said(&self, picture: &Picture, width: usize, sink: &mut dyn Sink) -> Tally {
        let CameraFiles { sources, textures, .. } = self;
        let (points, width) = ((picture.samples, "rays"), Some(width));
        let report = Report { sources, points, width, textures, path_option: "--search-path", texts: &[] };
        report.send(&picture.camera, sink)
    }
}

/// Gives a world the camera of a shader.
fn camera(
    args: &RenderArgs,
    file: &Path,
    scene: &mut LoadedScene,
    sink: &mut dyn Sink,
) -> Result<CameraFiles, Failure> {
    let mut image = Image::default();
    image.shader.file = Some(file.to_path_buf());
    image.shader.params.clone_from(&args.camera_param);
    image.shader.repair = args.repair;
    image.shader.allow_files = args.allow_files;
    image.shader.read = args.read.reading();
    image.shader.network.shader_path.clone_from(&args.search_path);
    image.provided.texture_path.clone_from(&args.search_path);
    image.provided.attributes.clone_from(&args.attributes);
    let mut loaded = load::load(&load::Request::of(&image), sink)?;
    let lens = CameraShader::of(&image, &mut loaded, sink)?.lens(&image, &scene.world.view);
    let drawing = args.rays.as_deref().map(|path| rays::file(&scene.world.view, &lens, &loaded.name, path));
    let textures = lens.services.textures.clone();
    scene.world.lens = Some(lens);
    Ok(CameraFiles { sources: loaded.sources, textures, drawing: drawing.transpose()? })
}

fn picture(args: &RenderArgs, loaded: &LoadedScene, sink: &dyn Sink) -> Result<Picture, Failure> {
    let options = RenderOptions {
        samples: args.samples.unwrap_or(loaded.samples),
        max_error: args.max_error,
        seed: args.seed,
        crop: args.crop.as_ref().map(|crop| crop.with_border(if args.denoise { render::REACH } else { 0 })),
        ..RenderOptions::default()
    };
    let meter = sink.meters()(1000, "");
    let tick = |done: f32| meter.at((done * 1000.0) as u64);
    let work = || render::render(&loaded.world, &options, &tick);
    let result = on_threads(args.threads, work)?;
    result.map_err(|stop| stopped(&stop, &loaded.sources))
}

/// Prints the messages of shaders.
fn said(rendered: &Picture, loaded: &LoadedScene, sink: &mut dyn Sink) -> Tally {
    let report = Report {
        sources: &loaded.sources,
        points: (0, "hits"),
        width: Some(rendered.width),
        textures: &loaded.textures,
        path_option: "--search-path",
        texts: &[],
    };
    let tally = report.send(&rendered.messages, sink);
    picture::note_unknown(&rendered.unknown, sink);
    tally
}
