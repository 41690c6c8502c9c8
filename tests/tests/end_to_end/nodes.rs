//! Compares the shaders of `osl/nodes` with formulas: each runs as a layer of a group, with its inputs
//! computed here.

use osl::stages::{self, ShaderFiles};
use osl_exec::{PointSource, RunOptions, Services};
use osl_image::TextureCache;
use osl_ir::passes;
use osl_scene::Grid;
use osl_syntax::source::SourceProvider;
use osl_syntax::{NoFiles, Options};
use osl_tests::run;
use std::f64::consts::PI;

/// The nodes, and shaders that a test provides.
struct Library<'a>(&'a [(&'a str, &'a str)]);

impl ShaderFiles for Library<'_> {
    fn find(&self, shader: &str) -> Result<(String, String), String> {
        let own = self.0.iter().find(|(name, _)| *name == shader).map(|(_, text)| *text);
        let text = own.or_else(|| oslrun::nodes::find(shader)).ok_or("no such shader")?;
        Ok((format!("{shader}.osl"), text.to_string()))
    }

    fn includes(&self) -> &dyn SourceProvider {
        &NoFiles
    }
}

/// A word in a parameter, and its function of one number.
type Curve = (&'static str, fn(f64) -> f64);
/// A word in a parameter, and its function of two numbers.
type Blend = (&'static str, fn(f64, f64) -> f64);

/// Points along each side. Odd, so that some lie in the middle.
const SIDE: usize = 17;

/// The values of a group on the unit square.
struct Values(Vec<(String, Vec<f32>)>);

impl Values {
    fn get(&self, name: &str) -> &[f32] {
        &self.0.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no {name}")).1
    }

    /// Checks that each value is that of the formula, within single precision and the approximations of the
    /// reference.
    fn are(&self, name: &str, formula: impl Fn(f64, f64) -> f64) {
        for (point, got) in self.get(name).iter().enumerate() {
            let (x, y) = (point % SIDE, point / SIDE);
            let (u, v) = (x as f64 / (SIDE - 1) as f64, y as f64 / (SIDE - 1) as f64);
            let want = formula(u, v);
            let off = (f64::from(*got) - want).abs();
            assert!(off <= 3e-5 * want.abs().max(1.0), "{name} at {u}, {v}: {got}, not {want}");
        }
    }
}

/// Runs a group; the outputs are those of its last layer, and `more`.
fn values(text: &str, own: &[(&str, &str)], more: &[&str]) -> Values {
    let checked = stages::check_group(
        "group",
        text,
        "test",
        &Library(own),
        &Options { strict: true, ..Options::default() },
    );
    assert!(checked.diagnostics.is_empty(), "{text}: {:#?}", checked.diagnostics);
    let more: Vec<_> = more.iter().map(|name| (*name).into()).collect();
    let body = osl_lower::lower_group(&checked.group.unwrap(), &more).unwrap();
    let grid = Grid::new(SIDE, SIDE);
    let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
    let program = stages::finish(body, &options).program;
    let services = Services {
        textures: TextureCache::new(vec![run::root().join("tests/data/textures")]),
        ..Services::default()
    };
    let frame = osl_exec::run(&program, &services, &grid, &RunOptions::default(), &|_| ()).unwrap();
    assert!(frame.messages.is_empty(), "{text}: {:?}", frame.messages);
    Values(run::columns(&frame))
}

/// Runs one node with parameters set.
fn node(name: &str, params: &str) -> Values {
    values(&format!("{params} shader {name} n;"), &[], &[])
}

/// Runs one node whose input `to` is connected to an expression of u, v and P.
fn fed(name: &str, params: &str, to: &str, ty: &str, expression: &str) -> Values {
    let source = format!("shader feed(output {ty} o = 0) {{ o = {expression}; }}");
    values(
        &format!("shader feed f; {params} shader {name} n; connect f.o n.{to};"),
        &[("feed", &source)],
        &[],
    )
}

#[test]
fn fractal() {
    let octaves = "shader octaves(output float a = 0, output float b = 0, output float c = 0) {
        a = noise(\"simplex\", P * 3.0); b = 2 * noise(\"cell\", P * 7.5) - 1; c = noise(\"perlin\", P * 18.75);
    }";
    let alone = values("shader octaves o;", &[("octaves", octaves)], &[]);
    let [a, b, c] = ["a", "b", "c"].map(|n| alone.get(n));
    let params =
        "param float frequency 3; param int octaves 3; param float lacunarity 2.5; param float gain 0.6;
        param string type \"simplex\"; param string[3] octave_types \"\" \"cell\" \"perlin\";
        param float amplitude 0.8; param float offset 0.4; param float lo 0.3; param float hi 0.5;";
    for ridged in [false, true] {
        let got = node("fractal", &format!("{params} param int ridged {};", i32::from(ridged)));
        let fold = |x: f32| if ridged { 1.0 - 2.0 * x.abs() } else { x };
        for point in 0..SIDE * SIDE {
            let sum = fold(a[point]) + 0.6 * fold(b[point]) + 0.36 * fold(c[point]);
            let raw = sum / 1.96;
            assert!((got.get("raw")[point] - raw).abs() < 1e-5);
            assert!((got.get("result")[point] - (0.4 + 0.8 * raw).clamp(0.3, 0.5)).abs() < 1e-5);
        }
    }
    assert!(node("fractal", "param int octaves 0;").get("result").iter().all(|x| *x == 0.5));
}

#[test]
fn remap() {
    let ranges =
        "param float in_lo 0.25; param float in_hi 0.75; param float out_lo 2; param float out_hi -1;";
    let t = |u: f64| (u - 0.25) / 0.5;
    fed("remap", ranges, "value", "float", "u").are("result", |u, _| 2.0 - 3.0 * t(u).clamp(0.0, 1.0));
    let free = format!("{ranges} param int clamped 0; param float exponent 0.5;");
    fed("remap", &free, "value", "float", "u")
        .are("result", |u, _| 2.0 - 3.0 * t(u).abs().sqrt() * t(u).signum());
    let step = "param float in_lo 0.5; param float in_hi 0.5;";
    fed("remap", step, "value", "float", "u").are("result", |u, _| f64::from(u >= 0.5));
}

#[test]
fn clamp() {
    let bounds = "param float lo 0.25; param float hi 0.5;";
    fed("clamp", bounds, "value", "float", "u").are("result", |u, _| u.clamp(0.25, 0.5));
    let colors = fed("clamp", bounds, "tint", "color", "color(u, v, 2)");
    colors.are("result_color.r", |u, _| u.clamp(0.25, 0.5));
    colors.are("result_color.g", |_, v| v.clamp(0.25, 0.5));
    colors.are("result_color.b", |_, _| 0.5);
}

/// The weights of red, green and blue in the luminance: for the primaries of Rec. 709, those that give white
/// of D65.
fn luminance() -> [f64; 3] {
    let xyz = |x: f64, y: f64| [x / y, 1.0, (1.0 - x - y) / y];
    let [r, g, b, white] = [xyz(0.64, 0.33), xyz(0.3, 0.6), xyz(0.15, 0.06), xyz(0.3127, 0.3291)];
    let det = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            + c[0] * (a[1] * b[2] - a[2] * b[1])
    };
    [det(white, g, b), det(r, white, b), det(r, g, white)].map(|d| d / det(r, g, b))
}

#[test]
fn ramp() {
    let knots = "param float[3] positions 0.2 0.4 0.8; param color[3] colors 1 0 0 0 1 0 0 0 2;";
    let between = |shape: fn(f64) -> f64, u: f64, colors: [f64; 3]| match u {
        u if u < 0.4 => {
            let t = shape(((u - 0.2) / 0.2).clamp(0.0, 1.0));
            colors[0] * (1.0 - t) + colors[1] * t
        }
        u => {
            let t = shape(((u - 0.4) / 0.4).clamp(0.0, 1.0));
            colors[1] * (1.0 - t) + colors[2] * t
        }
    };
    let shapes: [Curve; 3] =
        [("linear", |t| t), ("smooth", |t| t * t * (3.0 - 2.0 * t)), ("constant", f64::floor)];
    let [red, green, blue] = luminance();
    for (name, shape) in shapes {
        let all = format!("{knots} param string interpolation \"{name}\";");
        let got = fed("ramp", &all, "position", "float", "u");
        got.are("result.r", |u, _| between(shape, u, [1.0, 0.0, 0.0]));
        got.are("result.g", |u, _| between(shape, u, [0.0, 1.0, 0.0]));
        got.are("result.b", |u, _| between(shape, u, [0.0, 0.0, 2.0]));
        got.are("value", |u, _| between(shape, u, [red, green, 2.0 * blue]));
    }
    fed("ramp", "", "position", "float", "u").are("result.g", |u, _| u);
}

#[test]
fn displacement_layer() {
    let params = "param float disp2 0.5; param float disp3 3; param float disp4 -1; param float gain1 2;
        param float gain2 0.5; param float gain3 0.1; param float gain4 0.25; param float gain 4;";
    let got = fed("displacement_layer", params, "disp1", "float", "u * v");
    let sum = |u: f64, v: f64| 4.0 * (2.0 * u * v + 0.25 + 0.3 - 0.25);
    got.are("result", sum);
    got.are("disp.z", sum);
    got.are("disp.x", |_, _| 0.0);
}

#[test]
fn mix() {
    let modes: [Blend; 9] = [
        ("blend", |_, b| b),
        ("add", |a, b| a + b),
        ("subtract", |a, b| a - b),
        ("multiply", |a, b| a * b),
        ("screen", |a, b| a + b - a * b),
        ("overlay", |a, b| if a < 0.5 { 2.0 * a * b } else { 1.0 - 2.0 * (1.0 - a) * (1.0 - b) }),
        ("difference", |a, b| (a - b).abs()),
        ("lighten", f64::max),
        ("darken", f64::min),
    ];
    for (name, mode) in modes {
        let params =
            format!("param string mode \"{name}\"; param color b 0.75 1.5 0; param float amount 0.25;");
        let got = fed("mix", &params, "a", "color", "color(u, v, u)");
        got.are("result.r", |u, _| 0.75 * u + 0.25 * mode(u, 0.75));
        got.are("result.g", |_, v| 0.75 * v + 0.25 * mode(v, 1.5));
        let got = fed("mix", &format!("{params} param int clamped 1;"), "a", "color", "color(u, v, u)");
        got.are("result.b", |u, _| (0.75 * u + 0.25 * mode(u, 0.0)).clamp(0.0, 1.0));
    }
}

#[test]
fn project_planar() {
    let place = "param point center 0.5 -1 2; param vector size 2 4 0.5;";
    let q = |u: f64, v: f64| [(u - 0.5) / 2.0, (v + 1.0) / 4.0, (1.0 - 2.0) / 0.5];
    for (axis, order) in [("x", [1, 2, 0]), ("y", [2, 0, 1]), ("z", [0, 1, 2])] {
        let got = node("project_planar", &format!("{place} param string axis \"{axis}\";"));
        got.are("UV.x", |u, v| q(u, v)[order[0]] + 0.5);
        got.are("UV.y", |u, v| q(u, v)[order[1]] + 0.5);
        got.are("UV.z", |u, v| q(u, v)[order[2]]);
    }
}

/// An angle from 0 to 1 around z from a center. The center is not on the grid, to avoid the seam.
fn around(u: f64, v: f64) -> f64 {
    ((v - 0.47).atan2(u - 0.53) / (2.0 * PI) + 0.25).rem_euclid(1.0)
}

#[test]
fn project_spherical() {
    let got = node("project_spherical", "param point center 0.53 0.47 0.5; param float turn 90;");
    let r = |u: f64, v: f64| ((u - 0.53).powi(2) + (v - 0.47).powi(2) + 0.25).sqrt();
    got.are("UV.x", around);
    got.are("UV.y", |u, v| (0.5 / r(u, v)).asin() / PI + 0.5);
    got.are("UV.z", r);
    let middle = fed("project_spherical", "", "p", "point", "point(0)");
    middle.are("UV.x", |_, _| 0.0);
    middle.are("UV.y", |_, _| 0.5);
}

#[test]
fn project_cylindrical() {
    let place = "param point center 0.53 0.47 0.5; param float turn 90; param float height 2;";
    let got = node("project_cylindrical", place);
    got.are("UV.x", around);
    got.are("UV.y", |_, _| 0.75);
    got.are("UV.z", |u, v| (u - 0.53).hypot(v - 0.47));
}

#[test]
fn project_triplanar() {
    let look = "shader look(string image = \"tex64.png\", point p = P, color w = 0, output color o = 0) {
        o = w[0] * (color) texture(image, p[1], p[2], \"wrap\", \"periodic\")
          + w[1] * (color) texture(image, p[2], p[0], \"wrap\", \"periodic\")
          + w[2] * (color) texture(image, p[0], p[1], \"wrap\", \"periodic\"); }";
    let feed = "shader feed(output normal o = 0) { o = normal(u + 0.1, v, -0.5); }";
    let params = "param string image \"tex64.png\"; param float sharpness 2; param string space \"common\";";
    let group = format!(
        "shader feed f; {params} shader project_triplanar n; connect f.o n.n; shader look l; connect n.weights l.w;"
    );
    let got = values(&group, &[("feed", feed), ("look", look)], &["n.result", "n.weights"]);
    let square = |u: f64, v: f64| (u + 0.1).powi(2) + v * v + 0.25;
    got.are("n.weights.r", |u, v| (u + 0.1).powi(2) / square(u, v));
    got.are("n.weights.g", |u, v| v * v / square(u, v));
    got.are("n.weights.b", |u, v| 0.25 / square(u, v));
    for part in ["r", "g", "b"] {
        let (one, other) = (got.get(&format!("o.{part}")), got.get(&format!("n.result.{part}")));
        assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-5));
    }
    assert!(got.get("o.r").iter().any(|x| *x > 0.1), "the picture is seen");
}

#[test]
fn uv_transform() {
    let place =
        "param float scale_u 3; param float scale_v 2; param float angle 30; param point pivot 0.25 0.5 0;
        param float offset_u 0.1; param float offset_v -0.2;";
    let (s, c) = (PI / 6.0).sin_cos();
    let x = |u: f64, v: f64| c * 3.0 * (u - 0.25) - s * 2.0 * (v - 0.5) + 0.35;
    let y = |u: f64, v: f64| s * 3.0 * (u - 0.25) + c * 2.0 * (v - 0.5) + 0.3;
    let wraps: [Curve; 4] = [
        ("none", |x| x),
        ("repeat", |x| x.rem_euclid(1.0)),
        ("mirror", |x| 1.0 - (x.rem_euclid(2.0) - 1.0).abs()),
        ("clamp", |x| x.clamp(0.0, 1.0)),
    ];
    for (name, wrap) in wraps {
        let got = node("uv_transform", &format!("{place} param string wrap \"{name}\";"));
        got.are("U", |u, v| wrap(x(u, v)));
        got.are("UV.x", |u, v| wrap(x(u, v)));
        got.are("V", |u, v| wrap(y(u, v)));
    }
}

#[test]
fn chaos_image() {
    let look = "shader look(point p = 0, output color o = 0) {
        o = texture(\"tex64.png\", p[0], p[1], \"wrap\", \"periodic\"); }";
    let params = "param string image \"tex64.png\"; param int tiles 3; param int seed 5;";
    let group = format!("{params} shader chaos_image n; shader look l; connect n.UV l.p;");
    let got = values(&group, &[("look", look)], &["n.result", "n.UV"]);
    assert_eq!(got.get("o.g"), got.get("n.result.g"));
    assert!(got.get("o.g").iter().any(|x| *x > 0.1), "the picture is seen");
    let shift = |u: f64, v: f64, part: u32| {
        let tile = [(u * 3.0).floor(), (v * 3.0).floor(), f64::from(10 + part)];
        let cell = tile.map(|x| x as i32 as u32);
        f64::from(osl_noise::hash::hash(cell)) / f64::from(u32::MAX)
    };
    got.are("n.UV.x", |u, v| u + shift(u, v, 0));
    got.are("n.UV.y", |u, v| v + shift(u, v, 1));

    // Blending: in the middle of a tile only that tile is visible, and there is no step at an edge.
    let fading = |u: f32, v: f32, blend: f32| {
        let more = format!("param float blend {blend}; param point uv {u} {v} 0;");
        node("chaos_image", &format!("{params} {more}")).get("result.r")[0]
    };
    assert_eq!(fading(0.5, 0.5, 0.9), fading(0.5, 0.5, 0.0));
    let edge = 1.0 / 3.0;
    assert!((fading(edge - 1e-4, 0.52, 0.5) - fading(edge + 1e-4, 0.52, 0.5)).abs() < 0.02);
    assert!((fading(0.4, 2.0 * edge - 1e-4, 0.5) - fading(0.4, 2.0 * edge + 1e-4, 0.5)).abs() < 0.02);
}

#[test]
fn bump() {
    // The height u² + 0.5 v rises by 2u along u and by 0.5 along v.
    let got = fed("bump", "param float scale 0.5;", "height", "float", "u * u + 0.5 * v");
    let inverse = |u: f64| 1.0 / (u * u + 0.0625 + 1.0).sqrt();
    got.are("result.x", |u, _| -u * inverse(u));
    got.are("result.y", |u, _| -0.25 * inverse(u));
    got.are("result.z", |u, _| inverse(u));
    got.are("encoded.g", |u, _| 0.5 - 0.125 * inverse(u));
}

#[test]
fn color_correct() {
    let light = "param float exposure 1; param color gain 1 0.5 1; param color offset 0 0.1 0;
        param float contrast 1.5; param float pivot 0.2; param float saturation 0.5; param float gamma 2;";
    let got = fed("color_correct", light, "tint", "color", "color(u, v, 0.5)");
    let lit = |u: f64, v: f64| [2.0 * u, v + 0.1, 1.0].map(|x| 0.2 + (x - 0.2) * 1.5);
    let formula = |u: f64, v: f64, part: usize| {
        let c = lit(u, v);
        let grey: f64 = luminance().iter().zip(c).map(|(weight, x)| weight * x).sum();
        (0.5 * (grey + c[part])).max(0.0).sqrt()
    };
    got.are("result.r", |u, v| formula(u, v, 0));
    got.are("result.g", |u, v| formula(u, v, 1));
    got.are("result.b", |u, v| formula(u, v, 2));
    // A third of a turn carries red to green.
    let turned =
        fed("color_correct", "param float hue 0.33333333;", "tint", "color", "color(0.25 + u, v * 0.2, 0)");
    turned.are("result.g", |u, _| 0.25 + u);
    turned.are("result.b", |_, v| 0.2 * v);
    turned.are("result.r", |_, _| 0.0);
}

/// The size of a group after the passes: instructions, lane registers and their words.
fn size(text: &str, output: &str) -> (usize, (usize, u32)) {
    let checked = stages::check_group("group", text, "test", &Library(&[]), &Options::default());
    let body = osl_lower::lower_group(&checked.group.unwrap(), &[]).unwrap();
    let varying = Grid::new(1, 1).varying().to_vec();
    let outputs = Some(vec![output.into()]);
    let options = passes::Options { outputs, varying, ..passes::Options::default() };
    let done = stages::finish(body, &options);
    (done.body.count(), done.program.register_words())
}

#[test]
fn idle_layers_leave_nothing_behind() {
    let file = run::root().join("crates/oslrun/benches/shaders/network.group");
    let needed = std::fs::read_to_string(file).unwrap();
    let idle: String = (0..25).map(|i| format!("shader fractal Noise{i}; shader remap Map{i};\n")).collect();
    let links: String = (0..25).map(|i| format!("connect Noise{i}.result Map{i}.value;\n")).collect();
    let chain: String = (1..25).map(|i| format!("connect Map{}.result Noise{i}.offset;\n", i - 1)).collect();
    let crowded = format!("{idle}{needed}{links}{chain}connect Map24.result Last.value;");
    assert_eq!(size(&needed, "result_color"), size(&crowded, "result_color"));
    assert!(size(&needed, "result").0 < size(&crowded, "result").0);
}
