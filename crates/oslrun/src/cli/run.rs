//! `oslrun FILE -o OUT`: compiles a shader, runs it on the grid, and writes the image.

use super::args::RunArgs;
use super::load::{self, LoadedShader, MoreTaps, Request};
use super::output::{Broken, RunRequest, Tallied};
use super::prefilter;
use super::preview::{self, PreviewArgs};
use super::ranges::summary;
use super::reads::Reads;
use super::rows::{Points, Rows};
use super::said::Said;
use super::sampling::{self, Plan, Sampled, Target};
use super::session::{grid_spaces, on_threads, options, points, progress, services, stopped};
use super::shading::{self, Report};
use super::streams::{First, Kept, Streams};
use super::summary::{About, Stats};
use super::within::InTime;
use super::{Failure, data, histogram, on, output, profile, session};
use osl::stages;
use osl_exec::{Frame, PointSource, Program, Run, RunOptions, Services};
use osl_files::Unsaved;
use osl_ir::passes;
use osl_measure::explain;
use osl_measure::sample::{Guard, Shading};
use osl_numeric::Arithmetic;
use osl_scene::{Crop, WithData};
use osl_syntax::source::SourceMap;
use std::io::Write;
use std::time::{Duration, Instant};

/// Runs a shader that writes no picture, and returns its values.
pub(super) fn values(
    args: &RunArgs,
    reads: Option<&mut Reads>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<Kept, Failure> {
    kept(args, &PreviewArgs::default(), reads, out, err)
}

/// The same for a run that may be a preview.
pub(super) fn kept(
    args: &RunArgs,
    lit: &PreviewArgs,
    reads: Option<&mut Reads>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<Kept, Failure> {
    kept_with(args, lit, reads, (None, None), (out, err))
}

/// Runs a shader that writes no picture on a smaller grid first, and returns the values of the whole one.
pub(super) fn values_after(
    first: Option<First<'_>>,
    args: &RunArgs,
    reads: &mut Reads,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<Kept, Failure> {
    kept_with(args, &PreviewArgs::default(), Some(reads), (None, first), (out, err))
}

/// Runs a shader that writes no picture with the taps that a function makes, and returns its values.
pub(super) fn tapped(
    args: &RunArgs,
    more_taps: &MoreTaps<'_>,
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<Kept, Failure> {
    kept_with(args, &PreviewArgs::default(), None, (Some(more_taps), None), (out, err))
}

fn kept_with(
    args: &RunArgs,
    lit: &PreviewArgs,
    reads: Option<&mut Reads>,
    (more_taps, first): (Option<&MoreTaps<'_>>, Option<First<'_>>),
    (out, err): (&mut dyn Write, &mut dyn Write),
) -> Result<Kept, Failure> {
    let mut kept = Kept::default();
    let mut picture = std::io::sink();
    let picture = &mut picture;
    let streams = &mut Streams { out, err, picture, kept: Some(&mut kept), first, reads, more_taps };
    run(args, lit, None, streams)?;
    Ok(kept)
}

/// Runs a shader once.
pub(super) fn run(
    args: &RunArgs,
    lit: &PreviewArgs,
    mut about: Option<&mut About>,
    streams: &mut Streams<'_>,
) -> Result<(), Failure> {
    let Streams { out, err, picture, kept, first, reads, more_taps } = streams;
    let started = Instant::now();
    let plan = args.sampling.plan()?;
    if args.closures && plan != Plan::Plain {
        return Err(Failure::usage("--closures wants one sample for each pixel"));
    }
    cropped(args, plan, lit.preview)?;
    let request = Request { more_taps: *more_taps, ..Request::of(args) };
    let loaded = load::load(&request, err)?;
    if let Some(reads) = reads {
        let services = services(args, loaded.folder.clone(), grid_spaces(args));
        reads.sources(&loaded.sources);
        reads.textures(&services.textures, loaded.texts.iter().map(|(_, text)| &**text));
    }
    if lit.preview {
        return preview::run((args, lit), loaded, started, about, streams);
    }
    if args.on.on.is_some() {
        return on::run(args, &loaded, started, about, streams);
    }
    let outputs = loaded.outputs(args);
    let LoadedShader { sources, mut body, name, folder, texts, tapped: taps, .. } = loaded;
    let points = WithData { data: data::read(args)?, points: points(args) };
    let services = services(args, folder.clone(), grid_spaces(args));
    let mut options = passes::Options {
        outputs,
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        traces: points.traces(),
        affine: services.spaces.affine(),
        without: args.without_pass.clone(),
        arithmetic: args.arithmetic.unwrap_or_default(),
        prefilter: None,
        limits: args.read.limits.limits().clone(),
    };
    let tapped = output::has_closure(&body, &taps);
    if tapped && plan != Plan::Plain {
        return Err(Failure::new("a tap of a closure wants one sample for each pixel"));
    }
    if !args.closures && !tapped {
        output::drop_closures(&mut body, options.outputs.as_deref());
    }
    let lowered = body.count();
    let filtered = match args.sampling.prefilter(plan) {
        Some(samples) => {
            let of = (samples, plan.filter(), plan == Plan::Plain && !args.closures && !tapped);
            let (chosen, said) =
                prefilter::of_run(args, of, (&body, &options), (&services, &points), &sources)?;
            options.prefilter = chosen;
            Some(said)
        }
        None => None,
    };
    let ranges = filtered.as_ref().and_then(|said| said.guard.as_deref());
    let plain = ranges.map(|_| {
        stages::finish(body.clone(), &passes::Options { prefilter: None, ..options.clone() }).program
    });
    let guard = plain.as_ref().zip(ranges).map(|(plain, ranges)| Guard { plain, ranges });
    let offers = args.arithmetic.is_none() && matches!(plan, Plan::MaxError(..));
    let whole = (args.stats || offers).then(|| body.clone());
    let compiled = stages::finish(body, &options);
    let cheaper = whole.as_ref().filter(|_| offers && compiled.body.is_cheaper_in_fast()).map(|body| {
        let arithmetic = Arithmetic::Fast;
        stages::finish(body.clone(), &passes::Options { arithmetic, ..options.clone() }).program
    });
    let compile_time = started.elapsed();

    // A material without other outputs writes its closures to the image.
    let alone = !args.closures && output::only_closures(&compiled.body);
    let is_shown = args.output.is_none()
        && !args.stats
        && !args.histogram
        && args.profile.is_none()
        && about.is_none()
        && kept.is_none();
    let is_told = args.output.is_none() && kept.is_none() && plan == Plan::Plain;
    let closures = args.closures || is_told && (alone || tapped);
    let values = closures || args.histogram || kept.is_some();
    let wanted = RunRequest { closures, ranges: is_shown || about.is_some(), values };
    let programs = Programs { usual: &compiled.program, cheaper: cheaper.as_ref(), guard };
    if let Some(First { grid, show }) = first {
        let args = RunArgs { grid: *grid, ..args.clone() };
        let textures = services.textures.clone();
        let services = Services { textures, ..session::services(&args, folder, grid_spaces(&args)) };
        let points = WithData { data: points.data.clone(), points: session::points(&args) };
        // One sample for each pixel is enough. If it fails, the whole grid says why.
        let plan = (Plan::Plain, RunRequest { closures, ranges: false, values: true }, started);
        if let Ok(shaded) = shade(programs, &services, &points, plan, &args, &sources) {
            show(Kept { frame: shaded.frame, times: [compile_time, shaded.run], ..Kept::default() });
        }
    }
    let shaded = shade(programs, &services, &points, (plan, wanted, started), args, &sources)?;
    let again = || {
        let again = RunArgs { output: None, ..args.clone() };
        let wanted = RunRequest { closures, ranges: false, values: true };
        shade(programs, &services, &points, (plan, wanted, Instant::now()), &again, &sources)
    };
    let Shaded { frame, run, write, file, tallied, said } = shaded;
    if let Some(reads) = reads {
        reads.textures(&services.textures, []);
    }
    output::printed(&frame.printed, output::Appends::of(args), out)?;
    if closures {
        tallied.closures.show(args.size().0, args.part().map_or((0, 0), |part| part.first), out);
    }
    if alone && args.output.is_some() {
        let note = if tallied.shows { output::CLOSURES_ALONE } else { output::CLOSURES_NULL };
        let _ = writeln!(err, "note: {note}");
    }
    let rounds = match &args.profile {
        Some(_) => profile::rounds(&frame.profile, || again().map(|shaded| shaded.frame.profile))?,
        None => Vec::new(),
    };
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
    tallied.warn(args, err);

    super::flushed(out)?;
    let started = Instant::now();
    let written = match (&args.output, file) {
        (Some(path), None) => output::write(&frame, None, path, args)?.save(path, picture, err)?,
        (Some(path), Some(file)) => {
            file.save().map_err(Failure::new)?;
            vec![path.clone()]
        }
        (None, _) => Vec::new(),
    };
    let write = write + started.elapsed();
    let histograms = args.histogram.then(|| histogram::of(&frame.planes, None));
    if is_shown {
        summary(&tallied.ranges, out);
    }
    let stats = args.stats.then(|| {
        let times = [compile_time, run, write];
        let mut stats = Stats::of(&compiled, lowered, evaluations, times, args);
        stats.prefilter = filtered.map(|filtered| filtered.sentence());
        stats
    });
    if let Some(about) = &mut about {
        about.ran(&tallied.ranges, &written, shading);
        about.stats = stats;
        about.histograms = histograms;
        about.max_error = said.as_ref().and_then(|said| said.max_error.clone());
        about.within = said.as_ref().and_then(|said| said.within);
        if args.profile.is_some() {
            about.profile = Some(profile::tables(&rounds, &sources));
        }
    } else {
        histogram::print(&histograms.unwrap_or_default(), out);
        if let Some(stats) = &stats {
            stats.print(err);
            if let Some(whole) = &whole {
                let _ = err.write_all(explain::table(&explain::cost(whole, &options)).as_bytes());
            }
        }
    }
    let missed = said.as_ref().is_some_and(|said| said.print(args, out, err));
    if let Some(path) = &args.profile {
        if about.is_none() {
            profile::print(&rounds, &sources, out);
        }
        if let Some(path) = path {
            profile::write(&rounds, &name, &sources, path)?;
            let _ = writeln!(out, "wrote {}", path.display());
        }
    }
    // A page shows the messages themselves, and what the shader prints.
    if about.is_none() && args.live.is_none() {
        shading.wrote(&written, out);
    }
    match kept {
        Some(kept) => {
            kept.frame = frame;
            kept.missed = missed;
            kept.said = said;
            kept.times = [compile_time, run];
        }
        None if missed => return Err(Failure::missed()),
        None => {}
    }
    Ok(())
}

/// Fails if a part of the picture cannot be computed alone, or is not in the picture.
fn cropped(args: &RunArgs, plan: Plan, is_lit: bool) -> Result<(), Failure> {
    let Some(crop) = &args.crop else { return Ok(()) };
    crop.check(args.grid).map_err(Failure::usage)?;
    if is_lit {
        return Ok(());
    }
    if args.on.on.is_some() {
        return Err(Failure::usage("--crop is for the grid, not for --on"));
    }
    match plan {
        Plan::Plain | Plan::Samples(..) | Plan::Within(..) => Ok(()),
        Plan::Rate(_) | Plan::Adaptive(..) | Plan::MaxError(..) => Err(Failure::usage(
            "--crop goes with --samples and --filter only: --shading-rate, --adaptive and --max-error compute a pixel \
             from others, so that a part would have other values than the whole picture",
        )),
    }
}

/// A frame, the times of running and writing it, and its file if it is written already, but not yet moved
/// into place.
struct Shaded {
    frame: Frame,
    run: Duration,
    write: Duration,
    file: Option<Unsaved>,
    tallied: Tallied,
    /// The report on samples.
    said: Option<Said>,
}

/// The shader in the requested arithmetic, and in another one that may be used if an error is permitted.
#[derive(Clone, Copy)]
struct Programs<'a> {
    usual: &'a Program,
    cheaper: Option<&'a Program>,
    /// Where pixels are filtered, if that is decided for each.
    guard: Option<Guard<'a>>,
}

/// Runs all points. An EXR file is written during the run.
fn shade(
    programs: Programs<'_>,
    services: &Services,
    points: &WithData<Crop>,
    (plan, wanted, began): (Plan, RunRequest, Instant),
    args: &RunArgs,
    sources: &SourceMap,
) -> Result<Shaded, Failure> {
    let options =
        RunOptions { keeping: shading::keeping(sources), closures: wanted.closures, ..options(args) };
    let bar = progress(points.count() as u64, "points");
    let tick = |done: usize| bar.at(done as u64);
    let run = Run::new(programs.usual, services, points, &options);
    let is_plain = plan == Plan::Plain;
    let shading = (!is_plain || programs.guard.is_some()).then(|| {
        let shading = sampling::shading(programs.usual, services, points, &options, plan);
        Shading { cheaper: programs.cheaper, guard: programs.guard, ..shading }
    });
    let target = match &shading {
        Some(shading) => {
            let target = on_threads(args.threads, || Target::of(shading, &args.sampling))?;
            target.map_err(|stop| stopped(&stop, sources))??
        }
        None => Target::default(),
    };
    let work = || {
        let Some(shading) = &shading else {
            let mut plain = Points { run: &run, width: args.size().0, progress: &tick };
            return computed(&mut plain, wanted, args);
        };
        if let Plan::Within(time, ..) = plan {
            let clock = || began.elapsed().as_secs_f64();
            let share = |share: f64| tick((share.clamp(0.0, 1.0) * points.count() as f64) as usize);
            let mut image = InTime::new(shading, time, &clock, &share);
            let shaded = computed(&mut image, wanted, args)?;
            return Ok(Shaded { said: Some(image.said()), ..shaded });
        }
        let sampled = Sampled::new(shading, (plan, &target), args.stats && !is_plain, &tick);
        let mut sampled = sampled.keeping(args.live.is_some());
        let shaded = computed(&mut sampled, wanted, args)?;
        let said = sampled.said().map_err(Broken::Run)?;
        // One sample in each pixel is worth a report only if somebody asks for it.
        Ok(Shaded { said: (!is_plain || args.stats).then_some(said), ..shaded })
    };
    let result = on_threads(args.threads, work)?;
    bar.done();
    result.map_err(|broken| match broken {
        Broken::Image(error) => Failure::new(error),
        Broken::Run(stop) => stopped(&stop, sources),
        Broken::Empty => Failure::new(output::EMPTY),
    })
}

/// Computes an image, and writes it to its file if it is written piece by piece.
fn computed(image: &mut (dyn Rows + Send), wanted: RunRequest, args: &RunArgs) -> Result<Shaded, Broken> {
    let started = Instant::now();
    match &args.output {
        // A histogram needs all values.
        Some(path) if !args.histogram && output::streams(args) => {
            let (frame, run, file, tallied) = output::stream(image, path, wanted, args)?;
            let write = started.elapsed().saturating_sub(run);
            Ok(Shaded { frame, run, write, file: Some(file), tallied, said: None })
        }
        path => {
            if path.is_none()
                && !wanted.values
                && let Some((frame, tallied)) = output::only_ranges(image, wanted, args)?
            {
                let (run, write) = (started.elapsed(), Duration::ZERO);
                return Ok(Shaded { frame, run, write, file: None, tallied, said: None });
            }
            let mut tallied = Tallied::default();
            let frame = output::whole(image, wanted, args, &mut tallied)?;
            let run = started.elapsed();
            // A page counts what it shows itself.
            if args.live.is_none() {
                tallied.count(&frame.planes, wanted, args);
            }
            Ok(Shaded { frame, run, write: Duration::ZERO, file: None, tallied, said: None })
        }
    }
}
