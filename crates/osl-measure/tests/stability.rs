//! Planted weaknesses: each of the shaders in `faults` has one, on the line that says so, and that is the
//! line to blame.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::Services;
use osl_limits::Limits;
use osl_measure::stability::{self, Base, Examined, Knob, Subject};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults")
}

fn examine(name: &str, text: &str, knobs: &[Knob]) -> Examined {
    let checked = stages::check(name, text, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let base = |params: &[(String, String)]| {
        let plain = stages::lower(&program, params).ok()?;
        let noted = stages::lower_noted(&program, params).ok()?;
        Some(Base::new(plain, noted, None, &Limits::default()))
    };
    let services = Services::default();
    let limits = Limits::default();
    let subject = Subject::new(&services, base(&[]).expect("it lowers"), &limits);
    let variant = |name: &str, value: &str| base(&[(name.to_string(), value.to_string())]);
    let grid = Grid::new(64, 64);
    stability::examine(&subject, &grid, 0.01, knobs, &variant, &checked.sources, name)
}

#[test]
fn the_planted_line_is_blamed_first() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for entry in std::fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let report = examine(&name, &text, &[]).report;
        count += 1;
        let lists = [&report.culprits, &report.noticed, &report.beyond];
        let first = lists.into_iter().find_map(|list| list.first());
        if !first.is_some_and(|c| c.text.contains("// planted")) {
            wrong.push(stability::text::text(&report, false));
        }
    }
    assert_eq!(count, 10);
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn a_report_reads_like_this() {
    let text = std::fs::read_to_string(folder().join("large_offset_floor.osl")).unwrap();
    let examined = examine("large_offset_floor.osl", &text, &[]);
    insta::assert_snapshot!(stability::text::text(&examined.report, false));
    let html = stability::html::html(&examined, 64, 64);
    assert!(html.contains("<svg") && html.contains("floor(x * 1.01)"));
}

#[test]
fn parameters_that_make_no_numbers_are_told() {
    let text = "shader s(float width = 0.5, output float r = 0) { r = noise(u / width) * log(width - 2 * width + 1); }";
    let values = ["0", "-0.5", "1e30", "nan", "inf"].map(str::to_string).to_vec();
    let report =
        examine("s.osl", text, &[Knob { name: "width".to_string(), values, near: Vec::new() }]).report;
    insta::assert_snapshot!(stability::text::text(&report, false));
}

/// A setting at which the points take too many steps is told as such, and as the end of the right ones.
#[test]
fn a_setting_that_stops_the_run_is_told() {
    let text = "shader s(output float r = 0) { for (float x = 0; x < u; x += 1) r += 1; }";
    let report = examine("s.osl", text, &[]).report;
    insta::assert_snapshot!(stability::text::text(&report, false));
}

#[test]
fn numeric_events_are_noticed() {
    let text = "shader s(output float r = 0)\n{\n    int n = (int)(u * 1000) * 3000000;\n    \
                float list[2] = {1, 2};\n    r = list[(int)(u * 2.5)] + n * 1e-9 + filterwidth(sqrt(u));\n}\n";
    let report = examine("s.osl", text, &[]).report;
    let noticed: Vec<(u32, &str)> = report.noticed.iter().map(|c| (c.line, c.what.as_str())).collect();
    assert_eq!(noticed, [(3, "int-overflow"), (5, "index")]);
    assert!(report.noticed[0].why.starts_with("overflows an int at "), "{}", report.noticed[0].why);
}

/// 4096 + 1/3 is rounded to a multiple of 2^-11, and the difference magnifies this 8192 times: from half a
/// unit in the last place, 2^-24, to (683 / 2048) / (1 / 3) - 1 = 2^-11.
#[test]
fn the_line_that_magnifies_names_the_line_that_rounds() {
    let text = "shader s(float third = 0.333333343, output float r = 0)\n{\n    float far = third + 4096;\n    \
                float near = far - 4096;\n    r = near * u * 2;\n}\n";
    let report = examine("s.osl", text, &[]).report;
    let [first, second] = &report.culprits[..2] else { panic!("{:?}", report.culprits) };
    assert_eq!((first.line, second.line), (4, 3));
    let partner = first.magnifies.as_ref().unwrap();
    assert_eq!((partner.line, partner.code.as_str()), (3, "third + 4096"));
    assert_eq!(first.why, "loses digits: it magnifies up to 8.2e3 times what line 3 rounds");
    assert_eq!(second.magnified_by.as_ref().map(|by| by.line), Some(4));
    assert_eq!(second.why, "rounds its result, which line 4 magnifies up to 8.2e3 times");
    insta::assert_snapshot!(stability::text::text(&report, false));
}
