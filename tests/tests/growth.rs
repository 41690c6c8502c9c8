//! Twice the input takes twice the time: sixty shapes of input, each at a size, twice and four times
//! that size.
//!
//! The program that `OSLRUN` names reads each input, so that everything from the command line to the last
//! message is measured: `cargo build --release -p oslrun`, then
//! `OSLRUN=$PWD/target/release/oslrun cargo test -p osl-tests --test growth -- --ignored --nocapture`.
//! `SHAPE=name` selects shapes by the start of their names, `SCALE=0.1` makes all smaller. A shape fails if
//! four times the input takes more than ten times the time or memory, beyond half a second or 100 MB: then a
//! step is quadratic in its input. Each run ends within 5 s and 500 MB.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "a test says what must hold")]

use std::fmt::Write;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A shape of input: its name, the command, its size, and a function that generates the file for a size.
struct Shape {
    name: &'static str,
    args: &'static str,
    size: usize,
    text: fn(usize) -> String,
}

const fn shape(name: &'static str, args: &'static str, size: usize, text: fn(usize) -> String) -> Shape {
    Shape { name, args, size, text }
}

fn lines(n: usize, line: impl Fn(usize) -> String) -> String {
    (0..n).fold(String::new(), |mut all, i| {
        let _ = writeln!(all, "{}", line(i));
        all
    })
}

fn body(text: &str) -> String {
    format!("shader a(output float o = 0) {{\n{text}\n}}\n")
}

/// Loops within loops, of two rounds each.
fn nest(depth: usize) -> String {
    body(&(lines(depth, |i| format!("for (int i{i} = 0; i{i} < 2; i{i}++)")) + "o += u;"))
}

const CHECK: &str = "check a.osl";
const RUN: &str = "a.osl -g 1x1";
const COMPILED: &str = "a.oso -g 1x1";
const OSO: &str = "OpenShadingLanguage 1.00\nshader a\noparam\tfloat\to\t0\t\t%read{0,1} %write{0,0}\nconst\tfloat\t$c\t1\n";

const SHAPES: &[Shape] = &[
    // Macros and the preprocessor.
    shape("macro_parameters", CHECK, 50_000, |n| {
        let names: Vec<String> = (0..n).map(|i| format!("p{i}")).collect();
        format!("#define F({0}) p0\n{1}", names.join(","), body("o = u;"))
    }),
    shape("macro_body", CHECK, 50_000, |n| format!("#define F {}\n{}", "u + ".repeat(n), body("o = u;"))),
    shape("macro_definitions", CHECK, 50_000, |n| {
        lines(n, |i| format!("#define M{i} {i}")) + &body("o = M1;")
    }),
    shape("macro_redefinitions", CHECK, 50_000, |n| lines(n, |i| format!("#define M {i}")) + &body("o = M;")),
    shape("macro_pasting", CHECK, 4_000, |n| {
        format!("#define X(a) {}a\n{}", "a ## ".repeat(n), body("float X(b) = 1; o = 1;"))
    }),
    shape("macro_strings", CHECK, 20_000, |n| {
        format!("#define S(x) #x\n{}", body(&lines(n, |i| format!("printf(S(a b {i}));"))))
    }),
    shape("line_numbers", CHECK, 40_000, |n| {
        format!("#define L(x) __LINE__ + x\n{}", body(&lines(n, |_| "o = L(\n__LINE__);".to_string())))
    }),
    shape("conditionals", CHECK, 50_000, |n| {
        lines(n, |_| "#if 1\n#else\n#endif".to_string()) + &body("o = u;")
    }),
    shape("open_conditionals", CHECK, 50_000, |n| "#if 1\n".repeat(n)),
    shape("skipped_text", CHECK, 200_000, |n| {
        format!("#if 0\n{}#endif\n{}", "a ' b \" c\n".repeat(n), body("o = u;"))
    }),
    shape("nowarn", CHECK, 40_000, |n| body(&lines(n, |_| "#pragma osl nowarn\no = o;".to_string()))),
    // Tokens.
    shape("quotes", CHECK, 200_000, |n| body(&format!("{}\n", "'\\".repeat(n)))),
    shape("open_strings", CHECK, 100_000, |n| body(&"\"\n".repeat(n))),
    shape("comments", CHECK, 500_000, |n| "/* x */".repeat(n) + &body("o = u;")),
    shape("nested_comments", CHECK, 500_000, |n| format!("{} */ {}", "/* ".repeat(n), body("o = u;"))),
    shape("joined_strings", CHECK, 100_000, |n| body(&format!("printf({});", "\"ab\" ".repeat(n)))),
    shape("blank_lines", CHECK, 2_000_000, |n| "\n".repeat(n) + &body("o = u;")),
    shape("one_line", CHECK, 40_000, |n| body(&"o = o; ".repeat(n))),
    shape("repeated_names", CHECK, 50_000, |n| {
        format!(
            "#define N {}\n{}",
            "n".repeat(500),
            body(&format!("float N = 1;{}", "N += N;".repeat(n / 4)))
        )
    }),
    // Broken files.
    shape("open_parentheses", CHECK, 50_000, |n| {
        body(&format!("{} {{ {} }}", "( ".repeat(n), "; ".repeat(n)))
    }),
    shape("open_lists", CHECK, 50_000, |n| body(&format!("float x[2] = {}", "{ ".repeat(n)))),
    shape("brackets", CHECK, 50_000, |n| body(&"( } ".repeat(n))),
    shape("unknown_names", CHECK, 40_000, |n| {
        body(&lines(n, |i| format!("float known{i} = 1; o = knwon{i};")))
    }),
    shape("unknown_fields", CHECK, 40_000, |n| {
        let fields = lines(n, |i| format!("float f{i};"));
        format!(
            "struct S {{ {fields} }};\n{}",
            body(&format!("S s; {}", lines(n, |i| format!("o = s.g{i};"))))
        )
    }),
    // Declarations.
    shape("fields", CHECK, 40_000, |n| {
        let fields = lines(n, |i| format!("float f{i};"));
        format!(
            "struct S {{ {fields} }};\n{}",
            body(&format!("S s; {}", lines(n, |i| format!("o = s.f{i};"))))
        )
    }),
    shape("fields_run", RUN, 8_000, |n| {
        let fields = lines(n, |i| format!("float f{i};"));
        format!(
            "struct S {{ {fields} }};\n{}",
            body(&format!("S s; {}", lines(n, |i| format!("s.f{i} = u; o += s.f{i};"))))
        )
    }),
    shape("structs_in_structs", CHECK, 60, |n| {
        let structs = lines(n, |i| format!("struct S{} {{ S{i} x; }};", i + 1));
        format!("struct S0 {{ float x; }};\n{structs}{}", body("o = u;"))
    }),
    shape("struct_calls", RUN, 10, |n| {
        let structs = lines(12, |i| format!("struct S{} {{ S{i} a, b; }};", i + 1));
        format!(
            "struct S0 {{ float x; }};\n{structs}S12 f(S12 x) {{ return x; }}\n{}",
            body(&format!("S12 y; y = {}y{}; o = u;", "f(".repeat(n), ")".repeat(n)))
        )
    }),
    shape("parameters", RUN, 10_000, |n| {
        let list: Vec<String> = (0..n).map(|i| format!("float p{i} = {i}")).collect();
        format!("shader a({}, output float o = 0) {{ o = p1; }}", list.join(", "))
    }),
    shape("metadata", "info a.osl", 40_000, |n| {
        let list: Vec<String> = (0..n).map(|i| format!("int m{i} = {i}")).collect();
        format!("shader a [[ {} ]] (output float o = 0) {{ o = u; }}", list.join(", "))
    }),
    shape("overloads", CHECK, 5_000, |n| {
        let functions = lines(250, |i| format!("float f(float a[{}]) {{ return a[0]; }}", i + 1));
        functions + &body(&format!("float a[200];\n{}", lines(n, |_| "o += f(a);".to_string())))
    }),
    shape("functions", CHECK, 20_000, |n| {
        lines(n, |i| format!("float f{i}(float x) {{ return x; }}"))
            + &body(&lines(n, |i| format!("o += f{i}(u);")))
    }),
    shape("initialisers", CHECK, 100_000, |n| {
        body(&format!("float x[1000000] = {{ 1{} }};", ", 1".repeat(n)))
    }),
    // Statements.
    shape("sum", RUN, 20_000, |n| body(&format!("o = u{};", " + v".repeat(n.min(200)))) + &"// \n".repeat(n)),
    shape("comma_chain", RUN, 20_000, |n| body(&format!("o = (u{});", ", v".repeat(n)))),
    shape("statements", RUN, 20_000, |n| body(&lines(n, |i| format!("o += {i}.5 * u;")))),
    shape("branches", RUN, 5_000, |n| body(&lines(n, |i| format!("if (u > {i}) o += v;")))),
    shape("returns", RUN, 2_500, |n| body(&lines(n, |i| format!("if (u > {i} + o) return;")))),
    shape("loops", RUN, 1_000, |n| {
        body(&lines(n, |i| format!("for (int i = 0; i < {}; i++) o += u * i;", i % 7)))
    }),
    shape("written_in_branches", RUN, 1_000, |n| {
        let declared = lines(n, |i| format!("float x{i} = 0;"));
        let written = lines(n, |i| format!("x{i} = v;"));
        let read = lines(n, |i| format!("o += x{i};"));
        body(&format!("{declared}{}{written}{}{read}", "if (u > o) {\n".repeat(100), "}\n".repeat(100)))
    }),
    shape("messages", RUN, 5_000, |n| body(&lines(n, |i| format!("setmessage(\"m{i}\", u);")))),
    shape("message_reads", RUN, 5_000, |n| body(&lines(n, |i| format!("getmessage(\"m{i}\", o);")))),
    shape("computed_strings", RUN, 10_000, |n| {
        body(&format!(
            "string s = \"a\";{} o = strlen(s);",
            lines(n, |_| "s = concat(substr(s, 1), \"b\");".to_string())
        ))
    }),
    shape("textures", RUN, 2_000, |n| {
        body(&lines(n, |i| format!("o += (float)texture(\"t{i}.exr\", u, v);")))
    }),
    shape("noises", RUN, 2_000, |n| body(&lines(n, |i| format!("o += noise(P * {i});")))),
    // Lints.
    shape("self_assignments", CHECK, 40_000, |n| body(&lines(n, |_| "o = o;".to_string()))),
    shape("unused", CHECK, 40_000, |n| body(&lines(n, |i| format!("float x{i} = u;")))),
    shape("uninitialised", CHECK, 10_000, |n| {
        body(&lines(n, |i| format!("float x{i}; if (u > v) x{i} = 1; o += x{i};")))
    }),
    // Other commands.
    shape("fmt", "fmt --check a.osl", 20_000, |n| body(&lines(n, |i| format!("o+=sin(u*{i})+cos(v );")))),
    shape("fmt_long", "fmt --check a.osl", 10_000, |n| {
        body(&format!("o = max({});", "u + v * ".repeat(n) + "1"))
    }),
    shape("compile", "compile a.osl", 20_000, |n| body(&lines(n, |i| format!("o += sin(u * {i});")))),
    shape("compile_one_line", "compile a.osl", 20_000, |n| body(&"o += sin(u);".repeat(n))),
    shape("explain", "explain a.osl --at 0,0 -g 2x2", 5_000, |n| {
        body(&lines(n, |i| format!("o += {i}.5 * u;")))
    }),
    shape("explain_elements", "explain a.osl --at 0,0 -g 2x2", 5_000, |n| {
        body(&format!("float x[100000]; for (int i = 0; i < {n}; i++) x[i] = u; o = x[3];"))
    }),
    shape("explain_nest", "explain a.osl --at 0,0 -g 2x2", 45, nest),
    shape("sanitize_nest", "sanitize a.osl -g 2x2", 45, nest),
    shape("stability_nest", "stability a.osl -g 2x2", 45, nest),
    shape("bounds_nest", "bounds a.osl --tiles 1", 25, nest),
    shape("oso_operations", COMPILED, 20_000, |n| {
        format!("{OSO}code ___main___\n{}\tend\n", "\tassign\to $c\n".repeat(n))
    }),
    shape("oso_symbols", COMPILED, 50_000, |n| {
        format!(
            "{OSO}{}code ___main___\n\tassign\to $c\n\tend\n",
            lines(n, |i| format!("local\tfloat\tx{i}"))
        )
    }),
    shape("oso_sections", COMPILED, 5_000, |n| {
        let params = lines(n, |i| format!("param\tfloat\tp{i}\t0\t\t%initexpr"));
        let codes = lines(n, |i| format!("code p{i}\n\tassign\tp{i} $c"));
        format!("{OSO}{params}{codes}code ___main___\n\tassign\to $c\n\tend\n")
    }),
    shape("group_connections", "a.group -g 1x1", 20_000, |n| {
        "shader s A ;\nshader s B ;\n".to_string() + &"connect A.o B.a ;\n".repeat(n)
    }),
    shape("group_layers", "a.group -g 1x1", 500, |n| {
        lines(n, |i| format!("shader s L{i} ;")) + &lines(n - 1, |i| format!("connect L{i}.o L{}.a ;", i + 1))
    }),
    shape("group_values", "a.group -g 1x1", 20_000, |n| "param float a 1 ;\n".repeat(n) + "shader s A ;\n"),
];

/// Time in seconds and memory in megabytes of one run.
fn measured(shape: &Shape, size: usize) -> (f64, u64) {
    let folder = tempfile::tempdir().unwrap();
    let name = shape.args.split(' ').find(|word| word.starts_with("a.")).unwrap();
    std::fs::write(folder.path().join(name), (shape.text)(size)).unwrap();
    std::fs::write(folder.path().join("s.osl"), "shader s(float a = 0, output float o = 0) { o = a + u; }")
        .unwrap();
    let start = Instant::now();
    let mut child = Command::new(std::env::var("OSLRUN").unwrap())
        .current_dir(folder.path())
        .args(shape.args.split(' '))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let now =
            status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
        most = most.max(now.unwrap_or(0));
        if start.elapsed() > Duration::from_secs(120) {
            let _ = child.kill();
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    (start.elapsed().as_secs_f64(), most / 1024)
}

#[test]
#[ignore = "measures the program that OSLRUN names"]
fn time_and_memory_grow_with_the_input() {
    let only = std::env::var("SHAPE").unwrap_or_default();
    let scale: f64 = std::env::var("SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0);
    let mut bad = Vec::new();
    for shape in SHAPES.iter().filter(|shape| shape.name.starts_with(&only)) {
        let size = ((shape.size as f64 * scale) as usize).max(2);
        let [a, b, c] = [1, 2, 4].map(|times| measured(shape, times * size));
        let steep = c.0 > 0.5 + 10.0 * a.0 || c.1 > 100 + 10 * a.1;
        let large = scale == 1.0 && (c.0 > 5.0 || c.1 > 500);
        let mark = if steep || large { "  <-- too much" } else { "" };
        println!(
            "{:<22} {:>9} {:6.2} s {:6.2} s {:6.2} s {:6} MB {:5} MB {:5} MB{mark}",
            shape.name, size, a.0, b.0, c.0, a.1, b.1, c.1
        );
        if steep || large {
            bad.push(shape.name);
        }
    }
    assert!(bad.is_empty(), "{bad:?}");
}
