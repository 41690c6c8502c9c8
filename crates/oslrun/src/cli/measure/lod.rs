//! `oslrun lod FILE -o lod.osl`: writes a shader that is simpler where a pixel covers much of its pattern.

use super::Clock;
use crate::cli::options::points::{GridArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::BatchArgs;
use crate::cli::options::shader::ShaderArgs;
use crate::cli::print::{Console, busy};
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl::stages;
use osl_exec::RunError;
use osl_image::Transfer;
use osl_job::file::data_url;
use osl_job::picture::setup::{grid, grid_spaces, options, services, stopped};
use osl_job::request::values::seconds;
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::source::{input, repair};
use osl_job::{Failure, Image, Sink};
use osl_limits::Halt;
use osl_lower::params::{self, ParamValues};
use osl_measure::lod::{self, GivenParam, Report, Stop};
use osl_measure::stability::fix::Built;
use std::path::{Path, PathBuf};

/// The default size of the image at footprint 1.
const POINTS: &str = "128x128";

/// What the grid means here.
const GRID: &str = "Pixels of the image at footprint 1; with --uv-scale they say how large a pixel is there";

/// What to simplify.
#[derive(Debug, Args)]
#[command(
    mut_arg("file", |arg| arg.help("The shader: a source").long_help("The shader: a source")),
    mut_arg("grid", |arg| arg.default_value(POINTS).help(GRID).long_help(GRID)),
)]
pub(in crate::cli) struct LodArgs {
    /// Maximum time in seconds. If it is not enough, the report says what is missing.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// An error up to which a level may be used even if the original is closer: a share of an output's range.
    /// The default is a step of an image with 8 bits.
    #[arg(long, value_name = "SHARE", default_value_t = 0.004)]
    tolerance: f64,
    /// The largest root mean square error of a mean that replaces the outputs: a share of an output's range.
    /// Where it is larger, the original runs.
    #[arg(long, value_name = "SHARE", default_value_t = 0.25)]
    error: f64,
    /// Another number measures at other points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u32,
    /// Print JSON: the levels, and for each footprint the errors and the times.
    #[arg(long)]
    json: bool,
    /// Write a page with the levels, pictures side by side at each footprint, and the written shader.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// The shader to write: the source with its levels.
    #[arg(short, long, value_name = "LOD.osl", value_parser = PathBufValueParser::new().try_map(source_file))]
    output: Option<PathBuf>,
    /// Use a level only where its error is not larger than that of so many samples of the original.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=MOST_SAMPLES))]
    samples: u32,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    batch: BatchArgs,
    #[command(flatten)]
    format: FormatArgs,
}

impl LodArgs {
    fn image(&self) -> Image {
        Image {
            shader: self.shader.shader(None),
            points: self.grid.points(),
            provided: self.scene.provided(None),
            running: self.batch.running(),
            ..Image::default()
        }
    }
}

fn source_file(path: PathBuf) -> Result<PathBuf, String> {
    match path.extension().is_some_and(|ending| ending == "osl") {
        true => Ok(path),
        false => Err("the name must end in .osl".to_string()),
    }
}

/// Largest number of samples with which levels are compared.
const MOST_SAMPLES: i64 = 64;

/// Finds the levels, and writes the shader.
pub(in crate::cli) fn lod(args: &LodArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let run = &args.image();
    let path = suits(args, run)?;
    let clock = Clock::new(args.budget);
    let request = Request { repair: run.shader.repair.then_some(None), ..Request::of(run) };
    let LoadedShader { sources, body, folder, .. } = load::load(&request, console)?;
    let mut input = input::read(path, &run.shader.read)?;
    input.files = input.files.or_anywhere(run.shader.allow_files);
    if run.shader.repair {
        repair::apply(&mut input, None)?;
    }
    let check = |text: &str| stages::check(&input.name, text, &input.files, &input.options);
    let build = |text: &str| {
        let checked = check(text);
        let program = checked.program?;
        let plain = load::lowered_again(&program, &request, false, None)?;
        Some(Built { program, sources: checked.sources, plain, noted: None })
    };
    let program = check(&input.text).program.ok_or_else(Failure::said)?;
    let given = given(&program, &run.shader.params)?;
    let services = services(run, folder, grid_spaces(run));
    let mut options = options(run);
    options.limits = options.limits.until(&clock.cancel);
    let bar = busy("measuring", args.budget);
    let found = lod::lod(&lod::Request {
        text: &input.text,
        program: &program,
        body,
        given: &given,
        build: &build,
        grid: &grid(run),
        services: &services,
        options: &options,
        samples: args.samples,
        tolerance: args.tolerance,
        error: args.error,
        seed: args.seed,
        pictures: args.html.is_some(),
    });
    bar.finish_and_clear();
    let report = found.map_err(|stop| match stop {
        Stop::Refused(why) => Failure::new(why),
        Stop::Run(RunError::Halted(Halt::Cancelled)) if clock.is_over() => {
            Failure::new("the time was over before any level was found; --budget SECONDS sets it")
        }
        Stop::Run(stop) => stopped(&stop, &sources),
    })?;
    if args.json {
        console.object(&report)?;
    } else {
        console.escaped(&lod::text(&report));
    }
    files(args, &report, console)
}

/// Refuses what is not the source of a single shader, and numbers out of range.
fn suits<'a>(args: &LodArgs, run: &'a Image) -> Result<&'a Path, Failure> {
    for (name, share) in [("tolerance", args.tolerance), ("error", args.error)] {
        if !(0.0..=1.0).contains(&share) {
            return Err(Failure::usage(format!("--{name} must be a share from 0 to 1")));
        }
    }
    let single = run.shader.file.as_deref().filter(|file| {
        run.shader.network.is_empty()
            && !load::is_group(file)
            && !stages::is_compiled(&file.display().to_string())
    });
    single.ok_or_else(|| Failure::usage("lod is for the source of a single shader"))
}

/// The values that were given for parameters.
fn given(program: &osl_hir::hir::Program, values: &[(String, String)]) -> Result<Vec<GivenParam>, Failure> {
    let mut given = ParamValues::default();
    for (name, text) in values {
        params::set(program, &mut given, name, text).map_err(Failure::new)?;
    }
    Ok(given.given(program).into_iter().map(|(name, values)| (name.to_string(), values.to_vec())).collect())
}

fn files(args: &LodArgs, report: &Report, console: &mut Console<'_>) -> Result<(), Failure> {
    let wrote = |path: &Path, console: &mut Console<'_>| {
        console.text(&format!("wrote {}", path.display()));
    };
    if let Some(path) = &args.html {
        let page = lod::html(report, &|width, height, planes| {
            data_url::png((width, height), planes, Transfer::Srgb)
        });
        osl_files::replace(path, page.as_bytes()).map_err(Failure::new)?;
        wrote(path, console);
    }
    let Some(path) = &args.output else { return Ok(()) };
    match &report.text {
        Some(text) => {
            osl_files::replace(path, text.as_bytes()).map_err(Failure::new)?;
            wrote(path, console);
        }
        None => {
            let name = path.display().to_string();
            console.note(&format!("there are no levels, so {name} is not written"));
        }
    }
    Ok(())
}
