//! From a request to values: shades the points of an [`Image`] and writes its file.
//!
//! [`run`] chooses the way: `grid` shades the patch, `surface` what a camera sees of a surface, and
//! `lit` renders a surface with light. `setup` makes what all of them need; `sampling` and `within`
//! make pictures with several samples for each pixel.

pub mod camera;
mod grid;
mod layer;
mod lit;
mod roles;
pub mod sampling;
mod seen;
pub mod setup;
pub mod sight;
mod surface;
mod within;

pub use lit::{note_unknown, stats as render_stats};

use crate::report::closures;
use crate::report::histogram::{self, Histogram};
use crate::report::messages::Tally;
use crate::report::ranges::Ranges;
use crate::report::samples::Samples;
use crate::report::stats::Stats;
use crate::source::load::{self, MoreTaps, Request};
use crate::source::reads::Reads;
use crate::{Failure, Image, Sink};
use osl_exec::{Frame, Plane, ProfileEntry};
use osl_numeric::Arithmetic;
use osl_syntax::source::SourceMap;
use sampling::Plan;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A smaller grid that the compiled program runs before the whole one.
pub struct First<'a> {
    /// Columns and rows.
    pub grid: (usize, usize),
    /// Gets the values; not called for a surface or a picture with light.
    pub show: &'a dyn Fn(Done),
}

/// What a client adds to a request.
#[derive(Default)]
pub struct Extras<'a> {
    /// A smaller grid that is shown before the whole one.
    pub first: Option<First<'a>>,
    /// Gets the files that the run reads or looks for.
    pub reads: Option<&'a mut Reads>,
    /// Makes taps of the shader, besides those of the request.
    pub more_taps: Option<&'a MoreTaps<'a>>,
}

/// What a run has computed and written.
#[derive(Default)]
pub struct Done {
    /// The values, as far as they are kept, and the messages of the shader.
    pub frame: Frame,
    /// 0 at pixels that do not show the surface; none for the grid.
    pub covered: Option<Plane>,
    /// The range of each output, if it is wanted.
    pub ranges: Ranges,
    /// The closures, if they are wanted.
    pub closures: Option<closures::Summary>,
    /// What the samples took, unless each pixel has one.
    pub samples: Option<Samples>,
    /// The channels of a picture with light, and the samples that a PNG file stores.
    pub light: Option<(usize, Vec<u8>)>,
    /// The distribution of the values, if it is wanted.
    pub histograms: Option<Vec<Histogram>>,
    /// Times and rates, if they are wanted.
    pub stats: Option<Stats>,
    /// What each output costs, as a table below the times.
    pub cost: Option<String>,
    /// The profiles of several rounds.
    pub profile: Vec<Vec<ProfileEntry>>,
    /// The files that were written.
    pub files: Vec<PathBuf>,
    /// The picture for the standard output.
    pub piped: Vec<u8>,
    /// The numbers of errors and warnings that the shader reported.
    pub messages: Tally,
    /// The time until the program was ready, and the time that it ran.
    pub times: [Duration; 2],
    /// The files of the shader.
    pub sources: SourceMap,
    /// The name of the shader.
    pub name: Arc<str>,
}

impl Done {
    /// Whether the picture misses its error bound.
    pub fn misses(&self) -> bool {
        self.samples.as_ref().is_some_and(|samples| samples.missed.is_some())
    }

    /// Adds the distribution of the values, if it is wanted.
    fn count(&mut self, image: &Image) {
        let count = || histogram::of(&self.frame.planes, self.covered.as_ref());
        self.histograms = image.wanted.histogram.then(count);
    }
}

/// Makes a picture.
///
/// # Errors
/// The request makes no sense, the shader has errors, a file cannot be read or written, or a limit is
/// reached.
pub fn run(image: &Image, extras: Extras<'_>, sink: &mut dyn Sink) -> Result<Done, Failure> {
    let began = image.snapshot().host().now();
    let done = shade(image, extras, sink);
    image.snapshot().note_textures(began);
    done
}

fn shade(image: &Image, extras: Extras<'_>, sink: &mut dyn Sink) -> Result<Done, Failure> {
    let started = Instant::now();
    let plan = image.sampling.plan()?;
    if image.wanted.closures && plan != Plan::Plain {
        return Err(Failure::usage("--closures wants one sample for each pixel"));
    }
    cropped(image, plan)?;
    let Extras { first, mut reads, more_taps } = extras;
    let opens = more_taps.is_none() && opens(image, plan);
    let loaded = load::load(&Request { more_taps, opens, ..Request::of(image) }, sink)?;
    if let Some(reads) = &mut reads {
        let services = setup::services(image, loaded.folder.clone(), setup::grid_spaces(image));
        reads.sources(&loaded.sources);
        reads.textures(&services.textures, loaded.texts.iter().map(|(_, text)| &**text));
    }
    match &image.light {
        Some(light) => lit::run(image, light, loaded, started, sink),
        None if image.points.surface.on.is_some() => surface::run(image, &loaded, started, sink),
        None => grid::run(image, loaded, grid::Start { plan, started, first, reads }, sink),
    }
}

/// Whether the program of a picture may be kept, with parameters as inputs: what is told of it must be the
/// same as of a program with constants.
fn opens(image: &Image, plan: Plan) -> bool {
    let Image { points, running, wanted, sampling, .. } = image;
    let is_grid = image.light.is_none() && points.surface.on.is_none();
    let is_watched = running.profile || running.steps || wanted.stats || wanted.closures;
    let is_strict = matches!(running.arithmetic, None | Some(Arithmetic::Strict)) && !sampling.prefilter;
    is_grid && is_strict && !is_watched && matches!(plan, Plan::Plain | Plan::Samples(..))
}

/// Fails if a part of the picture cannot be computed alone, or is not in the picture.
fn cropped(image: &Image, plan: Plan) -> Result<(), Failure> {
    let Some(crop) = &image.points.crop else { return Ok(()) };
    crop.check(image.points.grid).map_err(Failure::usage)?;
    if image.light.is_some() {
        return Ok(());
    }
    if image.points.surface.on.is_some() {
        return Err(Failure::usage("--crop is for the grid, not for --on"));
    }
    match plan {
        Plan::Plain | Plan::Samples(..) | Plan::Within(..) => Ok(()),
        Plan::Rate(_) | Plan::Adaptive(..) | Plan::MaxError(..) => Err(Failure::usage(
            "--crop goes with --samples and --filter only: --shading-rate, --adaptive and --max-error compute a pixel \
             from others, so that a part would have other values than the whole picture",
        )),
    }
}
