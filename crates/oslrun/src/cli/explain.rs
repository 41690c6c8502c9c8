//! `oslrun explain FILE --at X,Y`: shows what a shader does at one point; `--cost`: what each output costs.

use super::Failure;
use super::args::{self, RunArgs};
use super::load::{self, Loaded, Request};
use super::session::{grid, services};
use clap::Args;
use osl_exec::PointSource;
use osl_ir::passes;
use osl_measure::explain::{self, cost, text};
use osl_measure::trace::{self, OnePoint};
use osl_scene::Grid;
use std::io::Write;

/// What to explain.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// The pixel: column and row, from 0; row 0 has the smallest v.
    #[arg(long, value_name = "X,Y", value_parser = pixel, conflicts_with = "uv")]
    at: Option<(usize, usize)>,
    /// The point of the patch that is closest to this u and v.
    #[arg(long, value_name = "U,V", value_parser = args::values::pair, allow_hyphen_values = true)]
    uv: Option<args::values::Pair>,
    /// Also show the values in double precision, and how many digits agree.
    #[arg(long)]
    f64: bool,
    /// Show what each output needs: instructions, layers, derivatives, globals and textures.
    #[arg(long)]
    cost: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// The shader and its points.
    #[command(flatten)]
    run: RunArgs,
}

fn pixel(text: &str) -> Result<(usize, usize), String> {
    let (x, y) = text.split_once(',').ok_or("two numbers and a comma, such as 100,200")?;
    let number = |t: &str| t.trim().parse().map_err(|_| format!("`{t}` is no column or row"));
    Ok((number(x)?, number(y)?))
}

/// Explains a point.
pub(super) fn explain(args: &ExplainArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let (Loaded { sources, body, folder, .. }, noted) = load::load_noted(&Request::of(run), err)?;
    let points = grid(run);
    let outputs = run.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: run.read.limits.limits().clone(),
        ..passes::Options::default()
    };
    if args.cost {
        let costs = cost(&body, &options);
        let text = if args.json { json(&costs)? } else { explain::table(&costs) };
        let _ = out.write_all(text.as_bytes());
        return Ok(());
    }
    let (x, y) = match (args.at, &args.uv) {
        (Some(at), _) => at,
        (None, Some(uv)) => closest(&points, uv.0),
        (None, None) => (points.width / 2, points.height / 2),
    };
    let Some(point) = OnePoint::at_pixel(&points, points.width, points.height, x, y) else {
        return Err(Failure::new(format!(
            "the grid has {} by {} points; --at begins at 0,0",
            points.width, points.height
        )));
    };
    let services = services(run, folder, super::session::grid_spaces(run));
    let mut followed = trace::prepare(noted, &options.varying, &options.derivs, &options.limits);
    if let Some(wanted) = &options.outputs {
        followed.outputs.retain(|o| wanted.contains(&o.name));
    }
    let trace = trace::follow(&followed, &services, OnePoint { source: &points, point }, &options.limits);
    let needed = explain::only_needed(body, &options);
    let explanation = explain::explain(&trace, &followed, &needed, &sources);
    let text = if args.json {
        json(&explanation)?
    } else {
        let place = format!("pixel ({x}, {y}) of {} by {}", points.width, points.height);
        text::text(&explanation, &place, args.f64)
    };
    let _ = out.write_all(text.as_bytes());
    Ok(())
}

pub(super) fn json(value: &impl serde::Serialize) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(value).map_err(Failure::new)? + "\n")
}

/// The pixel whose point is closest to u and v.
fn closest(grid: &Grid, uv: [f32; 2]) -> (usize, usize) {
    let along = |axis: usize, n: usize| {
        let off = |i: &usize| (grid.coordinate(axis, *i, n) - uv[axis]).abs();
        (0..n).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    };
    (along(0, grid.width), along(1, grid.height))
}
