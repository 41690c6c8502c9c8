//! Proven bounds hold: no value of a run is outside of them, and no event happens that they exclude.

use osl::stages;
use osl_exec::{PointSource, RunOptions};
use osl_ir::passes;
use osl_measure::bounds::{self, Domain, Effort, Verdict};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_tests::enclosed::{self, Proven};
use osl_tests::{generate, run};

const SCALE: [f32; 2] = [3.0, 2.5];
const OFFSET: [f32; 2] = [-1.0, -0.7];

/// A grid of the domain's points.
fn grid(width: usize, height: usize) -> Grid {
    Grid { scale: SCALE, offset: OFFSET, ..Grid::new(width, height) }
}

/// The report of a shader, if it compiles.
fn proven(text: &str, tiles: usize) -> Option<Proven> {
    enclosed::prove(text, &run::services(), &grid(7, 5), (SCALE, OFFSET), tiles)
}

/// The first value outside of its bounds, or event that was excluded.
fn violation(name: &str, text: &str, tiles: usize) -> Option<String> {
    let found = enclosed::violation(&proven(text, tiles)?, text, &run::services(), &grid(7, 5))?;
    Some(format!("{name}, {found}"))
}

fn hold(seeds: std::ops::Range<u64>, tiles: usize) {
    let text = |seed| generate::program(&generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100));
    let found: Vec<String> =
        seeds.filter_map(|seed| violation(&seed.to_string(), &text(seed), tiles)).collect();
    found.iter().take(12).for_each(|line| println!("{line}"));
    assert!(found.is_empty(), "{} programs leave their bounds, such as {}", found.len(), found[0]);
}

#[test]
fn of_generated_programs() {
    hold(0..150, 40);
}

/// `cargo test --release -p osl-tests --test end_to_end -- --ignored --nocapture proven_bounds::of_many`
#[test]
#[ignore = "takes minutes"]
fn of_many_generated_programs() {
    hold(0..20_000, 40);
}

/// The seed shaders with their defaults, at points of the unit patch that no grid has: `grids` grids of
/// 500x500 for each, a part of the patch each.
fn seeds_hold(grids: usize, tiles: usize) {
    let mut points = 0;
    for shader in ["Cobbled", "flakes", "strips", "nonlinear_noise", "sprinkles", "chaosmosaic"] {
        let mut text = std::fs::read_to_string(run::root().join(format!("osl/{shader}.osl"))).unwrap();
        if let Some(repaired) = osl_syntax::repair::repair(shader, &text, &NoFiles, &Options::default()) {
            text = repaired.text;
        }
        let services = run::services();
        let checked = stages::check(shader, &text, &NoFiles, &Options::default());
        let body = stages::lower(&checked.program.unwrap(), &[]).unwrap();
        let grid = Grid::new(500, 500);
        let options = passes::Options {
            varying: grid.varying().to_vec(),
            derivs: grid.varying_derivs().to_vec(),
            ..passes::Options::default()
        };
        let subject = bounds::subject(body, &options);
        let effort = Effort { tiles, ..Effort::default() };
        let domain = Domain::of_patch([1.0; 2], [0.0; 2]);
        let report = bounds::prove(&subject, (&services, &grid, &checked.sources), &domain, effort, shader);
        for at in 0..grids {
            let scale = 0.4 + 0.07 * at as f32;
            let offset = [(1.0 - scale) * 0.37, (1.0 - scale) * 0.83];
            let grid = Grid { scale: [scale; 2], offset, ..Grid::new(500, 500) };
            let frame = run::run(shader, &text, &[], &grid, &RunOptions::default()).unwrap();
            points += grid.count();
            for (plane, output) in frame.planes.iter().zip(&report.outputs) {
                let is_inside = |x: &f32| {
                    let wide = f64::from(*x);
                    if x.is_nan() {
                        output.never_nan != Verdict::Proven
                    } else {
                        output.lowest <= wide && wide <= output.highest
                    }
                };
                assert!(plane.floats().iter().all(is_inside), "{shader}, {}", plane.output);
            }
        }
    }
    println!("{points} points");
}

#[test]
fn of_the_seed_shaders() {
    seeds_hold(1, 200);
}

/// `cargo test --release -p osl-tests --test end_to_end -- --ignored --nocapture ten_million_points`
#[test]
#[ignore = "takes minutes"]
fn of_the_seed_shaders_at_ten_million_points() {
    seeds_hold(7, 4_000);
}

/// What is a matter of course must be proved.
#[test]
fn guards_and_ranges_are_proved() {
    let of = |text: &str| proven(text, 4_000).unwrap().report;
    let range = |text: &str| {
        let report = of(text);
        let output = &report.outputs[0];
        (output.lowest, output.highest, output.never_nan == Verdict::Proven)
    };
    let shader = |text: &str| format!("shader s(output float r = 0) {{ {text} }}");
    assert_eq!(range(&shader("r = smoothstep(0.2, 0.8, u);")), (0.0, 1.0, true));
    assert_eq!(range(&shader("r = clamp(u * v, 0, 1);")), (0.0, 1.0, true));
    assert_eq!(range(&shader("float x = 9 * u; r = x - floor(x);")), (0.0, 1.0, true));
    assert_eq!(range(&shader("r = mod(9 * u, 1);")), (0.0, 1.0, true));
    assert_eq!(range(&shader("r = pow(clamp(u, 0, 1), 3);")), (0.0, 1.0, true));
    assert_eq!(range(&shader("for (int i = 0; i < 10; i++) r += 0.5 * (u * u);")).0, 0.0);
    let (lo, hi, _) = range(&shader("r = noise(\"uperlin\", 4 * P);"));
    assert!(lo > -0.02 && hi < 1.02, "{lo} {hi}");
    let all = |text: &str| {
        let report = of(&shader(text));
        assert!(!report.claims.is_empty(), "{text}");
        report.claims.iter().all(|claim| claim.verdict == Verdict::Proven)
    };
    assert!(all("if (u > 0) r = 1 / u;"));
    assert!(all("r = u > 0 ? v / u : 0;"));
    assert!(all("if (u > -1 && u < 1) r = acos(u);"));
    assert!(all("r = acos(clamp(u, -1, 1));"));
    assert!(all("r = sqrt(1 - cos(u) * cos(u) + 0.001);"));
    assert!(all("float t[4] = {1, 2, 3, 4}; int i = (int) clamp(u, 0, 3); r = t[i];"));
    assert!(all("vector d = normalize(vector(u, v, 1)); r = d[0];"));
    let wrong = of(&shader("r = sqrt(u);"));
    assert_eq!(wrong.claims[0].verdict, Verdict::Wrong);
    assert!(wrong.claims[0].at.as_ref().unwrap()[0] < 0.0);
}

/// Values of endless loops and of what is not known are unknown, and the search ends.
#[test]
fn long_loops_end() {
    let text =
        "shader s(output float r = 0) { float x = u; while (x < 5) { x += noise(x) + 0.01; r += 0.001; } }";
    let found = proven(text, 30).unwrap().report;
    assert!(found.outputs[0].lowest >= 0.0, "{:?}", found.outputs);
    let text = "shader s(output int n = 0) { int k = (int) (1000 * u); while (k > 0) { k /= 2; n += 1; } }";
    let found = proven(text, 30).unwrap().report;
    assert!(found.outputs[0].lowest >= 0.0, "{:?}", found.outputs);
}
