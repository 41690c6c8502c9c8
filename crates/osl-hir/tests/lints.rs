//! The lints: a snapshot for each message, sources without findings, and the correctness of the fixes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use osl_hir::lint::{self, LINTS};
use osl_hir::resolve::resolve;
use osl_syntax::diagnostic::Diagnostic;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::source::{SourceMap, SourceProvider};
use osl_syntax::{Options, parse};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Code, the purpose of the case, and a source that causes it. The source is the body of
/// `shader s(float f = 1, color c = 1, output float r = 0) { …; r += f + c[0]; }` unless it contains `shader`
/// itself.
const CASES: &[(&str, &str, &str)] = &[
    ("W0301", "", "float a = 1;"),
    ("W0301", "assigned", "float a; a = f; a += 2; a++;"),
    ("W0301", "shared", "float a = f, b = f; r = a;"),
    ("W0301", "call", "float a = noise(P);"),
    ("W0302", "", "shader s(float gain = 1, output float r = 0) { r = u; }"),
    (
        "W0302",
        "formal",
        "float twice(float x, float y) { return 2 * x; }\nshader s(output float r = 0) { r = twice(u, v); }",
    ),
    ("W0303", "", "float twice(float x) { return 2 * x; }\nshader s(output float r = 0) { r = u; }"),
    ("W0304", "", "float a; r = a * 2;"),
    ("W0304", "update", "color sum; sum += c; r = sum[0];"),
    ("W0304", "loop", "float sum; for (int i = 0; i < 4; i++) sum += noise(P * i); r = sum;"),
    ("W0304", "array", "float a[3]; r = a[1]; a[1] = 2;"),
    ("W0305", "", "float a; if (f > 0) a = 1; r = a;"),
    ("W0305", "else", "float a; if (f > 0) r = 1; else a = 1; r = a;"),
    ("W0306", "", "if (f > 0) { return; r = 1; r = 2; }"),
    ("W0306", "branches", "while (f > r) { if (f > 2) break; else continue; r = 1; }"),
    ("W0307", "", "while (1) { r += 1; }"),
    ("W0307", "for", "for (;;) r += 1;"),
    ("W0307", "inner", "while (1) { while (r < f) { r += 1; break; } }"),
    ("W0307", "unchanged", "while (f < 10) { r += 0.1; }"),
    ("W0307", "away", "for (int i = 3; i >= 0; i++) r += i;"),
    ("W0308", "", "if (0) r = 1;"),
    ("W0308", "never", "int i; for (i = 0; i > 3; i++) r += i;"),
    ("W0308", "ternary", "r = 1 < 2 ? f : 2;"),
    ("W0308", "while", "while (!1) r += 1;"),
    ("W0308", "variable", "int verbose = 0; if (verbose && u > 0) r = 2; if (verbose) r = 1;"),
    ("W0308", "strings", "if (\"a\" == \"b\") r = 1;"),
    ("W0308", "truncated", "int k = (int)0.5; if (k) r = 1;"),
    ("W0309", "", "int i = (int)f; if (i = 1) r = i;"),
    ("W0310", "", "r = r;"),
    ("W0310", "component", "color k = c; if (f > 0) k[1] = k[1]; r = k[0];"),
    ("W0311", "", "if (f * 3 == sin(u)) r = 1;"),
    ("W0311", "triple", "if (P != 2 * N) r = 1;"),
    ("W0311", "tenth", "if (f * 2 == 0.1) r = 1;"),
    ("W0312", "", "r = 1/2 * u;"),
    ("W0312", "argument", "r = pow(u, 2 / 3);"),
    ("W0312", "negative", "float a = 2 * (-1 / 3); r = a;"),
    ("W0313", "", "if (u > 0.5) { float f = 2; r = f; }"),
    ("W0313", "global", "{ float time = 2; r = time; }"),
    ("W0314", "", "point p = transform(\"Object\", P); r = p[0];"),
    ("W0314", "far", "matrix m = matrix(\"common\", \"kitchen\"); r = m[0][0];"),
    (
        "W0302",
        "several",
        "shader s(float gain = 1, string Notes = \"x\",\n#pragma osl nowarn\n    float kept = 2,\n    color tint = 1, output float r = 0) { r = u; }",
    ),
    (
        "W0303",
        "several",
        "float twice(float x) { return 2 * x; }\nfloat half(float x) { return x / 2; }\nshader s(output float r = 0) { r = u; }",
    ),
    ("W0316", "", "int n; gettextureinfo(\"a.tx\", \"channels\", n); r = n;"),
    ("W0316", "array", "float a[2]; if (f > 0) getattribute(\"a\", a); else getmessage(\"b\", a); r = a[1];"),
    (
        "W0317",
        "",
        "float half(float x) { if (x > 0.5) return 1; }\nshader s(output float r = 0) { r = half(u); }",
    ),
    (
        "W0317",
        "loop",
        "int find(float x) { for (int i = 0; i < 9; i++) { if (i > x) return i; } }\nshader s(output float r = 0) { r = find(u); }",
    ),
    ("W0306", "alone", "if (f > 0) { return; f + 1; }"),
    ("W0309", "alone", "int i = (int) f; if (i = 1) r = 1;"),
    ("W0318", "", "r == 3;"),
    ("W0318", "call", "sin(f); noise(P);"),
    ("W0318", "closure", "surface x(output float r = 0) { r = 1; diffuse(N); } // a shader"),
    ("W0318", "value", "f + 1; f;"),
    ("W0318", "comma", "r = 2,5 * f;"),
    ("W0319", "", "if (f > 1); r = 1;"),
    ("W0319", "for", "int i; for (i = 0; i < 3; i++); { r += i; }"),
    ("W0319", "while", "while (r < f); { r += 1; }"),
    ("W0320", "", "if (0 < f < 1) r = 1;"),
    ("W0320", "equality", "if (f == r == c[0]) r = 1;"),
    ("W0321", "", "if (!f > 0.5) r = 1;"),
    ("W0321", "not", "if (not f == 2) r = 1;"),
    ("W0322", "", "shader s(output float r = 0, output color Cout = 0) { r = u; }"),
    (
        "W0322",
        "several",
        "shader s(output float r = 0, output color Cout = 0, output float h[2] = {1, 2}) { r = u; }",
    ),
    ("W0323", "", "int n = (int) f; r = n / 3;"),
    ("W0323", "term", "int n = (int) f; r = 2 * ((n + 1) / 2) + 1;"),
    ("W0324", "", "r = noise(\"smplex\", P);"),
    ("W0324", "wrap", "r = texture(\"a.tx\", u, v, \"wrap\", \"periodc\", \"interp\", \"fine\");"),
    (
        "W0324",
        "distribution",
        "surface x(output float r = 0) { r = 1; Ci = microfacet(\"gxg\", N, 0.1, 1.5, 0); } // a shader",
    ),
    ("W0325", "", "float w = 1; getattribute(\"camera:fvo\", w); r = w;"),
    (
        "W0325",
        "metadata",
        "shader x(float k = 1 [[ float mni = 0, string widgt = \"slider\" ]], output float r = 0) { r = k; } // a shader",
    ),
    ("W0326", "", "r = smoothstep(0.6, 0.4, f);"),
    ("W0326", "clamp", "r = clamp(f, 1, 0);"),
    ("W0327", "", "color k = color(255, 128, 0); r = k[0];"),
    ("W0328", "", "if (f > 1) r = 1; else r = 1;"),
    ("W0328", "ternary", "r = f > 1 ? c[0] : c[0];"),
    ("W0315", "", "color k = color(\"HSV\", 0.5, 1, 1); r = k[0];"),
];

/// Sources without findings, each with the reason in its text.
const CLEAN: &[&str] = &[
    "float _a = 1;",
    "int n; if (gettextureinfo(\"a.tx\", \"channels\", n)) r = n;",
    "int n = 3; gettextureinfo(\"a.tx\", \"channels\", n); r = n;",
    "int n; int ok = getattribute(\"a\", n); r = n * ok; /* the result goes somewhere */",
    "int n; getattribute(\"a\", n); n += 1; r = n; /* something else writes it */",
    "{ float u = 2; float v = 1; r = u + v; } /* coordinates of one's own */",
    "if (P != N || f == 0.1 || f == r) r = 1; /* values that were handed on */",
    "shader s(string Notes = \"x\", string tip = \"y\" [[ int connectable = 0 ]], output float r = 0) { r = u; }",
    "float s; float k; sincos(u, s, k); r = s; /* an output must go somewhere */",
    "while (1) { r += 1; if (r > f) break; }",
    "while (f < 10) { r += 0.1; if (r > 3) break; } /* a jump leaves it */",
    "float t = 0; while (t < f) { r += t; t += 1; } do { t -= 1; } while (t > f);",
    "float t = 0; while (t < f) sincos(t, t, r); /* an output changes it */",
    "for (int i = 3; i >= 0; i--) r += i; for (int i = 0; i < (int)f; i++) r += i;",
    "for (int i = 3; i > 0; i++) { i -= 2; r += i; } /* the body counts */",
    "shader s(float k = 1 [[ float soft_min = 0, string tags = \"a\", string unit = \"m\" ]], output float r = 0) { r = k; }",
    "do { r = 1; if (f > 0) break; r = 2; } while (0); /* a block that break leaves */",
    "int i = 0; while ((i = i + 1) < 3) r = i; if ((i = 2)) r = i;",
    "if (f == 0 || c == color(0) || f == 0.5 || floor(f) == f || logb(f) == f || 2 == f) r = 1;",
    "int i = 2; if (i == r) r = 2;",
    "if (f != f || c[1] == c[1]) r = 0; /* a test for NaN */",
    "struct S { float x; };\nint __operator__eq__(S a, S b) { return a.x == b.x; }\n\
     shader s(output float r = 0) { S a = {u}; r = a == a; }",
    "int verbose = 0; if (u > 0) verbose = 1; if (verbose) r = 1;",
    "#define DEBUG 0\nshader s(output float r = 0) { int verbose = DEBUG; if (verbose) r = 1; }",
    "void set(int x) { x = 1; } int verbose = 0; set(verbose); if (verbose) r = 1;",
    "r = 4/2 * u + 1.0/2 + 1/0; int i = 7/2; r = i;",
    "float a; if (f > 0) a = 1; else a = 2; r = a;",
    "float a; if (f > 0) a = 1; if (f > 0) r = a; /* the conditions may go together */",
    "float a; for (int i = 0; i < 3; i++) { if (i == 0) a = 1; else r = a; }",
    "float a; for (int i = 0; i < 3; i++) { if (i == 0) { a = 1; continue; } r = a; }",
    "float a; for (int i = 0; i < 3; i++) a = i; r = a; /* a loop counts as run */",
    "float a; if (f > 0) return; a = 1; r = a;",
    "float a; if (f > 0) a = 1; else return; r = a;",
    "string t; t = \"x\"; string w; if (t == w) r = 1;",
    "float a[2]; a[0] = 1; a[1] = 2; r = a[0];",
    "void set(float x) { x = 2; } float a; set(a); r = a; /* by reference */",
    "float a; void later() { a = 2; } later(); r = a; /* a nested function sees it */",
    "if (f > 0) return; r = 2;",
    "r = transform(\"object\", P)[0] + color(\"hsv\", 0, 1, 1)[0];",
    "float g(float _unused) { return 1; } r = g(2);",
    "#define DEBUG 0\n#define HALF 1/2\nshader s(output float r = 0) { if (DEBUG) r = 1; if (DEBUG > 1) r = 2; }",
    "#define SQUARE(x) x * x\nshader s(output float r = 0) { r = SQUARE(u); }",
    "float len(point P, float u) { return length(P) * u; }\nshader s(output float r = 0) { r = len(P, v); }",
    "shader s(float a = 1, float b = a, output float r = 0) { r = b; }",
    "#include \"library.h\"\nshader s(output float r = 0) { r = u; }",
    "shader s(output float r = 0) {\n  r = u;\n#pragma osl nowarn\n  float a;\n}",
    "float f(float x) { if (x > 0) { return 1; } else return 2; }\nshader s(output float r = 0) { r = f(u); }",
    "float f(float x) { while (1) { if (x > 0) return 1; x += 1; } }\nshader s(output float r = 0) { r = f(u); }",
    "float f(float x) { do { return x; } while (x > 1); }\nshader s(output float r = 0) { r = f(u); }",
    "#define LOG(x)\n#define SAY(x) x\nshader s(output float r = 0) { r = u; LOG(r); SAY(r); if (r > 1) LOG(2); if (r > 2) SAY(r = 1); }",
    "int i = 0; setmessage(\"a\", f); i++; error(\"x\"); while ((i = i + 1) < 3); r = i;",
    "int i; for (i = 0; i < 3 && i < f; i++); r = i; /* all of it in the head */",
    "if (f > 1); else r = 1;",
    "if ((0 < f) == (f < 1) || (f < 1) < r) r = 1;",
    "int on = f > 1; if (!on == !r || !on == 0) r = 1; if ((!on) > f) r = 2; if (!(f > 1)) r = 3;",
    "float f(float x) { return x; }\nfloat f(color _x, float y) { return 2; }\nfloat f(color x) { return x[0]; }\nshader s(output float r = 0) { r = f(u); }",
    "shader s(output float r = 0) { printf(\"%g\", u); }",
    "string t = \"x\"; t++; r = stof(t);",
    "shader s(output float r = u * 2, output float _spare = 0) {}",
    "int n = (int) f; r = (float) (n / 3) + float(n / 3) + n / 3.0; int k = n / 3; r += k;",
    "string kind = \"x\"; r = noise(kind, P) + noise(\"hash\", P) + noise(\"perlin\", P);",
    "float w = 1; getattribute(\"user:fov\", w); getattribute(\"my:thing\", w); r = w;",
    "r = smoothstep(f, 0.2, u) + clamp(f, 0, 1) + smoothstep(0.5, 0.5, u);",
    "color k = color(2, 1.5, 1) + color(100, 100, 100) + color(40.5, 0, 0) + color(1, 0, 1); r = k[0];",
    "if (f > 1) r = 1; else r = 2; if (f > 2) { } else { }",
    "float alpha = 0; color _k = c; color lost = texture(\"a.tx\", u, v, \"alpha\", alpha); r = alpha; /* the call is there for its output */",
    "int k = (int) (5 * noise(P)); if (noise(P) < 0.4 || k > noise(\"cell\", P)) r = k; /* only a float fits */",
    "float leave() { exit(); return 8; }\nshader s(output float r = 0) { r = leave(); }",
];

struct Library;

impl SourceProvider for Library {
    fn include(&self, name: &str, _: bool, _: &str) -> Result<(String, Arc<str>), String> {
        Ok((name.to_owned(), "float spare(float x) { float y; if (0) return 1/2; return 1; }\n".into()))
    }
}

fn source(case: &str) -> String {
    if case.contains("shader") {
        return format!("{case}\n");
    }
    // A component of a call is not valid OSL, but a short way to write a case.
    let case = case.replace("transform(\"object\", P)[0]", "length(transform(\"object\", P))");
    let case = case.replace("color(\"hsv\", 0, 1, 1)[0]", "luminance(color(\"hsv\", 0, 1, 1))");
    format!("shader s(float f = 1, color c = 1, output float r = 0) {{\n    {case}\n    r += f + c[0];\n}}\n")
}

fn lints(text: &str) -> (Vec<Diagnostic>, SourceMap) {
    let parsed = parse("case.osl", text, &Library, &Options::default());
    assert!(!parsed.has_errors(), "{text}\n{:#?}", parsed.diagnostics);
    let resolved = resolve(&parsed.ast);
    assert!(!resolved.diagnostics.iter().any(|d| d.is_error()), "{text}\n{:#?}", resolved.diagnostics);
    let options = lint::Options { silenced: parsed.silenced.clone(), ..lint::Options::default() };
    let list = lint::run(&parsed.ast, &resolved.program.unwrap(), &parsed.sources, &options);
    (list, parsed.sources)
}

#[test]
fn each_lint_has_its_snapshots() {
    let mut seen = BTreeSet::new();
    for (code, what, case) in CASES {
        let text = source(case);
        let (list, sources) = lints(&text);
        let said = render(&list, &sources, RenderStyle::default());
        assert!(list.iter().any(|d| d.code.id == *code), "{code} {what}\n{text}\n{said}");
        assert!(list.iter().all(|d| d.code.id == *code), "{code} {what}\n{text}\n{said}");
        assert!(list.iter().all(|d| d.help.is_some() && !d.label.is_empty()), "{code}");
        seen.insert(*code);
        let name = if what.is_empty() { (*code).to_owned() } else { format!("{code}-{what}") };
        insta::assert_snapshot!(name, format!("{text}----\n{said}"));
    }
    let missing: Vec<_> = LINTS.iter().filter(|l| !seen.contains(l.code.id)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn what_is_right_earns_nothing() {
    for case in CLEAN {
        let text = source(case);
        let (list, sources) = lints(&text);
        let parsed = parse("case.osl", &text, &Library, &Options::default());
        let warned = resolve(&parsed.ast).diagnostics;
        assert!(!warned.iter().any(|d| d.code.id == "W0201"), "{text}\n{warned:#?}");
        assert!(list.is_empty(), "{text}\n{}", render(&list, &sources, RenderStyle::default()));
    }
}

#[test]
fn a_fix_removes_its_finding_and_makes_no_other() {
    for (code, what, case) in CASES {
        let text = source(case);
        let (list, _) = lints(&text);
        for d in &list {
            let Some(fix) = d.fixes.first() else { continue };
            let mut fixed = text.clone();
            for edit in fix.edits.iter().rev() {
                fixed.replace_range(edit.span.start as usize..edit.span.end as usize, &edit.text);
            }
            let (left, sources) = lints(&fixed);
            let said = render(&left, &sources, RenderStyle::default());
            assert!(left.len() < list.len(), "{code} {what}\n{fixed}\n{said}");
        }
    }
}

#[test]
fn numbers_and_names_are_unique() {
    let ids: BTreeSet<_> = LINTS.iter().map(|l| l.code.id).collect();
    let names: BTreeSet<_> = LINTS.iter().map(|l| l.code.name).collect();
    assert_eq!((ids.len(), names.len()), (LINTS.len(), LINTS.len()));
}

#[test]
fn known_spaces_are_known() {
    let text = source("point p = transform(\"kitchen\", P); r = p[0];");
    let parsed = parse("case.osl", &text, &Library, &Options::default());
    let program = resolve(&parsed.ast).program.unwrap();
    let options = lint::Options { known_spaces: vec!["kitchen".to_owned()], ..lint::Options::default() };
    assert!(lint::run(&parsed.ast, &program, &parsed.sources, &options).is_empty());
}

#[test]
fn many_findings_end_somewhere() {
    let text = format!("shader s() {{ {} }}\n", "if (0) ; ".repeat(5_000));
    assert_eq!(lints(&text).0.len(), 200);
}
