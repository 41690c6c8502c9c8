//! What a stability report says must hold: ranges, factors, figures, and who is to blame for what.

use osl_measure::stability::{self, Culprit, Knob, Report};

fn examine(text: &str, knobs: &[Knob]) -> Report {
    super::examine("s", text, knobs).report
}

fn told(report: &Report) -> String {
    stability::text::text(report, false)
}

fn line(report: &Report, number: u32) -> &Culprit {
    let found = report.culprits.iter().find(|culprit| culprit.line == number);
    found.unwrap_or_else(|| panic!("{}", told(report)))
}

/// The powers of ten are right here, and the numbers between 20 and 50 are not.
#[test]
fn a_range_holds_between_the_powers_of_ten() {
    let text = "shader s(output float r = 0)\n{\n    float far = u + 1e7;\n    float near = far - 1e7;\n    \
                r = u > 20 && u < 50 ? near : u;\n}\n";
    let report = examine(text, &[]);
    let limit = report.findings.iter().find(|finding| finding.sweep == "offset").and_then(|f| f.limit);
    assert!(limit.is_some_and(|limit| (10.0..20.0).contains(&limit)), "{}", told(&report));
}

/// The sum before the last one magnifies too, but only six times; the last one magnifies what it rounds.
#[test]
fn the_instruction_of_a_line_that_magnifies_most_is_told() {
    let text = "shader s(output float r = 0)\n{\n    float x = 0.85 + 0.3 * u;\n    \
                float w = (((((x - 6) * x + 15) * x - 20) * x + 15) * x - 6) * x + 1;\n    r = w * 87791;\n}\n";
    let report = examine(text, &[]);
    let first = &report.culprits[0];
    assert!(first.code.ends_with("* x + 1"), "{}", told(&report));
    let worst = report.trials[0].outcomes[0].worst;
    assert!(first.error > 0.5 * worst && first.error <= worst, "{}", told(&report));
}

/// The sine reduces its argument in single precision.
#[test]
fn an_inexact_function_does_not_round() {
    let text = "shader s(float first = 20000, output float r = 0)\n{\n    float cell = floor(u * 12);\n    \
                float wave = sin((first + cell) * 127) * 4.375;\n    r = wave - floor(wave);\n}\n";
    let report = examine(text, &[]);
    let first = &report.culprits[0];
    assert_eq!(first.line, 4, "{}", told(&report));
    assert!(first.why.starts_with("is inexact, with "), "{}", first.why);
    let reduces = line(&report, 5);
    assert!(reduces.why.ends_with(" times the error of line 4"), "{}", reduces.why);
}

#[test]
fn a_factor_near_one_loses_no_digits() {
    let text = "shader s(output float r = 0)\n{\n    float k = 6 * (0.8 + 0.3 * u);\n    \
                float y = log((k + 1) / k);\n    for (int n = 1; n <= 9; n++)\n        y = 1.0 / n - k * y;\n    \
                r = smoothstep(0.6, 1.3, y * 70);\n}\n";
    let report = examine(text, &[]);
    assert_eq!(report.culprits[0].line, 6, "{}", told(&report));
    let start = line(&report, 4);
    assert!(start.why.starts_with("rounds its result, which line 6 magnifies up to "), "{}", start.why);
}

/// Each rounding makes less than 1e-4 of the range here, and all of them make more.
#[test]
fn the_roundings_of_a_line_count_together() {
    let text = "float reflected(float ci, float eta)\n{\n    \
                float ct = sqrt(1.0 - (1.0 - ci * ci) / (eta * eta));\n    \
                float rs = (ci - eta * ct) / (ci + eta * ct);\n    return rs * rs;\n}\n\
                shader s(output float r = 0)\n{\n    float ci = 0.45 + 0.4 * u;\n    \
                float bright = reflected(ci, 1.0001) * 2e7;\n    r = bright / (1.0 + bright);\n}\n";
    let report = examine(text, &[]);
    let (by, rounds) = (line(&report, 4), line(&report, 3));
    assert!(by.why.ends_with("times what line 3 rounds"), "{}", told(&report));
    assert!(rounds.why.contains(" more roundings of the line)"), "{}", told(&report));
    assert!(by.error >= rounds.error && rounds.error >= 1e-4, "{}", told(&report));
    let worst = report.trials[0].outcomes[0].worst;
    assert!(by.error <= worst, "{}", told(&report));
}

/// The error of the factor is a single rounding; the loop makes much of it. Both have the same error.
#[test]
fn a_loop_that_adds_up_an_error_comes_before_it() {
    let text = "shader s(output float r = 0)\n{\n    float a = 0.004 * (0.5 + u);\n    \
                float k = 2 * cos(a);\n    float before = 1, now = cos(a);\n    \
                for (int i = 1; i < 400; i++) {\n        float next = k * now - before;\n        \
                before = now;\n        now = next;\n    }\n    r = now;\n}\n";
    let report = examine(text, &[]);
    let (first, second) = (&report.culprits[0], &report.culprits[1]);
    assert_eq!((first.line, second.line), (7, 4), "{}", told(&report));
    assert!(first.why.starts_with("adds up what line 4 rounds"), "{}", first.why);
    assert_eq!(second.why, "rounds its result, which line 7 adds up");
    assert!((first.error - second.error).abs() < 0.1 * first.error, "{}", told(&report));
}

/// Points are wrong as given; another color changes how many of them by little.
#[test]
fn values_that_make_nothing_wrong_are_not_told() {
    let text = "shader s(float seconds = 100003.4, float shade = 0.1, float rate = 3, output float r = 0)\n{\n    \
                float cycles = seconds * rate + 4 * u;\n    float part = cycles - floor(cycles);\n    \
                r = mix(shade, 1, smoothstep(0, 0.2, part)) * v;\n}\n";
    let knob = |name: &str, values: &[&str]| {
        let values = values.iter().map(|value| (*value).to_string()).collect();
        Knob { name: name.to_string(), values, near: Vec::new() }
    };
    let report = examine(text, &[knob("shade", &["0", "0.2"]), knob("rate", &["100"])]);
    assert!(report.trials[0].wrong() > 0.01, "{}", told(&report));
    assert!(!report.findings.iter().any(|finding| finding.sweep == "shade"), "{}", told(&report));
    assert!(report.findings.iter().any(|finding| finding.sweep == "rate"), "{}", told(&report));
}
