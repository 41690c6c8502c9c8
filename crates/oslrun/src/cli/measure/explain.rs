//! `oslrun explain FILE --at X,Y`: shows what a shader does at one point; `--cost`: what each output costs.

use crate::cli::options::points::{OnArgs, Pair, PatchArgs, both};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::shader::SubjectArgs;
use crate::cli::print::{Console, json};
use clap::Args;
use osl::stages;
use osl::stages::SourceMap;
use osl_exec::{PointSource, Services};
use osl_ir::Span;
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_job::picture::setup::{self, grid, grid_spaces, services, spaces};
use osl_job::picture::sight;
use osl_job::report::messages::Report;
use osl_job::source::data;
use osl_job::source::load::{self, LoadedShader, Request, TextureFiles};
use osl_job::{Failure, Image, Sink};
use osl_measure::explain::text::{self, Style};
use osl_measure::explain::{self, Explanation, Reported, Selection, Subject, cost};
use osl_measure::trace::{self, OnePoint};
use osl_scene::{Grid, WithData};

/// What to explain.
#[derive(Debug, Args)]
pub(in crate::cli) struct ExplainArgs {
    /// The pixel: column and row, from 0; row 0 has the smallest v, or with --on is the top of the picture.
    #[arg(long, value_name = "X,Y", value_parser = pixel, allow_hyphen_values = true, conflicts_with = "uv")]
    at: Option<(usize, usize)>,
    /// The point of the patch that is closest to this u and v.
    #[arg(long, value_name = "U,V", value_parser = both, allow_hyphen_values = true)]
    uv: Option<Pair>,
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
    #[command(flatten)]
    subject: SubjectArgs,
    #[command(flatten)]
    patch: PatchArgs,
    #[command(flatten)]
    on: OnArgs,
    #[command(flatten)]
    format: FormatArgs,
}

impl ExplainArgs {
    fn image(&self) -> Image {
        let mut image = self.patch.image(self.subject.shader());
        image.points.surface = self.on.surface();
        image
    }

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
pub(in crate::cli) fn explain(args: &ExplainArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let image = &args.image();
    let (loaded, noted) = load::load_noted(&Request::of(image), console)?;
    if args.cost {
        let affine = spaces(image, grid_spaces(image)).affine();
        let options = passes::Options { affine, ..options(image, &grid(image)) };
        let mut costs = cost(&loaded.body, &options);
        let lines = explain::line_costs(&loaded.body, &options, &loaded.sources);
        let text = match (args.json, costs.get_mut(1)) {
            (true, Some(all)) => {
                all.lines = lines;
                json::pretty(&costs)?
            }
            _ => format!("{}\n{}", explain::table(&costs), explain::ranking(&lines)),
        };
        console.report(&text);
        return Ok(());
    }
    let wanted = Point { at: args.at, uv: args.uv, derivatives: args.derivatives, part: &args.part() };
    let Some((explanation, place)) = found(image, (&loaded, noted), &wanted, console)? else {
        return Ok(());
    };
    if args.json {
        return console.object(&explanation);
    }
    console.report(&text::text(&explanation, &place, Style { exact: args.f64, all: args.all }));
    Ok(())
}

/// The explanation of a pixel as JSON, as the command prints it without further options.
pub(in crate::cli) fn pixel_json(
    image: &Image,
    at: (usize, usize),
    sink: &mut dyn Sink,
) -> Result<String, Failure> {
    let (loaded, noted) = load::load_noted(&Request::of(image), sink)?;
    let wanted = Point { at: Some(at), uv: None, derivatives: false, part: &Selection::default() };
    match found(image, (&loaded, noted), &wanted, sink)? {
        Some((explanation, _)) => json::pretty(&explanation),
        None => Err(Failure::new("there is no such point")),
    }
}

/// The explanation of a pixel of the patch, of a body with notes that was lowered from these sources.
pub(in crate::cli) fn of_body(
    image: &Image,
    noted: Body,
    sources: &SourceMap,
    (x, y): (usize, usize),
) -> Option<Explanation> {
    let points = grid(image);
    let options = options(image, &points);
    let (width, height) = image.points.grid;
    let point = OnePoint::at_pixel(&points, width, height, x, y)?;
    let point = OnePoint { source: &points, point };
    let folder = image.shader.file.as_deref()?.parent()?.to_path_buf();
    let services = services(image, TextureFiles { folder, typed: Vec::new() }, grid_spaces(image));
    let subject = Subject::new(noted, &options, sources);
    let trace = trace::follow(&subject.body, &services, point, &options.limits);
    Some(explain::explain(&trace, &subject, sources))
}

/// The point to explain, and what of it.
struct Point<'a> {
    /// Column and row.
    at: Option<(usize, usize)>,
    /// The place on the patch.
    uv: Option<Pair>,
    /// Whether derivatives are explained.
    derivatives: bool,
    /// What is shown.
    part: &'a Selection,
}

/// The explanation of the point at a pixel, closest to a place of the patch, or in the middle; and its place
/// in words.
fn found(
    image: &Image,
    (loaded, noted): (&LoadedShader, Body),
    wanted: &Point<'_>,
    sink: &dyn Sink,
) -> Result<Option<(Explanation, String)>, Failure> {
    let (at, uv) = (wanted.at, wanted.uv);
    let told = |point: OnePoint<'_>, services: &Services, place: String| {
        let explanation = told(image, (loaded, noted), point, services, wanted)?;
        Ok(Some((explanation, place)))
    };
    if image.points.surface.on.is_some() {
        if uv.is_some() {
            return Err(Failure::usage("--uv is for the patch; with --on, --at X,Y chooses a pixel"));
        }
        let (points, pixels, services) = sight::points(image, loaded, sink)?;
        let (width, height) = image.points.grid;
        let (x, y) = at.unwrap_or((width / 2, height / 2));
        inside((x, y), image.points.grid)?;
        let pixel = u32::try_from(y * width + x).unwrap_or(u32::MAX);
        let Some(point) = pixels.iter().position(|known| *known == pixel) else {
            return Err(Failure::new(format!("the pixel ({x}, {y}) does not show the surface")));
        };
        let place = format!(
            "pixel ({x}, {y}) of {width} by {height} on {}",
            image.points.surface.on.as_deref().unwrap_or_default()
        );
        return told(OnePoint { source: &points, point }, &services, place);
    }
    let grid = grid(image);
    let (x, y) = match (at, uv) {
        (Some(at), _) => at,
        (None, Some(uv)) => closest(&grid, uv.0),
        (None, None) => (grid.width / 2, grid.height / 2),
    };
    inside((x, y), image.points.grid)?;
    let place = format!("pixel ({x}, {y}) of {} by {}", grid.width, grid.height);
    let (width, height) = (grid.width, grid.height);
    let data = data::read(image, loaded.spoken.as_ref())?;
    let points = WithData { points: grid, data };
    let Some(point) = OnePoint::at_pixel(&points, width, height, x, y) else { return Ok(None) };
    let services = services(image, loaded.folder.clone(), grid_spaces(image));
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

fn options(image: &Image, points: &dyn PointSource) -> passes::Options {
    passes::Options {
        outputs: image.shader.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect()),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: image.limits().clone(),
        ..passes::Options::default()
    }
}

/// Follows the point.
fn told(
    image: &Image,
    (loaded, noted): (&LoadedShader, Body),
    point: OnePoint<'_>,
    services: &Services,
    wanted: &Point<'_>,
) -> Result<Explanation, Failure> {
    let options = options(image, point.source);
    let subject = Subject::new(noted, &options, &loaded.sources);
    let trace = trace::follow(&subject.body, services, point, &options.limits);
    let mut explanation = explain::explain(&trace, &subject, &loaded.sources);
    if wanted.derivatives {
        let with_derivs = load::load_with_derivs(&Request::of(image))?;
        let with_derivs = Subject::new(with_derivs, &options, &loaded.sources);
        let with = trace::follow(&with_derivs.body, services, point, &options.limits);
        explain::derivatives(&mut explanation, (&trace, &subject), &with, point, &loaded.sources);
    }
    explanation.report(reported(image, loaded, point, services, options), &loaded.sources);
    explanation.narrow(wanted.part).map_err(Failure::new)?;
    Ok(explanation)
}

/// What a run of the point reports; nothing if it does not end. The trace cannot tell: it also computes what
/// no output needs, and messages between layers do not outlast its calls.
fn reported(
    image: &Image,
    loaded: &LoadedShader,
    point: OnePoint<'_>,
    services: &Services,
    options: passes::Options,
) -> Vec<(Option<Span>, Reported)> {
    let options = passes::Options {
        affine: services.spaces.affine(),
        without: image.running.without_pass.clone(),
        ..options
    };
    let compiled = stages::finish(loaded.body.clone(), &options);
    let Ok(frame) = osl_exec::run(&compiled.program, services, &point, &setup::options(image), &|_| ())
    else {
        return Vec::new();
    };
    let report = Report {
        sources: &loaded.sources,
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
