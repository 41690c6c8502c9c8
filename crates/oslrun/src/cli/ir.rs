//! `oslrun ir FILE`.

use super::Failure;
use super::args::levels::LintArgs;
use super::args::values::{assignment, pass};
use super::args::{NetworkArgs, ReadArgs};
use super::load::{self, Request};
use clap::{Args, ValueEnum};
use osl::stages;
use osl_exec::Spaces;
use osl_ir::passes::{self, Pass};
use std::io::Write;
use std::path::PathBuf;

/// Which IR to print.
#[derive(Debug, Args)]
pub(super) struct IrArgs {
    /// The shader file, or the text of a group.
    #[arg(required_unless_present_any = ["group", "layer"], value_name = "FILE.osl")]
    pub(super) file: Option<PathBuf>,
    /// A group of shaders.
    #[command(flatten)]
    pub(super) network: NetworkArgs,
    /// Value of a parameter; may be repeated.
    #[arg(short, long = "param", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(super) params: Vec<(String, String)>,
    /// Outputs to keep, separated by commas (default: all).
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub(super) outputs: Option<Vec<String>>,
    /// Which stage to print.
    #[arg(long, value_enum, default_value_t)]
    pub(super) stage: Stage,
    /// Pass to skip; may be repeated.
    #[arg(long, value_name = "PASS", value_parser = pass)]
    pub(super) without_pass: Vec<Pass>,
    /// The warnings to report.
    #[command(flatten)]
    pub(super) lints: LintArgs,
    /// The options for reading the file.
    #[command(flatten)]
    pub(super) read: ReadArgs,
}

/// Stages of the IR.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Stage {
    /// Before and after the passes.
    #[default]
    Both,
    /// As lowered.
    Before,
    /// After the passes.
    After,
}

/// Prints the IR of a shader.
pub(super) fn ir(args: &IrArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let request = Request {
        note_derivs: false,
        file: args.file.as_deref(),
        network: &args.network,
        params: &args.params,
        userdata: &[],
        outputs: args.outputs.as_deref(),
        taps: &[],
        more_taps: None,
        displace: None,
        read: &args.read,
        lints: &args.lints,
        repair: None,
        write: None,
        allow_files: false,
        points: 1,
    };
    let body = load::load(&request, err)?.body;
    if args.stage != Stage::After {
        let _ = write!(out, "# before the passes\n{}", osl_ir::ir::print(&body));
    }
    if args.stage != Stage::Before {
        let outputs = args.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
        let varying = osl_exec::PointSource::varying(&osl_scene::Grid::new(1, 1)).to_vec();
        let without = args.without_pass.clone();
        let limits = args.read.limits.limits().clone();
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
        let _ = write!(out, "# after the passes\n{}", osl_ir::ir::print(&compiled.body));
    }
    Ok(())
}
