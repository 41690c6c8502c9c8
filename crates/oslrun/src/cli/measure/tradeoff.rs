//! `oslrun tradeoff FILE`: measures speed against accuracy.

use crate::cli::options::points::PatchArgs;
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::RunningArgs;
use crate::cli::options::shader::SubjectArgs;
use crate::cli::print::{Console, busy};
use clap::Args;
use osl::stages::{self, Compiled};
use osl_exec::{Frame, PointSource, RunError, RunOptions, Services};
use osl_image::Transfer;
use osl_ir::ir::Body;
use osl_ir::passes::{self, Prefilter};
use osl_job::file::{data_url, output};
use osl_job::picture::setup::{grid, grid_spaces, on_threads, options, services, stopped};
use osl_job::report::messages::Report;
use osl_job::report::stats::SAME_IN_FAST;
use osl_job::request::values::seconds;
use osl_job::source::data;
use osl_job::source::load::{self, LoadedShader, Request};
use osl_job::{Failure, Image};
use osl_measure::sample::{Filter, Shading, Surface};
use osl_measure::tradeoff::{self, Setting, Trade, Variant};
use osl_numeric::Arithmetic;
use osl_scene::WithData;
use std::path::PathBuf;
use std::time::Duration;

/// What to measure.
#[derive(Debug, Args)]
pub(in crate::cli) struct TradeoffArgs {
    #[command(flatten)]
    subject: SubjectArgs,
    #[command(flatten)]
    patch: PatchArgs,
    #[command(flatten)]
    running: RunningArgs,
    #[command(flatten)]
    format: FormatArgs,
    /// Approximate maximum time in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    budget: f64,
    /// Print one JSON object.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Print comma-separated values.
    #[arg(long)]
    csv: bool,
    /// Write a page with plots and pictures of the errors.
    #[arg(long, value_name = "FILE.html")]
    html: Option<PathBuf>,
}

impl TradeoffArgs {
    fn image(&self) -> Image {
        Image { running: self.running.running(), ..self.patch.image(self.subject.shader()) }
    }
}

/// Measures and reports.
pub(in crate::cli) fn tradeoff(args: &TradeoffArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let image = &args.image();
    let most = image.limits().running.measured_pixels;
    let (width, height) = image.points.grid;
    if (width * height) as u64 > most {
        let text = format!(
            "tradeoff takes at most {most} pixels (--limit running.measured_pixels=N); -g sets the size"
        );
        return Err(Failure::new(text));
    }
    let loaded = load::load(&Request::of(image), console)?;
    let outputs = loaded.outputs(image);
    let LoadedShader { sources, mut body, name, folder, texts, spoken, .. } = loaded;
    output::drop_closures(&mut body, outputs.as_deref());
    let points = WithData { data: data::read(image, spoken.as_ref())?, points: grid(image) };
    let services = services(image, folder, grid_spaces(image));
    let bench = Bench { services: &services, surface: &points, options: options(image) };
    let bar = busy("measuring", args.budget);
    let measured = on_threads(image.running.threads, || {
        let programs = Programs::new(&body, image, (&points, &bench));
        Ok((bench.measure(&name, &programs, args.budget)?, programs))
    })?;
    bar.finish_and_clear();
    let (trade, programs) = measured.map_err(|stop| stopped(&stop, &sources))?;
    if trade.outputs.is_empty() {
        return Err(Failure::new(output::EMPTY));
    }
    if let Some(path) = &args.html {
        let page = tradeoff::html(&trade, &|width, height, planes| {
            data_url::png((width, height), planes, Transfer::Linear)
        });
        osl_files::replace(path, page.as_bytes()).map_err(Failure::new)?;
        console.text(&format!("wrote {}", path.display()));
    }
    match (args.json, args.csv) {
        (true, _) => console.object(&trade)?,
        (_, true) => console.report(&tradeoff::csv(&trade)),
        _ => console.report(&tradeoff::text(&trade)),
    }
    // The messages of the shader, once.
    let frame = bench.said(&programs).map_err(|stop| stopped(&stop, &sources))?;
    let report = Report {
        sources: &sources,
        points: (points.count() as u64, "points"),
        width: Some(width),
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &texts,
    };
    report.send(&frame.messages, console).judge(image.shader.lints.denies_errors())
}

/// The numbers of samples for which filtering is tried.
const FILTERED: [u32; 3] = [1, 4, 16];

/// The program in all forms: in each arithmetic, and with steps filtered for some numbers of samples.
struct Programs {
    strict: Compiled,
    /// Unless it is the same as the strict one.
    fast: Option<Compiled>,
    double: Compiled,
    /// Unless nothing is filtered.
    widened: Vec<(u32, Compiled)>,
}

impl Programs {
    fn new(body: &Body, image: &Image, (points, bench): (&dyn PointSource, &Bench<'_>)) -> Programs {
        let outputs: Option<Vec<_>> =
            image.shader.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
        let usual = passes::Options {
            outputs,
            varying: points.varying().to_vec(),
            derivs: points.varying_derivs().to_vec(),
            traces: points.traces(),
            affine: bench.services.spaces.affine(),
            without: image.running.without_pass.clone(),
            arithmetic: Arithmetic::Strict,
            prefilter: None,
            limits: image.limits().clone(),
        };
        let form = |arithmetic: Arithmetic, prefilter: Option<Prefilter>| {
            stages::finish(body.clone(), &passes::Options { arithmetic, prefilter, ..usual.clone() })
        };
        let is_filtered = passes::n_filtered(body.clone(), &usual) > 0;
        let filter = |samples: u32| Prefilter { scale: 1.0 / (samples as f32).sqrt() };
        let forms = FILTERED.map(|samples| (samples, form(Arithmetic::Strict, Some(filter(samples)))));
        let widened = if is_filtered { forms.into() } else { Vec::new() };
        let strict = form(Arithmetic::Strict, None);
        let fast = strict.body.differs_in_fast().then(|| form(Arithmetic::Fast, None));
        Programs { strict, fast, double: form(Arithmetic::Double, None), widened }
    }

    /// The options that are not measured, because they change nothing.
    fn idle(&self) -> Vec<String> {
        let fast = self.fast.is_none().then(|| SAME_IN_FAST.to_string());
        let filtered = self.widened.is_empty().then(|| {
            "`--prefilter` changes nothing here: it can filter no step or noise of this shader".to_string()
        });
        fast.into_iter().chain(filtered).collect()
    }
}

/// What all runs share.
struct Bench<'a> {
    services: &'a Services,
    surface: &'a dyn Surface,
    options: RunOptions,
}

impl Bench<'_> {
    fn shading<'s>(&'s self, form: &'s Compiled) -> Shading<'s> {
        Shading {
            program: &form.program,
            services: self.services,
            surface: self.surface,
            options: &self.options,
            cheaper: None,
            pattern: tradeoff::pattern(),
            filter: Filter::default(),
        }
    }

    fn measure(&self, name: &str, programs: &Programs, budget: f64) -> Result<Trade, RunError> {
        let variant = |name: &str, form, settings: Vec<Setting>| Variant {
            name: name.into(),
            shading: self.shading(form),
            settings,
        };
        let few = || [1, 4, 16].map(Setting::Samples).to_vec();
        let mut variants = vec![
            variant("strict", &programs.strict, Setting::ladder()),
            variant("f64", &programs.double, vec![Setting::Samples(1)]),
        ];
        if let Some(fast) = &programs.fast {
            variants.insert(1, variant("fast", fast, few()));
        }
        for (samples, form) in &programs.widened {
            variants.push(variant("prefilter", form, vec![Setting::Samples(*samples)]));
        }
        tradeoff::tradeoff(&tradeoff::Request {
            name: name.to_string(),
            variants,
            oracle: ("f64".into(), self.shading(&programs.double)),
            budget: Duration::from_secs_f64(budget),
            idle: programs.idle(),
        })
    }

    /// The messages of a run.
    fn said(&self, programs: &Programs) -> Result<Frame, RunError> {
        Ok(self.shading(&programs.strict).rows(0..self.surface.size().1, 1)?.frame)
    }
}
