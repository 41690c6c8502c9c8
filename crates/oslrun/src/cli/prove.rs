//! `oslrun bounds FILE`: proves what holds at every point. This module must not know how bounds are found.

use super::args::RunArgs;
use super::args::values::seconds;
use super::clock::Clock;
use super::json::json;
use super::load::{self, LoadedShader, Request};
use super::session::{grid, grid_spaces, options, services};
use super::{Failure, data};
use clap::Args;
use osl_exec::PointSource;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_ir::types::{Base, Type};
use osl_measure::bounds::{self, Domain, Effort, Open, Range};
use osl_scene::WithData;
use osl_syntax::escape::shown;
use std::io::Write;

/// The name of the command.
pub(super) const NAME: &str = "bounds";

/// What to prove.
#[derive(Debug, Args)]
pub(super) struct ProveArgs {
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
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// The shader and its points: all those between the borders of the grid.
    #[command(flatten)]
    run: RunArgs,
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
pub(super) fn bounds(args: &ProveArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let clock = Clock::new(args.budget);
    let request = Request::of(run);
    let loaded = load::load(&request, err)?;
    let mut domain = Domain::of_patch(run.uv_scale.0, run.uv_offset.0);
    let body = opened(args, &loaded, &request, &mut domain)?;
    let outputs = loaded.outputs(run);
    let LoadedShader { sources, folder, name, .. } = loaded;
    let services = services(run, folder, grid_spaces(run));
    let points = WithData { data: data::read(run)?, points: grid(run) };
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: options(run).limits.until(&clock.cancel),
        ..passes::Options::default()
    };
    let subject = bounds::subject(body, &options);
    let effort = Effort { tiles: args.tiles, ..Effort::default() };
    let prove = || bounds::prove(&subject, (&services, &points, &sources), &domain, effort, &name);
    let report = super::session::on_threads(run.threads, prove)?;
    let text = if args.json { json(&report)? } else { bounds::text::text(&report) };
    let _ = write!(out, "{}", shown(&text));
    Ok(())
}

/// The body in which the parameters with a range are inputs.
fn opened(
    args: &ProveArgs,
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
