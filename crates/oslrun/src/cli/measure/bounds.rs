//! `oslrun bounds FILE`: proves what holds at every point.

use super::{Clock, fail_on};
use crate::cli::options::points::PatchArgs;
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::ThreadArgs;
use crate::cli::options::shader::SubjectArgs;
use crate::cli::print::Console;
use clap::Args;
use osl_exec::PointSource;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_ir::types::{Base, Type};
use osl_job::picture::setup::{grid, grid_spaces, on_threads, options, services};
use osl_job::request::values::seconds;
use osl_job::source::data;
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::{Failure, Image};
use osl_measure::bounds::{self, Domain, Effort, Open, Range};
use osl_scene::WithData;

/// What to prove.
#[derive(Debug, Args)]
pub(in crate::cli) struct BoundsArgs {
    /// Prove for all values of a parameter from FROM to TO: `--over radius=0.1:0.5`, of a triple `--over
    /// tint=0:1` or `--over tint=0,0,0:1,1,0.5`; may be repeated. The other parameters have the values of
    /// `-p`, or their defaults.
    #[arg(long, value_name = "NAME=FROM:TO", value_parser = over)]
    over: Vec<Over>,
    /// Maximum time in seconds. If it is not enough, the report has wider bounds.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// Maximum number of tiles, the parts of the domain for which bounds are computed.
    #[arg(long, value_name = "N", default_value_t = Effort::default().tiles)]
    tiles: usize,
    /// End with exit code 1 unless it is proven that none of these events happens: the kinds of `sanitize`,
    /// such as zero-division, domain, index, nan, infinity; or any.
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = fail_on::kind)]
    fail_on: Vec<fail_on::FailOn>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    subject: SubjectArgs,
    #[command(flatten)]
    patch: PatchArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

impl BoundsArgs {
    fn image(&self) -> Image {
        let mut image = self.patch.image(self.subject.shader());
        image.running.threads = self.threads.count();
        image
    }
}

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
struct Over {
    name: String,
    from: String,
    to: String,
}

fn over(text: &str) -> Result<Over, String> {
    let parts = text.split_once('=').and_then(|(name, range)| Some((name, range.split_once(':')?)));
    let Some((name, (from, to))) = parts.filter(|(name, _)| !name.is_empty()) else {
        return Err("write NAME=FROM:TO, such as radius=0.1:0.5".to_string());
    };
    Ok(Over { name: name.to_string(), from: from.trim().to_string(), to: to.trim().to_string() })
}

impl Over {
    /// The ranges of the components.
    fn ranges(&self, ty: Option<Type>) -> Result<Vec<Range>, Failure> {
        let fails =
            |why: &str| Failure::usage(format!("--over {}={}:{}: {why}", self.name, self.from, self.to));
        let Some(ty) = ty else { return Err(Failure { code: 1, ..fails("there is no such parameter") }) };
        let is_number = matches!(ty.base, Base::Int | Base::Float) || ty.base.is_triple();
        if ty.is_array() || !is_number {
            return Err(fails("only an int, a float or a triple has a range"));
        }
        let count = if ty.base.is_triple() { 3 } else { 1 };
        let numbers = |text: &str| -> Option<Vec<f32>> {
            let list: Option<Vec<f32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
            let list = list.filter(|list| list.iter().all(|x: &f32| x.is_finite()))?;
            match list[..] {
                [one] => Some(vec![one; count]),
                _ => Some(list).filter(|list| list.len() == count),
            }
        };
        let (Some(from), Some(to)) = (numbers(&self.from), numbers(&self.to)) else {
            return Err(fails("write numbers, three with commas for a triple"));
        };
        let is_int = ty.base == Base::Int;
        let letters = if ty.base == Base::Color { ["r", "g", "b"] } else { ["x", "y", "z"] };
        let mut ranges = Vec::new();
        for (at, (from, to)) in from.into_iter().zip(to).enumerate() {
            if from > to {
                return Err(fails("the first value is the smaller one"));
            }
            if is_int && [from, to].iter().any(|x| x.fract() != 0.0 || x.abs() > 16_777_216.0) {
                return Err(fails("write whole numbers up to 16777216"));
            }
            let name = if count == 3 { format!("{}.{}", self.name, letters[at]) } else { self.name.clone() };
            ranges.push(Range { name, from, to, is_int });
        }
        Ok(ranges)
    }
}

/// Proves bounds of a shader.
pub(in crate::cli) fn bounds(args: &BoundsArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let image = args.image();
    let clock = Clock::new(args.budget);
    let request = Request::of(&image);
    let loaded = load::load(&request, console)?;
    let mut domain = Domain::of_patch(image.points.uv_scale, image.points.uv_offset);
    let body = opened(args, &loaded, &request, &mut domain)?;
    let outputs = loaded.outputs(&image);
    let LoadedShader { sources, folder, name, spoken, .. } = loaded;
    let services = services(&image, folder, grid_spaces(&image));
    let points = WithData { data: data::read(&image, spoken.as_ref())?, points: grid(&image) };
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: options(&image).limits.until(&clock.cancel),
        ..passes::Options::default()
    };
    let subject = bounds::subject(body, &options);
    let effort = Effort { tiles: args.tiles, ..Effort::default() };
    let prove = || bounds::prove(&subject, (&services, &points, &sources), &domain, effort, &name);
    let report = on_threads(image.running.threads, prove)?;
    match args.json {
        true => console.object(&report)?,
        false => console.escaped(&bounds::text::text(&report)),
    }
    if report.open_kinds().into_iter().any(|kind| fail_on::fails(&args.fail_on, kind)) {
        return Err(Failure::said());
    }
    Ok(())
}

/// The body in which the parameters with a range are inputs.
fn opened(
    args: &BoundsArgs,
    loaded: &LoadedShader,
    request: &Request<'_>,
    domain: &mut Domain,
) -> Result<Body, Failure> {
    if args.over.is_empty() {
        return Ok(loaded.body.clone());
    }
    let mut open = Vec::new();
    for over in &args.over {
        let ranges = over.ranges(loaded.type_of(&over.name))?;
        let first = domain.ranges.len();
        domain.ranges.extend(ranges);
        open.push((first, (over.name.as_str(), over.from.as_str())));
    }
    let values: Vec<(&str, &str)> = open.iter().map(|(_, value)| *value).collect();
    let (body, inputs) = load::lowered_open(loaded, request, &values)?;
    domain.open = inputs.into_iter().zip(open).map(|(input, (first, _))| Open { input, first }).collect();
    Ok(body)
}
