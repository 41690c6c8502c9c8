//! What examines numbers examines closures too: their weights are those of a run, and their faults are found.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::passes;
use osl_limits::Limits;
use osl_measure::stability::{self, Base, Subject};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::collections::BTreeMap;
use std::sync::Arc;

const SHADERS: [&str; 6] = [
    "surface s() { Ci = u * diffuse(N) + emission() * color(0.5, v, 1); }",
    "surface s() { closure color a = 0; for (int i = 0; i < 3; i++) if (u > 0.3 * i) a += sin(v * i) * phong(N, u + 1); Ci = mix(0.2, 0.7, u) * a; }",
    "closure color twice(closure color a) { if (u > 0.5) return 2 * a; return a + -0.5 * a; }
     surface s() { Ci = twice(v * diffuse(N)) + twice(reflection(N)); }",
    "surface s() { closure color list[3]; list[0] = diffuse(N); list[1] = 0; list[2] = emission(); for (int i = 0; i < 3; i++) Ci += (u + i) * list[i]; if (v > 0.5) Ci = -Ci; }",
    "surface s(output closure color other = 0) { other = v * diffuse(N); Ci = other * u + 2 * other; }",
    "surface s() { Ci = 0.5 * layer(u * reflection(N), (1 - u) * diffuse(N)) + v * diffuse(N); }",
];

/// The values of the planes of a shader, by name and component: the weights that a run sums, or the numbers
/// that the pass adds.
fn planes(text: &str, by_pass: bool, asked: Option<&str>) -> BTreeMap<(String, usize), Vec<f32>> {
    let grid = Grid::new(16, 16);
    let checked = stages::check("s.osl", text, &NoFiles, &Options::default());
    let mut body =
        stages::lower(&checked.program.unwrap_or_else(|| panic!("{text}: {:?}", checked.diagnostics)), &[])
            .expect("it lowers");
    let mut outputs: Option<Vec<Arc<str>>> = asked.map(|name| vec![name.into()]);
    if by_pass {
        passes::closures_as_numbers(&mut body, outputs.as_mut());
    }
    let varying = grid.varying().to_vec();
    let options = passes::Options { outputs, varying, ..passes::Options::default() };
    let program = stages::finish(body, &options).program;
    let options = RunOptions { weights: true, ..RunOptions::default() };
    let frame = osl_exec::run(&program, &Services::default(), &grid, &options, &|_| ()).unwrap();
    let plane = |plane: &osl_exec::Plane| ((plane.output.to_string(), plane.component), plane.floats());
    frame.planes.iter().map(plane).collect()
}

#[test]
fn weights_are_those_of_a_run() {
    for text in SHADERS {
        let (run, mut numbers) = (planes(text, false, None), planes(text, true, None));
        numbers.retain(|(name, _), _| !name.contains("argument"));
        assert!(!run.is_empty());
        // A component that is only within a layer has no weight of its own.
        let within = |name: &(String, usize), plane: &Vec<f32>| {
            !run.contains_key(name) && plane.iter().all(|weight| *weight == 0.0)
        };
        numbers.retain(|name, plane| !within(name, plane));
        assert!(run.keys().eq(numbers.keys()), "{text}");
        // The run multiplies the factors of a weight in another order.
        let differs = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-6 * a.abs();
        let off = run.iter().find(|(name, plane)| plane.iter().zip(&numbers[*name]).any(differs));
        assert_eq!(off, None, "{text}");
    }
}

#[test]
fn parameters_and_what_layers_hold_are_numbers_too() {
    let numbers = planes(SHADERS[1], true, Some("Ci"));
    let names: Vec<&str> = numbers.keys().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["Ci.phong", "Ci.phong", "Ci.phong", "Ci.phong.argument2"], "N is not computed");
    let exponent = &numbers[&("Ci.phong.argument2".to_string(), 0)];
    assert_eq!((exponent[0], exponent[15]), (0.0, 2.0));
    let layered = planes(SHADERS[5], true, None);
    assert_eq!(layered[&("Ci.layer.argument1.reflection".to_string(), 0)][3], 0.2);
    assert_eq!(layered[&("Ci.layer.argument2.diffuse".to_string(), 0)][3], 0.8);
    // Only the requested closure counts.
    let other = planes(SHADERS[4], true, Some("other"));
    assert!(other.keys().all(|(name, _)| name == "other.diffuse"), "{other:?}");
}

#[test]
fn the_faults_of_closures_are_blamed() {
    let text =
        "surface c(float big = 10000) {\n    float d = (big + u) - big;\n    Ci = d * 100 * diffuse(N);\n}";
    let checked = stages::check("c.osl", text, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let (plain, noted) = (stages::lower(&program, &[]).unwrap(), stages::lower_noted(&program, &[]).unwrap());
    let (services, limits) = (Services::default(), Limits::default());
    let subject = Subject::new(&services, Base::new(plain, noted, None, &limits), &limits);
    let examined = stability::examine_given(&subject, &Grid::new(64, 64), 0.01, &checked.sources, "c");
    let first = examined.report.culprits.first().expect("a line to blame");
    assert_eq!(examined.report.left_out, [""; 0]);
    assert_eq!((first.line, first.is_event), (2, false));
}

#[test]
fn what_is_not_examined_is_said_first() {
    let text = "surface t(string how = \"ggx\", output string name = \"x\") {
        name = format(\"%g\", u); Ci = microfacet(how, N, 0.1 + u, 1.5, u > 0.5); }";
    let checked = stages::check("t.osl", text, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let (plain, noted) = (stages::lower(&program, &[]).unwrap(), stages::lower_noted(&program, &[]).unwrap());
    let (services, limits) = (Services::default(), Limits::default());
    let subject = Subject::new(&services, Base::new(plain, noted, None, &limits), &limits);
    let examined = stability::examine_given(&subject, &Grid::new(8, 8), 0.01, &checked.sources, "t");
    let said = stability::text::text(&examined.report, false);
    let first = said.lines().next().unwrap();
    assert!(first.contains("; not examined: the string `name`, argument"), "{first}");
    assert!(first.ends_with("of `microfacet`, which is an int"), "{first}");
}

#[test]
fn shares_of_events_are_those_of_all_points() {
    let text = "shader e(output float e = 0) {\n    e = smoothstep(v, u, 0.3);\n}";
    let checked = stages::check("e.osl", text, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let (plain, noted) = (stages::lower(&program, &[]).unwrap(), stages::lower_noted(&program, &[]).unwrap());
    let (services, limits) = (Services::default(), Limits::default());
    let subject = Subject::new(&services, Base::new(plain, noted, None, &limits), &limits);
    let examined = stability::examine_given(&subject, &Grid::new(64, 64), 0.01, &checked.sources, "e");
    // Where u <= v: 65 * 64 / 2 points of 4096.
    assert!(examined.report.noticed[0].why.contains("51 % of the points"), "{:?}", examined.report.noticed);
}
