//! Broken sources with several slips each: every slip is reported once, with no error that only follows.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::resolve::resolve_parsed;
use osl_limits::Limits;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options, Reports, parse};

/// Name, number of slips, source. A slip of a stage is combined with one of each other stage: preprocessor,
/// token, syntax, tree (built, but refused), name, type, call, statement.
const SOURCES: &[(&str, usize, &str)] = &[
    (
        "four-functions",
        4,
        "float a(float x) { return smothstep(0, 1, x); }\nfloat b(float x) { vec3 p = 0; return x; }\n\
         float c(float x) { return mix(x); }\nfloat d(float x) { float y = (x + ; return y; }\n\
         shader s(output float r = 0) { r = a(u) + b(u) + c(u) + d(u); }",
    ),
    (
        "include-name",
        2,
        "#include \"nowhere.h\"\nshader s(output float r = 0) { vector2 p = make(u); r = mix(u); }",
    ),
    (
        "macro-syntax",
        2,
        "#define SQUARE(x) ((x) * (x))\nshader s(output float r = 0) {\n    r = SQUARE(u, v);\n    r = r + ;\n}",
    ),
    (
        "macro-name",
        2,
        "#define SQUARE(x) ((x) * (x))\nshader s(output float r = 0) {\n    r = SQUARE(u, v);\n    r = smothstep(0, 1, u);\n}",
    ),
    (
        "directive-type",
        2,
        "#if 1 +\n#endif\nshader s(output float r = 0) {\n    string t = u;\n    r = 1;\n}",
    ),
    ("token-syntax", 2, "shader s(output float r = 0) {\n    r = 1.0f;\n    r = r + ;\n}"),
    ("token-tree", 2, "shader s(output float r = 0) {\n    r = 1.0f;\n    r = sin(u)[0];\n}"),
    ("token-name", 2, "shader s(output float r = 0) {\n    float half = 1.0f;\n    r = radiuss;\n}"),
    ("token-type", 2, "shader s(output float r = 0) {\n    r = u $ v;\n    string t = u;\n}"),
    ("token-call", 2, "shader s(output float r = 0) {\n    r = 4000000000;\n    r = mix(u);\n}"),
    ("syntax-tree", 2, "shader s(output float r = 0) {\n    r = u +;\n    r = sin(u)[0];\n}"),
    (
        "syntax-name",
        3,
        "float half(float x) { return x / ; }\nfloat twice(float x) { return y * 2; }\n\
         shader s(output float r = 0) { r = half(u) + twise(v); }",
    ),
    (
        "syntax-type",
        2,
        "shader s(output float r = 0) {\n    float a = 1 2;\n    string t = u;\n    r = a;\n}",
    ),
    ("syntax-call", 2, "shader s(output float r = 0) {\n    if r > 1 r = 0;\n    r = clamp(r, 0);\n}"),
    (
        "syntax-statement",
        2,
        "void f() { return 1; }\nshader s(output float r = 0) {\n    r = (u;\n    f();\n}",
    ),
    ("tree-name", 2, "shader s(output float r = 0) {\n    u + 1 = 2;\n    r = radiuss;\n}"),
    (
        "tree-type",
        2,
        "shader s(output float r = 0) {\n    float a[2] = u;\n    string t = u;\n    r = a[0];\n}",
    ),
    ("tree-call", 2, "shader s(output float r = 0) {\n    float a[0];\n    r = mix(u) + a[0];\n}"),
    ("tree-statement", 2, "shader s(output float r = 0) {\n    (u)++;\n    break;\n    r = 1;\n}"),
    ("name-type", 2, "shader s(output float r = 0) {\n    r = radiuss * 2 + P;\n    string t = u;\n}"),
    ("name-call", 2, "shader s(output float r = 0) {\n    r = max(radiuss, 1);\n    r = mix(u);\n}"),
    (
        "name-statement",
        2,
        "float f(float x) { return y; }\nshader s(output float r = 0) { continue; r = f(u); }",
    ),
    (
        "type-call",
        2,
        "vec3 f(vec3 x) { return x; }\nshader s(output float r = 0) { r = f(u) + f(P) + mix(u); }",
    ),
    ("type-statement", 2, "struct k { flaot x; };\nshader s(output float r = 0) { k a; r = a.x; return r; }"),
    (
        "call-statement",
        2,
        "float f(float x) { return; }\nshader s(output float r = 0) { r = f(u) + mix(u); }",
    ),
    // What recovery drops may have declared what is used after it.
    (
        "dropped-declarations",
        1,
        "shader s(output float r = 0) {\n    float a = 1, b = , c = 2;\n    r = a + b * c;\n}",
    ),
    (
        "dropped-function",
        1,
        "float half(float x { return x / 2; }\nshader s(output float r = 0) { r = half(u) + half(v); }",
    ),
    (
        "dropped-parameter",
        1,
        "float f(float x, y) { return x; }\nshader s(output float r = 0) { r = f(u, v); }",
    ),
    (
        "dropped-field",
        1,
        "struct k { float x; flaot y z; };\nshader s(output float r = 0) { k a = { 1, 2 }; r = a.x + a.z; a = k(1, 2, 3); }",
    ),
    ("nameless", 2, "shader s(float = 1, output float r = 0) {\n    r = size + radiuss;\n}"),
    (
        "misspelt-return",
        1,
        "float f(float x) {\n    retrun x;\n}\nshader s(output float r = 0) { r = f(u); }",
    ),
    ("misspelt-shader", 1, "shder s(float a = 1, output float r = 0) {\n    r = a;\n}"),
    (
        "name-file",
        1,
        "shader s(output float r = 0) {\n    color c = texture(filename, u, v);\n    r = c[0];\n}",
    ),
    // No keyword can stand where these stand.
    (
        "no-keywords",
        3,
        "float f(foo x) { return 1; }\nshader s(output float r = 0) { fro a = 1; whle b; r = f(u) + a; }",
    ),
    (
        "missing-brace",
        2,
        "float half(float x) {\n    if (x > 1) {\n        x = 1;\n    return x / 2;\n}\n\nfloat twice(float x) \
         {\n    return y * 2;\n}\n\nshader s(output float r = 0) {\n    r = half(u) + twice(v);\n}",
    ),
    (
        "early-brace",
        2,
        "float half(float x) {\n    if (x > 1)\n        x = 1; }\n    float y = x;\n    x = y * 2;\n    return x / 2;\n}\n\
         shader s(output float r = 0) {\n    r = half(u) + twice(v);\n}",
    ),
    ("read-only-thrice", 1, "shader s(float a = 1, output float r = 0) { a = 2; a += 3; a++; r = a; }"),
    (
        "repeated",
        2,
        "shader s(output float r = 0) {\n    vec3 a, b;\n    vec3 c;\n    r = radiuss + radiuss;\n    r = radiuss;\n}",
    ),
];

fn report(text: &str) -> (usize, String) {
    let parsed = parse("broken.osl", text, &NoFiles, &Options::default());
    let resolved = resolve_parsed(&parsed, Reports::Once, &Limits::default());
    assert!(resolved.program.is_err());
    let mut list = parsed.diagnostics.clone();
    list.extend(resolved.diagnostics);
    list.sort_by_key(|d| d.span.start);
    (list.iter().filter(|d| d.is_error()).count(), render(&list, &parsed.sources, RenderStyle::default()))
}

#[test]
fn each_slip_is_reported_once() {
    let mut wrong = Vec::new();
    for (name, slips, text) in SOURCES {
        let (errors, said) = report(text);
        if errors != *slips {
            wrong.push(format!("{name}: {errors} errors of {slips} slips\n{said}"));
        }
        insta::assert_snapshot!(*name, format!("{text}\n----\n{said}"));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
