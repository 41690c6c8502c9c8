//! Options of a run that have no effect in a command which measures or explains: they are refused, so that
//! nobody relies on them.

use super::Failure;
use super::args::RunArgs;
use super::commands::Cli;
use clap::CommandFactory;

/// The options of a run that only matter for a picture or for its speed.
pub(super) const IDLE: [&str; 19] = [
    "output",
    "samples",
    "filter",
    "shading_rate",
    "adaptive",
    "max_error",
    "prefilter",
    "half",
    "stats",
    "profile",
    "threads",
    "batch",
    "isa",
    "arithmetic",
    "closures",
    "without_pass",
    "range",
    "signed",
    "exposure",
];

/// Fails if such an option is given.
pub(super) fn refuse(run: &RunArgs, command: &str) -> Result<(), Failure> {
    let sampling = &run.sampling;
    let given = [
        run.output.is_some(),
        sampling.samples.is_some(),
        sampling.filter.is_some(),
        sampling.shading_rate.is_some(),
        sampling.adaptive.is_some(),
        sampling.max_error.is_some(),
        sampling.prefilter,
        run.half,
        run.stats,
        run.profile.is_some(),
        run.threads.is_some(),
        run.batch.is_some(),
        run.isa.is_some(),
        run.arithmetic.is_some(),
        run.closures,
        !run.without_pass.is_empty(),
        run.display.is_given(),
    ];
    if run.max_steps.is_some() && command == "explain" {
        return Err(Failure::new("--max-steps has no effect in `explain`; --limit running.trace=N has"));
    }
    match IDLE.into_iter().zip(given).find(|(_, given)| *given) {
        Some((name, _)) => {
            let name = name.replace('_', "-");
            Err(Failure::new(format!("--{name} has no effect in `{command}`, so it is refused")))
        }
        None => Ok(()),
    }
}

/// The command line, without these options in the help of the commands.
pub(super) fn command_line() -> clap::Command {
    let hidden = |arg: clap::Arg| {
        let name = arg.get_id().as_str();
        let is_idle = IDLE.contains(&name) || matches!(name, "compression" | "format");
        if is_idle { arg.hide(true) } else { arg }
    };
    let hide = |command: clap::Command| command.mut_args(hidden);
    ["explain", "stability"].into_iter().fold(Cli::command(), |cli, name| cli.mut_subcommand(name, hide))
}
