//! `--on SURFACE`: shades a shape or a mesh that a camera sees.
//!
//! The surface is displaced first if requested; then the visible points are shaded. Each output becomes a
//! picture with alpha: colors stay colors, numbers become masks, and normals become normal maps.

use super::args::RunArgs;
use super::load::LoadedShader;
use super::ranges::{Ranges, summary};
use super::sampling::Plan;
use super::shading::Report;
use super::streams::Streams;
use super::summary::{About, Stats};
use super::surface::{Job, scattered};
use super::{Failure, histogram, output, session, sight};
use osl_exec::{Plane, PointSource, Spaces};
use osl_ir::ir::Kind;
use osl_ir::types::Type;
use std::io::Write;
use std::time::Instant;

/// Shades a view of a surface and writes it.
pub(super) fn run(
    args: &RunArgs,
    loaded: &LoadedShader,
    started: Instant,
    about: Option<&mut About>,
    streams: &mut Streams<'_>,
) -> Result<(), Failure> {
    let Streams { out, err, picture, kept, .. } = streams;
    let mut job = Job::new(args, loaded, args.on.displace.clone())?;
    let displace = job.displacement()?;
    let shown = job.shown();
    let program = (!shown.is_empty()).then(|| job.compile(&shown)).transpose()?;
    let compile = started.elapsed();

    let started = Instant::now();
    let programs = (displace.as_ref(), program.as_ref());
    let (frame, coverage, count, said) = match args.sampling.plan()? {
        Plan::Plain => {
            let (seen, mut frame) = session::on_threads(args.threads, || job.picture(programs))??;
            for said in &mut frame.messages {
                said.first = seen.pixels.get(said.first).map_or(0, |pixel| *pixel as usize);
            }
            let mut coverage = vec![1.0; seen.pixels.len()];
            coverage = scattered(&coverage, &seen.pixels, args.grid.0 * args.grid.1);
            (frame, coverage, seen.points.count() as u64, None)
        }
        plan => {
            let (image, said) =
                session::on_threads(args.threads, || sight::picture(&mut job, programs, plan))??;
            (image.frame, image.coverage, image.tally.evaluations, Some(said))
        }
    };
    let time = started.elapsed();
    job.notes.iter().for_each(|note| {
        let _ = writeln!(err, "{}", osl_syntax::escape::shown(&note.to_string()));
    });
    output::printed(&frame.printed, output::Appends::of(args), out)?;
    let textures = session::services(args, loaded.folder.clone(), Spaces::default()).textures;
    let report = Report {
        sources: &loaded.sources,
        format: args.read.message_format,
        points: (job.vertices as u64, "vertices"),
        width: None,
        textures: &textures,
        path_option: "--texture-path",
        texts: &loaded.texts,
    };
    let mut shading = report.print(&job.displaced, err);
    let points = (count, if said.is_some() { "samples" } else { "points" });
    shading.add(Report { points, width: Some(args.grid.0), ..report }.print(&frame.messages, err));
    shading.judge(args.lints.denies_errors())?;
    let alpha = alpha(&coverage);

    let started = Instant::now();
    let written = match &args.output {
        Some(path) => output::write(&frame, Some(&alpha), path, args)?.save(path, picture, err)?,
        None => Vec::new(),
    };
    let times = [compile, time, started.elapsed()];
    let compiled = program.as_ref().or(displace.as_ref()).filter(|_| args.stats);
    let stats = compiled.map(|compiled| Stats::of(compiled, loaded.body.count(), count, times, args));
    let shows = !args.stats && args.output.is_none() && !args.histogram && kept.is_none();
    let mut ranges = Ranges::default();
    if about.is_some() || shows {
        session::on_threads(args.threads, || ranges.add(&frame.planes))?;
    }
    if let Some(about) = about {
        about.ran(&ranges, &written, shading);
        about.stats = stats;
        about.histograms = args.histogram.then(|| histogram::of(&frame.planes, Some(&alpha)));
        about.max_error = said.as_ref().and_then(|said| said.max_error.clone());
        return said.is_none_or(|said| said.missed.is_none()).then_some(()).ok_or_else(Failure::missed);
    }
    if args.histogram {
        histogram::print(&histogram::of(&frame.planes, Some(&alpha)), out);
    }
    match stats {
        Some(stats) => stats.print(err),
        None if shows => summary(&ranges, out),
        None => {}
    }
    let missed = said.as_ref().is_some_and(|said| said.print(args, out, err));
    if args.live.is_none() {
        shading.wrote(&written, out);
    }
    match kept {
        Some(kept) => {
            kept.covered = Some(alpha);
            kept.frame = frame;
            kept.missed = missed;
            kept.said = said;
            kept.times = [compile, time];
        }
        None if missed => return Err(Failure::missed()),
        None => {}
    }
    Ok(())
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
