//! The shaders of the benches, and how to compile one. This module must not know what is measured.

use osl::stages::{self, ShaderFiles};
use osl_exec::{PointSource, Program, Services, Spaces};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::NoFiles;
use osl_syntax::source::SourceProvider;
use std::path::{Path, PathBuf};

/// A shader to run.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    file: &'static str,
    /// The outputs to compute; all if there are none.
    #[allow(dead_code, reason = "not every bench uses it")]
    outputs: &'static [&'static str],
    pub(crate) params: &'static [(&'static str, &'static str)],
}

/// The seed shaders, and shaders that cover the library.
#[allow(dead_code, reason = "not every bench uses it")]
pub(crate) const CASES: [Case; 22] = [
    case("Cobbled, all outputs", "osl/Cobbled.osl", &[], &[]),
    case("Cobbled, resultRGB", "osl/Cobbled.osl", &["resultRGB"], &[]),
    case("Cobbled, resultMask", "osl/Cobbled.osl", &["resultMask"], &[]),
    case("flakes, result", "osl/flakes.osl", &["result"], &[]),
    case("sprinkles, Fac", "tests/data/seeds/sprinkles.repaired.osl", &["Fac"], &[]),
    case("strips, all outputs", "osl/strips.osl", &[], &[]),
    case("strips, Fac", "osl/strips.osl", &["Fac"], &[]),
    case("nonlinear noise, recursive", "osl/nonlinear_noise.osl", &[], &[("type", "recursive")]),
    case("chaosmosaic, Color", "osl/chaosmosaic.osl", &[], &[("Image", TEXTURE)]),
    case("matrices", "crates/oslrun/benches/shaders/matrices.osl", &[], &[]),
    case("transcendental", "crates/oslrun/benches/shaders/transcendental.osl", &[], &[]),
    case("branches", "crates/oslrun/benches/shaders/branches.osl", &[], &[]),
    case("loops", "crates/oslrun/benches/shaders/loops.osl", &[], &[]),
    case("pattern", "crates/oslrun/benches/shaders/pattern.osl", &[], &[]),
    case("ramps", "crates/oslrun/benches/shaders/ramps.osl", &[], &[]),
    case("splines", "crates/oslrun/benches/shaders/splines.osl", &[], &[]),
    case("colors", "crates/oslrun/benches/shaders/colors.osl", &[], &[]),
    case("gabor", "crates/oslrun/benches/shaders/gabor.osl", &[], &[]),
    case("textures", "crates/oslrun/benches/shaders/textures.osl", &[], &[("image", TEXTURE)]),
    case("derivatives", "crates/oslrun/benches/shaders/derivatives.osl", &[], &[]),
    case("strings", "crates/oslrun/benches/shaders/strings.osl", &[], &[]),
    case("network", "crates/oslrun/benches/shaders/network.group", &[], &[]),
];

/// Shaders that resemble published ones: procedural textures with loops, graphs of nodes, fractals, tilings,
/// toon and weave patterns, ramps in arrays, searches of cells, blends of textures.
#[allow(dead_code, reason = "not every bench uses it")]
pub(crate) const MORE: [Case; 37] = [
    more("marble", "crates/oslrun/benches/shaders/suite/marble.osl"),
    more("wood", "crates/oslrun/benches/shaders/suite/wood.osl"),
    more("ridges", "crates/oslrun/benches/shaders/suite/ridges.osl"),
    more("bricks", "crates/oslrun/benches/shaders/suite/bricks.osl"),
    more("rust", "crates/oslrun/benches/shaders/suite/rust.osl"),
    more("clouds", "crates/oslrun/benches/shaders/suite/clouds.osl"),
    more("graph_stone", "crates/oslrun/benches/shaders/suite/graph_stone.osl"),
    more("graph_surface", "crates/oslrun/benches/shaders/suite/graph_surface.osl"),
    more("graph_noise2d", "crates/oslrun/benches/shaders/suite/graph_noise2d.osl"),
    more("graph_switch", "crates/oslrun/benches/shaders/suite/graph_switch.osl"),
    more("mandelbrot", "crates/oslrun/benches/shaders/suite/mandelbrot.osl"),
    more("julia", "crates/oslrun/benches/shaders/suite/julia.osl"),
    more("sierpinski", "crates/oslrun/benches/shaders/suite/sierpinski.osl"),
    more("newton", "crates/oslrun/benches/shaders/suite/newton.osl"),
    more("hexagons", "crates/oslrun/benches/shaders/suite/hexagons.osl"),
    more("herringbone", "crates/oslrun/benches/shaders/suite/herringbone.osl"),
    more("truchet", "crates/oslrun/benches/shaders/suite/truchet.osl"),
    more("kaleidoscope", "crates/oslrun/benches/shaders/suite/kaleidoscope.osl"),
    more("toon", "crates/oslrun/benches/shaders/suite/toon.osl"),
    more("halftone", "crates/oslrun/benches/shaders/suite/halftone.osl"),
    more("weave", "crates/oslrun/benches/shaders/suite/weave.osl"),
    more("tartan", "crates/oslrun/benches/shaders/suite/tartan.osl"),
    more("ramp_search", "crates/oslrun/benches/shaders/suite/ramp_search.osl"),
    more("ramp_splines", "crates/oslrun/benches/shaders/suite/ramp_splines.osl"),
    more("palette", "crates/oslrun/benches/shaders/suite/palette.osl"),
    more("bins", "crates/oslrun/benches/shaders/suite/bins.osl"),
    more("worley", "crates/oslrun/benches/shaders/suite/worley.osl"),
    more("crackle", "crates/oslrun/benches/shaders/suite/crackle.osl"),
    more("bubbles", "crates/oslrun/benches/shaders/suite/bubbles.osl"),
    more("patch", "crates/oslrun/benches/shaders/suite/patch.osl"),
    more("neighbours", "crates/oslrun/benches/shaders/suite/neighbours.osl"),
    more("layers", "crates/oslrun/benches/shaders/suite/layers.osl"),
    more("first_hit", "crates/oslrun/benches/shaders/suite/first_hit.osl"),
    more("lookups", "crates/oslrun/benches/shaders/suite/lookups.osl"),
    textured("triplanar", "crates/oslrun/benches/shaders/suite/triplanar.osl"),
    textured("splats", "crates/oslrun/benches/shaders/suite/splats.osl"),
    textured("decals", "crates/oslrun/benches/shaders/suite/decals.osl"),
];

const TEXTURE: &str = "tests/data/textures/tex64.png";

const fn case(
    name: &'static str,
    file: &'static str,
    outputs: &'static [&'static str],
    params: &'static [(&'static str, &'static str)],
) -> Case {
    Case { name, file, outputs, params }
}

const fn more(name: &'static str, file: &'static str) -> Case {
    case(name, file, &[], &[])
}

const fn textured(name: &'static str, file: &'static str) -> Case {
    case(name, file, &[], &[("image", TEXTURE)])
}

/// The built-in shaders.
#[allow(dead_code, reason = "not every bench uses it")]
struct Nodes;

impl ShaderFiles for Nodes {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let text = oslrun::nodes::find(shader).ok_or("no such node")?;
        Ok((format!("{shader}.osl"), text.to_string()))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// What shaders ask for, with the textures of the repository.
pub(crate) fn services() -> Services {
    Services { spaces: Spaces::default(), textures: TextureCache::new(vec![root()]), ..Services::default() }
}

impl Case {
    /// The text of the shader.
    pub(crate) fn text(&self) -> String {
        std::fs::read_to_string(root().join(self.file)).expect("a shader of the repository")
    }

    /// Compiles the shader for a grid.
    #[allow(dead_code, reason = "not every bench uses it")]
    pub(crate) fn compile(&self, text: &str, grid: &Grid) -> Program {
        let options = osl_syntax::Options::default();
        let body = if self.file.ends_with(".group") {
            let checked = stages::check_group(self.file, text, "bench", &Nodes, &options);
            osl_lower::lower_group(&checked.group.expect("a group"), &[]).expect("a body")
        } else {
            let params: Vec<(String, String)> =
                self.params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
            let checked = stages::check(self.file, text, &NoFiles, &options);
            stages::lower(&checked.program.expect("a program"), &params).expect("a body")
        };
        let outputs = (!self.outputs.is_empty()).then(|| self.outputs.iter().map(|o| (*o).into()).collect());
        let options =
            passes::Options { outputs, varying: grid.varying().to_vec(), ..passes::Options::default() };
        stages::finish(body, &options).program
    }
}
