//! Shades the points of the grid: compiles the shader, runs it with the samples that are asked for, and
//! writes the file. An EXR file is written while the picture is computed.

use super::sampling::{self, Plan, Sampled, Target};
use super::setup::{self, grid_spaces, on_threads, options, points, services, stopped};
use super::within::InTime;
use super::{Done, First};
use crate::event::Meters;
use crate::file::output::{self, Broken, RunRequest, Tallied};
use crate::file::rows::{Points, Rows};
use crate::report::messages::{self, Report};
use crate::report::profile;
use crate::report::samples::Samples;
use crate::report::stats::{Stats, filtered};
use crate::source::data;
use crate::source::load::{LoadedShader, TextureFiles};
use crate::source::reads::Reads;
use crate::{Failure, Image, Sink};
use osl::stages::{self, Compiled};
use osl_exec::{Frame, PointSource, Program, Run, RunOptions, Services};
use osl_files::Unsaved;
use osl_ir::ir::{Body, Input};
use osl_ir::passes;
use osl_measure::explain;
use osl_measure::sample::Shading;
use osl_numeric::Arithmetic;
use osl_scene::{Crop, WithData};
use osl_syntax::source::SourceMap;
use std::any::Any;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How a run of the grid begins.
pub(super) struct Start<'a> {
    pub(super) plan: Plan,
    /// When the request began.
    pub(super) started: Instant,
    pub(super) first: Option<First<'a>>,
    pub(super) reads: Option<&'a mut Reads>,
}

/// The compiled forms of a shader.
struct Forms {
    usual: Compiled,
    /// In cheaper arithmetic, if an error is permitted and it pays.
    cheaper: Option<Program>,
    /// The shader before the passes, for a table of costs.
    whole: Option<Body>,
    /// The passes.
    options: passes::Options,
    /// The number of lowered instructions.
    lowered: usize,
}

/// The picture that is computed.
struct Job<'a> {
    image: &'a Image,
    forms: &'a Forms,
    /// The usual form, with the values of this request.
    program: &'a Program,
    services: &'a Services,
    points: &'a WithData<Crop>,
    sources: &'a SourceMap,
    meters: Meters,
}

/// How often and for what the points are shaded.
#[derive(Clone, Copy)]
struct Way {
    plan: Plan,
    wanted: RunRequest,
    began: Instant,
}

/// Shades the grid.
pub(super) fn run(
    image: &Image,
    loaded: LoadedShader,
    start: Start<'_>,
    sink: &mut dyn Sink,
) -> Result<Done, Failure> {
    let Start { plan, started, first, mut reads } = start;
    let points = WithData { data: data::read(image, loaded.spoken.as_ref())?, points: points(image) };
    let services = services(image, loaded.folder.clone(), grid_spaces(image));
    let tapped = output::has_closure(&loaded.body, &loaded.tapped);
    if tapped && plan != Plan::Plain {
        return Err(Failure::new("a tap of a closure wants one sample for each pixel"));
    }
    let forms = forms(image, &loaded, plan, tapped, (&services, &points));
    let open = with_inputs(&forms.usual.program, &loaded.body.inputs);
    let program = open.as_ref().unwrap_or(&forms.usual.program);
    let compile = started.elapsed();
    let LoadedShader { sources, name, folder, texts, .. } = loaded;

    // A material without other outputs writes its closures to the image.
    let alone = !image.wanted.closures && output::only_closures(&forms.usual.body);
    let is_told = image.output.path.is_none() && !image.wanted.values && plan == Plan::Plain;
    let closures = image.wanted.closures || is_told && (alone || tapped);
    let values = closures || image.wanted.histogram || image.wanted.values;
    let wanted = RunRequest { closures, ranges: image.wanted.ranges, values };
    let meters = sink.meters();
    let (forms, services) = (&*forms, &services);
    let job = Job { image, forms, program, services, points: &points, sources: &sources, meters };
    if let Some(first) = first {
        job.show_first(&first, folder, (started, compile), closures);
    }
    let shaded = job.shade(Way { plan, wanted, began: started })?;
    if let Some(reads) = &mut reads {
        reads.textures(&services.textures, []);
    }
    output::printed(&shaded.frame.printed, output::Appends::of(image), sink)?;
    if alone && image.output.path.is_some() {
        sink.note(if shaded.tallied.shows { output::CLOSURES_ALONE } else { output::CLOSURES_NULL });
    }
    let rounds = if image.running.profile { job.rounds(&shaded.frame, plan)? } else { Vec::new() };
    let Shaded { frame, run, write, file, tallied, samples } = shaded;
    let evaluations = samples.as_ref().map_or(points.count() as u64, |samples| samples.tally.evaluations);
    let report = Report {
        sources: &sources,
        points: (evaluations, if samples.is_some() { "samples" } else { "points" }),
        width: Some(image.points.grid.0),
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &texts,
    };
    let messages = report.send(&frame.messages, sink);
    messages.judge(image.shader.lints.denies_errors())?;
    tallied.warn(image, sink);

    sink.settle()?;
    let started = Instant::now();
    let mut done = Done { frame, messages, samples, profile: rounds, ..Done::default() };
    saved(&mut done, file, image, sink)?;
    let times = [compile, run, write + started.elapsed()];
    done.times = [compile, run];
    done.count(image);
    done.stats = image
        .wanted
        .stats
        .then(|| Stats::of(&forms.usual, (forms.lowered, evaluations), times, &image.running));
    if let (Some(stats), Some(whole), Some(_)) = (&mut done.stats, &forms.whole, &forms.options.prefilter) {
        stats.prefilter = Some(filtered(passes::n_filtered(whole.clone(), &forms.options)));
    }
    let cost = |whole: &Body| explain::table(&explain::cost(whole, &forms.options));
    done.cost = forms.whole.as_ref().filter(|_| image.wanted.stats).map(cost);
    done.ranges = tallied.ranges;
    done.closures = closures.then_some(tallied.closures);
    (done.sources, done.name) = (sources, name);
    Ok(done)
}

/// Writes the file of a picture, or moves the one that is written already into its place.
fn saved(done: &mut Done, file: Option<Unsaved>, image: &Image, sink: &mut dyn Sink) -> Result<(), Failure> {
    match (&image.output.path, file) {
        (Some(path), None) => {
            (done.files, done.piped) = output::write(&done.frame, None, path, image)?.save(path, sink)?;
        }
        (Some(path), Some(file)) => {
            file.save().map_err(Failure::new)?;
            done.files = vec![path.clone()];
        }
        (None, _) => {}
    }
    Ok(())
}

/// The program with the values of its inputs in a body; none without inputs.
fn with_inputs(program: &Program, inputs: &[Input]) -> Option<Program> {
    let mut program = (!inputs.is_empty()).then(|| program.clone())?;
    for index in 0..program.inputs().len() {
        let known = program.inputs().get(index);
        let is_it =
            |input: &&Input| known.is_some_and(|k| (&k.name, k.element) == (&input.name, input.element));
        if let Some(input) = inputs.iter().find(is_it) {
            program.set_input(index, input.value.clone());
        }
    }
    Some(program)
}

/// The compiled forms of the shader: those that the session keeps, or new ones.
fn forms(
    image: &Image,
    loaded: &LoadedShader,
    plan: Plan,
    tapped: bool,
    (services, points): (&Services, &WithData<Crop>),
) -> Arc<Forms> {
    let options = passes::Options {
        outputs: loaded.outputs(image),
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        traces: points.traces(),
        affine: services.spaces.affine(),
        without: image.running.without_pass.clone(),
        arithmetic: image.running.arithmetic.unwrap_or_default(),
        prefilter: image.sampling.prefilter(plan),
        limits: image.limits().clone(),
    };
    let Some((source, key)) = &loaded.kept else {
        return Arc::new(compiled(image, loaded, plan, tapped, options));
    };
    let key = || format!("{key} {tapped} {options:?}");
    let make = || {
        let forms = compiled(image, loaded, plan, tapped, options.clone());
        if let Some(mut kept) = image.snapshot().kept() {
            kept.compiled += 1;
        }
        // Compiling that was cancelled leaves the program slow.
        let files = image.limits().halted().is_none().then(Vec::new);
        Ok::<_, Infallible>(((source.clone(), Arc::new(forms) as Arc<dyn Any + Send + Sync>), files))
    };
    let Ok((_, forms)) = image.snapshot().keep(|kept| &mut kept.forms, key, make);
    forms.downcast().unwrap_or_else(|_| Arc::new(compiled(image, loaded, plan, tapped, options.clone())))
}

/// Compiles the shader in all forms that the request needs.
fn compiled(
    image: &Image,
    loaded: &LoadedShader,
    plan: Plan,
    tapped: bool,
    options: passes::Options,
) -> Forms {
    let mut body = loaded.body.clone();
    if !image.wanted.closures && !tapped {
        output::drop_closures(&mut body, options.outputs.as_deref());
    }
    let lowered = body.count();
    let offers = image.running.arithmetic.is_none() && matches!(plan, Plan::MaxError(..));
    let whole = (image.wanted.stats || offers).then(|| body.clone());
    let usual = stages::finish(body, &options);
    let cheaper = whole.as_ref().filter(|_| offers && usual.body.is_cheaper_in_fast()).map(|body| {
        let arithmetic = Arithmetic::Fast;
        stages::finish(body.clone(), &passes::Options { arithmetic, ..options.clone() }).program
    });
    Forms { usual, cheaper, whole, options, lowered }
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
    samples: Option<Samples>,
}

impl Job<'_> {
    /// Shows a smaller grid before the whole one. One sample for each pixel is enough; if it fails, the whole
    /// grid says why.
    fn show_first(
        &self,
        first: &First<'_>,
        folder: TextureFiles,
        (began, compile): (Instant, Duration),
        closures: bool,
    ) {
        let mut small = self.image.clone();
        small.points.grid = first.grid;
        let textures = self.services.textures.clone();
        let services = Services { textures, ..setup::services(&small, folder, grid_spaces(&small)) };
        let points = WithData { data: self.points.data.clone(), points: setup::points(&small) };
        let meters = self.meters.clone();
        let job = Job { image: &small, services: &services, points: &points, meters, ..*self };
        let wanted = RunRequest { closures, ranges: false, values: true };
        if let Ok(shaded) = job.shade(Way { plan: Plan::Plain, wanted, began }) {
            (first.show)(Done { frame: shaded.frame, times: [compile, shaded.run], ..Done::default() });
        }
    }

    /// The profiles of this run and of others of the same picture.
    fn rounds(&self, first: &Frame, plan: Plan) -> Result<Vec<Vec<osl_exec::ProfileEntry>>, Failure> {
        let mut again = self.image.clone();
        again.output.path = None;
        let wanted = RunRequest { closures: false, ranges: false, values: true };
        let again = Job { image: &again, meters: self.meters.clone(), ..*self };
        profile::rounds(&first.profile, || {
            let shaded = again.shade(Way { plan, wanted, began: Instant::now() })?;
            Ok(shaded.frame.profile)
        })
    }

    /// Runs all points. An EXR file is written during the run.
    fn shade(&self, way: Way) -> Result<Shaded, Failure> {
        let Job { image, services, points, .. } = *self;
        let Way { plan, wanted, began } = way;
        let program = self.program;
        let keeping = messages::keeping(self.sources);
        let options = RunOptions { keeping, closures: wanted.closures, ..options(image) };
        let meter = (self.meters)(points.count() as u64, "points");
        let tick = |done: usize| meter.at(done as u64);
        let shading = (plan != Plan::Plain).then(|| {
            let shading = sampling::shading(program, services, points, &options, plan);
            Shading { cheaper: self.forms.cheaper.as_ref(), ..shading }
        });
        let target = match &shading {
            Some(shading) => {
                let target = on_threads(image.running.threads, || Target::of(shading, &image.sampling))?;
                target.map_err(|stop| stopped(&stop, self.sources))??
            }
            None => Target::default(),
        };
        let work = || {
            let Some(shading) = &shading else {
                let run = Run::new(program, services, points, &options);
                let mut plain = Points { run: &run, width: image.size().0, progress: &tick };
                return computed(&mut plain, wanted, image);
            };
            if let Plan::Within(time, ..) = plan {
                let clock = || began.elapsed().as_secs_f64();
                let share = |share: f64| tick((share.clamp(0.0, 1.0) * points.count() as f64) as usize);
                let mut timed = InTime::new(shading, time, &clock, &share);
                let shaded = computed(&mut timed, wanted, image)?;
                return Ok(Shaded { samples: Some(timed.said()), ..shaded });
            }
            let sampled = Sampled::new(shading, (plan, &target), image.wanted.stats, &tick);
            let mut sampled = sampled.keeping(image.wanted.samples);
            let shaded = computed(&mut sampled, wanted, image)?;
            let samples = sampled.said().map_err(Broken::Run)?;
            Ok(Shaded { samples: Some(samples), ..shaded })
        };
        on_threads(image.running.threads, work)?.map_err(|broken| match broken {
            Broken::Image(error) => Failure::new(error),
            Broken::Run(stop) => stopped(&stop, self.sources),
            Broken::Empty => Failure::new(output::EMPTY),
        })
    }
}

/// Computes an image, and writes it to its file if it is written piece by piece.
fn computed(rows: &mut (dyn Rows + Send), wanted: RunRequest, image: &Image) -> Result<Shaded, Broken> {
    let started = Instant::now();
    let nothing = |frame, run, tallied| Shaded {
        frame,
        run,
        write: Duration::ZERO,
        file: None,
        tallied,
        samples: None,
    };
    match &image.output.path {
        // A histogram needs all values.
        Some(path) if !image.wanted.histogram && output::streams(image) => {
            let (frame, run, file, tallied) = output::stream(rows, path, wanted, image)?;
            let write = started.elapsed().saturating_sub(run);
            Ok(Shaded { write, file: Some(file), ..nothing(frame, run, tallied) })
        }
        path => {
            if path.is_none()
                && !wanted.values
                && let Some((frame, tallied)) = output::only_ranges(rows, wanted, image)?
            {
                return Ok(nothing(frame, started.elapsed(), tallied));
            }
            let mut tallied = Tallied::default();
            let frame = output::whole(rows, wanted, image, &mut tallied)?;
            let run = started.elapsed();
            // Without a file or a table nobody is told.
            if path.is_some() || wanted.ranges {
                tallied.count(&frame.planes, wanted, image);
            }
            Ok(nothing(frame, run, tallied))
        }
    }
}
