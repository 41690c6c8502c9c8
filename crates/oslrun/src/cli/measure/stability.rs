//! `oslrun stability FILE`: shows where a shader becomes inaccurate, which line is the cause, and with
//! `--fix` a repair of it.

use super::{Clock, repair};
use crate::cli::options::points::{PlaceArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::StepArgs;
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs};
use crate::cli::print::{Console, json};
use crate::cli::source::info::{self, Parameter};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, ValueEnum};
use osl_job::file::map;
use osl_job::picture::setup::{grid, grid_spaces, options, services, stopped};
use osl_job::request::Points;
use osl_job::request::values::{self, image_path, seconds};
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::source::reads::Reads;
use osl_job::{Failure, Image, NoSink, Sink};
use osl_measure::stability::{self, Base, Examined, Knob, Planes, Setting, Subject, Trial, digits_lost};
use osl_scene::Grid;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What to examine.
#[derive(Debug, Args)]
pub(in crate::cli) struct StabilityArgs {
    /// Number of grid points on which each setting is tried.
    #[arg(short = 'g', long, visible_alias = "grid", value_name = "WxH", default_value = "64x64", value_parser = values::grid)]
    points: (usize, usize),
    /// The error above which a point counts as wrong, as a fraction of the output's range.
    #[arg(long, value_name = "SHARE", default_value = "0.01")]
    tolerance: f64,
    /// Do not try other values of the parameters.
    #[arg(long)]
    no_params: bool,
    /// Look for a repair of the lines to blame: rewrites of the source that cut the error at least tenfold,
    /// cost less than 1.2 times (1.5 if the error falls a thousandfold) and change nothing that was right.
    /// They are shown as a diff with their figures.
    #[arg(long)]
    fix: bool,
    /// Maximum time in seconds; 4 by default, and 10 with --fix. If it is not enough, the report says what
    /// was not examined.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    budget: Option<f64>,
    /// Show the result of every setting, and all lines.
    #[arg(long)]
    all: bool,
    /// End with exit code 1 if a point has one of these at the given setting: error (it exceeds the
    /// tolerance), nan, infinity; or any.
    #[arg(long, value_name = "KIND,…", value_delimiter = ',')]
    fail_on: Vec<FailOn>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write a report with curves and maps of lost digits.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Image of the number of decimal digits that each pixel has lost at the given setting. EXR and TIFF hold
    /// the numbers: EXR with a channel for each output, TIFF with the largest of all outputs. PNG and JPEG
    /// show the largest as grey: 0 digits are black, 8 or more, which is all that a float has, white.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(image_path))]
    error_map: Option<PathBuf>,
    /// With --fix or --repair: save the repaired source here.
    #[arg(long, value_name = "FILE.osl")]
    write: Option<PathBuf>,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    place: PlaceArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    steps: StepArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// What fails the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum FailOn {
    Error,
    Nan,
    Infinity,
    Any,
}

impl FailOn {
    fn is_in(self, trial: &Trial) -> bool {
        trial.outcomes.iter().any(|outcome| match self {
            FailOn::Error => outcome.wrong > 0.0,
            FailOn::Nan => outcome.nan > 0.0,
            FailOn::Infinity => outcome.infinite > 0.0,
            FailOn::Any => outcome.wrong + outcome.nan + outcome.infinite > 0.0,
        })
    }
}

impl StabilityArgs {
    fn image(&self) -> Image {
        let mut shader = self.shader.shader(Some(&self.network));
        shader.outputs = self.outputs.names();
        shader.write = self.write.clone();
        Image {
            shader,
            points: Points { grid: self.points, ..self.place.points() },
            provided: self.scene.provided(None),
            running: self.steps.running(),
            ..Image::default()
        }
    }
}

/// The default times in seconds: without a search for a repair, and with it.
const BUDGETS: [f64; 2] = [4.0, 10.0];

/// The share of the time that the examination may take before the search for a repair.
const BEFORE_FIX: f64 = 0.6;

/// Examines a shader.
pub(in crate::cli) fn stability(args: &StabilityArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    if !(args.tolerance > 0.0 && args.tolerance.is_finite()) {
        return Err(Failure::usage("--tolerance must be a number above 0"));
    }
    let run = &args.image();
    if args.write.is_some() && !args.fix && !run.shader.repair {
        return Err(Failure::usage("--write needs --fix or --repair"));
    }
    if args.fix {
        repair::suits(run)?;
    }
    let budget = args.budget.unwrap_or(BUDGETS[usize::from(args.fix)]);
    let times = [if args.fix { BEFORE_FIX } else { 1.0 }, 1.0].map(|share| Clock::new(budget * share));
    let request = Request::of(run);
    let (LoadedShader { sources, body, folder, program, name, .. }, noted) =
        load::load_noted(&request, console)?;
    let outputs = outputs(run);
    let services = services(run, folder, grid_spaces(run));
    let base = Base::new(body, noted, outputs.clone(), run.limits());
    let limits = times.each_ref().map(|clock| options(run).limits.until(&clock.cancel));
    let subject = Subject::new(&services, base, &limits[0]);
    let grid = grid(run);
    let knobs: Vec<Knob> = if args.no_params {
        Vec::new()
    } else {
        info::describe(&program).parameters.iter().filter_map(|p| knob(p, &run.shader.params)).collect()
    };
    // The given setting is the first one.
    let settings = 1 + knobs.iter().map(|knob| knob.values.len()).sum::<usize>();
    let meter = console.meters()(settings as u64, "settings");
    let tried = std::cell::Cell::new(0);
    let variant = |name: &str, value: &str| {
        tried.set(tried.get() + 1);
        meter.at(tried.get());
        let mut params = run.shader.params.clone();
        params.push((name.to_string(), value.to_string()));
        let request = Request { params: &params, repair: None, points: 1, ..Request::of(run) };
        let (loaded, noted) = load::load_noted(&request, &mut NoSink).ok()?;
        Some(Base::new(loaded.body, noted, outputs.clone(), run.limits()))
    };
    let mut examined = stability::examine(&subject, &grid, args.tolerance, &knobs, &variant, &sources, &name);
    drop(meter);
    if args.fix {
        let subject = Subject::new(&services, subject.base, &limits[1]);
        examined.report.repair = Some(repair::find(run, &request, (&subject, &grid), &examined, &knobs)?);
    }
    let report = &examined.report;
    let mut text = if args.json { json::pretty(report)? } else { stability::text::text(report, args.all) };
    let repaired = report.repair.as_ref().map(|found| repair::text(found, run));
    if let Some(said) = repaired.as_ref().filter(|_| !args.json) {
        text += said;
    }
    console.report(&text);
    files(args, (&examined, repaired.as_deref()), &grid, console)?;
    report.repair.as_ref().map_or(Ok(()), |found| repair::write(found, run, console))?;
    let given = report.trials.first();
    match given.is_some_and(|given| args.fail_on.iter().any(|kind| kind.is_in(given))) {
        true => Err(Failure::said()),
        false => Ok(()),
    }
}

fn files(
    args: &StabilityArgs,
    (examined, repair): (&Examined, Option<&str>),
    grid: &Grid,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    if let Some(path) = &args.html {
        let html = stability::html::html(examined, (grid.width, grid.height), repair);
        osl_files::replace(path, html.as_bytes()).map_err(Failure::new)?;
        console.wrote(path);
    }
    if let Some(path) = &args.error_map {
        map(path, &examined.given, grid)?;
        console.wrote(path);
    }
    Ok(())
}

/// Writes the number of digits that each point has lost.
fn map(path: &Path, planes: &Planes, grid: &Grid) -> Result<(), Failure> {
    map::write(path, (grid.width, grid.height), &layers(planes), WHITE)
}

/// For each component of an output, the digits that each point has lost.
fn layers(planes: &Planes) -> Vec<(&str, Vec<f32>)> {
    let lost = |(strict, exact): (&Vec<f64>, &Vec<f64>)| {
        strict.iter().zip(exact).map(|(s, e)| digits_lost(*s, *e) as f32).collect::<Vec<f32>>()
    };
    let values = planes.strict.iter().zip(&planes.exact).map(lost);
    planes.names.iter().map(String::as_str).zip(values).collect()
}

/// The number of lost digits that a picture shows as white.
pub(in crate::cli) const WHITE: f32 = stability::html::WHITE;

/// The outputs that the command line names.
fn outputs(run: &Image) -> Option<Vec<Arc<str>>> {
    run.shader.outputs.as_ref().map(|list| list.iter().map(|output| output.as_str().into()).collect())
}

/// The digits that each point of the grid has lost, which `--error-map` shows: the largest number of all
/// components. Adds the files that the run reads.
pub(in crate::cli) fn lost(run: &Image, reads: &mut Reads, sink: &mut dyn Sink) -> Result<Vec<f32>, Failure> {
    let request = Request::of(run);
    let (LoadedShader { sources, body, folder, texts, .. }, noted) = load::load_noted(&request, sink)?;
    let services = services(run, folder, grid_spaces(run));
    reads.sources(&sources);
    reads.textures(&services.textures, texts.iter().map(|(_, text)| &**text));
    let limits = options(run).limits;
    let base = Base::new(body, noted, outputs(run), run.limits());
    let subject = Subject::new(&services, base, &limits);
    let planes = subject.run(&subject.base, &Setting::AsGiven.points(&grid(run)), false);
    reads.textures(&services.textures, []);
    Ok(map::largest(&layers(&planes.map_err(|stop| stopped(&stop, &sources))?)))
}

/// The values of a parameter to try: its limits, 0, its negation, and the extremes; and those that a user may
/// choose, without the extremes. `None` if it is not a number.
fn knob(parameter: &Parameter, given: &[(String, String)]) -> Option<Knob> {
    if parameter.output {
        return None;
    }
    let whole = match parameter.ty.as_str() {
        "int" => true,
        "float" | "color" | "point" | "vector" | "normal" => false,
        _ => return None,
    };
    let mut values: Vec<String> = Vec::new();
    let mut push = |text: String| {
        if !values.contains(&text) {
            values.push(text);
        }
    };
    let limit = |name: &str| parameter.metadata.iter().find(|m| m.name == name)?.value.as_f64();
    let limits: Vec<f64> = ["min", "max", "slidermin", "slidermax"].into_iter().filter_map(limit).collect();
    limits.iter().for_each(|number| push(number.to_string()));
    push("0".to_string());
    let now = given.iter().rev().find(|(name, _)| *name == parameter.name);
    let now = now.and_then(|(_, text)| text.parse::<f64>().ok()).or_else(|| first(&parameter.default));
    if let Some(x) = now.filter(|x| *x != 0.0) {
        push((-x).to_string());
    }
    // What a user may choose; a repair must not harm there.
    let mut near = values.clone();
    let around = around(now.unwrap_or(0.0), whole);
    near.extend(around.iter().map(|x| x.to_string()));
    // Between them, each hundredth of the range that the metadata states, or else of these values.
    let ends = |list: &[f64]| {
        list.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(*x), h.max(*x)])
    };
    let [low, high] = ends(&limits);
    near.extend(Knob::between(if low < high { [low, high] } else { ends(&around) }, whole));
    let extremes: &[&str] = if whole {
        &["1", "-1", "2147483647", "-2147483648"]
    } else {
        &["1e-30", "-1e-30", "1e30", "-1e30", "nan", "inf", "-inf"]
    };
    for text in extremes {
        if !values.iter().any(|value| value == text) {
            values.push((*text).to_string());
        }
    }
    Some(Knob { name: parameter.name.clone(), values, near })
}

/// Values around a parameter's given one, below and above it.
fn around(now: f64, whole: bool) -> Vec<f64> {
    match (whole, now == 0.0) {
        (true, _) => vec![-now, now - 1.0, now + 1.0, 2.0 * now, 10.0 * now],
        (false, true) => vec![0.01, 1.0, -1.0],
        (false, false) => [-1.0, 0.1, 0.5, 2.0, 10.0].iter().map(|factor| factor * now).collect(),
    }
}

fn first(value: &Value) -> Option<f64> {
    value.as_f64().or_else(|| value.as_array()?.first()?.as_f64())
}
