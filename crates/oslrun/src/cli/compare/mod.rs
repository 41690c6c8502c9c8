//! `oslrun compare A B`: where two pictures differ, and by how much.
//!
//! Each picture is an image file, or the result of running a shader. `side` gets the pictures, `differ`
//! measures, and `show` writes the report and the picture of the difference. Words after `--` are options of
//! the second picture alone, so that one shader can be compared with itself under two settings. This module
//! must not know how shaders run.

mod differ;
mod show;
mod side;

pub(super) use differ::{At, measure};
pub(super) use show::{brief, color};
pub(super) use side::Side;

use super::Failure;
use super::args::{RunArgs, heading};
use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches};
use osl_image::ImageFormat;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// The name of the command.
pub(super) const NAME: &str = "compare";

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
#[command(after_help = AFTER)]
pub(super) struct CompareArgs {
    /// How shaders are run.
    #[command(flatten)]
    run: RunArgs,
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
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x: &f64| *x >= 0.0 && x.is_finite());
    number.ok_or_else(|| format!("a tolerance is a number from 0 on, not `{text}`"))
}

/// The options of a run, as they are for a comparison.
pub(super) fn options_of_a_comparison(command: Command) -> Command {
    let file = PathBufValueParser::new().try_map(difference_file);
    command
        .mut_arg("file", |arg| {
            let help = "The first picture: an image file, or a shader";
            arg.index(1).value_name("FILE").help(help).long_help(help)
        })
        .mut_arg("output", |arg| {
            let help = "Picture of the difference to write: .png shows the largest difference of each pixel, \
                        .exr holds the second picture minus the first for each channel";
            arg.value_parser(file).help(help).long_help(help)
        })
        .mut_arg("outputs", |arg| {
            let help = "Outputs or layers to compare, separated by commas (default: all)";
            arg.help(help).long_help(help)
        })
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
pub(super) fn refused(found: &ArgMatches, line: fn() -> Command) -> Option<String> {
    let image = |name| found.get_one::<PathBuf>(name).is_some_and(|path| !side::is_shader(path));
    if !image("file") || !image("other") {
        return None;
    }
    if found.get_many::<OsString>("second").is_some() {
        return Some(
            "the options after `--` are for a shader, and both pictures are image files".to_string(),
        );
    }
    let all = line();
    let command = all.find_subcommand(NAME)?;
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

/// How the whole command line is read, for the second picture: its description, and the message for the
/// first option that has no effect.
#[derive(Clone, Copy)]
pub(super) struct Reading {
    pub(super) line: fn() -> Command,
    pub(super) refused: fn(&ArgMatches) -> Option<String>,
}

/// Compares two pictures.
pub(super) fn compare(
    args: CompareArgs,
    (words, reading): (&[OsString], Reading),
    out: &mut dyn Write,
    err: &mut dyn Write,
) -> Result<(), Failure> {
    let other = match args.second.is_empty() {
        true => None,
        false => Some(second(words, reading)?),
    };
    let path = other.as_ref().unwrap_or(&args).other.clone();
    if path.is_none() && other.is_none() {
        return Err(Failure::usage(
            "a comparison takes two pictures: two files, or a shader and, after `--`, options for its second picture",
        ));
    }
    let CompareArgs { run, tolerance, json, second: options, .. } = args;
    let (mut run, picture) = without_picture(run);
    let (mut said, mut said_again) = (Vec::new(), Vec::new());
    let left = side::of(&run, &mut said);
    let _ = err.write_all(&said);
    let left = left?;
    // The second picture has the options of the first one, and its own.
    if let Some(other) = other {
        run = without_picture(other.run).0;
    }
    run.file = path.or(run.file);
    let right = side::of(&run, &mut said_again);
    // Both runs of one shader mostly say the same.
    if said_again != said {
        let _ = err.write_all(&said_again);
    }
    let mut right = right?;
    // The two pictures of one shader differ in these words.
    for word in &options {
        right.name = format!("{} {}", right.name, word.to_string_lossy());
    }
    let measured = differ::measure(&left, &right, tolerance).map_err(Failure::new)?;
    let report = show::Report { left: &left, right: &right, measured: &measured, tolerance };
    let file = picture.as_deref().map(|path| show::picture(&report, path)).transpose()?;
    let text = if json { report.json()? } else { report.text() };
    let _ = out.write_all(text.as_bytes());
    super::flushed(out)?;
    if let (Some(file), Some(path)) = (file, &picture) {
        file.file.save().map_err(Failure::new)?;
        let line = format!("wrote {}: {}", path.display(), file.legend);
        // With --json, the standard output has only the object.
        let _ = if json { writeln!(err, "{line}") } else { writeln!(out, "{line}") };
    }
    if measured.is_equal() { Ok(()) } else { Err(Failure::said()) }
}

/// The options of a run without a picture of its own, and the picture of the difference.
fn without_picture(mut run: RunArgs) -> (RunArgs, Option<PathBuf>) {
    let picture = run.output.take();
    (run, picture)
}

/// The arguments of the second picture: those before `--`, and those after it, which take precedence.
fn second(words: &[OsString], reading: Reading) -> Result<CompareArgs, Failure> {
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
    let line = (reading.line)().mut_subcommand(NAME, |command| command.args_override_self(true));
    let found = line.try_get_matches_from(all).map_err(|error| usage(&error.render().to_string()))?;
    if let Some(text) = (reading.refused)(&found) {
        return Err(usage(&text));
    }
    let Some((NAME, options)) = found.subcommand() else {
        return Err(usage("only options of `oslrun compare` may follow"));
    };
    let args = CompareArgs::from_arg_matches(options).map_err(|error| usage(&error.to_string()))?;
    match args.second.is_empty() {
        true => Ok(args),
        false => Err(usage("there are only two pictures, so `--` stands once")),
    }
}
