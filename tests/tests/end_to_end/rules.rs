//! Rules of the language that are easy to miss, each as in the reference.

use osl::stages;
use osl_syntax::{NoFiles, Options};
use osl_tests::ways::prints;

#[test]
fn a_color_stays_in_its_space_only_by_constant_names() {
    let head = "shader s(string a = \"hsv\") { color c = color(1, 0.5, 0.25);";
    for (body, expected) in [
        // Hue 1 becomes 0 on the way through RGB.
        ("printf(\"%g\", transformc(\"hsv\", \"hsv\", c));", "1 0.5 0.25"),
        ("printf(\"%g\", transformc(a, \"hsv\", c));", "1 0.5 0.25"),
        ("printf(\"%g\", transformc(a, a, color(1, 0.5, 0.25)));", "1 0.5 0.25"),
        ("string b = u > 5 ? \"rgb\" : \"hsv\"; printf(\"%g\", transformc(b, b, c));", "0 0.5 0.25"),
        (
            "string b[2] = {\"hsv\", \"rgb\"}; for (int i = 0; i < 2; ++i) printf(\"%g;\", transformc(b[i], b[i], c));",
            "0 0.5 0.25;1 0.5 0.25;",
        ),
    ] {
        prints(&format!("{head} {body} }}"), expected);
    }
}

#[test]
fn functions_that_differ_in_what_they_return() {
    let head = "struct A { int x; }; struct B { int x; };
        A one() { printf(\"A\"); return A(1); }
        B two() { printf(\"B\"); return B(2); }";
    for (functions, body, expected) in [
        ("void one() { printf(\"void\"); }", "one();", "A"),
        (
            "void two() { printf(\"void\"); } matrix two() { printf(\"matrix\"); return 1; }",
            "two();",
            "matrix",
        ),
        ("int one() { printf(\"int\"); return 1; }", "A a = one();", "A"),
        ("A two() { printf(\"A\"); return A(3); }", "B b = two(); printf(\"%d\", b.x);", "B2"),
    ] {
        prints(&format!("{head} {functions} shader s() {{ {body} }}"), expected);
    }
    let tied = format!("{head} A two() {{ return A(3); }} int two() {{ return 1; }} shader s() {{ two(); }}");
    assert!(stages::check("s.osl", &tied, &NoFiles, &Options::default()).program.is_none());
}

#[test]
fn what_computes_an_interactive_default_never_runs() {
    prints(
        "int noisy() { printf(\"never\"); return 3; }
        shader s(int a = noisy() [[ int interactive = 1 ]], int b = 4 [[ int interactive = 1 ]], int c = 1 + b,
            int d = noisy() + 2 [[ int interactive = 0 ]], float e[2] = {1, u} [[ int interactive = 1 ]])
        { printf(\"%d %d %d %d %g\", a, b, c, d, e); }",
        "never0 4 5 5 0 0",
    );
}

#[test]
fn one_vector_may_stand_for_knots() {
    prints(
        "vector curve(float x, vector k) { return spline(\"linear\", x, k); }
        shader s() { printf(\"%g\", curve(0.5, vector(1, 2, 3))); }",
        "1 2 3",
    );
    let color = "color curve(float x, color k) { return spline(\"linear\", x, k); } shader s() { }";
    assert!(stages::check("s.osl", color, &NoFiles, &Options::default()).program.is_none());
}

#[test]
fn a_shader_by_itself_is_connected_to_nothing_unless_asked() {
    prints("shader s(output float o = 0) { printf(\"%d\", isconnected(o)); }", "0");
}
