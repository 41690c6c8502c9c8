//! `--within TIME`: an image with as many samples as fit into a time, and its measured error.

use super::sampling::checked;
use crate::file::rows::Rows;
use crate::report::samples::{Reached, Samples, spent};
use osl_exec::{Frame, Plane, RunError};
use osl_measure::sample::{Shading, Tally, Watch, within};
use std::ops::Range;
use std::time::Duration;

/// The largest share of the time for measuring the error. The rest is for the samples.
const CHECKING: f64 = 0.1;
/// The number of compared pixels: the minimum, whatever they take, and the maximum.
const CHECKED: (usize, usize) = (16, 4096);
/// Samples of the oracle per pixel: twice those of the image, within these numbers.
const ORACLE: (u32, u32) = (64, 16384);

/// The samples of the oracle for an image with so many.
fn oracle(samples: u32) -> u32 {
    samples.saturating_mul(2).next_power_of_two().clamp(ORACLE.0, ORACLE.1)
}

/// An image that is computed within a time, as a whole before its first piece is handed out.
pub(super) struct InTime<'a, 'b> {
    shading: &'a Shading<'b>,
    time: Duration,
    /// Seconds since the command began.
    clock: &'a (dyn Fn() -> f64 + Sync),
    /// Is called with the share of the time that has passed.
    progress: &'a (dyn Fn(f64) + Sync),
    done: Option<Done>,
}

/// The computed image.
struct Done {
    planes: Vec<Plane>,
    /// The messages, until the first piece takes them.
    rest: Frame,
    tally: Tally,
    reached: Reached,
    text: String,
}

impl<'a, 'b> InTime<'a, 'b> {
    pub(super) fn new(
        shading: &'a Shading<'b>,
        time: Duration,
        clock: &'a (dyn Fn() -> f64 + Sync),
        progress: &'a (dyn Fn(f64) + Sync),
    ) -> InTime<'a, 'b> {
        InTime { shading, time, clock, progress, done: None }
    }

    fn compute(&self) -> Result<Done, RunError> {
        let all = self.time.as_secs_f64();
        let (width, height) = self.shading.surface.size();
        let most = CHECKED.1.min(width * height) as f64;
        let checking = |samples: u32, each: f64| each * f64::from(oracle(samples)) * most;
        let end = |samples: u32, each: f64| all - checking(samples, each).min(CHECKING * all);
        let timed = within(self.shading, &end, self.clock, self.progress)?;
        let (mut image, samples) = (timed.image, timed.samples);
        let oracle = oracle(samples);
        let affordable = ((all - (self.clock)()) / (timed.each * f64::from(oracle))).max(0.0) as usize;
        let mut watch = Watch::new(width * height, affordable.clamp(CHECKED.0, CHECKED.1));
        watch.note(&image, 0);
        let check = watch.check(self.shading, &[], [oracle; 2])?;
        let seconds = (self.clock)();
        let mut text = spent(&image.tally);
        text += &format!(
            "{samples} sample{} a pixel in {seconds:.2} s of {all} s; --samples {samples} makes the same picture\n",
            if samples == 1 { "" } else { "s" }
        );
        text += &checked(&check, [oracle; 2], (image.tally.pixels, None));
        let reached = Reached { samples, seconds, fits: timed.fits, rms: check.rmse, compared: check.pixels };
        let planes = std::mem::take(&mut image.frame.planes);
        Ok(Done { planes, rest: image.frame, tally: image.tally, reached, text })
    }

    /// The cost and the error of the image.
    pub(super) fn said(self) -> Samples {
        let Some(Done { tally, reached, text, .. }) = self.done else { return Samples::default() };
        let warning = (!reached.fits).then(|| {
            format!(
                "{:?} of --within are too short for one sample in each pixel; the picture has one",
                self.time
            )
        });
        Samples { tally, text, warning, within: Some(reached), ..Samples::default() }
    }
}

impl Rows for InTime<'_, '_> {
    fn planes(&self) -> Result<Vec<Plane>, RunError> {
        self.shading.fits(1)?;
        Ok(self.shading.planes())
    }

    fn fits(&self, points: usize) -> Result<(), RunError> {
        self.shading.fits(points)
    }

    fn rows(&mut self, rows: Range<usize>) -> Result<Frame, RunError> {
        let mut done = match self.done.take() {
            Some(done) => done,
            None => self.compute()?,
        };
        let width = self.shading.surface.size().0;
        let piece = rows.start * width..rows.end * width;
        let slice = |plane: &Plane| {
            let words = plane.words.get(piece.clone()).unwrap_or(&[]).to_vec().into();
            Plane {
                output: plane.output.clone(),
                ty: plane.ty,
                component: plane.component,
                kind: plane.kind,
                words,
                wide: Vec::new(),
            }
        };
        let planes = done.planes.iter().map(slice).collect();
        let frame = Frame { planes, ..std::mem::take(&mut done.rest) };
        self.done = Some(done);
        Ok(frame)
    }
}
