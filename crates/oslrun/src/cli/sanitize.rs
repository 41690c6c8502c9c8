//! `oslrun sanitize FILE`: counts numeric events by source line. This module must not know what an event is.

use super::args::RunArgs;
use super::args::values::{image_path, seconds};
use super::clock::Clock;
use super::json::json;
use super::load::{self, LoadedShader, Request};
use super::session::{grid, services};
use super::{Failure, data, map, surface};
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl_exec::{PointSource, Services};
use osl_ir::passes;
use osl_measure::sanitize::{self, Kind, Points, Subject};
use osl_scene::WithData;
use osl_syntax::escape::shown;
use std::io::Write;
use std::path::PathBuf;

/// The name of the command.
pub(super) const NAME: &str = "sanitize";

/// The default number of points: fewer than in a picture, since following a point takes longer than running
/// it.
const POINTS: &str = "64x64";

/// The grid has a default of its own.
pub(super) fn own_options(command: clap::Command) -> clap::Command {
    command.mut_arg("grid", |arg| arg.default_value(POINTS))
}

/// What to examine.
#[derive(Debug, Args)]
pub(super) struct SanitizeArgs {
    /// Maximum time in seconds. If it is not enough, the report says how many points were not examined.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// End with exit code 1 if one of these events happens: int-overflow, int-conversion, zero-division,
    /// domain, edges, index, nan, infinity, cancellation, denormal; or any.
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = kind)]
    fail_on: Vec<FailOn>,
    /// Also follow up to 1024 of the points three times with random rounding, and say in how many digits the
    /// results agree and where digits fall apart: a second opinion that needs no double precision.
    #[arg(long)]
    random_rounding: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Image of the points at which something happened: white in PNG and JPEG, 1 in TIFF; EXR has a channel
    /// for each kind of event.
    #[arg(long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(image_path))]
    map: Option<PathBuf>,
    /// The shader and its points.
    #[command(flatten)]
    run: RunArgs,
}

/// An event that fails the command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FailOn {
    Any,
    One(Kind),
}

fn kind(text: &str) -> Result<FailOn, String> {
    if text == "any" {
        return Ok(FailOn::Any);
    }
    Kind::from_name(text).map(FailOn::One).ok_or_else(|| {
        let names: Vec<&str> = Kind::ALL.into_iter().map(Kind::name).collect();
        format!("the kinds are any, {}", names.join(", "))
    })
}

/// The points, the pixel of each if they are those of a surface, and the services.
fn places(run: &RunArgs, loaded: &LoadedShader) -> Result<Places, Failure> {
    if run.on.on.is_some() {
        let (points, pixels, services) = surface::points(run, loaded)?;
        return Ok((Box::new(points), Some(pixels), services));
    }
    let services = services(run, loaded.folder.clone(), super::session::grid_spaces(run));
    Ok((Box::new(WithData { data: data::read(run)?, points: grid(run) }), None, services))
}

type Places = (Box<dyn PointSource>, Option<Vec<u32>>, Services);

/// Examines a shader.
pub(super) fn sanitize(args: &SanitizeArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let (width, height) = run.grid;
    let clock = Clock::new(args.budget);
    let loaded = load::load(&Request::of(run), err)?;
    let outputs = loaded.outputs(run);
    let (points, pixels, services) = places(run, &loaded)?;
    let LoadedShader { sources, body, name, .. } = loaded;
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: super::session::options(run).limits.until(&clock.cancel),
        ..passes::Options::default()
    };
    let subject = Subject::new(body, &options);
    let places = Points { source: &*points, size: (width, height), pixels: pixels.as_deref() };
    let examine = || {
        let mut examined = sanitize::sanitize(&subject, &services, &places, &sources, &name);
        if args.random_rounding {
            let found = sanitize::rounding(&subject, &services, &places, &sources);
            examined.report.rounding = Some(found);
        }
        examined
    };
    let examined = super::session::on_threads(run.threads, examine)?;
    let report = &examined.report;
    let mut text = if args.json { json(report)? } else { sanitize::text::text(report) };
    if let (Some(file), Some(event), false) = (&run.file, report.events.first(), args.json) {
        let [x, y] = event.first;
        let file = file.display();
        let on = run.on.on.as_ref().map_or_else(String::new, |name| format!(" --on {name}"));
        text += &format!(
            "\n`oslrun explain {file}{on} -g {width}x{height} --at {x},{y}` shows what such a pixel does\n"
        );
    }
    let _ = write!(out, "{}", shown(&text));
    if let Some(path) = &args.map {
        let layer = |kind: Kind| {
            let at = |bits: &u16| f32::from(bits & kind.bit() != 0);
            (kind.name(), examined.happened.iter().map(at).collect::<Vec<f32>>())
        };
        map::write(path, (width, height), &Kind::ALL.map(layer), 1.0)?;
        let _ = writeln!(err, "wrote {}", shown(&path.display().to_string()));
    }
    let fails = |kind: Kind| args.fail_on.iter().any(|w| [FailOn::Any, FailOn::One(kind)].contains(w));
    match report.events.iter().any(|event| fails(event.kind)) {
        true => Err(Failure::said()),
        false => Ok(()),
    }
}
