//! The report on an image with samples: what it took, and whether it keeps its error bounds.

use crate::event::Sink;
use crate::request::bounds::Resolved;
use osl_measure::sample::{Cheaper, Tally};
use serde::Serialize;
use std::fmt::Write;

/// The report on an image with samples.
#[derive(Default)]
pub struct Samples {
    /// Evaluations, and how many samples the pixels have.
    pub tally: Tally,
    /// Samples of each pixel, 0 where it was interpolated, if they are kept and differ.
    pub samples: Vec<u32>,
    /// What the image took, and its error.
    pub text: String,
    /// Notes on the error bounds.
    pub notes: Vec<String>,
    /// Why the picture has fewer samples than were asked for.
    pub warning: Option<String>,
    /// The bounds, if there are any, and whether the image keeps them.
    pub max_error: Option<Kept>,
    /// What a time was enough for.
    pub within: Option<Reached>,
    /// Why they are not kept.
    pub missed: Option<String>,
}

impl Samples {
    /// Sends the notes on the error bounds, and a warning if they are missed.
    pub fn send(&self, sink: &mut dyn Sink) {
        self.notes.iter().for_each(|note| sink.note(note));
        self.warning.iter().chain(&self.missed).for_each(|warning| sink.warn(warning));
    }
}

/// Error bounds, and whether an image keeps them.
#[derive(Clone, Debug, Serialize)]
pub struct Kept {
    bounds: Vec<Resolved>,
    kept: bool,
}

impl Kept {
    /// Bounds that an image keeps or not.
    pub fn of(bounds: Vec<Resolved>, kept: bool) -> Kept {
        Kept { bounds, kept }
    }
}

/// What the time was enough for.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Reached {
    /// Samples of each pixel.
    pub samples: u32,
    /// Seconds from the start of the command until the error was measured.
    pub seconds: f64,
    /// Whether one sample for each pixel fits into the time.
    pub fits: bool,
    /// Root mean square error.
    pub rms: f64,
    /// Number of pixels at which it was measured.
    pub compared: u64,
}

/// The number of evaluations, and the pixels that received them.
pub fn spent(tally: &Tally) -> String {
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
