//! Images from samples, for shaders whose true images are known.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{Frame, PointSource, Program, RunOptions, Services};
use osl_ir::passes;
use osl_measure::sample::{
    Adaptive, Filter, FilterKind, Image, MaxError, Pattern, Rate, Shading, Watch, adaptive, at_rate, check,
    max_error, max_error_each, oracle, reaches, within,
};
use osl_numeric::Arithmetic;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

fn compile(text: &str, arithmetic: Arithmetic) -> Program {
    let checked = stages::check("test.osl", text, &NoFiles, &Options::default());
    let program = checked.program.expect("no errors");
    let body = stages::lower(&program, &[]).expect("lowers");
    let varying = Grid::new(2, 2).varying().to_vec();
    let options = passes::Options { varying, derivs: Vec::new(), arithmetic, ..passes::Options::default() };
    stages::finish(body, &options).program
}

/// Calls `work` with a shader, given as text, on a grid.
fn shading<T>(text: &str, grid: &Grid, filter: Filter, work: impl FnOnce(&Shading<'_>) -> T) -> T {
    let (services, options) = (Services::default(), RunOptions::default());
    let program = compile(text, Arithmetic::Strict);
    work(&Shading {
        program: &program,
        services: &services,
        surface: grid,
        options: &options,
        cheaper: None,
        pattern: Pattern::new(64, 0),
        filter,
    })
}

fn values(frame: &Frame, plane: usize) -> Vec<f32> {
    frame.planes[plane].floats()
}

const EDGE: &str = "shader s(output float r = 0, output color c = 0) { r = step(0.437, u + 0.3 * v); c = color(u, v, noise(20 * P)); }";

#[test]
fn one_sample_has_the_bits_of_a_plain_run() {
    for center in [false, true] {
        let grid = Grid { center, scale: [3.0, 0.7], offset: [0.1, -2.0], ..Grid::new(50, 37) };
        shading(EDGE, &grid, Filter::default(), |s| {
            let plain = osl_exec::run(s.program, s.services, &grid, s.options, &|_| ()).unwrap();
            for image in [s.rows(0..37, 1).unwrap(), at_rate(s, 0..37, Rate([1, 1])).unwrap()] {
                let words = |frame: &Frame| frame.planes.iter().map(|p| p.words.clone()).collect::<Vec<_>>();
                assert_eq!(words(&image.frame), words(&plain));
            }
        });
    }
}

#[test]
fn samples_do_not_depend_on_how_the_image_is_cut() {
    let grid = Grid::new(40, 24);
    shading(EDGE, &grid, Filter::default(), |s| {
        let whole = s.rows(0..24, 7).unwrap().frame;
        let mut pieces = Frame::default();
        for rows in [0..5, 5..16, 16..24] {
            pieces.add(s.rows(rows, 7).unwrap().frame, &s.options.limits.running);
        }
        assert_eq!(values(&whole, 1), values(&pieces, 1));
        for rate in Rate::ALL {
            let whole = at_rate(s, 0..24, rate).unwrap().frame;
            let mut pieces = Frame::default();
            for rows in [0..8, 8..20, 20..24] {
                pieces.add(at_rate(s, rows, rate).unwrap().frame, &s.options.limits.running);
            }
            assert_eq!(values(&whole, 1), values(&pieces, 1), "{rate}");
        }
    });
}

#[test]
fn filters_keep_what_they_should() {
    let grid = Grid::new(16, 16);
    for kind in FilterKind::ALL {
        let filter = Filter::new(kind, kind.usual_width());
        let constant = "shader s(output float r = 0) { r = 0.7; }";
        let image = shading(constant, &grid, filter.clone(), |s| s.rows(0..16, 16).unwrap());
        assert!(values(&image.frame, 0).iter().all(|r| (r - 0.7).abs() < 1e-6), "{kind:?}");
        let slope = "shader s(output float r = 0) { r = u; }";
        let image = shading(slope, &grid, filter, |s| s.rows(0..16, 64).unwrap());
        for (i, r) in values(&image.frame, 0).iter().enumerate() {
            assert!((r - (i % 16) as f32 / 15.0).abs() < 4e-3, "{kind:?}: {i} {r}");
        }
    }
}

#[test]
fn a_box_gives_the_share_of_the_pixel() {
    // The edge is at 10.3 of 20 pixels; column 10 covers 9.5 to 10.5, so a fifth of it is after the edge.
    let grid = Grid::new(20, 4);
    let text = "shader s(output int r = 0) { r = u * 19 > 10.3; }";
    let image = shading(text, &grid, Filter::default(), |s| s.rows(0..4, 64).unwrap());
    let r = values(&image.frame, 0);
    assert_eq!((r[9], r[11]), (0.0, 1.0));
    assert!((r[10] - 0.2).abs() < 0.02, "{}", r[10]);
}

#[test]
fn derivatives_are_those_of_the_pixel() {
    let grid = Grid::new(9, 9);
    let text = "shader s(output float r = 0) { r = Dx(u); }";
    for samples in [1, 16] {
        let image = shading(text, &grid, Filter::default(), |s| s.rows(0..9, samples).unwrap());
        assert!(values(&image.frame, 0).iter().all(|r| *r == 0.125));
    }
}

/// Mean of the shader over each pixel, from very many samples.
fn truth(s: &Shading<'_>, rows: usize) -> Vec<Vec<f32>> {
    let many = Shading { pattern: Pattern::new(1024, 99), ..s.clone() };
    let image = many.rows(0..rows, 1024).unwrap();
    image.frame.planes.iter().map(|p| p.floats()).collect()
}

fn share_above(image: &Image, truth: &[Vec<f32>], limit: f32) -> f64 {
    let planes: Vec<Vec<f32>> = image.frame.planes.iter().map(|p| p.floats()).collect();
    let count = truth[0].len();
    let bad = |at: &usize| planes.iter().zip(truth).any(|(p, t)| (p[*at] - t[*at]).abs() > limit);
    (0..count).filter(bad).count() as f64 / count as f64
}

#[test]
fn adaptive_samples_go_where_the_edge_is() {
    let grid = Grid::new(64, 64);
    shading(
        "shader s(output float r = 0) { r = step(0.437, u + 0.3 * v); }",
        &grid,
        Filter::default(),
        |s| {
            let image = adaptive(s, 0..64, Adaptive { threshold: 0.01, most: 256 }).unwrap();
            assert!(image.tally.per_pixel() < 24.0, "{:?}", image.tally);
            assert!(share_above(&image, &truth(s, 64), 0.03) < 0.005);
        },
    );
}

#[test]
fn a_bound_is_kept_and_costs_little() {
    let grid = Grid::new(128, 128);
    // Maximum evaluations per pixel: slightly more than one for several pixels where lattices suffice; half
    // more than the best fixed number where all pixels are rough, since so small an image has few pixels to
    // learn from; and a fraction of it where there are edges.
    let cases: [(&str, &str, f32, f64); 10] = [
        ("constant", "r = 0.25;", 0.01, 0.08),
        ("smooth", "r = sin(6 * u) * v;", 0.01, 0.08),
        ("half as smooth", "r = sin(20 * u) * cos(18 * v);", 0.03, 0.4),
        ("waves", "r = sin(45 * u) * cos(35 * v);", 0.02, 1.2),
        ("edge", "r = step(0.437, u + 0.3 * v);", 0.02, 12.0),
        ("grazing edge", "r = step(0.05 + 0.9 * u, v);", 0.05, 8.0),
        (
            "dots",
            "point p = 9.7 * P; point f = floor(p) + 0.5; f[2] = p[2]; r = distance(p, f) < 0.08;",
            0.02,
            64.0,
        ),
        ("cells", "r = noise(\"cell\", 23 * P);", 0.05, 24.0),
        ("fine perlin", "r = noise(150 * P);", 0.05, 24.0),
        ("noise", "r = noise(\"hash\", P * 1e4);", 0.1, 200.0),
    ];
    for (name, body, error, most) in cases {
        let text = format!("shader s(output float r = 0) {{ {body} }}");
        shading(&text, &grid, Filter::default(), |s| {
            let image = max_error(s, 0..128, MaxError { error, most: 1024 }).unwrap();
            let share = share_above(&image, &truth(s, 128), error);
            // In so small an image the pilot has a thousand pixels, which cannot distinguish one failure from
            // three.
            assert!(share <= 0.003, "{name}: {share} of the pixels are off, {:?}", image.tally);
            assert!(image.tally.per_pixel() < most, "{name}: {:?}", image.tally);
        });
    }
}

#[test]
fn a_centre_is_enough_although_no_other_place_in_its_pixel_has_its_value() {
    let text = "shader s(output float r = 0) {
        float a = 1; point p = 30 * P;
        for (int i = 0; i < 4; i++) { r += a * noise(p); p *= 2; a *= 0.5; } }";
    let grid = Grid::new(192, 192);
    shading(text, &grid, Filter::default(), |s| {
        let image = max_error(s, 0..192, MaxError { error: 0.07, most: 1024 }).unwrap();
        assert!(image.tally.per_pixel() < 1.3, "{:?}", image.tally);
        assert!(share_above(&image, &truth(s, 192), 0.07) <= 0.001);
    });
}

#[test]
fn a_bound_is_kept_in_small_images_too() {
    // A thousandth of these images is at most ten pixels.
    let specks = "point p = 40 * P; point f = floor(p); f[2] = 0;
        r = noise(\"hash\", f) < 0.2 && distance(point(p[0], p[1], 0), f + point(0.5, 0.5, 0)) < 0.17;";
    let edge = "r = step(0.437, u + 0.3 * v);";
    let hills = "r = noise(9 * P) + 0.5 * noise(18 * P) + 0.25 * noise(36 * P);";
    for side in [16, 32, 64, 100] {
        for body in [specks, edge, hills] {
            let text = format!("shader s(output float r = 0) {{ {body} }}");
            shading(&text, &Grid::new(side, side), Filter::default(), |s| {
                let image = max_error(s, 0..side, MaxError { error: 0.04, most: 1024 }).unwrap();
                let share = share_above(&image, &truth(s, side), 0.04);
                assert!(share <= 0.001, "{side}, {body}: {share} of the pixels are off, {:?}", image.tally);
            });
        }
    }
}

#[test]
fn outlines_that_few_probes_hit_are_not_overlooked() {
    // A ring covers a quarter of the pixels that it crosses: one probe in four sees it there.
    let text = "shader s(output float r = 0) {
        point q = 2.3 * P; point c = floor(q) + 0.5; c[2] = q[2];
        r = abs(distance(q, c) - 0.3) < 0.00075 ? 0 : 0.6 + 0.1 * sin(9 * u); }";
    let grid = Grid::new(384, 384);
    shading(text, &grid, Filter::default(), |s| {
        let image = max_error(s, 0..384, MaxError { error: 0.05, most: 1024 }).unwrap();
        let share = share_above(&image, &truth(s, 384), 0.05);
        assert!(share <= 0.001, "{share} of the pixels are off, {:?}", image.tally);
    });
}

#[test]
fn so_many_probes_that_a_few_trials_do_not_speak_for_them() {
    // With one sample at each centre, a pixel in seven exceeds the bound, and 10 of the 48 first probes do.
    // More than 16,000 probes may have 11 that fail.
    let text = "shader s(output float r = 0) {
        int twill = ((int)(u * 200) + (int)(v * 200)) % 4 < 2;
        r = noise(\"cell\", 9 * (twill ? u : v)); }";
    let (width, height, bound) = (1024, 768, 0.0116);
    let grid = Grid { center: true, ..Grid::new(width, height) };
    shading(text, &grid, Filter::default(), |s| {
        let image = max_error(s, 0..height, MaxError { error: bound, most: 1024 }).unwrap();
        let truth = oracle(s, Watch::new(width * height, 4096).pixels(), 1024).unwrap();
        let planes: Vec<Vec<f32>> = image.frame.planes.iter().map(|p| p.floats()).collect();
        let found = check(&planes, &truth, &[f64::from(bound)], |pixel| pixel as usize);
        assert!(found.above <= 6, "{} of 4096 pixels are off, {:?}", found.above, image.tally);
    });
}

#[test]
fn a_bound_is_kept_under_other_filters() {
    let grid = Grid::new(64, 64);
    for (kind, width) in
        [(FilterKind::Gaussian, 2.0), (FilterKind::Mitchell, 4.0), (FilterKind::Gaussian, 20.0)]
    {
        for body in ["r = sin(20 * u) * cos(18 * v);", "r = step(0.437, u + 0.3 * v);"] {
            let text = format!("shader s(output float r = 0) {{ {body} }}");
            shading(&text, &grid, Filter::new(kind, width), |s| {
                let image = max_error(s, 0..64, MaxError { error: 0.05, most: 1024 }).unwrap();
                let share = share_above(&image, &truth(s, 64), 0.05);
                assert!(share <= 0.002, "{kind:?} {width}, {body}: {share} are off, {:?}", image.tally);
            });
        }
    }
}

#[test]
fn an_error_bound_gives_the_same_image_whatever_the_threads() {
    let grid = Grid::new(96, 64);
    let text = "shader s(output float r = 0) { r = u > 0.4 ? noise(\"cell\", 17 * P) : sin(9 * v); }";
    shading(text, &grid, Filter::default(), |s| {
        let image = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let image = pool.install(|| max_error(s, 0..64, MaxError { error: 0.03, most: 256 }).unwrap());
            (image.frame.planes[0].words.clone(), image.tally)
        };
        assert_eq!(image(1), image(3));
    });
}

/// Rough everywhere, so that all pixels need samples.
fn rough(of: &str) -> String {
    format!("shader s(output float r = 0) {{ r = 0.5 + 0.5 * sin({of} * noise(\"hash\", 1e4 * P)); }}")
}

#[test]
fn samples_are_cheaper_where_that_is_good_enough() {
    let grid = Grid::new(128, 128);
    // Sines of large angles are inaccurate in fast arithmetic.
    for (text, error, good) in
        [(rough("3"), 0.1, true), (rough("3"), 1e-5, false), (rough("1e6"), 0.1, false)]
    {
        let fast = compile(&text, Arithmetic::Fast);
        shading(&text, &grid, Filter::default(), |s| {
            let offered = Shading { cheaper: Some(&fast), ..s.clone() };
            let image = max_error(&offered, 0..128, MaxError { error, most: 1024.min((1e3 * error) as u32) });
            let image = image.unwrap();
            assert_eq!(image.tally.cheaper.is_some(), good, "{text} {error} {:?}", image.tally);
            if let Some(cheaper) = image.tally.cheaper {
                assert!(cheaper.compared >= 1024 && cheaper.largest > 0.0 && cheaper.largest < 0.02 * error);
                assert!(cheaper.pixels > 16000, "{cheaper:?}");
            }
        });
    }
}

#[test]
fn pixels_that_may_not_have_enough_samples_are_counted() {
    // In the smaller image, half of the pixels belong to the pilot, which gets twice as many samples.
    for (side, most) in [(64, 26.0), (128, 18.0)] {
        let grid = Grid::new(side, side);
        let text = "shader s(output float r = 0) { r = noise(\"hash\", P * 1e4); }";
        shading(text, &grid, Filter::default(), |s| {
            let image = max_error(s, 0..side, MaxError { error: 0.01, most: 16 }).unwrap();
            assert!(image.tally.unfinished as usize > 3 * side * side / 4, "{:?}", image.tally);
            assert!(image.tally.per_pixel() <= most, "{:?}", image.tally);
        });
    }
}

#[test]
fn each_output_has_its_own_bound() {
    let grid = Grid::new(192, 128);
    // The second output is the first one in other units; the third one is never a number.
    let text = "shader s(output float r = 0, output float w = 0, output float n = 0) {
        r = u > 0.4 ? noise(\"cell\", 17 * P) : sin(9 * v) + step(0.437, u + 0.3 * v);
        w = 64 * r;
        n = pow(10, 30) * pow(10, 30) * (u - 0.5);
    }";
    let free = f32::INFINITY;
    shading(text, &grid, Filter::default(), |s| {
        let image = |bounds: [f32; 3]| {
            let image = max_error_each(s, 0..128, (&bounds, 256)).unwrap();
            (image.frame.planes.iter().map(|p| p.words.clone()).collect::<Vec<_>>(), image.tally)
        };
        let one = image([0.03, free, free]);
        assert!(one.1.per_pixel() > 1.0, "{:?}", one.1);
        assert_eq!(image([0.03, 64.0 * 0.03, free]), one);
        assert_eq!(image([free, 64.0 * 0.03, free]), one);
        assert_eq!(image([0.03, 64.0 * 0.06, free]), one, "the stricter bound counts");
        let none = image([free, free, free]);
        assert!(none.1.per_pixel() < 0.1 && none.1.above == 0.0, "{:?}", none.1);
    });
}

#[test]
fn ranges_are_those_of_the_outputs() {
    let text = "shader s(output float r = 0, output color c = 0, output int i = 0) {
        r = 10 + 4 * u; c = color(u, 0.5, 100 + 2 * v); i = 3;
    }";
    for (size, pixels) in [(40, 1024), (200, 1250), (400, 4096)] {
        let grid = Grid::new(size, size);
        shading(text, &grid, Filter::default(), |s| {
            let found = reaches(s).unwrap();
            let names: Vec<&str> = found.iter().map(|own| &*own.name).collect();
            assert_eq!(names, ["r", "c", "i"]);
            let sizes: Vec<f32> = found.iter().map(|own| own.size()).collect();
            assert!((sizes[0] - 4.0).abs() < 0.02 && (sizes[1] - 2.0).abs() < 0.02, "{sizes:?}");
            assert_eq!((sizes[2], found[0].pixels), (3.0, pixels));
        });
    }
}

#[test]
fn a_bound_that_is_missed_is_seen_without_an_oracle() {
    let grid = Grid::new(96, 96);
    let text = "shader s(output float r = 0) { r = noise(\"hash\", P * 1e4); }";
    shading(text, &grid, Filter::default(), |s| {
        let wanted = MaxError { error: 0.05, most: 16 };
        let image = max_error(s, 0..96, wanted).unwrap();
        let share = share_above(&image, &truth(s, 96), wanted.error);
        let said = image.tally.above / image.tally.pixels as f64;
        assert!(share > 0.3 && (said / share - 1.0).abs() < 0.25, "{said} said, {share} true");
        let enough = max_error(s, 0..96, MaxError { most: 4096, ..wanted }).unwrap();
        assert_eq!(enough.tally.above, 0.0);
    });
}

/// A clock that shows as many seconds more at each look.
fn ticking(each: f64) -> impl Fn() -> f64 + Sync {
    let looks = std::sync::atomic::AtomicU32::new(0);
    move || each * f64::from(looks.fetch_add(1, std::sync::atomic::Ordering::Relaxed))
}

#[test]
fn the_clock_decides_the_number_of_samples_and_nothing_else() {
    let grid = Grid::new(40, 24);
    for kind in FilterKind::ALL {
        shading(EDGE, &grid, Filter::new(kind, kind.usual_width()), |s| {
            let mut seen = Vec::new();
            for each in [7.0, 0.9, 0.4, 0.3, 0.25, 0.2, 0.15] {
                let timed = within(s, &|_, _| 1.0, &ticking(each), &|_| ()).unwrap();
                let pattern = s.pattern.clone().with(timed.samples);
                let plain = Shading { pattern, ..s.clone() }.rows(0..24, timed.samples).unwrap();
                let words =
                    |image: &Image| image.frame.planes.iter().map(|p| p.words.clone()).collect::<Vec<_>>();
                assert_eq!(words(&timed.image), words(&plain), "{kind:?}, {} samples", timed.samples);
                assert_eq!(timed.image.tally.by_samples, [(timed.samples, 40 * 24)]);
                assert_eq!(timed.fits, each < 1.0 / 2.0 || timed.samples > 1, "{each}");
                seen.push(timed.samples);
            }
            assert!(seen[0] == 1 && seen.is_sorted() && seen[6] > 5, "{seen:?}");
            assert!(seen.iter().any(|n| !n.is_power_of_two()), "{seen:?}");
        });
    }
}

#[test]
fn what_is_no_number_neither_hides_nor_goes_on_forever() {
    let grid = Grid::new(32, 32);
    let text = "shader s(output float r = 0) { r = u > 0.5 ? 1 : acos(2) + log(-1) ; if (u > 0.7) r = 1 / (v - v); }";
    let text = text.replace("1 / (v - v)", "pow(10, 30) * pow(10, 30)");
    shading(&text, &grid, Filter::default(), |s| {
        let image = max_error(s, 0..32, MaxError { error: 0.01, most: 1024 }).unwrap();
        assert_eq!(image.frame.planes[0].words.len(), 1024);
        assert!(image.tally.evaluations < 1 << 20, "{:?}", image.tally);
        let plain = s.rows(0..32, 4).unwrap();
        assert_eq!(plain.frame.planes[0].words.len(), 1024);
    });
}

#[test]
fn tiny_images_work() {
    for (width, height) in [(1, 1), (1, 7), (5, 1), (3, 3)] {
        let grid = Grid::new(width, height);
        shading(EDGE, &grid, Filter::default(), |s| {
            let pixels = width * height;
            let check = |image: Image| assert_eq!(image.frame.planes[0].words.len(), pixels);
            check(max_error(s, 0..height, MaxError { error: 0.05, most: 64 }).unwrap());
            check(adaptive(s, 0..height, Adaptive { threshold: 0.05, most: 2 }).unwrap());
            check(at_rate(s, 0..height, Rate([4, 4])).unwrap());
            check(s.rows(0..height, 3).unwrap());
        });
    }
}
