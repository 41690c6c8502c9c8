//! The limits of `running`; whether a point reaches them depends on this point only.

use crate::{Folder, Said, Tripped, shader};
use osl_limits::Row;

pub(crate) const TRIPPED: Tripped = &[
    ("running.point_steps", point_steps),
    ("running.point_memory", point_memory),
    ("running.memory", memory),
    ("running.frame_bytes", frame_bytes),
    ("running.printed_bytes", printed_bytes),
    ("running.closure_bytes", closure_bytes),
    ("running.xml_bytes", xml_bytes),
    ("running.xml_attributes", xml_attributes),
    ("running.xml_found", xml_found),
    ("running.trace", trace),
    ("running.traces", traces),
    ("running.tried_steps", tried_steps),
    ("running.xml_cache_bytes", xml_cache_bytes),
    ("running.string_bytes", string_bytes),
    ("running.regex_bytes", regex_bytes),
    ("running.regex_retries", regex_retries),
    ("running.messages", |_| messages("running.messages=3")),
    ("running.message_bytes", |_| messages("running.message_bytes=30")),
    ("running.points", points),
    ("running.measured_pixels", measured_pixels),
    ("running.book_pictures", book_pictures),
];

/// A shader with one output.
fn body(text: &str) -> Folder {
    shader(&format!("shader a(output float o = 0) {{ {text} }}\n"))
}

/// Runs `a.osl` on 4 × 4 points.
fn run(folder: &Folder, more: &[&str]) -> Said {
    folder.run(&[&["a.osl", "-g", "4x4"], more].concat())
}

const LOOP: &str = "for (int i = 0; i < 100000000; i++)";

fn point_steps(row: &Row) {
    let few = body("for (int i = 0; i < 100; i++) o += sin(u * i);");
    run(&few, &[]).succeeds();
    run(&few, &["--limit", "running.point_steps=500"]).fails_with(row);
    run(&few, &["--max-steps", "500"]).fails_with(row);
    // Each of these does much work in one step of the shader, which counts as several steps; otherwise a
    // point would take minutes.
    let knots = "float k[2000]; k[int(u * 9)] = v;";
    for text in [
        &format!("{LOOP} o += sin(u * i);") as &str,
        &format!("{knots} {LOOP} o += splineinverse(\"linear\", u * i, k);"),
        &format!(
            "string r[2000]; string s = format(\"%g\", u); for (int i = 0; i < 9; i++) s = concat(s, \"a\", s); {LOOP} o += split(s, r, \"a\") + i * u;"
        ),
        &format!("int e; {LOOP} {{ gettextureinfo(format(\"a%d<UDIM>\", i), \"exists\", e); o += e + u; }}"),
        &format!(
            "string x = \"<b>\"; string y = \"</b>\"; for (int i = 0; i < 6; i++) {{ x = concat(x, x); y = concat(y, y); }} int d = dict_find(concat(\"<a>\", x, y, \"</a>\"), \"/a\"); {LOOP} o += dict_find(d, \"//b//b//b//b\") + i * u;"
        ),
        &format!("int r[2000]; {LOOP} o += regex_search(format(\"%g\", u + i), r, \"(a)\");"),
        &format!("{LOOP} o += regex_search(\"abc\", format(\"\\\\pL{{1,20}}%d%g\", i, u));"),
        &format!(
            "closure color c = diffuse(N); for (int j = 0; j < 20; j++) c = c + u * diffuse(N); {LOOP} o += strlen(format(\"%s\", c));"
        ),
        &format!(
            "float k[400]; float q[400]; k[int(u * 9)] = v; {LOOP} {{ setmessage(format(\"a%d\", 0 * i), k); getmessage(format(\"a%d\", 0 * i), q); o += q[int(u * 9)]; }}"
        ),
        "float x[30000]; x[int(u * 9)] = u; o = x[int(v * 9)];",
    ] {
        run(&body(text), &["--limit", "running.point_steps=20000"]).fails_with(row);
    }
    // Code without loops counts too.
    let mut straight = String::new();
    (0..200).for_each(|_| straight += "o += noise(\"gabor\", P * o, \"bandwidth\", 8.0);\n");
    run(&body(&straight), &["--limit", "running.point_steps=20000"]).fails_with(row);
    // A shader with much work, which ends, is within the default limits.
    run(&body("float x = 0; float y = 0; for (int i = 0; i < 10000; i++) { float t = x * x - y * y + u; y = 2 * x * y + v; x = t; if (x > 2) x = 0; } o = x;"), &[]).succeeds();
}

fn point_memory(row: &Row) {
    let low = ["--limit", "running.point_memory=100k"];
    for text in [
        "string s = format(\"%g\", u); for (int i = 0; i < 16; i++) s = concat(s, s); o = strlen(s);",
        "for (int i = 0; i < 5000; i++) setmessage(format(\"m%d\", i), u);",
        "for (int i = 0; i < 5000; i++) printf(\"%g\\n\", u);",
        "closure color c = diffuse(N); for (int i = 0; i < 500; i++) c = c + u * diffuse(N); o = !c;",
        // A sum that is added to itself: it would be long in expanded form.
        "closure color c = u * diffuse(N); for (int i = 0; i < 40; i++) c = c + c; o = !c;",
        "string x = \"<b/>\"; for (int i = 0; i < 12; i++) x = concat(x, x); o = dict_find(concat(\"<r>\", x, format(\"%g\", u), \"</r>\"), \"/r\");",
    ] {
        run(&body(text), &low).fails_with(row);
    }
}

fn memory(row: &Row) {
    let arrays = body("float x[50000]; x[int(u * 9)] = u; o = x[int(v * 9)];");
    for threads in ["1", "16"] {
        run(&arrays, &["--threads", threads]).succeeds();
        // Points are run one by one if necessary.
        let one = ["--threads", threads, "--limit", "running.memory=300k"];
        run(&arrays, &[&one[..], &["--arithmetic", "strict"]].concat()).succeeds();
        run(&arrays, &[&one[..], &["--arithmetic", "f64"]].concat()).fails_with(row);
    }
}

fn frame_bytes(row: &Row) {
    let array = shader("shader a(output float o[1000] = {0}) { o[int(u * 9)] = u; }");
    run(&array, &[]).succeeds();
    run(&array, &["--limit", "running.frame_bytes=100k"]).fails_with(row);
    array.run(&["a.osl", "--histogram"]).fails_with(row);
    // Without a file, no values are kept, except those of the points that are computed at the time.
    array.run(&["a.osl", "-g", "128x128", "--limit", "running.frame_bytes=20M"]).succeeds();
    array
        .run(&["a.osl", "-g", "128x128", "--limit", "running.frame_bytes=20M", "--histogram"])
        .fails_with(row);
    let big = shader("shader a(output float o[100000] = {0}) { o[int(u * 9)] = u; }");
    big.run(&["a.osl", "-g", "128x128", "-o", "a.exr"]).fails_with(row);
    assert!(!big.path().join("a.exr").exists());
}

fn printed_bytes(row: &Row) {
    let prints = body("for (int i = 0; i < 10; i++) printf(\"%g\\n\", u);");
    // A million points would print too much; a few do not.
    for batch in ["1", "16", "64"] {
        for threads in ["1", "2"] {
            run(&prints, &["--batch", batch, "--threads", threads, "--limit", "running.printed_bytes=10k"])
                .fails_with(row);
        }
    }
    run(&prints, &["--limit", "running.printed_bytes=12k"]).succeeds();
}

fn closure_bytes(row: &Row) {
    let material = shader("surface a() { Ci = u * diffuse(N) + v * reflection(N); }");
    run(&material, &["--closures"]).succeeds();
    run(&material, &["--closures", "--limit", "running.closure_bytes=500"]).fails_with(row);
    // Only some rows are in memory at a time, and none for the weights.
    let large = ["a.osl", "-g", "64x512", "--limit"];
    material.run(&[&large[..], &["running.closure_bytes=256k", "--closures"]].concat()).succeeds();
    material.run(&[&large[..], &["running.closure_bytes=1", "-o", "a.exr"]].concat()).succeeds();
}

/// A shader that builds the text of an XML document with this number of elements.
fn searches(count: u32) -> Folder {
    body(&format!(
        "string x = \"<b/>\"; for (int i = 0; i < {count}; i++) x = concat(x, x); int n = dict_find(concat(\"<r>\", x, \"</r>\"), \"/r/b\"); int k = 0; while (n != 0) {{ n = dict_next(n); k++; }} o = k;"
    ))
}

/// Checks that the error is reported as one of the shader, which continues.
#[track_caller]
fn tells(said: &Said, row: &Row) {
    assert!(said.err.contains(row.error), "{}", said.err);
}

fn xml_bytes(row: &Row) {
    tells(&run(&searches(6), &["--limit", "running.xml_bytes=100"]), row);
    let file = Folder::with(&[
        ("d.xml", "<a><b/></a>".repeat(20).as_bytes()),
        ("a.osl", b"shader a(output float o = 0) { o = dict_find(\"d.xml\", \"/a\"); }"),
    ]);
    assert!(run(&file, &["--limit", "running.xml_bytes=100"]).err.contains("100 bytes"));
}

fn xml_attributes(row: &Row) {
    let many = body(
        "string x = \"<a\"; for (int i = 0; i < 20; i++) x = concat(x, format(\" b%d=''\", i)); o = dict_find(concat(x, \"/>\"), \"/a\");",
    );
    run(&many, &[]).succeeds();
    tells(&run(&many, &["--limit", "running.xml_attributes=10"]), row);
}

fn xml_found(_: &Row) {
    let count = |limit: &str| run(&searches(6), &["--limit", limit]).out;
    assert!(count("running.xml_found=16k").contains("64 to 64"));
    assert!(count("running.xml_found=10").contains("10 to 10"));
}

fn book_pictures(_: &Row) {
    let folder = body("float a = u; a = v; a = 2 * u; o = a;");
    let left_out = |more: &[&str]| {
        folder.run(&[&["picture-book", "a.osl", "-o", "a.html", "-g", "4x4"], more].concat()).succeeds();
        std::fs::read_to_string(folder.path().join("a.html")).unwrap().contains("left out")
    };
    assert!(!left_out(&[]) && left_out(&["--limit", "running.book_pictures=1"]));
}

fn xml_cache_bytes(_: &Row) {
    let text = "for (int i = 0; i < 6; i++) { int n = dict_find(format(\"<a k='%d'/>\", i % 3), \"/a\"); int k = 0; dict_value(n, \"k\", k); o += k; }";
    assert!(run(&body(text), &["--limit", "running.xml_cache_bytes=1"]).out.contains("6 to 6"));
}

/// Strings that are joined at compile time are cut in the same way as in a run.
fn string_bytes(_: &Row) {
    for text in [
        "string s = format(\"%g\", 2 + u - u); o = strlen(concat(s, \"bcd\", \"efg\", \"h\"));",
        "o = strlen(concat(\"a\", \"bcd\", \"efg\", \"h\"));",
        "o = strlen(format(\"%s%g\", \"abcdef\", u - u + 77));",
    ] {
        assert!(run(&body(text), &[]).out.contains("8 to 8"), "{text}");
        let cut = run(&body(text), &["--limit", "running.string_bytes=7"]);
        assert!(cut.out.contains("7 to 7"), "{text}: {}", cut.out);
    }
}

fn regex_bytes(row: &Row) {
    let search = body("o = regex_search(\"abc\", \"[a-z]{20}|b\");");
    assert!(run(&search, &[]).out.contains("1 to 1"));
    tells(&run(&search, &["--limit", "running.regex_bytes=100"]), row);
}

fn regex_retries(_: &Row) {
    let search = body("o = regex_search(\"aaaaaaaaaab\", \"(a+)\\\\1b\");");
    assert!(run(&search, &[]).out.contains("1 to 1"));
    assert!(run(&search, &["--limit", "running.regex_retries=1"]).out.contains("0 to 0"));
}

fn messages(limit: &str) {
    let many = body("for (int i = 0; i < 20; i++) warning(\"number %d of 20\", i);");
    let count = |more: &[&str]| run(&many, more).err.matches("of 20").count();
    // Five messages of a line are shown, and the others counted.
    assert_eq!(count(&[]), 5);
    assert!(run(&many, &[]).err.contains("and 15 other messages of this line"));
    assert!((1..4).contains(&count(&["--limit", limit])), "{limit}");
}

fn points(row: &Row) {
    let few = body("o = u;");
    run(&few, &[]).succeeds();
    let limit = ["--limit", "running.points=15"];
    run(&few, &limit).fails_with(row);
    few.run(&["testshade", "-g", "4", "4", "a", limit[0], limit[1]]).fails_with(row);
    few.run(&["stability", "a.osl", "--points", "4x4", limit[0], limit[1]]).fails_with(row);
}

fn measured_pixels(row: &Row) {
    let limit = ["--limit", "running.measured_pixels=15"];
    body("o = u;").run(&["tradeoff", "a.osl", "-g", "4x4", limit[0], limit[1]]).fails_with(row);
}

fn trace(row: &Row) {
    let folder = shader("shader a(output float o = 0) { for (int i = 0; i < 100; i++) o += sin(u + i); }");
    let args = ["explain", "a.osl", "--at", "0,0", "-g", "2x2"];
    assert!(!folder.run(&args).out.contains(row.error));
    let limited = folder.run(&[&args[..], &["--limit", "running.trace=50"]].concat());
    assert!(limited.out.contains(row.error), "{}: {}", row.name, limited.out);
}

fn traces(_: &Row) {
    let unstable = body("o = (u + 100000) - 100000;");
    let lines = |limit: &str| {
        let said =
            unstable.run(&["stability", "a.osl", "--points", "4x4", "--budget", "600", "--limit", limit]);
        said.succeeds();
        said.out.len()
    };
    assert!(lines("running.traces=0") < lines("running.traces=1M"));
}

fn tried_steps(row: &Row) {
    let long = shader(
        "shader a(float p = 1, output float o = 0) { for (int i = 0; i < 300; i++) o = sin(o + u * p); }",
    );
    let limit = ["--limit", "running.tried_steps=500"];
    let args = ["stability", "a.osl", "--points", "4x4", "--budget", "600", limit[0], limit[1]];
    let said = long.run(&args);
    said.succeeds();
    let told: Vec<&str> = said.out.lines().filter(|line| line.contains(row.error)).collect();
    assert!(matches!(told[..], [line] if line.contains("no other setting was tried")), "{}", said.out);
    // As given it is short.
    let longer = shader(
        "shader a(float p = 1, output float o = 0) { for (int i = 0; i < p * 300; i++) o = sin(o + u); }",
    );
    let args =
        ["stability", "a.osl", "--points", "4x4", "--budget", "600", "--limit", "running.tried_steps=9000"];
    let said = longer.run(&args);
    said.succeeds();
    assert!(said.out.contains("p: ") && said.out.contains("stops the run"), "{}", said.out);
}

/// Programs that exceed a limit at some points, or that would exceed it for a few points together.
const DEPENDS: [&str; 6] = [
    "string s = format(\"%g %g\", u, v); while (strlen(s) < 20000) s = concat(s, s); o = strlen(s);",
    "float x[2000]; x[int(u * 9)] = v; string s = format(\"%g %g\", u, v); while (strlen(s) < 15000) s = concat(s, s); o = x[0];",
    "for (int i = 0; i < int(u * v * 500); i++) o += sin(u * i);",
    "int me = int(u * 15 + 0.5); for (int k = 0; k < 16; k++) if (k == me) for (int i = 0; i < 50; i++) o += noise(P * i);",
    "for (int i = 0; i < int(u * 12); i++) printf(\"%g %g\\n\", u, v);",
    "closure color c = u * diffuse(N); for (int i = 0; i < int(v * 9); i++) c = c + u * diffuse(N); o = strlen(format(\"%s\", c));",
];

#[test]
fn a_verdict_depends_on_the_point_alone() {
    for text in DEPENDS {
        let folder = body(text);
        for (steps, memory) in [("1M", "16M"), ("3000", "16M"), ("1M", "50k"), ("20k", "150k")] {
            let said = |batch: &str, threads: &str, isa: &str| {
                let (steps, memory) =
                    (format!("running.point_steps={steps}"), format!("running.point_memory={memory}"));
                let limits = ["--limit", &steps, "--limit", &memory, "--limit", "running.printed_bytes=20k"];
                let how = ["--batch", batch, "--threads", threads, "--isa", isa];
                let said = folder.run(&[&["a.osl", "-g", "20x13"], &limits[..], &how[..]].concat());
                (said.code, said.out, said.err)
            };
            let expected = said("1", "1", "baseline");
            for (batch, threads) in [("16", "2"), ("256", "1"), ("256", "2")] {
                assert!(
                    said(batch, threads, "baseline") == expected,
                    "{text}: {batch} {threads}: {expected:?}"
                );
            }
        }
    }
}
