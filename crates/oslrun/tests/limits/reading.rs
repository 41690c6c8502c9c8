//! The limits of `reading`.

use crate::{Folder, Tripped, shader};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[
    ("reading.file_bytes", file_bytes),
    ("reading.source_bytes", source_bytes),
    ("reading.included_bytes", included_bytes),
    ("reading.include_depth", include_depth),
    ("reading.includes", includes),
    ("reading.expansion", expansion),
    ("reading.condition_depth", condition_depth),
    ("reading.tokens", tokens),
    ("reading.token_bytes", token_bytes),
    ("reading.nesting", nesting),
    ("reading.diagnostics", diagnostics),
    ("reading.recovery", recovery),
    ("reading.repair", repair),
    ("reading.group_words", group_words),
    ("reading.layers", layers),
    ("reading.oso_lines", oso_lines),
    ("reading.oso_depth", oso_depth),
    ("reading.oso_structs", oso_structs),
    ("reading.oso_elements", oso_elements),
    ("reading.oso_quoted", oso_quoted),
];

/// Checks that `check` succeeds without changes, and fails with the error of the row for a smaller limit.
fn check(row: &Row, folder: &Folder, file: &str, limit: u64) {
    folder.run(&["check", file]).succeeds();
    folder.run(&["check", file, "--limit", &format!("{}={limit}", row.name)]).fails_with(row);
}

fn file_bytes(row: &Row) {
    check(row, &shader("shader a(output float o = 0) { o = u; }"), "a.osl", 10);
}

fn source_bytes(row: &Row) {
    check(row, &shader("shader a(output float o = 0) { o = u; }"), "a.osl", 10);
}

fn included_bytes(row: &Row) {
    let source = "#include \"a.h\"\n#include \"a.h\"\nshader a(output float o = 0) { o = u; }\n";
    // The header of the language counts too.
    let header = "// a line of no use\n".repeat(5000);
    let folder = Folder::with(&[("a.osl", source.as_bytes()), ("a.h", header.as_bytes())]);
    check(row, &folder, "a.osl", 150_000);
}

fn include_depth(row: &Row) {
    let folder = Folder::with(&[
        ("a.osl", b"#include \"a.h\"\nshader a() {}"),
        ("a.h", b"#include \"b.h\"\n"),
        ("b.h", b"// nothing\n"),
    ]);
    check(row, &folder, "a.osl", 2);
}

fn includes(row: &Row) {
    let folder =
        Folder::with(&[("a.osl", b"#include \"a.h\"\n#include \"a.h\"\nshader a() {}"), ("a.h", b"")]);
    check(row, &folder, "a.osl", 1);
}

fn expansion(row: &Row) {
    check(row, &shader("#define A u + u + u + u\nshader a(output float o = 0) { o = A; }"), "a.osl", 4);
}

fn condition_depth(row: &Row) {
    check(row, &shader("#if ((((1))))\n#endif\nshader a() {}"), "a.osl", 3);
}

fn tokens(row: &Row) {
    check(row, &shader("shader a(output float o = 0) { o = u; }"), "a.osl", 10);
}

fn token_bytes(row: &Row) {
    let name = "x".repeat(1000);
    let source =
        format!("#define N {name}\nshader a(output float o = 0) {{ float N = 1; o = N + N + N + N; }}");
    check(row, &shader(&source), "a.osl", 4500);
}

fn nesting(row: &Row) {
    check(row, &shader("shader a(output float o = 0) { o = -(-(-(-(u)))); }"), "a.osl", 6);
}

fn diagnostics(row: &Row) {
    let unknown: String = (0..10).map(|i| format!("o = nobody{i};\n")).collect();
    let folder = shader(&format!("shader a(output float o = 0) {{ {unknown} }}"));
    folder.run(&["check", "a.osl", "--limit", "reading.diagnostics=3"]).fails_with(row);
}

fn recovery(row: &Row) {
    let folder = shader("shader a(output float o = 0) { o = = 1; o = u; o = * 2; }");
    let count = |args: &[&str]| folder.run(args).err.matches("error[E").count();
    let limited = count(&["check", "a.osl", "--limit", "reading.recovery=1"]);
    assert_eq!((count(&["check", "a.osl"]), limited), (2, 1), "{}", row.name);
}

fn repair(row: &Row) {
    let folder = shader("shader a(output float o = 0) { if (u > v { o = 1; } }");
    assert!(folder.run(&["a.osl", "-g", "2x2", "--repair"]).err.contains("repaired"));
    let limited = folder.run(&["a.osl", "-g", "2x2", "--repair", "--limit", "reading.repair=0"]);
    assert!(limited.code == 1 && !limited.err.contains("repaired"), "{}: {}", row.name, limited.err);
}

const GROUP: &str = "shader s A ;\nshader s B ;\nconnect A.o B.p ;\n";
const LAYER: &str = "shader s(float p = 0, output float o = 0) { o = p + u; }";

fn group() -> Folder {
    Folder::with(&[("g.group", GROUP.as_bytes()), ("s.osl", LAYER.as_bytes())])
}

fn group_words(row: &Row) {
    group().run(&["g.group", "-g", "2x2"]).succeeds();
    group().run(&["g.group", "-g", "2x2", "--limit", "reading.group_words=5"]).fails_with(row);
}

fn layers(row: &Row) {
    group().run(&["g.group", "-g", "2x2", "--limit", "reading.layers=1"]).fails_with(row);
}

/// A compiled shader of some lines of symbols and operations.
fn compiled(symbols: &str, code: &str) -> Folder {
    let head = "OpenShadingLanguage 1.00\nshader a\noparam\tfloat\to\t0\t\t%read{0,1} %write{0,0}\n";
    Folder::with(&[("a.oso", format!("{head}{symbols}code ___main___\n{code}\tend\n").as_bytes())])
}

/// The same with compiled shaders, which are run.
fn runs(row: &Row, folder: &Folder, limit: u64) {
    folder.run(&["a.oso", "-g", "2x2"]).succeeds();
    folder.run(&["a.oso", "-g", "2x2", "--limit", &format!("{}={limit}", row.name)]).fails_with(row);
}

fn oso_lines(row: &Row) {
    let folder = compiled("const\tfloat\tone\t1\n", "\tassign\to one\n\tassign\to one\n\tassign\to one\n");
    runs(row, &folder, 3);
}

fn oso_depth(row: &Row) {
    let code = "\tif\to 3 3\n\tif\to 3 3\n\tassign\to one\n";
    runs(row, &compiled("const\tfloat\tone\t1\n", code), 1);
}

fn oso_structs(row: &Row) {
    let symbols = "param\tstruct A\ts\t\t\nparam\tstruct B\ts.b\t\t%mystruct{s} %mystructfield{0}\n\
                   param\tfloat\ts.b.x\t1\t\t%mystruct{s.b} %mystructfield{0}\n";
    runs(row, &compiled(symbols, "\tassign\to s.b.x\n"), 1);
}

fn oso_elements(row: &Row) {
    let symbols = "const\tfloat[4]\tlist\t1 2 3 4\nconst\tint\tone\t1\n";
    runs(row, &compiled(symbols, "\taref\to list one\n"), 3);
}

fn oso_quoted(row: &Row) {
    let symbols = "const\tint\tnine\t9\nlocal\tfloat[2]\tlist\n";
    let folder = compiled(symbols, "\taref\to list nine\t%filename{\"far.osl\"} %line{90}\n");
    assert!(folder.run(&["a.oso", "-g", "2x2"]).err.contains("far.osl:90"));
    let limited = folder.run(&["a.oso", "-g", "2x2", "--limit", "reading.oso_quoted=80"]);
    assert!(limited.err.contains("a.oso:"), "{}: {}", row.name, limited.err);
}
