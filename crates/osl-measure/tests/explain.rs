//! Explanations of single points, as people read them.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_exec::{PointSource, RunOptions, Services};
use osl_ir::passes;
use osl_limits::Limits;
use osl_measure::explain::text::{self, Style};
use osl_measure::explain::{Subject, cost, explain};
use osl_measure::trace::{OnePoint, follow, prepare};
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use std::sync::Arc;

const LOOP: &str = "\
shader s(float k = 2, output float r = 0, output float other = 1)
{
    float x = u * k;
    for (int i = 0; i < 3; i++) {
        if (x > 0.5)
            r += sin(x) + i;
        else
            r -= noise(P * 4);
        x *= 1.3;
    }
    other = cellnoise(v * 10);
    if (other < -100)
        other = 0;
}
";

/// Copies, calls, returns, jumps, conditions within expressions, equal and unneeded computations, closures.
const ALL: &str = "\
float f(float x) { if (x > 0.5) return 1; float y = x * 2; return y; }
void two(float x, output float y, output float z) { y = x; z = 2 * x; }
float scene(point p) {
    float d = length(p) - 0.3;
    for (int k = 0; k < 10; k++) { if (d > 1 + k) continue; d += 0.01; if (d > 0.9) break; }
    return d;
}
shader a(output float x = 0, output float b = 0, output color c = 0, output closure color k = 0)
{
    float q = 1;
    x = q;
    float t = u;
    int n = 0;
    while (n < 20) {
        if (t > 0.5) break;
        if (n % 2 == 0) { n++; continue; }
        t += 0.05;
        n++;
    }
    float s = scene(P);
    if (s > 0.2)
        b = f(u) + f(v);
    float y, z;
    two(u, y, z);
    float w = y * z;
    float w2 = y * z;
    float unused = sin(w);
    c = color(w, w2, u < 0.5 ? 1 : 2);
    if (s > 0.1 && t > 3 || n == 0) c *= 2;
    k = 0.5 * diffuse(N) + w * oren_nayar(N, 0.3);
    if (0 > 1) c = 0;
    if (t > 0.3) return;
    c = 1;
}
";

fn explained(source: &str, outputs: Option<&[&str]>, at: (usize, usize), exact: bool) -> String {
    let checked = stages::check("s.osl", source, &NoFiles, &Options::default());
    let program = checked.program.expect("it compiles");
    let noted = stages::lower_noted(&program, &[]).unwrap();
    let grid = Grid::new(16, 16);
    let outputs: Option<Vec<Arc<str>>> = outputs.map(|o| o.iter().map(|n| (*n).into()).collect());
    let options = passes::Options { outputs, varying: grid.varying().to_vec(), ..passes::Options::default() };
    let subject = Subject::new(noted, &options, &checked.sources);
    let point = OnePoint::at_pixel(&grid, 16, 16, at.0, at.1).unwrap();
    let services = Services::default();
    let trace = follow(&subject.body, &services, OnePoint { source: &grid, point }, &Limits::default());
    let style = Style { exact, ..Style::default() };
    text::text(&explain(&trace, &subject, &checked.sources), "a pixel", style)
}

#[test]
fn a_loop_with_a_branch() {
    insta::assert_snapshot!(explained(LOOP, None, (5, 9), false));
}

#[test]
fn what_is_not_needed_is_said() {
    insta::assert_snapshot!(explained(LOOP, Some(&["other"]), (5, 9), true));
}

#[test]
fn every_line_has_its_own_facts() {
    insta::assert_snapshot!(explained(ALL, None, (5, 11), false));
}

/// The sentences below a line of an explanation, without the line itself.
fn below(text: &str, line: u32) -> Vec<String> {
    let head = format!("{line} | ");
    let mut lines = text.lines().skip_while(|l| !l.trim_start().starts_with(&head)).skip(1);
    let mut out = Vec::new();
    while let Some(told) = lines.next().and_then(|l| l.trim_start().strip_prefix(":   ")) {
        out.push(told.to_string());
    }
    out
}

#[test]
fn copies_have_values() {
    let text = explained(
        "shader s(output float x = 0, output float a = 0) {
            float y = u * 2;
            float q = y;
            x = q;
            a = Dx(y);
        }",
        None,
        (4, 4),
        false,
    );
    assert_eq!(below(&text, 3), ["q = 0.533333"]);
    assert_eq!(below(&text, 4), ["x = 0.533333"]);
    assert!(below(&text, 5).contains(&"a = 0.133333".to_string()), "{text}");
    assert!(!text.contains("\nnot needed"), "{text}");
}

#[test]
fn outcomes_stand_on_their_own_line() {
    let text = explained(
        "shader s(output float r = 0) {
            float t = 0; int n = 0;
            while (n < 20) {
                if (t > 0.5) break;
                if (n % 2 == 0) { n++; continue; }
                if (t > 9)
                    n = 100;
                t += 0.2; n++;
            }
            if (u < 5) return;
            r = 1;
        }",
        None,
        (4, 4),
        false,
    );
    assert_eq!(below(&text, 3), ["7 rounds"]);
    assert_eq!(below(&text, 4)[0], "true once, false 6 times");
    assert_eq!(below(&text, 5)[0], "true 3 times, false 3 times");
    assert_eq!(below(&text, 6)[0], "false 3 times");
    assert_eq!(below(&text, 7), ["does not run: `t > 9` (line 6) is false"]);
    assert_eq!(below(&text, 10), ["true"]);
    assert_eq!(below(&text, 11), ["does not run: `u < 5` (line 10) is true"]);
}

#[test]
fn calls_are_told_apart() {
    let text = explained(
        "float many(int n, float x) {
            float b = 0;
            for (int i = 0; i < n; i++)
                b += x;
            return b;
        }
        shader s(output float r = 0) {
            color b = color(u);
            r = many(2, u) + many(3, v);
        }",
        None,
        (4, 4),
        false,
    );
    assert!(below(&text, 3).contains(&"2 rounds (call 1); 3 rounds (call 2)".to_string()), "{text}");
    assert_eq!(below(&text, 5), ["returns 0.533333 (call 1); 0.8 (call 2)"]);
    assert_eq!(
        below(&text, 8),
        ["b = (0.266667 0.266667 0.266667)", "not needed: the output `r` does not depend on it"]
    );
}

/// What the compiler makes of a line differs from call to call.
#[test]
fn each_call_has_its_own_status() {
    let source = "float twice(float x) {
            float y = x + x;
            return y;
        }
        shader s(output float f = 0, output float g = 0) {
            g = twice(3);
            f = twice(u);
        }";
    let all = explained(source, None, (4, 4), false);
    assert_eq!(below(&all, 2), ["y = 6 (known when the shader is compiled) (call 1); 0.533333 (call 2)"]);
    let one = explained(source, Some(&["f"]), (4, 4), false);
    assert_eq!(
        below(&one, 2),
        [
            "y = 6 (not needed) (call 1); 0.533333 (call 2)",
            "not needed: the output `f` does not depend on these values of `y`",
        ]
    );
}

/// An int literal is converted too; a value that the source converts itself is not.
#[test]
fn converted_arguments_are_named() {
    let call = |call: &str, said: &str| {
        let text = format!("shader s(output float r = 0) {{\n    r = {call};\n}}");
        let lines = below(&explained(&text, None, (1, 1), false), 2);
        assert!(
            lines.iter().any(|line| line.contains("calls ") && line.contains(said)),
            "{call}: {lines:#?}"
        );
    };
    call("pow(u, 2)", "(one of 9 forms; argument 2 is converted)");
    call("mix(0, 1, u)", "(one of 11 forms; arguments 1, 2 are converted)");
    call("length(P)", "(argument 1 is converted)");
    for exact in ["pow(u, 2.0)", "pow(u, float(2))", "length(vector(P))", "distance(P, (point) N)"] {
        call(exact, "exactly these types)");
    }
}

#[test]
fn transformations_say_what_they_do() {
    let text = explained(
        "shader s(output float r = 0) {
            matrix m = matrix(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 2, 3, 4, 1);
            point p = transform(m, P);
            vector d = transform(m, vector(1, 2, 3));
            normal n = transform(m, normal(1, 2, 3));
            r = p[0] + d[0] + n[0];
        }",
        None,
        (4, 4),
        false,
    );
    let told = |line: u32| below(&text, line)[1].clone();
    let matrix = "[1 0 0 0 0 1 0 0 0 0 1 0 2 3 4 1]";
    assert_eq!(told(3), format!("  a point: with the translation of the matrix {matrix}"));
    assert_eq!(told(4), format!("  a vector: without the translation of the matrix {matrix}"));
    assert!(told(5).starts_with("  a normal: by the transposed inverse of the matrix"), "{text}");
}

#[test]
fn closures_are_null_as_in_a_run() {
    let text = explained(
        "shader s(output float r = 0) {
            closure color none = 0 * diffuse(N);
            if (none)
                r = 1;
            closure color some = none + 2 * emission();
            if (some)
                r += 2;
            string text = format(\"%s\", some);
        }",
        None,
        (4, 4),
        false,
    );
    assert_eq!(below(&text, 3), ["false; known when the shader is compiled"]);
    assert_eq!(below(&text, 6), ["true"]);
    assert!(
        below(&text, 2).contains(&"none = null (known when the shader is compiled)".to_string()),
        "{text}"
    );
    assert!(below(&text, 5).contains(&"some = 2 * emission()".to_string()), "{text}");
    assert!(below(&text, 8).contains(&"text = \"(2, 2, 2) * emission ()\"".to_string()), "{text}");
}

/// A regular expression costs more steps than most calls of a trace.
#[test]
fn regular_expressions_have_their_results() {
    let source = "shader s(string text = \"-3.5e1\", output float r = 0) {
            if (regex_match(text, \"[0-9.e-]*\"))
                r = 1 + regex_search(\"a b,c\", \"[,;]\");
        }";
    let text = explained(source, None, (4, 4), false);
    assert!(below(&text, 2).contains(&"true".to_string()), "{text}");
    assert!(below(&text, 3).contains(&"r = 2".to_string()), "{text}");
}

#[test]
fn what_is_traced_is_what_a_run_computes() {
    let sources = [
        LOOP,
        "shader s(output color r = 0, output float q = 0, output string t = \"\") {
            float a[4] = { 1, 2, 3, 4 }; for (int i = 0; i < 4; i++) a[i] *= noise(P * i) + Dx(u);
            t = format(\"%g\", a[2]); r = transformc(\"hsv\", \"rgb\", color(a[0], a[1], a[int(u * 4)]));
            q = spline(\"catmull-rom\", v, a) + hash(u) + strlen(t) + filterwidth(snoise(P * 3)); }",
        "shader s(output float r = 0, output point p = 0) { int n = 0;
            while (1) { if (n > 3) break; n++; if (n == 2) continue; r += pnoise(u * n, 3.0); }
            p = transform(\"shader\", \"world\", P + n) + noise(\"gabor\", P); }",
    ];
    for source in sources {
        let checked = stages::check("s.osl", source, &NoFiles, &Options::default());
        let program = checked.program.expect("it compiles");
        let grid = Grid::new(7, 5);
        let options = passes::Options { varying: grid.varying().to_vec(), ..passes::Options::default() };
        let plain = stages::lower(&program, &[]).unwrap();
        let services = Services::default();
        let compiled = stages::finish(plain, &options);
        let frame =
            osl_exec::run(&compiled.program, &services, &grid, &RunOptions::default(), &|_| ()).unwrap();
        let body =
            prepare(stages::lower_noted(&program, &[]).unwrap(), &options.varying, &[], &options.limits);
        for pixel in [0, 11, 17, 34] {
            let point = OnePoint::at_pixel(&grid, 7, 5, pixel % 7, pixel / 7).unwrap();
            let trace = follow(&body, &services, OnePoint { source: &grid, point }, &Limits::default());
            for plane in &frame.planes {
                let (_, _, nodes) = trace.outputs.iter().find(|(n, ..)| *n == plane.output).unwrap();
                let value = osl_measure::trace::Exact::widen(trace.node(nodes[0]).strict.as_ref().unwrap());
                let expected = f64::from(f32::from_bits(plane.words[pixel]));
                let expected = if plane.kind == osl_ir::ir::Kind::Int {
                    f64::from(plane.words[pixel].cast_signed())
                } else {
                    expected
                };
                assert_eq!(value.numbers()[plane.component], expected, "{} {pixel}", plane.output);
            }
        }
    }
}

#[test]
fn a_way_without_end_is_cut() {
    for source in [
        "shader s(output float r = 0) { int x = 1; while (x) {} r = 1; }",
        "shader s(output float r = 0) { while (1) r += noise(\"gabor\", P * r); }",
    ] {
        assert!(explained(source, None, (1, 1), false).contains("too long to be followed"), "{source}");
    }
    let loops: String = (0..100).map(|i| format!("for (int i{i} = 0; i{i} < 2; i{i}++) ")).collect();
    let source = format!("shader s(output float r = 0) {{\nfloat x = u;\n{loops}\nr += 1; }}");
    let text = explained(&source, None, (1, 1), false);
    assert!(text.contains("too long to be followed") && text.contains("not needed"), "{text}");
}

#[test]
fn needs_cross_the_rounds_of_nested_loops() {
    // A value reaches the output through three variables, against the order of the statements, and each step
    // takes another round of another loop.
    let source = "shader s(output float r = 0) {
        float a = 0, b = 0, c = 0, d = 0;
        for (int i = 0; i < 3; i++) {
            r = a;
            for (int j = 0; j < 2; j++) {
                a = b;
                for (int k = 0; k < 2; k++) {
                    b = c;
                    d = c;
                }
            }
            c = u;
        }
    }";
    let text = explained(source, None, (1, 1), false);
    assert!(text.contains("d = 0 (not needed)"), "{text}");
    let is_idle = |line: u32| {
        below(&text, line)
            .iter()
            .any(|told| told.starts_with("not needed: the output `r` does not depend on it"))
    };
    assert_eq!([4, 6, 8, 9, 12].map(is_idle), [false, false, false, true, false], "{text}");
}

#[test]
fn costs_are_told_by_output() {
    let checked = stages::check("s.osl", LOOP, &NoFiles, &Options::default());
    let body = stages::lower(&checked.program.unwrap(), &[]).unwrap();
    let costs = cost(&body, &passes::Options::default());
    let of = |name: &str| costs.iter().find(|c| c.output == name).unwrap().clone();
    assert!(of("other").instructions < of("all asked for").instructions);
    assert_eq!(of("all asked for").noises, of("r").noises + of("other").noises);
}

#[test]
fn the_mask_alone_evaluates_no_simplex_noise() {
    use osl_ir::ir::{Kernel, NoiseField, Op};
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../osl/Cobbled.osl");
    let text = std::fs::read_to_string(path).unwrap();
    let checked = stages::check("Cobbled.osl", &text, &NoFiles, &Options::default());
    let program = checked.program.unwrap();
    let simplex = |outputs: Option<&str>| {
        let outputs = outputs.map(|o| vec![o.into()]);
        let options = passes::Options { outputs, ..passes::Options::default() };
        let body = stages::finish(stages::lower(&program, &[]).unwrap(), &options).body;
        let is_simplex = |op: &Op| {
            matches!(
                op,
                Op::Kernel(
                    Kernel::Noise { field: NoiseField::Simplex | NoiseField::USimplex, .. }
                        | Kernel::NamedNoise { .. },
                    _
                )
            )
        };
        let mut blocks = vec![body.entry];
        let mut count = 0;
        while let Some(block) = blocks.pop() {
            for inst in &body.block(block).insts {
                count += usize::from(is_simplex(&inst.op));
                match &inst.op {
                    Op::If { then, otherwise, .. } => blocks.extend([*then, *otherwise]),
                    Op::Loop { body, .. } => blocks.push(*body),
                    _ => {}
                }
            }
        }
        count
    };
    assert_eq!(simplex(Some("resultMask")), 0);
    assert!(simplex(None) >= 8);
}
