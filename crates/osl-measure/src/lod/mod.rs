//! Levels of detail of a shader: one source in which parts are replaced by their means, or by linear forms,
//! where a pixel covers so much of the pattern that a sample of the original is a worse answer.
//!
//! `inputs` finds what the outputs depend on, `ground` makes points at larger footprints, `judge` measures
//! errors there, `off` and `known` test them, `place` measures the coordinate, `linear` fits slopes, `means`,
//! `noise`, `edges`, `far` and `search` find the levels, and `write` writes the source. The levels are chosen
//! on some points and judged on others. This module must not write files; [`text`] and [`html`] format a
//! [`Report`].

mod edges;
mod far;
mod frame;
mod ground;
mod html;
mod inputs;
mod judge;
mod known;
mod linear;
mod means;
mod noise;
mod off;
mod place;
mod report;
mod search;
mod text;
mod why;
mod words;
mod write;

pub use html::html;
pub use inputs::GivenParam;
pub use off::Errors;
pub use report::{Front, Picture, Report, Row};
pub use text::text;

use crate::stability::fix::Built;
use crate::stability::fix::source::Source;
use frame::Frame;
use inputs::Inputs;
use judge::{FOOTPRINTS, Judge, Variant};
use known::Known;
use osl_exec::{RunError, RunOptions, Services};
use osl_hir::hir::Program;
use osl_ir::ir::Body;
use osl_scene::Grid;
use place::Place;
use search::{Failed, Search};
use write::{Plan, Said};

/// Compiles a changed text of the main file, without notes; `None` if it has errors.
pub type Build<'a> = dyn Fn(&str) -> Option<Built> + 'a;

/// What to simplify.
pub struct Request<'a> {
    /// The text of the main file.
    pub text: &'a str,
    /// Its resolved program.
    pub program: &'a Program,
    /// Its lowered body for the given parameter values.
    pub body: Body,
    /// The values that were given for parameters.
    pub given: &'a [GivenParam],
    /// Compiles a changed text for the same parameter values.
    pub build: &'a Build<'a>,
    /// The image at footprint 1.
    pub grid: &'a Grid,
    /// Files and spaces.
    pub services: &'a Services,
    /// Limits of all runs. If they end, what was found before is reported.
    pub options: &'a RunOptions,
    /// The number of samples of the original whose error a level must not exceed.
    pub samples: u32,
    /// An error up to which a level is good in any case, as a share of the range.
    pub tolerance: f64,
    /// Another number gives other points.
    pub seed: u32,
    /// Whether to make pictures.
    pub pictures: bool,
}

/// Why there is no report.
#[derive(Debug)]
pub enum Stop {
    /// The shader cannot be simplified, for this reason.
    Refused(String),
    /// A run ended early.
    Run(RunError),
}

impl From<RunError> for Stop {
    fn from(error: RunError) -> Stop {
        Stop::Run(error)
    }
}

/// Finds the levels of a shader and writes it with them.
///
/// # Errors
/// No mean can stand for the outputs, or a run ended before anything was found.
pub fn lod(request: &Request<'_>) -> Result<Report, Stop> {
    let source = Source::new(request.program, request.text);
    let inputs = Inputs::of(&source, request.given).map_err(Stop::Refused)?;
    let frame = Frame::of(&source)
        .ok_or_else(|| Stop::Refused("the body of the shader is not in the named file itself".to_string()))?;
    let surroundings = (request.services, request.options);
    let (judge, original) =
        Judge::new(surroundings, request.grid, (inputs.turned.clone(), request.seed), request.body.clone())?;
    if judge.outputs.is_empty() {
        return Err(Stop::Refused("the shader has no outputs of numbers".to_string()));
    }
    let place = Place::of((&source, &frame, &inputs), &judge, request.build)?;
    let width = place.width(&judge)?;
    let known = Known::of((&judge, &original), &FOOTPRINTS, (request.samples, request.tolerance))?;
    let mut search = Search {
        judge: &judge,
        source: &source,
        frame: &frame,
        inputs: &inputs,
        original: &original,
        build: request.build,
        samples: request.samples,
        known: &known,
        place: &place,
        width,
        tried: 0,
        failed: Vec::new(),
    };
    let far = search.far()?;
    let statements = means::statements(&source, &frame);
    let statements = means::measured(statements, &source, &frame, &judge, request.build)?;
    let inner = search.inner(far.as_ref())?;
    let near = search.near(&statements, (&inner, far.as_ref()))?;
    let found = settle(request, &mut search, Plan { inner, near, far }, width)?;
    Ok(report::report(request, &search, found, width))
}

/// The levels that hold in the written shader.
pub(super) struct WrittenLevels {
    plan: Plan,
    text: String,
    written: Variant,
    /// For each level the largest error from there on, and that of the original.
    errors: Vec<[f64; 2]>,
}

/// Writes the shader and checks it; levels that do not hold begin later or are dropped.
fn settle(
    request: &Request<'_>,
    search: &mut Search<'_, '_>,
    mut plan: Plan,
    width: f64,
) -> Result<Option<WrittenLevels>, Stop> {
    while !plan.is_empty() {
        let none = vec![[0.0; 2]; plan.near.len() + 1];
        let text = written(request, search, &plan, (width, &none))?;
        let Some(built) = (request.build)(&text) else {
            return Err(Stop::Refused("the written shader does not compile; this is a bug of oslrun".into()));
        };
        let written_now = search.judge.variant(built.plain);
        let Err((level, fault)) = search.check(&written_now, &plan)? else {
            let errors = stated(search, &written_now, &plan)?;
            let text = written(request, search, &plan, (width, &errors))?;
            return Ok(Some(WrittenLevels { plan, text, written: written_now, errors }));
        };
        search.failed.push(Failed::Written(fault));
        match level {
            None => plan.inner = write::Inner::default(),
            Some(level) if level < plan.near.len() => plan.near.truncate(level),
            Some(_) => plan.far = plan.far.take().and_then(|far| later(far, fault.footprint)),
        }
    }
    Ok(None)
}

/// The far level with a shorter fade, if the fade is to blame; else from the next footprint on.
fn later(far: write::Far, blamed: f64) -> Option<write::Far> {
    if blamed < far.full && far.begin < write::LATE {
        return Some(write::Far { begin: write::LATE, ..far });
    }
    let full = FOOTPRINTS.into_iter().find(|footprint| *footprint > far.full)?;
    Some(write::Far { full, begin: write::BEGIN, ..far })
}

/// The largest error of an output, with two standard errors, while each level is the last one; and that of
/// the original.
fn stated(search: &Search<'_, '_>, written: &Variant, plan: &Plan) -> Result<Vec<[f64; 2]>, RunError> {
    let fulls: Vec<f64> =
        plan.near.iter().map(|near| near.full).chain(plan.far.iter().map(|far| far.full)).collect();
    let mut errors = vec![[0.0_f64; 2]; fulls.len()];
    for sets in &search.known.sets {
        for known in [&sets.held, &sets.fitted] {
            let own = search.judge.off(written, &known.truth, search.samples)?.limit();
            let original = known.original.limit();
            for (at, error) in errors.iter_mut().enumerate() {
                let next = fulls.get(at + 1).copied().unwrap_or(f64::INFINITY);
                let from = fulls.get(at).copied().unwrap_or(0.0);
                if known.truth.footprint >= from && known.truth.footprint < next {
                    *error = [error[0].max(own), error[1].max(original)];
                }
            }
        }
    }
    Ok(errors)
}

fn written(
    request: &Request<'_>,
    search: &Search<'_, '_>,
    plan: &Plan,
    (width, errors): (f64, &[[f64; 2]]),
) -> Result<String, Stop> {
    let largest = width * FOOTPRINTS.last().copied().unwrap_or(1.0);
    let given = !request.given.is_empty();
    let said = Said { errors, samples: request.samples, given, largest };
    write::write(search.source, search.frame, search.inputs, plan, (width, &said))
        .ok_or_else(|| Stop::Refused("the source cannot be changed at these places".to_string()))
}

/// The measured footprints that a report shows.
const SHOWN: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
