//! From a shader's text to its values on a grid.

use crate::golden::Golden;
use crate::host;
use osl::stages;
use osl_exec::{Arithmetic, Frame, PointSource, RunOptions, Services};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_ir::types::Type;
use osl_lower::params::{self, ParamValues};
use osl_scene::{Grid, reference_spaces};
use osl_syntax::source::SourceMap;
use osl_syntax::{NoFiles, Options};
use std::path::{Path, PathBuf};

/// The folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The named spaces and textures with which reference results were recorded.
pub fn services() -> Services {
    Services {
        spaces: reference_spaces(64, 64),
        textures: TextureCache::new(vec![root().join("tests/data/textures")]),
        ..Services::default()
    }
}

/// Compiles a shader for parameter values.
///
/// # Errors
/// The diagnostics, as text.
pub fn compile(
    name: &str,
    text: &str,
    params: &[(String, String)],
    options: &passes::Options,
) -> Result<stages::Compiled, String> {
    let checked = stages::check(name, text, &NoFiles, &Options::default());
    let program = checked.program.ok_or_else(|| format!("{:#?}", checked.diagnostics))?;
    let body = stages::lower(&program, params).map_err(|e| format!("{e:?}"))?;
    Ok(stages::finish(body, options))
}

/// Runs a shader on a grid with the reference's spaces.
///
/// # Errors
/// The diagnostics, as text.
pub fn run(
    name: &str,
    text: &str,
    params: &[(String, String)],
    grid: &Grid,
    options: &RunOptions,
) -> Result<Frame, String> {
    run_in(Arithmetic::Strict, (name, text, params), grid, options)
}

/// The same in a given arithmetic.
///
/// # Errors
/// The diagnostics, as text.
pub fn run_in(
    arithmetic: Arithmetic,
    (name, text, params): (&str, &str, &[(String, String)]),
    grid: &Grid,
    options: &RunOptions,
) -> Result<Frame, String> {
    let varying = grid.varying().to_vec();
    let passes = passes::Options { varying, arithmetic, ..passes::Options::default() };
    let compiled = compile(name, text, params, &passes)?;
    osl_exec::run(&compiled.program, &services(), grid, options, &|_| ()).map_err(|e| e.to_string())
}

/// Runs a shader under the conditions of a recorded run: values that do not match their parameters are
/// ignored.
///
/// # Errors
/// The diagnostics, as text.
pub fn like(
    name: &str,
    text: &str,
    golden: &Golden,
    options: &RunOptions,
) -> Result<(Frame, SourceMap), String> {
    let host = host::renderer(golden);
    let checked = stages::check(name, text, &NoFiles, &Options::default());
    let program = checked.program.ok_or_else(|| format!("{:#?}", checked.diagnostics))?;
    let mut values = ParamValues::default();
    for (ty, name, value) in &golden.params {
        if let Some(ty) = Type::parse(ty) {
            let _ = params::set_typed(&program, &mut values, ty, name, value);
        }
    }
    golden.interpolated.iter().for_each(|name| values.interpolate(name));
    let body = osl_lower::lower(&program, &values).map_err(|e| format!("{e:#?}"))?;
    let passes = passes::Options {
        varying: host.varying().to_vec(),
        derivs: host.varying_derivs().to_vec(),
        traces: host.traces(),
        ..passes::Options::default()
    };
    let compiled = stages::finish(body, &passes);
    let frame = osl_exec::run(&compiled.program, &host::services(golden, &host), &host, options, &|_| ());
    Ok((frame.map_err(|e| e.to_string())?, checked.sources))
}

/// The planes of a frame under the names that recorded columns have: `c.r`, `p.x`, `m[0][1]`, `f`.
pub fn columns(frame: &Frame) -> Vec<(String, Vec<f32>)> {
    frame.planes.iter().map(|p| (column(p), p.floats())).collect()
}

fn column(plane: &osl_exec::Plane) -> String {
    use osl_ir::types::Type;
    let letters = match plane.ty {
        Type::COLOR => [".r", ".g", ".b"],
        Type::MATRIX => return format!("{}[{}][{}]", plane.output, plane.component / 4, plane.component % 4),
        ty if ty.is_triple() => [".x", ".y", ".z"],
        _ => ["", "", ""],
    };
    format!("{}{}", plane.output, letters[plane.component])
}

/// The usual limits, except for the steps of a point.
pub fn steps(n: u64) -> osl_limits::Limits {
    let mut limits = osl_limits::Limits::default();
    limits.running.point_steps = n;
    limits
}
