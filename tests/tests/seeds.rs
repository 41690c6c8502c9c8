//! Compares the seed shaders with recorded reference results: every value must be within 1e-5, absolute or
//! relative, on at least 99.9 % of the points of every output.
//!
//! The remaining points are at edges: `d <= radius`, `r < Radius` and cell borders depend on the last bit of
//! a distance. The counts for each file below limit them.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_exec::RunOptions;
use osl_tests::golden::{Golden, compare};
use osl_tests::run;
use std::path::{Path, PathBuf};

fn recorded(prefix: &str) -> Vec<PathBuf> {
    let folder = run::root().join("tests/data/seeds");
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.retain(|p| {
        let name = p.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with(prefix) && name.ends_with(".csv.gz")
    });
    files.sort();
    files
}

/// Runs the published shader, with its quirks, for one recorded run and compares every column.
fn check(shader: &str, text: &str, path: &Path, tolerance: f32) -> Vec<String> {
    let name = path.file_name().unwrap().to_string_lossy().into_owned();
    let golden = Golden::load(path).unwrap();
    let frame = run::like(shader, text, &golden, &RunOptions::default()).unwrap().0;
    let columns = run::columns(&frame);
    let mut failures = Vec::new();
    for (column, expected) in golden.columns.iter().skip(2) {
        let (_, got) =
            columns.iter().find(|(n, _)| n == column).unwrap_or_else(|| panic!("{name}: no {column}"));
        let c = compare(expected, got, tolerance);
        println!(
            "{name} {column}: {} of {} exact, {} within, worst {:e}",
            c.exact, c.total, c.within, c.worst.0
        );
        if c.total != expected.len() || c.within * 1000 < c.total * 999 {
            failures.push(format!("{name} {column}: {c:?}"));
        }
    }
    failures
}

fn check_all(shader: &str, text: &str, prefix: &str, count: usize) {
    let files = recorded(prefix);
    assert_eq!(files.len(), count);
    let failures: Vec<String> = files.iter().flat_map(|p| check(shader, text, p, 1e-5)).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

fn published(name: &str) -> String {
    std::fs::read_to_string(run::root().join("osl").join(name)).unwrap()
}

#[test]
fn cobbled_as_published() {
    check_all("Cobbled", &published("Cobbled.osl"), "Cobbled.", 10);
}

#[test]
fn flakes_as_published() {
    check_all("flakes", &published("flakes.osl"), "flakes.", 8);
}

#[test]
fn sprinkles_as_repaired() {
    let text = published("sprinkles.osl");
    let repaired = osl_syntax::repair::repair(
        "sprinkles.osl",
        &text,
        &osl_syntax::NoFiles,
        &osl_syntax::Options::default(),
    )
    .unwrap();
    check_all("sprinkles", &repaired.text, "sprinkles.", 12);
}

#[test]
fn chaosmosaic_as_published() {
    check_all("chaosmosaic", &published("chaosmosaic.osl"), "chaosmosaic.", 8);
}
