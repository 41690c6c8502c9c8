//! The double-precision side of a trace is a run in double precision: nothing in it was rounded to single
//! precision when the shader was compiled.

use osl::stages;
use osl_exec::{Arithmetic, PointSource, RunOptions};
use osl_measure::trace::{self, OnePoint};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_tests::{generate, run};

/// The first output that differs, if the shader runs.
fn difference(name: &str, text: &str) -> Option<String> {
    let grid = Grid { scale: [3.0, 2.5], offset: [-1.0, -0.7], ..Grid::new(3, 2) };
    let options = RunOptions { limits: run::steps(20_000), ..RunOptions::default() };
    let frame = run::run_in(Arithmetic::Double, (name, text, &[]), &grid, &options).ok()?;
    let program = stages::check(name, text, &NoFiles, &Options::default()).program?;
    let body = stages::lower_noted(&program, &[]).ok()?;
    let body = trace::prepare(body, grid.varying(), grid.varying_derivs(), &options.limits);
    let services = run::services();
    for point in 0..grid.count() {
        let found = trace::follow(&body, &services, OnePoint { source: &grid, point }, &options.limits);
        if found.cut {
            continue;
        }
        for (output, _, nodes) in &found.outputs {
            let values = nodes.iter().map(|id| found.nodes.get(*id as usize)?.exact.clone());
            let Some(values) = values.collect::<Option<Vec<_>>>() else { continue };
            let numbers = values.iter().flat_map(trace::Exact::numbers);
            let own = |plane: &&osl_exec::Plane| {
                let rest = plane.output.strip_prefix(&**output);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
            };
            for (plane, number) in frame.planes.iter().filter(own).zip(numbers) {
                let ran = plane.doubles()[point];
                if ran.to_bits() != number.to_bits() && !(ran.is_nan() && number.is_nan()) {
                    return Some(format!(
                        "{name}, point {point}, {}: {ran:e} run, {number:e} traced",
                        plane.output
                    ));
                }
            }
        }
    }
    None
}

/// Constants that single precision would round, with what once made folding run: derivatives and named noise.
#[test]
fn constants_are_not_rounded() {
    let lost = "float sea = 16777216.0; float fade = 0.3; float a = (sea + fade) - sea; r = a + u;";
    let cases = [
        format!("shader s(output float r = 0) {{ {lost} }}"),
        format!("shader s(output float r = 0) {{ {lost} r += Dx(u) * (0.1 + 0.2); }}"),
        format!("shader s(output float r = 0) {{ {lost} r += noise(\"perlin\", 3 * P) * sqrt(2.0); }}"),
        format!(
            "shader s(output float r = 0) {{ {lost} string k = concat(\"simp\", \"lex\"); r *= noise(k, P / 3.0); }}"
        ),
        format!("shader s(output float r = 0) {{ {lost} r += filterwidth(P)[0] * (1.0 / 3.0); }}"),
    ];
    let found: Vec<String> = cases.iter().filter_map(|text| difference("case.osl", text)).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

fn generated(seeds: std::ops::Range<u64>) {
    let text = |seed| generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100));
    let found: Vec<String> = seeds.filter_map(|seed| difference(&seed.to_string(), &text(seed))).collect();
    found.iter().take(12).for_each(|line| println!("{line}"));
    assert!(found.is_empty(), "{} programs differ", found.len());
}

#[test]
fn of_generated_programs() {
    generated(0..200);
}

/// `cargo test --workspace --test end_to_end -- --ignored --nocapture exact_traces`
#[test]
#[ignore = "takes minutes"]
fn of_many_generated_programs() {
    generated(0..20_000);
}
