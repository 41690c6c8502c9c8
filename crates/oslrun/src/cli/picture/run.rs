//! `oslrun FILE -o OUT`: runs a shader, and writes its outputs as pictures.
//!
//! A run goes from [`super::watch`] (again after a change) to [`super::frames`] (for each frame), from there
//! to [`super::once`], and then to [`super::sweep`] if a parameter has several values.

use super::frames::FrameArgs;
use super::once::Way;
use super::watch::WatchArgs;
use super::{watch, words};
use crate::cli::options::heading;
use crate::cli::options::picture::{DisplayArgs, OutputArgs, ViewArgs};
use crate::cli::options::points::{CropArgs, DataArgs, GridArgs, OnArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::{ArithmeticArgs, MeasureArgs, MoreArgs, RunningArgs};
use crate::cli::options::samples::{SampleArgs, WithinArgs};
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs, TapArgs, WriteArgs};
use crate::cli::print::Console;
use clap::Args;
use osl_job::request::values::{Gained, gained};
use osl_job::request::{Light, Points, Running, Wanted};
use osl_job::{Failure, Image};
use std::ffi::OsString;
use std::path::PathBuf;

/// A run of a shader.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct RunArgs {
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    taps: TapArgs,
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    crop: CropArgs,
    #[command(flatten)]
    display: DisplayArgs,
    #[command(flatten)]
    on: OnArgs,
    #[command(flatten)]
    preview: PreviewArgs,
    #[command(flatten)]
    samples: SampleArgs,
    #[command(flatten)]
    within: WithinArgs,
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    write: WriteArgs,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    data: DataArgs,
    #[command(flatten)]
    more: MoreArgs,
    #[command(flatten)]
    arithmetic: ArithmeticArgs,
    #[command(flatten)]
    running: RunningArgs,
    #[command(flatten)]
    measure: MeasureArgs,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    watch: WatchArgs,
    /// Print the result of the run as one JSON object: the range of each output, the files, the numbers of
    /// errors and warnings; with --stats, --histogram and --profile also their tables.
    #[arg(long, help_heading = heading::MESSAGES)]
    json: bool,
    #[command(flatten)]
    format: FormatArgs,
}

/// A picture with light.
#[derive(Clone, Debug, Default, Args)]
struct PreviewArgs {
    /// Show the shader on a sphere with light, or on the surface of --on. A shader that writes Ci is shown as
    /// it is; of others, outputs give the base color, bumps, the normal, the roughness and the displacement.
    /// A camera shader, with outputs `position` and `direction`, shows a sphere as this camera sees it.
    #[arg(long, group = "seen", requires = "output", conflicts_with_all = ["center", "closures", "steps", "profile", "outputs", "filter", "shading_rate", "adaptive", "within", "prefilter", "range", "signed", "userdata", "time", "global", "frames", "histogram"], help_heading = heading::PREVIEW)]
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
    /// Draw the rays of a camera shader, from above and from the right, as an SVG image.
    #[arg(long, value_name = "FILE", requires = "preview", help_heading = heading::PREVIEW)]
    rays: Option<PathBuf>,
    /// Leave the noise in, and do not limit the light of single paths.
    #[arg(long, requires = "preview", help_heading = heading::PREVIEW)]
    raw: bool,
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
            rays: self.rays.clone(),
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

/// Runs a shader as the command line says.
pub(in crate::cli) fn run(
    args: &RunArgs,
    line: &[OsString],
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let command = words::text(line, args.shader.file());
    let flames = args.measure.profile().flatten();
    let way = Way { json: args.json, flames, line: line.to_vec() };
    // Each run of a watch has limits of its own, so that --max-time is the time of one picture.
    let fresh = args.clone();
    watch::run(&args.watch, &args.frames, &way, move || fresh.clone().image(command.clone()), console)
}
