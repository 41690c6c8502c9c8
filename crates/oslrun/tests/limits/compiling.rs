//! The limits of `compiling`.

use crate::{Folder, Tripped, shader};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[
    ("compiling.overloads", overloads),
    ("compiling.struct_depth", struct_depth),
    ("compiling.index_depth", index_depth),
    ("compiling.call_depth", call_depth),
    ("compiling.nested_jumps", nested_jumps),
    ("compiling.jump_depth", jump_depth),
    ("compiling.values", values),
    ("compiling.variables", variables),
    ("compiling.name_bytes", name_bytes),
    ("compiling.array_words", array_words),
    ("compiling.joins", joins),
    ("compiling.folded_bytes", folded_bytes),
    ("compiling.written_operations", written_operations),
    ("compiling.written_symbols", written_symbols),
    ("compiling.findings", findings),
    ("compiling.watched", watched),
    ("compiling.marked", marked),
];

/// Checks that a run succeeds without changes, and fails with the error of the row for a smaller limit.
fn run(row: &Row, folder: &Folder, limit: u64) {
    folder.run(&["a.osl", "-g", "2x2"]).succeeds();
    folder.run(&["a.osl", "-g", "2x2", "--limit", &format!("{}={limit}", row.name)]).fails_with(row);
}

fn body(text: &str) -> Folder {
    shader(&format!("shader a(output float o = 0) {{ {text} }}"))
}

fn overloads(row: &Row) {
    let functions =
        "float f(int x) { return 1; } float f(float x) { return 2; } float f(color x) { return 3; }";
    run(row, &shader(&format!("{functions} shader a(output float o = 0) {{ o = f(u); }}")), 2);
}

fn findings(row: &Row) {
    let folder = body("float a = 1; float b = 2; float c = 3; o = u;");
    let count = |n: u64| {
        let said = folder.run(&["check", "a.osl", "--limit", &format!("{}={n}", row.name)]);
        said.err.matches("warning[").count()
    };
    assert!(count(row.default) >= 3, "{}", count(row.default));
    assert_eq!(count(1), 1);
}

fn watched(row: &Row) {
    let folder = body("float a; float b; o = a + b;");
    let count = |n: u64| {
        let said = folder.run(&["check", "a.osl", "--limit", &format!("{}={n}", row.name)]);
        said.err.matches("warning[").count()
    };
    assert_eq!(count(row.default), count(1) + 1);
}

fn marked(row: &Row) {
    let folder = body("float a[4]; o = a[int(u) + 3];");
    let args = ["testshade", "--debuguninit", "-g", "1", "1", "-o", "o", "null", "a"];
    let said = |n: u64| folder.run(&[&args[..], &["--limit", &format!("{}={n}", row.name)]].concat()).err;
    assert!(said(4).contains("uninitialized"), "{}", said(4));
    assert!(!said(3).contains("uninitialized"), "{}", said(3));
}

fn struct_depth(row: &Row) {
    let structs = "struct A { float x; }; struct B { A a; }; struct C { B b; };";
    run(
        row,
        &shader(&format!("{structs} shader a(output float o = 0) {{ C c; c.b.a.x = u; o = c.b.a.x; }}")),
        2,
    );
}

fn index_depth(row: &Row) {
    run(row, &body("int i[3] = {0, 1, 2}; i[i[i[0]]] += 1; o = i[0];"), 1);
}

fn call_depth(row: &Row) {
    let functions =
        "float f(float x) { return x; } float g(float x) { return f(x); } float h(float x) { return g(x); }";
    run(row, &shader(&format!("{functions} shader a(output float o = 0) {{ o = h(u); }}")), 2);
}

const JUMPS: &str =
    "if (u > 0.9) return; o += 1; if (v > 0.9) return; o += 2; if (u + v > 1) return; o += 4;";

/// The program differs, its results do not.
fn laid_out_otherwise(row: &Row, text: &str, limit: &str) {
    let folder = body(text);
    let limit = format!("{}={limit}", row.name);
    let both = |args: &[&str]| {
        let limited: Vec<&str> = args.iter().copied().chain(["--limit", &limit]).collect();
        (folder.run(args).out, folder.run(&limited).out)
    };
    let (usual, limited) = both(&["ir", "a.osl", "--stage", "before"]);
    assert!(!usual.is_empty() && usual != limited, "{}", row.name);
    let picture = || std::fs::read(folder.path().join("a.exr")).unwrap();
    folder.run(&["a.osl", "-g", "4x4", "-o", "a.exr"]).succeeds();
    let usual = picture();
    folder.run(&["a.osl", "-g", "4x4", "-o", "a.exr", "--limit", &limit]).succeeds();
    assert!(usual == picture(), "{}", row.name);
}

fn nested_jumps(row: &Row) {
    laid_out_otherwise(row, JUMPS, "1");
}

fn jump_depth(row: &Row) {
    laid_out_otherwise(row, JUMPS, "0");
}

fn values(row: &Row) {
    run(row, &body("o = sin(u) + cos(v) * 2;"), 20);
    // Detected before the elements become values: twelve arrays of a million elements would take gigabytes.
    let arrays = format!(
        "shader a(float x[1048576] = {{0}}, output float o = 0) {{ printf(\"{}\"{}); o = u; }}",
        "%g".repeat(12),
        ", x".repeat(12)
    );
    let printed = shader(&arrays).run(&["a.osl", "-g", "1x1"]);
    printed.fails_with(row);
}

fn variables(row: &Row) {
    run(row, &body("float x = u; float y = v; o = x + y;"), 10);
}

fn name_bytes(row: &Row) {
    run(row, &body(&format!("float {} = u; o = v;", "x".repeat(2000))), 1000);
}

fn array_words(row: &Row) {
    run(row, &body("float x[100]; x[int(u * 9)] = v; o = x[3];"), 99);
}

fn joins(row: &Row) {
    run(row, &body("float x = 0; if (u > 0.5) { if (v > 0.5) { x = 1; } } o = x;"), 1);
}

fn folded_bytes(row: &Row) {
    let folder = body("string s = concat(\"one\", \"two\"); o = strlen(s) + u;");
    let limit = format!("{}=2", row.name);
    let after = |more: &[&str]| {
        let args = ["ir", "a.osl", "--stage", "after"];
        folder.run(&args.iter().chain(more).copied().collect::<Vec<_>>()).out
    };
    let (usual, limited) = (after(&[]), after(&["--limit", &limit]));
    assert!(!usual.contains("concat") && limited.contains("concat"), "{}:\n{usual}\n{limited}", row.name);
}

/// Checks that writing a compiled shader succeeds without changes, and fails for a smaller limit.
fn compile(row: &Row, text: &str, limit: u64) {
    let folder = body(text);
    folder.run(&["compile", "a.osl"]).succeeds();
    folder.run(&["compile", "a.osl", "--limit", &format!("{}={limit}", row.name)]).fails_with(row);
}

fn written_operations(row: &Row) {
    compile(row, "o = sin(u); o += cos(v); o *= 2;", 2);
}

fn written_symbols(row: &Row) {
    let text = "float x = u; float y = v; o = x + y;";
    compile(row, text, 3);
}
