//! The report on a shader with levels: errors and times at each footprint, and pictures.
//!
//! Errors are those of the points that were held out. Times are the only numbers here that depend on the
//! clock.

use super::errors::Errors;
use super::ground::{By, Ground};
use super::judge::{MOST, Output, Set, Variant};
use super::original::{Known, Sizes};
use super::search::{Search, sentences};
use super::{Request, SHOWN, Written};
use crate::sample::Pattern;
use osl_exec::{PointSource, RunError};
use osl_scene::Grid;
use serde::Serialize;
use std::time::Instant;

/// The result.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// The shader.
    pub name: String,
    /// The coordinate whose derivatives say how large a pixel is.
    pub coordinate: String,
    /// How the size of a pixel is measured in it.
    pub by: By,
    /// The size of a pixel at footprint 1.
    pub width: f64,
    /// The number of samples of the original whose error a level must not exceed.
    pub samples: u32,
    /// The error up to which a level is good in any case, as a share of the range.
    pub tolerance: f64,
    /// The largest root mean square error of a mean, as a share of the range.
    pub error: f64,
    /// The seed of the points.
    pub seed: u32,
    /// Samples of each reference value.
    pub reference_samples: u32,
    /// The outputs.
    pub outputs: Vec<String>,
    /// The cost of the original, in additions.
    pub cost: f64,
    /// Number of calls of noise that fade to the mean of the noise.
    pub faded_noise: usize,
    /// The width of a pixel from which on they fade, in cells of the noise.
    pub noise_width: f64,
    /// Number of edges that become softer.
    pub soft_edges: usize,
    /// The level at which all outputs are their means, if there is one.
    pub level: Option<Level>,
    /// If there is no level: why, for each kind of level that was tried.
    pub why: Vec<String>,
    /// Errors and times by footprint.
    pub rows: Vec<Row>,
    /// Number of changed sources that were tried.
    pub tried: usize,
    /// Whether the time was over before everything was measured.
    pub cut_short: bool,
    /// The written source, if anything is replaced.
    #[serde(skip)]
    pub text: Option<String>,
    /// Pictures, if they were requested.
    #[serde(skip)]
    pub pictures: Vec<Picture>,
}

/// The means of all outputs, from a size of a pixel on.
#[derive(Clone, Debug, Serialize)]
pub struct Level {
    /// The size of a pixel at which it begins to fade in, and at which it is complete.
    pub widths: [f64; 2],
    /// The footprint at which it is complete.
    pub footprint: f64,
    /// Its cost alone, in additions.
    pub cost: f64,
    /// The largest root mean square error of an output from there on, with two standard errors.
    pub error: f64,
    /// The same of the original.
    pub original_error: f64,
}

/// A footprint.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// How many times larger a pixel is than in the given image.
    pub footprint: f64,
    /// The size of a pixel in the coordinate.
    pub width: f64,
    /// The errors of the original with one sample.
    pub original: Errors,
    /// The errors of the written shader with one sample.
    pub written: Errors,
    /// The number of samples with which the worst output of the original has the error of the worst output of
    /// the written shader. The original was measured with up to [`Row::most`] samples. An error up to the
    /// tolerance is equal to that of one sample at least.
    pub equal_samples: f64,
    /// The largest number of samples that was measured.
    pub most: u32,
    /// Nanoseconds of a sample: of the original and of the written shader; empty if the time was over.
    pub ns: Option<[f64; 2]>,
    /// How many times less time the written shader takes than the original at the same error.
    pub cheaper: Option<f64>,
}

/// Pictures of an output at a footprint, side by side.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The output.
    pub output: String,
    /// The footprint.
    pub footprint: f64,
    /// Pixels per row, and number of rows.
    pub size: usize,
    /// Many samples, one sample of the original, and one of the written shader: for each one or three
    /// planes with values from 0 to 1.
    pub images: [Vec<Vec<f32>>; 3],
}

/// Columns and rows of an image that is timed: at least and at most. The start of a run takes as long as many
/// points of a small shader.
const TIMED: (f64, f64) = (128.0, 512.0);
/// The work of an image that is timed, in additions, if its size allows it.
const IMAGE: f64 = 4e7;
/// How often each program is timed: at least and at most, and the work of all turns, in additions.
const TURNS: (f64, f64) = (5.0, 60.0);
const WORK: f64 = 1e9;
/// Columns and rows of a picture.
const PICTURE: usize = 96;
/// Maximum number of outputs with pictures.
const SHOWN_OUTPUTS: usize = 4;
/// Samples of the first picture.
pub(super) const MANY: u32 = 32;

pub(super) fn report(request: &Request<'_>, search: &Search<'_, '_>, found: Option<Written>) -> Report {
    let by = found.as_ref().map_or(By::default(), |found| found.plan.by);
    let mut report = Report {
        name: request.program.shader.name.to_string(),
        coordinate: search.inputs.coordinate.name().to_string(),
        by,
        width: search.width(by),
        samples: request.samples,
        tolerance: request.tolerance,
        error: request.error,
        seed: request.seed,
        reference_samples: search.judge.samples(),
        outputs: search.judge.outputs.iter().map(|output| output.name.clone()).collect(),
        cost: search.original.cost,
        tried: search.tried,
        ..Report::default()
    };
    let level = found.as_ref().and_then(|found| found.plan.far.as_ref());
    if level.is_none() {
        report.why = sentences(&search.failed, &report.outputs, report.samples);
    }
    let Some(found) = found else { return report };
    report.level = found.plan.far.as_ref().map(|far| Level {
        widths: [report.width * far.full * far.begin, report.width * far.full],
        footprint: far.full,
        cost: far.planes.len() as f64,
        error: found.errors[0],
        original_error: found.errors[1],
    });
    report.faded_noise = found.plan.inner.calls;
    report.noise_width = found.plan.inner.start;
    report.soft_edges = found.plan.inner.edges;
    // If the time is over, what is known so far is reported.
    report.cut_short = rest(request, search, &found, &mut report).is_err();
    report.text = Some(found.text);
    report
}

fn rest(
    request: &Request<'_>,
    search: &Search<'_, '_>,
    found: &Written,
    report: &mut Report,
) -> Result<(), RunError> {
    for known in search.known.of_set(Set::HeldOut, Sizes::ALL) {
        let [x, y] = known.truth.sides;
        if x == y && SHOWN.contains(&x) {
            report.rows.push(row(search, found, (known, report.width * x))?);
        }
    }
    for row in &mut report.rows {
        let ns = time(search, found, row.footprint)?;
        row.ns = Some(ns);
        row.cheaper = Some(row.equal_samples * ns[0] / ns[1].max(1e-3));
    }
    if request.pictures {
        pictures(search, found, report)?;
    }
    Ok(())
}

fn row(search: &Search<'_, '_>, found: &Written, (known, width): (&Known, f64)) -> Result<Row, RunError> {
    let judge = search.judge;
    let footprint = known.truth.sides[0];
    let most = MOST.min(2 * judge.samples());
    let mut curve = Vec::new();
    let mut first = None;
    let mut samples = 1;
    while samples <= most {
        let off = judge.off(search.original, &known.truth, samples)?;
        curve.push((f64::from(samples), off.errors().worst));
        first.get_or_insert(off);
        samples *= 2;
    }
    let written = judge.off(&found.variant, &known.truth, 1)?;
    let mut equal_samples = equal(&curve, written.errors().worst);
    if written.errors().worst <= search.known.bounds.tolerance {
        equal_samples = equal_samples.max(1.0);
    }
    let original = first.as_ref().unwrap_or(&known.original).errors();
    Ok(Row {
        footprint,
        width,
        original,
        equal_samples,
        written: written.errors(),
        most,
        ns: None,
        cheaper: None,
    })
}

/// The number of samples with which the worst output of the original has the same error, from a curve of such
/// errors. Their squares are interpolated between measured numbers, and below one sample they fall with their
/// number.
fn equal(curve: &[(f64, f64)], error: f64) -> f64 {
    let square = error * error;
    let Some((_, first)) = curve.first().map(|(samples, error)| (samples, error * error)) else { return 1.0 };
    if square >= first {
        // Equal errors, and both 0, are one sample.
        return if square > 0.0 { first / square } else { 1.0 };
    }
    for pair in curve.windows(2) {
        let [(few, high), (many, low)] = pair else { continue };
        let (high, low) = (high * high, low * low);
        if square >= low && high > low {
            let share = (high - square) / (high - low);
            return few + share * (many - few);
        }
    }
    curve.last().map_or(1.0, |(samples, _)| *samples)
}

/// The smallest times of a sample at a footprint, measured in turns: other work on the machine only adds.
fn time(search: &Search<'_, '_>, found: &Written, footprint: f64) -> Result<[f64; 2], RunError> {
    let judge = search.judge;
    let work = search.original.cost.max(1.0);
    let size = (IMAGE / work).sqrt().clamp(TIMED.0, TIMED.1) as usize;
    let grid = enlarged(judge.grid, size);
    // A run with one sample computes a grid. Random directions would take longer than many shaders.
    let ground = Ground::new(&grid, [footprint; 2], 0.0, &[], judge.seed).still();
    let source: &dyn PointSource = if judge.turned.is_empty() { &ground.grid } else { &ground };
    let mut times = [Vec::new(), Vec::new()];
    let turns = WORK / ((size * size) as f64 * work);
    for turn in 0..=turns.clamp(TURNS.0, TURNS.1) as usize {
        for (list, variant) in times.iter_mut().zip([search.original, &found.variant]) {
            let started = Instant::now();
            osl_exec::run(&variant.compiled.program, judge.services, source, judge.options, &|_| ())?;
            // The first turn loads textures.
            if turn > 0 {
                list.push(1e9 * started.elapsed().as_secs_f64() / (size * size) as f64);
            }
        }
    }
    Ok(times.map(|list| list.into_iter().fold(f64::INFINITY, f64::min)))
}

/// A grid with more or fewer pixels of the same size.
fn enlarged(grid: &Grid, size: usize) -> Grid {
    let mut scale = grid.scale;
    for (scale, n) in scale.iter_mut().zip([grid.width, grid.height]) {
        let steps = |n: usize| if grid.center { n } else { n.saturating_sub(1).max(1) } as f32;
        *scale *= steps(size) / steps(n);
    }
    Grid { width: size, height: size, scale, ..grid.clone() }
}

fn pictures(search: &Search<'_, '_>, found: &Written, report: &mut Report) -> Result<(), RunError> {
    let judge = search.judge;
    let grid = enlarged(judge.grid, PICTURE);
    for footprint in SHOWN {
        let place = judge.ground([footprint; 2], Set::HeldOut);
        let ground = Ground::new(&grid, [footprint; 2], 0.0, &judge.turned, judge.seed);
        let ground = ground.moved_to(&place).still();
        let pattern = Pattern::new(MANY, judge.seed);
        let image = |variant: &Variant, samples: u32| -> Result<Vec<Vec<f32>>, RunError> {
            let shading = judge.shading(variant, &ground, &pattern);
            let image = shading.rows(0..PICTURE, samples)?;
            Ok(image.frame.planes.iter().map(|plane| plane.floats()).collect())
        };
        let images = [image(search.original, MANY)?, image(search.original, 1)?, image(&found.variant, 1)?];
        for output in judge.outputs.iter().take(SHOWN_OUTPUTS) {
            let images = images.each_ref().map(|planes| shown(output, planes));
            report.pictures.push(Picture { output: output.name.clone(), footprint, size: PICTURE, images });
        }
    }
    Ok(())
}

/// The planes of an output, so that its range is 0 to 1, except colors, which are shown as they are.
fn shown(output: &Output, planes: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let is_color = output.ty == osl_ir::types::Type::COLOR;
    let [low, high] = if is_color { [0.0, 1.0] } else { output.ends };
    let scale = 1.0 / (high - low).max(1e-30);
    let one = |plane: &Vec<f32>| plane.iter().map(|x| ((x - low) * scale).clamp(0.0, 1.0)).collect();
    planes.get(output.planes.clone()).unwrap_or(&[]).iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_numbers_of_samples_are_interpolated() {
        let curve = [(1.0, 0.4), (2.0, 0.2), (4.0, 0.1)]
            .map(|(samples, square): (f64, f64)| (samples, square.sqrt()));
        let of = |square: f64| equal(&curve, square.sqrt());
        assert!((of(0.4) - 1.0).abs() < 1e-9 && (of(0.8) - 0.5).abs() < 1e-9);
        assert!((of(0.3) - 1.5).abs() < 1e-9 && (of(0.15) - 3.0).abs() < 1e-9);
        assert_eq!(of(0.0), 4.0);
        assert_eq!(equal(&[(1.0, 0.0)], 0.0), 1.0);
    }
}
