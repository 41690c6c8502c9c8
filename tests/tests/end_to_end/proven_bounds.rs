//! Proven bounds hold: no value of a run is outside of them, and no event happens that they exclude.

use osl::stages;
use osl_exec::{PointSource, RunOptions};
use osl_ir::passes;
use osl_measure::bounds::{self, Domain, Effort, Verdict};
use osl_measure::sanitize::Kind;
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
                let is_inside = |x: &f64| {
                    if x.is_nan() {
                        output.never_nan != Verdict::Proven
                    } else {
                        output.lowest <= *x && *x <= output.highest
                    }
                };
                assert!(enclosed::numbers(plane).iter().all(is_inside), "{shader}, {}", plane.output);
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

/// Shaders whose values stay together only if the cases of a branch, of a whole number or of an index are
/// walked apart; the smallest and the largest value of each is a matter of course.
const CASES: [(&str, &str, [f64; 2]); 8] = [
    (
        "a cell",
        "float k = floor(4 * u); float from = k * k; float to = (k + 1) * (k + 1);
        r = to == from ? 0.5 : clamp(4 * u - k, 0, 1) * (to - from) / (to - from);",
        [-0.01, 1.01],
    ),
    ("a branch", "float a = 1; float b = 2; if (u + v > 0.3) { a = 5; b = 7; } r = 1 / (b - a);", [0.5, 1.0]),
    (
        "nested branches",
        "float a = 1; float b = 2; if (u > 0.1) { a = 3; if (v > 0.2) b = 5; else b = 4; }
        r = b - a;",
        [1.0, 2.0],
    ),
    ("a negative int", "int k = (int) (5 * u - 2); float from = 3 * k; r = (3 * k + 1) - from;", [1.0, 1.0]),
    ("a triple", "vector k = floor(3 * P); vector m = k * k + 1; r = m[0] / m[0] + m[1] / m[1];", [2.0, 2.0]),
    (
        "an index",
        "float from[3] = {1, 4, 9}; float to[3] = {2, 6, 12};
        int i = u < 0 ? 0 : v < 0.4 ? 1 : 2; r = to[i] - from[i];",
        [1.0, 3.0],
    ),
    (
        "a write",
        "float t[3] = {1, 1, 1}; int i = (int) clamp(3 * u, 0, 2); t[i] = 4; r = t[0] + t[1] + t[2];",
        [6.0, 6.0],
    ),
    (
        "after a loop",
        "float x = u; for (int i = 0; i < 3; i++) { if (x < v) x += 0.25; }
        float a = 0; if (x > 1) a = 1; r = a * (1 - a);",
        [0.0, 0.0],
    ),
];

/// Bounds hold at the points of many grids with the same derivatives.
fn holds_in_many_places(name: &str, text: &str, tiles: usize) -> bounds::Report {
    let points = Grid { scale: [1.0, 0.7], ..Grid::new(9, 8) };
    let services = run::services();
    let proven = enclosed::prove(text, &services, &points, (SCALE, OFFSET), tiles).unwrap();
    for at in 0..60 {
        let share = |step: usize| (at * step % 61) as f32 / 60.0;
        let place =
            |axis: usize, step| OFFSET[axis] + share(step) * (SCALE[axis] - points.scale[axis]) * 0.999;
        let moved = Grid { offset: [place(0, 1), place(1, 23)], ..points.clone() };
        let found = enclosed::violation(&proven, text, &services, &moved);
        assert_eq!(found, None, "{name} at {:?}", moved.offset);
    }
    proven.report
}

#[test]
fn cases_are_walked_apart() {
    for (name, body, [lowest, highest]) in CASES {
        let text = format!("shader s(output float r = 0) {{ {body} }}");
        let report = holds_in_many_places(name, &text, 1_500);
        let output = &report.outputs[0];
        assert!(output.lowest >= lowest && output.highest <= highest, "{name}: {output:?}");
        assert_eq!(output.never_nan, Verdict::Proven, "{name}");
        assert!(report.claims.iter().all(|claim| claim.verdict == Verdict::Proven), "{name}: {report:?}");
    }
}

/// Lookups, with the smallest and the largest value that the texels allow.
const LOOKUPS: [(&str, [f64; 2]); 14] = [
    ("r = texture(\"tex64.png\", u, v);", [0.0, 1.0001]),
    ("r = texture(\"tex64f.exr\", 3 * u, v, \"wrap\", \"periodic\");", [-0.001, 4.0]),
    ("r = texture(\"tex64.png\", u, v, \"swrap\", u > 0 ? \"clamp\" : \"black\");", [0.0, 1.0001]),
    ("r = texture(\"tex64.png\", u, v, \"width\", 4, \"blur\", 0.1, \"interp\", \"closest\");", [0.0, 1.0001]),
    ("r = texture(\"tex3x2gray.png\", u, v, \"firstchannel\", 2, \"fill\", 0.5);", [0.0, 0.5001]),
    ("r = texture(\"tex3x2gray.png\", u, v, \"firstchannel\", 2, \"fill\", u);", [-1.001, 2.001]),
    ("texture(\"tex4rgba.exr\", u, v, \"alpha\", r);", [-0.001, 4.0]),
    ("r = texture(\"none.png\", u, v);", [0.0, 0.0]),
    ("r = texture(\"none.png\", u, v, \"fill\", v);", [-0.701, 1.801]),
    ("color c = texture(\"none.png\", u, v, \"missingcolor\", color(u, 3, 4), \"missingalpha\", 7, \"alpha\", r);
        r += c[2];", [11.0, 11.0]),
    ("r = texture(\"none.png\", u, v, \"missingalpha\", 7, \"fill\", 2);", [2.0, 2.0]),
    ("r = texture(\"tex64.png\", 1 / (u - u), v, \"wrap\", \"clamp\");", [0.0, 1.0001]),
    ("r = environment(\"tex64.png\", vector(u, v, 1), \"blur\", 0.2);", [-0.0001, 1.0001]),
    ("string e; r = environment(\"none.png\", vector(u, v, 1), \"fill\", 0.25, \"errormessage\", e);", [0.25, 0.25]),
];

#[test]
fn textures_are_bounded_by_their_texels() {
    for (body, [lowest, highest]) in LOOKUPS {
        let text = format!("shader s(output float r = 0) {{ {body} }}");
        let report = holds_in_many_places(body, &text, 60);
        let output = &report.outputs[0];
        assert!(output.lowest >= lowest && output.highest <= highest, "{body}: {output:?}");
        assert_eq!(output.never_nan, Verdict::Proven, "{body}");
    }
    // Unknown options and names bound nothing.
    let blurred = "r = texture(\"tex64.png\", u, v, \"blur\", -u);";
    for body in [blurred, "r = texture(format(\"%g.png\", u), u, v);"] {
        let report = holds_in_many_places(body, &format!("shader s(output float r = 0) {{ {body} }}"), 8);
        assert!(!report.outputs[0].is_finite, "{body}");
    }
    // Which file it is may be a case.
    let body = "r = texture(u > v ? \"tex64.png\" : \"none.png\", u, v, \"fill\", 0.5);";
    let report = holds_in_many_places(body, &format!("shader s(output float r = 0) {{ {body} }}"), 60);
    assert!(report.outputs[0].highest <= 1.0001, "{:?}", report.outputs);
}

/// Colors between spaces, with the smallest and the largest value of a component.
const COLORS: [(&str, usize, [f64; 2]); 8] = [
    ("transformc(\"rgb\", \"sRGB\", color(clamp(u, 0, 1), 0.5, 0))", 0, [-0.001, 1.001]),
    ("transformc(\"sRGB\", \"rgb\", color(clamp(u, 0, 1), v, 0))", 0, [-0.001, 1.001]),
    ("transformc(\"rgb\", \"XYZ\", color(clamp(u, 0, 1), clamp(v, 0, 1), 0.5))", 1, [0.0, 1.0]),
    ("transformc(\"XYZ\", \"YIQ\", color(u, v, 0.5))", 2, [-20.0, 20.0]),
    ("color(\"hsv\", u, clamp(v, 0, 1), 0.5)", 1, [-0.001, 0.501]),
    ("color(\"hsl\", clamp(u, 0, 1), 0.5, clamp(v, 0, 1))", 0, [f64::NEG_INFINITY, f64::INFINITY]),
    ("transformc(\"hsv\", \"hsv\", color(clamp(u, 0, 1), 0.5, clamp(v, 0, 1)))", 2, [-0.001, 1.001]),
    ("transformc(\"nowhere\", \"rgb\", color(clamp(u, 0, 1), 0.5, v))", 0, [0.0, 1.0]),
];

#[test]
fn colors_between_spaces_are_bounded() {
    for (value, component, [lowest, highest]) in COLORS {
        let report = holds_in_many_places(value, &format!("shader s(output color c = {value}) {{ }}"), 200);
        let output = &report.outputs[component];
        assert!(output.lowest >= lowest && output.highest <= highest, "{value}: {output:?}");
    }
}

/// The statements about the seed shaders in docs/accuracy.md.
#[test]
fn the_seed_shaders_stay_in_range() {
    let of = |shader: &str| {
        let text = std::fs::read_to_string(run::root().join(format!("osl/{shader}.osl"))).unwrap();
        let text = osl_syntax::repair::repair(shader, &text, &NoFiles, &Options::default())
            .map_or(text, |repaired| repaired.text);
        let unit = ([1.0; 2], [0.0; 2]);
        enclosed::prove(&text, &run::services(), &Grid::new(64, 64), unit, 6_000).unwrap().report
    };
    for shader in ["flakes", "strips", "sprinkles", "chaosmosaic"] {
        let report = of(shader);
        assert!(report.claims.iter().all(|claim| claim.verdict == Verdict::Proven), "{shader}: {report:?}");
        for output in &report.outputs {
            let least = if output.component == "b" { -1.0 } else { 0.0 };
            let is_inside = output.lowest >= least && output.highest <= 1.0 + 1e-6;
            assert!(is_inside && output.never_nan == Verdict::Proven, "{shader}: {output:?}");
        }
    }
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

/// The cost of nested loops does not grow with a power of their depth, and what holds in them stays known.
#[test]
fn nested_loops_end() {
    let nest = |depth: usize, rounds: usize| {
        let loops: String =
            (0..depth).map(|i| format!("for (int i{i} = 0; i{i} < {rounds}; i{i}++) ")).collect();
        format!("shader s(output float r = 0, output float x = 0) {{ {loops} r += 0.5; x = u * u; }}")
    };
    for (depth, rounds) in [(20, 2), (100, 2), (12, 5), (3, 1000)] {
        let found = proven(&nest(depth, rounds), 10).unwrap().report;
        let [_, x] = &found.outputs[..] else { panic!("{found:?}") };
        assert!(x.lowest == 0.0 && x.highest <= 4.0, "{depth} loops of {rounds}: {x:?}");
    }
    // Few loops are walked to their end.
    let found = proven(&nest(6, 2), 10).unwrap().report;
    assert_eq!((found.outputs[0].lowest, found.outputs[0].highest), (32.0, 32.0));
}

/// Each operation that `sanitize` watches has a claim, with a point where it is wrong.
#[test]
fn every_event_has_a_claim() {
    for (text, code, kind) in [
        ("int k = -2147483647 - 1 + (int) abs(u); n = k / -1;", "k / -1", Kind::IntOverflow),
        (
            "int k = -2147483647 - 1 + (int) abs(u); n = k / ((int) v - 1);",
            "k / ((int) v - 1)",
            Kind::IntOverflow,
        ),
        ("int k = (int) u; n = 5 / k;", "5 / k", Kind::ZeroDivision),
        ("int k = (int) u; n = 5 % k;", "5 % k", Kind::ZeroDivision),
        (
            "t = mod(vector(u, v, 1), vector(1, 0, 2));",
            "mod(vector(u, v, 1), vector(1, 0, 2))",
            Kind::ZeroDivision,
        ),
        (
            "t = fmod(vector(u, v, 1), vector(1, 0, 2));",
            "fmod(vector(u, v, 1), vector(1, 0, 2))",
            Kind::ZeroDivision,
        ),
        ("t = vector(u, v, 1) / vector(1, 0, 2);", "vector(u, v, 1) / vector(1, 0, 2)", Kind::ZeroDivision),
    ] {
        let text = format!("shader s(output int n = 0, output vector t = 0) {{ {text} }}");
        let report = holds_in_many_places(code, &text, 30);
        let found: Vec<Verdict> = (report.claims.iter())
            .filter(|claim| claim.kind == kind && claim.quote.code == code)
            .map(|claim| claim.verdict)
            .collect();
        assert_eq!(found, [Verdict::Wrong], "{code}: {:?}", report.claims);
    }
    // What cannot happen for the constants is not said.
    let report = holds_in_many_places("a constant", "shader s(output int n = 0) { n = (int) u / -2; }", 30);
    assert!(report.claims.iter().all(|claim| claim.kind == Kind::IntConversion), "{:?}", report.claims);
}

/// Ints are exact, also those that no float holds.
#[test]
fn large_ints_are_exact() {
    let of = |text: &str| {
        let report = holds_in_many_places(text, &format!("shader s(output int n = 0) {{ {text} }}"), 400);
        let output = &report.outputs[0];
        (output.lowest, output.highest, output.reached)
    };
    let ends = |lo: f64, hi: f64| (lo, hi, Some([lo, hi]));
    assert_eq!(of("n = 20000001 + (int) clamp(100 * u, 0, 50);"), ends(20_000_001.0, 20_000_051.0));
    assert_eq!(of("n = u > 0 ? 2147483647 : -2147483647 - 1;"), ends(-2_147_483_648.0, 2_147_483_647.0));
    assert_eq!(of("n = (int) (-clamp(u, 0, 1) * 3000000000.0);"), ends(-2_147_483_648.0, 0.0));
}

/// What is known when the time is over.
#[test]
fn a_search_without_time_proves_nothing() {
    let text = "shader s(int n = 3, output float r = 0) { float a[2] = {1, 2}; r = a[n] / u; }";
    let checked = stages::check("case.osl", text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.unwrap(), &[]).unwrap();
    let cancel = osl_limits::Cancel::new();
    let limits = osl_limits::Limits::default();
    let points = grid(3, 3);
    let options = passes::Options {
        varying: points.varying().to_vec(),
        limits: limits.until(&cancel),
        ..passes::Options::default()
    };
    let subject = bounds::subject(body, &options);
    cancel.cancel();
    let domain = Domain::of_patch(SCALE, OFFSET);
    let services = run::services();
    let report =
        bounds::prove(&subject, (&services, &points, &checked.sources), &domain, Effort::default(), "case");
    assert!(report.is_cut && report.points == 0);
    assert_eq!((report.outputs[0].lowest, report.outputs[0].highest), (f64::NEG_INFINITY, f64::INFINITY));
    let claims: Vec<(Kind, Verdict)> =
        report.claims.iter().map(|claim| (claim.kind, claim.verdict)).collect();
    assert_eq!(claims, [(Kind::ZeroDivision, Verdict::NotProven), (Kind::Index, Verdict::NotProven)]);
}
