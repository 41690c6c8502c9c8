//! `oslrun sanitize FILE`: counts numeric events by source line.

use super::{Clock, fail_on};
use crate::cli::options::points::{OnArgs, PatchArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::ThreadArgs;
use crate::cli::options::shader::SubjectArgs;
use crate::cli::print::Console;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl_exec::{PointSource, Services};
use osl_ir::passes;
use osl_job::file::map;
use osl_job::picture::setup::{self, grid, services};
use osl_job::picture::sight;
use osl_job::request::values::{image_path, seconds};
use osl_job::source::data;
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::{Failure, Image, Sink};
use osl_measure::sanitize::{self, Kind, Points as Places, Subject};
use osl_scene::WithData;
use std::path::PathBuf;

/// The default number of points: fewer than in a picture, since following a point takes longer than running
/// it.
const POINTS: &str = "64x64";

/// What to examine.
#[derive(Debug, Args)]
#[command(mut_arg("grid", |arg| arg.default_value(POINTS)))]
pub(in crate::cli) struct SanitizeArgs {
    /// Maximum time in seconds. If it is not enough, the report says how many points were not examined.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// End with exit code 1 if one of these events happens: int-overflow, int-conversion, zero-division,
    /// domain, edges, index, nan, infinity, cancellation, denormal; or any.
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = fail_on::kind)]
    fail_on: Vec<fail_on::FailOn>,
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
    #[command(flatten)]
    subject: SubjectArgs,
    #[command(flatten)]
    patch: PatchArgs,
    #[command(flatten)]
    on: OnArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

impl SanitizeArgs {
    fn image(&self) -> Image {
        let mut image = self.patch.image(self.subject.shader());
        image.points.surface = self.on.surface();
        image.running.threads = self.threads.count();
        image
    }
}

/// The points, the pixel of each if they are those of a surface, and the services.
type Ground = (Box<dyn PointSource>, Option<Vec<u32>>, Services);

fn ground(image: &Image, loaded: &LoadedShader, sink: &dyn Sink) -> Result<Ground, Failure> {
    if image.points.surface.on.is_some() {
        let (points, pixels, services) = sight::points(image, loaded, sink)?;
        return Ok((Box::new(points), Some(pixels), services));
    }
    let services = services(image, loaded.folder.clone(), setup::grid_spaces(image));
    Ok((
        Box::new(WithData { data: data::read(image, loaded.spoken.as_ref())?, points: grid(image) }),
        None,
        services,
    ))
}

/// Examines a shader.
pub(in crate::cli) fn sanitize(args: &SanitizeArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let image = args.image();
    let (width, height) = image.points.grid;
    let clock = Clock::new(args.budget);
    let loaded = load::load(&Request::of(&image), console)?;
    let outputs = loaded.outputs(&image);
    let (points, pixels, services) = ground(&image, &loaded, console)?;
    let LoadedShader { sources, body, name, .. } = loaded;
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: setup::options(&image).limits.until(&clock.cancel),
        ..passes::Options::default()
    };
    let subject = Subject::new(body, &options);
    let places = Places { source: &*points, size: (width, height), pixels: pixels.as_deref() };
    let examine = || {
        let mut examined = sanitize::sanitize(&subject, &services, &places, &sources, &name);
        if args.random_rounding {
            let found = sanitize::rounding(&subject, &services, &places, &sources);
            examined.report.rounding = Some(found);
        }
        examined
    };
    let examined = setup::on_threads(image.running.threads, examine)?;
    let report = &examined.report;
    if args.json {
        console.object(report)?;
    } else {
        console.escaped(&sanitize::text::text(report));
    }
    if let (Some(file), Some(event), false) = (&image.shader.file, report.events.first(), args.json) {
        let [x, y] = event.first;
        let file = file.display();
        let on = image.points.surface.on.as_ref().map_or_else(String::new, |name| format!(" --on {name}"));
        console.escaped(&format!(
            "\n`oslrun explain {file}{on} -g {width}x{height} --at {x},{y}` shows what such a pixel does\n"
        ));
    }
    if let Some(path) = &args.map {
        let layer = |kind: Kind| {
            let at = |bits: &u16| f32::from(bits & kind.bit() != 0);
            (kind.name(), examined.happened.iter().map(at).collect::<Vec<f32>>())
        };
        map::write(path, (width, height), &Kind::ALL.map(layer), 1.0)?;
        console.text(&format!("wrote {}", path.display()));
    }
    match report.events.iter().any(|event| fail_on::fails(&args.fail_on, event.kind)) {
        true => Err(Failure::said()),
        false => Ok(()),
    }
}
