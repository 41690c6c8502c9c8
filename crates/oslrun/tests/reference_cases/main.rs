//! Recorded cases of the reference's tools: `tests/data/suite` contains command lines with everything that
//! they print and write, and `tests/data/corpus` contains shaders with their values and printed text. Each
//! case checks one rule; other tests check cases to which the rule does not apply. These modules know the
//! recordings, but not how oslrun works.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

mod corpus;
mod exceptions;
mod picture;
mod suite;

use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// The program under test.
const OSLRUN: &str = env!("CARGO_BIN_EXE_oslrun");

/// A folder below `tests/data`.
fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data").join(name)
}

/// Runs the check on all cases in parallel, and fails with the list of cases that differ. An exception that
/// no longer differs is a failure too, so that the list stays correct.
fn hold(cases: &[String], check: impl Fn(&str) -> Vec<String> + Sync) {
    let only = std::env::var("CASE").ok();
    let chosen = cases.iter().filter(|case| only.as_ref().is_none_or(|only| case.contains(only.as_str())));
    let outcomes: Vec<(&String, Vec<String>)> =
        chosen.collect::<Vec<_>>().into_par_iter().map(|case| (case, check(case))).collect();
    assert!(!outcomes.is_empty(), "no cases");
    let mut wrong = Vec::new();
    for (case, differences) in outcomes {
        match (exceptions::reason(case), differences.is_empty()) {
            (None, true) => {}
            (None, false) => wrong.push(format!("{case}:\n    {}", differences.join("\n    "))),
            (Some(_), true) => wrong.push(format!("{case} agrees: take it off the list of exceptions")),
            (Some(reason), false) => println!("{case} differs: {reason}"),
        }
    }
    assert!(wrong.is_empty(), "{} of {} cases:\n{}", wrong.len(), cases.len(), wrong.join("\n"));
}

/// The names of the files or folders in a folder, in order.
fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn tools_print_and_write_what_the_reference_does() {
    let tools = suite::Tools::linked();
    hold(&names_in(&data("suite")), |case| suite::check(&tools, case));
}

#[test]
fn shaders_have_the_values_and_text_of_the_reference() {
    hold(&corpus::cases(), corpus::check);
}
