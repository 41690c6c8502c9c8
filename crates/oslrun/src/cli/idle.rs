//! Options of a run that have no effect in a command which measures or explains: they are refused, so that
//! nobody relies on them.
//!
//! This module must not know what the options mean.

use super::commands::Cli;
use super::{book, compare, lod, prove, sanitize, stability, studio};
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory};

/// The options that only matter for a picture that is written.
const PICTURE: [&str; 20] = [
    "output",
    "crop",
    "tap",
    "format",
    "half",
    "compression",
    "no_command",
    "range",
    "signed",
    "exposure",
    "closures",
    "steps",
    "samples",
    "filter",
    "shading_rate",
    "adaptive",
    "max_error",
    "within",
    "prefilter",
    "arithmetic",
];

/// The options of each command that have no effect in it, besides those for a picture.
const COMMANDS: [(&str, &[&str]); 7] = [
    ("explain", &["stats", "histogram", "profile", "threads", "batch", "isa", "without_pass", "max_steps"]),
    (
        "stability",
        &["time", "global", "stats", "histogram", "profile", "threads", "batch", "isa", "without_pass", "on"],
    ),
    (sanitize::NAME, &["stats", "histogram", "profile", "batch", "isa", "without_pass", "max_steps"]),
    (
        prove::NAME,
        &[
            "stats",
            "histogram",
            "profile",
            "batch",
            "isa",
            "without_pass",
            "max_steps",
            "on",
            "displace",
            "edge_pixels",
            "level",
            "catmull_clark",
            "eye",
        ],
    ),
    ("tradeoff", &["stats", "histogram", "profile", "on"]),
    (
        lod::NAME,
        &[
            "outputs",
            "time",
            "global",
            "userdata",
            "attributes",
            "stats",
            "histogram",
            "profile",
            "threads",
            "without_pass",
            "on",
            "displace",
            "edge_pixels",
            "level",
            "catmull_clark",
            "eye",
            "group",
            "layer",
            "connect",
            "shader_path",
            "group_name",
            "write",
        ],
    ),
    (
        book::NAME,
        &[
            "outputs",
            "stats",
            "histogram",
            "profile",
            "on",
            "displace",
            "edge_pixels",
            "level",
            "catmull_clark",
            "eye",
            "group",
            "layer",
            "connect",
            "shader_path",
            "group_name",
            "write",
        ],
    ),
];

/// What to use instead of an option.
fn instead(command: &str, option: &str) -> &'static str {
    match (command, option) {
        ("explain" | sanitize::NAME, "max_steps") => "; --limit running.trace=N has one",
        (book::NAME, "tap") => ": it has a picture of each variable",
        (book::NAME, "on") => ": it shows the grid",
        (lod::NAME, "outputs") => ": the written shader keeps all outputs",
        (prove::NAME, "on") => ": it proves bounds on the patch",
        (_, "on") => ": it examines the grid",
        ("tradeoff", "arithmetic") => ": it measures all kinds",
        ("tradeoff", "samples" | "shading_rate") => ": it measures several",
        _ => "",
    }
}

/// The options that have no effect in a comparison, which uses the values of a run and writes its own
/// picture.
const COMPARED: [&str; 12] = [
    "within",
    "format",
    "half",
    "compression",
    "no_command",
    "range",
    "signed",
    "exposure",
    "stats",
    "histogram",
    "profile",
    "write",
];

/// The options that have no effect on a live page, which writes no files and shows one output of all points.
const LIVE: [&str; 15] = [
    "within",
    "output",
    "crop",
    "tap",
    "format",
    "half",
    "compression",
    "no_command",
    "steps",
    "closures",
    "stats",
    "histogram",
    "profile",
    "write",
    "message_format",
];

fn has_no_effect(command: &str, option: &str) -> bool {
    if command == compare::NAME {
        return COMPARED.contains(&option);
    }
    if command == studio::NAME {
        return LIVE.contains(&option);
    }
    let own = COMMANDS.iter().find(|(name, _)| *name == command);
    let is_own = match command {
        book::NAME => option == "output",
        lod::NAME => ["output", "samples"].contains(&option),
        _ => false,
    };
    own.is_some_and(|(_, options)| (PICTURE.contains(&option) && !is_own) || options.contains(&option))
}

/// The message for the first option on the command line that has no effect in its command.
pub(super) fn refused(found: &ArgMatches) -> Option<String> {
    let (command, options) = found.subcommand()?;
    let is_typed = |name: &str| options.value_source(name) == Some(ValueSource::CommandLine);
    if command == compare::NAME
        && let Some(text) = compare::refused(options, command_line)
    {
        return Some(text);
    }
    let name = options.ids().map(clap::Id::as_str).find(|id| has_no_effect(command, id) && is_typed(id))?;
    let instead = instead(command, name);
    Some(format!("--{} has no effect in `{command}`{instead}", name.replace('_', "-")))
}

/// The command line, without these options in the help of the commands.
pub(super) fn command_line() -> clap::Command {
    let cli = Cli::command()
        .mut_subcommand(book::NAME, book::options_of_a_page)
        .mut_subcommand(compare::NAME, compare::options_of_a_comparison)
        .mut_subcommand(lod::NAME, lod::own_options)
        .mut_subcommand(sanitize::NAME, sanitize::own_options)
        .mut_subcommand(stability::NAME, stability::own_options)
        .mut_subcommand(studio::NAME, studio::options_of_a_page);
    let names = COMMANDS.into_iter().map(|(name, _)| name).chain([compare::NAME, studio::NAME]);
    names.fold(cli, |cli, name| {
        cli.mut_subcommand(name, |command| {
            command.mut_args(|arg| {
                let is_idle = has_no_effect(name, arg.get_id().as_str());
                if is_idle { arg.hide(true) } else { arg }
            })
        })
    })
}
