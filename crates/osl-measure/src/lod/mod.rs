//! Levels of detail of a shader: one source in which all outputs are their means where a pixel covers so much
//! of the pattern that a sample of the original is a worse answer, and in which noise fades and edges become
//! softer before.
//!
//! `inputs` finds what the outputs depend on, `ground` makes points with larger pixels, `judge` measures
//! errors there, `errors` and `original` test them, `noise`, `edges` and `search` find what replaces parts of
//! the shader, and `write` writes the source. All is chosen on some points and judged on others; [`text`] and
//! [`html`] format a [`Report`].

mod edges;
mod errors;
mod ground;
mod html;
mod inputs;
mod judge;
mod noise;
mod original;
mod report;
mod search;
mod text;
mod words;
mod write;

pub use errors::Errors;
pub use ground::By;
pub use html::html;
pub use inputs::GivenParam;
pub use report::{Level, Picture, Report, Row};
pub use text::text;

use crate::sample::{Pattern, some_pixels};
use crate::stability::fix::Built;
use crate::stability::fix::source::Source;
use errors::Bounds;
use ground::shapes;
use inputs::Inputs;
use judge::{FOOTPRINTS, Judge, LARGEST, Set, Variant};
use original::{Original, Sizes};
use osl_exec::{RunError, RunOptions, Services};
use osl_hir::hir::Program;
use osl_ir::ir::Body;
use osl_scene::Grid;
use search::{BEGINS, Failed, Search};
use write::Frame;
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
    /// The largest root mean square error of a mean, as a share of the range.
    pub error: f64,
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

/// Finds the level of a shader, and changes in place, and writes it with them.
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
    let widths = widths((&source, &frame, &inputs), &judge, request.build)?;
    let bounds = Bounds { tolerance: request.tolerance, error: request.error };
    let all: Vec<_> = FOOTPRINTS.into_iter().flat_map(|size| shapes(size, By::Area, LARGEST)).collect();
    let known = Original::of((&judge, &original), &all, (request.samples, bounds))?;
    let mut search = Search {
        judge: &judge,
        source: &source,
        frame: &frame,
        inputs: &inputs,
        original: &original,
        build: request.build,
        samples: request.samples,
        known: &known,
        widths,
        tried: 0,
        failed: Vec::new(),
    };
    let far = search.far()?;
    let inner = search.inner(far.as_ref())?;
    let far = far.map(|far| search.after(&inner, far)).transpose()?;
    let by = far.as_ref().map_or(By::default(), |far| far.by);
    let found = settle(request, &mut search, Plan { inner, far, by })?;
    Ok(report::report(request, &search, found))
}

/// Pixels from which the size of a pixel is taken.
const PIXELS: usize = 256;

/// The size of a pixel at footprint 1 by its larger side and by its area, as the written shader sees it.
fn widths(
    (source, frame, inputs): (&Source<'_>, &Frame, &Inputs),
    judge: &Judge<'_>,
    build: &Build<'_>,
) -> Result<[f64; 2], Stop> {
    let refused = || Stop::Refused("the size of a pixel in the shader's coordinate is not known".to_string());
    let (text, names) = write::probe(source, frame, inputs, [By::Side, By::Area]).ok_or_else(refused)?;
    let variant = judge.variant(build(&text).ok_or_else(refused)?.plain);
    let ground = judge.ground([1.0; 2], Set::Fitted);
    let shading = judge.shading(&variant, &ground, &Pattern::new(1, judge.seed));
    let pixels = some_pixels(judge.grid.width * judge.grid.height, PIXELS, judge.seed);
    let values = shading.chosen(&pixels, 1)?;
    let planes = shading.planes();
    let middle = |name: &String| {
        let at = planes.iter().position(|plane| *plane.output == **name)?;
        let mut list = values.get(at)?.clone();
        list.sort_by(f32::total_cmp);
        let middle = list.get(list.len() / 2).copied().map(f64::from)?;
        (middle > 0.0 && middle.is_finite()).then_some(middle)
    };
    let [side, area] = names.each_ref().map(middle);
    Ok([side.ok_or_else(refused)?, area.ok_or_else(refused)?])
}

/// What holds in the written shader.
pub(super) struct Written {
    plan: Plan,
    text: String,
    variant: Variant,
    /// The largest error of the level, and that of the original there.
    errors: [f64; 2],
}

/// Writes the shader and checks it; what does not hold begins later or is dropped.
fn settle(
    request: &Request<'_>,
    search: &mut Search<'_, '_>,
    mut plan: Plan,
) -> Result<Option<Written>, Stop> {
    while !plan.is_empty() {
        let text = written(request, search, &plan, [0.0; 2])?;
        let Some(built) = (request.build)(&text) else {
            return Err(Stop::Refused("the written shader does not compile; this is a bug of oslrun".into()));
        };
        let variant = search.judge.variant(built.plain);
        let Err((is_far, fault)) = search.check(&variant, &plan)? else {
            let errors = stated(search, &variant, &plan)?;
            let text = written(request, search, &plan, errors)?;
            return Ok(Some(Written { plan, text, variant, errors }));
        };
        search.failed.push(Failed::Written(fault));
        if is_far {
            plan.far = plan.far.take().and_then(|far| later(far, fault.sides));
        } else {
            plan.inner = write::Inner::default();
        }
    }
    Ok(None)
}

/// The far level with a shorter fade, if the fade is to blame; else from the next size on.
fn later(far: write::Far, blamed: ground::Sides) -> Option<write::Far> {
    let begin = BEGINS.into_iter().find(|begin| far.by.of(blamed) < far.full && *begin > far.begin);
    if let Some(begin) = begin {
        return Some(write::Far { begin, ..far });
    }
    let full = FOOTPRINTS.into_iter().find(|footprint| *footprint > far.full)?;
    Some(write::Far { full, ..far })
}

/// The largest error of an output where the level is complete, with two standard errors, and that of the
/// original.
fn stated(search: &Search<'_, '_>, written: &Variant, plan: &Plan) -> Result<[f64; 2], RunError> {
    let mut errors = [0.0_f64; 2];
    let Some(far) = &plan.far else { return Ok(errors) };
    let sizes = Sizes { by: far.by, from: far.full, to: f64::INFINITY };
    for known in search.known.within(sizes).filter(|known| known.truth.set != Set::Home) {
        let own = search.judge.off(written, &known.truth, search.samples)?.limit();
        errors = [errors[0].max(own), errors[1].max(known.original.limit())];
    }
    Ok(errors)
}

fn written(
    request: &Request<'_>,
    search: &Search<'_, '_>,
    plan: &Plan,
    errors: [f64; 2],
) -> Result<String, Stop> {
    let width = search.width(plan.by);
    let given = !request.given.is_empty();
    let said = Said { errors, samples: request.samples, given, largest: width * LARGEST };
    write::write(search.source, search.frame, search.inputs, plan, (width, &said))
        .ok_or_else(|| Stop::Refused("the source cannot be changed at these places".to_string()))
}

/// The measured footprints that a report shows.
const SHOWN: [f64; 5] = [1.0, 4.0, 16.0, 64.0, 256.0];
