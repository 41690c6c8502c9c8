//! The shaders of the bench. This module must not know what is measured.

use crate::cases::MORE;
use osl::stages;
use osl_exec::{PointSource, Program, Spaces};
use osl_ir::ir::Body;
use osl_ir::passes;
use osl_numeric::Arithmetic;
use osl_scene::Grid;
use osl_syntax::NoFiles;
use std::path::{Path, PathBuf};

const TEXTURE: &str = "tests/data/textures/tex64.png";

/// A shader to measure.
pub(crate) struct Shader {
    /// `first`, `second`, `suite` or `borders`.
    pub(crate) set: &'static str,
    pub(crate) name: &'static str,
    text: String,
    outputs: &'static [&'static str],
    params: &'static [(&'static str, &'static str)],
    /// Whether the points are at the centres of the pixels, as with `--center`.
    pub(crate) center: bool,
}

/// A shader in the usual arithmetic and, if that may be cheaper, in fast arithmetic, as on the command line.
pub(crate) struct Compiled {
    pub(crate) program: Program,
    pub(crate) fast: Option<Program>,
}

/// Name, file, outputs (empty means all), parameters.
type File = (&'static str, &'static str, &'static [&'static str], &'static [(&'static str, &'static str)]);

const FILES: [File; 14] = [
    ("Cobbled, resultRGB", "osl/Cobbled.osl", &["resultRGB"], &[]),
    ("Cobbled, resultMask", "osl/Cobbled.osl", &["resultMask"], &[]),
    ("flakes, result", "osl/flakes.osl", &["result"], &[]),
    ("sprinkles, Fac", "tests/data/seeds/sprinkles.repaired.osl", &["Fac"], &[]),
    ("strips, Fac", "osl/strips.osl", &["Fac"], &[]),
    ("nonlinear noise", "osl/nonlinear_noise.osl", &[], &[("type", "recursive")]),
    ("chaosmosaic, Color", "osl/chaosmosaic.osl", &[], &[("Image", TEXTURE)]),
    ("transcendental", "crates/oslrun/benches/shaders/transcendental.osl", &[], &[]),
    ("branches", "crates/oslrun/benches/shaders/branches.osl", &[], &[]),
    ("splines", "crates/oslrun/benches/shaders/splines.osl", &[], &[]),
    ("colors", "crates/oslrun/benches/shaders/colors.osl", &[], &[]),
    ("gabor", "crates/oslrun/benches/shaders/gabor.osl", &[], &[]),
    ("textures", "crates/oslrun/benches/shaders/textures.osl", &[], &[("image", TEXTURE)]),
    ("matrices", "crates/oslrun/benches/shaders/matrices.osl", &[], &[]),
];

/// Bodies of shaders with one output `r`.
const TEXTS: [(&str, &str); 13] = [
    ("constant", "r = 0.25;"),
    ("slope", "r = 3 * u - v;"),
    ("waves", "r = sin(9 * u) * cos(7 * v);"),
    ("fine waves", "r = sin(90 * u) * cos(70 * v);"),
    ("edge", "r = step(0.437, u + 0.3 * v);"),
    ("rings", "r = sin(400 * length(P - point(0.5, 0.5, 1))) > 0;"),
    ("checks", "r = mod(floor(13 * u) + floor(13 * v + 0.3 * u), 2);"),
    ("thin lines", "r = abs(mod(11.3 * u + 0.7 * v, 1) - 0.5) < 0.004;"),
    ("dots", "point p = 19.7 * P; point f = floor(p) + 0.5; f[2] = p[2]; r = distance(p, f) < 0.08;"),
    ("perlin", "r = noise(12 * P);"),
    ("fine perlin", "r = noise(300 * P);"),
    ("cells", "r = noise(\"cell\", 23 * P);"),
    ("white noise", "r = noise(\"hash\", 1e4 * P);"),
];

/// The second set was not used to choose the first parameters; later changes were tried on all sets.
const SECOND: [(&str, &str); 8] = [
    ("fine gabor", "r = noise(\"gabor\", 31 * P);"),
    ("grazing step", "r = step(0.05 + 0.9 * u, v + 0.02 * sin(37 * u));"),
    (
        "voronoi",
        "point p = 15 * P; p[2] = 0; r = 1e9;
         for (int i = -1; i <= 1; i++) for (int j = -1; j <= 1; j++) {
             point c = floor(p) + vector(i, j, 0); point q = c + noise(\"cell\", c); q[2] = 0;
             r = min(r, distance(p, q)); }",
    ),
    (
        "voronoi edges",
        "point p = 15 * P; p[2] = 0; float a = 1e9; float b = 1e9;
         for (int i = -1; i <= 1; i++) for (int j = -1; j <= 1; j++) {
             point c = floor(p) + vector(i, j, 0); point q = c + noise(\"cell\", c); q[2] = 0;
             float d = distance(p, q); if (d < a) { b = a; a = d; } else b = min(b, d); }
         r = b - a < 0.05;",
    ),
    (
        "five octaves",
        "float a = 1; point p = 20 * P; for (int i = 0; i < 5; i++) { r += a * noise(p); p *= 2; a *= 0.5; }",
    ),
    ("smooth and rough", "r = u < 0.5 ? sin(5 * v) : noise(\"hash\", 1e4 * P);"),
    (
        "mortar",
        "float y = 14 * v; float x = 7 * u + 0.5 * mod(floor(y), 2);
         r = (mod(x, 1) < 0.04 || mod(y, 1) < 0.08) ? 0.2 : 0.5 + 0.4 * noise(\"cell\", floor(x), floor(y)) + 0.1 * noise(90 * P);",
    ),
    (
        "specks",
        "point p = 41.3 * P; p[2] = 0; point c = floor(p);
         point q = c + 0.2 + 0.6 * noise(\"cell\", c); q[2] = 0;
         r = (noise(\"cell\", c + 0.5) > 0.9 && distance(p, q) < 0.1) ? 1 : 0.3 * u;",
    ),
];

/// Shaders with edges on the borders of pixels in images whose sides are powers of two, and lozenges whose
/// corners are smaller than a pixel.
const BORDERS: [(&str, &str); 4] = [
    ("checkerboard", "r = mod(floor(16 * u) + floor(16 * v), 2);"),
    ("wire frame", "r = mod(u, 0.125) < 0.015625 || mod(v, 0.125) < 0.015625;"),
    ("stripes", "r = mod(floor(32 * u), 2) * (0.6 + 0.4 * sin(9 * v));"),
    ("lozenges", "r = abs(mod(11 * u, 1) - 0.5) + abs(mod(11 * v, 1) - 0.5) < 0.42 ? 0.9 - 0.3 * v : 0.1;"),
];

/// The folder of the repository.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// All shaders.
pub(crate) fn shaders() -> Vec<Shader> {
    let file = |(name, file, outputs, params): &File| {
        let text = std::fs::read_to_string(root().join(file)).expect("a shader");
        Shader { set: "first", name, text, outputs, params, center: false }
    };
    let text = |set: &'static str, (name, text): &(&'static str, &str), center| {
        let text = format!("shader s(output float r = 0) {{ {text} }}");
        Shader { set, name, text, outputs: &[], params: &[], center }
    };
    let more = MORE.iter().map(|case| Shader {
        set: "suite",
        name: case.name,
        text: case.text(),
        outputs: &[],
        params: case.params,
        center: true,
    });
    let files = FILES.iter().map(file).chain(TEXTS.iter().map(|one| text("first", one, false)));
    let second = SECOND.iter().map(|one| text("second", one, false));
    files.chain(second).chain(more).chain(BORDERS.iter().map(|one| text("borders", one, true))).collect()
}

impl Shader {
    /// What tells the shader from others, as far as its values are concerned.
    pub(crate) fn identity(&self) -> String {
        format!("{} {:?} {:?} {}", self.text, self.outputs, self.params, self.center)
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// What the command line has to say beside the file and the size.
    pub(crate) fn arguments(&self) -> Vec<String> {
        let outputs = (!self.outputs.is_empty()).then(|| format!("--outputs={}", self.outputs.join(",")));
        let params = self.params.iter().flat_map(|(name, value)| ["-p".into(), format!("{name}={value}")]);
        outputs.into_iter().chain(params).chain(self.center.then(|| "--center".into())).collect()
    }

    /// The program before the passes, and the options of the passes.
    pub(crate) fn lowered(&self) -> (Body, passes::Options) {
        let params: Vec<(String, String)> =
            self.params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
        let checked = stages::check("shader.osl", &self.text, &NoFiles, &osl_syntax::Options::default());
        let body = stages::lower(&checked.program.expect("a program"), &params).expect("a body");
        let outputs = (!self.outputs.is_empty()).then(|| self.outputs.iter().map(|o| (*o).into()).collect());
        let varying = Grid::new(2, 2).varying().to_vec();
        let affine = Spaces::default().affine();
        (body, passes::Options { outputs, varying, derivs: Vec::new(), affine, ..passes::Options::default() })
    }

    pub(crate) fn compile(&self) -> Compiled {
        let (body, options) = self.lowered();
        let compiled = stages::finish(body.clone(), &options);
        let fast = compiled.body.is_cheaper_in_fast().then(|| {
            stages::finish(body, &passes::Options { arithmetic: Arithmetic::Fast, ..options }).program
        });
        Compiled { program: compiled.program, fast }
    }
}
