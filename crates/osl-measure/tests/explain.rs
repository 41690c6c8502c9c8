//! Explanations of single points, as people read them.

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
use osl_measure::explain::{cost, explain, only_needed, text};
use osl_measure::trace::{OnePoint, follow, prepare};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::sync::Arc;

const LOOP: &str = "\
shader s(float k = 2, output float r = 0, output float other = 1)
{
    float x = u * k;
    for (int i = 0; i < 3; i++) {
        if (x > 0.5)
            r += sin(x) + i;
        else
            r -= noise(P * 4);
        x *= 1.3;
    }
    other = cellnoise(v * 10);
    if (other < -100)
        other = 0;
}
";

fn explained(source: &str, outputs: Option<&[&str]>, at: (usize, usize), exact: bool) -> String {
    let checked = stages::check("s.osl", source, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let plain = stages::lower(&program, &[]).unwrap();
    let noted = stages::lower_noted(&program, &[]).unwrap();
    let grid = Grid::new(16, 16);
    let outputs: Option<Vec<Arc<str>>> = outputs.map(|o| o.iter().map(|n| (*n).into()).collect());
    let options = passes::Options {
        outputs: outputs.clone(),
        varying: grid.varying().to_vec(),
        ..passes::Options::default()
    };
    let mut body = prepare(noted, &options.varying, &[], &options.limits);
    if let Some(wanted) = outputs {
        body.outputs.retain(|o| wanted.contains(&o.name));
    }
    let point = OnePoint::at_pixel(&grid, 16, 16, at.0, at.1).unwrap();
    let services = Services::default();
    let trace = follow(&body, &services, OnePoint { source: &grid, point }, &Limits::default());
    let needed = only_needed(plain, &options);
    text::text(&explain(&trace, &body, &needed, &checked.sources), "a pixel", exact)
}

#[test]
fn a_loop_with_a_branch() {
    insta::assert_snapshot!(explained(LOOP, None, (5, 9), false));
}

#[test]
fn what_is_not_needed_is_said() {
    insta::assert_snapshot!(explained(LOOP, Some(&["other"]), (5, 9), true));
}

#[test]
fn what_is_traced_is_what_a_run_computes() {
    let sources = [
        LOOP,
        "shader s(output color r = 0, output float q = 0, output string t = \"\") {
            float a[4] = { 1, 2, 3, 4 }; for (int i = 0; i < 4; i++) a[i] *= noise(P * i) + Dx(u);
            t = format(\"%g\", a[2]); r = transformc(\"hsv\", \"rgb\", color(a[0], a[1], a[int(u * 4)]));
            q = spline(\"catmull-rom\", v, a) + hash(u) + strlen(t) + filterwidth(snoise(P * 3)); }",
        "shader s(output float r = 0, output point p = 0) { int n = 0;
            while (1) { if (n > 3) break; n++; if (n == 2) continue; r += pnoise(u * n, 3.0); }
            p = transform(\"shader\", \"world\", P + n) + noise(\"gabor\", P); }",
    ];
    for source in sources {
        let checked = stages::check("s.osl", source, &NoFiles, &Options::default());
        let program = checked.program.expect("it compiles");
        let grid = Grid::new(7, 5);
        let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
        let plain = stages::lower(&program, &[]).unwrap();
        let services = Services::default();
        let compiled = stages::finish(plain, &options);
        let frame =
            osl_exec::run(&compiled.program, &services, &grid, &RunOptions::default(), &|_| ()).unwrap();
        let body =
            prepare(stages::lower_noted(&program, &[]).unwrap(), &options.varying, &[], &options.limits);
        for pixel in [0, 11, 17, 34] {
            let point = OnePoint::at_pixel(&grid, 7, 5, pixel % 7, pixel / 7).unwrap();
            let trace = follow(&body, &services, OnePoint { source: &grid, point }, &Limits::default());
            for plane in &frame.planes {
                let (_, _, nodes) = trace.outputs.iter().find(|(n, ..)| *n == plane.output).unwrap();
                let value = osl_measure::trace::Exact::widen(trace.node(nodes[0]).strict.as_ref().unwrap());
                let expected = f64::from(f32::from_bits(plane.words[pixel]));
                let expected = if plane.kind == osl_ir::ir::Kind::Int {
                    f64::from(plane.words[pixel].cast_signed())
                } else {
                    expected
                };
                assert_eq!(value.numbers()[plane.component], expected, "{} {pixel}", plane.output);
            }
        }
    }
}

#[test]
fn a_way_without_end_is_cut() {
    for source in [
        "shader s(output float r = 0) { int x = 1; while (x) {} r = 1; }",
        "shader s(output float r = 0) { while (1) r += noise(\"gabor\", P * r); }",
    ] {
        assert!(explained(source, None, (1, 1), false).contains("too long to be followed"), "{source}");
    }
}

#[test]
fn costs_are_told_by_output() {
    let checked = stages::check("s.osl", LOOP, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.unwrap(), &[]).unwrap();
    let costs = cost(&body, &passes::Options::default());
    let of = |name: &str| costs.iter().find(|c| c.output == name).unwrap().clone();
    assert!(of("other").instructions < of("all asked for").instructions);
    assert_eq!(of("all asked for").noises, of("r").noises + of("other").noises);
}

#[test]
fn the_mask_alone_evaluates_no_simplex_noise() {
    use osl_ir::ir::{Kernel, NoiseField, Op};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/Cobbled.osl");
    let text = std::fs::read_to_string(path).unwrap();
    let checked = stages::check("Cobbled.osl", &text, &NoFiles, &Options::default());
    let program = checked.program.unwrap();
    let simplex = |outputs: Option<&str>| {
        let outputs = outputs.map(|o| vec![o.into()]);
        let options = passes::Options { outputs, ..passes::Options::default() };
        let body = stages::finish(stages::lower(&program, &[]).unwrap(), &options).body;
        let is_simplex = |op: &Op| {
            matches!(
                op,
                Op::Kernel(
                    Kernel::Noise { field: NoiseField::Simplex | NoiseField::USimplex, .. }
                        | Kernel::NamedNoise { .. },
                    _
                )
            )
        };
        let mut blocks = vec![body.entry];
        let mut count = 0;
        while let Some(block) = blocks.pop() {
            for inst in &body.block(block).insts {
                count += usize::from(is_simplex(&inst.op));
                match &inst.op {
                    Op::If { then, otherwise, .. } => blocks.extend([*then, *otherwise]),
                    Op::Loop { body, .. } => blocks.push(*body),
                    _ => {}
                }
            }
        }
        count
    };
    assert_eq!(simplex(Some("resultMask")), 0);
    assert!(simplex(None) >= 8);
}
