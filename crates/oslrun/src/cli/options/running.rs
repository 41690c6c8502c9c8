//! How the program runs, and what is measured.

use super::heading;
use clap::Args;
use osl_exec::Isa;
use osl_ir::passes::Pass;
use osl_job::request::Running;
use osl_job::request::values::{amount, arithmetic, isa, pass};
use osl_numeric::Arithmetic;
use std::path::PathBuf;

/// The threads.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct ThreadArgs {
    /// Threads (default: all cores).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = heading::RUNNING)]
    threads: Option<u16>,
}

impl ThreadArgs {
    /// The number of threads; none for all cores.
    pub(in crate::cli) fn count(&self) -> Option<u16> {
        self.threads
    }
}

/// The work of each point.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct StepArgs {
    /// Maximum number of steps per point, such as 100M: the same as --limit running.point_steps=N.
    #[arg(long, value_name = "N", value_parser = amount, help_heading = heading::RUNNING)]
    max_steps: Option<u64>,
}

impl StepArgs {
    /// A run with this maximum.
    pub(in crate::cli) fn running(&self) -> Running {
        Running { max_steps: self.max_steps, ..Running::default() }
    }
}

/// Batches, instruction sets and steps.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct BatchArgs {
    /// Points per batch: each instruction runs on so many at once (default: chosen for the shader).
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536), help_heading = heading::RUNNING)]
    batch: Option<u32>,
    /// Instruction set (default: the widest that this machine has).
    #[arg(long, value_name = "NAME", value_parser = isa, help_heading = heading::RUNNING)]
    isa: Option<Isa>,
    #[command(flatten)]
    steps: StepArgs,
}

impl BatchArgs {
    /// A run in these batches.
    pub(in crate::cli) fn running(&self) -> Running {
        Running { batch: self.batch, isa: self.isa, ..self.steps.running() }
    }
}

/// Everything about a run that does not change what it computes.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct RunningArgs {
    #[command(flatten)]
    batch: BatchArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass, help_heading = heading::RUNNING)]
    without_pass: Vec<Pass>,
}

impl RunningArgs {
    /// How the program runs.
    pub(in crate::cli) fn running(&self) -> Running {
        let RunningArgs { batch, threads, without_pass } = self;
        Running { threads: threads.count(), without_pass: without_pass.clone(), ..batch.running() }
    }
}

/// The arithmetic.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct ArithmeticArgs {
    /// Arithmetic: strict, the same bits on every machine; fast, cheaper approximations in single precision;
    /// f64, double precision (default: strict).
    #[arg(long, value_name = "NAME", value_parser = arithmetic, help_heading = heading::RUNNING)]
    arithmetic: Option<Arithmetic>,
}

impl ArithmeticArgs {
    /// The arithmetic, if one is chosen.
    pub(in crate::cli) fn chosen(&self) -> Option<Arithmetic> {
        self.arithmetic
    }
}

/// Further outputs of a run.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(in crate::cli) struct MoreArgs {
    /// Add an output `steps`: the work that each point takes, in steps as the limit --max-steps counts them.
    /// In some shaders it also depends on --batch.
    #[arg(long, conflicts_with_all = ["on", "samples", "filter", "shading_rate", "adaptive", "max_error"], help_heading = heading::MEASURING)]
    steps: bool,
    /// Show the closures of the surface, and write their weights as layers.
    #[arg(long, conflicts_with = "on", help_heading = heading::PICTURE)]
    closures: bool,
}

impl MoreArgs {
    /// Whether the work of each point is an output.
    pub(in crate::cli) fn steps(&self) -> bool {
        self.steps
    }

    /// Whether closures are shown.
    pub(in crate::cli) fn closures(&self) -> bool {
        self.closures
    }
}

/// Figures about a run.
#[derive(Clone, Debug, Default, Args)]
pub(in crate::cli) struct MeasureArgs {
    /// Print times, points per second, and what each pass did.
    #[arg(long, help_heading = heading::MEASURING)]
    stats: bool,
    /// Print how the values of each output are distributed: range, mean, standard deviation, and a bar for
    /// each sixteenth of the range.
    #[arg(long, help_heading = heading::MEASURING)]
    histogram: bool,
    /// Print the processor time spent in each instruction and line, the least of five runs; with a file, also
    /// write a flame graph: an image (.svg), or its folded stacks.
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, conflicts_with = "on", help_heading = heading::MEASURING)]
    profile: Option<Option<PathBuf>>,
}

impl MeasureArgs {
    /// Whether times and rates are printed.
    pub(in crate::cli) fn stats(&self) -> bool {
        self.stats
    }

    /// Whether distributions are printed.
    pub(in crate::cli) fn histogram(&self) -> bool {
        self.histogram
    }

    /// Whether the time of each line is printed, and the file of the flame graph.
    pub(in crate::cli) fn profile(&self) -> Option<Option<PathBuf>> {
        self.profile.clone()
    }
}
