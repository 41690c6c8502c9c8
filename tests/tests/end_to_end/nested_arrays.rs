//! Arrays of structs that hold arrays, at any depth: own elements, copies, arguments and lists.

use osl::stages;
use osl_exec::{Frame, RunOptions};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_tests::agree::{self, Verdict};
use osl_tests::run;

/// Structs and functions of every form.
const HEAD: &str = "
struct Leaf { float x; color c; };
struct S { float x; float w[2]; Leaf l; };
struct T { S s; string names[3]; };
struct U { T t[2]; float z[2]; };
float sum(float a[]) { float s = 0; for (int i = 0; i < arraylength(a); i++) s = 10 * s + a[i]; return s; }
float fixed(float a[2]) { return a[0] + 10 * a[1]; }
void fill(output float a[2], float x) { a[0] = x; a[1] = x + 1; }
void fill_open(output float a[], float x) { for (int i = 0; i < arraylength(a); i++) a[i] = x + i; }
void set(output S h[], int at, float x) { h[at].w[1] = x; h[at].l.c[1] = x; }
void own(S h[3]) { h[0].w[0] = 9; }
S make(float x) { S s = { x, { x, x * 2 }, { x, color(x) } }; return s; }
string show(S h[]) {
    string t = \"\";
    for (int i = 0; i < arraylength(h); i++) t = concat(t, format(\"%g:%g,%g:%g \", h[i].x, h[i].w[0], h[i].w[1], h[i].l.c[1]));
    return t;
}
";

/// Three elements, `1:2,3:1 4:5,6:2 7:8,9:3 ` as `show` prints them.
const LIST: &str = "S h[3] = { { 1, { 2, 3 }, { 1, color(1) } }, { 4, { 5, 6 }, { 2, color(2) } }, { 7, { 8, 9 }, { 3, color(3) } } };";

fn frame(text: &str) -> Frame {
    run::run("s.osl", text, &[], &Grid::new(1, 1), &RunOptions::default()).unwrap()
}

fn shader(body: &str) -> String {
    format!("{HEAD}shader s(output float r = 0) {{ {LIST} {body} }}")
}

/// The text that a shader with this body prints; the walker must agree.
fn printed(body: &str) -> String {
    let text = shader(body);
    assert_eq!(agree::hold(&text, false), Ok(Verdict::Same), "{body}");
    frame(&text).printed.iter().map(|p| p.text.as_str()).collect()
}

#[test]
fn each_element_has_arrays_of_its_own() {
    for (body, expected) in [
        ("printf(\"%s\", show(h));", "1:2,3:1 4:5,6:2 7:8,9:3 "),
        ("h[1].w[0] = 0; h[2].w[1] += 1; printf(\"%s\", show(h));", "1:2,3:1 4:0,6:2 7:8,10:3 "),
        ("int i = int(u + 1); h[i].w[i] = 0; printf(\"%s\", show(h));", "1:2,3:1 4:5,0:2 7:8,9:3 "),
        ("S k = h[1]; h[0] = k; h[1].w[0] = 0; printf(\"%s\", show(h));", "4:5,6:2 4:0,6:2 7:8,9:3 "),
        ("S g[3]; g = h; h[0] = make(0); g[1] = g[2]; printf(\"%s\", show(g));", "1:2,3:1 7:8,9:3 7:8,9:3 "),
        ("h[0].w = h[2].w; printf(\"%s\", show(h));", "1:8,9:1 4:5,6:2 7:8,9:3 "),
        (
            "float a[2]; a = h[1].w; a[0] = 0; h[2].w = a; printf(\"%s\", show(h));",
            "1:2,3:1 4:5,6:2 7:0,6:3 ",
        ),
        (
            "float a[2] = { 1, 1 }; S g[2] = { { 1, a, { 0, 0 } }, h[2] }; printf(\"%s\", show(g));",
            "1:1,1:0 7:8,9:3 ",
        ),
        ("printf(\"%d %d %g\", arraylength(h), arraylength(h[1].w), h[2].w);", "3 2 8 9"),
    ] {
        assert_eq!(printed(body), expected, "{body}");
    }
}

#[test]
fn published_ones_have_their_values() {
    let knots = "struct knot { color c; float w[4]; };
        shader s(output float a = 0, output float b = 0, output float c = 0, output float len = 0) {
            knot d[5];
            for (int i = 0; i < 5; i++) for (int j = 0; j < 4; j++) d[i].w[j] = 10 * i + j;
            a = d[0].w[3]; b = d[2].w[1]; c = d[4].w[0]; len = arraylength(d[1].w); }";
    let copy = "struct S { float x; float w[2]; };
        shader s(output float r = 0, output float s = 0) {
            S h[3] = { { 1, { 2, 3 } }, { 4, { 5, 6 } }, { 7, { 8, 9 } } };
            r = h[0].w[0] + 10 * h[1].w[1] + 100 * h[2].w[0];
            S t = h[1]; h[0] = t; s = h[0].x + 10 * h[2].w[1]; }";
    for (text, expected) in [(knots, &[3.0, 21.0, 40.0, 4.0][..]), (copy, &[862.0, 94.0])] {
        assert_eq!(agree::hold(text, false), Ok(Verdict::Same));
        let values: Vec<f32> = frame(text).planes.iter().map(|p| f32::from_bits(p.words[0])).collect();
        assert_eq!(values, expected);
    }
}

#[test]
fn they_are_arguments() {
    for (body, expected) in [
        ("printf(\"%g %g\", sum(h[1].w), fixed(h[2].w));", "56 98"),
        ("fill(h[0].w, 4); fill_open(h[2].w, 6); printf(\"%s\", show(h));", "1:4,5:1 4:5,6:2 7:6,7:3 "),
        ("int i = int(v * 2); fill(h[i].w, 4); printf(\"%s\", show(h));", "1:2,3:1 4:4,5:2 7:8,9:3 "),
        ("set(h, 1, 7); own(h); printf(\"%s\", show(h));", "1:9,3:1 4:5,7:7 7:8,9:3 "),
    ] {
        assert_eq!(printed(body), expected, "{body}");
    }
}

#[test]
fn functions_of_the_language_write_them() {
    let body = "T q[2]; int n = split(\"a b c\", q[1].names, \" \"); int m = split(\"x y\", q[int(v)].names);
        printf(\"%d%d %s %s\", n, m, q[0].names, q[1].names);";
    let printed: String = frame(&shader(body)).printed.iter().map(|p| p.text.as_str()).collect();
    assert_eq!(printed, "32 x y  a b c");
}

#[test]
fn they_nest_at_any_depth() {
    let body = "U x[3]; x[2].t[1].s.w[1] = 7; x[1].t[1].s = h[1]; x[1].t[0].names[2] = \"a\"; x[0] = x[1]; x[0].z[1] = 5;
        U y[3]; y = x; y[0].t[1].s.w[0] = 0; x[1].t = y[2].t; T t = y[0].t[0]; t.names[1] = \"b\";
        printf(\"%g %g %g %g %g|%s%s|%s%s|%g %g %d %d\", x[0].t[1].s.w, y[0].t[1].s.w, x[1].t[1].s.w, x[1].t[0].s.w, y[1].t[1].s.w,
            t.names[1], t.names[2], x[0].t[0].names[1], x[0].t[0].names[2], x[0].z, x[1].z, arraylength(x[1].t), arraylength(x[1].t[1].names));";
    assert_eq!(printed(body), "5 6 0 6 0 7 0 0 5 6|ba|a|0 5 0 0 2 3");
}

#[test]
fn each_index_out_of_range_is_told_and_clamped() {
    let text = shader("int i = int(u) + 5; h[i].w[i - 6] = 20; r = h[2].w[0] + h[-i].w[9];");
    assert_eq!(agree::hold(&text, false), Ok(Verdict::Same));
    let frame = frame(&text);
    assert_eq!(f32::from_bits(frame.planes[0].words[0]), 23.0);
    let mut said: Vec<&str> =
        frame.messages.iter().map(|m| m.message.text.split(':').next().unwrap_or_default()).collect();
    said.sort_unstable();
    let expected = [
        "Index [-1] out of range h.w[0..1]",
        "Index [-5] out of range h[0..2]",
        "Index [5] out of range h[0..2]",
        "Index [9] out of range h.w[0..1]",
    ];
    assert_eq!(said, expected);
}

#[test]
fn they_cannot_be_written_as_a_compiled_shader() {
    let unused =
        "struct S { float w[2]; }; struct T { S s[2]; }; shader s(output float r = 0) { S a; r = a.w[1]; }";
    for (text, code) in [(shader("r = h[1].w[1];"), Some("E0310")), (unused.to_string(), None)] {
        let checked = stages::check("s.osl", &text, &NoFiles, &Options::default());
        let program = checked.program.unwrap();
        let written = osl_hir::oso::write(&program, &checked.sources, &Default::default());
        assert_eq!(written.err().map(|list| list[0].code.id), code);
    }
}
