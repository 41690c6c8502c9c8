//! Compiled shaders: those that the reference wrote run like their sources, and what is written here comes back.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_exec::RunOptions;
use osl_ir::ir::Kind;
use osl_tests::golden::{Golden, compare, ulps};
use osl_tests::run;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The files below a folder with an extension, in order.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            found.extend(files(&entry, extension));
        } else if entry.extension().is_some_and(|e| e == extension) {
            found.push(entry);
        }
    }
    found.sort();
    found
}

fn data(folder: &str) -> PathBuf {
    run::root().join("tests/data").join(folder)
}

/// Whether a value is as near as it has to be: the rule of the tests of the sources.
fn near(expected: f32, got: f32) -> bool {
    expected == got
        || (expected.is_nan() && got.is_nan())
        || (expected - got).abs() <= 1e-6
        || ulps(expected, got) <= 2
}

/// Runs a compiled shader of the reference for a recorded run of its source; what differs.
fn recorded(oso: &Path, csv: &Path, seed: bool) -> Vec<String> {
    let name = oso.file_name().unwrap().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(oso).unwrap();
    let mut golden = Golden::load(csv).unwrap();
    let frame = match run::like(&name, &text, &golden, &RunOptions::default()) {
        Ok((frame, _)) => frame,
        Err(e) => return vec![e],
    };
    let is_int = |output: &str| {
        let of = |p: &osl_exec::Plane| p.output.split('[').next() == Some(output) && p.kind == Kind::Int;
        frame.planes.iter().any(of)
    };
    if !seed {
        golden.untangle(is_int);
    }
    let unopt = csv.with_extension("").with_extension("unopt.csv");
    let mut other = Golden::load(&unopt).unwrap_or_default();
    other.untangle(is_int);
    let columns = run::columns(&frame);
    let mut wrong = Vec::new();
    for (column, expected) in golden.columns.iter().skip(2) {
        let Some((_, got)) = columns.iter().find(|(n, _)| n == column) else {
            wrong.push(format!("no column {column}"));
            continue;
        };
        if seed {
            let c = compare(expected, got, 1e-5);
            if c.total != expected.len() || c.within * 1000 < c.total * 999 {
                wrong.push(format!("{column}: {c:?}"));
            }
            continue;
        }
        let second = other.columns.iter().find(|(n, _)| n == column).map(|(_, v)| v);
        let fits = |e: &Vec<f32>| e.iter().zip(got).all(|(e, g)| near(*e, *g));
        if !fits(expected) && !second.is_some_and(fits) {
            let first = expected.iter().zip(got).enumerate().find(|(_, (e, g))| !near(**e, **g));
            wrong.push(format!("{column}: {first:?}"));
        }
    }
    wrong
}

/// The recorded runs of the source of a sample.
fn runs_of(sample: &Path) -> (Vec<PathBuf>, bool) {
    let stem = sample.file_stem().unwrap().to_string_lossy().into_owned();
    let (area, case) = stem.split_once("__").unwrap();
    if area == "seeds" {
        let prefix = format!("{}.", case.trim_end_matches(".repaired"));
        let mut all = files(&data("seeds"), "gz");
        all.retain(|p| p.file_name().unwrap().to_string_lossy().starts_with(&prefix));
        return (all, true);
    }
    let csv = data("values").join(area).join(format!("{case}.csv"));
    (vec![if csv.exists() { csv } else { csv.with_extension("csv.gz") }], false)
}

#[test]
fn samples_of_the_reference_run_as_recorded() {
    let samples = files(&data("oso"), "oso");
    assert_eq!(samples.len(), 83);
    let check = |sample: &PathBuf| {
        let (runs, seed) = runs_of(sample);
        assert!(!runs.is_empty(), "{}", sample.display());
        runs.iter().flat_map(|csv| recorded(sample, csv, seed)).collect::<Vec<String>>()
    };
    let outcomes: Vec<Vec<String>> = samples.par_iter().map(check).collect();
    let bad: Vec<String> = samples
        .iter()
        .zip(&outcomes)
        .filter(|(_, wrong)| !wrong.is_empty())
        .map(|(sample, wrong)| format!("{}: {}", sample.file_stem().unwrap().display(), wrong.join("\n  ")))
        .collect();
    assert!(bad.is_empty(), "{} of {}:\n{}", bad.len(), samples.len(), bad.join("\n"));
}

/// Everything that a run yields, as text: bits of all planes, closures, printed text, messages.
fn outcome(frame: &osl_exec::Frame, sources: &osl_syntax::source::SourceMap) -> Vec<(String, String)> {
    let place = |span| sources.place(span).map_or_else(String::new, |p| format!("{}:{}", p.file, p.line));
    let mut all = Vec::new();
    for (name, values) in run::columns(frame) {
        let bits: Vec<u32> = values.iter().map(|x| x.to_bits()).collect();
        all.push((name, format!("{bits:x?}")));
    }
    let printed: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    all.push(("printed".to_string(), printed));
    all.push(("messages".to_string(), format!("{:#?}", frame.said(place))));
    all.push(("closures".to_string(), format!("{:?}", frame.closures)));
    all
}

/// Compiles a source to text and runs both; what differs. `None` if the source is not accepted.
fn round_trip(source: &Path) -> Option<Vec<String>> {
    let name = source.file_name().unwrap().to_string_lossy().into_owned();
    let text = std::fs::read_to_string(source).unwrap();
    let checked =
        oslrun::pipeline::check(&name, &text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    let program = checked.program?;
    let written = match osl_ir::oso::write(&program, &checked.sources) {
        Ok(written) => written,
        Err(list) => return Some(vec![format!("{list:?}")]),
    };
    let mut golden = Golden::conditions(&text);
    golden.size = (golden.size.0.max(7), golden.size.1.max(5));
    let options = RunOptions { closures: true, ..RunOptions::default() };
    let expected = match run::like(&name, &text, &golden, &options) {
        Ok((frame, sources)) => outcome(&frame, &sources),
        // It does not fit, or does not end: neither does what it becomes.
        Err(why) => vec![("error".to_string(), why)],
    };
    let got = match run::like(&format!("{name}.oso"), &written, &golden, &options) {
        Ok((frame, sources)) => outcome(&frame, &sources),
        Err(why) if expected[0].0 == "error" => {
            vec![("error".to_string(), if why.is_empty() { why } else { expected[0].1.clone() })]
        }
        Err(why) => return Some(vec![format!("{why}\n{written}")]),
    };
    let names = |list: &[(String, String)]| list.iter().map(|(n, _)| n.clone()).collect::<Vec<_>>();
    if names(&expected) != names(&got) {
        return Some(vec![format!("{:?} for {:?}", names(&got), names(&expected))]);
    }
    let short = |text: &str| text.chars().take(300).collect::<String>();
    let differ = expected.iter().zip(&got).filter(|(e, g)| e != g);
    Some(differ.map(|(e, g)| format!("{}: {} for {}", e.0, short(&g.1), short(&e.1))).collect())
}

#[test]
fn what_is_written_comes_back() {
    let mut sources = files(&run::root().join("osl"), "osl");
    sources.extend(files(&run::root().join("tests/data"), "osl"));
    let outcomes: Vec<Option<Vec<String>>> = sources.par_iter().map(|s| round_trip(s)).collect();
    let accepted = outcomes.iter().flatten().count();
    let bad: Vec<String> = sources
        .iter()
        .zip(outcomes)
        .filter_map(|(source, wrong)| Some((source, wrong?)))
        .filter(|(_, wrong)| !wrong.is_empty())
        .map(|(source, wrong)| format!("{}:\n  {}", source.display(), wrong.join("\n  ")))
        .collect();
    println!("{accepted} sources accepted of {}", sources.len());
    assert!(bad.is_empty(), "{} of {accepted}:\n{}", bad.len(), bad.join("\n"));
    assert!(accepted > 500, "{accepted}");
}
