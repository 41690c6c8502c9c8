//! The trade-off: its reports, and that the results are plausible.

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
use osl_measure::sample::{Filter, Shading};
use osl_measure::tradeoff::{
    Error, Output, Picture, Request, Row, Setting, Trade, Variant, csv, html, pattern, text, tradeoff,
};
use osl_numeric::Arithmetic;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::time::Duration;

/// A trade-off with made-up times that do not depend on the machine.
fn made_up() -> Trade {
    let row = |variant: &str, setting: &str, ns: f64, evaluations: f64| Row {
        variant: variant.into(),
        setting: setting.into(),
        options: format!("--{}", setting.replace(' ', "-")),
        ns_per_pixel: ns,
        ns_least: 0.96 * ns,
        spread: 0.04,
        speed_up: 50.0 / ns,
        evaluations,
    };
    let error = |rms: f64| Error { rms, nearly_all: 4.0 * rms, largest: 9.0 * rms };
    let picture = || Picture { width: 2, values: vec![0.0, 1e-3, 0.1, 2.0] };
    Trade {
        name: "edges<1>".into(),
        size: (64, 32),
        oracle: "strict".into(),
        oracle_samples: 1024,
        repeats: 5,
        rows: vec![
            row("strict", "rate 4x4", 9.0, 0.0625),
            row("strict", "1 sample", 50.0, 1.0),
            row("strict", "16 samples", 800.0, 16.0),
            row("prefilter", "1 sample", 70.0, 1.0),
        ],
        outputs: vec![Output {
            name: "result".into(),
            range: 0.8,
            oracle_error: 2.1e-4,
            errors: vec![error(0.2), error(0.05), error(0.004), error(0.06)],
            front: vec![0, 1, 2],
            pictures: vec![picture(), picture(), picture()],
        }],
        idle: vec!["`--arithmetic fast` changes nothing here".into()],
    }
}

#[test]
fn the_table() {
    insta::assert_snapshot!("table", text(&made_up()));
}

#[test]
fn the_values() {
    insta::assert_snapshot!("values", csv(&made_up()));
}

#[test]
fn the_page_needs_nothing_else() {
    let page = html(&made_up(), &|width, height, planes| {
        assert_eq!((width, height, planes.len()), (2, 2, 3));
        Some(format!("data:,{:?}", planes[0]))
    });
    assert!(!page.contains("://") && !page.contains("<script"));
    assert!(page.contains("edges&lt;1&gt;"));
    insta::assert_snapshot!("page", page.replace("><", ">\n<"));
}

#[test]
fn a_measured_trade_makes_sense() {
    let grid = Grid::new(48, 48);
    let source = "shader s(output float r = 0, output color c = 0) {
        r = step(0.437, u + 0.3 * v);
        c = color(sin(6 * u), v, r);
    }";
    let checked = stages::check("test.osl", source, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
    let varying = grid.varying().to_vec();
    let options = passes::Options { varying, derivs: Vec::new(), ..passes::Options::default() };
    let program = stages::finish(body, &options).program;
    let (services, options) = (Services::default(), RunOptions::default());
    let shading = Shading {
        program: &program,
        services: &services,
        surface: &grid,
        options: &options,
        cheaper: None,
        pattern: pattern(),
        filter: Filter::default(),
    };
    let settings = [1, 4, 16].map(Setting::Samples).to_vec();
    let trade = tradeoff(&Request {
        name: "s".into(),
        variants: vec![Variant { name: "strict".into(), shading: shading.clone(), settings }],
        oracle: ("strict".into(), shading),
        // Ends much earlier, except on a busy machine.
        budget: Duration::from_secs(8),
        idle: Vec::new(),
    })
    .unwrap();
    assert_eq!(trade.outputs.iter().map(|o| &*o.name).collect::<Vec<_>>(), ["r", "c"]);
    assert_eq!(trade.rows.iter().map(|r| r.evaluations).collect::<Vec<_>>(), [1.0, 4.0, 16.0]);
    for output in &trade.outputs {
        let errors: Vec<f64> = output.errors.iter().map(|e| e.rms).collect();
        assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
        assert!(output.errors.iter().all(|e| e.rms <= e.largest && e.nearly_all <= e.largest));
        assert_eq!(output.pictures.len(), output.front.len());
        assert!(output.oracle_error < 0.1 * errors[0]);
    }
}

#[test]
fn the_oracle_is_strict_where_that_agrees_with_double_precision() {
    let grid = Grid::new(32, 32);
    let options = RunOptions::default();
    let services = Services::default();
    // Of the second angle, single precision keeps no digit after the point.
    for (of, wanted) in [("9", "strict"), ("1e8", "f64")] {
        let source = format!("shader s(output float r = 0) {{ r = sin({of} * (u + 0.3 * v)); }}");
        let checked = stages::check("test.osl", &source, &NoFiles, &Options::default());
        let body = stages::lower(&checked.program.expect("no errors"), &[]).expect("lowers");
        let form = |arithmetic| {
            let passes = passes::Options {
                varying: grid.varying().to_vec(),
                arithmetic,
                ..passes::Options::default()
            };
            stages::finish(body.clone(), &passes).program
        };
        let programs = [Arithmetic::Strict, Arithmetic::Double].map(form);
        let [strict, double] = programs.each_ref().map(|program| Shading {
            program,
            services: &services,
            surface: &grid,
            options: &options,
            cheaper: None,
            pattern: pattern(),
            filter: Filter::default(),
        });
        let variants =
            vec![Variant { name: "strict".into(), shading: strict, settings: vec![Setting::Samples(1)] }];
        let request = Request {
            name: "s".into(),
            variants,
            oracle: ("f64".into(), double),
            budget: Duration::from_millis(100),
            idle: Vec::new(),
        };
        assert_eq!(tradeoff(&request).unwrap().oracle, wanted, "{source}");
    }
}
