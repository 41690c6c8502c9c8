//! One snapshot for each code: the source and its diagnostics.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::parse_with;
use osl_syntax::Options;
use osl_syntax::errors::CODES;
use osl_syntax::render::{RenderStyle, places, render};

/// Code, what the case shows, text.
const CASES: &[(&str, &str, &str)] = &[
    ("E0001", "", "#include \"gone.h\"\nshader s() {}\n"),
    ("E0002", "", "#include \"loop.h\"\nshader s() {}\n"),
    ("E0003", "", "#include \"twice.h\"\nshader s() {}\n"),
    ("E0004", "", "#undef 7\nshader s() {}\n"),
    ("E0005", "", "#inlcude \"a.h\"\nshader s() {}\n"),
    ("E0006", "", "#define F(a, 1) a\nshader s() {}\n"),
    ("E0007", "", "#define SUM(a, b) a + b\nshader s() { float x = SUM(1, 2, 3); }\n"),
    ("E0008", "", "#define SUM(a, b) a + b\nshader s() { float x = SUM(1, 2; }\n"),
    ("E0009", "", "#define GLUE(a, b) a ## b\nshader s() { float x = GLUE(+, 1); }\n"),
    ("E0010", "", "#if OSL_VERSION >= 1 / 0\n#endif\nshader s() {}\n"),
    ("E0011", "", "shader s() {}\n#if 1\n#else\n#else\n#endif\n"),
    ("E0012", "", "#ifdef M_PI\nshader s() {}\n"),
    ("E0013", "", "#error OSL 2 is needed\nshader s() {}\n"),
    ("E0014", "", "#define A B B\n#define B C C\n#define C D D\n#define D 1 1 1 1\nshader s() { A; }\n"),
    ("E0015", "", "#define F(x) x\nshader s() { float a = F(F(F(F(F(F(F(F(F(F(F(F(F(F(1)))))))))))))); }\n"),
    (
        "E0016",
        "",
        "shader s() { a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; a; }\n",
    ),
    ("E0018", "", "#pragma error \"too old\"\nshader s() {}\n"),
    ("W0001", "", "#define K 1\n#define K 2\nshader s() {}\n"),
    ("W0002", "", "#warning take care\nshader s() {}\n"),
    ("W0003", "", "#pragma warning \"take care\"\nshader s() {}\n"),
    ("W0004", "", "#pragma osl nowarm\nshader s() {}\n"),
    ("W0005", "", "/* one /* two */\nshader s() {}\n"),
    ("E0101", "", "shader s() { float a = 1 @ 2; }\n"),
    ("E0101", "quotes", "shader s() { string a = “x”; }\n"),
    ("E0102", "", "shader s() {\n  string a = \"abc;\n  string b = \"def\";\n}\n"),
    ("E0103", "", "shader s() { /* never\n}\n"),
    ("E0104", "", "shader s() { int a = 99999999999; }\n"),
    ("E0105", "", "shader s() { float a = 1.0f; }\n"),
    ("E0106", "", "shader s() { bool a = true; }\n"),
    ("E0107", "", "shader s() { float ___a; }\n"),
    ("E0108", "", "shader s() { string a = 'x'; }\n"),
    ("E0110", "", "shader s() { float a = 2 * ; }\n"),
    ("E0110", "semicolon", "shader s() {\n  float a = 1 // one\n\n  float b = 2;\n}\n"),
    ("E0110", "global", "float a = 1;\nshader s() {}\n"),
    ("E0110", "else", "shader s() { ; else ; }\n"),
    ("E0110", "macro", "#define TWICE(x) x * * x\nshader s(float k = 1) {\n  float a = TWICE(k);\n}\n"),
    ("E0110", "include", "#include \"broken.h\"\nshader s() {}\n"),
    ("E0111", "", "float f(float a) {\n  return a;\n\nshader s() {\n  float b = f(1);\n}\n"),
    ("E0112", "", "shader s() {\n}\n}\n"),
    ("E0113", "", "shader s() { float a = ((((((((((((((((1)))))))))))))))); }\n"),
    ("E0114", "", "shader s() { (a) = 1; }\n"),
    ("E0115", "", "shader s() { float a = color(1)[0]; }\n"),
    ("E0115", "indices", "shader s() { float a = m[0][1][2][3]; }\n"),
    ("E0116", "", "shader s() { float a[1 + 1]; }\n"),
    ("E0117", "", "shader s() { float a[2] = b; }\n"),
    ("E0118", "", "shader s() { color c = {}; }\n"),
    ("E0120", "", "shader s() {\n  = ;\n  = ;\n  = ;\n  = ;\n  = ;\n  = ;\n  = ;\n}\n"),
    ("W0101", "", "float f() { return 1; }\n}\nshader s() {}\n"),
    ("W0102", "", "shader s(float a = 1 [[ string help = \"one\ntwo\" ]]) {}\n"),
    ("W0103", "", "shader s() { float a[2] = {1, 2,}; f(a,); }\n"),
    ("W0104", "", "float f() { return 1; };\nshader s() {};\n"),
    ("W0105", "", "shader s() { color c = (1, 2, 3); }\n"),
];

fn options() -> Options {
    let mut options = Options::default();
    let reading = &mut options.limits.reading;
    (reading.include_depth, reading.includes, reading.expansion) = (8, 100, 40);
    (reading.tokens, reading.nesting, reading.diagnostics) = (60, 12, 6);
    options
}

#[test]
fn each_message() {
    let files = [
        ("loop.h", "#include \"loop.h\"\n"),
        ("twice.h", "#ifndef DEEP\n#include \"twice.h\"\n#include \"twice.h\"\n#endif\n"),
        ("broken.h", "float f(float a) {\n  return a +;\n}\n"),
    ];
    for (code, what, text) in CASES {
        let parsed = parse_with(text, &files, &options());
        let rendered = render(&parsed.diagnostics, &parsed.sources, RenderStyle::default());
        assert!(parsed.diagnostics.iter().any(|d| d.code.id == *code), "{code}\n{text}\n{rendered}");
        assert!(parsed.diagnostics.iter().all(|d| places(d.span, &parsed.sources).is_some()), "{code}");
        let name = if what.is_empty() { (*code).to_owned() } else { format!("{code}-{what}") };
        insta::with_settings!({ omit_expression => true, description => *text }, {
            insta::assert_snapshot!(name, rendered);
        });
    }
}

#[test]
fn every_code_has_its_snapshot_and_a_number_of_its_own() {
    // A test cannot use four gibibytes of source. `files` shows bytes that are not UTF-8.
    let missing: Vec<_> = CODES
        .iter()
        .filter(|c| !["E0017", "W0006"].contains(&c.id) && !CASES.iter().any(|(id, ..)| *id == c.id))
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
    let mut ids: Vec<_> = CODES.iter().map(|c| c.id).collect();
    let mut names: Vec<_> = CODES.iter().map(|c| c.name).collect();
    ids.sort_unstable();
    names.sort_unstable();
    assert!(ids.windows(2).all(|w| w[0] != w[1]), "{ids:?}");
    assert!(names.windows(2).all(|w| w[0] != w[1]), "{names:?}");
}

#[test]
fn quirks_are_errors_under_strict_syntax() {
    for (code, _, text) in CASES
        .iter()
        .filter(|(code, ..)| matches!(*code, "W0001" | "W0002" | "W0005" | "W0101" | "W0103" | "W0104"))
    {
        let parsed = parse_with(text, &[], &Options { strict: true, ..options() });
        assert!(parsed.diagnostics.iter().any(|d| d.code.id == *code && d.is_error()), "{code}");
    }
}

#[test]
fn color_is_only_in_the_style() {
    let parsed = parse_with("shader s() { a = ; }", &[], &options());
    let plain = render(&parsed.diagnostics, &parsed.sources, RenderStyle { color: false });
    let color = render(&parsed.diagnostics, &parsed.sources, RenderStyle { color: true });
    assert!(!plain.contains('\u{1b}') && color.contains('\u{1b}'));
}

#[test]
fn carriage_returns_are_not_drawn() {
    let parsed = parse_with("shader s()\r\n{\r\n    float a = ;\r\n}\r\n", &[], &options());
    let plain = render(&parsed.diagnostics, &parsed.sources, RenderStyle::default());
    assert!(plain.contains("3 |     float a = ;") && !plain.contains(['\r', '␍']), "{plain}");
}
