//! `--samples`, `--filter`, `--shading-rate`, `--adaptive`, `--max-error`, `--within`: images with a number
//! of samples per pixel other than one.

use crate::Failure;
use crate::file::rows::Rows;
use crate::report::samples::{Kept, Samples, spent};
use crate::request::Sampling;
use crate::request::bounds::{Resolved, short};
use osl_exec::{Frame, Plane, Program, RunError, RunOptions, Services};
use osl_ir::passes::Prefilter;
use osl_measure::sample::{
    Adaptive, Check, Filter, FilterKind, Image, MAX_SAMPLES, PROMISED, Pattern, Rate, Reach, Shading,
    Surface, Tally, Watch, adaptive, at_rate, likely, max_error_each, outputs, reaches,
};
use std::fmt::Write;
use std::ops::Range;
use std::time::Duration;

/// The sampling plan of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plan {
    /// One sample at each pixel's centre.
    Plain,
    /// The same number of samples in each pixel.
    Samples(u32, FilterKind, f32),
    /// One sample for several pixels.
    Rate(Rate),
    /// As many samples as a standard error requires.
    Adaptive(Adaptive, FilterKind, f32),
    /// As few samples as the error bounds permit, and at most so many per pixel.
    MaxError(u32, FilterKind, f32),
    /// As many samples as fit into a time.
    Within(Duration, FilterKind, f32),
}

/// The default maximum number of samples per pixel, and the default with an error to keep: noise with values
/// from 0 to 1 needs 2300 samples for an error of 0.02.
const MOST: u32 = 1024;
const MOST_FOR_ERROR: u32 = 4096;
/// The number of pixels that are compared with an oracle: enough to see one pixel in a thousand.
const CHECKED: usize = 4096;
/// The minimum number of samples of the oracle per pixel.
const ORACLE: u32 = 1024;
/// Without a report, an image that promises an error is compared at one in a hundred of its pixels, and at
/// least at so many.
const AGAIN: usize = 64;
/// Samples of the oracle for that comparison: of all these pixels, and at least of those that may exceed a
/// bound.
const QUICK: [u32; 2] = [16, 256];

impl Sampling {
    /// The plan that the options describe together.
    pub fn plan(&self) -> Result<Plan, Failure> {
        let (kind, width) = self.filter.unwrap_or((FilterKind::Box, 1.0));
        let most = self.samples.unwrap_or(MOST);
        if let Some(time) = self.within {
            return Ok(Plan::Within(time, kind, width));
        }
        Ok(match (self.shading_rate, self.adaptive, &self.max_error) {
            (Some(Rate([1, 1])), ..) => Plan::Plain,
            (Some(rate), ..) => Plan::Rate(rate),
            (_, Some(threshold), _) => Plan::Adaptive(Adaptive { threshold, most }, kind, width),
            (.., Some(_)) => Plan::MaxError(self.samples.unwrap_or(MOST_FOR_ERROR), kind, width),
            _ if self.samples.unwrap_or(1) == 1 => Plan::Plain,
            _ => Plan::Samples(most, kind, width),
        })
    }
}

impl Sampling {
    /// Whether any of these options is given.
    pub fn is_given(&self) -> bool {
        let Sampling { samples, filter, shading_rate, adaptive, max_error, within, prefilter } = self;
        samples.is_some()
            || filter.is_some()
            || shading_rate.is_some()
            || adaptive.is_some()
            || max_error.is_some()
            || within.is_some()
            || *prefilter
    }

    /// How wide steps are filtered, if they are: over the area of one of the samples of a pixel.
    pub fn prefilter(&self, plan: Plan) -> Option<Prefilter> {
        let samples = if let Plan::Samples(samples, ..) = plan { samples } else { 1 };
        self.prefilter.then(|| Prefilter { scale: 1.0 / (samples as f32).sqrt() })
    }
}

impl Plan {
    /// The filter of the pixels.
    pub fn filter(self) -> Filter {
        match self {
            Plan::Plain | Plan::Rate(_) => Filter::default(),
            Plan::Samples(_, kind, width)
            | Plan::Adaptive(_, kind, width)
            | Plan::MaxError(_, kind, width)
            | Plan::Within(_, kind, width) => Filter::new(kind, width),
        }
    }

    /// The number of samples for which the sample pattern is built.
    pub fn samples(self) -> u32 {
        match self {
            Plan::Samples(samples, ..) => samples,
            // A second look takes so many; the pilot makes more if they are needed.
            Plan::MaxError(..) => 32,
            _ => 64,
        }
    }
}

/// A program that can be run at any place of an image.
pub fn shading<'a>(
    program: &'a Program,
    services: &'a Services,
    surface: &'a dyn Surface,
    options: &'a RunOptions,
    plan: Plan,
) -> Shading<'a> {
    let pattern = Pattern::new(plan.samples(), 0);
    Shading { program, services, surface, options, cheaper: None, pattern, filter: plan.filter() }
}

/// The error bounds of an image, which are known before its first piece.
#[derive(Debug, Default)]
pub struct Target {
    /// The bound of each plane; infinite if it has none.
    planes: Vec<f32>,
    /// The bounds of the outputs.
    each: Vec<Resolved>,
    /// Which bounds those are that the command line gives as shares.
    words: Vec<String>,
    /// Evaluations that the ranges of the outputs took.
    looks: u64,
}

impl Target {
    /// The bounds of the command line for the outputs of an image; nothing without such bounds.
    pub fn of(shading: &Shading<'_>, sampling: &Sampling) -> Result<Result<Target, Failure>, RunError> {
        let (Some(bounds), planes) = (&sampling.max_error, shading.planes()) else {
            return Ok(Ok(Target::default()));
        };
        if planes.is_empty() {
            return Ok(Ok(Target::default()));
        }
        let (reaches, looks) = if bounds.needs_ranges() {
            let reaches = reaches(shading)?;
            let looks = reaches.first().map_or(0, |reach| reach.pixels as u64);
            (reaches, looks)
        } else {
            let name = |at: usize| planes.get(at).map_or_else(|| "".into(), |plane| plane.output.clone());
            let own =
                |own: Range<usize>| Reach { name: name(own.start), planes: own, ends: [0.0; 2], pixels: 0 };
            (outputs(&planes).into_iter().map(own).collect(), 0)
        };
        Ok(bounds.of(&reaches).map(|found| {
            let mut each = vec![f32::INFINITY; planes.len()];
            for (at, own) in &found {
                let range = reaches.get(*at).map_or(0..0, |reach| reach.planes.clone());
                if let Some(planes) = each.get_mut(range) {
                    planes.fill(own.bound);
                }
            }
            let words = bounds.words(&reaches);
            Target { planes: each, each: found.into_iter().map(|(_, own)| own).collect(), words, looks }
        }))
    }

    /// The bounds in words.
    fn named(&self) -> String {
        named(&self.each)
    }

    /// Whether the image misses its bounds, in words. The comparison with an oracle decides if it is sure;
    /// otherwise the estimate from the pixels that were sampled first.
    fn missed(&self, tally: &Tally, check: Option<&Check>, most: u32) -> Option<String> {
        let estimated = tally.above / tally.pixels.max(1) as f64;
        let by_check = check.filter(|check| check.pixels > 0).and_then(|check| {
            let seen = check.above as f64 / check.pixels as f64;
            let [low, high] = limits(check, tally.pixels);
            (low > PROMISED || high <= PROMISED).then_some(seen)
        });
        let share = by_check.unwrap_or(estimated);
        let how = if by_check.is_some() { "of the compared pixels" } else { "of the pixels, as estimated," };
        (share > PROMISED && !self.each.is_empty()).then(|| {
            let help = if tally.unfinished > 0 && most < MAX_SAMPLES {
                format!("; they may have at most {most} samples, and --samples N sets this limit")
            } else {
                String::new()
            };
            format!(
                "the error bound {} is missed: {:.2} % {how} exceed it, and {} % may{help}",
                self.named(),
                100.0 * share,
                100.0 * PROMISED
            )
        })
    }
}

/// Bounds in words: a number, or one for each output.
fn named(bounds: &[Resolved]) -> String {
    let first = bounds.first().map(|own| own.bound);
    if bounds.iter().all(|own| Some(own.bound) == first) {
        return first.map_or_else(String::new, short);
    }
    let list: Vec<String> =
        bounds.iter().map(|own| format!("{} of {}", short(own.bound), own.output)).collect();
    list.join(", ")
}

/// Why an image of a surface misses its bounds, if this share of its pixels, as estimated, exceeds them.
pub fn missed(bounds: &[Resolved], share: f64) -> Option<String> {
    (share > PROMISED).then(|| {
        format!(
            "the error bound {} is missed: {:.2} % of the pixels of the surface, as estimated, exceed it, and {} % may; \
             --samples N permits more samples",
            named(bounds),
            100.0 * share,
            100.0 * PROMISED
        )
    })
}

/// The share of the pixels above their bound: its limits with a confidence of 95 %; the share itself if all
/// pixels were compared.
fn limits(check: &Check, pixels: u64) -> [f64; 2] {
    match check.pixels >= pixels {
        true => [check.above as f64 / pixels.max(1) as f64; 2],
        false => likely::share(check.above, check.pixels),
    }
}

/// An image that is computed with a plan, piece by piece.
pub struct Sampled<'a, 'b> {
    shading: &'a Shading<'b>,
    plan: Plan,
    target: &'a Target,
    tally: Tally,
    /// The pixels to compare with an oracle.
    watch: Option<Watch>,
    /// Whether the report has the comparison, which then is a thorough one.
    check: bool,
    /// The samples of each pixel, if somebody wants to know them.
    samples: Option<Vec<u32>>,
    progress: &'a (dyn Fn(usize) + Sync),
}

impl<'a, 'b> Sampled<'a, 'b> {
    /// An image before its first piece.
    pub fn new(
        shading: &'a Shading<'b>,
        (plan, target): (Plan, &'a Target),
        check: bool,
        progress: &'a (dyn Fn(usize) + Sync),
    ) -> Sampled<'a, 'b> {
        let (width, height) = shading.surface.size();
        // A promise is tested at some pixels in any case.
        let again = (width * height / 100).max(AGAIN);
        let is_promised = matches!(plan, Plan::MaxError(..)) && !target.each.is_empty();
        let watched = if check { CHECKED } else { again };
        let watch = (check || is_promised).then(|| Watch::new(width * height, watched));
        let tally = Tally { evaluations: target.looks, ..Tally::default() };
        Sampled { shading, plan, target, tally, watch, check, samples: None, progress }
    }

    /// The same; with `keeps`, the report has the samples of each pixel.
    pub fn keeping(self, keeps: bool) -> Sampled<'a, 'b> {
        Sampled { samples: keeps.then(Vec::new), ..self }
    }

    fn piece(&self, rows: Range<usize>) -> Result<Image, RunError> {
        match self.plan {
            // `within` computes an image for a time, all at once.
            Plan::Plain | Plan::Within(..) => self.shading.rows(rows, 1),
            Plan::Samples(samples, ..) => self.shading.rows(rows, samples),
            Plan::Rate(rate) => at_rate(self.shading, rows, rate),
            Plan::Adaptive(wanted, ..) => adaptive(self.shading, rows, wanted),
            Plan::MaxError(most, ..) => max_error_each(self.shading, rows, (&self.target.planes, most)),
        }
    }

    /// The cost and the error of the image.
    pub fn said(self) -> Result<Samples, RunError> {
        let mut text = spent(&self.tally);
        let mut compared = None;
        if let Some(watch) = &self.watch {
            let most = self.tally.by_samples.last().map_or(1, |(samples, _)| *samples);
            let least = if self.check { ORACLE } else { QUICK[1] };
            let many = most.saturating_mul(4).clamp(least, MAX_SAMPLES).next_power_of_two();
            let few = match (self.check, self.target.each.is_empty()) {
                (false, _) => QUICK[0],
                (true, true) => many,
                (true, false) => ORACLE,
            };
            let limits: Vec<f64> = self.target.planes.iter().copied().map(f64::from).collect();
            let check = watch.check(self.shading, &limits, [few, many])?;
            if self.check {
                text += &checked(&check, [few, many], (self.tally.pixels, Some(self.target)));
            }
            compared = Some(check);
        }
        let most = if let Plan::MaxError(most, ..) = self.plan { most } else { MAX_SAMPLES };
        let missed = self.target.missed(&self.tally, compared.as_ref(), most);
        let bounds = self.target.each.clone();
        let max_error = (!bounds.is_empty()).then(|| Kept::of(bounds, missed.is_none()));
        let notes = self.target.words.clone();
        let samples = self.samples.unwrap_or_default();
        Ok(Samples { tally: self.tally, samples, text, notes, max_error, missed, ..Samples::default() })
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
        if let Some(samples) = &mut self.samples {
            samples.extend(image.samples.each());
        }
        (self.progress)(self.tally.pixels as usize);
        Ok(image.frame)
    }

    fn weight(&self) -> usize {
        8
    }
}

/// The error of an image of so many pixels.
pub fn checked(check: &Check, [few, many]: [u32; 2], (pixels, target): (u64, Option<&Target>)) -> String {
    let some = if check.pixels < pixels { "" } else { "all " };
    let again = if check.again > 0 { format!(" ({many} at {} of them)", check.again) } else { String::new() };
    // Fewer pixels do not show one in a thousand.
    let nearly_all = match check.pixels >= 1000 || check.pixels >= pixels {
        true => format!("99.9 % below {:.3e}, ", check.nearly_all),
        false => String::new(),
    };
    let mut text = format!(
        "error at {some}{} pixels, against {few} samples each{again}: rms {:.3e}, {nearly_all}largest {:.3e} \
         (oracle's own standard error {:.1e}, subtracted)\n",
        check.pixels, check.rmse, check.largest, check.oracle
    );
    let target = target.filter(|target| !target.each.is_empty() && check.pixels > 0);
    if let Some(target) = target {
        let within = |above: f64| 100.0 * (1.0 - above);
        let share = within(check.above as f64 / check.pixels as f64);
        let _ = write!(text, "{share:.2} % of them are within {}", target.named());
        if check.pixels < pixels {
            let [_, high] = limits(check, pixels);
            let sure = 100.0 * likely::SURE;
            let _ = write!(text, "; of all pixels at least {:.2} %, with {sure} % confidence", within(high));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(bounds: &[(&str, f32)]) -> Target {
        let one = |(name, bound): &(&str, f32)| Resolved { output: (*name).to_string(), bound: *bound };
        let each = bounds.iter().map(one).collect();
        Target { planes: bounds.iter().map(|(_, bound)| *bound).collect(), each, ..Target::default() }
    }

    #[test]
    fn a_comparison_says_what_it_tells_of_all_pixels() {
        let target = target(&[("r", 0.1), ("c", 0.2)]);
        let check = Check { pixels: 4096, above: 0, again: 7, ..Check::default() };
        let text = checked(&check, [1024, 4096], (1 << 18, Some(&target)));
        assert!(
            text.starts_with("error at 4096 pixels, against 1024 samples each (4096 at 7 of them): rms"),
            "{text}"
        );
        let end = "100.00 % of them are within 0.1 of r, 0.2 of c; of all pixels at least 99.93 %, with 95 % confidence\n";
        assert!(text.ends_with(end), "{text}");
        let text = checked(&check, [1024, 4096], (4096, Some(&target)));
        assert!(text.starts_with("error at all 4096 pixels") && !text.contains("confidence"), "{text}");
    }

    #[test]
    fn a_sure_comparison_decides_and_otherwise_the_estimate_does() {
        let target = target(&[("r", 0.1)]);
        let missed = |pixels: u64, above: f64, check: Option<(u64, u64)>| {
            let tally = Tally { pixels, above, ..Tally::default() };
            let check = check.map(|(above, pixels)| Check { pixels, above, ..Check::default() });
            target.missed(&tally, check.as_ref(), 64)
        };
        assert_eq!(missed(100_000, 100.0, None), None, "one in a thousand may exceed the bound");
        let said = missed(100_000, 500.0, None).unwrap_or_default();
        assert!(
            said.contains("0.1 is missed: 0.50 % of the pixels, as estimated, exceed it, and 0.1 % may"),
            "{said}"
        );
        assert_eq!(missed(100_000, 500.0, Some((0, 4096))), None, "so many pixels without an error are sure");
        assert!(missed(100_000, 500.0, Some((4, 4096))).is_some(), "four are not");
        assert_eq!(missed(100_000, 0.0, Some((4, 4096))), None);
        let said = missed(100_000, 0.0, Some((41, 4096))).unwrap_or_default();
        assert!(said.contains("1.00 % of the compared pixels"), "{said}");
        assert!(missed(4096, 0.0, Some((5, 4096))).is_some(), "all pixels are known");
        assert_eq!(missed(4096, 900.0, Some((4, 4096))), None);
    }
}
