//! What the commands prove or write about programs of the generator: bounds, and levels of detail.

use super::{broken, hash};
use crate::fuzz::mutate::Random;
use crate::{enclosed, generate, laws, run};
use osl::stages::{self, Compiled};
use osl_exec::{PointSource, RunError, RunOptions};
use osl_ir::passes;
use osl_limits::{Cancel, Limits};
use osl_measure::bounds;
use osl_measure::lod::{self, Stop};
use osl_measure::stability::fix::Built;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::collections::BTreeSet;
use std::sync::mpsc;
use std::time::Duration;

/// Bounds for a part of the plane, and runs at random points of it.
pub fn bounds(bytes: &[u8]) -> u64 {
    let text = generate::program(bytes);
    let (scale, offset) = ([3.0, 2.5], [-1.0, -0.7]);
    // The points have the same derivatives wherever their grid is.
    let points = Grid { scale: [1.0, 0.7], ..Grid::new(5, 4) };
    let services = laws::services();
    let Some(proven) = enclosed::prove(&text, services, &points, (scale, offset), 24) else { return 0 };
    bounds::text::text(&proven.report);
    let mut random = Random::new(hash(bytes));
    for _ in 0..4 {
        let place = |axis: usize, share: f32| offset[axis] + share * (scale[axis] - points.scale[axis]);
        let shares = [0, 1].map(|_| random.below(1 << 12) as f32 / 4100.0);
        let moved = Grid { offset: [place(0, shares[0]), place(1, shares[1])], ..points.clone() };
        if let Some(what) = enclosed::violation(&proven, &text, services, &moved) {
            broken(&text, &format!("at {:?}: {what}", moved.offset));
        }
    }
    let verdicts: BTreeSet<u64> = proven.report.claims.iter().map(|claim| claim.kind.bit().into()).collect();
    verdicts.into_iter().fold(proven.report.outputs.len() as u64, |sum, bit| sum.rotate_left(9) ^ bit)
}

/// Compiles a text for the points of a grid.
fn compiled(text: &str, points: &Grid) -> Option<Compiled> {
    let passes = passes::Options {
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        ..passes::Options::default()
    };
    run::compile("generated.osl", text, &[], &passes).ok()
}

/// The bits of all outputs.
fn bits(text: &str, points: &Grid, options: &RunOptions) -> Option<Result<Vec<Vec<u32>>, RunError>> {
    let compiled = compiled(text, points)?;
    let frame = osl_exec::run(&compiled.program, laws::services(), points, options, &|_| ());
    Some(frame.map(|frame| frame.planes.into_iter().map(|plane| plane.words.to_vec()).collect()))
}

/// The time of a search for levels, like that of `oslrun lod`.
const LOD_SECONDS: u64 = 2;

/// Cancels after so many seconds; the watch ends when the sender is dropped.
fn within(seconds: u64) -> (Cancel, mpsc::Sender<()>) {
    let cancel = Cancel::new();
    let watched = cancel.clone();
    let (running, ends) = mpsc::channel::<()>();
    std::thread::spawn(move || {
        if ends.recv_timeout(Duration::from_secs(seconds)) == Err(mpsc::RecvTimeoutError::Timeout) {
            watched.cancel();
        }
    });
    (cancel, running)
}

/// Levels of detail: what is written compiles, and has the bits of the original where the original runs.
pub fn lod(bytes: &[u8]) -> u64 {
    let text = generate::program(bytes);
    let checked = stages::check("generated.osl", &text, &NoFiles, &Options::default());
    let Some(program) = &checked.program else { return 0 };
    let Ok(body) = stages::lower(program, &[]) else { return 1 };
    let build = |text: &str| {
        let checked = stages::check("generated.osl", text, &NoFiles, &Options::default());
        let program = checked.program?;
        let plain = stages::lower(&program, &[]).ok()?;
        Some(Built { program, sources: checked.sources, plain, noted: None })
    };
    let grid = Grid::new(4, 3);
    let mut limits = Limits::default();
    limits.running.point_steps = 2_000;
    let (cancel, watch) = within(LOD_SECONDS);
    let watched = RunOptions { limits: limits.until(&cancel), ..RunOptions::default() };
    let options = RunOptions { limits, ..RunOptions::default() };
    let found = lod::lod(&lod::Request {
        text: &text,
        program,
        body,
        given: &[],
        build: &build,
        grid: &grid,
        services: laws::services(),
        options: &watched,
        samples: 1,
        tolerance: 0.004,
        error: 0.2,
        seed: 1,
        pictures: false,
    });
    drop(watch);
    let report = match found {
        Ok(report) => report,
        Err(Stop::Refused(why)) if why.contains("bug") => broken(&text, &why),
        Err(Stop::Refused(why)) => return super::message(&why),
        Err(Stop::Run(_)) => return 2,
    };
    lod::text(&report);
    let Some(written) = &report.text else { return 3 };
    let Some(new) = bits(written, &grid, &options) else {
        broken(&text, &format!("{written}\nwhat is written does not compile"))
    };
    // Noise fades by the width of its own argument, which may be wide at any footprint; and an edge without
    // a width treats NaN in another way.
    let is_same_near = report.faded_noise == 0 && report.soft_edges == 0;
    let old = bits(&text, &grid, &options);
    if let (true, Some(Ok(old)), Ok(new)) = (is_same_near, old, &new)
        && old != *new
    {
        broken(&text, &format!("{written}\nwhat is written has other values at footprint 1"));
    }
    4 + u64::from(is_same_near) + 2 * u64::from(report.level.is_some())
}
