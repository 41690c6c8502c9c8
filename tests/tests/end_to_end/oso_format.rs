//! Compiled shaders run elsewhere: what is written here follows the rules that the run times of renderers
//! have, whatever the values of parameters, and computes the values of the reference.

use super::oso::{data, files};
use osl_exec::RunOptions;
use osl_hir::hir::{Expr, ExprKind, Init, Program};
use osl_hir::oso;
use osl_ir::types::Type;
use osl_syntax::source::SourceMap;
use osl_tests::golden::Golden;
use osl_tests::run;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Sources that no compiler can turn into a valid file: they call an operation of one renderer, or give a
/// texture lookup options that do not exist.
const OWN_MISTAKES: [&str; 3] =
    ["builtin_float.osl", "texture_option_wrong_type.osl", "texture_unknown_option.osl"];

/// A function of the language specification that published compilers write and no run time has.
const WITHOUT_RUN_TIME: &str = "transformu";

fn violations(text: &str) -> Vec<String> {
    let show = |v: oso::Violation| {
        let line = text.lines().nth(v.line as usize - 1).unwrap_or_default();
        format!("{}: {} `{}`: {}\n    {line}", v.line, v.rule.name(), v.subject, v.message)
    };
    let found = oso::check(text, &Default::default()).into_iter();
    found.filter(|v| v.subject != WITHOUT_RUN_TIME).map(show).collect()
}

fn compiled(name: &str, text: &str) -> Option<(Program, SourceMap)> {
    let checked = osl::stages::check(name, text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    Some((checked.program?, checked.sources))
}

/// The violations in the compiled form of a source; `None` if it is not accepted or too large. The form must
/// be the same with other defaults of the parameters.
fn written(name: &str, text: &str) -> Option<Vec<String>> {
    let (mut program, sources) = compiled(name, text)?;
    let write = |program: &Program| oso::write(program, &sources, &Default::default()).ok();
    let first = write(&program)?;
    let mut found = violations(&first);
    for param in &mut program.shader.params {
        change(&mut param.init);
    }
    let second = write(&program)?;
    found.extend(violations(&second));
    let is_param = |line: &&str| line.starts_with("param") || line.starts_with("oparam");
    let code =
        |text: &str| text.lines().filter(|line| !is_param(line)).map(str::to_string).collect::<Vec<_>>();
    if code(&first) != code(&second) {
        found.push("the operations depend on the defaults of parameters".to_string());
    }
    Some(found)
}

/// Changes the constants of a default.
fn change(init: &mut Init) {
    match init {
        Init::Value(e) if init_is_constant(e) => change_value(e),
        Init::Value(_) => {}
        Init::List(items) if items.iter().all(Init::is_constant) => items.iter_mut().for_each(change),
        Init::List(_) => {}
    }
}

fn init_is_constant(e: &Expr) -> bool {
    Init::Value(e.clone()).is_constant()
}

fn change_value(e: &mut Expr) {
    match &mut e.kind {
        ExprKind::Int(n) => *n = n.wrapping_add(3),
        ExprKind::Float(x) => *x = if *x == 0.25 { 1.5 } else { 0.25 },
        ExprKind::Str(text) => *text = if &**text == "gabor" { "cell" } else { "gabor" }.into(),
        ExprKind::Triple(parts) => parts.iter_mut().for_each(change_value),
        ExprKind::Matrix(cells) => cells.iter_mut().for_each(change_value),
        // Code computes an int from a float.
        ExprKind::Convert(inner) if e.ty != Type::INT => change_value(inner),
        ExprKind::Struct(fields) => fields.iter_mut().for_each(change),
        _ => {}
    }
}

#[test]
fn recorded_files_follow_the_format() {
    for file in files(&data("oso"), "oso") {
        let found = violations(&std::fs::read_to_string(&file).unwrap());
        assert!(found.is_empty(), "{}: {}", file.display(), found.join("\n"));
    }
    let broken = data("suite").join("testshade_missing_shader/broken.oso");
    let found = violations(&std::fs::read_to_string(broken).unwrap());
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("`frobnicate`: no run time has this operation"), "{found:?}");
}

#[test]
fn what_is_written_follows_the_format() {
    let folders = ["osl", "tests/data", "docs", "examples", "crates"];
    let sources: Vec<_> = folders.iter().flat_map(|folder| files(&run::root().join(folder), "osl")).collect();
    let check = |source: &PathBuf| {
        let name = source.file_name().unwrap().to_string_lossy().into_owned();
        let text = String::from_utf8_lossy(&std::fs::read(source).unwrap()).into_owned();
        let found = written(&name, &text)?;
        Some(if OWN_MISTAKES.contains(&&*name) == found.is_empty() {
            vec![format!("{}:\n  {}", source.display(), found.join("\n  "))]
        } else {
            Vec::new()
        })
    };
    let outcomes: Vec<_> = sources.par_iter().filter_map(check).collect();
    let accepted = outcomes.len();
    let bad: Vec<String> = outcomes.into_iter().flatten().collect();
    println!("{accepted} sources accepted of {}", sources.len());
    assert!(bad.is_empty(), "{} of {accepted}:\n{}", bad.len(), bad.join("\n"));
    assert!(accepted > 900, "{accepted}");
}

#[test]
fn examples_of_functions_follow_the_format() {
    for row in osl_hir::builtins::all() {
        let text = format!("surface example(output float result = 0) {{\n{}\n}}\n", row.example);
        let found = written("example.osl", &text).unwrap_or_default();
        assert!(found.is_empty(), "{}: {}", row.name, found.join("\n"));
    }
}

fn generated(seeds: std::ops::Range<u64>) {
    let check = |seed: u64| {
        let bytes = osl_tests::generate::noise_bytes(seed, 200 + (seed % 7) as usize * 100);
        let text = osl_tests::generate::program(&bytes);
        let found = written("generated.osl", &text)?;
        (!found.is_empty()).then(|| format!("{seed}: {}\n{text}", found.join("\n")))
    };
    let bad: Vec<String> = seeds.into_par_iter().filter_map(check).collect();
    let short: Vec<&str> = bad.iter().filter_map(|text| text.lines().next()).collect();
    assert!(bad.is_empty(), "{}:\n{}\n{}", bad.len(), short.join("\n"), bad[0]);
}

#[test]
fn generated_programs_follow_the_format() {
    generated(0..400);
}

/// `cargo test -p osl-tests --test end_to_end oso_format -- --ignored`
#[test]
#[ignore = "takes minutes"]
fn very_many_generated_programs_follow_the_format() {
    generated(1_000_000..1_100_000);
}

/// The recorded values of each case: by point and output.
fn recorded() -> BTreeMap<String, Vec<(usize, String, Vec<f32>)>> {
    let text = std::fs::read_to_string(data("oso_forms").join("expected.csv")).unwrap();
    let mut cases: BTreeMap<String, Vec<_>> = BTreeMap::new();
    for line in text.lines().skip(1) {
        let [case, x, y, output, values] = line.splitn(5, ',').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let list = cases.entry(case.to_string()).or_default();
        let (Ok(x), Ok(y)) = (x.parse::<usize>(), y.parse::<usize>()) else { continue };
        let values = values.split_whitespace().map(|v| v.parse().unwrap()).collect();
        list.push((y * 4 + x, output.to_string(), values));
    }
    cases
}

/// The recorded text of each case, line by line.
fn printed() -> BTreeMap<String, Vec<String>> {
    let text = std::fs::read_to_string(data("oso_forms").join("expected_text.tsv")).unwrap();
    let mut cases: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (case, line) in text.lines().filter_map(|line| line.split_once('\t')) {
        if !line.starts_with("STDERR") {
            cases.entry(case.to_string()).or_default().push(line.to_string());
        }
    }
    cases
}

/// Runs a shader; returns how its values and its text differ from the recorded ones.
fn differences(
    name: &str,
    text: &str,
    expected: &[(usize, String, Vec<f32>)],
    lines: Option<&Vec<String>>,
) -> Vec<String> {
    let golden = Golden { size: (4, 4), scale: [1.0; 2], center: true, ..Golden::default() };
    let frame = match run::like(name, text, &golden, &RunOptions::default()) {
        Ok((frame, _)) => frame,
        Err(e) => return vec![e],
    };
    let mut found = Vec::new();
    let near =
        |e: f32, g: f32| e == g || (e.is_nan() && g.is_nan()) || (e - g).abs() <= 2e-5 * e.abs().max(1.0);
    for (point, output, values) in expected {
        let planes = frame.planes.iter().filter(|plane| plane.output.split('[').next() == Some(output));
        let got: Vec<f32> = planes.map(|plane| plane.floats()[*point]).collect();
        if got.len() != values.len() || !values.iter().zip(&got).all(|(e, g)| near(*e, *g)) {
            found.push(format!("{output} at {point}: {got:?} for {values:?}"));
        }
    }
    let got: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
    let got: Vec<&str> = got.lines().collect();
    if lines.is_some_and(|lines| *lines != got) {
        found.push(format!("{got:?} for {lines:?}"));
    }
    found
}

/// Cases that differ from the reference, with the cause.
const DIFFERENT: [(&str, &str); 3] = [
    ("closure_keywords", "the recorded text lacks keywords that the reference's renderer does not register"),
    ("element_increment", "`++` changes an element here; the reference changes a copy of it"),
    ("isnan_family", "the reference folds x - x to 0 also where x is infinite"),
];

#[test]
fn forms_of_operations_run_as_recorded() {
    let (values, texts) = (recorded(), printed());
    let mut bad = Vec::new();
    for source in files(&data("oso_forms"), "osl") {
        let case = source.file_stem().unwrap().to_string_lossy().into_owned();
        let name = format!("{case}.osl");
        let text = std::fs::read_to_string(&source).unwrap();
        let (program, sources) = compiled(&name, &text).unwrap();
        let oso = oso::write(&program, &sources, &Default::default()).unwrap();
        let expected = values.get(&case).map_or(&[][..], Vec::as_slice);
        let lines = texts.get(&case);
        let mut found = violations(&oso);
        found.extend(differences(&name, &text, expected, lines));
        found.extend(
            differences(&format!("{case}.oso"), &oso, expected, lines)
                .into_iter()
                .map(|d| format!("as .oso: {d}")),
        );
        if DIFFERENT.iter().any(|(name, _)| *name == case) == found.is_empty() {
            bad.push(format!("{case}: {}", found.first().map_or("nothing differs", String::as_str)));
        }
    }
    assert!(bad.is_empty(), "{}:\n{}", bad.len(), bad.join("\n"));
}
