//! `oslrun picture-book FILE.osl -o BOOK.html`: a page that shows the source of a shader, and beside each
//! line a picture of each variable that the line sets.
//!
//! The pictures are taps, all of one run, which `figures` makes from the results. `highlight` colors the
//! source, and `page` writes the page. A run in double precision tells which digits are lost (`lost`), and
//! one without taps how long each line takes.

mod highlight;
mod lost;
mod page;

use super::figures::{self, Pictures, Results};
use super::words::{self, Left};
use crate::cli::options::points::{DataArgs, GridArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::RunningArgs;
use crate::cli::options::shader::ShaderArgs;
use crate::cli::print::Console;
use crate::cli::source::info;
use clap::Args;
use clap::builder::{PathBufValueParser, TypedValueParser};
use osl::stages;
use osl_exec::{Frame, PointSource, Run, RunOptions, Services};
use osl_hir::hir::Program;
use osl_hir::lint::Level;
use osl_ir::passes;
use osl_job::file::output;
use osl_job::picture::setup::{grid, grid_spaces, on_threads, options, services, stopped};
use osl_job::report::messages::{self, Report};
use osl_job::report::profile;
use osl_job::source::data;
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::source::{input, levels, repair};
use osl_job::{Failure, Image, NoSink, Sink};
use osl_lower::taps::{self, Doings, Most};
use osl_numeric::Arithmetic;
use osl_scene::{Grid, WithData};
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::source::SourceMap;
use page::{Book, Line, Warning};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The name of the command.
const NAME: &str = "picture-book";
/// The size of the pictures, and the largest one.
const SIZE: &str = "64x64";
const MAX_SIZE: usize = 128;

/// What the grid means here.
const GRID: &str = "Points of each picture, at most 128x128";

/// What to show.
#[derive(Debug, Args)]
#[command(
    mut_arg("file", |arg| arg.help("The shader: a source").long_help("The shader: a source")),
    mut_arg("grid", |arg| arg.default_value(SIZE).help(GRID).long_help(GRID)),
)]
pub(in crate::cli) struct BookArgs {
    /// The page to write: one file with everything in it.
    #[arg(short, long, required = true, value_name = "BOOK.html", value_parser = PathBufValueParser::new().try_map(page_file))]
    output: Option<PathBuf>,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    running: RunningArgs,
    #[command(flatten)]
    format: FormatArgs,
}

impl BookArgs {
    fn image(&self) -> Image {
        Image {
            shader: self.shader.shader(None),
            points: self.grid.points(),
            provided: self.scene.provided(Some(&self.data)),
            running: self.running.running(),
            ..Image::default()
        }
    }
}

fn page_file(path: PathBuf) -> Result<PathBuf, String> {
    match path.extension().is_some_and(|ending| ending == "html" || ending == "htm") {
        true => Ok(path),
        false => Err("the name must end in .html".to_string()),
    }
}

/// Writes the page. `words` is the command line, which the page repeats.
pub(in crate::cli) fn book(
    args: &BookArgs,
    words: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let run = &args.image();
    let (Some(path), Some(file)) = (&args.output, &run.shader.file) else {
        return Err(Failure::usage(
            "a picture book is a page about a shader: name FILE.osl, and the page with -o",
        ));
    };
    let size = run.points.grid;
    if size.0 > MAX_SIZE || size.1 > MAX_SIZE {
        return Err(Failure::usage(format!(
            "the pictures of a page have at most {MAX_SIZE}x{MAX_SIZE} points"
        )));
    }
    if file.extension().is_none_or(|ending| ending != "osl") {
        return Err(Failure::usage("a picture book shows the source of one shader: FILE.osl"));
    }
    let limits = run.limits();
    let taps = usize::try_from(limits.running.book_pictures).unwrap_or(usize::MAX);
    let most = Most { taps, rounds: figures::ROUNDS, line: None };
    let doings = |program: &Program, sources: &SourceMap| taps::doings(program, (sources, 0), 0, most);
    let all = |program: &Program, sources: &SourceMap| figures::taps(&doings(program, sources));
    let loaded = load::load(&Request { more_taps: Some(&all), ..Request::of(run) }, console)?;
    let doings = doings(&loaded.program, &loaded.sources);
    let main = loaded.sources.files().first();
    let (name, text) = main.map(|main| (main.name.clone(), main.text.to_string())).unwrap_or_default();

    let points = WithData { data: data::read(run, loaded.spoken.as_ref())?, points: grid(run) };
    let services = services(run, loaded.folder.clone(), grid_spaces(run));
    let single = frame(&loaded, Arithmetic::Strict, (run, &services, &points))?;
    output::printed(&single.printed, output::Appends::of(run), console)?;
    let report = Report {
        sources: &loaded.sources,
        points: (points.count() as u64, "points"),
        width: Some(size.0),
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    let shading = report.send(&single.messages, console);
    shading.judge(run.shader.lints.denies_errors())?;
    let double = frame(&loaded, Arithmetic::Double, (run, &services, &points))?;

    let (in_single, in_double) = (Results::of(&single, None), Results::of(&double, None));
    let pictures = Pictures { results: &in_single, size };
    let mut lines = drawn(&pictures, &doings, &in_double);
    for (line, text, is_error) in report.at_lines(&single.messages, &name) {
        lines.entry(line).or_default().warnings.push(Warning { text, is_error });
    }
    warnings(file, run, &mut lines)?;
    costs(run, (&services, &points), &mut lines)?;
    let shader = info::describe(&loaded.program);
    let more = doings.more;
    let cut = || format!("{more} pictures of later lines are left out (--limit running.book_pictures=N)");
    let left_out = (more > 0).then(cut).into_iter().collect();
    let page = page::html(&Book {
        shader: &shader,
        file: &file.display().to_string(),
        given: &run.shader.params,
        text: &text,
        lines,
        size,
        outputs: pictures.outputs(&single, &figures::taps(&doings)),
        tapping: tapping(words, size),
        command: words::typed(words),
        left_out,
    });
    console.settle()?;
    osl_files::replace(path, page.as_bytes()).map_err(Failure::new)?;
    shading.wrote(std::slice::from_ref(path), console.out);
    Ok(())
}

/// The options of the page that the command of a picture does not repeat. It states the size.
const OF_THE_PAGE: Left =
    Left { valued: &["-o", "--output", "-g", "--grid", "--threads", "--message-format"], alone: &[] };

/// The start of the command that makes one of the pictures, which have this size.
fn tapping(words: &[OsString], (width, height): (usize, usize)) -> String {
    let words = words.iter().skip(1).map(|word| word.to_string_lossy().into_owned());
    let mut kept = OF_THE_PAGE.removed(words);
    if let Some(at) = kept.iter().position(|word| word == NAME) {
        kept.remove(at);
    }
    kept.extend(["-g".to_string(), format!("{width}x{height}")]);
    words::line(kept)
}

/// The pictures of each line, and the digits that it loses.
fn drawn(pictures: &Pictures<'_>, doings: &Doings, in_double: &Results<'_>) -> BTreeMap<u32, Line> {
    let figures = pictures.lines(doings).into_iter();
    let mut lines: BTreeMap<u32, Line> =
        figures.map(|(line, figures)| (line, Line { figures, ..Line::default() })).collect();
    for (line, digits) in lost::lines(doings, pictures.results, in_double) {
        lines.entry(line).or_default().lost = digits;
    }
    lines
}

/// Adds what `oslrun check` says to each line.
fn warnings(file: &Path, run: &Image, lines: &mut BTreeMap<u32, Line>) -> Result<(), Failure> {
    let mut input = input::read(file, &run.shader.read)?;
    input.files = input.files.or_anywhere(run.shader.allow_files);
    if run.shader.repair {
        repair::apply(&mut input, None)?;
    }
    let checked = stages::check(&input.name, &input.text, &input.files, &input.options);
    let at = |d: &Diagnostic| {
        let (found, line) = checked.sources.line(d.span)?;
        let is_main = checked.sources.files().first().is_some_and(|main| main.name == found.name);
        is_main.then_some(line)
    };
    for d in levels::judge(&checked, Level::Check, &run.shader.lints, run.limits()) {
        if let Some(line) = at(&d) {
            let (word, is_error) = if d.is_error() { ("error", true) } else { ("warning", false) };
            let text = format!("{word}: {} ({})", d.message, d.code.name);
            lines.entry(line).or_default().warnings.push(Warning { text, is_error });
        }
    }
    Ok(())
}

/// Runs all points.
fn frame(
    loaded: &LoadedShader,
    arithmetic: Arithmetic,
    (run, services, points): (&Image, &Services, &WithData<Grid>),
) -> Result<Frame, Failure> {
    let mut body = loaded.body.clone();
    output::drop_closures(&mut body, None);
    let passes = passes::Options {
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        traces: points.traces(),
        affine: services.spaces.affine(),
        without: run.running.without_pass.clone(),
        arithmetic,
        limits: run.limits().clone(),
        ..passes::Options::default()
    };
    let compiled = stages::finish(body, &passes);
    let keeping = messages::keeping(&loaded.sources);
    let options =
        RunOptions { keeping, profile: loaded.tapped.is_empty().then_some(profile::CLOCK), ..options(run) };
    let job = Run::new(&compiled.program, services, points, &options);
    let result = on_threads(run.running.threads, || job.points(0..points.count(), &|_| ()))?;
    result.map_err(|stop| stopped(&stop, &loaded.sources))
}

/// Adds the share of each line of the time of a run without taps.
fn costs(
    run: &Image,
    (services, points): (&Services, &WithData<Grid>),
    lines: &mut BTreeMap<u32, Line>,
) -> Result<(), Failure> {
    let plain = load::load(&Request::of(run), &mut NoSink)?;
    let frame = frame(&plain, Arithmetic::Strict, (run, services, points))?;
    let total: f64 = frame.profile.iter().map(|entry| entry.own.as_secs_f64()).sum();
    let main = plain.sources.files().first().map(|file| file.name.clone()).unwrap_or_default();
    for entry in &frame.profile {
        if let Some((_, line)) = plain.sources.line(entry.span).filter(|(file, _)| file.name == main) {
            lines.entry(line).or_default().cost += entry.own.as_secs_f64() / total.max(1e-12);
        }
    }
    Ok(())
}
