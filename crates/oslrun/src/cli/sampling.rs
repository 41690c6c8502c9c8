//! `--samples`, `--filter`, `--shading-rate`, `--adaptive`, `--max-error`: images with a number of samples
//! per pixel other than one.

use super::Failure;
use super::args::SampleArgs;
use super::output::Rows;
use osl_exec::{Frame, Plane, Program, RunError, RunOptions, Services};
use osl_measure::sample::{
    Adaptive, Cheaper, Check, Filter, FilterKind, Image, MAX_SAMPLES, MaxError, Pattern, Rate, Shading,
    Surface, Tally, Watch, adaptive, at_rate, max_error,
};
use std::fmt::Write;
use std::ops::Range;

/// The sampling plan of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Plan {
    /// One sample at each pixel's centre.
    Plain,
    /// The same number of samples in each pixel.
    Samples(u32, FilterKind, f32),
    /// One sample for several pixels.
    Rate(Rate),
    /// As many samples as a standard error requires.
    Adaptive(Adaptive, FilterKind, f32),
    /// As few samples as an error permits.
    MaxError(MaxError, FilterKind, f32),
}

/// The default maximum number of samples per pixel, and the default with an error to keep: noise with values
/// from 0 to 1 needs 2300 samples for an error of 0.02.
const MOST: u32 = 1024;
const MOST_FOR_ERROR: u32 = 4096;
/// The number of pixels that are compared with an oracle.
const CHECKED: usize = 256;
/// The minimum number of samples of the oracle per pixel.
const ORACLE: u32 = 1024;

impl SampleArgs {
    /// The plan that the options describe together.
    pub(super) fn plan(&self) -> Result<Plan, Failure> {
        let (kind, width) = self.filter.unwrap_or((FilterKind::Box, 1.0));
        let most = self.samples.unwrap_or(MOST);
        Ok(match (self.shading_rate, self.adaptive, self.max_error) {
            (Some(Rate([1, 1])), ..) => Plan::Plain,
            (Some(rate), ..) => Plan::Rate(rate),
            (_, Some(threshold), _) => Plan::Adaptive(Adaptive { threshold, most }, kind, width),
            (.., Some(error)) => {
                let most = self.samples.unwrap_or(MOST_FOR_ERROR);
                Plan::MaxError(MaxError { error, most }, kind, width)
            }
            _ if self.samples.unwrap_or(1) == 1 => Plan::Plain,
            _ => Plan::Samples(most, kind, width),
        })
    }
}

impl SampleArgs {
    /// Whether any of these options is given.
    pub(super) fn is_given(&self) -> bool {
        let SampleArgs { samples, filter, shading_rate, adaptive, max_error, prefilter } = self;
        samples.is_some()
            || filter.is_some()
            || shading_rate.is_some()
            || adaptive.is_some()
            || max_error.is_some()
            || *prefilter
    }

    /// The width of filtered steps, if they are filtered: the share of the pixel that belongs to a sample.
    pub(super) fn prefilter(&self, plan: Plan) -> Option<f32> {
        let samples = if let Plan::Samples(samples, ..) = plan { samples } else { 1 };
        self.prefilter.then(|| 1.0 / (samples as f32).sqrt())
    }
}

impl Plan {
    fn filter(self) -> Filter {
        match self {
            Plan::Plain | Plan::Rate(_) => Filter::default(),
            Plan::Samples(_, kind, width)
            | Plan::Adaptive(_, kind, width)
            | Plan::MaxError(_, kind, width) => Filter::new(kind, width),
        }
    }

    /// The number of samples for which the sample pattern is built.
    fn samples(self) -> u32 {
        match self {
            Plan::Samples(samples, ..) => samples,
            _ => 64,
        }
    }

    /// The requested error, or infinity.
    fn limit(self) -> f32 {
        match self {
            Plan::MaxError(wanted, ..) => wanted.error,
            _ => f32::INFINITY,
        }
    }
}

/// A program that can be run at any place of an image.
pub(super) fn shading<'a>(
    program: &'a Program,
    services: &'a Services,
    surface: &'a dyn Surface,
    options: &'a RunOptions,
    plan: Plan,
) -> Shading<'a> {
    let pattern = Pattern::new(plan.samples(), 0);
    Shading { program, services, surface, options, cheaper: None, pattern, filter: plan.filter() }
}

/// An image that is computed with a plan, piece by piece.
pub(super) struct Sampled<'a, 'b> {
    shading: &'a Shading<'b>,
    plan: Plan,
    tally: Tally,
    /// The pixels to compare with an oracle.
    watch: Option<Watch>,
    progress: &'a (dyn Fn(usize) + Sync),
}

/// The report on an image with samples.
pub(super) struct Said {
    pub(super) tally: Tally,
    pub(super) text: String,
}

impl<'a, 'b> Sampled<'a, 'b> {
    /// An image before its first piece.
    pub(super) fn new(
        shading: &'a Shading<'b>,
        plan: Plan,
        check: bool,
        progress: &'a (dyn Fn(usize) + Sync),
    ) -> Sampled<'a, 'b> {
        let (width, height) = shading.surface.size();
        let watch = check.then(|| Watch::new(width * height, CHECKED));
        Sampled { shading, plan, tally: Tally::default(), watch, progress }
    }

    fn piece(&self, rows: Range<usize>) -> Result<Image, RunError> {
        match self.plan {
            Plan::Plain => self.shading.rows(rows, 1),
            Plan::Samples(samples, ..) => self.shading.rows(rows, samples),
            Plan::Rate(rate) => at_rate(self.shading, rows, rate),
            Plan::Adaptive(wanted, ..) => adaptive(self.shading, rows, wanted),
            Plan::MaxError(wanted, ..) => max_error(self.shading, rows, wanted),
        }
    }

    /// The cost and the error of the image.
    pub(super) fn said(self) -> Result<Said, RunError> {
        let mut text = spent(&self.tally);
        if let Some(watch) = &self.watch {
            let most = self.tally.by_samples.last().map_or(1, |(samples, _)| *samples);
            let samples = most.saturating_mul(4).clamp(ORACLE, MAX_SAMPLES);
            let check = watch.check(self.shading, f64::from(self.plan.limit()), samples)?;
            text += &checked(&check, samples, self.plan.limit());
        }
        Ok(Said { tally: self.tally, text })
    }
}

impl Rows for Sampled<'_, '_> {
    fn planes(&self) -> Result<Vec<Plane>, RunError> {
        self.shading.fits(1)?;
        Ok(self.shading.planes())
    }

    fn fits(&self, points: usize) -> Result<(), RunError> {
        self.shading.fits(points)
    }

    fn rows(&mut self, rows: Range<usize>) -> Result<Frame, RunError> {
        let width = self.shading.surface.size().0;
        let first = rows.start * width;
        let image = self.piece(rows)?;
        self.tally.add(&image.tally);
        if let Some(watch) = &mut self.watch {
            watch.note(&image, first);
        }
        (self.progress)(self.tally.pixels as usize);
        Ok(image.frame)
    }

    fn weight(&self) -> usize {
        8
    }
}

/// The number of evaluations, and the pixels that received them.
fn spent(tally: &Tally) -> String {
    let mut text = format!("{:.3} evaluations a pixel", tally.per_pixel());
    let share = |pixels: u64| 100.0 * pixels as f64 / tally.pixels.max(1) as f64;
    for (at, (samples, pixels)) in tally.by_samples.iter().enumerate() {
        let what = match samples {
            0 => "interpolated".to_string(),
            1 => "with 1 sample".to_string(),
            n => format!("with {n}"),
        };
        let _ = write!(text, "{} {:.2} % {what}", if at == 0 { ":" } else { "," }, share(*pixels));
    }
    text.push('\n');
    if let Some(Cheaper { compared, largest, pixels }) = tally.cheaper {
        let _ = writeln!(
            text,
            "{:.2} % sampled in fast arithmetic, which is off by {largest:.1e} at most of {compared} samples",
            share(pixels)
        );
    }
    if tally.unfinished > 0 {
        let _ = writeln!(
            text,
            "{} pixels want more samples than they may have; --samples sets the limit",
            tally.unfinished
        );
    }
    if tally.not_finite > 0 {
        let _ = writeln!(text, "{} pixels have a value that is not a number or infinite", tally.not_finite);
    }
    text
}

fn checked(check: &Check, samples: u32, limit: f32) -> String {
    let mut text = format!(
        "error at {} pixels, against {samples} samples each: rms {:.3e}, 99.9 % below {:.3e}, largest {:.3e} \
         (oracle's own standard error {:.1e}, subtracted)\n",
        check.pixels, check.rmse, check.nearly_all, check.largest, check.oracle
    );
    if limit.is_finite() {
        let share = 100.0 * (1.0 - check.above as f64 / check.pixels.max(1) as f64);
        let _ = writeln!(text, "{share:.2} % of them are within {limit}");
    }
    text
}
