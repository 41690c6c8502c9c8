//! The arithmetics other than the strict one: double precision is compared with mathematics, and each
//! arithmetic with itself in all ways to run.

use osl_exec::{Arithmetic, Frame, Isa, Native, RunOptions};
use osl_scene::Grid;
use osl_tests::run;
use std::f64::consts::PI;

/// Runs statements that set `out` from `u` and `v` in double precision, and returns u, v and the values.
fn values(body: &str, grid: &Grid) -> Vec<(f64, f64, f64)> {
    let text = format!("shader s(output float out = 0, output point where = 0) {{ where = P; {body} }}");
    let shader = ("s.osl", text.as_str(), &[][..]);
    let frame = run::run_in(Arithmetic::Double, shader, grid, &RunOptions::default()).unwrap();
    let plane = |name: &str, component: usize| {
        frame.planes.iter().find(|p| &*p.output == name && p.component == component).unwrap().doubles()
    };
    let (x, y, out) = (plane("where", 0), plane("where", 1), plane("out", 0));
    x.into_iter().zip(y).zip(out).map(|((x, y), out)| (x, y, out)).collect()
}

/// A body of a shader, and the expected values.
type Case = (&'static str, fn(f64, f64) -> f64);

const ANALYTIC: &[Case] = &[
    ("out = u * u - v / (u + 3) + 0.5;", |u, v| u * u - v / (u + 3.0) + 0.5),
    ("out = sin(40 * u) + cos(v) * tan(u);", |u, v| (40.0 * u).sin() + v.cos() * u.tan()),
    ("out = exp(u - v) + exp2(3 * u) + expm1(v);", |u, v| (u - v).exp() + (3.0 * u).exp2() + v.exp_m1()),
    ("out = log(u + 1) + log2(v + 2) - log10(u + v + 1);", |u, v| {
        (u + 1.0).ln() + (v + 2.0).log2() - (u + v + 1.0).log10()
    }),
    ("out = pow(u + 0.25, v * 3) + sqrt(u) * inversesqrt(v + 1) + cbrt(u + v);", |u, v| {
        (u + 0.25).powf(3.0 * v) + u.sqrt() / (v + 1.0).sqrt() + (u + v).cbrt()
    }),
    ("out = asin(u - 0.5) + acos(v - 0.25) + atan(4 * u) + atan2(v - 0.5, u - 0.25);", |u, v| {
        (u - 0.5).asin() + (v - 0.25).acos() + (4.0 * u).atan() + (v - 0.5).atan2(u - 0.25)
    }),
    ("out = sinh(u * 2) + cosh(v) + tanh(u - v) * hypot(u, v);", |u, v| {
        (2.0 * u).sinh() + v.cosh() + (u - v).tanh() * u.hypot(v)
    }),
    ("out = degrees(u) + radians(v);", |u, v| u.to_degrees() + v.to_radians()),
    ("out = fmod(u * 7, 0.375) + mod(-v * 3, 0.5) + floor(u * 9) - ceil(v * 5) + round(u * 3);", |u, v| {
        (7.0 * u) % 0.375 + (-3.0 * v).rem_euclid(0.5) + (9.0 * u).floor() - (5.0 * v).ceil()
            + (3.0 * u).round()
    }),
    ("float third = 1.0 / 3.0; out = u * third;", |u, _| u * (1.0 / 3.0)),
    (
        "float a[3] = {0.5, 0.25, 0}; for (int i = 0; i < 9; i++) { a[i % 3] += u / (i + 3); } out = a[2];",
        |u, _| u / 5.0 + u / 8.0 + u / 11.0,
    ),
    ("float s = 0; int i = 0; while (s < 10) { s += u + 0.25; i++; } out = s;", |u, _| {
        let mut s = 0.0;
        while s < 10.0 {
            s += u + 0.25;
        }
        s
    }),
    ("out = dot(normalize(vector(u, v, 1)), vector(1, 2, 3)) + length(P);", |u, v| {
        (u + 2.0 * v + 3.0) / (u * u + v * v + 1.0).sqrt() + (u * u + v * v + 1.0).sqrt()
    }),
    ("point r = rotate(point(1, 0, 0), u, point(0, 0, 0), point(0, 0, 1)); out = r[1];", |u, _| u.sin()),
    (
        "matrix m = matrix(1 + u, 0.25, 0, 0, v, 2, 0, 0, 0, 0, 1, 0, u, v, 1, 1); matrix one = 1 / m * m; out = one[0][0] + determinant(m);",
        |u, v| 1.0 + (1.0 + u) * 2.0 - 0.25 * v,
    ),
    ("float k[6] = {0, 0.25, 0.5, 1, 2, 4}; out = spline(\"bspline\", 0, k) + 0 * u;", |_, _| {
        (0.0 + 4.0 * 0.25 + 0.5) / 6.0
    }),
    ("float k[5] = {0, 0, 0.5, 1, 1}; out = splineinverse(\"linear\", u, k);", |u, _| u),
    ("color c = transformc(\"rgb\", \"YIQ\", color(u, v, 1)); out = c[0];", |u, v| {
        0.299 * u + 0.587 * v + 0.114
    }),
    (
        "color h = transformc(\"rgb\", \"hsv\", color(u + 1, v, 0)); color c = transformc(\"hsv\", \"rgb\", h); out = c[1];",
        |_, v| v,
    ),
    ("out = smoothstep(0.25, 0.75, u) + linearstep(0, 2, v) + mix(u, v, 0.125);", |u, v| {
        let t = ((u - 0.25) * 2.0).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t) + v / 2.0 + u * 0.875 + v * 0.125
    }),
    ("out = erf(u) + erfc(v * 2);", |u, v| erf(u) + 1.0 - erf(2.0 * v)),
    // Derivatives: u and v change by the step of the grid.
    ("out = (Dx(sin(u * 3)) / Dx(u)) + Dy(log10(v + 1)) / Dy(v) + Dx(pow(u + 1, 2.5)) / Dx(u);", |u, v| {
        3.0 * (3.0 * u).cos() + 1.0 / ((v + 1.0) * std::f64::consts::LN_10) + 2.5 * (u + 1.0).powf(1.5)
    }),
    ("out = Dx(exp2(u)) / Dx(u) + Dx(erf(u)) / Dx(u);", |u, _| {
        u.exp2() * std::f64::consts::LN_2 + (-u * u).exp() * 2.0 / PI.sqrt()
    }),
];

/// Computed by its series, which is accurate for the small arguments here.
fn erf(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for n in 1..80 {
        term *= -x * x / f64::from(n);
        sum += term / f64::from(2 * n + 1);
    }
    sum * 2.0 / PI.sqrt()
}

#[test]
fn double_precision_is_mathematics() {
    let mut wrong = Vec::new();
    for (body, expected) in ANALYTIC {
        // Coordinates that are floats, and no round ones.
        let grid = Grid { scale: [0.875, 0.8125], offset: [0.015625, 0.03125], ..Grid::new(33, 17) };
        for (u, v, got) in values(body, &grid) {
            let expected = expected(u, v);
            if (got - expected).abs() > 2e-14 * expected.abs().max(1.0) {
                wrong.push(format!("{body} at {u}, {v}: {got:e} for {expected:e}, {:e} off", got - expected));
                break;
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn double_precision_keeps_the_domains_of_the_language() {
    let cases: &[(&str, f64)] = &[
        ("out = exp(1000);", 1022_f64.exp2()),
        ("out = exp(-1000 - u);", (-1022_f64).exp2()),
        ("out = log(-u);", f64::from(f32::MIN_POSITIVE).ln()),
        ("out = sqrt(-1 - u);", 0.0),
        ("out = acos(2 + u);", 0.0),
        ("out = pow(-2 - u, 0.5);", 0.0),
        ("out = pow(0, -1 - u);", 0.0),
        ("out = (1 + u) / (u - u);", 0.0),
        ("out = fmod(u, u - u);", 0.0),
        ("out = inversesqrt(u - u);", 0.0),
    ];
    for (body, expected) in cases {
        for (u, _, got) in values(body, &Grid::new(5, 2)) {
            assert!(
                (got - expected).abs() <= 1e-14 * expected.abs(),
                "{body} at {u}: {got:e} for {expected:e}"
            );
        }
    }
}

/// Periodic noise has the same value after any number of whole periods.
#[test]
fn noise_in_double_precision_is_the_same_far_from_the_origin() {
    for noise in ["pnoise(\"perlin\", Q", "pnoise(\"uperlin\", Q", "pnoise(\"cell\", Q"] {
        for far in ["1000000", "1000000000"] {
            let grid = Grid { scale: [7.0, 5.0], ..Grid::new(21, 13) };
            let at = |offset: &str| {
                let period = format!("point({far})");
                let body = format!("point Q = P * 1.375 + {offset}; out = {noise}, {period});");
                values(&body, &grid)
            };
            for ((u, v, near), (_, _, far)) in at("0").into_iter().zip(at(far)) {
                assert!((near - far).abs() < 1e-6, "{noise} at {u}, {v}: {near} and {far}");
            }
        }
    }
    // Simplex noise has no periods: its value depends on the coordinates themselves.
    let grid = Grid { scale: [7.0, 5.0], ..Grid::new(21, 13) };
    let got =
        values("point Q = P * 1.375 + 1000000; out = snoise(Q[0], Q[1]) + noise(\"simplex\", Q);", &grid);
    for (u, v, got) in got {
        let q = [u * 1.375 + 1e6, v * 1.375 + 1e6, 1.375 + 1e6];
        let (mut plane, mut space) = ([0.0_f64], [0.0_f64]);
        let coords: [&[f64]; 3] = [&q[..1], &q[1..2], &q[2..]];
        osl_noise::eval(Isa::baseline(), osl_noise::Kind::Perlin, &coords[..2], &mut plane);
        osl_noise::eval(Isa::baseline(), osl_noise::Kind::Simplex, &coords, &mut space);
        assert_eq!(got, plane[0] + space[0], "{u} {v}");
    }
}

/// The derivatives of noise are its slopes.
#[test]
fn derivatives_of_noise_in_double_precision_are_slopes() {
    for call in [
        "noise(\"perlin\", q)",
        "noise(\"simplex\", q)",
        "noise(\"usimplex\", q[0], q[1])",
        "noise(\"uperlin\", q, 0.5)",
    ] {
        let h = "0.00000095367431640625";
        let body = format!(
            "point q = P * 3.5; float slope = Dx({call}) / Dx(u);
             q = (P - vector({h}, 0, 0)) * 3.5; float before = {call};
             q = (P + vector({h}, 0, 0)) * 3.5; float after = {call};
             out = slope - (after - before) / (2 * {h});"
        );
        for (u, v, got) in values(&body, &Grid { offset: [0.1, 0.2], ..Grid::new(17, 9) }) {
            assert!(got.abs() < 1e-6, "{call} at {u}, {v}: {got:e}");
        }
    }
}

/// A shader: its name, its file, values of parameters.
type Seed = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

/// Seeds whose outputs are continuous except at few points.
const SEEDS: &[Seed] = &[
    ("Cobbled", "osl/Cobbled.osl", &[]),
    ("flakes", "osl/flakes.osl", &[]),
    ("sprinkles", "tests/data/seeds/sprinkles.repaired.osl", &[]),
    ("strips", "osl/strips.osl", &[]),
    ("nonlinear_noise", "osl/nonlinear_noise.osl", &[("type", "recursive")]),
    ("transcendental", "crates/oslrun/benches/shaders/transcendental.osl", &[]),
    ("matrices", "crates/oslrun/benches/shaders/matrices.osl", &[]),
    ("derivatives", "crates/oslrun/benches/shaders/derivatives.osl", &[]),
    ("splines", "crates/oslrun/benches/shaders/splines.osl", &[]),
    ("colors", "crates/oslrun/benches/shaders/colors.osl", &[]),
    ("branches", "crates/oslrun/benches/shaders/branches.osl", &[]),
];

fn seed(arithmetic: Arithmetic, file: &str, params: &[(&str, &str)], options: &RunOptions) -> Frame {
    let text = std::fs::read_to_string(run::root().join(file)).unwrap();
    let params: Vec<_> = params.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
    let grid = Grid { scale: [2.0, 2.0], ..Grid::new(96, 64) };
    run::run_in(arithmetic, (file, &text, &params), &grid, options).unwrap()
}

#[test]
fn strict_and_double_precision_agree_where_single_suffices() {
    let mut wrong = Vec::new();
    for (name, file, params) in SEEDS {
        let strict = seed(Arithmetic::Strict, file, params, &RunOptions::default());
        let exact = seed(Arithmetic::Double, file, params, &RunOptions::default());
        for (a, b) in strict.planes.iter().zip(&exact.planes) {
            assert_eq!(b.wide.len(), b.words.len());
            let (a, b) = (a.doubles(), b.doubles());
            let size = b.iter().fold(0.0_f64, |m, x| m.max(x.abs())).max(1e-3);
            let near = |(a, b): (&f64, &f64)| (a - b).abs() <= 2e-4 * size || (a.is_nan() && b.is_nan());
            let count = a.iter().zip(&b).filter(|pair| near(*pair)).count();
            // Some of the matrices are nearly singular.
            if count * 100 < a.len() * 95 {
                wrong.push(format!("{name}: {count} of {} of a plane", a.len()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn each_arithmetic_has_the_same_results_however_it_is_run() {
    for arithmetic in [Arithmetic::Fast, Arithmetic::Double] {
        for (name, file, params) in SEEDS {
            let plain =
                RunOptions { batch: Some(64), tile: 10_000, isa: Isa::baseline(), ..RunOptions::default() };
            for isa in Isa::all() {
                // Results of the fast arithmetic depend on the instruction set, and on nothing else.
                let plain = match arithmetic {
                    Arithmetic::Fast => RunOptions { isa, ..plain.clone() },
                    _ => plain.clone(),
                };
                let expected = seed(arithmetic, file, params, &plain);
                for (batch, native) in [(16, Native::Always), (600, Native::Never)] {
                    let options = RunOptions { isa, native, batch: Some(batch), tile: 1024, ..plain.clone() };
                    let got = seed(arithmetic, file, params, &options);
                    for (a, b) in expected.planes.iter().zip(&got.planes) {
                        assert_eq!(a.words, b.words, "{name} {} {isa:?} {batch}", a.output);
                        let bits =
                            |p: &osl_exec::Plane| p.wide.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                        assert_eq!(bits(a), bits(b), "{name} {} {isa:?} {batch}", a.output);
                    }
                }
            }
        }
    }
}
