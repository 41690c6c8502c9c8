//! `oslrun ir FILE`.

use super::Failure;
use super::args::{IrArgs, Stage};
use super::load::{self, Request};
use crate::pipeline;
use osl_ir::passes;
use std::io::Write;

/// Prints the IR of a shader.
pub(super) fn ir(args: &IrArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let request = Request {
        file: args.file.as_deref(),
        network: &args.network,
        params: &args.params,
        outputs: args.outputs.as_deref(),
        displace: None,
        read: &args.read,
        lints: &args.lints,
        repair: None,
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
            slopes: Vec::new(),
            without,
            limits,
            ..passes::Options::default()
        };
        let compiled = pipeline::finish(body, &options);
        let _ = write!(out, "# after the passes\n{}", osl_ir::ir::print(&compiled.body));
    }
    Ok(())
}
