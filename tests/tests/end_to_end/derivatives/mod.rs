//! Compares derivatives with their mathematical meaning. For every row of the table of built-ins that has
//! derivatives, and for operators and statements, `Dx` and `Dy` of a run are compared with central
//! differences of models in f64 (`measure` describes the method and the tolerance). `edges` checks the rules
//! at points without a slope, and `vectors` compares with the reference's own results, to the bit.

mod case;
mod color;
mod edges;
mod fields;
mod functions;
mod gabor;
mod geometry;
mod measure;
mod source;
mod tables;
mod vectors;

use case::Case;
use osl_hir::builtins;
use rayon::prelude::*;
use std::collections::BTreeSet;

fn cases() -> Vec<Case> {
    [
        functions::exponentials(),
        functions::numbers(),
        functions::operators(),
        geometry::vectors(),
        geometry::spaces(),
        color::colors(),
        tables::splines(),
        tables::lookups(),
        fields::fields(),
        gabor::noises(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Rows with zero derivatives, because their values come from files, texts, messages or the renderer.
const ELSEWHERE: &[&str] = &["texture3d", "environment", "stof", "setmessage", "getmessage", "surfacearea"];

#[test]
fn every_row_with_derivatives_has_a_case() {
    let cases = cases();
    let covered: BTreeSet<&str> = cases.iter().map(|case| case.row).collect();
    let smooth: BTreeSet<&str> =
        cases.iter().filter(|case| case.model.is_some()).map(|case| case.row).collect();
    let mut missing = Vec::new();
    for row in builtins::all().filter(|row| !row.derivatives.starts_with("none")) {
        let right = if row.derivatives.starts_with("zero") {
            covered.contains(row.name) != ELSEWHERE.contains(&row.name) && !smooth.contains(row.name)
        } else {
            smooth.contains(row.name)
        };
        if !right {
            missing.push(format!("{}: {}", row.name, row.derivatives));
        }
    }
    assert!(missing.is_empty(), "no case fits {missing:#?}");
    for name in ELSEWHERE {
        assert!(builtins::find(name).is_some(), "{name}");
    }
    for name in covered {
        assert!(matches!(name, "operator" | "statement") || builtins::find(name).is_some(), "{name}");
    }
}

#[test]
fn derivatives_are_the_slopes() {
    let outcomes: Vec<_> = cases().into_par_iter().map(|case| (measure::measure(&case), case)).collect();
    let mut wrong = Vec::new();
    let mut total = [0; 4];
    for (outcome, case) in &outcomes {
        let counts = [outcome.measured, outcome.kinks, outcome.unmeasured, outcome.beyond];
        total.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
        println!(
            "{:>5} {:>4} {:>4} {:>4}  {:8.1e} {:7.3}  {}",
            counts[0],
            counts[1],
            counts[2],
            counts[3],
            outcome.share,
            outcome.worst,
            case.name()
        );
        let tried = if case.model.is_none() { counts[0] } else { counts.iter().sum() };
        if counts[0] * 4 < tried * 3 || counts[0] < 130 {
            wrong.push(format!("{}: only {} of {tried} measured", case.name(), counts[0]));
        }
        if !outcome.wrong.is_empty() {
            let shown: Vec<String> = outcome.wrong.iter().take(3).cloned().collect();
            wrong.push(format!(
                "{}, {} of {}:\n  {}",
                case.name(),
                outcome.wrong.len(),
                counts[0],
                shown.join("\n  ")
            ));
        }
    }
    println!(
        "{} cases: {} measured, {} kinks, {} unmeasured, {} beyond",
        outcomes.len(),
        total[0],
        total[1],
        total[2],
        total[3]
    );
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
