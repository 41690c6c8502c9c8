//! `oslrun tradeoff FILE`: measures speed against accuracy.

use super::args::RunArgs;
use super::args::values::seconds;
use super::load::{self, LoadedShader, Request};
use super::prefilter::DecisionInput;
use super::session::{busy, grid, on_threads, options, services, stopped};
use super::shading::Report;
use super::summary::SAME_IN_FAST;
use super::{Failure, data, data_url, output};
use clap::Args;
use osl::stages::{self, Compiled};
use osl_exec::{Frame, PointSource, RunError, RunOptions, Services};
use osl_image::Transfer;
use osl_ir::ir::Body;
use osl_ir::passes::{self, Prefilter};
use osl_measure::sample::{Filter, Guard, Shading, Surface};
use osl_measure::tradeoff::{self, Setting, Trade, Variant};
use osl_numeric::Arithmetic;
use osl_scene::WithData;
use osl_syntax::escape::shown;
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

/// What to measure.
#[derive(Debug, Args)]
pub(super) struct TradeoffArgs {
    /// The shader, and how it is run: as for a run, without --output and the number of samples.
    #[command(flatten)]
    pub(super) run: RunArgs,
    /// Approximate maximum time in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds)]
    pub(super) budget: f64,
    /// Print one JSON object.
    #[arg(long, conflicts_with = "csv")]
    pub(super) json: bool,
    /// Print comma-separated values.
    #[arg(long)]
    pub(super) csv: bool,
    /// Write a page with plots and pictures of the errors.
    #[arg(long, value_name = "FILE.html")]
    pub(super) html: Option<PathBuf>,
}

/// Measures and reports.
pub(super) fn tradeoff(args: &TradeoffArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let run = &args.run;
    let most = run.read.limits.limits().running.measured_pixels;
    if (run.grid.0 * run.grid.1) as u64 > most {
        let text = format!(
            "tradeoff takes at most {most} pixels (--limit running.measured_pixels=N); -g sets the size"
        );
        return Err(Failure::new(text));
    }
    let request = Request::of(run);
    let loaded = load::load(&request, err)?;
    let outputs = loaded.outputs(run);
    let LoadedShader { sources, mut body, name, folder, texts, .. } = loaded;
    output::drop_closures(&mut body, outputs.as_deref());
    let points = WithData { data: data::read(run)?, points: grid(run) };
    let services = services(run, folder, super::session::grid_spaces(run));
    let bench = Bench { services: &services, surface: &points, options: options(run) };
    let bar = busy("measuring", args.budget);
    let measured = on_threads(run.threads, || {
        let programs = Programs::new(&body, run, (&points, &bench))?;
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
        let _ = writeln!(err, "wrote {}", shown(&path.display().to_string()));
    }
    let text = match (args.json, args.csv) {
        (true, _) => serde_json::to_string_pretty(&trade).map_err(Failure::new)? + "\n",
        (_, true) => tradeoff::csv(&trade),
        _ => tradeoff::text(&trade),
    };
    let _ = write!(out, "{text}");
    // The messages of the shader, once.
    let said = bench.said(&programs);
    let frame = said.map_err(|stop| stopped(&stop, &sources))?;
    let report = Report {
        sources: &sources,
        format: run.read.message_format,
        points: (points.count() as u64, "points"),
        width: Some(run.grid.0),
        textures: &services.textures,
        path_option: "--texture-path",
        texts: &texts,
    };
    report.print(&frame.messages, err).judge(run.lints.denies_errors())
}

/// The numbers of samples for which filtering is tried.
const FILTERED: [u32; 3] = [1, 4, 16];

/// The program in all forms: in each arithmetic, and with steps filtered for some numbers of samples.
struct Programs {
    strict: Compiled,
    /// Unless it is the same as the strict one.
    fast: Option<Compiled>,
    double: Compiled,
    /// Unless nothing is filtered; with the ranges of the planes if each pixel is decided on its own.
    widened: Vec<(u32, Compiled, Option<Vec<f64>>)>,
}

impl Programs {
    fn new(
        body: &Body,
        args: &RunArgs,
        (points, bench): (&dyn PointSource, &Bench<'_>),
    ) -> Result<Programs, RunError> {
        let outputs: Option<Vec<_>> =
            args.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
        let usual = passes::Options {
            outputs,
            varying: points.varying().to_vec(),
            derivs: points.varying_derivs().to_vec(),
            traces: points.traces(),
            affine: bench.services.spaces.affine(),
            without: args.without_pass.clone(),
            arithmetic: Arithmetic::Strict,
            prefilter: None,
            limits: args.read.limits.limits().clone(),
        };
        let form = |arithmetic: Arithmetic, prefilter: Option<Prefilter>| {
            stages::finish(body.clone(), &passes::Options { arithmetic, prefilter, ..usual.clone() })
        };
        let mut widened = Vec::new();
        for samples in FILTERED {
            let Bench { services, surface, options } = bench;
            let filter = Filter::default();
            let wanted = DecisionInput {
                services,
                surface: *surface,
                options,
                filter,
                samples,
                may_guard: samples == 1,
            };
            let (chosen, said) = wanted.chosen(body, &usual)?;
            widened
                .extend(chosen.map(|chosen| (samples, form(Arithmetic::Strict, Some(chosen)), said.guard)));
        }
        let strict = form(Arithmetic::Strict, None);
        let fast = strict.body.differs_in_fast().then(|| form(Arithmetic::Fast, None));
        Ok(Programs { strict, fast, double: form(Arithmetic::Double, None), widened })
    }

    /// The options that are not measured, because they change nothing.
    fn idle(&self) -> Vec<String> {
        let fast = self.fast.is_none().then(|| SAME_IN_FAST.to_string());
        let missing: Vec<u32> =
            FILTERED.into_iter().filter(|n| !self.widened.iter().any(|(own, ..)| own == n)).collect();
        let words: Vec<String> = missing.iter().map(u32::to_string).collect();
        let filtered = match &words[..] {
            [] => None,
            all if all.len() == FILTERED.len() => {
                Some("`--prefilter` changes nothing here: it would not help".into())
            }
            some => Some(format!("`--prefilter` changes nothing with {} samples", some.join(" or "))),
        };
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
            guard: None,
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
        for (samples, form, ranges) in &programs.widened {
            let mut own = variant("prefilter", form, vec![Setting::Samples(*samples)]);
            let guard = |ranges| Guard { plain: &programs.strict.program, ranges };
            own.shading.guard = ranges.as_deref().map(guard);
            variants.push(own);
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
