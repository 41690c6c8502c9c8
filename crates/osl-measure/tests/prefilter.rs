//! Widened steps compared with means of many samples, and the choice of what is widened.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::passes::{self, FilterSite, Prefilter};
use osl_measure::sample::{Filter, Filtered, Guard, Pattern, Shading, Surface, filtered};
use osl_scene::{Crop, Grid};
use osl_syntax::{NoFiles, Options};

const SIDE: usize = 48;

/// Values of the first output with a number of samples.
fn image(text: &str, samples: u32, prefilter: Option<f32>) -> Vec<f32> {
    let grid = Grid::new(SIDE, SIDE);
    let checked = stages::check("test.osl", text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
    let varying = grid.varying().to_vec();
    let prefilter = prefilter.map(Prefilter::all);
    let options = passes::Options { varying, derivs: Vec::new(), prefilter, ..passes::Options::default() };
    let program = stages::finish(body, &options).program;
    let (services, options) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &program,
        services: &services,
        surface: &grid,
        options: &options,
        cheaper: None,
        guard: None,
        pattern: Pattern::new(samples, 0),
        filter: Filter::default(),
    };
    shading.rows(0..SIDE, samples).unwrap().frame.planes[0].floats()
}

fn rms(a: &[f32], b: &[f32]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}

/// Root mean square errors of one sample: without and with widened steps.
fn errors(text: &str) -> (f64, f64) {
    let truth = image(text, 1024, None);
    (rms(&image(text, 1, None), &truth), rms(&image(text, 1, Some(1.0)), &truth))
}

/// Shaders with edges, and the factor by which the error must shrink.
const CASES: [(&str, &str, f64); 10] = [
    ("step", "r = step(0.43, u + 0.3 * v);", 8.0),
    ("smoothstep", "r = smoothstep(0.42, 0.44, u + 0.3 * v);", 4.0),
    ("linearstep", "r = linearstep(0.42, 0.44, u + 0.3 * v);", 4.0),
    ("smoothstep without width", "r = smoothstep(0.43, 0.43, u + 0.3 * v);", 8.0),
    ("comparison as a number", "r = u + 0.3 * v > 0.43;", 8.0),
    ("choice", "r = u + 0.3 * v < 0.43 ? 0.2 : 0.9;", 8.0),
    ("branch", "if (length(P - point(0.5, 0.5, 1)) < 0.3) r = 0.5 + u;", 6.0),
    ("two conditions", "if (u > 0.31 && v + 0.2 * u < 0.6) r = 1;", 6.0),
    ("either", "if (u > 0.71 || v + 0.2 * u < 0.3) r = 1;", 6.0),
    ("mix", "color c = mix(color(1, 0, 0), color(0, 1, 0), step(0.5, 3 * u - v)); r = c[0];", 8.0),
];

#[test]
fn edges_show_their_mean() {
    for (name, text, factor) in CASES {
        let (plain, wide) = errors(&format!("shader s(output float r = 0) {{ {text} }}"));
        assert!(wide * factor <= plain, "{name}: {plain:.2e} becomes {wide:.2e}");
    }
}

#[test]
fn noise_fades_where_it_is_too_fine() {
    for (name, mean) in [("perlin", 0.0), ("uperlin", 0.5), ("simplex", 0.0), ("usimplex", 0.5)] {
        let text =
            |scale: u32| format!("shader s(output float r = 0) {{ r = noise(\"{name}\", P * {scale}); }}");
        let gone = image(&text(300), 1, Some(1.0));
        assert!(gone.iter().all(|r| *r == mean), "{name}");
        for scale in [5, 15, 25, 40, 70] {
            let (plain, wide) = errors(&text(scale));
            assert!(wide < plain, "{name} * {scale}: {plain:.2e} becomes {wide:.2e}");
        }
    }
}

#[test]
fn what_chooses_a_cell_stays_where_it_is() {
    let text = "shader s(output float r = 0) {
        float cell = step(0.43, u) + 2 * step(0.6, v);
        r = noise(\"cell\", cell + 0.5);
    }";
    assert_eq!(image(text, 1, Some(1.0)), image(text, 1, None));
    let text = "shader s(output float r = 0) {
        float nearest = 100;
        for (int i = 0; i < 5; ++i) {
            float d = distance(point(u, v, 0), point(noise(\"cell\", i), noise(\"cell\", i, 7), 0));
            if (d < nearest) nearest = d;
        }
        r = floor(10 * nearest);
    }";
    assert_eq!(image(text, 1, Some(1.0)), image(text, 1, None));
}

#[test]
fn a_side_that_is_no_number_does_not_show_where_it_is_not_taken() {
    let text =
        "shader s(output float r = 0) { float x = u - 0.5; r = x > 0 ? 1 / (x * x) : x; if (x < 0) r = x; }";
    assert!(image(text, 1, Some(1.0)).iter().all(|r| r.is_finite()));
}

#[test]
fn a_footprint_of_nothing_changes_nothing() {
    for (name, text, _) in CASES {
        let text = format!("shader s(output float r = 0) {{ {text} }}");
        assert_eq!(image(&text, 1, Some(0.0)), image(&text, 1, None), "{name}");
    }
}

/// What is decided for a shader on an image of this size.
fn decided(text: &str, side: usize) -> Filtered {
    let grid = Grid::new(side, side);
    let text = format!("shader s(output float r = 0) {{ {text} }}");
    let checked = stages::check("test.osl", &text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
    let varying = grid.varying().to_vec();
    let options = passes::Options { varying, derivs: Vec::new(), ..passes::Options::default() };
    let plain = stages::finish(body.clone(), &options).program;
    let compile = |left: &[FilterSite]| {
        let prefilter = Some(Prefilter { scale: 1.0, left: left.to_vec() });
        stages::finish(body.clone(), &passes::Options { prefilter, ..options.clone() }).program
    };
    let (services, run) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &plain,
        services: &services,
        surface: &grid,
        options: &run,
        cheaper: None,
        guard: None,
        pattern: Pattern::new(1, 0),
        filter: Filter::default(),
    };
    let places = passes::prefilter_places(body.clone(), &options);
    let found = filtered(&shading, (&places, true), &compile).unwrap();
    let again = filtered(&shading, (&places, true), &compile).unwrap();
    assert_eq!(found.left, again.left, "{text}");
    found
}

/// A line that is thinner than a pixel: the change of its distance at one point says nothing of both edges.
const HAIR: &str = "abs(mod(7.3 * u + 0.7 * v, 1) - 0.5) < 0.003";
/// A straight edge, whose mean is exact.
const EDGE: &str = "step(0.43, u + 0.3 * v)";

#[test]
fn only_what_helps_is_filtered() {
    for (text, places, kept) in [
        (format!("r = {EDGE};"), 1, 1),
        (format!("r = {HAIR};"), 1, 0),
        (format!("r = 0.5 * {EDGE} + ({HAIR} ? 0.5 : 0);"), 2, 1),
        ("r = noise(\"cell\", 30 * P);".into(), 0, 0),
        // Nobody sees a difference.
        ("r = noise(P);".into(), 1, 0),
    ] {
        let found = decided(&text, 96);
        assert_eq!((found.places, found.kept()), (places, kept), "{text}: {}", found.sentence());
        assert!(kept == 0 || found.error < 0.9, "{text}: {}", found.sentence());
    }
}

/// Discs that touch: right everywhere, except where two of them meet within a pixel.
const DISCS: &str = "point at = point(mod(7 * u, 1) - 0.5, mod(7 * v, 1) - 0.5, 0); float d = 10;
    for (int i = -1; i <= 1; i++) d = min(d, hypot(at[0] - 0.98 * i, at[1]));
    r = d < 0.497;";

#[test]
fn pixels_are_decided_one_by_one_where_single_ones_would_be_worse() {
    let found = decided(DISCS, 384);
    assert!(found.guard.is_some(), "{}", found.sentence());
    assert!(found.error.sqrt() < 0.6 && found.cost < 2.5, "{}", found.sentence());
}

#[test]
fn a_part_of_a_picture_has_the_pixels_of_the_whole() {
    let text = format!("shader s(output float r = 0) {{ {DISCS} }}");
    let checked = stages::check("test.osl", &text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
    let whole = Grid::new(90, 70);
    let options = passes::Options {
        varying: whole.varying().to_vec(),
        derivs: Vec::new(),
        ..passes::Options::default()
    };
    let plain = stages::finish(body.clone(), &options).program;
    let prefilter = Some(Prefilter::all(1.0));
    let wide = stages::finish(body, &passes::Options { prefilter, ..options }).program;
    let (services, run) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &wide,
        services: &services,
        surface: &whole,
        options: &run,
        cheaper: None,
        guard: Some(Guard { plain: &plain, ranges: &[1.0] }),
        pattern: Pattern::new(1, 0),
        filter: Filter::default(),
    };
    let image = |surface: &dyn Surface, rows| {
        let own = Shading { surface, ..shading.clone() };
        own.rows(rows, 1).unwrap()
    };
    let all = image(&whole, 0..70);
    let values = all.frame.planes[0].floats();
    let unguarded = |program| {
        let own = Shading { program, guard: None, ..shading.clone() };
        own.rows(0..70, 1).unwrap().frame.planes[0].floats()
    };
    let (centres, filtered) = (unguarded(&plain), unguarded(&wide));
    let of_filtered = |(value, centre): &(&f32, &f32)| value != centre;
    assert!(values.iter().zip(&centres).filter(of_filtered).count() > 300);
    assert!(values.iter().zip(&filtered).filter(of_filtered).count() > 100, "folds are refused");
    for ((value, centre), wide) in values.iter().zip(&centres).zip(&filtered) {
        assert!(value == centre || value == wide, "{value} is neither {centre} nor {wide}");
    }
    assert!(all.tally.evaluations < 3 * 90 * 70, "{:?}", all.tally);
    assert_eq!(all.tally.by_samples, [(1, 6300)]);

    let pieces: Vec<f32> = [0..1, 1..33, 33..70]
        .into_iter()
        .flat_map(|rows| image(&whole, rows).frame.planes[0].floats())
        .collect();
    assert_eq!(pieces, values);
    for (columns, rows) in [(11..60, 20..63), (0..90, 69..70), (89..90, 0..70)] {
        let crop = Crop::new(whole.clone(), columns.clone(), rows.clone());
        let part = image(&crop, 0..rows.len()).frame.planes[0].floats();
        let row = |y: usize| values[90 * y..][columns.clone()].to_vec();
        assert_eq!(part, rows.clone().flat_map(row).collect::<Vec<f32>>(), "{columns:?} {rows:?}");
    }
}

#[test]
fn what_costs_too_much_is_not_filtered() {
    // The derivatives of three noises in four dimensions take fifty times the time of the noises.
    let text = "vector w = 0; for (int i = 0; i < 3; i++) w += noise(90 * P + w, i); r = step(0.5, noise(40 * P + w));";
    let found = decided(text, 64);
    assert_eq!(found.kept(), 0, "{}", found.sentence());
}

#[test]
fn the_decision_is_a_sentence() {
    let all: Vec<String> = [format!("r = {EDGE};"), "r = noise(P);".into(), "r = u;".into()]
        .iter()
        .map(|text| decided(text, 64).sentence())
        .collect();
    insta::assert_snapshot!("decisions", all.join("\n"));
}
