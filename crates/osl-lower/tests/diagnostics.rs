//! A snapshot for each diagnostic of resolution and lowering: the source, and its diagnostics.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::resolve::{errors, resolve_parsed};
use osl_limits::Limits;
use osl_lower::lower;
use osl_lower::params::ParamValues;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options, Reports, parse};
use std::collections::BTreeSet;

/// Code, followed by a word if the code has several cases, and a source that causes it. The source is the
/// body of `shader s(float f = 1, color c = 1, output float r = 0) { … }` unless it contains `shader` itself.
const CASES: &[(&str, &str)] = &[
    ("E0201", "r = radiuss; r = smothstep(0, 1, u);"),
    (
        "E0201-languages",
        "for (i = 0; i < 3; i++)\n    r += fract(u);\nc = lerp(c, saturate(c), rsqrt(u));\nr = dFdx(f) + M_TAU;\nmatrix m = P * m;",
    ),
    (
        "E0203-languages",
        "struct key { float time; };\nshader s(output float r = 0) { vec3 a; flaot b; key d; r = d.tmie; kee e; point p; r = p.xy; }",
    ),
    (
        "E0301-languages",
        "r = f % 2.0; r = f ^ 2; string t = \"a\" + \"b\"; matrix m = 1; point p = m * P; r = c < 1;",
    ),
    ("E0202", "float a; float a; float P; float sin;"),
    ("E0203", "shader s(output float r = 0) { blob b; }"),
    (
        "E0202-struct",
        "float half(float x) { return x / 2; }\nstruct half { float x; };\nstruct noise { float x; };\nstruct P { float x; };\nshader s() {}",
    ),
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
    ("E0310", "struct A { float x[1048576]; float y; };\nshader s() {}"),
    ("E0312", "f = 2;"),
    ("E0401", "r = length(\"a\"); r = distance(P);"),
    (
        "E0402",
        "struct A { float x; };\nstruct B { float y; };\nA make(float v) { A a; return a; }\nB make(float v) { B b; return b; }\nshader s() { make(1.0); }",
    ),
    (
        "E0401-count",
        "struct S { float x; };\nvoid show(S s) {}\nvoid show(S a, S b, int n) {}\nshader s() { show(); mix(1, 2); emission(1); backfacing(1); }",
    ),
    (
        "E0401-type",
        "float pick(int i, string name) { return i; }\nfloat pick(float list[3], int i) { return list[i]; }\nshader s(float pair[2] = {0, 1}, output float r = 0) { r = pick(0.5, \"a\"); r = pick(pair, 1); r = pick(1, 2); }",
    ),
    (
        "E0401-list",
        "float sum(float list[3]) { return list[0]; }\nfloat sum(color c) { return c[0]; }\nshader s(output float r = 0) { r = sum({ 1, 2 }); r = sum({ \"a\", \"b\", \"c\" }); setmessage(\"a\", { 1, 2 }); }",
    ),
    (
        "E0401-options",
        "c = 1; color k = texture(\"a.exr\", u, v, \"blur\"); k = texture(\"a.exr\", u, v, 0.5, 1);",
    ),
    ("E0401-any", "float one = 0; r = arraylength(one); float a[2]; r = isconnected(a);"),
    (
        "E0402-list",
        "struct A { float x, y, z; };\nfloat sum(color c) { return c[0]; }\nfloat sum(A a) { return a.x; }\nfloat sum(float list[3]) { return list[0]; }\nshader s(output float r = 0) { r = sum({ 1, 2, 3 }); }",
    ),
    ("E0403", "float later(float x);\nshader s(output float r = 0) { r = later(1); }"),
    ("E0404", "void set(output float x) { x = 1; }\nshader s() { int i; set(i); }"),
    ("E0405", "printf(\"%d and %6.2f\\n\", r, \"text\"); string t = format(\"%g %u\", 1, 2);"),
    ("E0405-count", "printf(\"%g %g\\n\", r); warning(\"100%%\", r); fprintf(\"a.txt\", \"%g\");"),
    (
        "E0405-struct",
        "struct S { float x; };\nshader s() { S a; S b[2]; printf(\"%g %s\", a, b); printf(\"%s %s %s\", N, \"a\" \"b\", emission()); }",
    ),
    ("E0406", "float none(float x) { x; }\nshader s(output float r = 0) { r = none(1); }"),
    ("E0407", "void nothing() {}\nshader s(output float r = 0) { r = nothing(); }"),
    ("E0408", "string option = \"blur\"; r = texture(\"a.exr\", u, v, option, 0.1, \"wrap\", \"black\");"),
    ("E0501", "break; continue;"),
    (
        "E0302-return",
        "int half(int x) { return x * 0.5; }\nint one() { return 1.0; }\nshader s(output int i = 0) { i = half(1) + one(); }",
    ),
    ("E0502", "float a(float x) { return; }\nshader s() { return 1; }"),
    ("E0503", "shader s(float a) {}"),
    ("E0504", "float a(float x = 1) { return x; }\nshader s() {}"),
    (
        "E0312-passed",
        "void g(float y) { y += 1; }\nvoid f(float x, float t) { g(x); x = t; }\nvoid idle() { f(1, 2); }\nstruct A { float a; };\nshader s(float in = 1, A all = { 1 }, output float r = 0) { f(in, in); f(all.a, 1); f(r, in); f(in + 1, r); f(2, r); }",
    ),
    ("E0505", "struct A { float x; };\nshader s(A list[2] = {}, output float o[] = { 1 }) {}"),
    (
        "E0506",
        "float half(float x) [[ string help = \"a\" \"b\", float version = 1 ]] { return x / 2; }\nshader s [[ string help = 1 ]] (float a = 1 [[ int min = \"a\", float max = 2 * 3, float soft = a, color tint = { 1, 0, 0 } ]],\n    float b = 1 [[ float range[2] = { 1, 2, 3 }, string names[2] = { \"a\", \"b\" }, matrix m = vector(1, 2, 3) ]]) {}",
    ),
    (
        "E0601",
        "float f0(float x) { return x + 1; }\nfloat f1(float x) { return f0(x) + f0(x) + f0(x) + f0(x); }\nfloat f2(float x) { return f1(x) + f1(x) + f1(x) + f1(x); }\nfloat f3(float x) { return f2(x) + f2(x) + f2(x) + f2(x); }\nfloat f4(float x) { return f3(x) + f3(x) + f3(x) + f3(x); }\nfloat f5(float x) { return f4(x) + f4(x) + f4(x) + f4(x); }\nfloat f6(float x) { return f5(x) + f5(x) + f5(x) + f5(x); }\nfloat f7(float x) { return f6(x) + f6(x) + f6(x) + f6(x); }\nfloat f8(float x) { return f7(x) + f7(x) + f7(x) + f7(x); }\nfloat f9(float x) { return f8(x) + f8(x) + f8(x) + f8(x); }\nshader s(output float r = 0) { r = f9(u) + f9(v); }",
    ),
    (
        "E0602",
        "float triple(float x) [[ int builtin = 1 ]];\nvoid mark(string s) [[ int builtin = 1 ]];\nshader s(output float r = 0) { r = triple(u); mark(\"here\"); }",
    ),
    ("W0201", "printf(\"%g\\n\", noise(P));"),
    ("W0202", "int i = 1.5;"),
    ("W0202-operation", "int i = 2 * f; i *= 0.5; i = noise(f);"),
    ("W0203", "u = 1;"),
    (
        "W0204",
        "float a(float x) { return x; }\nfloat a(float x) { return 1; }\nshader s(output float r = 0) { r = a(1); }",
    ),
    ("W0204-builtin", "float sqrt(float x) { return x; }\nshader s(output float r = 0) { r = sqrt(2.0); }"),
    ("W0206", "shader s(float noise = 1, output float r = 0) { r = noise; }"),
    ("W0207", "float x; sincos(u, x, 1.0);"),
    (
        "W0207-element",
        "struct S { float x; float w[2]; };\nvoid set(output S s) { s.x = 1; }\nvoid both(output float w[2]) { w[0] = 1; }\nshader s() { S a[2]; set(a[1]); both(a[1].w); }",
    ),
    ("W0207-function", "void set(output float x) { x = 1; }\nshader s() { float a = 0; set(a + 1); }"),
    ("W0213", "float a[2]; a[2] = a[-1] + N[3]; matrix m = 1; r = m[4][0] + a[0x1];"),
    ("W0214", "r = f / 0 + 7 % 0 + 1 / 0.0; r /= 0;"),
    ("W0208", "string line = \"%g\"; printf(line, r);"),
    ("W0209", "r = texture(\"a.exr\", u, v, \"blurr\", 0.1, \"width\", 1, \"wrap\", 2, \"gloss\", 1);"),
    ("W0210", "float a[2] = { 1, \"two\" }; string names[3] = { \"a\", 2, 3.0 };"),
    ("W0211", "string t = \"a\"; t++;"),
    (
        "W0212",
        "struct A { float x; A next, list[2]; };\nshader s(output float r = 0) { A a; r = a.x + a.next.x; }",
    ),
];

fn source(case: &str) -> String {
    if case.contains("shader") {
        return format!("{case}\n");
    }
    format!("shader s(float f = 1, color c = 1, output float r = 0) {{\n    {case}\n}}\n")
}

/// All diagnostics of a source as text, and their codes.
fn report(text: &str) -> (String, BTreeSet<&'static str>) {
    let parsed = parse("case.osl", text, &NoFiles, &Options::default());
    let resolved = resolve_parsed(&parsed, Reports::Once, &Limits::default());
    let mut list = parsed.diagnostics.clone();
    list.extend(resolved.diagnostics);
    if let Ok(program) = resolved.program {
        list.extend(lower(&program, &ParamValues::default()).err().unwrap_or_default());
    }
    list.sort_by_key(|d| d.span.start);
    let codes = list.iter().map(|d| d.code.id).collect();
    (render(&list, &parsed.sources, RenderStyle::default()), codes)
}

/// Five unrelated mistakes, one per line; none hides another.
#[test]
fn independent_errors_are_all_reported() {
    let text = "shader s(float f = 1, output color c = 0) {\n    float a = radiuss;\n    c = textur(\"a.exr\", u, v);\n    \
                f = 2;\n    c.x = a;\n    printf(\"%d\\n\", a);\n}\n";
    let (said, codes) = report(text);
    assert_eq!(said.matches("error[").count(), 5, "{said}");
    assert_eq!(codes.len(), 4);
    insta::assert_snapshot!("five-errors", format!("{text}----\n{said}"));
}

/// Five syntax errors, each in a separate statement: the parser continues after each.
#[test]
fn syntax_errors_are_all_reported() {
    let text = "shader s(output float r = 0) {\n    float a = ;\n    r = 1.0f;\n    int class = 1;\n    r = (1 + ;\n    \
                if r > 1 r = 0;\n    r = a;\n}\n";
    let (said, _) = report(text);
    assert!(said.matches("error[").count() >= 5, "{said}");
    insta::assert_snapshot!("five-syntax-errors", format!("{text}----\n{said}"));
}

/// A missing brace is one error, at its location, and not one for each function after it.
#[test]
fn a_missing_brace_buries_nobody() {
    let text = "float half(float x) {\n    if (x > 1) {\n        x = 1;\n    return x / 2;\n}\n\nfloat twice(float x) \
                {\n    return x * 2;\n}\n\nshader s(output float r = 0) {\n    r = half(u) + twice(v);\n}\n";
    let (said, _) = report(text);
    assert_eq!(said.matches("error[").count(), 1, "{said}");
    insta::assert_snapshot!("missing-brace", format!("{text}----\n{said}"));
}

#[test]
fn each_code_has_its_snapshot() {
    let mut seen = BTreeSet::new();
    for (code, case) in CASES {
        let text = source(case);
        let (said, codes) = report(&text);
        let name = code;
        let code = name.split('-').next().unwrap_or(name);
        assert!(codes.contains(code), "{name}: {codes:?}\n{said}");
        seen.insert(code);
        insta::assert_snapshot!(*name, format!("{text}----\n{said}"));
    }
    let all: BTreeSet<&str> = errors::ALL
        .iter()
        .map(|c| c.id)
        .chain([osl_hir::hir::TOO_LARGE.id, osl_lower::NO_OPERATION.id])
        .collect();
    // E0311 is for trees that no parser has checked; E0208 is tested among the hostile files.
    let missing: Vec<_> = all.difference(&seen).filter(|code| !["E0208", "E0311"].contains(code)).collect();
    assert!(missing.is_empty(), "codes without a case: {missing:?}");
}
