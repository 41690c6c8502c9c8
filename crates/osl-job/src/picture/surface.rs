//! Shades a shape or a mesh that a camera sees.
//!
//! The surface is displaced first if requested; then the visible points are shaded. Each output becomes a
//! picture with alpha: colors stay colors, numbers become masks, and normals become normal maps.

use super::sampling::Plan;
use super::sight::{Job, scattered};
use super::{Done, seen, setup};
use crate::file::output;
use crate::report::messages::Report;
use crate::report::stats::Stats;
use crate::source::load::LoadedShader;
use crate::{Failure, Image, Sink};
use osl_exec::{Plane, PointSource, Spaces};
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use std::time::Instant;

/// Shades a view of a surface and writes it.
pub(super) fn run(
    image: &Image,
    loaded: &LoadedShader,
    started: Instant,
    sink: &mut dyn Sink,
) -> Result<Done, Failure> {
    let mut job = Job::new(image, loaded, image.points.surface.displace.clone(), sink.meters())?;
    let displace = job.displacement()?;
    let shown = job.shown();
    let program = (!shown.is_empty()).then(|| job.compile(&shown)).transpose()?;
    let compile = started.elapsed();

    let started = Instant::now();
    let programs = (displace.as_ref(), program.as_ref());
    let threads = image.running.threads;
    let (frame, coverage, count, samples) = match image.sampling.plan()? {
        Plan::Plain => {
            let (seen, mut frame) = setup::on_threads(threads, || job.picture(programs))??;
            for said in &mut frame.messages {
                said.first = seen.pixels.get(said.first).map_or(0, |pixel| *pixel as usize);
            }
            let (width, height) = image.points.grid;
            let coverage = scattered(&vec![1.0; seen.pixels.len()], &seen.pixels, width * height);
            (frame, coverage, seen.points.count() as u64, None)
        }
        plan => {
            let (seen, samples) = setup::on_threads(threads, || seen::picture(&mut job, programs, plan))??;
            (seen.frame, seen.coverage, seen.tally.evaluations, Some(samples))
        }
    };
    let time = started.elapsed();
    job.send_facts(sink);
    output::printed(&frame.printed, output::Appends::of(image), sink)?;
    let textures = setup::services(image, loaded.folder.clone(), Spaces::default()).textures;
    let report = Report {
        sources: &loaded.sources,
        points: (job.vertices as u64, "vertices"),
        width: None,
        textures: &textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    let mut messages = report.send(&job.displaced, sink);
    let points = (count, if samples.is_some() { "samples" } else { "points" });
    messages.add(Report { points, width: Some(image.points.grid.0), ..report }.send(&frame.messages, sink));
    messages.judge(image.shader.lints.denies_errors())?;
    let alpha = alpha(&coverage);

    sink.settle()?;
    let started = Instant::now();
    let mut done = Done { frame, messages, samples, times: [compile, time], ..Done::default() };
    if let Some(path) = &image.output.path {
        (done.files, done.piped) = output::write(&done.frame, Some(&alpha), path, image)?.save(path, sink)?;
    }
    let times = [compile, time, started.elapsed()];
    let compiled = program.as_ref().or(displace.as_ref()).filter(|_| image.wanted.stats);
    done.stats =
        compiled.map(|program| Stats::of(program, (loaded.body.count(), count), times, &image.running));
    if image.wanted.ranges {
        let planes = &done.frame.planes;
        setup::on_threads(threads, || done.ranges.add(planes))?;
    }
    done.covered = Some(alpha);
    done.count(image);
    (done.sources, done.name) = (loaded.sources.clone(), loaded.name.clone());
    Ok(done)
}

/// The share of each pixel that shows the surface.
fn alpha(coverage: &[f32]) -> Plane {
    Plane {
        output: "A".into(),
        ty: Type::FLOAT,
        component: 0,
        kind: Kind::Float,
        words: coverage.iter().map(|share| share.to_bits()).collect(),
        wide: Vec::new(),
    }
}
