//! `oslrun ir FILE`.

use crate::cli::options::reading::{FormatArgs, LintArgs, ReadArgs};
use crate::cli::options::shader::NetworkArgs;
use crate::cli::print::Console;
use clap::{Args, ValueEnum};
use osl::stages;
use osl_exec::Spaces;
use osl_ir::passes::{self, Pass};
use osl_job::Failure;
use osl_job::request::values::{assignment, pass};
use osl_job::source::load::{self, Request};
use std::path::PathBuf;

/// Which IR to print.
#[derive(Debug, Args)]
pub(in crate::cli) struct IrArgs {
    /// The shader file, or the text of a group.
    #[arg(required = true, value_name = "FILE.osl")]
    file: Option<PathBuf>,
    #[command(flatten)]
    network: NetworkArgs,
    /// Value of a parameter; may be repeated.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment)]
    params: Vec<(String, String)>,
    /// Outputs to keep, separated by commas (default: all).
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    outputs: Option<Vec<String>>,
    /// Which stage to print.
    #[arg(long, value_enum, default_value_t)]
    stage: Stage,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass)]
    without_pass: Vec<Pass>,
    #[command(flatten)]
    lints: LintArgs,
    #[command(flatten)]
    read: ReadArgs,
    #[command(flatten)]
    format: FormatArgs,
}

/// Stages of the IR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Stage {
    /// Before and after the passes.
    #[default]
    Both,
    /// As lowered.
    Before,
    /// After the passes.
    After,
}

/// Prints the IR of a shader.
pub(in crate::cli) fn ir(args: &IrArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let (network, lints, reading) = (args.network.network(), args.lints.lints(), args.read.reading());
    let request = Request {
        note_derivs: false,
        opens: false,
        time: (0.0, 0.0),
        file: args.file.as_deref(),
        network: &network,
        params: &args.params,
        userdata: &[],
        outputs: args.outputs.as_deref(),
        taps: &[],
        more_taps: None,
        displace: None,
        read: &reading,
        lints: &lints,
        repair: None,
        write: None,
        allow_files: false,
        points: 1,
    };
    let body = load::load(&request, console)?.body;
    if args.stage != Stage::After {
        console.report(&format!("# before the passes\n{}", osl_ir::ir::print(&body)));
    }
    if args.stage != Stage::Before {
        let outputs = args.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
        let varying = osl_exec::PointSource::varying(&osl_scene::Grid::new(1, 1)).to_vec();
        let without = args.without_pass.clone();
        let limits = reading.limits.clone();
        let options = passes::Options {
            outputs,
            varying,
            derivs: Vec::new(),
            affine: Spaces::default().affine(),
            without,
            limits,
            ..passes::Options::default()
        };
        let compiled = stages::finish(body, &options);
        console.report(&format!("# after the passes\n{}", osl_ir::ir::print(&compiled.body)));
    }
    Ok(())
}
