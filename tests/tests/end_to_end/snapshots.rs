//! Snapshots for each seed shader: IR before and after the passes, and a sample of its values. The crate that
//! makes tokens and trees has its own snapshots.

use osl_exec::RunOptions;
use osl_ir::passes;
use osl_scene::Grid;
use osl_tests::run;
use std::fmt::Write;

fn text(path: &str) -> String {
    std::fs::read_to_string(run::root().join(path)).unwrap()
}

fn snapshots(name: &str, path: &str, params: &[(&str, &str)]) {
    let text = text(path);
    let params: Vec<(String, String)> = params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    let checked = osl::stages::check(name, &text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    let body = osl::stages::lower(&checked.program.unwrap(), &params).unwrap();
    insta::assert_snapshot!(format!("{name}_ir_before"), osl_ir::ir::print(&body));
    let varying = osl_exec::PointSource::varying(&Grid::new(1, 1)).to_vec();
    let compiled = osl::stages::finish(body, &passes::Options { varying, ..passes::Options::default() });
    insta::assert_snapshot!(format!("{name}_ir_after"), osl_ir::ir::print(&compiled.body));
    insta::assert_snapshot!(format!("{name}_values"), values(name, &text, &params));
}

/// Every output at some points, in full precision.
fn values(name: &str, text: &str, params: &[(String, String)]) -> String {
    let grid = Grid { scale: [3.0, 3.0], offset: [-1.0, -1.0], ..Grid::new(9, 7) };
    let frame = run::run(name, text, params, &grid, &RunOptions::default()).unwrap();
    let columns = run::columns(&frame);
    let mut out = String::new();
    for point in (0..63).step_by(5) {
        let _ = writeln!(out, "point {point}");
        for (column, values) in &columns {
            let _ = writeln!(out, "  {column} = {:?}", values[point]);
        }
    }
    out
}

#[test]
fn cobbled() {
    snapshots("cobbled", "osl/Cobbled.osl", &[]);
}

#[test]
fn flakes() {
    snapshots("flakes", "osl/flakes.osl", &[]);
}

#[test]
fn chaosmosaic() {
    snapshots("chaosmosaic", "osl/chaosmosaic.osl", &[("Image", "tex64.png")]);
}

#[test]
fn sprinkles() {
    snapshots("sprinkles", "tests/data/seeds/sprinkles.repaired.osl", &[("Scale", "4"), ("Radius", "0.2")]);
}

#[test]
fn strips() {
    snapshots("strips", "osl/strips.osl", &[]);
}

#[test]
fn nonlinear_noise() {
    snapshots("nonlinear_noise", "osl/nonlinear_noise.osl", &[("type", "recursive"), ("freq", "3")]);
}
