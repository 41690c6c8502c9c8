//! `oslrun FILE -o OUT`: runs a shader, and writes its outputs as pictures.
//!
//! A run goes from [`super::watch`] (again after a change) to [`super::frames`] (for each frame), and from here to
//! [`super::sweep`] (for several values of a parameter) or to the session (once).

use super::frames::FrameArgs;
use super::watch::WatchArgs;
use super::{sweep, watch, words};
use crate::cli::options::heading;
use crate::cli::options::picture::{DisplayArgs, OutputArgs, ViewArgs};
use crate::cli::options::points::{CropArgs, DataArgs, GridArgs, OnArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::{ArithmeticArgs, MeasureArgs, MoreArgs, RunningArgs};
use crate::cli::options::samples::{SampleArgs, WithinArgs};
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs, TapArgs, WriteArgs};
use crate::cli::print::{Console, checked, done};
use clap::Args;
use osl_job::picture::Extras;
use osl_job::request::values::{Gained, STDOUT, gained};
use osl_job::request::{Light, Points, Running, Wanted};
use osl_job::source::reads::Reads;
use osl_job::{Done, Failure, Image, picture};
use std::ffi::OsString;
use std::path::PathBuf;

/// A run of a shader.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct RunArgs {
    /// The file of the picture.
    #[command(flatten)]
    output: OutputArgs,
    /// The outputs.
    #[command(flatten)]
    outputs: OutputsArgs,
    /// Variables that become outputs.
    #[command(flatten)]
    taps: TapArgs,
    /// The points.
    #[command(flatten)]
    grid: GridArgs,
    /// A part of the picture.
    #[command(flatten)]
    crop: CropArgs,
    /// How values become colors.
    #[command(flatten)]
    display: DisplayArgs,
    /// A surface to shade instead of the grid.
    #[command(flatten)]
    on: OnArgs,
    /// A picture with light.
    #[command(flatten)]
    preview: PreviewArgs,
    /// The samples of each pixel.
    #[command(flatten)]
    samples: SampleArgs,
    /// A time for the samples.
    #[command(flatten)]
    within: WithinArgs,
    /// The shader.
    #[command(flatten)]
    shader: ShaderArgs,
    /// A group of shaders.
    #[command(flatten)]
    network: NetworkArgs,
    /// The file of a repaired source.
    #[command(flatten)]
    write: WriteArgs,
    /// Spaces, rays and textures.
    #[command(flatten)]
    scene: SceneArgs,
    /// The data of the points.
    #[command(flatten)]
    data: DataArgs,
    /// Further outputs.
    #[command(flatten)]
    more: MoreArgs,
    /// The arithmetic.
    #[command(flatten)]
    arithmetic: ArithmeticArgs,
    /// How the program runs.
    #[command(flatten)]
    running: RunningArgs,
    /// What is measured.
    #[command(flatten)]
    measure: MeasureArgs,
    /// The frames of a film.
    #[command(flatten)]
    frames: FrameArgs,
    /// Whether to run again after a change.
    #[command(flatten)]
    watch: WatchArgs,
    /// Print the result of the run as one JSON object: the range of each output, the files, the numbers of
    /// errors and warnings; with --stats, --histogram and --profile also their tables.
    #[arg(long, help_heading = heading::MESSAGES)]
    json: bool,
    /// How messages are printed.
    #[command(flatten)]
    format: FormatArgs,
}

/// A picture with light.
#[derive(Clone, Debug, Default, Args)]
struct PreviewArgs {
    /// Show the shader on a sphere with light, or on the surface of --on. A shader that writes Ci is shown as
    /// it is; of others, outputs give the base color, bumps, the normal, the roughness and the displacement.
    #[arg(long, group = "seen", requires = "output", conflicts_with_all = ["center", "closures", "steps", "profile", "outputs", "filter", "shading_rate", "adaptive", "within", "prefilter", "range", "signed", "userdata", "attributes", "time", "global", "frames", "histogram"], help_heading = heading::PREVIEW)]
    preview: bool,
    /// Output for the base color (default: the first color).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    base: Option<String>,
    /// Output for the height of bumps, and a factor on it (default: a float named bump, height, displacement
    /// or disp).
    #[arg(long, value_name = "OUTPUT[,GAIN]", requires = "preview", value_parser = gained, help_heading = heading::PREVIEW)]
    bump: Option<Gained>,
    /// Output for the normal (default: the first normal).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    normal: Option<String>,
    /// Output for the roughness of highlights, from 0 to 1 (default: a float whose name says so).
    #[arg(long, value_name = "OUTPUT", requires = "preview", help_heading = heading::PREVIEW)]
    roughness: Option<String>,
    /// Leave the noise in, and do not limit the light of single paths.
    #[arg(long, requires = "preview", help_heading = heading::PREVIEW)]
    raw: bool,
    /// The curve of the picture.
    #[command(flatten)]
    view: ViewArgs,
}

impl PreviewArgs {
    fn light(&self) -> Option<Light> {
        self.preview.then(|| Light {
            base: self.base.clone(),
            bump: self.bump.clone(),
            normal: self.normal.clone(),
            roughness: self.roughness.clone(),
            raw: self.raw,
            view: self.view.curve(),
        })
    }
}

impl RunArgs {
    /// The picture that the options describe.
    fn image(&self, command: Option<String>) -> Image {
        let mut shader = self.shader.shader(Some(&self.network));
        shader.outputs = self.outputs.names();
        shader.taps = self.taps.taps();
        shader.write = self.write.path();
        let points = self.grid.points();
        let (stats, histogram) = (self.measure.stats(), self.measure.histogram());
        let profile = self.measure.profile().is_some();
        let output = self.output.output(&self.display, command);
        let ranges = self.json || output.path.is_none() && !stats && !histogram && !profile;
        Image {
            shader,
            points: Points { crop: self.crop.part(), surface: self.on.surface(), ..points },
            provided: self.scene.provided(Some(&self.data)),
            sampling: self.samples.sampling(Some(&self.within)),
            running: Running {
                arithmetic: self.arithmetic.chosen(),
                steps: self.more.steps(),
                profile,
                ..self.running.running()
            },
            output,
            light: self.preview.light(),
            wanted: Wanted { stats, histogram, closures: self.more.closures(), ranges, ..Wanted::default() },
            ..Image::default()
        }
    }
}

/// What the command line says about a run besides its picture.
pub(super) struct Way {
    /// The frames of a film.
    pub(super) frames: FrameArgs,
    /// Whether the result is printed as an object.
    pub(super) json: bool,
    /// The file of the flame graph.
    pub(super) flames: Option<PathBuf>,
}

/// Runs a shader as the command line says.
pub(in crate::cli) fn run(
    args: &RunArgs,
    line: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let command = words::text(line, args.shader.file());
    let flames = args.measure.profile().flatten();
    let way = Way { frames: args.frames.clone(), json: args.json, flames };
    // Each run of a watch has limits of its own, so that --max-time is the time of one picture.
    let fresh = args.clone();
    watch::run(&args.watch, &way, move || fresh.clone().image(command.clone()), console)
}

/// Runs a shader once, or for several values of parameters, and prints the result. With `json`, the standard
/// output gets one object; if it gets the picture, text goes to the standard error.
pub(super) fn once(
    image: &Image,
    way: &Way,
    reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    image.output.display.check(image.output.path.as_deref())?;
    if image.light.is_some() && image.output.path.is_none() {
        return Err(Failure::new("a preview is a picture: name one with -o"));
    }
    let piped = image.output.path.as_deref().is_some_and(|path| path.as_os_str() == STDOUT);
    if piped && way.json {
        return Err(Failure::usage("--json and the picture of `-o -` do not fit on one standard output"));
    }
    if piped && checked::is_terminal() {
        return Err(Failure::usage(
            "`-o -` writes the bytes of a picture, which a terminal cannot show: pipe it, or name a file",
        ));
    }
    let mut text = Vec::new();
    let shown = if way.json {
        let found = values(image, reads, &mut console.with_out(&mut text))?;
        done::object(&found, &String::from_utf8_lossy(&text), console)?;
        Shown { piped: Vec::new(), misses: found.misses() }
    } else if piped {
        let shown = shown(image, way, reads, &mut console.with_out(&mut text));
        console.again(&text);
        shown?
    } else {
        shown(image, way, reads, console)?
    };
    let _ = console.out.write_all(&shown.piped);
    if shown.misses { Err(Failure::missed()) } else { Ok(()) }
}

/// What remains to be done after a run was printed.
pub(super) struct Shown {
    /// The picture for the standard output.
    pub(super) piped: Vec<u8>,
    /// Whether the picture misses its error bound.
    pub(super) misses: bool,
}

/// Runs a shader with one value of each parameter.
fn values(image: &Image, reads: Option<&mut Reads>, console: &mut Console<'_>) -> Result<Done, Failure> {
    if !sweep::find(image)?.is_empty() {
        return Err(Failure::usage("--preview and --json are for a run with one value of each parameter"));
    }
    let done = picture::run(image, Extras { reads, ..Extras::default() }, console)?;
    if let Some(samples) = &done.samples {
        samples.send(console);
    }
    Ok(done)
}

/// Runs a shader once, or for several values of parameters, and prints the result.
fn shown(
    image: &Image,
    way: &Way,
    reads: Option<&mut Reads>,
    console: &mut Console<'_>,
) -> Result<Shown, Failure> {
    let sweeps = sweep::find(image)?;
    if !sweeps.is_empty() {
        return sweep::all(image, &sweeps, reads, console);
    }
    let done = picture::run(image, Extras { reads, ..Extras::default() }, console)?;
    done::text(&done, image, way.flames.as_deref(), console)?;
    Ok(Shown { misses: done.misses(), piped: done.piped })
}
