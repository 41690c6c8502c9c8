//! Numeric events: each kind at exactly the points where plain arithmetic has it, nothing where nothing
//! happens, and no change of the values.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::cast_possible_truncation,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::ir::Const;
use osl_ir::passes;
use osl_measure::sanitize::{self, Examined, Kind, Subject};
use osl_measure::trace::OnePoint;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

const SIZE: (usize, usize) = (17, 9);

fn grid() -> Grid {
    Grid::new(SIZE.0, SIZE.1)
}

fn options(grid: &Grid) -> passes::Options {
    passes::Options {
        varying: grid.varying().to_vec(),
        derivs: grid.varying_derivs().to_vec(),
        ..passes::Options::default()
    }
}

fn examine_on(name: &str, text: &str, grid: &Grid, options: &passes::Options) -> Examined {
    let checked = stages::check(name, text, &NoFiles, &Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{text}: {:?}", checked.diagnostics));
    let subject = Subject::new(stages::lower(&program, &[]).unwrap(), options);
    let size = (grid.width, grid.height);
    let points = sanitize::Points { source: grid, size, pixels: None };
    sanitize::sanitize(&subject, &Services::default(), &points, &checked.sources, name)
}

fn examine(text: &str) -> Examined {
    examine_on("s.osl", text, &grid(), &options(&grid()))
}

/// A shader with these statements on the lines from 3.
fn shader(statements: &str) -> String {
    format!("shader s(output float r = 0)\n{{\n{statements}\n}}\n")
}

/// What is reported: kind, line, points, times, first pixel.
type Told = (Kind, u32, usize, u64, [usize; 2]);

fn told(examined: &Examined) -> Vec<Told> {
    let events = examined.report.events.iter();
    events.map(|e| (e.kind, e.quote.line, e.points, e.times, e.first)).collect()
}

/// What must be reported, if the event happens `times(u, v)` times at each point.
fn expected(kind: Kind, line: u32, times: impl Fn(f32, f32) -> u64) -> Told {
    let grid = grid();
    let (mut points, mut all, mut first) = (0, 0, None);
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let n = times(grid.coordinate(0, x, SIZE.0), grid.coordinate(1, y, SIZE.1));
            points += usize::from(n > 0);
            all += n;
            if n > 0 && first.is_none() {
                first = Some([x, y]);
            }
        }
    }
    (kind, line, points, all, first.expect("it happens"))
}

/// The whole part of a number.
fn whole(x: f32) -> i32 {
    x as i32
}

/// One row: the statement on line 3, the kind, and whether it happens at a point.
type Row = (&'static str, Kind, fn(f32, f32) -> bool);

const ROWS: [Row; 35] = [
    ("int n = 2147483000 + (int)(u * 1000); r = n;", Kind::IntOverflow, |u, _| {
        2_147_483_000_i32.checked_add(whole(u * 1000.0)).is_none()
    }),
    ("int n = -2147483000 - (int)(u * 1000); r = n;", Kind::IntOverflow, |u, _| {
        (-2_147_483_000_i32).checked_sub(whole(u * 1000.0)).is_none()
    }),
    ("int n = (int)(u * 1000) * 3000000; r = n;", Kind::IntOverflow, |u, _| {
        whole(u * 1000.0).checked_mul(3_000_000).is_none()
    }),
    ("int n = (int)(-u - 2147483647); n = -n; r = n;", Kind::IntOverflow, |u, _| {
        whole(-u - 2_147_483_647.0).checked_neg().is_none()
    }),
    ("int n = (int)(u * -2147483648.0); n = abs(n); r = n;", Kind::IntOverflow, |u, _| {
        whole(u * -2_147_483_648.0).checked_abs().is_none()
    }),
    ("int n = (int)(u * 4e9); r = n;", Kind::IntConversion, |u, _| u * 4e9 >= 2_147_483_648.0),
    ("int n = int(u * -4e9); r = n;", Kind::IntConversion, |u, _| u * -4e9 < -2_147_483_648.0),
    ("r = v / (u - 0.5);", Kind::ZeroDivision, |u, _| u == 0.5),
    ("r = 1; r /= u;", Kind::ZeroDivision, |u, _| u == 0.0),
    ("int k = (int)(u * 16); r = 7 / k;", Kind::ZeroDivision, |u, _| whole(u * 16.0) == 0),
    ("int k = (int)(u * 8); r = 7 % k;", Kind::ZeroDivision, |u, _| whole(u * 8.0) == 0),
    ("r = mod(v, u - 0.5);", Kind::ZeroDivision, |u, _| u == 0.5),
    ("r = fmod(v, u - 0.5);", Kind::ZeroDivision, |u, _| u == 0.5),
    ("color c = color(u, v, 1) / color(1, v, 2); r = c[1];", Kind::ZeroDivision, |_, v| v == 0.0),
    ("r = log(u);", Kind::Domain, |u, _| u <= 0.0),
    ("r = log2(u - v);", Kind::Domain, |u, v| u - v <= 0.0),
    ("r = log10(u - 0.25);", Kind::Domain, |u, _| u <= 0.25),
    ("r = sqrt(u - 0.5);", Kind::Domain, |u, _| u < 0.5),
    ("r = inversesqrt(u - 0.5);", Kind::Domain, |u, _| u <= 0.5),
    ("r = acos(2 * u);", Kind::Domain, |u, _| u > 0.5),
    ("r = asin(u - 4 * v);", Kind::Domain, |u, v| (u - 4.0 * v).abs() > 1.0),
    ("r = pow(u - 0.5, 0.3);", Kind::Domain, |u, _| u < 0.5),
    ("r = pow(u, v - 2);", Kind::Domain, |u, _| u == 0.0),
    ("r = length(normalize(vector(u - 0.5, v - 0.5, 0)));", Kind::Domain, |u, v| u == 0.5 && v == 0.5),
    ("float a[4] = {1, 2, 3, 4}; r = a[(int)(u * 8)];", Kind::Index, |u, _| whole(u * 8.0) > 3),
    ("float a[4] = {1, 2, 3, 4}; r = a[(int)(u * 3) - 1];", Kind::Index, |u, _| whole(u * 3.0) < 1),
    ("color c = color(u, v, 0); r = c[(int)(u * 4)];", Kind::Index, |u, _| whole(u * 4.0) > 2),
    ("r = smoothstep(0.5, u, v);", Kind::Edges, |u, _| u <= 0.5),
    ("r = linearstep(0.5, u, v);", Kind::Edges, |u, _| u <= 0.5),
    ("r = clamp(v, 0.5, u);", Kind::Edges, |u, _| u < 0.5),
    ("float x = u * 1e30; r = x * 1e9;", Kind::Infinity, |u, _| (u * 1e30 * 1e9).is_infinite()),
    ("float x = u + 1e-28; r = 1e30 / (x * 1e-8);", Kind::Infinity, |u, _| {
        (1e30 / ((u + 1e-28) * 1e-8)).is_infinite()
    }),
    ("float x = u * 1e-30; r = x * 1e-9;", Kind::Denormal, |u, _| (u * 1e-30 * 1e-9).is_subnormal()),
    ("r = (1 + 1e-5 * u) - 1;", Kind::Cancellation, |u, _| loses_digits(u)),
    ("if (u > 0.5) r = 1 / (v - 0.5);", Kind::ZeroDivision, |u, v| u > 0.5 && v == 0.5),
];

/// Whether `(1 + 1e-5 u) - 1` has more than four digits fewer than its first operand.
fn loses_digits(u: f32) -> bool {
    let (sum, wide) = (1.0 + 1e-5 * u, 1.0 + f64::from(1e-5_f32) * f64::from(u));
    let right = |strict: f32, exact: f64| {
        let (error, size) = ((f64::from(strict) - exact).abs(), exact.abs().max(f64::from(strict).abs()));
        if error <= size * f64::from(f32::EPSILON) / 2.0 {
            7.2
        } else {
            (-(error / size).log10()).clamp(0.0, 7.2)
        }
    };
    right(sum, wide) - right(sum - 1.0, wide - 1.0) > 4.0
}

#[test]
fn each_kind_is_counted_where_it_happens() {
    let mut wrong = Vec::new();
    for (statements, kind, happens) in ROWS {
        let examined = examine(&shader(statements));
        let wanted = vec![expected(kind, 3, |u, v| u64::from(happens(u, v)))];
        let found = told(&examined);
        if found != wanted {
            wrong.push(format!("{statements}\n  wanted {wanted:?}\n  found  {found:?}"));
        }
        let map = examined.happened.iter().filter(|bits| **bits == kind.bit()).count();
        assert_eq!(map, wanted[0].2, "{statements}: the map");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_kind_has_a_row() {
    for kind in Kind::ALL {
        let in_rows = ROWS.iter().any(|row| row.1 == kind);
        assert!(in_rows || kind == Kind::Nan, "{kind:?}");
        assert_eq!(Kind::from_name(kind.name()), Some(kind));
    }
}

#[test]
fn what_passes_through_is_told_once() {
    let text = shader(
        "float big = u * 1e30;\nfloat inf = big * big;\nfloat nan = inf - inf;\nfloat more = nan + 1;\n\
         int n = (int) more;\nr = sqrt(more) + n;",
    );
    let is_infinite = |u: f32| (u * 1e30 * (u * 1e30)).is_infinite();
    let wanted = [(Kind::Infinity, 4), (Kind::Nan, 5), (Kind::IntConversion, 7)];
    let wanted = wanted.map(|(kind, line)| expected(kind, line, |u, _| u64::from(is_infinite(u))));
    assert_eq!(told(&examine(&text)), wanted);
    let text = shader("float x = u * 1e-30;\nfloat y = x * 1e-9;\nr = y * 0.5 + max(y, 0);");
    let wanted = expected(Kind::Denormal, 4, |u, _| u64::from((u * 1e-30 * 1e-9).is_subnormal()));
    assert_eq!(told(&examine(&text)), [wanted]);
}

#[test]
fn several_times_at_a_point_are_counted() {
    let text = shader("for (int i = 0; i < 5; i++)\n    r += v / (i - 2);\nr += log(u);");
    let wanted =
        [expected(Kind::ZeroDivision, 4, |_, _| 1), expected(Kind::Domain, 5, |u, _| u64::from(u == 0.0))];
    assert_eq!(told(&examine(&text)), wanted);
    let text = shader("for (int i = 0; i < 5; i++)\n    r += log(u * i);");
    assert_eq!(told(&examine(&text)), [expected(Kind::Domain, 4, |u, _| if u == 0.0 { 5 } else { 1 })]);
}

/// A difference that crosses 0 at few points is no event; where it is computed at few points, they are all of
/// them.
#[test]
fn crossings_of_zero_are_not_told() {
    let on = |grid: Grid, text: &str| told(&examine_on("s.osl", &shader(text), &grid, &options(&grid)));
    let wide = Grid::new(1001, 1);
    let close = Grid { scale: [0.002, 1.0], offset: [0.499, 0.0], ..wide.clone() };
    let crossing = "r = 0.5 + sin((u - 0.5) * 0.02) - 0.5;";
    assert_eq!(on(wide.clone(), crossing), []);
    assert!(matches!(on(close, crossing)[..], [(Kind::Cancellation, 3, 800.., ..)]));
    let near = on(wide, "float x = 1 + 1e-5 * u;\nif (u > 0.9985)\n    r = x - 1;");
    assert_eq!(near, [(Kind::Cancellation, 5, 2, 2, [999, 0])]);
}

/// Guards that work, exact differences, code that nobody needs, and the inside of built-ins and derivatives.
#[test]
fn what_is_right_is_not_told() {
    let innocent = [
        "r = u == 0.5 ? 0 : v / (u - 0.5);",
        "if (u != 0.5 && 1 / (u - 0.5) > 2) r = 1;",
        "float waste = 1 / (u - 0.5); r = v;",
        "if (u > 2) r = log(-u);",
        "r = u - 0.5;",
        "r = (u + 1) - 1;",
        "float big = 1000000; r = (big + u) - v;",
        "r = aastep(0.5, 0.25);",
        "r = filterwidth(sqrt(u)) + Dx(pow(u, 0.5)) + Dx(length(vector(u, v, 0)));",
        "r = smoothstep(0, 1, u) + linearstep(0, 1, v) + clamp(u, 0, 1);",
        "int n = (int)(u * 2147483520); r = n;",
        "float a[3] = {1, 2, 3}; r = a[(int)(u * 2)];",
        "r = noise(u * 100) + snoise(P) + cellnoise(u * 17);",
        "r = exp(-u * 50) + pow(u, 3) + pow(-u, 2) + acos(u) + sqrt(u) + log(u + 0.1) + 1 / (u + 0.1);",
        "int h = (int)(u * 100); h = (h << 7) ^ (h >> 3); r = h & 255;",
        "r = mod(u, 0.1) + fmod(u, 0.1) + u / 3;",
        "vector d = normalize(vector(u, v, 1)); r = dot(d, d);",
        "point q = rotate(P, u, point(0), point(0, 0, 1)); r = q[0] + hypot(u, v);",
    ];
    let told: Vec<String> = innocent
        .into_iter()
        .map(|statements| sanitize::text::text(&examine(&shader(statements)).report))
        .filter(|text| !text.contains("no numeric events"))
        .collect();
    assert!(told.is_empty(), "{}", told.join("\n"));
}

const SEEDS: [&str; 6] =
    ["Cobbled.osl", "chaosmosaic.osl", "flakes.osl", "nonlinear_noise.osl", "sprinkles.osl", "strips.osl"];

fn seed(name: &str) -> String {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

/// They were written with care: their guards work, and their differences cross 0 at few points.
#[test]
fn the_seed_shaders_have_no_events() {
    let repaired = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/seeds/sprinkles.repaired.osl");
    let mut texts: Vec<(&str, String)> = vec![("sprinkles", std::fs::read_to_string(repaired).unwrap())];
    texts.extend(SEEDS.into_iter().filter(|name| *name != "sprinkles.osl").map(|name| (name, seed(name))));
    let grid = Grid::new(24, 24);
    for (name, text) in texts {
        let report = examine_on(name, &text, &grid, &options(&grid)).report;
        assert!(report.events.is_empty(), "{}", sanitize::text::text(&report));
        assert_eq!((report.points, report.cut), (576, 0));
    }
}

/// The values of an examined point are those of a run, bit by bit.
#[test]
fn values_do_not_change() {
    let rows = ROWS.map(|(statements, ..)| ("s.osl".to_string(), shader(statements)));
    let seeds = SEEDS.map(|name| (name.to_string(), seed(name)));
    for (name, text) in rows.into_iter().chain(seeds) {
        let grid = Grid::new(7, 5);
        let checked = stages::check(&name, &text, &NoFiles, &Options::default());
        let Some(program) = checked.program else { continue };
        let body = stages::lower(&program, &[]).unwrap();
        let services = Services::default();
        let ran = stages::finish(body.clone(), &options(&grid)).program;
        let frame = osl_exec::run(&ran, &services, &grid, &RunOptions::default(), &|_| ()).unwrap();
        let subject = Subject::new(body, &options(&grid));
        for pixel in 0..grid.count() {
            let point = OnePoint::at_pixel(&grid, 7, 5, pixel % 7, pixel / 7).unwrap();
            let trace = subject.follow(&services, OnePoint { source: &grid, point });
            let nodes = trace.outputs.iter().flat_map(|(.., nodes)| nodes);
            let words = nodes.flat_map(|id| match trace.node(*id).strict.clone().unwrap() {
                Const::Int(n) => vec![n.cast_unsigned()],
                Const::Float(x) => vec![x.to_bits()],
                Const::Triple(t) => t.map(f32::to_bits).to_vec(),
                Const::Matrix(m) => m.map(f32::to_bits).to_vec(),
                Const::Str(_) | Const::Null => Vec::new(),
            });
            let words: Vec<u32> = words.collect();
            let run: Vec<u32> = frame.planes.iter().map(|plane| plane.words[pixel]).collect();
            assert_eq!(words, run, "{name}, pixel {pixel}: {text}");
        }
    }
}

#[test]
fn a_report_reads_like_this() {
    let text = shader(
        "float far = 1 + 1e-5 * u;\nr = v / (u - 0.5) + (far - 1) + sqrt(v - 0.25);\n\
         int n = (int)(u * 4e9);\nfloat list[4] = {1, 2, 3, 4};\nr += list[(int)(u * 8)] * (n + 1000) * 1e30;\n\
         r *= smoothstep(0.5, u, v) * clamp(v, 0.5, u) * (u * 1e-30 * 1e-9);\n\
         float overflow = (r + 1) * 1e30 * 1e30;\nr = overflow - overflow;",
    );
    insta::assert_snapshot!(sanitize::text::text(&examine(&text).report));
}

#[test]
fn a_cut_is_told() {
    let text = shader("for (int i = 0; i < 1000; i++)\n    r += v / (u - 0.5);");
    let mut few = options(&grid());
    few.limits.running.trace = 500;
    let report = examine_on("s.osl", &text, &grid(), &few).report;
    assert_eq!((report.points, report.cut, report.not_examined), (153, 153, 0));
    assert_eq!(report.events.len(), 1, "what was seen before the cut counts");
    let mut over = options(&grid());
    let cancel = osl_limits::Cancel::new();
    cancel.cancel();
    over.limits = over.limits.until(&cancel);
    let report = examine_on("s.osl", &text, &grid(), &over).report;
    assert_eq!((report.points, report.not_examined), (0, 153));
    assert!(sanitize::text::text(&report).contains("153 more points"));
}

/// Each index is quoted where it stands.
#[test]
fn each_index_of_a_matrix_has_its_place() {
    for (cell, code) in [("[4 + row][0]", "4 + row"), ("[0][5 + row]", "5 + row")] {
        let text =
            format!("shader s(output float r = 0) {{ int row = int(u * 0.5); matrix m = u; r = m{cell}; }}");
        let events = examine(&text).report.events;
        let codes: Vec<&str> = events.iter().map(|event| event.quote.code.as_str()).collect();
        assert_eq!(codes, [code], "{text}");
    }
}
