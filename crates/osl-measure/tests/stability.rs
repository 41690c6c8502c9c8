//! Planted weaknesses: each of the shaders in `faults` has one, on the line that says so, and that is the
//! line to blame.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

#[path = "stability/sentences.rs"]
mod sentences;

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
    let mut examined = examine("large_offset_floor.osl", &text, &[]);
    insta::assert_snapshot!(stability::text::text(&examined.report, false));
    examined.far = Some((1000.0, examined.given.clone()));
    let html = stability::html::html(&examined, (64, 64), Some("\nRepair: `a < b`\n  - old\n"));
    assert!(html.contains("<svg") && html.contains("floor(x * 1.01)"));
    for part in [
        "<title>large_offset_floor.osl: numerical stability</title>",
        "Points are wrong that are off by more than 0.01 of the range.",
        "<h2>Repair</h2>\n<pre>Repair: `a &lt; b`\n  - old</pre>",
        "<h3>offset 1e3</h3>",
        ">offset that is added to the coordinates</text>",
    ] {
        assert!(html.contains(part), "{part}");
    }
    let unnamed = html.matches("<svg").count() - html.matches("role=\"img\" aria-label=").count();
    assert_eq!(unnamed, 0, "every picture has a name");
}

/// The page says what the text says about the time.
#[test]
fn a_page_says_what_was_not_examined() {
    let mut examined = examine("s.osl", "shader s(output float r = 0) { r = u; }", &[]);
    let page = |examined: &Examined| stability::html::html(examined, (64, 64), None);
    assert!(page(&examined).contains("<p>Nothing to blame.</p>") && !page(&examined).contains("--budget"));
    examined.report.not_examined = vec!["offset".to_string(), "some lines".to_string()];
    let (page, text) = (page(&examined), stability::text::text(&examined.report, false));
    for part in [
        "was over (--budget) before these were examined: offset, some lines",
        "before lines could be blamed.",
    ] {
        assert!(text.contains(part) && page.contains(part), "{part}: {text}");
    }
    assert!(!page.contains("Nothing to blame"));
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

/// The error is in the derivative of the search. The derivative of a jump is alike in both arithmetics.
#[test]
fn a_derivative_of_what_jumps_is_no_culprit() {
    let text = "shader s(output float r = 0, output float edge = 0)\n{\n    \
                float knots[7] = {0, 0, 0.2, 0.5, 0.7, 1, 1};\n    \
                r = Dx(splineinverse(\"bspline\", 0.1 + 0.8 * u, knots));\n    \
                edge = Dx(step(0.5, u));\n}\n";
    let report = examine("s.osl", text, &[]).report;
    assert!(report.trials[0].outcomes[0].worst > 1e-4, "{:?}", report.trials[0]);
    assert!(report.culprits.iter().all(|c| c.line != 5), "{:?}", report.culprits);
    assert!(report.noticed.iter().any(|c| (c.line, c.what.as_str()) == (5, "Dx")), "{:?}", report.noticed);
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

fn lines_of(text: &str) -> (Vec<u32>, Examined) {
    let examined = examine("s.osl", text, &[]);
    (examined.report.culprits.iter().map(|c| c.line).collect(), examined)
}

/// Both terms of the difference have the same `x`, so its rounding cancels: 1/x - 1/(x + 1) changes by
/// 2 dx / x, and the roundings of the quotients are magnified x times.
#[test]
fn a_rounding_that_both_operands_share_is_not_blamed() {
    let text = "shader s(float start = 4000, output float r = 0)\n{\n    float x = start * (1 + 2 * u);\n    \
                float near = 1 / x;\n    float far = 1 / (x + 1);\n    float d = near - far;\n    \
                r = d * start * start;\n}\n";
    let (lines, examined) = lines_of(text);
    assert_eq!(lines[0], 6, "{lines:?}");
    assert!(lines.contains(&4) && !lines.contains(&3), "{lines:?}");
    let told = stability::text::text(&examined.report, false);
    assert!(!told.contains("what line 3 rounds"), "{told}");
}

/// The errors of roundings are those of experiments: each of two lines of a loop makes a notable part of the
/// error, and the one that magnifies what the other rounds comes first.
#[test]
fn the_error_of_a_rounding_is_measured() {
    let text = "shader s(output float r = 0)\n{\n    float x = 9.5 + 0.5 * u, term = 1, sum = 1;\n    \
                for (int i = 1; i < 50; i++) {\n        term *= -x / i;\n        sum += term;\n    }\n    \
                r = sum * 200;\n}\n";
    let report = lines_of(text).1.report;
    let error = |line: u32| report.culprits.iter().find(|c| c.line == line).map_or(0.0, |c| c.error);
    let (term, sum) = (error(5), error(6));
    assert!(term > 0.003 && sum > 0.003, "{term} {sum}");
    assert_eq!(report.culprits[0].line, 6);
}

/// A function that repeats magnifies whatever it is given, so the line that forms the large argument comes
/// first. If that is in the same line, the line comes first anyway.
#[test]
fn the_line_that_forms_a_large_argument_comes_before_the_function_that_repeats() {
    for repeats in [
        "s - floor(s)",
        "mod(s, 1)",
        "fmod(s, 1)",
        "s - trunc(s)",
        "sin(s)",
        "noise(s)",
        "floor(s * 1) * 0.25 - floor(s * 0.25)",
    ] {
        let text = format!(
            "shader s(float tile = 20000, output float r = 0)\n{{\n    float s = (u + tile) * 48.3;\n    \
             float part = {repeats};\n    r = part;\n}}\n"
        );
        let (lines, examined) = lines_of(&text);
        let told = stability::text::text(&examined.report, false);
        assert_eq!(lines.first(), Some(&3), "{told}");
    }
    let text = "shader s(float tile = 20000, output float r = 0)\n{\n    float s = u + tile;\n    \
                float d = s - tile;\n    r = d;\n}\n";
    assert_eq!(lines_of(text).0, [4, 3]);
}

/// Chaos, Rump's polynomial and Muller's recurrence need more digits than double precision has; iterations
/// that converge do not, though their last corrections have no right digit.
#[test]
fn double_precision_is_tested() {
    let not_enough = |lines: &str| {
        let text = format!("shader s(output float r = 0)\n{{\n    float a = 1 + u;\n    {lines}\n}}\n");
        let examined = lines_of(&text).1;
        let told = stability::text::text(&examined.report, false);
        assert_eq!(
            told.contains("double precision is not enough here"),
            examined.report.not_enough.is_some()
        );
        assert!(examined.report.not_enough.is_none() || !told.contains("Nothing to blame"), "{told}");
        examined.report.not_enough.map(|found| (found.error >= 1e-4, found.place.map(|place| place.line)))
    };
    let chaos = "float x = 0.3 * a;\nfor (int i = 0; i < 80; i++) x = 3.9 * x * (1 - x);\nr = x;";
    assert_eq!(not_enough(chaos), Some((true, Some(5))));
    let rump = "float x = 77617 + 0 * u, b = 33096;\nr = 333.75 * pow(b, 6) + x * x * (11 * x * x * b * b - \
                pow(b, 6) - 121 * pow(b, 4) - 2) + 5.5 * pow(b, 8) + x / (2 * b) + u;";
    assert_eq!(not_enough(rump), Some((true, Some(5))));
    let muller = "float p = 2 + 0 * u, q = -4;\nfor (int i = 0; i < 24; i++) {\nfloat next = 111 - 1130 / q + 3000 / \
                  (p * q);\np = q;\nq = next;\n}\nr = q + u;";
    assert_eq!(not_enough(muller), Some((false, Some(6))));
    for innocent in [
        "float x = 2; for (int i = 0; i < 12; i++) x = 0.5 * (x + a / x); r = x;",
        "float p = 1, q = 2; for (int i = 0; i < 12; i++) { float f = p * p - a, g = q * q - a; float d = g - f; \
         float x = d != 0 ? q - g * (q - p) / d : q; p = q; q = x; } r = q;",
        "float z = (a * 1.1 - a) - a * 0.1; r = 1 + z / (z * z + 1e-3);",
        "r = floor(a * 8) / 8 + (a * 3 > 4.5 ? 1 : 0) + noise(P * 9) + cellnoise(u * 8, v * 8);",
    ] {
        assert_eq!(not_enough(innocent), None, "{innocent}");
    }
}

/// What follows from an infinite or vanished operand is not the fault of the later line.
#[test]
fn the_line_that_leaves_the_range_of_floats_first_is_blamed_first() {
    let body = |lines: &str| format!("shader s(output float r = 0)\n{{\n{lines}\n}}\n");
    for (lines, line, says) in [
        (
            "float x = 3e38 * (0.5 + 0.5 * u);\nfloat y = 3e38 * v;\nfloat s = x + y;\nr = s / 3e38;",
            5,
            "overflows: ",
        ),
        ("float x = 1e-22 * (1 + u);\nfloat y = x * x;\nfloat z = sqrt(y);\nr = x / z;", 4, "underflows: "),
        ("float x = 3e-22 * (1 + u);\nfloat y = x * x;\nfloat z = sqrt(y);\nr = z / x;", 4, "underflows: "),
        (
            "float a = 1e25 * (1 + u);\nfloat b = 1e-25;\nfloat q = a / b;\nr = q / 1e25 / 1e25;",
            5,
            "overflows: ",
        ),
        (
            "float a = exp(-60 * (1 + u));\nfloat b = a * exp(-50);\nfloat c = a * exp(-51);\nr = b / (b + c);",
            4,
            "underflows: ",
        ),
        (
            "vector g = vector(u + 1, 2, v) * 1e-23;\nfloat d = dot(g, g);\nr = g[0] / sqrt(d);",
            4,
            "underflows: ",
        ),
    ] {
        let examined = lines_of(&body(lines)).1;
        let told = stability::text::text(&examined.report, false);
        let Some(first) = examined.report.culprits.first() else { panic!("nothing is blamed: {told}") };
        assert_eq!(first.line, line, "{told}");
        assert!(first.why.starts_with(says), "{told}");
        assert!(!told.contains("loses digits"), "{told}");
    }
}

/// An overflow at few points is found where the errors are large.
#[test]
fn events_at_few_points_are_noticed() {
    let text = "shader s(output float r = 0)\n{\n    float x = 3.0e19 * (u - 0.5);\n    \
                float y = 3.0e19 * (v - 0.5);\n    r = sqrt(x * x + y * y) / 3.0e19;\n}\n";
    let report = lines_of(text).1.report;
    let event = report.noticed.iter().find(|c| c.what == "infinity").expect("an event");
    assert_eq!(event.line, 5);
    let says = "makes a number that is too large for a float at some of the points with the largest errors";
    assert_eq!(event.why, says);
    let text = "shader s(output float r = 0)\n{\n    float x = floor(u * 3);\n    r = v / x;\n}\n";
    let report = lines_of(text).1.report;
    assert!(report.noticed[0].why.starts_with("divides by zero at "), "{}", report.noticed[0].why);
}
