//! Widened steps compared with means of many samples.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::passes::{self, Prefilter};
use osl_measure::sample::{Filter, Pattern, Shading};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};

const SIDE: usize = 48;

/// Values of the first output with a number of samples.
fn image(text: &str, samples: u32, prefilter: Option<f32>) -> Vec<f32> {
    let grid = Grid::new(SIDE, SIDE);
    let checked = stages::check("test.osl", text, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
    let varying = grid.varying().to_vec();
    let prefilter = prefilter.map(|scale| Prefilter { scale });
    let options = passes::Options { varying, derivs: Vec::new(), prefilter, ..passes::Options::default() };
    let program = stages::finish(body, &options).program;
    let (services, options) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &program,
        services: &services,
        surface: &grid,
        options: &options,
        cheaper: None,
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
