//! From a shader's text to its values on a grid.

use crate::golden::Golden;
use osl_exec::{Frame, RunOptions, Services};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_scene::{Grid, reference_spaces};
use osl_syntax::{NoFiles, Options};
use oslrun::pipeline;
use std::path::{Path, PathBuf};

/// The folder of the repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The grid of a recorded run.
pub fn grid(golden: &Golden) -> Grid {
    Grid {
        width: golden.size.0,
        height: golden.size.1,
        scale: golden.scale,
        offset: golden.offset,
        center: golden.center,
    }
}

/// Named spaces and textures as reference results were recorded with.
pub fn services() -> Services {
    Services {
        spaces: reference_spaces(),
        textures: TextureCache::new(vec![root().join("tests/data/textures")]),
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
) -> Result<pipeline::Compiled, String> {
    let checked = pipeline::check(name, text, &NoFiles, &Options::default());
    let program = checked.program.ok_or_else(|| format!("{:#?}", checked.diagnostics))?;
    let body = pipeline::lower(&program, params).map_err(|e| format!("{e:?}"))?;
    Ok(pipeline::finish(body, options))
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
    let varying = osl_exec::PointSource::varying(grid).to_vec();
    let compiled = compile(name, text, params, &passes::Options { varying, ..passes::Options::default() })?;
    osl_exec::run(&compiled.program, &services(), grid, options, &|_| ()).map_err(|e| e.to_string())
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
