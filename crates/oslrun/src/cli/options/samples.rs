//! The samples of each pixel.

use super::heading;
use clap::Args;
use osl_job::request::Sampling;
use osl_job::request::bounds::{Bounds, bounds};
use osl_job::request::values::{duration, error, filter, rate};
use osl_measure::sample::{FilterKind, MAX_SAMPLES, Rate};
use std::time::Duration;

/// The options for samples.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct SampleArgs {
    /// Samples per pixel (default: 1, at its centre); with --adaptive and --max-error the maximum per pixel
    /// (default: 1024 and 4096).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)), allow_negative_numbers = true, help_heading = heading::SAMPLES)]
    samples: Option<u32>,
    /// Filter of the pixels: box, gaussian, blackman-harris or mitchell, and its width in pixels (default: 1,
    /// 2, 3, 4). A single sample is always at the centre.
    #[arg(long, value_name = "NAME[,WIDTH]", value_parser = filter, help_heading = heading::SAMPLES)]
    filter: Option<(FilterKind, f32)>,
    /// Compute one pixel of 2x1, 2x2 or 4x4, and interpolate the others.
    #[arg(long, value_name = "WxH", value_parser = rate, conflicts_with_all = ["samples", "filter", "adaptive", "max_error"], help_heading = heading::SAMPLES)]
    shading_rate: Option<Rate>,
    /// Take samples until the standard error of a pixel is at most this, in the units of the outputs.
    #[arg(long, value_name = "ERROR", value_parser = error, allow_negative_numbers = true, conflicts_with = "max_error", help_heading = heading::SAMPLES)]
    adaptive: Option<f32>,
    /// Keep the error of 999 in 1000 pixels below this with as little work as possible: pixels are
    /// interpolated where the shader is smooth, and have many samples where it is not. 0.01 is in the units
    /// of the outputs; 2% is a share of the range of each output, which is measured first. color=2%,mask=0.01
    /// sets the error of single outputs. The fast arithmetic is used if its error is much smaller, unless
    /// --arithmetic is given. With --stats the error is checked. If the bound is missed, a warning says so,
    /// and the exit code is 1. With --preview, it is the standard error of the light, which a screen shows
    /// from 0 to 1.
    #[arg(long, value_name = "ERROR", value_parser = bounds, allow_hyphen_values = true, help_heading = heading::SAMPLES)]
    max_error: Option<Bounds>,
    /// Filter steps, comparisons and noise over the area of a sample, so that fewer samples may be needed.
    /// Straight edges get their mean. Folds, edges that are close to each other and some noises can become
    /// worse, and derivatives of noise take time: `oslrun tradeoff` shows what it is worth for a shader.
    /// With --stats, a sentence says how many operations are filtered.
    #[arg(long, conflicts_with_all = ["adaptive", "max_error"], help_heading = heading::SAMPLES)]
    prefilter: bool,
}

impl SampleArgs {
    /// The samples; within a time, if a command has this option.
    pub(in crate::cli) fn sampling(&self, within: Option<&WithinArgs>) -> Sampling {
        Sampling {
            samples: self.samples,
            filter: self.filter,
            shading_rate: self.shading_rate,
            adaptive: self.adaptive,
            max_error: self.max_error.clone(),
            within: within.and_then(|own| own.within),
            prefilter: self.prefilter,
        }
    }
}

/// A time that the samples may take.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct WithinArgs {
    /// Take as many samples in each pixel as fit into this time: 5s, 0.5s, 500ms. It is the time from the
    /// start of the command until the picture is computed. A report shows the number of samples and the
    /// error; --samples with this number makes the same picture.
    #[arg(long, value_name = "TIME", value_parser = duration, allow_hyphen_values = true, conflicts_with_all = ["samples", "shading_rate", "adaptive", "max_error", "prefilter", "steps"], help_heading = heading::SAMPLES)]
    within: Option<Duration>,
}
