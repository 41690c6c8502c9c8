//! `oslrun explain FILE --at X,Y`: shows what a shader does at one point; `--cost`: what each output costs.

use super::Failure;
use super::args::{self, RunArgs};
use super::json::json;
use super::load::{self, LoadedShader, Request};
use super::session::{self, grid, grid_spaces, services, spaces};
use super::shading::Report;
use super::{data, surface};
use clap::Args;
use osl::stages;
use osl_exec::{PointSource, Services};
use osl_ir::Span;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_measure::explain::text::{self, Style};
use osl_measure::explain::{self, Explanation, Reported, Selection, Subject, cost};
use osl_measure::trace::{self, OnePoint};
use osl_scene::{Grid, WithData};
use std::io::Write;

/// What to explain.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    /// The pixel: column and row, from 0; row 0 has the smallest v, or with --on is the top of the picture.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true, conflicts_with = "uv")]
    at: Option<(usize, usize)>,
    /// The point of the patch that is closest to this u and v.
    #[arg(long, value_name = "U,V", value_parser = args::values::pair, allow_hyphen_values = true)]
    uv: Option<args::values::Pair>,
    /// Also show the values in double precision, and how many digits agree.
    #[arg(long)]
    f64: bool,
    /// Also show how each float and triple changes with u and v and from pixel to pixel, and through which
    /// variables.
    #[arg(long)]
    derivatives: bool,
    /// Show all values of long loops and arrays.
    #[arg(long)]
    all: bool,
    /// Show only these variables; may be repeated.
    #[arg(long, value_name = "NAME")]
    var: Vec<String>,
    /// Show only the line with this number; may be repeated.
    #[arg(long, value_name = "N")]
    line: Vec<u32>,
    /// Show only what happens in the call with this number; 0 is the shader itself.
    #[arg(long, value_name = "N")]
    call: Option<usize>,
    /// Show calls within calls only up to this depth; 0 shows the shader itself.
    #[arg(long, value_name = "N")]
    depth: Option<usize>,
    /// Show what each output needs (instructions, layers, derivatives, globals and textures), and which lines
    /// cost most. No clock is asked.
    #[arg(long)]
    cost: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// The shader and its points.
    #[command(flatten)]
    run: RunArgs,
}

impl ExplainArgs {
    /// What to show of the explanation.
    fn part(&self) -> Selection {
        Selection {
            variables: self.var.clone(),
            lines: self.line.clone(),
            call: self.call,
            depth: self.depth,
        }
    }
}

fn pixel(text: &str) -> Result<(usize, usize), String> {
    let (x, y) = text.split_once(',').ok_or("two numbers and a comma, such as 100,200")?;
    let number =
        |t: &str| t.trim().parse().map_err(|_| format!("`{t}` is no column or row: they are counted from 0"));
    Ok((number(x)?, number(y)?))
}

/// Explains a point.
pub(super) fn explain(args: &ExplainArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let (loaded, noted) = load::load_noted(&Request::of(run), err)?;
    if args.cost {
        let affine = spaces(run, grid_spaces(run)).affine();
        let options = passes::Options { affine, ..options(run, &grid(run)) };
        let mut costs = cost(&loaded.body, &options);
        let lines = explain::line_costs(&loaded.body, &options, &loaded.sources);
        let text = match (args.json, costs.get_mut(1)) {
            (true, Some(all)) => {
                all.lines = lines;
                json(&costs)?
            }
            _ => format!("{}\n{}", explain::table(&costs), explain::ranking(&lines)),
        };
        let _ = out.write_all(text.as_bytes());
        return Ok(());
    }
    let place = (args.at, args.uv.as_ref());
    let Some((explanation, place)) = found(run, (&loaded, noted), place, args.derivatives, &args.part())?
    else {
        return Ok(());
    };
    let text = if args.json {
        json(&explanation)?
    } else {
        text::text(&explanation, &place, Style { exact: args.f64, all: args.all })
    };
    let _ = out.write_all(text.as_bytes());
    Ok(())
}

/// The explanation of a pixel as JSON, as the command prints it without further options.
pub(super) fn pixel_json(run: &RunArgs, at: (usize, usize), err: &mut dyn Write) -> Result<String, Failure> {
    let (loaded, noted) = load::load_noted(&Request::of(run), err)?;
    match found(run, (&loaded, noted), (Some(at), None), false, &Selection::default())? {
        Some((explanation, _)) => json(&explanation),
        None => Err(Failure::new("there is no such point")),
    }
}

/// The explanation of the point at a pixel, closest to a place of the patch, or in the middle; and its place
/// in words.
fn found(
    run: &RunArgs,
    (loaded, noted): (&LoadedShader, Body),
    (at, uv): (Option<(usize, usize)>, Option<&args::values::Pair>),
    derivatives: bool,
    part: &Selection,
) -> Result<Option<(Explanation, String)>, Failure> {
    let told = |point: OnePoint<'_>, services: &Services, place: String| {
        let explanation = told(run, (loaded, noted), point, services, derivatives, part)?;
        Ok(Some((explanation, place)))
    };
    if run.on.on.is_some() {
        if uv.is_some() {
            return Err(Failure::usage("--uv is for the patch; with --on, --at X,Y chooses a pixel"));
        }
        let (points, pixels, services) = surface::points(run, loaded)?;
        let (width, height) = run.grid;
        let (x, y) = at.unwrap_or((width / 2, height / 2));
        inside((x, y), run.grid)?;
        let pixel = u32::try_from(y * width + x).unwrap_or(u32::MAX);
        let Some(point) = pixels.iter().position(|known| *known == pixel) else {
            return Err(Failure::new(format!("the pixel ({x}, {y}) does not show the surface")));
        };
        let place = format!(
            "pixel ({x}, {y}) of {width} by {height} on {}",
            run.on.on.as_deref().unwrap_or_default()
        );
        return told(OnePoint { source: &points, point }, &services, place);
    }
    let grid = grid(run);
    let (x, y) = match (at, uv) {
        (Some(at), _) => at,
        (None, Some(uv)) => closest(&grid, uv.0),
        (None, None) => (grid.width / 2, grid.height / 2),
    };
    inside((x, y), run.grid)?;
    let place = format!("pixel ({x}, {y}) of {} by {}", grid.width, grid.height);
    let (width, height) = (grid.width, grid.height);
    let data = data::read(run)?;
    let points = WithData { points: grid, data };
    let Some(point) = OnePoint::at_pixel(&points, width, height, x, y) else { return Ok(None) };
    let services = services(run, loaded.folder.clone(), grid_spaces(run));
    told(OnePoint { source: &points, point }, &services, place)
}

/// Checks that a pixel is one of the picture.
fn inside((x, y): (usize, usize), (width, height): (usize, usize)) -> Result<(), Failure> {
    if x < width && y < height {
        return Ok(());
    }
    let (x, y) = (width.saturating_sub(1), height.saturating_sub(1));
    Err(Failure::usage(format!(
        "the grid has {width} by {height} points: --at begins at 0,0, and the last is {x},{y}"
    )))
}

fn options(run: &RunArgs, points: &dyn PointSource) -> passes::Options {
    passes::Options {
        outputs: run.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect()),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: run.read.limits.limits().clone(),
        ..passes::Options::default()
    }
}

/// Follows the point.
fn told(
    run: &RunArgs,
    (loaded, noted): (&LoadedShader, Body),
    point: OnePoint<'_>,
    services: &Services,
    derivatives: bool,
    part: &Selection,
) -> Result<Explanation, Failure> {
    let options = options(run, point.source);
    let subject = Subject::new(noted, &options, &loaded.sources);
    let trace = trace::follow(&subject.body, services, point, &options.limits);
    let mut explanation = explain::explain(&trace, &subject, &loaded.sources);
    if derivatives {
        let with_derivs = load::load_with_derivs(&Request::of(run))?;
        let with_derivs = Subject::new(with_derivs, &options, &loaded.sources);
        let with = trace::follow(&with_derivs.body, services, point, &options.limits);
        explain::derivatives(&mut explanation, (&trace, &subject), &with, point, &loaded.sources);
    }
    explanation.report(reported(run, loaded, point, services, options), &loaded.sources);
    explanation.narrow(part).map_err(Failure::new)?;
    Ok(explanation)
}

/// What a run of the point reports; nothing if it does not end. The trace cannot tell: it also computes what
/// no output needs, and messages between layers do not outlast its calls.
fn reported(
    run: &RunArgs,
    loaded: &LoadedShader,
    point: OnePoint<'_>,
    services: &Services,
    options: passes::Options,
) -> Vec<(Option<Span>, Reported)> {
    let options =
        passes::Options { affine: services.spaces.affine(), without: run.without_pass.clone(), ..options };
    let compiled = stages::finish(loaded.body.clone(), &options);
    let Ok(frame) = osl_exec::run(&compiled.program, services, &point, &session::options(run), &|_| ())
    else {
        return Vec::new();
    };
    let report = Report {
        sources: &loaded.sources,
        format: run.read.message_format,
        points: (1, "points"),
        width: None,
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    frame.messages.iter().flat_map(|said| report.told(said)).collect()
}

/// The pixel whose point is closest to u and v.
fn closest(grid: &Grid, uv: [f32; 2]) -> (usize, usize) {
    let along = |axis: usize, n: usize| {
        let off = |i: &usize| (grid.coordinate(axis, *i, n) - uv[axis]).abs();
        (0..n).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    };
    (along(0, grid.width), along(1, grid.height))
}
