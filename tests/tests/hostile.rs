//! Sources written to exhaust the compiler: each ends, with the error that names its excess, or compiles.
//!
//! Nothing here is timed; a case that does not end, or overflows the stack, is what fails.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options};
use oslrun::pipeline;
use std::collections::BTreeSet;

/// The codes of the errors, and how many problems there are, up to and with lowering, lints and rendering.
fn errors(name: &str, text: &str) -> BTreeSet<&'static str> {
    let start = std::time::Instant::now();
    let checked = pipeline::check("hostile.osl", text, &NoFiles, &Options::default());
    let mut list = checked.diagnostics.clone();
    let read = start.elapsed();
    list.extend(pipeline::lint(&checked, &osl_ir::lint::Options::default()));
    let linted = start.elapsed();
    if let Some(program) = &checked.program {
        list.extend(osl_ir::lower::lower(program, &Default::default()).err().unwrap_or_default());
    }
    let lowered = start.elapsed();
    let shown = render(&list, &checked.sources, RenderStyle::default());
    println!(
        "{name}: {} bytes, read {read:.0?}, linted {:.0?}, lowered {:.0?}, rendered {:.0?} in {} bytes",
        text.len(),
        linted - read,
        lowered - linted,
        start.elapsed() - lowered,
        shown.len()
    );
    assert!(list.len() <= 400, "{name}: {} problems", list.len());
    assert!(shown.len() <= 1 << 20, "{name}: {} bytes of messages", shown.len());
    list.iter().filter(|d| d.is_error()).map(|d| d.code.id).collect()
}

/// Expects exactly these codes of errors.
fn ends(name: &str, text: &str, codes: &[&'static str]) {
    assert_eq!(errors(name, text), codes.iter().copied().collect(), "{name}");
}

fn shader(body: &str) -> String {
    format!("shader s(output float r = 0) {{\n{body}\n}}\n")
}

/// `n` lines, each made from its number.
fn lines(n: usize, line: impl Fn(usize) -> String) -> String {
    (0..n).map(|i| line(i) + "\n").collect()
}

#[test]
fn macros() {
    let doubling = lines(64, |i| format!("#define M{} M{i} + M{i}", i + 1));
    ends("doubling", &format!("#define M0 u\n{doubling}{}", shader("r = M64;")), &["E0014"]);
    let arguments = lines(64, |i| format!("#define A{}(x) A{i}(x x)", i + 1));
    ends("doubling arguments", &format!("#define A0(x) x\n{arguments}{}", shader("r = A64(u);")), &["E0014"]);
    let chain = lines(100_000, |i| format!("#define C{} C{i}", i + 1));
    ends("chain", &format!("#define C0 u\n{chain}{}", shader("r = C100000;")), &[]);
    let itself = shader("#define f(x) f(f(x)) f(f(x))\nr = f(f(f(f(u))));");
    assert!(!errors("itself", &itself).is_empty());
}

#[test]
fn long_arrays_and_large_structs() {
    ends("2^31 - 1 elements", &shader("int a[2147483647];"), &["E0309"]);
    ends("2^31 elements", &shader("float a[2147483648];"), &["E0116"]);
    ends("2^32 elements", &shader("float a[4294967296];"), &["E0104", "E0116"]);
    ends("a parameter", "shader s(float a[2147483647] = {}) {}", &["E0309"]);
    let doubling = lines(64, |i| format!("struct S{} {{ S{i} a, b; }};", i + 1));
    let doubling = format!("struct S0 {{ float x; }};\n{doubling}");
    ends("doubling struct", &format!("{doubling}{}", shader("S64 a; S64 b[2]; r = 1;")), &["E0310"]);
    ends("wide struct in an array", &format!("{doubling}{}", shader("S18 a[1000];")), &["E0309", "E0310"]);
    let again = lines(64, |_| "struct A { A0 x; B a, b; };".to_string());
    let again = format!("struct A0 {{ float x; }};\nstruct B {{ float x; }};\n{again}");
    ends("struct again", &format!("{again}{}", shader("A a; r = a.x.x;")), &["E0202"]);
    let many = lines(2_000, |i| format!("float a{i}[1000000]; a{i}[0] = u;"));
    ends("many long arrays", &shader(&many), &["E0601"]);
}

#[test]
fn nesting() {
    let n = 100_000;
    let wrap = |open: &str, inner: &str, close: &str| format!("{}{inner}{}", open.repeat(n), close.repeat(n));
    for (name, body) in [
        ("parentheses", format!("r = {};", wrap("(", "u", ")"))),
        ("minus signs", format!("r = {};", wrap("- ", "u", ""))),
        ("calls", format!("r = {};", wrap("sin(", "u", ")"))),
        ("constructors", format!("r = {};", wrap("float(", "u", ")"))),
        ("casts", format!("r = {};", wrap("(float)", "u", ""))),
        ("blocks", wrap("{", "r = 1;", "}")),
        ("ifs", wrap("if (u > 0) ", "r = 1;", "")),
        ("elses", wrap("if (u > 0) r = 1; else ", "r = 2;", "")),
        ("loops", wrap("while (u > 0) ", "r = 1;", "")),
        ("for loops", wrap("for (;;) ", "r = 1;", "")),
        ("do loops", wrap("do ", "r = 1;", " while (0);")),
        ("ternaries", format!("r = {};", wrap("u > 0 ? 1 : ", "2", ""))),
        ("ternary middles", format!("r = {};", wrap("u > 0 ? ", "2", " : 1"))),
        ("assignments", format!("{};", wrap("r = ", "1", ""))),
        ("indices", format!("int a[2]; r = {};", wrap("a[", "0", "]"))),
        ("lists", format!("float a[2] = {};", wrap("{", "0", "}"))),
        ("functions", wrap("void f() {", "", "}")),
        ("powers", format!("r = {};", wrap("pow(u, ", "1", ")"))),
    ] {
        let found = errors(name, &shader(&body));
        let known = ["E0113", "E0110", "E0111", "E0112", "E0016", "E0120"];
        assert!(!found.is_empty() && found.iter().all(|code| known.contains(code)), "{name}: {found:?}");
    }
}

#[test]
fn chains() {
    let n = 100_000;
    for (name, body) in [
        ("a sum", format!("r = u{};", " + v".repeat(n))),
        ("a comparison", format!("r = 1{};", " < 2".repeat(n))),
        ("conjunctions", format!("r = u > 0{};", " && v > 0".repeat(n))),
        ("a comma list", format!("r = (u{});", ", v".repeat(n))),
        ("elements of elements", format!("matrix m = 1; r = m{};", "[0]".repeat(n))),
        ("members of members", format!("r = P{};", ".x".repeat(n))),
        ("statements", "r += 1;\n".repeat(n)),
        ("semicolons", ";".repeat(10 * n)),
        ("declarations", format!("float a0{};", (1..n).map(|i| format!(", a{i}")).collect::<String>())),
        ("arguments", format!("r = pow(u{});", ", v".repeat(n))),
        ("options", format!("r = texture(\"a\", u, v{});", ", \"blurr\", 1".repeat(n))),
        ("a format", format!("printf(\"{}\"{});", "%d ".repeat(n), ", u".repeat(n))),
        ("a list", format!("float a[2] = {{ 0{} }};", ", 1".repeat(n))),
    ] {
        errors(name, &shader(&body));
    }
}

#[test]
fn a_million_errors() {
    let n = 1_000_000;
    assert!(!errors("keywords", &shader(&"if\n".repeat(n))).is_empty());
    assert!(!errors("strings", &shader(&"\"\n".repeat(n))).is_empty());
    ends("closers", &shader(&")\n".repeat(n)), &["E0110"]);
    ends("stray characters", &shader(&"$".repeat(n)), &["E0101", "E0120"]);
    for (name, line) in
        [("unknown names", "r = unknwon;"), ("bad operands", "r = u + \"a\";"), ("directives", "#foo")]
    {
        let text = shader(&format!("{line}\n").repeat(n / line.len()));
        assert!(errors(name, &text).contains("E0120"), "{name}");
    }
    ends("warnings", &shader(&"{ int i = 1.5; r = i; }\n".repeat(n / 24)), &[]);
}

#[test]
fn long_lines() {
    let blank = " ".repeat(10_000_000);
    ends("a name at the end", &shader(&format!("{blank}r = unknown;")), &["E0201"]);
    ends("a long name", &shader(&format!("r = {};", "x".repeat(1_000_000))), &["E0201"]);
    ends("a long string", &shader(&format!("r = \"{}\";", "x".repeat(1_000_000))), &["E0302"]);
    ends("a long number", &shader(&format!("r = {};", "1".repeat(1_000_000))), &["E0104"]);
    ends("a long fraction", &shader(&format!("r = 0.{};", "1".repeat(1_000_000))), &[]);
    ends("many on one line", &shader(&"r = x; ".repeat(100_000)), &["E0120", "E0201"]);
}

#[test]
fn large_declarations() {
    let parameters = |n: usize| {
        let list: Vec<String> = (0..n).map(|i| format!("float p{i} = {i}")).collect();
        format!("shader s({}) {{}}", list.join(", "))
    };
    ends("parameters", &parameters(100_000), &[]);
    ends("a million parameters", &parameters(1_000_000), &["E0016"]);
    let metadata: Vec<String> = (0..100_000).map(|i| format!("int m{i} = {i}")).collect();
    ends("metadata", &format!("shader s [[ {} ]] () {{}}", metadata.join(", ")), &[]);
    let text = "x".repeat(1_000_000);
    ends("a long datum", &format!("shader s [[ string help = \"{text}\" ]] () {{}}"), &[]);
    let structs = lines(100_000, |i| format!("struct S{i} {{ float x; }};"));
    ends("structs", &format!("{structs}{}", shader("S0 a; S99999 b; r = 1;")), &[]);
    let functions = lines(100_000, |i| format!("float f{i}(float x) {{ return x; }}"));
    ends("functions", &format!("{functions}{}", shader("r = f0(f99999(u));")), &[]);
}

#[test]
fn overloads() {
    let one = |i: usize| format!("float f(float a[{}]) {{ return a[0]; }}", i + 1);
    ends("257 overloads", &format!("{}{}", lines(257, one), shader("r = 1;")), &["E0208"]);
    ends("many overloads", &format!("{}{}", lines(50_000, one), shader("r = 1;")), &["E0120", "E0208"]);
    let calls = lines(20_000, |_| "r += f(a);".to_string());
    let text = format!("{}{}", lines(256, one), shader(&format!("float a[200];\n{calls}")));
    ends("calls of overloads", &text, &[]);
    let noise = format!("r = {}u{};", "noise(".repeat(200), ")".repeat(200));
    errors("noise of noise", &shader(&noise));
    let struct_calls =
        "struct A { float x; }; struct B { float x; }; float f(A a) { return 1; } float f(B b) { return 1; }";
    let lists = format!("r = {}u{};", "f({".repeat(100), "})".repeat(100));
    ends("lists of calls", &format!("{struct_calls} {}", shader(&lists)), &["E0402"]);
    let doubling = "float f(output float x) { x += 1; return x; }";
    let twice = format!("float a[2]; r = {}0{};", "f(a[int(".repeat(40), ")])".repeat(40));
    ends("outputs of outputs", &format!("{doubling} {}", shader(&twice)), &["E0308"]);
    let compound = format!("int a[2]; r = {}0{};", "a[".repeat(40), "] += 1".repeat(40));
    ends("steps of steps", &shader(&compound), &["E0308"]);
    let calls = lines(40, |i| format!("float g{}(float x) {{ return g{i}(x) + g{i}(x); }}", i + 1));
    let calls = format!("float g0(float x) {{ return x + 1; }}\n{calls}{}", shader("r = g40(u);"));
    ends("doubling calls", &calls, &["E0601"]);
    let operators = "float __operator__add__(float a, float b) { return a - b; }";
    errors("operators", &format!("{operators} {}", shader(&format!("r = u{};", " + v".repeat(200)))));
}
