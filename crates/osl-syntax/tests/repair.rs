//! Repair of missing brackets and semicolons.

#[allow(dead_code, reason = "each test file uses its part")]
mod common;

use common::{strict, tree};
use osl_syntax::repair::repair;
use osl_syntax::{NoFiles, Options, print};

fn repaired(text: &str) -> Option<String> {
    repair("test.osl", text, &NoFiles, &Options::default()).map(|r| r.text)
}

#[test]
fn one_lost_bracket_each() {
    for (broken, whole) in [
        ("shader s() { float a = (1 + 2; }", "shader s() { float a = (1 + 2); }"),
        ("shader s() { float a[2] = {1, 2; }", "shader s() { float a[2] = {1, 2 }; }"),
        ("shader s() { float a[2 = {1, 2}; }", "shader s() { float a[2] = {1, 2}; }"),
        (
            "shader s() {\n    float a = 1\n    float b = 2;\n}\n",
            "shader s() {\n    float a = 1;\n    float b = 2;\n}\n",
        ),
        (
            "shader s() {\n    if (u > 0) {\n        ;\n}\n",
            "shader s() {\n    if (u > 0) {\n        ;\n}\n}\n",
        ),
        ("shader s(float a = 1 [[ int b = 2 ]) {}", "shader s(float a = 1 [[ int b = 2 ]]) {}"),
    ] {
        let got = repaired(broken).unwrap_or_else(|| panic!("{broken}"));
        assert_eq!(print::ast(&strict(&got).ast), tree(whole), "{got}");
    }
}

#[test]
fn a_lost_brace_goes_before_the_next_function_at_the_margin() {
    let broken =
        "float f() {\n  return 1;\n\nfloat g() {\n  return f();\n}\n\nshader s() {\n  float a = g();\n}\n";
    let whole =
        "float f() {\n  return 1;\n}\n\nfloat g() {\n  return f();\n}\n\nshader s() {\n  float a = g();\n}\n";
    assert_eq!(repaired(broken).unwrap(), whole);
}

#[test]
fn the_brace_stands_behind_a_comment_of_its_line() {
    let broken = "float f() {\n  return 1; // done\n\nshader s() {}\n";
    assert_eq!(repaired(broken).unwrap(), "float f() {\n  return 1; // done\n}\n\nshader s() {}\n");
}

#[test]
fn what_is_whole_or_wrong_otherwise_is_left_alone() {
    for text in ["shader s() {}", "shader s() { float a = * 2; }", "shader s() { float a = 1.0f; }", "}", ""]
    {
        assert_eq!(repaired(text), None, "{text}");
    }
}

/// A `;` that does not help is not inserted again and again until the budget of recovery is used up.
#[test]
fn recovery_inserts_one_semicolon_at_a_place() {
    let text = "void f(float x) {\n    return 0x;\nntf(\n#ifndef A\n\"%d\\n\", 1, }\nreturn ret\n";
    let parsed = osl_syntax::parse("loop.osl", text, &NoFiles, &Options::default());
    assert!(parsed.ast.gaps.list.len() < 20, "{} gaps", parsed.ast.gaps.list.len());
}
