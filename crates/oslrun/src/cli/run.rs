//! `oslrun FILE -o OUT`: compiles a shader, runs it on the grid, and writes the image.

use super::args::RunArgs;
use super::load::{self, Loaded, Request};
use super::output::{Broken, Rounded, Rows};
use super::sampling::{self, Plan, Sampled};
use super::shading::{self, Report};
use super::{Failure, closures, data, on, output, profile};
use crate::pipeline::{self, Compiled};
use indicatif::{ProgressBar, ProgressStyle};
use osl_exec::{Frame, Isa, PointSource, Program, Run, RunError, RunOptions, Services, Spaces};
use osl_files::Unsaved;
use osl_image::TextureCache;
use osl_ir::numeric::Arithmetic;
use osl_ir::passes;
use osl_measure::explain;
use osl_measure::sample::Shading;
use osl_scene::{Grid, WithData, set_screen_spaces};
use osl_syntax::source::SourceMap;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Runs a shader.
pub(super) fn run(args: &RunArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let started = Instant::now();
    let plan = args.sampling.plan()?;
    if args.closures && plan != Plan::Plain {
        return Err(Failure::new("--closures wants one sample for each pixel"));
    }
    let request = Request::of(args);
    let loaded = load::load(&request, err)?;
    if args.on.on.is_some() {
        if args.sampling.is_given() {
            return Err(Failure::new("samples and filters are for the grid, not for --on"));
        }
        return on::run(args, &loaded, started, out, err);
    }
    let Loaded { sources, mut body, name, folder, texts, .. } = loaded;
    let points = WithData {
        data: data::read(&args.userdata, args.attributes.as_deref(), args.read.limits.limits())?,
        points: grid(args),
    };
    let outputs = args.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
    let options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        slopes: points.varying_slopes().to_vec(),
        traces: points.traces(),
        without: args.without_pass.clone(),
        arithmetic: args.arithmetic.unwrap_or_default(),
        prefilter: args.sampling.prefilter(plan),
        limits: args.read.limits.limits().clone(),
    };
    if !args.closures {
        output::drop_closures(&mut body, options.outputs.as_deref());
    }
    let lowered = body.count();
    let offers = args.arithmetic.is_none() && matches!(plan, Plan::MaxError(..));
    let whole = (args.stats || offers).then(|| body.clone());
    let compiled = pipeline::finish(body, &options);
    let cheaper = whole.as_ref().filter(|_| offers && compiled.body.is_cheaper_in_fast()).map(|body| {
        let arithmetic = Arithmetic::Fast;
        pipeline::finish(body.clone(), &passes::Options { arithmetic, ..options.clone() }).program
    });
    let compile_time = started.elapsed();

    let services = services(args, folder, grid_spaces(args));
    // A material without other outputs writes its closures to the image.
    let alone = plan == Plan::Plain && !args.closures && output::only_closures(&compiled.body);
    let closures = args.closures || alone;
    let programs = Programs { usual: &compiled.program, cheaper: cheaper.as_ref() };
    let shaded = shade(programs, &services, &points, (plan, closures), args, &sources)?;
    let Shaded { mut frame, run, write, file, rounded, said } = shaded;
    output::printed(&frame.printed, args.allow_files, out)?;
    if closures {
        if args.closures || args.output.is_none() {
            closures::show(&frame, args.grid.0, out);
        }
        closures::layers(&mut frame);
    }
    if alone && args.output.is_some() {
        let _ = writeln!(err, "note: {}", output::CLOSURES_ALONE);
    }
    let evaluations = said.as_ref().map_or(points.count() as u64, |said| said.tally.evaluations);
    let report = Report {
        sources: &sources,
        format: args.read.message_format,
        points: (evaluations, if said.is_some() { "samples" } else { "points" }),
        width: Some(args.grid.0),
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &texts,
    };
    let shading = report.print(&frame.messages, err);
    shading.judge(args.lints.denies_errors())?;
    rounded.warn(args, err);

    super::flushed(out)?;
    let started = Instant::now();
    let written = match (&args.output, file) {
        (Some(path), None) => output::write(&frame, path, args)?,
        (Some(path), Some(file)) => {
            file.save().map_err(Failure::new)?;
            vec![path.clone()]
        }
        (None, _) => Vec::new(),
    };
    let write = write + started.elapsed();
    if args.output.is_none() && !args.stats && args.profile.is_none() {
        summary(&frame, out);
    }
    if args.stats {
        let times = [compile_time, run, write];
        stats(&compiled, lowered, evaluations, times, args, err);
        if let Some(whole) = &whole {
            let _ = err.write_all(explain::table(&explain::cost(whole, &options)).as_bytes());
        }
    }
    if let Some(said) = said {
        let _ = if args.stats { write!(err, "{}", said.text) } else { write!(out, "{}", said.text) };
    }
    if let Some(path) = &args.profile {
        profile::print(&frame.profile, &sources, err);
        if let Some(path) = path {
            profile::write(&frame.profile, &name, &sources, path)?;
            let _ = writeln!(out, "wrote {}", path.display());
        }
    }
    shading.wrote(&written, out);
    Ok(())
}

pub(super) fn grid(args: &RunArgs) -> Grid {
    Grid {
        width: args.grid.0,
        height: args.grid.1,
        scale: args.uv_scale.0,
        offset: args.uv_offset.0,
        center: args.center,
    }
}

/// The spaces of a grid: the spaces of the image can only be the target of a transformation.
pub(super) fn grid_spaces(args: &RunArgs) -> Spaces {
    let mut spaces = Spaces::default();
    set_screen_spaces(&mut spaces, args.grid.0, args.grid.1);
    spaces
}

/// The services of the renderer. Spaces from the command line take precedence over those of the scene.
pub(super) fn services(args: &RunArgs, folder: PathBuf, mut spaces: Spaces) -> Services {
    for (name, matrix) in [("shader", &args.shader_space), ("object", &args.object_space)] {
        if let Some(matrix) = matrix {
            spaces.set(name, **matrix);
        }
    }
    let mut folders = vec![folder];
    folders.extend(args.texture_path.iter().cloned());
    let mut limits = args.read.limits.limits().clone();
    if let Some(mebibytes) = args.texture_memory {
        limits.images.texture_memory = mebibytes.saturating_mul(1 << 20);
    }
    let textures = TextureCache::within(folders, &limits).allow_files(args.allow_files);
    Services { ray: args.raytype.clone(), spaces, textures, ..Services::default() }
}

/// A frame, the times of running and writing it, and its file if it is written already, but not yet moved
/// into place.
struct Shaded {
    frame: Frame,
    run: Duration,
    write: Duration,
    file: Option<Unsaved>,
    rounded: Rounded,
    /// The report on samples.
    said: Option<sampling::Said>,
}

/// The shader in the requested arithmetic, and in another one that may be used if an error is permitted.
#[derive(Clone, Copy)]
struct Programs<'a> {
    usual: &'a Program,
    cheaper: Option<&'a Program>,
}

/// Runs all points. An EXR file is written during the run.
fn shade(
    programs: Programs<'_>,
    services: &Services,
    points: &WithData<Grid>,
    (plan, closures): (Plan, bool),
    args: &RunArgs,
    sources: &SourceMap,
) -> Result<Shaded, Failure> {
    let options = RunOptions { keeping: shading::keeping(sources), closures, ..options(args) };
    let bar = progress(points.count());
    let tick = |done: usize| bar.set_position(done as u64);
    let run = Run::new(programs.usual, services, points, &options);
    let work = || {
        let mut plain = output::Points { run: &run, width: args.grid.0, progress: &tick };
        if plan == Plan::Plain {
            return computed(&mut plain, closures, args);
        }
        let cheaper = programs.cheaper;
        let shading =
            Shading { cheaper, ..sampling::shading(programs.usual, services, points, &options, plan) };
        let mut sampled = Sampled::new(&shading, plan, args.stats, &tick);
        let shaded = computed(&mut sampled, closures, args)?;
        let said = sampled.said().map_err(Broken::Run)?;
        Ok(Shaded { said: Some(said), ..shaded })
    };
    let result = on_threads(args, work)?;
    bar.finish_and_clear();
    result.map_err(|broken| match broken {
        Broken::Image(error) => Failure::new(error),
        Broken::Run(stop) => stopped(&stop, sources),
        Broken::Empty => Failure::new(output::EMPTY),
    })
}

/// The run options of the command line.
pub(super) fn options(args: &RunArgs) -> RunOptions {
    let mut limits = args.read.limits.limits().clone();
    if let Some(steps) = args.max_steps {
        limits.running.point_steps = steps;
    }
    RunOptions {
        limits,
        batch: args.batch.map(|n| n as usize),
        isa: args.isa.unwrap_or_else(Isa::detect),
        closures: args.closures,
        profile: args.profile.is_some(),
        ..RunOptions::default()
    }
}

/// Runs the work on the requested number of threads.
pub(super) fn on_threads<T: Send>(args: &RunArgs, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let Some(threads) = args.threads else { return Ok(work()) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build();
    let pool = pool.map_err(|e| Failure::new(format!("cannot start {threads} threads: {e}")))?;
    Ok(pool.install(work))
}

/// Computes an image, and writes it to its file if it is written piece by piece.
fn computed(image: &mut (dyn Rows + Send), closures: bool, args: &RunArgs) -> Result<Shaded, Broken> {
    let started = Instant::now();
    match &args.output {
        Some(path) if !closures && output::streams(args) => {
            let (frame, run, file, rounded) = output::stream(image, path, args)?;
            let write = started.elapsed().saturating_sub(run);
            Ok(Shaded { frame, run, write, file: Some(file), rounded, said: None })
        }
        _ => {
            let frame = output::whole(image, args)?;
            let mut rounded = Rounded::default();
            rounded.count(&frame.planes, args);
            Ok(Shaded {
                frame,
                run: started.elapsed(),
                write: Duration::ZERO,
                file: None,
                rounded,
                said: None,
            })
        }
    }
}

/// The message for a run that stopped early.
pub(super) fn stopped(stop: &RunError, sources: &SourceMap) -> Failure {
    let (span, hint) = match stop {
        RunError::TooManySteps { span, .. } => (*span, "; --max-steps sets the limit".to_string()),
        RunError::TooMuchMemory { span, .. } => {
            (*span, "; --limit running.point_memory=N sets the limit".to_string())
        }
        RunError::TooMuch { limit, .. } => (None, format!("; --limit {limit}=N sets the limit")),
        RunError::Halted(_) | RunError::VariesMore(_) | RunError::SlopesVaryMore(_) | RunError::Traces => {
            (None, String::new())
        }
    };
    let place = span
        .and_then(|span| sources.place(span))
        .map_or_else(String::new, |p| format!("{}:{}: ", p.file, p.line));
    Failure::new(format!("{place}{stop}{hint}"))
}

/// A progress bar on a terminal, for longer runs; nothing in logs.
fn progress(points: usize) -> ProgressBar {
    if points < 1 << 20 || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(points as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent:>3}% {per_sec} {eta}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// The summary of a run without an image: the range of each output, so that a first run shows something.
pub(super) fn summary(frame: &Frame, out: &mut dyn Write) {
    for plane in &frame.planes {
        let values = plane.floats();
        let (low, high) =
            values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len().max(1) as f64;
        let _ = writeln!(out, "{}[{}]: {low} to {high}, mean {mean:.6}", plane.output, plane.component);
    }
    let _ = writeln!(out, "(no image written: name one with -o)");
}

/// Times, rates, and what each pass did.
pub(super) fn stats(
    compiled: &Compiled,
    lowered: usize,
    points: u64,
    times: [Duration; 3],
    args: &RunArgs,
    err: &mut dyn Write,
) {
    let [compile, run, write] = times.map(|t| t.as_secs_f64() * 1e3);
    let isa = args.isa.unwrap_or_else(Isa::detect);
    let (registers, words) = compiled.program.register_words();
    let _ = writeln!(err, "compile {compile:.2} ms, run {run:.2} ms, write {write:.2} ms");
    let rate = points as f64 / (run / 1e3).max(1e-9);
    let per_point = run * 1e6 / points.max(1) as f64;
    let _ = writeln!(
        err,
        "{points} points, {rate:.0} points/s, {per_point:.1} ns/point ({isa:?}, batches of {})",
        args.batch.map_or_else(|| compiled.program.batch(), |n| n as usize)
    );
    if let Some(peak) = peak_memory() {
        let _ = writeln!(err, "peak memory {:.0} MB", peak as f64 / 1e6);
    }
    let _ =
        writeln!(err, "{lowered} instructions lowered, {registers} lane registers of {words} words in all");
    for report in &compiled.reports {
        let _ = writeln!(err, "  {:<8} {:>6} -> {}", report.pass.name(), report.before, report.after);
    }
}

/// The peak memory of the process in bytes, if the system provides it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
