//! `oslrun compare A B`: where two pictures differ, and by how much.
//!
//! Each picture is an image file, or the result of running a shader. `side` gets the pictures, `differ`
//! measures, and `show` writes the report and the picture of the difference. Words after `--` are options of
//! the second picture alone, so that one shader can be compared with itself under two settings.

mod differ;
mod show;
mod side;

pub(super) use differ::{At, measure};
pub(super) use show::{brief, color};
pub(super) use side::Side;

use crate::cli::help::misspelt;
use crate::cli::options::heading;
use crate::cli::options::points::{CropArgs, DataArgs, GridArgs, OnArgs, SceneArgs};
use crate::cli::options::reading::FormatArgs;
use crate::cli::options::running::{ArithmeticArgs, MoreArgs, RunningArgs};
use crate::cli::options::samples::SampleArgs;
use crate::cli::options::shader::{NetworkArgs, OutputsArgs, ShaderArgs, TapArgs};
use crate::cli::print::Console;
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use osl_image::ImageFormat;
use osl_job::request::{Points, Running, Wanted};
use osl_job::{Failure, Image, Sink};
use std::ffi::OsString;
use std::path::PathBuf;

/// The name of the command.
pub(in crate::cli) const NAME: &str = "compare";

/// The text at the end of the help.
const AFTER: &str = "\
Examples:
  oslrun compare old.exr new.exr -o difference.png
  oslrun compare old.osl new.osl -g 256x256 -p radius=0.3
  oslrun compare stones.osl -- -p radius=0.3       with the default radius, and with 0.3
  oslrun compare stones.osl -- --arithmetic fast
  oslrun compare reference.exr stones.osl -g 512x512

Exit code: 0 if the pictures are equal, 1 if they differ or cannot be compared,
2 for an error on the command line.";

/// What to compare.
#[derive(Debug, Args)]
#[command(
    after_help = AFTER,
    mut_arg("file", |arg| described(arg.index(1).value_name("FILE"), "The first picture: an image file, or a shader")),
    mut_arg("outputs", |arg| described(arg, "Outputs or layers to compare, separated by commas (default: all)")),
)]
pub(in crate::cli) struct CompareArgs {
    #[command(flatten)]
    shader: ShaderArgs,
    #[command(flatten)]
    network: NetworkArgs,
    #[command(flatten)]
    outputs: OutputsArgs,
    #[command(flatten)]
    taps: TapArgs,
    #[command(flatten)]
    grid: GridArgs,
    #[command(flatten)]
    crop: CropArgs,
    #[command(flatten)]
    on: OnArgs,
    #[command(flatten)]
    samples: SampleArgs,
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
    /// Picture of the difference to write: .png shows the largest difference of each pixel, .exr holds the
    /// second picture minus the first for each channel.
    #[arg(short, long, value_name = "FILE", value_parser = PathBufValueParser::new().try_map(difference_file), help_heading = heading::PICTURE)]
    output: Option<PathBuf>,
    /// The second picture: an image file, or a shader (default: the first shader again).
    #[arg(index = 2, value_name = "OTHER")]
    other: Option<PathBuf>,
    /// Options for the second picture alone, in addition to those for both: `-- -p radius=0.3`.
    #[arg(index = 3, last = true, value_name = "OPTIONS")]
    second: Vec<OsString>,
    /// Values that differ by at most this count as equal. A NaN or an infinity equals only itself.
    #[arg(long, value_name = "X", default_value = "0", value_parser = tolerance, allow_hyphen_values = true)]
    tolerance: f64,
    /// Print one JSON object.
    #[arg(long, help_heading = heading::MESSAGES)]
    json: bool,
    #[command(flatten)]
    format: FormatArgs,
}

impl CompareArgs {
    /// A picture of one side.
    fn image(&self) -> Image {
        let mut shader = self.shader.shader(Some(&self.network));
        shader.outputs = self.outputs.names();
        shader.taps = self.taps.taps();
        let points = self.grid.points();
        Image {
            shader,
            points: Points { crop: self.crop.part(), surface: self.on.surface(), ..points },
            provided: self.scene.provided(Some(&self.data)),
            sampling: self.samples.sampling(None),
            running: Running {
                arithmetic: self.arithmetic.chosen(),
                steps: self.more.steps(),
                ..self.running.running()
            },
            wanted: Wanted { closures: self.more.closures(), values: true, ..Wanted::default() },
            ..Image::default()
        }
    }
}

/// An option with another description than in a run.
fn described(arg: clap::Arg, help: &'static str) -> clap::Arg {
    arg.help(help).long_help(help)
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
    number.ok_or_else(|| format!("a tolerance is a number from 0 on, not `{text}`"))
}

fn difference_file(path: PathBuf) -> Result<PathBuf, String> {
    match ImageFormat::of(&path) {
        Some(ImageFormat::Exr | ImageFormat::Png) => Ok(path),
        _ => Err("the name must end in .exr or .png".to_string()),
    }
}

/// Arguments of a run that also have an effect on image files, besides the limits.
const FOR_IMAGES: [&str; 8] =
    ["file", "other", "second", "output", "outputs", "tolerance", "json", "message_format"];

/// The message for the first option that has no effect because both pictures are image files. `line`
/// describes the whole command line.
pub(in crate::cli) fn refused(found: &ArgMatches, line: &Command) -> Option<String> {
    let image = |name| found.get_one::<PathBuf>(name).is_some_and(|path| !side::is_shader(path));
    if !image("file") || !image("other") {
        return None;
    }
    if found.get_many::<OsString>("second").is_some() {
        return Some(
            "the options after `--` are for a shader, and both pictures are image files".to_string(),
        );
    }
    let command = line.find_subcommand(NAME)?;
    let is_idle = |arg: &&clap::Arg| {
        let name = arg.get_id().as_str();
        !FOR_IMAGES.contains(&name)
            && arg.get_help_heading() != Some(heading::LIMITS)
            && found.try_contains_id(name).is_ok()
            && found.value_source(name) == Some(ValueSource::CommandLine)
    };
    let idle = command.get_arguments().find(is_idle)?;
    let name = idle.get_id().as_str().replace('_', "-");
    Some(format!(
        "--{} has no effect on image files: it is for running a shader",
        idle.get_long().unwrap_or(&name)
    ))
}

/// Compares two pictures. `words` is the command line, and `line` describes all command lines.
pub(in crate::cli) fn compare(
    args: &CompareArgs,
    words: &[OsString],
    line: fn() -> Command,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let other = match args.second.is_empty() {
        true => None,
        false => Some(second(words, line())?),
    };
    let path = other.as_ref().unwrap_or(args).other.clone();
    if path.is_none() && other.is_none() {
        return Err(Failure::usage(
            "a comparison takes two pictures: two files, or a shader and, after `--`, options for its second picture",
        ));
    }
    let (mut said, mut said_again) = (Vec::new(), Vec::new());
    let mut image = args.image();
    let left = side::of(&image, &mut console.to(&mut std::io::sink(), &mut said));
    console.again(&said);
    let left = left?;
    // The second picture has the options of the first one, and its own.
    if let Some(other) = &other {
        image = other.image();
    }
    image.shader.file = path.or(image.shader.file);
    let right = side::of(&image, &mut console.to(&mut std::io::sink(), &mut said_again));
    // Both runs of one shader mostly say the same.
    if said_again != said {
        console.again(&said_again);
    }
    let mut right = right?;
    // The two pictures of one shader differ in these words.
    for word in &args.second {
        right.name = format!("{} {}", right.name, word.to_string_lossy());
    }
    let measured = differ::measure(&left, &right, args.tolerance).map_err(Failure::new)?;
    let report = show::Report { left: &left, right: &right, measured: &measured, tolerance: args.tolerance };
    let file = args.output.as_deref().map(|path| show::picture(&report, path)).transpose()?;
    let text = if args.json { report.json()? } else { report.text() };
    console.report(&text);
    console.settle()?;
    if let (Some(file), Some(path)) = (file, &args.output) {
        file.file.save().map_err(Failure::new)?;
        let line = format!("wrote {}: {}\n", path.display(), file.legend);
        // With --json, the standard output has only the object.
        if args.json { console.text(&line) } else { console.report(&line) }
    }
    if measured.is_equal() { Ok(()) } else { Err(Failure::said()) }
}

/// The arguments of the second picture: those before `--`, and those after it, which take precedence.
fn second(words: &[OsString], line: Command) -> Result<CompareArgs, Failure> {
    let usage =
        |text: &str| Failure::usage(format!("after `--`: {}", text.trim_start_matches("error: ").trim_end()));
    let all: Vec<&OsString> = {
        let mut passed = false;
        // Only the first one separates the pictures.
        words
            .iter()
            .filter(|word| {
                passed || {
                    passed = *word == "--";
                    !passed
                }
            })
            .collect()
    };
    let whole = line.clone();
    let line = line.mut_subcommand(NAME, |command| command.args_override_self(true));
    let found =
        line.try_get_matches_from(all).map_err(|error| match misspelt::usage(words, &error, &whole) {
            Some(text) => usage(&text),
            None => usage(&error.render().to_string()),
        })?;
    let Some((NAME, options)) = found.subcommand() else {
        return Err(usage("only options of `oslrun compare` may follow"));
    };
    if let Some(text) = refused(options, &whole) {
        return Err(usage(&text));
    }
    let args = CompareArgs::from_arg_matches(options).map_err(|error| usage(&error.to_string()))?;
    match args.second.is_empty() {
        true => Ok(args),
        false => Err(usage("there are only two pictures, so `--` stands once")),
    }
}
