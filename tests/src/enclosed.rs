//! Proven bounds against runs: no value of a run may be outside of them, and no event may happen that they
//! exclude or do not name. This module must not know where programs come from.

use crate::run;
use osl::stages;
use osl_exec::{Plane, PointSource, RunOptions, Services};
use osl_ir::ir::Kind;
use osl_ir::passes;
use osl_measure::bounds::{self, Domain, Effort, Report, Verdict};
use osl_measure::sanitize::{self, Subject};
use osl_scene::Grid;
use osl_syntax::source::SourceMap;
use osl_syntax::{NoFiles, Options};

/// The maximum number of steps of a point.
const STEPS: u64 = 20_000;

/// The events about which there is a claim wherever they can happen.
const HAVE_CLAIMS: [sanitize::Kind; 5] = [
    sanitize::Kind::IntOverflow,
    sanitize::Kind::IntConversion,
    sanitize::Kind::ZeroDivision,
    sanitize::Kind::Edges,
    sanitize::Kind::Index,
];

/// A report, with what is needed to compare it with runs.
pub struct Proven {
    /// What was proved.
    pub report: Report,
    /// The program as `sanitize` follows it, and as it was enclosed.
    subject: Subject,
    enclosed: Subject,
    sources: SourceMap,
}

/// Proves bounds of a shader for a part of the plane: its size and its corner. `points` gives the
/// derivatives. `None` if the shader does not compile.
pub fn prove(
    text: &str,
    services: &Services,
    points: &Grid,
    (scale, offset): ([f32; 2], [f32; 2]),
    tiles: usize,
) -> Option<Proven> {
    let checked = stages::check("case.osl", text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program?, &[]).ok()?;
    let options = passes::Options {
        varying: points.varying().to_vec(),
        derivs: points.varying_derivs().to_vec(),
        limits: run::steps(STEPS),
        ..passes::Options::default()
    };
    let subject = Subject::new(body.clone(), &options);
    let effort = Effort { tiles, ..Effort::default() };
    let domain = Domain::of_patch(scale, offset);
    let enclosed = bounds::subject(body, &options);
    let report = bounds::prove(&enclosed, (services, points, &checked.sources), &domain, effort, "case");
    Some(Proven { report, subject, enclosed, sources: checked.sources })
}

/// The numbers of a plane; ints are exact.
pub fn numbers(plane: &Plane) -> Vec<f64> {
    match plane.kind {
        Kind::Int => plane.words.iter().map(|word| f64::from(word.cast_signed())).collect(),
        _ => plane.floats().into_iter().map(f64::from).collect(),
    }
}

/// The first violation at these points: a value outside of its bounds, an event that was excluded, or an
/// event that no claim is about. The derivatives of the points must be those of the report. A program that
/// does not run to its end violates nothing.
pub fn violation(proven: &Proven, text: &str, services: &Services, points: &Grid) -> Option<String> {
    let report = &proven.report;
    let options = RunOptions { limits: run::steps(STEPS), ..RunOptions::default() };
    let passes = passes::Options { varying: points.varying().to_vec(), ..passes::Options::default() };
    let compiled = run::compile("case.osl", text, &[], &passes).ok()?;
    let frame = osl_exec::run(&compiled.program, services, points, &options, &|_| ()).ok()?;
    let mut outputs = report.outputs.iter().filter(|output| !output.name.contains('['));
    for plane in frame.planes.iter().filter(|plane| !plane.output.contains('[')) {
        let Some(output) = outputs.next() else {
            return Some(format!("{} has no bounds", plane.output));
        };
        for (point, value) in numbers(plane).into_iter().enumerate() {
            let is_inside = match value.is_nan() {
                true => output.never_nan != Verdict::Proven,
                false => output.lowest <= value && value <= output.highest,
            };
            if !is_inside {
                let (lo, hi) = (output.lowest, output.highest);
                return Some(format!("point {point}, {}: {value:e} not in {lo:e} {hi:e}", plane.output));
            }
        }
    }
    let places = sanitize::Points { source: points, size: (points.width, points.height), pixels: None };
    let claims = |event: &sanitize::Event, verdict: fn(Verdict) -> bool| {
        let mut claims = report.claims.iter().filter(|claim| verdict(claim.verdict));
        claims.any(|claim| claim.kind == event.kind && claim.quote == event.quote)
    };
    let events = |subject| {
        sanitize::sanitize(subject, services, &places, &proven.sources, "case").report.events.into_iter()
    };
    let mut excluded = events(&proven.subject).filter(|event| claims(event, |v| v == Verdict::Proven));
    if let Some(event) = excluded.next() {
        return Some(format!("{:?} at {:?}, which was excluded", event.kind, event.quote));
    }
    // Equal operations have one claim, so the events are those of the program in which they are one.
    let mut unnamed = events(&proven.enclosed)
        .filter(|event| HAVE_CLAIMS.contains(&event.kind) && !claims(event, |v| v != Verdict::Proven));
    let event = unnamed.next()?;
    Some(format!("{:?} at {:?}, and no claim is about it", event.kind, event.quote))
}
