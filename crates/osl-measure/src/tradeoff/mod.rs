//! Trades speed for accuracy: runs a shader at a ladder of settings, times each, and compares each with an
//! oracle.
//!
//! The settings run in turns, round after round, so that a temporary slowdown of the machine affects all of
//! them; the median time of a setting counts. A report names the setting to take for an error. Errors cover
//! every pixel of the image, with the oracle's standard error subtracted.

mod advice;
mod front;
mod html;
mod report;

pub use html::html;
pub use report::{csv, text};

use crate::sample::{
    Adaptive, Check, Image, MAX_SAMPLES, Oracle, PROMISED, Pattern, Rate, Reach, Shading, adaptive, at_rate,
    check, max_error_each, oracle, reaches, some_pixels,
};
use front::Measured;
use osl_exec::{Frame, Plane, RunError};
use serde::Serialize;
use std::fmt;
use std::time::{Duration, Instant};

/// How many evaluations of the shader an image has, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// One evaluation for several pixels.
    Rate(Rate),
    /// The same number in each pixel.
    Samples(u32),
    /// Until the standard error is below this.
    Adaptive(f32),
    /// As few as an error of so many percent of each output's range permits.
    MaxError(f32),
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Rate(rate) => write!(f, "rate {rate}"),
            Setting::Samples(1) => write!(f, "1 sample"),
            Setting::Samples(n) => write!(f, "{n} samples"),
            Setting::Adaptive(threshold) => write!(f, "adaptive {threshold}"),
            Setting::MaxError(percent) => write!(f, "max error {percent}%"),
        }
    }
}

/// Maximum samples per pixel for adaptive settings.
const MOST: u32 = 1024;

impl Setting {
    /// The tried settings, the cheapest first.
    pub fn ladder() -> Vec<Setting> {
        let mut ladder: Vec<Setting> =
            [[4, 4], [2, 2], [2, 1]].into_iter().map(|rate| Setting::Rate(Rate(rate))).collect();
        ladder.extend([1, 4, 16, 64, 256].map(Setting::Samples));
        ladder.extend([0.1, 0.03, 0.01].map(Setting::Adaptive));
        ladder.extend(advice::WANTED.map(Setting::MaxError));
        ladder
    }

    /// Renders the image of this setting.
    ///
    /// # Errors
    /// A loop exceeds its budget.
    pub fn image(self, shading: &Shading<'_>) -> Result<Image, RunError> {
        let rows = 0..shading.surface.size().1;
        match self {
            Setting::Rate(rate) => at_rate(shading, rows, rate),
            Setting::Samples(samples) => shading.rows(rows, samples),
            Setting::Adaptive(threshold) => adaptive(shading, rows, Adaptive { threshold, most: MOST }),
            Setting::MaxError(percent) => {
                let mut bounds = vec![f32::INFINITY; shading.planes().len()];
                for reach in reaches(shading)? {
                    let bound = (percent / 100.0 * reach.size()).max(f32::MIN_POSITIVE);
                    bounds.get_mut(reach.planes).unwrap_or_default().fill(bound);
                }
                max_error_each(shading, rows, (&bounds, MOST))
            }
        }
    }

    /// Approximate evaluations per pixel; for adaptive settings, the most that are likely.
    fn cost(self) -> f64 {
        match self {
            Setting::Rate(Rate([x, y])) => 1.0 / f64::from(x * y),
            Setting::Samples(n) => f64::from(n),
            Setting::Adaptive(error) => f64::from(2.0 / error).min(64.0),
            Setting::MaxError(percent) => f64::from(200.0 / percent).min(64.0),
        }
    }
}

/// A way to run the shader: an arithmetic, or the program with widened steps.
pub struct Variant<'a> {
    /// Its name: `strict`, `prefilter`.
    pub name: String,
    /// The program and everything needed to run it.
    pub shading: Shading<'a>,
    /// The settings worth measuring with it.
    pub settings: Vec<Setting>,
}

/// What to measure.
pub struct Request<'a> {
    /// Name of the shader.
    pub name: String,
    /// The ways to run it; speeds are relative to the first with one sample.
    pub variants: Vec<Variant<'a>>,
    /// The most accurate way to run it, for the oracle. If the first of the ways above agrees with it, the
    /// oracle uses that one, which has time for more samples.
    pub oracle: (String, Shading<'a>),
    /// Approximate time budget.
    pub budget: Duration,
    /// Ways that are not measured, because they change nothing: a sentence for each.
    pub idle: Vec<String>,
}

/// The measurements.
#[derive(Clone, Debug, Serialize)]
pub struct Trade {
    /// Name of the shader.
    pub name: String,
    /// Pixels per row, and number of rows.
    pub size: (usize, usize),
    /// The arithmetic of the oracle.
    pub oracle: String,
    /// The oracle's samples per pixel.
    pub oracle_samples: u32,
    /// How often each setting was timed.
    pub repeats: usize,
    /// The settings.
    pub rows: Vec<Row>,
    /// The outputs, each with an error for each row.
    pub outputs: Vec<Output>,
    /// Ways that were not measured, because they change nothing: a sentence for each.
    pub idle: Vec<String>,
}

/// A setting and its times.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The way to run it.
    pub variant: String,
    /// The setting.
    pub setting: String,
    /// The options of a command line for it.
    pub options: String,
    /// Median time of a pixel.
    pub ns_per_pixel: f64,
    /// The time of a pixel in the fastest round.
    pub ns_least: f64,
    /// How far that is below the median, as a share of the median.
    pub spread: f64,
    /// Speed relative to one sample per pixel.
    pub speed_up: f64,
    /// Evaluations of the shader for each pixel.
    pub evaluations: f64,
}

/// The accuracy of an output at each setting.
#[derive(Clone, Debug, Serialize)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// The size of its range, of which an error may be a share.
    pub range: f64,
    /// Root mean square of the oracle's standard error.
    pub oracle_error: f64,
    /// Errors, one for each row of the trade, with the oracle's own error subtracted.
    pub errors: Vec<Error>,
    /// The front, the fastest row first. No row of it is better than another one in time or root mean square
    /// error without being worse in the other of the two. Each row outside is beaten by one of the front.
    /// Differences within the spread of the times, and errors that differ by less than 2 %, do not count.
    pub front: Vec<usize>,
    /// Pictures of the errors, one for each row of the front.
    #[serde(skip)]
    pub pictures: Vec<Picture>,
}

/// The error of an output.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Error {
    /// Root mean square.
    pub rms: f64,
    /// Exceeded by one pixel in a thousand.
    pub nearly_all: f64,
    /// Largest of all pixels.
    pub largest: f64,
}

/// A small picture of errors: each of its pixels shows the largest error of the image pixels that it covers.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels per row.
    pub width: usize,
    /// Errors, row by row.
    pub values: Vec<f32>,
}

/// Minimum samples per pixel of the oracle.
const ORACLE: u32 = 64;
/// Shares of the time budget: for the oracle, and for the first run of all settings.
const SHARES: (f64, f64) = (0.4, 0.2);
/// Minimum and maximum number of times that a setting is timed.
const REPEATS: (usize, usize) = (3, 9);

/// Runs the ladder.
///
/// # Errors
/// A loop exceeds its budget.
pub fn tradeoff(request: &Request<'_>) -> Result<Trade, RunError> {
    let (oracle_name, best) = best(request)?;
    let size = best.surface.size();
    let pixels: Vec<u32> = (0..(size.0 * size.1) as u32).collect();
    let budget = request.budget.as_secs_f64();
    // One run loads the shader's textures into memory; a second one measures the cost of an evaluation.
    Setting::Samples(1).image(best)?;
    let started = Instant::now();
    Setting::Samples(1).image(best)?;
    let once = started.elapsed().as_secs_f64().max(1e-6);
    let affordable = (SHARES.0 * budget / once) as u32;
    let samples = 1_u32 << affordable.clamp(ORACLE, MAX_SAMPLES / 4).ilog2();
    let truth = oracle(best, &pixels, samples)?;

    let mut tried = Vec::new();
    for variant in &request.variants {
        Setting::Samples(1).image(&variant.shading)?;
        let started = Instant::now();
        Setting::Samples(1).image(&variant.shading)?;
        let once = started.elapsed().as_secs_f64().max(1e-6);
        for setting in &variant.settings {
            let too_fine = matches!(setting, Setting::Samples(n) if 2 * n > samples);
            if !too_fine && setting.cost() * once <= SHARES.1 * budget / 4.0 {
                tried.push(SettingRun { variant, setting: *setting, times: Vec::new(), image: None });
            }
        }
    }
    let repeats = time(&mut tried, budget * (1.0 - SHARES.0))?;
    let rows = rows(&tried, size);
    let reaches = reaches(request.variants.first().map_or(best, |variant| &variant.shading))?;
    let outputs = reaches.iter().map(|reach| judge(reach, &truth, &tried, (size.0, &rows)));
    Ok(Trade {
        name: request.name.clone(),
        size,
        oracle: oracle_name.to_string(),
        oracle_samples: samples,
        repeats,
        outputs: outputs.collect(),
        rows,
        idle: request.idle.clone(),
    })
}

/// The comparison that decides what the oracle uses: the number of pixels, their samples, and the largest
/// difference as a share of an output's range. As for errors, one pixel in a thousand may differ more.
const COMPARED: usize = 1024;
const FIRST_SAMPLES: u32 = 4;
const AGREE: f32 = 1e-4;

/// The way to run the shader for the oracle, with its name.
fn best<'r, 'a>(request: &'r Request<'a>) -> Result<(&'r str, &'r Shading<'a>), RunError> {
    let (name, accurate) = &request.oracle;
    let Some(usual) = request.variants.first() else { return Ok((name, accurate)) };
    let (width, height) = accurate.surface.size();
    let pixels = some_pixels(width * height, COMPARED, 0x0a91);
    let values = usual.shading.chosen(&pixels, FIRST_SAMPLES)?;
    let accurate_values = accurate.chosen(&pixels, FIRST_SAMPLES)?;
    let mut differs = vec![false; pixels.len()];
    for reach in reaches(&usual.shading)? {
        let limit = AGREE * reach.size();
        for plane in reach.planes {
            let (Some(a), Some(b)) = (values.get(plane), accurate_values.get(plane)) else { continue };
            for (differs, (a, b)) in differs.iter_mut().zip(a.iter().zip(b)) {
                *differs |= a != b && (a.is_nan() != b.is_nan() || (a - b).abs() > limit);
            }
        }
    }
    let count = differs.iter().filter(|differs| **differs).count();
    let agree = count as f64 <= PROMISED * pixels.len() as f64;
    Ok(if agree { (&usual.name, &usual.shading) } else { (name, accurate) })
}

/// A setting in progress.
struct SettingRun<'r, 'a> {
    variant: &'r Variant<'a>,
    setting: Setting,
    times: Vec<f64>,
    image: Option<Image>,
}

/// Runs all settings in turns for about `seconds`. Returns the number of rounds.
fn time(tried: &mut [SettingRun<'_, '_>], seconds: f64) -> Result<usize, RunError> {
    let started = Instant::now();
    let mut repeats = 0;
    while repeats < REPEATS.1 {
        let before = Instant::now();
        for one in tried.iter_mut() {
            let began = Instant::now();
            let image = one.setting.image(&one.variant.shading)?;
            one.times.push(began.elapsed().as_secs_f64());
            one.image = Some(image);
        }
        repeats += 1;
        let left = seconds - started.elapsed().as_secs_f64();
        if repeats >= REPEATS.0 && left < before.elapsed().as_secs_f64() {
            break;
        }
    }
    Ok(repeats)
}

fn rows(tried: &[SettingRun<'_, '_>], size: (usize, usize)) -> Vec<Row> {
    let scale = 1e9 / (size.0 * size.1).max(1) as f64;
    let median = |one: &SettingRun<'_, '_>| {
        let mut sorted = one.times.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    };
    let plain = tried.iter().find(|one| one.setting == Setting::Samples(1)).map_or(f64::NAN, median);
    let row = |one: &SettingRun<'_, '_>| {
        let (least, middle) = (one.times.iter().copied().fold(f64::INFINITY, f64::min), median(one));
        Row {
            variant: one.variant.name.clone(),
            setting: one.setting.to_string(),
            options: advice::options(&one.variant.name, one.setting),
            ns_per_pixel: scale * middle,
            ns_least: scale * least,
            spread: (middle - least) / middle,
            speed_up: plain / middle,
            evaluations: one.image.as_ref().map_or(0.0, |image| image.tally.per_pixel()),
        }
    };
    tried.iter().map(row).collect()
}

fn judge(
    reach: &Reach,
    truth: &Oracle,
    tried: &[SettingRun<'_, '_>],
    (width, rows): (usize, &[Row]),
) -> Output {
    let range = reach.planes.clone();
    let pick = |list: &[Vec<f32>]| list.get(range.clone()).unwrap_or(&[]).to_vec();
    let own = Oracle {
        pixels: truth.pixels.clone(),
        samples: truth.samples,
        values: pick(&truth.values),
        errors: pick(&truth.errors),
        said: Frame::default(),
    };
    let values = |one: &SettingRun<'_, '_>| -> Vec<Vec<f32>> {
        let planes = one.image.as_ref().and_then(|image| image.frame.planes.get(range.clone()));
        planes.unwrap_or(&[]).iter().map(Plane::floats).collect()
    };
    let checks: Vec<Check> =
        tried.iter().map(|one| check(&values(one), &own, &[], |pixel| pixel as usize)).collect();
    let errors: Vec<Error> = checks
        .iter()
        .map(|c| Error { rms: c.rmse, nearly_all: c.nearly_all.max(0.0), largest: c.largest.max(0.0) })
        .collect();
    let oracle = checks.first().map_or(0.0, |c| c.oracle);
    let front = Measured { rows, errors: &errors, oracle }.front();
    let picture = |row: &usize| tried.get(*row).map(|one| picture(&values(one), &own.values, width));
    Output {
        name: reach.name.to_string(),
        range: f64::from(reach.size()),
        oracle_error: oracle,
        pictures: front.iter().filter_map(picture).collect(),
        errors,
        front,
    }
}

/// Pixels per row of a picture.
const PICTURE: usize = 160;

fn picture(values: &[Vec<f32>], truth: &[Vec<f32>], width: usize) -> Picture {
    let step = width.div_ceil(PICTURE).max(1);
    let height = values.first().map_or(0, |plane| plane.len() / width.max(1));
    let small = (width.div_ceil(step), height.div_ceil(step));
    let mut errors = vec![0.0_f32; small.0 * small.1];
    for (plane, truth) in values.iter().zip(truth) {
        for (at, (a, b)) in plane.iter().zip(truth).enumerate() {
            let place = at / width / step * small.0 + at % width / step;
            if let Some(error) = errors.get_mut(place) {
                *error = error.max((a - b).abs());
            }
        }
    }
    Picture { width: small.0, values: errors }
}

/// A pattern with more samples than any setting of the ladder needs.
pub fn pattern() -> Pattern {
    Pattern::new(256, 0)
}
