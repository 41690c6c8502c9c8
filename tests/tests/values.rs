//! Compares small shaders, one for each feature, with recorded reference results:
//! `tests/data/values/AREA/CASE`. This test generates the table in `docs/conformance.md`;
//! `UPDATE_DOCS=1 cargo test -p osl-tests --test values` writes it.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_exec::{Native, RunOptions};
use osl_ir::ir::Kind;
use osl_tests::golden::{Golden, ulps};
use osl_tests::run;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Cases that differ on purpose, with the reason.
const EXCEPTIONS: &[(&str, &str)] = &[
    ("arith/incdec_elements", "the reference does not store what `a[i]++` yields; here it is stored"),
    ("arrays/int_array_histogram", "the same: `h[k]++` counts here"),
    ("struct/array_of_struct", "the reference loses `q[k].c[1] = 99`; here it is stored"),
    (
        "noise/null_names",
        "the reference does not run a shader with these names as constants; here they are fields",
    ),
    (
        "noise/unknown_name",
        "the reference does not run the shader; here the noise is 0 and the error is reported",
    ),
    ("noise/pnoise_simplex", "the same"),
    ("preproc/predefined", "the reference counts `__LINE__` from 2; here it is the line of the file"),
];

/// The result of a case.
#[derive(Default)]
struct Outcome {
    values: usize,
    exact: usize,
    /// The largest error in units in the last place, for values of at least 0.001.
    worst_ulp: u32,
    /// Largest absolute difference.
    worst: f32,
    wrong: Vec<String>,
}

/// Whether a value is near enough.
fn near(expected: f32, got: f32) -> bool {
    expected == got
        || (expected.is_nan() && got.is_nan())
        || (expected - got).abs() <= 1e-6
        || ulps(expected, got) <= 2
}

fn case(osl: &Path) -> Outcome {
    let mut outcome = Outcome::default();
    let text = std::fs::read_to_string(osl).unwrap();
    let csv = osl.with_extension("csv");
    let csv = if csv.exists() { csv } else { osl.with_extension("csv.gz") };
    let mut golden = Golden::load(&csv).unwrap();
    let mut other = Golden::load(&osl.with_extension("unopt.csv")).ok();
    let name = osl.file_stem().unwrap().to_string_lossy();
    let run = |native| {
        let options = RunOptions { native, ..RunOptions::default() };
        run::like(&name, &text, &golden, &options).map(|(frame, _)| frame)
    };
    let frame = match run(Native::Always) {
        Ok(frame) => frame,
        Err(e) => {
            outcome.wrong.push(e);
            return outcome;
        }
    };
    let interpreted = run(Native::Never).unwrap();
    if frame.planes.len() != interpreted.planes.len() {
        outcome.wrong.push("machine code has other planes than what is interpreted".to_string());
    }
    for (a, b) in frame.planes.iter().zip(&interpreted.planes) {
        if a.words != b.words {
            outcome.wrong.push(format!("{}: machine code is not what is interpreted", a.output));
        }
    }
    let is_int = |output: &str| {
        let of = |p: &osl_exec::Plane| p.output.split('[').next() == Some(output) && p.kind == Kind::Int;
        frame.planes.iter().any(of)
    };
    golden.untangle(is_int);
    if let Some(other) = &mut other {
        other.untangle(is_int);
    }
    let columns = run::columns(&frame);
    for (column, expected) in golden.columns.iter().skip(2) {
        let Some((_, got)) = columns.iter().find(|(n, _)| n == column) else {
            outcome.wrong.push(format!("no column {column}"));
            continue;
        };
        let second = other.as_ref().and_then(|o| o.columns.iter().find(|(n, _)| n == column));
        let choices: Vec<&Vec<f32>> = std::iter::once(expected).chain(second.map(|(_, v)| v)).collect();
        if expected.len() != got.len() {
            outcome.wrong.push(format!("{column}: {} values, not {}", got.len(), expected.len()));
        }
        let fits = |e: &Vec<f32>| e.iter().zip(got).all(|(e, g)| near(*e, *g));
        let chosen = choices.iter().find(|e| fits(e)).unwrap_or(&choices[0]);
        outcome.values += expected.len();
        for (at, (e, g)) in chosen.iter().zip(got).enumerate() {
            let same = e == g || (e.is_nan() && g.is_nan());
            outcome.exact += usize::from(same);
            if !same && (e - g).is_finite() {
                outcome.worst = outcome.worst.max((e - g).abs());
                if e.abs() >= 1e-3 {
                    outcome.worst_ulp = outcome.worst_ulp.max(ulps(*e, *g));
                }
            }
            if !near(*e, *g) {
                outcome.wrong.push(format!("{column} at {at}: {g} for {e}"));
            }
        }
    }
    outcome
}

fn cases() -> Vec<PathBuf> {
    let mut all = Vec::new();
    for area in std::fs::read_dir(run::root().join("tests/data/values")).unwrap() {
        for file in std::fs::read_dir(area.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            if path.extension().is_some_and(|e| e == "osl") {
                all.push(path);
            }
        }
    }
    all.sort();
    all
}

/// The part of a document between two marks, which this test generates.
fn table_in_docs(table: &str) {
    let path = run::root().join("docs/conformance.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (begin, end) = ("<!-- values: begin -->\n", "<!-- values: end -->");
    let (head, rest) = text.split_once(begin).unwrap();
    let (old, tail) = rest.split_once(end).unwrap();
    if old == table {
        return;
    }
    if std::env::var_os("UPDATE_DOCS").is_none() {
        panic!(
            "docs/conformance.md is not current; run this test with UPDATE_DOCS=1. It should have\n{table}"
        );
    }
    std::fs::write(path, format!("{head}{begin}{table}{end}{tail}")).unwrap();
}

#[test]
fn every_case_is_as_recorded() {
    let cases = cases();
    let outcomes: Vec<Outcome> = cases.par_iter().map(|c| case(c)).collect();
    let mut areas: BTreeMap<String, (usize, usize, Outcome)> = BTreeMap::new();
    let mut bad = 0;
    for (path, outcome) in cases.iter().zip(outcomes) {
        let area = path.parent().unwrap().file_name().unwrap().to_string_lossy().into_owned();
        let name = format!("{area}/{}", path.file_stem().unwrap().to_string_lossy());
        let (count, excepted, total) = areas.entry(area).or_default();
        *count += 1;
        if EXCEPTIONS.iter().any(|(n, _)| *n == name) {
            *excepted += 1;
            assert!(!outcome.wrong.is_empty(), "{name} is no exception any more");
            continue;
        }
        if !outcome.wrong.is_empty() {
            bad += 1;
            println!(
                "{name}: {} wrong, {}",
                outcome.wrong.len(),
                outcome.wrong[..outcome.wrong.len().min(3)].join("; ")
            );
        }
        total.values += outcome.values;
        total.exact += outcome.exact;
        total.worst = total.worst.max(outcome.worst);
        total.worst_ulp = total.worst_ulp.max(outcome.worst_ulp);
    }
    assert_eq!(bad, 0, "of {}", cases.len());
    let mut table = String::from(
        "| area | cases | values | equal to the bit | largest difference | in ulp, from 0.001 on | exceptions |\n|---|---|---|---|---|---|---|\n",
    );
    for (area, (count, excepted, t)) in &areas {
        let share = 100.0 * t.exact as f64 / t.values.max(1) as f64;
        table += &format!(
            "| {area} | {count} | {} | {share:.2} % | {:.1e} | {} | {excepted} |\n",
            t.values, t.worst, t.worst_ulp
        );
    }
    table += "\nExceptions:\n\n";
    for (name, why) in EXCEPTIONS {
        table += &format!("* `{name}`: {why}.\n");
    }
    table_in_docs(&table);
}
