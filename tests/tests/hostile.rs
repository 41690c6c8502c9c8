//! Sources that are written to exhaust the compiler: each compiles, or fails with the error for its excess.
//!
//! This test measures no times; a case fails if it does not end, or overflows the stack. [`real_runs`]
//! measures the time and the memory of the program itself.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "a test says what must hold"
)]

use osl::stages;
use osl_syntax::render::{RenderStyle, render};
use osl_syntax::{NoFiles, Options};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

thread_local! {
    /// Whether the program itself reads the sources instead.
    static REAL: Cell<bool> = const { Cell::new(false) };
}

/// Runs the program that `OSLRUN` names on every source here and shows the seconds and the largest resident
/// memory of each: `cargo build --release -p oslrun`, then
/// `OSLRUN=$PWD/target/release/oslrun cargo test -p osl-tests --test hostile -- --ignored --nocapture`.
///
/// Each ends within a second and 200 MB on a machine that does nothing else. The memory is what Linux keeps
/// of a process that runs; elsewhere it shows as 0.
#[test]
#[ignore = "measures the program that OSLRUN names"]
fn real_runs() {
    REAL.set(true);
    for test in [
        macros,
        long_arrays_and_large_structs,
        nesting,
        chains,
        a_million_errors,
        long_lines,
        large_declarations,
        overloads,
        multiplied,
        squares,
        runs_that_would_not_end,
    ] {
        test();
    }
}

/// The codes of the errors that the program shows for a source.
fn real(name: &str, text: &str) -> BTreeSet<&'static str> {
    let program = std::env::var("OSLRUN").expect("OSLRUN names the program");
    let dir = tempfile::tempdir().unwrap();
    let (file, said) = (dir.path().join("hostile.osl"), dir.path().join("said"));
    std::fs::write(&file, text).unwrap();
    let start = Instant::now();
    let mut child = Command::new(program)
        .current_dir(dir.path())
        .arg("hostile.osl")
        .stdout(Stdio::null())
        .stderr(std::fs::File::create(&said).unwrap())
        .spawn()
        .unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        most = resident(child.id()).unwrap_or(0).max(most);
        if start.elapsed() > Duration::from_secs(20) {
            child.kill().unwrap();
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    let seconds = start.elapsed().as_secs_f64();
    println!("{name:<32} {seconds:6.2} s {:6} MB {:9} bytes", most / 1000, text.len());
    assert!(seconds <= 1.0 && most <= 200_000, "{name}: {seconds:.2} s, {} MB", most / 1000);
    let said = String::from_utf8_lossy(&std::fs::read(said).unwrap()).into_owned();
    let codes = said.split("error[").skip(1).filter_map(|rest| rest.get(..5));
    codes.map(|code| &*code.to_string().leak()).collect()
}

/// The peak resident memory of a process, in thousands of bytes.
fn resident(id: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024 / 1000)
}

/// The codes of the errors, and the number of problems, up to and including lowering, lints and rendering.
fn errors(name: &str, text: &str) -> BTreeSet<&'static str> {
    if REAL.get() {
        return real(name, text);
    }
    let start = std::time::Instant::now();
    let checked = stages::check("hostile.osl", text, &NoFiles, &Options::default());
    let mut list = checked.diagnostics.clone();
    let read = start.elapsed();
    list.extend(stages::lint(&checked, &osl_hir::lint::Options::default()));
    let linted = start.elapsed();
    if let Some(program) = &checked.program {
        list.extend(osl_lower::lower(program, &Default::default()).err().unwrap_or_default());
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

/// Checks that there are exactly these codes of errors.
fn ends(name: &str, text: &str, codes: &[&'static str]) {
    let found = errors(name, text);
    let expected: BTreeSet<&str> = codes.iter().copied().collect();
    if REAL.get() {
        // The program stops at the first step that fails.
        assert!(found.is_subset(&expected) && found.is_empty() == expected.is_empty(), "{name}: {found:?}");
    } else {
        assert_eq!(found, expected, "{name}");
    }
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
        ("elses", wrap("if (u > 0) r = 1; else { ", "r = 2;", "}")),
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
        ("elses", "if (u > 0) r = 1; else ".repeat(n / 10) + "r = 2;"),
        ("returns", "if (u > r) return;\n".repeat(n / 10)),
        ("returns from the other branch", "if (u > r) r = 1; else return;\n".repeat(n / 10)),
        ("breaks", format!("while (u > r) {{ {} }}", "if (u > r) { r += 1; break; } ".repeat(n / 10))),
        ("exits", "if (u > r) exit();\n".repeat(n / 10)),
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
    ends("brackets without partners", &shader(&"( } ".repeat(n / 10)), &["E0110", "E0111"]);
    ends("stray characters", &shader(&"$".repeat(n)), &["E0101", "E0120"]);
    // Each with another name, because a name is reported once.
    let unknown: String = (0..n / 12).map(|i| format!("r = unknwon{i};\n")).collect();
    assert!(errors("unknown names", &shader(&unknown)).contains("E0120"));
    for (name, line) in [("bad operands", "r = u + \"a\";"), ("directives", "#foo")] {
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
    let declared = format!("float {} = 1; r = {}b;", "a".repeat(60_000), "a".repeat(59_999));
    ends("a long name beside another", &shader(&declared), &["E0201"]);
    ends("a long string", &shader(&format!("r = \"{}\";", "x".repeat(1_000_000))), &["E0302"]);
    ends("a long number", &shader(&format!("r = {};", "1".repeat(1_000_000))), &["E0104"]);
    ends("a long fraction", &shader(&format!("r = 0.{};", "1".repeat(1_000_000))), &[]);
    ends(
        "many on one line",
        &shader(&(0..100_000).map(|i| format!("r = x{i}; ")).collect::<String>()),
        &["E0120", "E0201"],
    );
}

#[test]
fn large_declarations() {
    let parameters = |n: usize| {
        let list: Vec<String> = (0..n).map(|i| format!("float p{i} = {i}")).collect();
        format!("shader s({}) {{}}", list.join(", "))
    };
    ends("parameters", &parameters(100_000), &[]);
    ends("500,000 parameters", &parameters(500_000), &["E0016"]);
    ends("a million parameters", &parameters(1_000_000), &["E0017"]);
    let metadata: Vec<String> = (0..100_000).map(|i| format!("int m{i} = {i}")).collect();
    ends("metadata", &format!("shader s [[ {} ]] () {{}}", metadata.join(", ")), &[]);
    let text = "x".repeat(1_000_000);
    ends("a long datum", &format!("shader s [[ string help = \"{text}\" ]] () {{}}"), &[]);
    let structs = lines(100_000, |i| format!("struct S{i} {{ float x; }};"));
    ends("structs", &format!("{structs}{}", shader("S0 a; S99999 b; r = 1;")), &[]);
    let functions = lines(50_000, |i| format!("float f{i}(float x) {{ return x; }}"));
    let fields: String = (0..100_000).map(|i| format!("float a{i};")).collect();
    ends("fields", &format!("struct S {{ {fields} }};\n{}", shader("S a; r = a.a99999;")), &[]);
    ends("functions", &format!("{functions}{}", shader("r = f0(f49999(u));")), &[]);
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

/// A short text that expands to a very long one.
#[test]
fn multiplied() {
    let structs = lines(16, |i| format!("struct S{} {{ S{i} a; S{i} b; }};", i + 1));
    let structs = format!("struct S0 {{ float x; }};\n{structs}S16 f(S16 x) {{ return x; }}\n");
    let calls = shader(&format!("S16 y; y = {}y{}; r = u;", "f(".repeat(40), ")".repeat(40)));
    ends("nested calls of large structs", &format!("{structs}{calls}"), &["E0601"]);
    let long = "n".repeat(60_000);
    let names = lines(12, |i| format!("struct S{} {{ S{i} a, {long}; }};", i + 1));
    let names = format!("struct S0 {{ float x; }};\n{names}{}", shader("S12 a; r = u;"));
    ends("long names of fields", &names, &["E0601"]);
    let chain = lines(100_000, |i| format!("struct S{} {{ S{i} x; }};", i + 1));
    let chain = format!("struct S0 {{ float x; }};\n{chain}{}", shader("S100000 a; r = 1;"));
    assert!(errors("a chain of structs", &chain).contains("E0310"));
    ends("a message of a long array", &shader("float k[1000000]; setmessage(\"a\", k);"), &["E0601"]);
    let (declared, written) =
        (lines(30_000, |i| format!("float a{i};")), lines(30_000, |i| format!("a{i} = u;")));
    let deep = format!("{declared}{}{written}{}", "if (u > r) {".repeat(90), "}".repeat(90));
    ends("variables in deep branches", &shader(&deep), &["E0601"]);
    let name = "x".repeat(1_000_000);
    ends("a long name, repeated", &format!("#define N {name}\n{}", shader(&"N; ".repeat(100))), &["E0016"]);
    let text = shader(&format!("r = 1; {}", "printf(S);".repeat(100)));
    ends("a long string, repeated", &format!("#define S \"{name}\"\n{text}"), &["E0016"]);
    ends(
        "a long string, joined",
        &format!("#define S \"{name}\"\n{}", shader(&"S ".repeat(100))),
        &["E0016"],
    );
    let file = format!("#line 1 \"{name}\"\n{}", shader(&"printf(__FILE__); ".repeat(10_000)));
    ends("a long name of a file", &file, &["E0014"]);
    let fold = "s = concat(substr(s, 1), \"b\");".repeat(1_000);
    let fold =
        shader(&format!("string s = \"aaaaaaaa\"; {} {fold} r = strlen(s);", "s = concat(s, s);".repeat(17)));
    ends("strings computed while compiling", &fold, &[]);
}

/// Inputs for which a step could be quadratic.
#[test]
fn squares() {
    let n = 100_000;
    assert!(!errors("quotes", &shader(&"'\\".repeat(n))).is_empty());
    assert!(!errors("open lists", &shader(&format!("float a[2] = {}", "{".repeat(n)))).is_empty());
    let open = format!("{} {{ {} }}", "( ".repeat(n), "; ".repeat(n));
    assert!(!errors("semicolons among open parentheses", &shader(&open)).is_empty());
    let parameters: Vec<String> = (0..n).map(|i| format!("p{i}")).collect();
    ends("macro parameters", &format!("#define F({}) p0\n{}", parameters.join(","), shader("r = u;")), &[]);
    let counted = "r = L(\n__LINE__);\n".repeat(n / 10);
    ends("line numbers", &format!("#define L(x) __LINE__ + x\n{}", shader(&counted)), &[]);
    ends("findings on one line", &shader(&"r = r; ".repeat(n / 4)), &[]);
    ends("silenced findings", &shader(&"#pragma osl nowarn\nr = r;\n".repeat(n / 4)), &[]);
    let fields: String = (0..n / 4).map(|i| format!("float f{i};")).collect();
    let read: String = (0..n / 4).map(|i| format!("r = s.f{i};")).collect();
    ends(
        "fields of a wide struct",
        &format!("struct S {{ {fields} }};\n{}", shader(&format!("S s; {read}"))),
        &[],
    );
    let messages = lines(n / 4, |i| format!("setmessage(\"m{i}\", u);"));
    ends("messages", &shader(&messages), &[]);
}

/// Sources that compile, and would run endlessly or fill the memory. Their messages are tested with the
/// program itself.
#[test]
fn runs_that_would_not_end() {
    for (name, body) in [
        ("endless", "while (1) r += 1;"),
        ("endless, varying", "while (u >= 0) r += 1;"),
        ("endless, busy", "while (u >= 0) r += noise(P * r) + noise(\"gabor\", P + r) + pow(sin(r), u);"),
        ("endless within endless", "while (u >= 0) for (int i = 0; u > -1; ++i) r += noise(P * i);"),
        ("endless lookups", "while (u >= 0) r += float(texture(\"missing.png\", u + r, v)) + 1;"),
        (
            "endless gabor noise",
            "while (u >= 0) { r += noise(\"gabor\", P + r, \"bandwidth\", 8, \"impulses\", 32); }",
        ),
        ("endless printf", "while (u >= 0) printf(\"%g %g\\n\", u, r);"),
        ("endless error", "while (u >= 0) { r += 1; error(\"%g %g\", u, r); }"),
        ("endless warning", "while (u >= 0) { r += 1; warning(\"%g %g\", u, r); }"),
        ("endless fprintf", "while (u >= 0) fprintf(\"x.txt\", \"%g\\n\", u);"),
        ("fprintf outside", "fprintf(\"../x.txt\", \"%g\\n\", u);"),
        (
            "strings doubled",
            "string a = \"ab\"; for (int i = 0; i < 60; ++i) a = concat(a, a); r = strlen(a);",
        ),
        (
            "strings doubled by point",
            "string a = format(\"%g %g\", u, v); for (int i = 0; i < 60; ++i) a = concat(a, a); r = strlen(a);",
        ),
        ("endless strings", "string a = \"\"; while (u >= 0) { a = format(\"%s%g\", a, r); r += 1; }"),
        (
            "endless regex",
            "string a = \"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\"; while (u >= 0) { r += regex_search(a, \"(a*)*b\"); }",
        ),
        (
            "endless look-ahead",
            "string a = \"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\"; while (u >= 0) { r += 1 + regex_search(format(\"%s%g\", a, u), \"(?=a)(a|aa)*\\\\1c\"); }",
        ),
        (
            "endless patterns",
            "while (u >= 0) { r += 1 + regex_search(\"abc\", format(\"a*(b|%g)*c\", u + v)); }",
        ),
        ("endless closures", "while (u >= 0) { Ci = Ci + diffuse(N); r += 1; }"),
        (
            "closures doubled",
            "closure color c = u * diffuse(N); for (int i = 0; i < 60; ++i) c += v * c; Ci = c;",
        ),
        (
            "closures nested",
            "closure color c = u * diffuse(N); for (int i = 0; i < 60; ++i) c = debug(\"c\", \"x\", c + c) + c; Ci = c;",
        ),
        (
            "closures layered",
            "closure color c = u * diffuse(N); for (int i = 0; i < 60; ++i) c = layer(c + c, c); Ci = c;",
        ),
        ("endless messages", "while (u >= 0) { setmessage(format(\"%g\", r), r); r += 1; }"),
        ("endless splits", "string w[100]; while (u >= 0) { r += split(format(\"%g a b c\", r), w); }"),
        (
            "endless indices",
            "float a[10]; int i = 0; while (u >= 0) { a[i * 1000003] = r; i += 1; r += a[i * 7919]; }",
        ),
        ("a long array", "float a[1000000]; int i = (int)(u * 999999); a[i] = v; r = a[999999 - i];"),
        (
            "many long arrays",
            "float a[1000000]; float b[1000000]; float c[1000000]; int i = (int)(u * 999999); a[i] = v; b[i] = u; c[i] = u; r = a[999999 - i] + b[5 * i] + c[i];",
        ),
        (
            "endless dictionaries",
            "while (u >= 0) { r += 1; r += dict_find(format(\"<a b='%g'/>\", r), \"a\"); }",
        ),
        ("endless splines", "float k[64]; while (u >= 0) { k[0] = r; r += 1 + spline(\"bspline\", u, k); }"),
    ] {
        errors(name, &format!("surface s(output float r = 0) {{\n{body}\n}}\n"));
    }
    let recursion = "float f(float x); float g(float x) { return f(x); } float f(float x) { return g(x); }";
    errors("recursion", &format!("{recursion}\n{}", shader("r = f(u);")));
}
