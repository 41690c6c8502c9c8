//! Calls of built-ins: output arguments with side effects in their indices, the order of arguments, messages
//! by name.

use osl_exec::{Frame, RunOptions};
use osl_ir::passes;
use osl_scene::Grid;
use osl_tests::run;

/// Runs a body on points `u` = 0 … 1 with all passes, and without the optional ones; both must print the
/// same.
fn frame(body: &str, points: usize) -> Frame {
    let text = format!(
        "struct S {{ int m[2]; }};\nstruct T {{ float x; }};\nint next(output int k) {{ k += 1; return k - 1; }}\nshader s() {{\nint i = 0;\n{body}\n}}"
    );
    let grid = Grid::new(points, 1);
    let frames = [
        passes::Options::default(),
        passes::Options { without: passes::Pass::ALL.to_vec(), ..Default::default() },
    ]
    .map(|options| {
        let varying = osl_exec::PointSource::varying(&grid).to_vec();
        let options = passes::Options { varying, ..options };
        let compiled = run::compile("s.osl", &text, &[], &options).unwrap();
        osl_exec::run(&compiled.program, &run::services(), &grid, &RunOptions::default(), &|_| ()).unwrap()
    });
    let [all, none] = frames;
    assert_eq!(printed(&all), printed(&none), "{text}");
    all
}

fn printed(frame: &Frame) -> String {
    frame.printed.iter().map(|p| p.text.as_str()).collect()
}

fn prints(body: &str, expected: &str) {
    let frame = frame(body, 1);
    assert_eq!(printed(&frame), expected, "{body}");
    assert!(frame.messages.is_empty(), "{body}: {:?}", frame.messages);
}

/// A function writes variables; components are copies that are written back after it, even where they come
/// first.
#[test]
fn components_are_written_back_after_variables() {
    let both = "vector w = vector(0.6, 0, -0.8); normal n = normal(0, 0, 1); float k, t; vector r, q, a = 7;
        fresnel(w, n, 1.5, k, t, r, q);
        fresnel(w, n, 1.5, a[1], t, a, a);
        printf(\"%d %d %d %d\", a[0] == q[0], a[1] == k, a[2] == q[2], k > 0.01);";
    prints(both, "1 1 1 1");
}

#[test]
fn places_of_outputs_are_evaluated_once() {
    for (body, expected) in [
        ("float a[4]; float b[4]; sincos(0, a[i++], b[i++]); printf(\"%g %g %d\", a[0], b[1], i);", "0 1 2"),
        (
            "float a[4]; float b[4]; sincos(0, a[next(i)], b[next(i)]); printf(\"%g %g %d\", a[0], b[1], i);",
            "0 1 2",
        ),
        (
            "color c = 5; color d = 5; sincos(0, c[i++], d[i++]); printf(\"%g %g %d\", c, d, i);",
            "0 5 5 5 1 5 2",
        ),
        ("matrix m = 3; float b = 0; sincos(0, b, m[i++][i++]); printf(\"%g %d\", m[0][1], i);", "1 2"),
        ("T a[3]; T b[3]; sincos(0, a[i++].x, b[i++].x); printf(\"%g %g %d\", a[0].x, b[1].x, i);", "0 1 2"),
        (
            "float a[3] = { 7, 8, 9 }; int r = getmessage(\"m\", a[next(i)]); printf(\"%d %g %d\", r, a[0], i);",
            "0 7 1",
        ),
        (
            "float a[3] = { 7, 8, 9 }; setmessage(\"m\", 1.5); int r = getmessage(\"m\", a[next(i)]); \
             printf(\"%d %g %g %d\", r, a[0], a[1], i);",
            "1 1.5 8 1",
        ),
        (
            "string a[2]; int r = getattribute(\"shader:shadername\", a[i++]); printf(\"%d %s %s %d\", r, a[0], a[1], i);",
            "1 s  1",
        ),
        (
            "float a[3] = { 7, 8, 9 }; float r = texture(\"tex64.png\", 0.5, 0.5, \"alpha\", a[i++]); \
             printf(\"%d %g %d\", a[0] != 7, a[1], i);",
            "1 8 1",
        ),
        (
            "string a[2]; float r = texture(\"missing.png\", 0.5, 0.5, \"errormessage\", a[i++], \"blur\", i++); \
             printf(\"%d %d %d\", strlen(a[0]) > 0, strlen(a[1]), i);",
            "1 0 2",
        ),
    ] {
        prints(body, expected);
    }
}

#[test]
fn arrays_are_arguments_once() {
    for (body, expected) in [
        ("int m[2]; int r = regex_search(\"aab\", m, \"b\"); printf(\"%d %d %d\", r, m[0], m[1]);", "1 2 3"),
        ("S s; int r = regex_search(\"aab\", s.m, \"b\"); printf(\"%d %d\", s.m[0], s.m[1]);", "2 3"),
        (
            "string w[3]; int r = split(\"a b c\", w, \" \", next(i) + 2); printf(\"%d %s %d\", r, w, i);",
            "2 a b c  1",
        ),
        (
            "float a[2] = { 1, 2 }; float b[2]; setmessage(\"m\", a); getmessage(\"m\", b); printf(\"%g\", b);",
            "1 2",
        ),
        ("float a[2] = { 1, 2 }; float b[2]; printf(\"%g %d\", (i++, b = a), i);", "1 2 1"),
    ] {
        prints(body, expected);
    }
}

#[test]
fn arguments_run_left_to_right_and_variables_show_later_changes() {
    for (body, expected) in [
        ("i = 1; printf(\"%d %d %d\", i, i++, i);", "2 1 2"),
        ("i = 2; printf(\"%d %d\", i++, i);", "2 3"),
        ("float a[3]; sincos(next(i), a[next(i)], a[next(i)]); printf(\"%g %d\", a, i);", "0 0 1 3"),
        // Written back in the order of the arguments.
        ("float a[2]; sincos(0, a[0], a[0]); printf(\"%g\", a[0]);", "1"),
        // The index is evaluated when the argument has its turn.
        ("float a[3]; float b[3]; sincos(0, b[2], a[i]), i = 2; printf(\"%g %d\", a[0], i);", "1 2"),
        ("float a[3]; sincos(0, a[i], a[++i]); printf(\"%g %g %d\", a[0], a[1], i);", "0 1 1"),
    ] {
        prints(body, expected);
    }
}

/// The messages that a body leaves at `points` points, and what it prints there.
fn says(body: &str, points: usize, expected: &str, errors: &[&str]) {
    let frame = frame(body, points);
    assert_eq!(printed(&frame), expected, "{body}");
    let said = frame.said(|_| "HERE".into());
    assert_eq!(said.iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>(), errors, "{body}");
}

/// The same calls with literal names, and with computed ones.
fn both(body: &str, points: usize, expected: &str, errors: &[&str]) {
    says(&body.replace('@', "\"m\""), points, expected, errors);
    says(&body.replace('@', "format(\"%s\", \"m\")"), points, expected, errors);
    says(&body.replace('@', "(u > 5 ? \"other\" : \"m\")"), points, expected, errors);
    // One name computed, the others literal.
    says(&body.replacen('@', "substr(\"nm\", 1, 1)", 1).replace('@', "\"m\""), points, expected, errors);
    let last = body.rfind('@').unwrap();
    let last = format!("{}substr(\"nm\", 1, 1){}", &body[..last], &body[last + 1..]);
    says(&last.replace('@', "\"m\""), points, expected, errors);
}

#[test]
fn messages_by_name() {
    let twice = "message \"m\" already exists (created here: HERE) cannot set again from HERE";
    let late = "message \"m\" was queried before being set (queried here: HERE) setting it now (HERE) would lead to inconsistent results";
    let mismatch = |made: &str, first: &str, wanted: &str| {
        format!(
            "type mismatch for message \"m\" ({made} as {first} here: HERE) cannot fetch as {wanted} from HERE"
        )
    };
    both(
        "setmessage(@, 2.5); float x = 0; int r = getmessage(@, x); printf(\"%d %g\", r, x);",
        1,
        "1 2.5",
        &[],
    );
    both("float x = 9; int r = getmessage(@, x); printf(\"%d %g\", r, x);", 1, "0 9", &[]);
    both(
        "setmessage(@, 1.0); setmessage(@, 2); float x = 0; getmessage(@, x); printf(\"%g\", x);",
        1,
        "1",
        &[twice],
    );
    both(
        "float x = 9; getmessage(@, x); setmessage(@, 1.0); int r = getmessage(@, x); printf(\"%d %g\", r, x);",
        1,
        "0 9",
        &[late],
    );
    both(
        "setmessage(@, 1.0); int y = 7; int r = getmessage(@, y); printf(\"%d %d\", r, y);",
        1,
        "0 7",
        &[&mismatch("created", "float", "int")],
    );
    both(
        "setmessage(@, color(1)); vector y = 7; int r = getmessage(@, y); printf(\"%d %g\", r, y);",
        1,
        "0 7 7 7",
        &[&mismatch("created", "color", "vector")],
    );
    both(
        "int x = 9; getmessage(@, x); float y = 8; int r = getmessage(@, y); printf(\"%d %g\", r, y);",
        1,
        "0 8",
        &[&mismatch("queried", "int", "float")],
    );
    both(
        "float a[2] = { u, 2 }; setmessage(@, a); float b[2]; int r = getmessage(@, b); printf(\"%d %g \", r, b);",
        2,
        "1 0 2 1 1 2 ",
        &[],
    );
    both(
        "float a[2] = { u, 2 }; setmessage(@, a); float b[3]; int r = getmessage(@, b); printf(\"%d %g \", r, b);",
        1,
        "0 0 0 0 ",
        &[&mismatch("created", "float[2]", "float[3]")],
    );
    both(
        "matrix m = 2; m[3][1] = 4; setmessage(@, m); matrix k; getmessage(@, k); printf(\"%g %g\", k[3][1], k[2][2]);",
        1,
        "4 2",
        &[],
    );
    both("setmessage(@, \"text\"); string s; getmessage(@, s); printf(\"%s\", s);", 1, "text", &[]);
    both(
        "closure color a = 2 * diffuse(N); setmessage(@, a); closure color b; int r = getmessage(@, b); printf(\"%d %d\", r, !b);",
        1,
        "1 0",
        &[],
    );
    both(
        "if (u > 0.5) setmessage(@, u); float x = 9; int r = getmessage(@, x); printf(\"%d %g \", r, x);",
        2,
        "0 9 1 1 ",
        &[],
    );
    both(
        "setmessage(@, u * u); float x = 0; getmessage(@, x); printf(\"%g %g \", x, Dx(x));",
        1,
        "0.25 0 ",
        &[],
    );
    both(
        "setmessage(@, 3 * u); float x = 0; getmessage(@, x); printf(\"%g %g \", x, Dx(x));",
        2,
        "0 0 3 0 ",
        &[],
    );
}

#[test]
fn message_names_may_differ_from_point_to_point() {
    let body = "string name = u > 0.5 ? \"a\" : \"b\"; setmessage(name, u); float x = -1; \
                int r = getmessage(\"a\", x); printf(\"%d %g \", r, x);";
    says(body, 3, "0 -1 0 -1 1 1 ", &[]);
    let many = "for (int k = 0; k < 50; ++k) setmessage(format(\"m%d\", k), k * k); int sum = 0; \
                for (int k = 0; k < 60; ++k) { int x = 0; if (getmessage(format(\"m%d\", k), x)) sum += x; } \
                printf(\"%d \", sum);";
    says(many, 2, "40425 40425 ", &[]);
}

#[test]
fn too_many_messages_are_an_error() {
    let text = "shader s() { for (int k = 0; k < 70000; ++k) setmessage(format(\"m%d\", k), k); }";
    let mut options = RunOptions { limits: run::steps(1 << 30), ..RunOptions::default() };
    options.limits.running.point_memory = 4 << 20;
    let stop = run::run("s.osl", text, &[], &Grid::new(1, 1), &options).unwrap_err();
    assert_eq!(stop, "the strings, messages and closures of point 0 take more than 4194304 bytes");
}
