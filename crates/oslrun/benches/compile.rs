//! The time of compiling, from text to program: the seed shaders, and generated shaders of several kinds and
//! lengths. Expect: under 5 ms for each seed, and a constant time per line for any length.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use osl::stages;
use osl_exec::Program;
use osl_ir::passes;
use std::fmt::Write;
use std::path::Path;

const SEEDS: [&str; 6] = [
    "osl/Cobbled.osl",
    "osl/flakes.osl",
    "osl/chaosmosaic.osl",
    "osl/strips.osl",
    "osl/nonlinear_noise.osl",
    "tests/data/seeds/sprinkles.repaired.osl",
];

/// A name, and a function that generates a shader with a number of lines.
type Kind = (&'static str, fn(usize) -> String);

const LENGTHS: [usize; 4] = [1000, 2000, 5000, 10_000];

fn compile(text: &str) -> Program {
    let checked = stages::check("s.osl", text, &osl_syntax::NoFiles, &osl_syntax::Options::default());
    let program = checked.program.unwrap_or_else(|| panic!("{:?}", checked.diagnostics));
    let body = stages::lower(&program, &[]).expect("a body");
    stages::finish(body, &passes::Options::default()).program
}

/// Each line computes from the lines before it.
fn straight(lines: usize) -> String {
    let mut text = String::from("shader s(output color r = 0) {\ncolor a = P; float x = u;\n");
    for n in 0..lines / 2 {
        let _ = writeln!(text, "x = x * 0.{n} + sin(v * {n}.5);");
        let _ = writeln!(text, "a = mix(a, color(x, v, {n}.25), 0.5) + a * x;");
    }
    text + "r = a;\n}\n"
}

/// Functions of five lines, each called once; some call the previous one.
fn functions(lines: usize) -> String {
    let mut text = String::new();
    for n in 0..lines / 6 {
        let _ = writeln!(
            text,
            "float f{n}(float x, output float y) {{\n    float z = x * {n}.5;\n    if (z > 0.5)\n        y = noise(z);\n    return z + y;\n}}"
        );
    }
    text += "shader s(output float r = 0) {\nfloat y = u;\n";
    for n in 0..lines / 6 {
        let _ = writeln!(text, "r += f{n}(v, y);");
    }
    text + "}\n"
}

/// Loops with branches in them, side by side.
fn branches(lines: usize) -> String {
    let mut text = String::from("shader s(output float r = 0) {\nfloat x = u; float y = v; int k = 0;\n");
    for n in 0..lines / 8 {
        let _ = writeln!(
            text,
            "for (int i = 0; i < 4; i++) {{\n    if (x > 0.{n}) {{\n        x = y * i + {n};\n        if (y < x) break;\n    }} else {{\n        y += x; k++;\n    }}\n}}"
        );
    }
    text + "r = x + y + k;\n}\n"
}

/// Blocks of branches and loops nested deep.
fn nested(lines: usize) -> String {
    const DEPTH: usize = 20;
    let mut text = String::from("shader s(output float r = 0) {\nfloat x = u; float y = v;\n");
    for n in 0..lines / (2 * DEPTH + 1) {
        for d in 0..DEPTH {
            let head = if d % 7 == 3 {
                format!("for (int i{d} = 0; i{d} < 2; i{d}++)")
            } else {
                format!("if (x > {d}.5)")
            };
            let _ = writeln!(text, "{head} {{");
        }
        let _ = writeln!(text, "x += y * {n};");
        text += &"}\n".repeat(DEPTH);
    }
    text + "r = x;\n}\n"
}

/// One parameter per line, half of them outputs that depend on the others.
fn params(lines: usize) -> String {
    let list: Vec<String> =
        (0..lines / 2).map(|n| format!("    float p{n} = {n},\n    output color o{n} = p{n} * u")).collect();
    format!("shader s(\n{}\n) {{\n    o0 = P;\n}}\n", list.join(",\n"))
}

/// Expressions of many operators, one to ten lines.
fn expressions(lines: usize) -> String {
    let mut text = String::from("shader s(output float r = 0) {\n");
    for n in 0..lines / 10 {
        let _ = writeln!(text, "r = ({}r", "(".repeat(18));
        for m in 0..9 {
            let _ = writeln!(text, "    * u + {n}.{m}) - cos(v / {m}.5))");
        }
        text += ");\n";
    }
    text + "}\n"
}

/// Arrays and structs written and read by index.
fn arrays(lines: usize) -> String {
    let mut text = String::from(
        "struct S { float a; color b; };\nshader s(output float r = 0) {\nfloat a[16]; S t[4]; int k = int(u * 9);\n",
    );
    for n in 0..lines / 4 {
        let _ = writeln!(
            text,
            "a[{}] = u * {n};\na[k % 16] += v;\nt[k % 4].b = color(a[{}]);\nr += t[{}].b[1];",
            n % 16,
            n % 13,
            n % 4
        );
    }
    text + "}\n"
}

/// Values that move to the next variable in each iteration of a loop.
fn chain(lines: usize) -> String {
    let mut text = String::from("shader s(output float r = 0) {\n");
    for n in 0..lines / 2 {
        let _ = writeln!(text, "float x{n} = 0;");
    }
    text += "for (int i = 0; i < 4; i++) {\n";
    for n in (1..lines / 2).rev() {
        let _ = writeln!(text, "x{n} = x{};", n - 1);
    }
    text + &format!("x0 = u + i;\n}}\nr = x{};\n}}\n", lines / 2 - 1)
}

/// Text for lints and format checks, messages and derivatives.
fn calls(lines: usize) -> String {
    let mut text = String::from("shader s(output float r = 0) {\ncolor c = P; string t = \"a\";\n");
    for n in 0..lines / 4 {
        let _ = writeln!(
            text,
            "t = format(\"%g %d\", u, {n});\nif (Dx(r) > {n}) printf(\"%s %g\\n\", t, c);\nr += filterwidth(c[1] * u);\nc = (color)noise(\"perlin\", P * {n}) + transform(\"shader\", c);"
        );
    }
    text + "}\n"
}

fn seeds(c: &mut Criterion) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut group = c.benchmark_group("compile seeds");
    for file in SEEDS {
        let text = std::fs::read_to_string(root.join(file)).expect("a seed shader");
        group.bench_function(file, |b| b.iter(|| compile(&text)));
        let text = format!("#include \"stdosl.h\"\n{text}");
        group.bench_function(format!("{file} with stdosl.h"), |b| b.iter(|| compile(&text)));
    }
    group.finish();
}

fn lengths(c: &mut Criterion) {
    let kinds: [Kind; 9] = [
        ("straight", straight),
        ("functions", functions),
        ("branches", branches),
        ("nested", nested),
        ("params", params),
        ("expressions", expressions),
        ("arrays", arrays),
        ("chain", chain),
        ("calls", calls),
    ];
    for (name, text) in kinds {
        let mut group = c.benchmark_group(format!("compile {name}"));
        group.sampling_mode(SamplingMode::Flat).sample_size(10);
        for lines in LENGTHS {
            let text = text(lines);
            group.throughput(Throughput::Elements(text.lines().count() as u64));
            group.bench_with_input(BenchmarkId::from_parameter(lines), &text, |b, text| {
                b.iter(|| compile(text))
            });
        }
        group.finish();
    }
}

criterion_group!(benches, seeds, lengths);
criterion_main!(benches);
