//! The report on an image with samples: what it took, and whether it keeps its error bounds. This module must
//! not know how samples are taken.

use super::args::RunArgs;
use super::args::bounds::Resolved;
use osl_measure::sample::{Cheaper, Tally};
use osl_syntax::escape::shown;
use serde::Serialize;
use std::fmt::Write;

/// The report on an image with samples.
#[derive(Default)]
pub(super) struct Said {
    pub(super) tally: Tally,
    /// Samples of each pixel, 0 where it was interpolated, if they are kept and differ.
    pub(super) samples: Vec<u32>,
    /// What the image took, and its error.
    pub(super) text: String,
    /// Notes on the error bounds.
    pub(super) notes: String,
    /// The bounds, if there are any, and whether the image keeps them.
    pub(super) max_error: Option<Kept>,
    /// What a time was enough for.
    pub(super) within: Option<Reached>,
    /// Why they are not kept.
    pub(super) missed: Option<String>,
}

impl Said {
    /// Prints the report. Returns whether the image misses its bounds.
    pub(super) fn print(
        &self,
        args: &RunArgs,
        out: &mut dyn std::io::Write,
        err: &mut dyn std::io::Write,
    ) -> bool {
        let _ = write!(err, "{}", shown(&self.notes));
        let _ = match (args.stats, &args.live) {
            (true, _) => write!(err, "{}", self.text),
            (false, None) => write!(out, "{}", self.text),
            // A page has its own place for it.
            (false, Some(_)) => Ok(()),
        };
        if let Some(why) = &self.missed {
            let _ = writeln!(err, "warning: {}", shown(why));
        }
        self.missed.is_some()
    }
}

/// Error bounds, and whether an image keeps them.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Kept {
    bounds: Vec<Resolved>,
    kept: bool,
}

impl Kept {
    /// Bounds that an image keeps or not.
    pub(super) fn of(bounds: Vec<Resolved>, kept: bool) -> Kept {
        Kept { bounds, kept }
    }
}

/// What the time was enough for.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Reached {
    /// Samples of each pixel.
    pub(super) samples: u32,
    /// Seconds from the start of the command until the error was measured.
    pub(super) seconds: f64,
    /// Whether one sample for each pixel fits into the time.
    pub(super) fits: bool,
    /// Root mean square error.
    pub(super) rms: f64,
    /// Number of pixels at which it was measured.
    pub(super) compared: u64,
}

/// The number of evaluations, and the pixels that received them.
pub(super) fn spent(tally: &Tally) -> String {
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
