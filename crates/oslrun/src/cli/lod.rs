//! `oslrun lod FILE -o lod.osl`: writes a shader that is simpler where a pixel covers much of its pattern.
//! This module must not know how levels are found or written.

use super::args::RunArgs;
use super::args::values::seconds;
use super::clock::Clock;
use super::json::json;
use super::load::{self, LoadedShader, Request};
use super::session::{busy, grid, grid_spaces, options, services, stopped};
use super::{Failure, data_url, input, repair};
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl::stages;
use osl_exec::RunError;
use osl_image::Transfer;
use osl_limits::Halt;
use osl_lower::params::{self, ParamValues};
use osl_measure::lod::{self, GivenParam, Report, Stop};
use osl_measure::stability::fix::Built;
use osl_syntax::escape::shown;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The name of the command.
pub(super) const NAME: &str = "lod";

/// The default size of the image at footprint 1.
const POINTS: &str = "128x128";

/// What to simplify.
#[derive(Debug, Args)]
pub(super) struct LodArgs {
    /// Maximum time in seconds. If it is not enough, the report says what is missing.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// An error up to which a level may be used even if the original is closer: a share of an output's range.
    /// The default is a step of an image with 8 bits.
    #[arg(long, value_name = "SHARE", default_value_t = 0.004)]
    tolerance: f64,
    /// Another number measures at other points.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u32,
    /// Print JSON: the levels, and for each footprint the errors, the times and the front.
    #[arg(long)]
    json: bool,
    /// Write a page with the levels, pictures side by side at each footprint, and the written shader.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
    /// The shader and its points.
    #[command(flatten)]
    run: RunArgs,
}

/// Options that mean something else here.
pub(super) fn own_options(command: clap::Command) -> clap::Command {
    let source = PathBufValueParser::new().try_map(source_file);
    command
        .mut_arg("file", |arg| {
            let help = "The shader: a source";
            arg.help(help).long_help(help)
        })
        .mut_arg("output", |arg| {
            let help = "The shader to write: the source with its levels";
            arg.value_name("LOD.osl").value_parser(source).help(help).long_help(help)
        })
        .mut_arg("grid", |arg| {
            let help = "Pixels of the image at footprint 1; with --uv-scale they say how large a pixel is there";
            arg.default_value(POINTS).help(help).long_help(help)
        })
        .mut_arg("samples", |arg| {
            let help = "Use a level only where its error is not larger than that of so many samples of the original \
                        (default: 1)";
            arg.help(help).long_help(help)
        })
}

fn source_file(path: PathBuf) -> Result<PathBuf, String> {
    match path.extension().is_some_and(|ending| ending == "osl") {
        true => Ok(path),
        false => Err("the name must end in .osl".to_string()),
    }
}

/// Largest number of samples with which levels are compared.
const MOST_SAMPLES: u32 = 64;

/// Finds the levels, and writes the shader.
pub(super) fn lod(args: &LodArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let path = suits(args)?;
    let clock = Clock::new(args.budget);
    let request = Request { repair: run.repair.then_some(None), ..Request::of(run) };
    let LoadedShader { sources, body, folder, .. } = load::load(&request, err)?;
    let mut input = input::read(path, &run.read)?;
    input.files = input.files.or_anywhere(run.allow_files);
    if run.repair {
        repair::apply(&mut input, None, &mut std::io::sink())?;
    }
    let check = |text: &str| stages::check(&input.name, text, &input.files, &input.options);
    let build = |text: &str| {
        let checked = check(text);
        let program = checked.program?;
        let plain = load::lowered_again(&program, &request, false, None)?;
        Some(Built { program, sources: checked.sources, plain, noted: None })
    };
    let program = check(&input.text).program.ok_or_else(Failure::said)?;
    let given = given(&program, &run.params)?;
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
        samples: run.sampling.samples.unwrap_or(1),
        tolerance: args.tolerance,
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
    let text = if args.json { json(&report)? } else { lod::text(&report) };
    let _ = write!(out, "{}", shown(&text));
    files(args, &report, err)
}

/// Refuses what is not the source of a single shader, and numbers out of range.
fn suits(args: &LodArgs) -> Result<&Path, Failure> {
    let run = &args.run;
    if !(0.0..1.0).contains(&args.tolerance) {
        return Err(Failure::usage("--tolerance must be a share from 0 to 1"));
    }
    if run.sampling.samples.is_some_and(|n| n > MOST_SAMPLES) {
        return Err(Failure::usage(format!("--samples must be at most {MOST_SAMPLES}")));
    }
    let single = run.file.as_deref().filter(|file| {
        run.network.is_empty() && !load::is_group(file) && !stages::is_compiled(&file.display().to_string())
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

fn files(args: &LodArgs, report: &Report, err: &mut dyn Write) -> Result<(), Failure> {
    let wrote = |path: &Path, err: &mut dyn Write| {
        let _ = writeln!(err, "wrote {}", shown(&path.display().to_string()));
    };
    if let Some(path) = &args.html {
        let page = lod::html(report, &|width, height, planes| {
            data_url::png((width, height), planes, Transfer::Srgb)
        });
        osl_files::replace(path, page.as_bytes()).map_err(Failure::new)?;
        wrote(path, err);
    }
    let Some(path) = &args.run.output else { return Ok(()) };
    match &report.text {
        Some(text) => {
            osl_files::replace(path, text.as_bytes()).map_err(Failure::new)?;
            wrote(path, err);
        }
        None => {
            let name = path.display().to_string();
            let _ = writeln!(err, "note: there are no levels, so {} is not written", shown(&name));
        }
    }
    Ok(())
}
