//! Compares diagnostics of small sources with the reference compiler: which sources it rejects and on what
//! line, which it accepts with a warning, and which without a message.
//!
//! Under strict syntax the same files are rejected, on the same line. By default, sources with one obvious
//! meaning run.

use osl::stages;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::{NoFiles, Options, Reports};
use osl_tests::run;

/// A source, with the line of the reference's message, if any.
struct Case {
    name: String,
    text: String,
    line: Option<u32>,
}

fn cases(folder: &str, count: usize) -> Vec<Case> {
    let folder = run::root().join("tests/data").join(folder);
    let mut cases: Vec<Case> = std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "osl"))
        .map(|path| Case {
            name: path.file_stem().unwrap().to_string_lossy().into_owned(),
            text: String::from_utf8(std::fs::read(&path).unwrap()).unwrap(),
            line: line(&std::fs::read_to_string(path.with_extension("json")).unwrap()),
        })
        .collect();
    cases.sort_by(|a, b| a.name.cmp(&b.name));
    assert_eq!(cases.len(), count);
    cases
}

/// The number after `"line":`.
fn line(json: &str) -> Option<u32> {
    let (_, rest) = json.split_once("\"line\":")?;
    rest.trim_start().split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// The diagnostics of a source, each with its line, up to and including lowering.
fn said(case: &Case, strict: bool) -> Vec<(u32, Diagnostic)> {
    let options = Options { strict, ..Options::default() };
    let checked = stages::check(&format!("{}.osl", case.name), &case.text, &NoFiles, &options);
    let mut list = checked.diagnostics.clone();
    if let Some(program) = &checked.program {
        list.extend(osl_lower::lower(program, &Default::default()).err().unwrap_or_default());
    }
    let place = |d: &Diagnostic| checked.sources.place(d.span).map_or(0, |p| p.line);
    list.into_iter().map(|d| (place(&d), d)).collect()
}

/// The same under strict syntax, with every lint.
fn said_and_linted(case: &Case) -> Vec<(u32, Diagnostic)> {
    let options = Options { strict: true, ..Options::default() };
    let checked = stages::check(&format!("{}.osl", case.name), &case.text, &NoFiles, &options);
    let lints = stages::lint(&checked, &osl_hir::lint::Options::default());
    let place = |d: &Diagnostic| checked.sources.place(d.span).map_or(0, |p| p.line);
    said(case, true).into_iter().chain(lints.into_iter().map(|d| (place(&d), d))).collect()
}

fn errors(case: &Case, strict: bool) -> Vec<(u32, Diagnostic)> {
    said(case, strict).into_iter().filter(|(_, d)| d.is_error()).collect()
}

fn shown(list: &[(u32, Diagnostic)]) -> String {
    list.iter().map(|(line, d)| format!("{line}: {} {}", d.code.id, d.message)).collect::<Vec<_>>().join("; ")
}

/// Cases whose error has another line than in the reference, with our line and why it is better.
const ELSEWHERE: &[(&str, u32, &str)] = &[
    ("missing_brace", 2, "the block that is never closed, not the end of the file"),
    ("output_arg_const_param", 3, "the call passes what cannot be written, not the function that writes"),
    ("output_arg_literal", 3, "the call passes what cannot be written, not the function that writes"),
    ("two_shaders", 4, "where the second shader begins, not where it ends"),
];

/// Mistakes that run by default, each with a warning, since they have only one possible meaning.
const RUN_BY_DEFAULT: &[&str] =
    &["macro_redefined", "trailing_comma_call", "trailing_comma_init", "warning_directive"];

#[test]
fn strict_syntax_refuses_what_the_reference_refuses_on_its_line() {
    let mut wrong = Vec::new();
    for case in cases("reject", 135) {
        let found = errors(&case, true);
        let elsewhere = ELSEWHERE.iter().find(|(name, ..)| *name == case.name);
        let wanted = elsewhere.map(|(_, line, _)| *line).or(case.line);
        let near = |line: u32| match (elsewhere, wanted) {
            (Some(_), Some(wanted)) => line == wanted,
            (None, Some(wanted)) => line.abs_diff(wanted) <= 1,
            (_, None) => true,
        };
        if !found.first().is_some_and(|(line, _)| near(*line)) {
            wrong.push(format!("{}: line {wanted:?}, not [{}]", case.name, shown(&found)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn by_default_only_what_has_no_meaning_is_refused() {
    let ran: Vec<String> = cases("reject", 135)
        .iter()
        .filter(|case| errors(case, false).is_empty())
        .inspect(|case| assert!(!said(case, false).is_empty(), "{}: runs without a word", case.name))
        .map(|case| case.name.clone())
        .collect();
    assert_eq!(ran, RUN_BY_DEFAULT);
}

#[test]
fn what_the_reference_takes_with_a_warning_has_one_on_its_line() {
    let mut wrong = Vec::new();
    for case in cases("accept_with_warning", 11) {
        for strict in [false, true] {
            let found = said(&case, strict);
            let warned = found.iter().any(|(line, d)| !d.is_error() && Some(*line) == case.line);
            if !warned || found.iter().any(|(_, d)| d.is_error()) {
                wrong.push(format!("{}: line {:?}, not [{}]", case.name, case.line, shown(&found)));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Sources that the reference accepts silently, but that are hardly intended: they compile, with a warning or
/// a lint of `check` of this code.
const DOUBTFUL: &[(&str, &str)] = &[
    ("array_init_wrong_type", "W0210"),
    ("assignment_in_condition", "W0309"),
    ("const_component_out_of_range", "W0213"),
    ("const_index_out_of_range", "W0213"),
    ("const_int_div_zero", "W0214"),
    ("empty_param_list", "W0301"),
    ("if_matrix", "W0308"),
    ("if_string", "W0308"),
    ("increment_string", "W0211"),
    ("output_arg_expr", "W0207"),
    ("output_arg_expr", "W0322"),
    ("shadow_local", "W0313"),
    ("some_paths_no_return", "W0317"),
    ("statement_after_return", "W0306"),
    ("struct_self_field", "W0212"),
    ("surface_assign_Ci_in_shader", "W0322"),
    ("texture_option_wrong_type", "W0209"),
    ("triple_chain_compare", "W0320"),
    ("texture_unknown_option", "W0209"),
    ("uninitialised_use", "W0304"),
    ("unused_variable", "W0301"),
    ("unused_variable", "W0301"),
    ("unused_variable", "W0301"),
    ("void_variable", "W0301"),
];

#[test]
fn what_the_reference_takes_in_silence_compiles() {
    let mut wrong = Vec::new();
    for case in cases("accept_silently", 58) {
        let found = said_and_linted(&case);
        let codes: Vec<&str> = found.iter().map(|(_, d)| d.code.id).collect();
        let wanted: Vec<&str> =
            DOUBTFUL.iter().filter(|(name, _)| *name == case.name).map(|(_, code)| *code).collect();
        if codes != wanted || found.iter().any(|(_, d)| d.is_error()) {
            wrong.push(format!("{}: {wanted:?}, not [{}]", case.name, shown(&found)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// What the lines of `one_line_errors.txt` can use.
const DECLARED: &str = "struct pair { float a; color b; };
struct deep { pair p; float q[3]; };
float twice(float x) { return 2 * x; }
void nothing(float x) { }
color tint(color c, output float w) { w = 1; return c; }
shader t(float fixed = 0, color whole = 1, output float f = 1, output int n = 2, output color c = 0,
    output float r = 0, output color o = 0) {
    float a[3] = {1, 2, 3}; pair p = {1, 2}; deep d; matrix m = 1; string s = \"x\"; point q = P;
    closure color k = emission(); float w = 0;
";

#[test]
fn a_mistake_is_told_once_or_as_often_as_its_type_is_used() {
    let path = run::root().join("tests/data/one_line_errors.txt");
    let (mut wrong, mut count) = (Vec::new(), 0);
    for line in std::fs::read_to_string(path).unwrap().lines().filter(|line| !line.starts_with('#')) {
        let (number, code) = line.split_once(' ').unwrap();
        let text = format!("{DECLARED}{code}\n}}\n");
        let wanted = [(Reports::Once, 1), (Reports::AsReference, number.parse().unwrap())];
        for (reports, wanted) in wanted {
            let options = Options { reports, ..Options::default() };
            let found = stages::check("line.osl", &text, &NoFiles, &options).diagnostics;
            let found: Vec<&str> =
                found.iter().filter(|d| d.is_error()).map(|d| d.message.as_str()).collect();
            if found.len() != wanted {
                wrong.push(format!("{code}: {wanted} {reports:?}: {found:#?}"));
            }
        }
        count += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(count, 175);
}
