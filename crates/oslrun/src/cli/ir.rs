//! `oslrun ir FILE`.

use super::args::{IrArgs, Stage};
use super::{Failure, input, report, run};
use crate::pipeline;
use osl_ir::passes;
use std::io::Write;

/// Prints the IR of a shader.
pub(super) fn ir(args: &IrArgs, out: &mut dyn Write, err: &mut dyn Write) -> Result<(), Failure> {
    let input = input::read(&args.file, &args.read)?;
    let checked = pipeline::check(&input.name, &input.text, &input.files, &input.options);
    report::diagnostics(&checked.diagnostics, &checked.sources, &args.read, err)?;
    let program = checked.program.ok_or_else(Failure::said)?;
    let body = run::lower(&program, &args.params, &checked.sources, &args.read, err)?;
    if args.stage != Stage::After {
        let _ = write!(out, "# before the passes\n{}", osl_ir::ir::print(&body));
    }
    if args.stage != Stage::Before {
        let outputs = args.outputs.as_ref().map(|list| list.iter().map(|o| o.as_str().into()).collect());
        let varying = osl_exec::PointSource::varying(&osl_scene::Grid::new(1, 1)).to_vec();
        let options =
            passes::Options { outputs, varying, slopes: Vec::new(), without: args.without_pass.clone() };
        let compiled = pipeline::finish(body, &options);
        let _ = write!(out, "# after the passes\n{}", osl_ir::ir::print(&compiled.body));
    }
    Ok(())
}
