//! `oslrun bake FILE -o OUT`: writes the outputs of a shader as textures, one for each square of texture
//! space.
//!
//! A texture is an EXR file in tiles, with all coarser levels. It holds a recipe: the values that decide its
//! pixels, as a hash. A square whose file has the recipe of this command is not computed again, so a bake
//! that was stopped goes on, on any machine.

use super::numbers::{self, Numbers};
use super::openjd::{self, JobArgs};
use crate::cli::options::heading;
use crate::cli::options::points::{DataArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::RunningArgs;
use crate::cli::options::samples::SampleArgs;
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs};
use crate::cli::print::Console;
use clap::Args;
use osl_exec::Plane;
use osl_image::{
    ExrCompression, ExrOptions, Layer, LayerKind, SampleType, TILE_SIDES, exr_command, exr_texture,
};
use osl_ir::ir::Kind;
use osl_ir::types::Base;
use osl_job::file::output::{EMPTY, OUTPUT, groups};
use osl_job::file::software::SOFTWARE;
use osl_job::picture::{self, Extras};
use osl_job::report::ranges::layer_kind;
use osl_job::request::values::{self, compression};
use osl_job::request::{Lints, Points, Wanted};
use osl_job::source::load::{self, Request};
use osl_job::{Failure, Image, Sink};
use serde::Serialize;
use std::ffi::OsString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

/// What to bake.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct BakeArgs {
    /// Textures to write (.exr). `<UDIM>` in the name stands for the number of the square, `{output}` for the
    /// output, which then has a file of its own. A file with one output has the channels R, G and B, or Y;
    /// with several, their names come before.
    #[arg(short, long, value_name = "FILE.exr", value_parser = texture, help_heading = heading::PICTURE)]
    output: String,
    /// The squares of texture space: 1001 is the first, 1011 the one above it; a list, 1001-1004,1011. In
    /// square 1012, u is between 1 and 2, and v too.
    #[arg(long, value_name = "LIST", default_value = "1001", value_parser = squares, help_heading = heading::POINTS)]
    udim: Numbers,
    /// Texels of each texture.
    #[arg(short, long, value_name = "WxH", default_value = "1024x1024", value_parser = values::grid, help_heading = heading::POINTS)]
    grid: (usize, usize),
    /// Texels on each side of the file's tiles.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = tile, help_heading = heading::PICTURE)]
    tile: usize,
    /// The first row of each texture is at the upper end of v, as modelling programs have it. Without this
    /// option it is at the lower end, where `texture(name, u, v)` of a shader reads it.
    #[arg(long, help_heading = heading::PICTURE)]
    flip_v: bool,
    /// Write 16-bit floats.
    #[arg(long, help_heading = heading::PICTURE)]
    half: bool,
    /// Compression: none, rle, zip1, zip16, piz, pxr24.
    #[arg(long, value_name = "NAME", default_value = "zip16", value_parser = compression, help_heading = heading::PICTURE)]
    compression: ExrCompression,
    /// Compute nothing: print the textures as a list of JSON objects, with what there is of them.
    #[arg(long, conflicts_with = "openjd")]
    dry_run: bool,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    samples: SampleArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    running: RunningArgs,
    #[command(flatten)]
    job: JobArgs,
    #[command(flatten)]
    format: FormatArgs,
}

fn texture(name: &str) -> Result<String, String> {
    let is_exr = name.to_ascii_lowercase().ends_with(".exr");
    is_exr.then(|| name.to_string()).ok_or_else(|| format!("textures are .exr files, not `{name}`"))
}

fn tile(text: &str) -> Result<usize, String> {
    let side = text.parse().ok().filter(|side| TILE_SIDES.contains(side));
    side.ok_or_else(|| format!("a number from {} to {}", TILE_SIDES.start(), TILE_SIDES.end()))
}

/// The numbers of squares.
const SQUARES: std::ops::RangeInclusive<u32> = 1001..=9999;

fn squares(text: &str) -> Result<Numbers, String> {
    let list = numbers::list(text, ("square", "1001-1040"))?;
    let (first, last) = list.ends();
    match SQUARES.contains(&first) && SQUARES.contains(&last) {
        true => Ok(list),
        false => Err(format!("squares have numbers from {} to {}", SQUARES.start(), SQUARES.end())),
    }
}

/// What there is of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum State {
    /// All its files have the recipe of this command.
    Done,
    /// A file is missing.
    Missing,
    /// A file has another recipe.
    Stale,
}

/// A texture of the list.
#[derive(Serialize)]
struct Texture {
    udim: u32,
    files: Vec<PathBuf>,
    state: State,
}

/// Bakes the textures.
pub(in crate::cli) fn bake(
    args: &BakeArgs,
    line: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    if args.udim.ends().0 != args.udim.ends().1 && !args.output.contains("<UDIM>") {
        return Err(Failure::usage("several squares need a place for their number: -o set.<UDIM>.exr"));
    }
    if let Some(file) = args.job.file() {
        let task = openjd::Task { option: "--udim", name: "Square", numbers: &args.udim };
        return openjd::write(file, &task, &args.job, line, console);
    }
    let mut image = args.image();
    let loaded = load::load(&Request::of(&image), console)?;
    // The warnings are said once, not for each square.
    image.shader.lints = Lints { allow: vec!["all".to_string()], ..image.shader.lints };
    let outputs = loaded.outputs(&image);
    let is_wanted =
        |name: &str| outputs.as_ref().is_none_or(|list| list.iter().any(|wanted| **wanted == *name));
    let has_pixels = |base: Base| !matches!(base, Base::String | Base::Closure);
    let all = loaded.body.outputs.iter().filter(|o| is_wanted(&o.name) && has_pixels(o.ty.base));
    let names: Vec<String> = all.map(|output| output.name.to_string()).collect();
    if names.is_empty() {
        return Err(Failure::new(EMPTY));
    }
    let recipe = args.recipe(&image, &osl_ir::ir::print(&loaded.body));
    drop(loaded);
    let list = args.udim.iter().map(|udim| args.texture(udim, &names, &recipe)).collect::<Vec<_>>();
    if args.dry_run {
        return console.object(&list);
    }
    let meter = console.meters()(list.len() as u64, "");
    let done = list.iter().filter(|texture| texture.state == State::Done).count();
    if done > 0 {
        console.note(&format!("{done} of {} textures are there already", list.len()));
    }
    for (at, texture) in list.iter().enumerate() {
        meter.at(at as u64);
        match texture.state {
            State::Done => continue,
            State::Stale => {
                let name = texture.files.first().map(|file| file.display().to_string()).unwrap_or_default();
                console.note(&format!("{name} was made by another command, and is made again"));
            }
            State::Missing => {}
        }
        for file in args.one(&image, texture.udim, &recipe, console)? {
            console.wrote(&file);
        }
        console.settle()?;
    }
    Ok(())
}

impl BakeArgs {
    fn image(&self) -> Image {
        let mut shader = self.shader.shader(Some(&self.network));
        shader.outputs = self.outputs.names();
        Image {
            shader,
            points: Points { grid: self.grid, center: true, ..Points::default() },
            provided: self.scene.provided(Some(&self.data)),
            sampling: self.samples.sampling(None),
            running: self.running.running(),
            wanted: Wanted { values: true, ..Wanted::default() },
            ..Image::default()
        }
    }

    /// What decides the texels of every square. `program` is the lowered shader with its parameters. What
    /// textures and files of attributes hold is not in it.
    fn recipe(&self, image: &Image, program: &str) -> String {
        let mut hash = DefaultHasher::new();
        let Image { shader, points, provided, sampling, running, .. } = image;
        let own = (self.tile, self.flip_v, self.half, self.compression, &self.outputs);
        let about = format!("{own:?} {:?} {points:?} {provided:?} {sampling:?}", shader.network);
        (program, about, format!("{:?}", running.without_pass), SOFTWARE).hash(&mut hash);
        format!("oslrun bake, recipe {:016x}", hash.finish())
    }

    /// The files of a square: one, or one for each output.
    fn files(&self, udim: u32, names: &[String]) -> Vec<PathBuf> {
        let name = self.output.replace("<UDIM>", &udim.to_string());
        match name.contains(OUTPUT) {
            true => names.iter().map(|output| name.replace(OUTPUT, output).into()).collect(),
            false => vec![name.into()],
        }
    }

    fn texture(&self, udim: u32, names: &[String], recipe: &str) -> Texture {
        let files = self.files(udim, names);
        let found: Vec<_> = files.iter().map(|file| exr_command(file)).collect();
        let state = match () {
            () if found.iter().flatten().any(|found| found != recipe) => State::Stale,
            () if found.iter().any(Option::is_none) => State::Missing,
            () => State::Done,
        };
        Texture { udim, files, state }
    }

    /// Computes a square and writes its files.
    fn one(
        &self,
        image: &Image,
        udim: u32,
        recipe: &str,
        console: &mut Console<'_>,
    ) -> Result<Vec<PathBuf>, Failure> {
        let mut image = image.clone();
        let square = udim - SQUARES.start();
        let (u, v) = ((square % 10) as f32, (square / 10) as f32);
        image.points.uv_offset = if self.flip_v { [u, v + 1.0] } else { [u, v] };
        image.points.uv_scale = if self.flip_v { [1.0, -1.0] } else { [1.0, 1.0] };
        let done = picture::run(&image, Extras::default(), console)?;
        if let Some(samples) = &done.samples {
            samples.send(console);
        }
        if done.misses() {
            return Err(Failure::missed());
        }
        let planes = done.frame.planes.iter().filter(|p| !matches!(p.kind, Kind::Str | Kind::Closure));
        let planes: Vec<&Plane> = planes.collect();
        let groups = groups(&planes);
        let names: Vec<String> = groups.iter().map(|group| group.first.output.to_string()).collect();
        let layer = |at: usize, name| {
            let group = groups.get(at)?;
            let kind = layer_kind(group.first);
            let name = if matches!(kind, LayerKind::Scalar) && str::is_empty(name) { "Y" } else { name };
            Some(Layer { name, kind, planes: group.values.iter().map(AsRef::as_ref).collect() })
        };
        let paths = self.files(udim, &names);
        let options = ExrOptions {
            samples: if self.half { SampleType::Half } else { SampleType::Float },
            compression: self.compression,
            part: None,
            software: Some(SOFTWARE),
            command: Some(recipe),
        };
        let mut files = Vec::new();
        for (at, path) in paths.iter().enumerate() {
            let layers: Vec<Layer<'_>> = match (paths.len(), names.len()) {
                (1, 2..) => names.iter().enumerate().filter_map(|(at, name)| layer(at, name)).collect(),
                _ => layer(at, "").into_iter().collect(),
            };
            osl_files::permit_rewrite(path);
            let file = exr_texture(path, self.grid, &layers, self.tile, options, image.limits());
            files.push(file.map_err(Failure::new)?);
        }
        osl_files::save_all(files).map_err(Failure::new)?;
        Ok(paths)
    }
}
