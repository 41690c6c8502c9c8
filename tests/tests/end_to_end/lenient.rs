//! What strict syntax refuses, and what it does by default: each has a meaning, and runs.

use osl::stages;
use osl_exec::RunOptions;
use osl_scene::Grid;
use osl_syntax::{NoFiles, Options};
use osl_tests::run;
use std::collections::BTreeSet;

/// The code of a check that strict syntax makes an error, a source, and the text that it prints by default.
const ALL: &[(&str, &str, &str)] = &[
    ("W0001", "#define A 1\n#define A 2\nshader s() { printf(\"%d\", A); }", "2"),
    ("W0002", "#warning take care\nshader s() { printf(\"%d\", 1); }", "1"),
    ("W0005", "/* one /* two */ shader s() { printf(\"%d\", 2); } // */", "2"),
    ("W0101", "float f() { return 3; }\n}\nshader s() { printf(\"%g\", f()); }", "3"),
    ("W0102", "shader s(string t = \"one\ntwo\") { printf(\"%s\", t); }", "one two"),
    ("W0103", "shader s() { float a[2] = { 4, 5, }; printf(\"%g %g\", a, max(1.0, 6.0,)); }", "4 5 6"),
    ("W0104", "float f() { return 7; };\nshader s() { printf(\"%g\", f()); };", "7"),
    (
        "E0310",
        "struct S { float w[2]; }; shader s() { S a[2]; a[1].w[0] = 8; printf(\"%g %g\", a[1].w, a[0].w); }",
        "8 0 0 0",
    ),
    (
        "E0310",
        "struct S { float w[2]; }; struct T { S a[2]; }; shader s() { T t; t.a[1].w[1] = 9; printf(\"%g %g\", t.a[1].w, t.a[0].w); }",
        "0 9 0 0",
    ),
    (
        "E0310",
        "struct S { float w[2]; }; float sum(S a[]) { return a[0].w[1] + 10 * a[1].w[1]; } shader s() { S a[2]; a[1].w[1] = 1; printf(\"%g\", sum(a)); }",
        "10",
    ),
];

fn errors(text: &str, strict: bool) -> Vec<&'static str> {
    let checked = stages::check("s.osl", text, &NoFiles, &Options { strict, ..Options::default() });
    checked.diagnostics.iter().filter(|d| d.is_error()).map(|d| d.code.id).collect()
}

#[test]
fn what_strict_syntax_alone_refuses_runs_by_default() {
    for (code, text, expected) in ALL {
        // Strict syntax does not join a string that is broken over lines.
        let refused = if *code == "W0102" { "E0102" } else { *code };
        assert!(errors(text, true).contains(&refused), "{code}: {:?}\n{text}", errors(text, true));
        assert!(errors(text, false).is_empty(), "{code}: {:?}\n{text}", errors(text, false));
        let frame = run::run("s.osl", text, &[], &Grid::new(1, 1), &RunOptions::default()).unwrap();
        let printed: String = frame.printed.iter().map(|p| p.text.as_str()).collect();
        assert_eq!(printed, *expected, "{code}: {text}");
        assert!(frame.messages.is_empty(), "{code}: {:?}", frame.messages);
    }
}

/// The words after a text in the sources of a crate.
fn after(krate: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut folders = vec![run::root().join("crates").join(krate).join("src")];
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let source = std::fs::read_to_string(&path).unwrap_or_default();
            let word = |rest: &str| {
                rest.split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap().to_string()
            };
            found.extend(source.split(text).skip(1).map(word));
        }
    }
    found
}

/// The list above has every check.
#[test]
fn every_check_of_strict_syntax_is_listed() {
    let listed: BTreeSet<&str> = ALL.iter().map(|(code, ..)| *code).collect();
    let quirks: BTreeSet<String> = after("osl-syntax", "quirk(strict, ")
        .iter()
        .map(|name| name.to_lowercase().replace('_', "-"))
        .collect();
    let of_quirks: BTreeSet<String> = osl_syntax::errors::CODES
        .iter()
        .filter(|code| listed.contains(code.id))
        .map(|code| code.name.to_string())
        .collect();
    assert_eq!(quirks, of_quirks);
    // Arrays within arrays.
    assert_eq!(after("osl-hir", "ast.strict").len(), 1);
}
