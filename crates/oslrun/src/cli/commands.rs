//! The commands. Each has a module, which also declares its options.

use super::editor::LspArgs;
use super::help::doc::DocArgs;
use super::help::explain_error::ExplainErrorArgs;
use super::help::pages::{CompletionArgs, ManArgs};
use super::help::version;
use super::measure::bounds::BoundsArgs;
use super::measure::explain::ExplainArgs;
use super::measure::lod::LodArgs;
use super::measure::sanitize::SanitizeArgs;
use super::measure::stability::StabilityArgs;
use super::measure::tradeoff::TradeoffArgs;
use super::options::reading;
use super::picture::bake::BakeArgs;
use super::picture::book::BookArgs;
use super::picture::compare::CompareArgs;
use super::picture::render::RenderArgs;
use super::picture::run::RunArgs;
use super::picture::studio::StudioArgs;
use super::source::check::CheckArgs;
use super::source::compile::CompileArgs;
use super::source::dialects::DialectsArgs;
use super::source::fmt::FmtArgs;
use super::source::info::InfoArgs;
use super::source::ir::IrArgs;
use super::source::portability::PortabilityArgs;
use clap::{Args, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

/// Compile and run Open Shading Language files on the CPU.
#[derive(Debug, Parser)]
#[command(name = "oslrun", version = version::short(), long_version = version::long(), args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct Cli {
    /// A command other than running a shader.
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    #[command(flatten)]
    pub(super) run: RunArgs,
}

/// The options of a run, if the command line is one, without an error and without a command.
///
/// Describing the options of all commands takes longer than compiling a shader, so that a run describes only
/// its own. The second value is the file of `--deps`. Every other line, also one with an error, is left to
/// [`Cli`].
pub(super) fn run_alone(args: &[OsString]) -> Option<(RunArgs, Option<PathBuf>)> {
    let first = args.get(1)?.to_str()?;
    if first == "help" || Command::has_subcommand(first) {
        return None;
    }
    let command = RunArgs::augment_args(clap::Command::new("oslrun")).disable_version_flag(true);
    let found = command.try_get_matches_from(args).ok()?;
    Some((RunArgs::from_arg_matches(&found).ok()?, reading::deps(&found)))
}

/// The commands other than running a shader.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Report errors and warnings of shader files.
    Check(CheckArgs),
    /// Print the intermediate representation of a shader before and after the passes.
    Ir(IrArgs),
    /// Explain an error or warning by its code, with a wrong and a right example.
    ExplainError(ExplainErrorArgs),
    /// Show what a shader does at one point, line by line, or what each output costs.
    Explain(Box<ExplainArgs>),
    /// Find inputs for which a shader becomes inaccurate, and the lines that cause it.
    Stability(Box<StabilityArgs>),
    /// Count numeric events by source line: divisions by zero, ints that overflow, NaN, lost digits.
    Sanitize(Box<SanitizeArgs>),
    /// Prove what holds at every point: ranges of outputs, arguments in their domain, indices in range.
    Bounds(Box<BoundsArgs>),
    /// Compile a shader to the text form that renderers load, .oso.
    Compile(CompileArgs),
    /// Show what a shader is: its kind, its parameters with types, defaults and metadata.
    Info(InfoArgs),
    /// List the dialects of renderers, or show the table of one: headers, attributes with defaults, what it
    /// lacks.
    Dialects(DialectsArgs),
    /// Say for each renderer what it lacks of what a shader uses, by line.
    Portability(PortabilityArgs),
    /// Rewrite shader files in one style.
    Fmt(FmtArgs),
    /// Serve an editor as a language server: diagnostics, completion, renaming and more, over the standard
    /// streams.
    Lsp(LspArgs),
    /// Describe the built-in functions: signatures, derivatives, extremes, an example.
    Doc(DocArgs),
    /// Measure what more and fewer samples of a shader cost, and how large their errors are.
    Tradeoff(Box<TradeoffArgs>),
    /// Write a shader that is simpler where a pixel covers much of its pattern: levels of detail by
    /// footprint.
    Lod(Box<LodArgs>),
    /// Compare two images, two shaders, or two settings of a shader: where they differ, and by how much.
    Compare(Box<CompareArgs>),
    /// Write the outputs of a shader as textures in tiles, one for each square of texture space (UDIM).
    Bake(Box<BakeArgs>),
    /// Write a page that shows the source of a shader, with a picture of each variable beside the line that
    /// sets it.
    PictureBook(Box<BookArgs>),
    /// Show a shader on a live page in the browser: its source, its picture, its parameters as sliders, and
    /// what happens at the pixel under the mouse.
    Studio(Box<StudioArgs>),
    /// Render a picture of a scene file: lighting, with the shaders of its materials.
    Render(Box<RenderArgs>),
    /// Print the completions of the command line for a shell.
    Completions(CompletionArgs),
    /// Print the manual page of oslrun, or of one of its commands.
    Man(ManArgs),
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split(' ').map(OsString::from).collect()
    }

    #[test]
    fn a_run_is_read_alike_with_and_without_the_commands() {
        let lines = [
            "oslrun a.osl",
            "oslrun a.osl -g 4x4 -o a.png --stats -p radius=2 --outputs f",
            "oslrun --stats check",
            "oslrun --json help",
            "oslrun -- check",
            "oslrun a.osl --time 1:2 --frames 3 -o a.#.png",
            "oslrun a.osl --watch --json --preview -o a.png",
            "oslrun a.osl --isa none",
            "oslrun a.osl b.osl",
            "oslrun a.osl check",
            "oslrun --stats",
            "oslrun",
        ];
        for line in lines.map(words) {
            let alone = run_alone(&line).map(|(alone, _)| alone);
            let all = Cli::try_parse_from(&line).ok();
            assert!(all.as_ref().is_none_or(|all| all.command.is_none()), "{line:?}");
            let all = all.map(|all| all.run);
            assert_eq!(format!("{alone:?}"), format!("{all:?}"), "{line:?}");
        }
    }

    #[test]
    fn commands_questions_and_errors_are_left_to_the_whole_command_line() {
        let lines =
            ["oslrun check a.osl", "oslrun help", "oslrun --help", "oslrun -V", "oslrun a.osl --colour"];
        for line in lines {
            assert!(run_alone(&words(line)).is_none(), "{line}");
        }
    }
}
