//! A snapshot for each diagnostic of resolution and lowering: the source, and what is said of it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_ir::lower;
use osl_ir::params::ParamValues;
use osl_ir::resolve::{errors, resolve};
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options, parse};
use std::collections::BTreeSet;

/// Code and a source that earns it. A body stands in `shader s(float f = 1, color c = 1, output float r = 0) { … }`
/// unless it says `shader` itself.
const CASES: &[(&str, &str)] = &[
    ("E0201", "r = radiuss; r = smothstep(0, 1, u);"),
    ("E0202", "float a; float a; float P; float sin;"),
    ("E0203", "shader s(output float r = 0) { blob b; }"),
    ("E0204", "r = c.x + P.r;"),
    ("E0205", "r = noise + f(2);"),
    ("E0206", "float only(float x) { return x; }\n// no shader here\n"),
    ("E0207", "shader a() {}\nshader b() {}"),
    ("E0301", "string t = \"a\"; r = t + 1; matrix m = 1; point p = P * m; r = ~f;"),
    ("E0302", "string t = 1; r = c;"),
    ("E0303", "r = (float) c;"),
    ("E0304", "color k = color(1, 2); matrix m = matrix(1, 2, 3);"),
    ("E0305", "float a[2] = { 1, 2, 3 }; float b = { 1 };"),
    ("E0306", "struct S { float x; };\nshader s(output float r = 0) { S a; if (a) r = 1; }"),
    ("E0307", "r = f > 0 ? \"a\" : 1;"),
    ("E0308", "float a[2]; r = a[0.5] + f[1]; matrix m = 1; r = m[1];"),
    ("E0309", "float a[2000000];"),
    ("E0310", "struct A { float x[2]; };\nstruct B { A a[3]; };\nshader s() {}"),
    ("E0312", "f = 2;"),
    ("E0401", "r = length(\"a\"); r = distance(P);"),
    (
        "E0402",
        "struct A { float x; };\nstruct B { float y; };\nA make(float v) { A a; return a; }\nB make(float v) { B b; return b; }\nshader s() { make(1.0); }",
    ),
    ("E0403", "float later(float x);\nshader s(output float r = 0) { r = later(1); }"),
    ("E0404", "void set(output float x) { x = 1; }\nshader s() { int i; set(i); }"),
    ("E0406", "float none(float x) { x; }\nshader s(output float r = 0) { r = none(1); }"),
    ("E0407", "void nothing() {}\nshader s(output float r = 0) { r = nothing(); }"),
    ("E0501", "break; continue;"),
    ("E0502", "float a(float x) { return; }\nshader s() { return 1; }"),
    ("E0503", "shader s(float a) {}"),
    ("E0504", "float a(float x = 1) { return x; }\nshader s() {}"),
    ("E0505", "struct A { float x; };\nshader s(A list[2] = {}, output float o[] = { 1 }) {}"),
    (
        "E0601",
        "float f0(float x) { return x + 1; }\nfloat f1(float x) { return f0(x) + f0(x) + f0(x) + f0(x); }\nfloat f2(float x) { return f1(x) + f1(x) + f1(x) + f1(x); }\nfloat f3(float x) { return f2(x) + f2(x) + f2(x) + f2(x); }\nfloat f4(float x) { return f3(x) + f3(x) + f3(x) + f3(x); }\nfloat f5(float x) { return f4(x) + f4(x) + f4(x) + f4(x); }\nfloat f6(float x) { return f5(x) + f5(x) + f5(x) + f5(x); }\nfloat f7(float x) { return f6(x) + f6(x) + f6(x) + f6(x); }\nfloat f8(float x) { return f7(x) + f7(x) + f7(x) + f7(x); }\nfloat f9(float x) { return f8(x) + f8(x) + f8(x) + f8(x); }\nshader s(output float r = 0) { r = f9(u) + f9(v); }",
    ),
    ("E0602", "string name = format(\"%g\", u); setmessage(name, 1.0);"),
    ("W0201", "if (noise(P) > 0.5) r = 1;"),
    ("W0202", "int i = 1.5;"),
    ("W0203", "u = 1;"),
    (
        "W0204",
        "float a(float x) { return x; }\nfloat a(float x) { return 1; }\nshader s(output float r = 0) { r = a(1); }",
    ),
    ("W0206", "shader s(float noise = 1, output float r = 0) { r = noise; }"),
    ("W0207", "float x; sincos(u, x, 1.0);"),
];

fn source(case: &str) -> String {
    if case.contains("shader") {
        return format!("{case}\n");
    }
    format!("shader s(float f = 1, color c = 1, output float r = 0) {{\n    {case}\n}}\n")
}

/// Everything that is said of a source, as text, and the codes.
fn report(text: &str) -> (String, BTreeSet<&'static str>) {
    let parsed = parse("case.osl", text, &NoFiles, &Options::default());
    let mut list = parsed.diagnostics.clone();
    if !parsed.has_errors() {
        let resolved = resolve(&parsed.ast);
        let failed = resolved.diagnostics.iter().any(|d| d.is_error());
        list.extend(resolved.diagnostics);
        if let (false, Some(program)) = (failed, resolved.program) {
            list.extend(lower::lower(&program, &ParamValues::default()).err().unwrap_or_default());
        }
    }
    let codes = list.iter().map(|d| d.code.id).collect();
    (render(&list, &parsed.sources, RenderStyle::default()), codes)
}

#[test]
fn each_code_has_its_snapshot() {
    let mut seen = BTreeSet::new();
    for (code, case) in CASES {
        let text = source(case);
        let (said, codes) = report(&text);
        assert!(codes.contains(code), "{code}: {codes:?}\n{said}");
        seen.insert(*code);
        insta::assert_snapshot!(*code, format!("{text}----\n{said}"));
    }
    let all: BTreeSet<&str> =
        errors::ALL.iter().map(|c| c.id).chain([lower::TOO_LARGE.id, lower::UNSUPPORTED.id]).collect();
    // E0311 is for trees that no parser has checked.
    let missing: Vec<_> = all.difference(&seen).filter(|code| **code != "E0311").collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
}
